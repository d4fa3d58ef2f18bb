//! Repair of what can be repaired without guessing; what cannot is left as it is, for the check to report.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::orient::{OrientReport, orient};
use crate::topology::{all_sides, by_edge, has_repeated_vertex};
use crate::weld::weld_within;
use crate::{Surface, Vec3};

/// Vertices nearer than this share of the diagonal of the bounding box are welded unless the caller says otherwise: 0.3 µm on
/// a forearm, far below what a skin resolves and far above the rounding of coordinates written with seven digits.
pub const DEFAULT_WELD_TOLERANCE: f64 = 1e-6;

/// The height of a triangle over its longest edge, as a share of that edge, below which it has no area. Its normal would be
/// rounding error.
pub(crate) const FLAT_HEIGHT: f64 = 1e-9;

/// Rounds of resolving flat triangles. Each halves a fan of collinear corners at least; more would go in circles.
const MAX_ROUNDS: usize = 32;

/// What a repair may do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RepairOptions {
    /// Distance below which vertices are welded, as a share of the diagonal of the bounding box; 0 welds only what is at
    /// exactly the same place.
    pub weld_tolerance: f64,
    /// Whether to move the centre of the bounding box to the origin.
    pub recentre: bool,
}

impl Default for RepairOptions {
    fn default() -> Self {
        Self {
            weld_tolerance: DEFAULT_WELD_TOLERANCE,
            recentre: false,
        }
    }
}

/// What a repair did.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct RepairReport {
    /// Vertices that were merged into another.
    pub n_welded: usize,
    /// Triangles with a repeated vertex or without area that were dropped, or resolved by turning an edge.
    pub n_degenerate: usize,
    /// Triangles dropped because another has the same three vertices.
    pub n_duplicate: usize,
    /// Vertices dropped because no triangle uses them.
    pub n_unused: usize,
    /// What was turned.
    pub orientation: OrientReport,
    /// What was added to every point, if the surface was recentred. m
    pub moved_by: Option<[f64; 3]>,
}

impl RepairReport {
    /// Whether the repair changed anything.
    pub fn is_changed(&self) -> bool {
        let n = self.n_welded + self.n_degenerate + self.n_duplicate + self.n_unused;
        n + self.orientation.n_flipped > 0 || self.moved_by.is_some()
    }
}

/// A repaired copy: vertices welded, triangles without area and doubles dropped, winding made consistent and outward
/// (see [`orient`]), unused vertices dropped.
///
/// Holes, edges of three and more triangles, self-intersections and vertices that are not finite stay: whether to
/// fill, cut or move is not for us to guess.
pub fn repair(surface: &Surface, options: &RepairOptions) -> (Surface, RepairReport) {
    let diagonal = used_bounds(surface).map_or(0.0, |(lo, hi)| (hi - lo).norm());
    let welded = weld_within(surface, options.weld_tolerance * diagonal).surface;
    let n_welded = surface.points.len() - welded.points.len();
    let mut surface = welded;

    let n_degenerate = drop_degenerate(&mut surface);
    let n_duplicate = drop_duplicates(&mut surface);
    let orientation = orient(&mut surface);
    let n_unused = drop_unused(&mut surface);
    let moved_by = options.recentre.then(|| recentre(&mut surface)).flatten();
    let report = RepairReport {
        n_welded,
        n_degenerate,
        n_duplicate,
        n_unused,
        orientation,
        moved_by,
    };
    (surface, report)
}

/// Smallest and largest coordinates of the vertices that are used and finite.
pub(crate) fn used_bounds(surface: &Surface) -> Option<(Vec3, Vec3)> {
    let mut used = surface
        .triangles
        .iter()
        .flatten()
        .map(|&v| surface.points[v as usize]);
    let is_finite = |p: &Vec3| p.iter().all(|x| x.is_finite());
    let first = used.find(is_finite)?;
    Some(
        used.filter(is_finite)
            .fold((first, first), |(lo, hi), p| (lo.inf(&p), hi.sup(&p))),
    )
}

/// What is wrong with the shape of a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Flaw {
    /// A vertex stands in it twice.
    RepeatedVertex,
    /// Its corners lie on one line; the side given is the longest, as the number of its first corner.
    Flat { longest: usize },
}

/// The flaw of a triangle, if it has one. A triangle with a corner that is not finite has none of these.
pub(crate) fn flaw(surface: &Surface, t: usize) -> Option<Flaw> {
    if has_repeated_vertex(surface.triangles[t]) {
        return Some(Flaw::RepeatedVertex);
    }
    let [a, b, c] = surface.corners(t);
    let length_sq = [
        (b - a).norm_squared(),
        (c - b).norm_squared(),
        (a - c).norm_squared(),
    ];
    let longest = (0..3).max_by(|&i, &j| length_sq[i].total_cmp(&length_sq[j]))?;
    // |cross| = longest · height ≤ ratio · longest².
    let is_flat = (b - a).cross(&(c - a)).norm() <= FLAT_HEIGHT * length_sq[longest];
    (is_flat && length_sq[longest].is_finite()).then_some(Flaw::Flat { longest })
}

/// Drops triangles without area. One that a neighbour needs to stay connected to the rest (its corners lie on a line, and its
/// longest side has exactly one neighbour) is not dropped, which would leave a slit: the longest side is turned instead, so
/// that the neighbour is split at the middle corner.
fn drop_degenerate(surface: &mut Surface) -> usize {
    let before = surface.triangles.len();
    surface.triangles.retain(|&t| !has_repeated_vertex(t));
    let mut n = before - surface.triangles.len();
    // Turning one edge may make the next triangle flat, where several corners lie on one line: so it is done in rounds, each
    // of which turns edges that do not touch, until there is nothing left to do or nothing more can be done.
    for _ in 0..MAX_ROUNDS {
        let flat: Vec<(usize, usize)> = (0..surface.triangles.len())
            .filter_map(|t| match flaw(surface, t) {
                Some(Flaw::Flat { longest }) => Some((t, longest)),
                _ => None,
            })
            .collect();
        if flat.is_empty() {
            break;
        }
        let n_done = resolve_flat(surface, &flat);
        n += n_done;
        if n_done == 0 {
            break;
        }
    }
    n
}

/// Drops or turns what it can of the flat triangles, given with their longest sides; returns how many.
fn resolve_flat(surface: &mut Surface, flat: &[(usize, usize)]) -> usize {
    let mut on_edge: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
    for sides in by_edge(&all_sides(surface)) {
        on_edge.insert(sides[0].edge, sides.iter().map(|s| s.triangle).collect());
    }
    let mut is_touched = vec![false; surface.triangles.len()];
    let mut is_dropped = vec![false; surface.triangles.len()];
    let mut is_flat = vec![false; surface.triangles.len()];
    for &(t, _) in flat {
        is_flat[t] = true;
    }
    let mut n_done = 0;
    for &(t, longest) in flat {
        if is_touched[t] {
            continue;
        }
        // a → b is the longest side, m the corner between its ends.
        let [a, b, m] = [0, 1, 2].map(|k| surface.triangles[t][(longest + k) % 3]);
        let others: Vec<u32> = on_edge[&[a.min(b), a.max(b)]]
            .iter()
            .copied()
            .filter(|&o| o as usize != t)
            .collect();
        match others[..] {
            [o] => {
                let o = o as usize;
                let Some(far) = surface.triangles[o].into_iter().find(|&v| v != a && v != b) else {
                    continue;
                };
                let is_known = on_edge.contains_key(&[far.min(m), far.max(m)]);
                if is_touched[o] || is_flat[o] || far == m || is_known {
                    continue;
                }
                // The neighbour keeps its winding: each half is the neighbour with one end of the side moved to m.
                let moved = |from: u32| surface.triangles[o].map(|v| if v == from { m } else { v });
                let halves = [moved(a), moved(b)];
                surface.triangles[o] = halves[0];
                surface.triangles[t] = halves[1];
                is_touched[o] = true;
                on_edge.insert([far.min(m), far.max(m)], Vec::new());
            }
            _ => is_dropped[t] = true,
        }
        is_touched[t] = true;
        n_done += 1;
    }
    let mut dropped = is_dropped.iter();
    surface.triangles.retain(|_| dropped.next() == Some(&false));
    n_done
}

/// Keeps the first of the triangles that have the same three vertices.
fn drop_duplicates(surface: &mut Surface) -> usize {
    let doubles = duplicates(surface);
    let mut is_double = vec![false; surface.triangles.len()];
    for &(_, t) in &doubles {
        is_double[t as usize] = true;
    }
    let mut flags = is_double.iter();
    surface.triangles.retain(|_| flags.next() == Some(&false));
    doubles.len()
}

/// Triangles with the same three vertices as an earlier one, as pairs (the first, the double). Those with a repeated vertex are
/// flawed already and left out.
pub(crate) fn duplicates(surface: &Surface) -> Vec<(u32, u32)> {
    let mut keys: Vec<([u32; 3], u32)> = surface
        .triangles
        .iter()
        .enumerate()
        .filter(|(_, triangle)| !has_repeated_vertex(**triangle))
        .map(|(t, triangle)| {
            let mut key = *triangle;
            key.sort_unstable();
            (key, t as u32)
        })
        .collect();
    keys.sort_unstable();
    let mut doubles: Vec<(u32, u32)> = keys
        .chunk_by(|a, b| a.0 == b.0)
        .flat_map(|group| group[1..].iter().map(|double| (group[0].1, double.1)))
        .collect();
    doubles.sort_unstable_by_key(|&(_, t)| t);
    doubles
}

/// Drops the vertices that no triangle uses; the others keep their order. Returns how many.
pub(crate) fn drop_unused(surface: &mut Surface) -> usize {
    let is_used = crate::topology::is_used(surface);
    let mut n_kept = 0;
    let new_index: Vec<u32> = is_used
        .iter()
        .map(|&used| {
            n_kept += u32::from(used);
            n_kept.wrapping_sub(1)
        })
        .collect();
    let n_unused = surface.points.len() - n_kept as usize;
    let mut used = is_used.iter();
    surface.points.retain(|_| used.next() == Some(&true));
    for v in surface.triangles.iter_mut().flatten() {
        *v = new_index[*v as usize];
    }
    n_unused
}

fn recentre(surface: &mut Surface) -> Option<[f64; 3]> {
    let (lo, hi) = used_bounds(surface)?;
    // Halves are added, because the sum of two large coordinates may overflow.
    let shift = -(lo * 0.5 + hi * 0.5);
    surface.points.iter_mut().for_each(|p| *p += shift);
    Some(shift.into())
}
