//! Repair of defects that need no guessing. All other defects stay, and the check reports them.

use std::collections::{BTreeMap, VecDeque};

use serde::Serialize;

use crate::orient::{OrientReport, orient};
use crate::topology::{all_sides, by_edge, has_repeated_vertex};
use crate::weld::weld_within;
use crate::{Surface, Vec3};

/// Default weld tolerance, as a share of the diagonal of the bounding box. It is 0.3 µm on a
/// forearm: far below the detail of a skin, and far above the rounding of coordinates written with
/// seven digits.
pub const DEFAULT_WELD_TOLERANCE: f64 = 1e-6;

/// Ratio of a triangle's height to its longest edge below which it counts as flat. Its normal would
/// be rounding error.
pub(crate) const FLAT_HEIGHT: f64 = 1e-9;

/// Largest offset of the bounding box's centre from the origin, as a share of the diagonal, at
/// which a surface counts as centred. A smaller move would only round its coordinates.
const CENTRED: f64 = 1e-9;

/// Largest number of moves to the origin. Each move after the first only corrects the rounding of
/// the one before. Two are enough for any coordinates that resolve the body.
const MAX_MOVES: usize = 8;

/// Options of a repair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RepairOptions {
    /// Distance up to which vertices are welded, as a share of the diagonal of the bounding box. 0
    /// welds only vertices with exactly the same coordinates.
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

/// Counts of the changes that a repair made.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct RepairReport {
    /// Number of vertices that were merged into another.
    pub n_welded: usize,
    /// Number of triangles with a repeated vertex or without area. They were dropped, or resolved
    /// by flipping an edge.
    pub n_degenerate: usize,
    /// Number of triangles dropped because another has the same three vertices.
    pub n_duplicate: usize,
    /// Number of vertices dropped because no triangle uses them.
    pub n_unused: usize,
    /// Changes of orientation.
    pub orientation: OrientReport,
    /// Vector added to every point, if the surface was recentred. m
    pub moved_by: Option<[f64; 3]>,
}

impl RepairReport {
    /// Whether the repair changed the surface.
    pub fn is_changed(&self) -> bool {
        let n = self.n_welded + self.n_degenerate + self.n_duplicate + self.n_unused;
        n + self.orientation.n_flipped > 0 || self.moved_by.is_some()
    }

    /// Adds the changes of a later repair of the same surface. The counts of parts that cannot be
    /// turned come from the later repair.
    fn add(&mut self, later: &Self) {
        self.n_welded += later.n_welded;
        self.n_degenerate += later.n_degenerate;
        self.n_duplicate += later.n_duplicate;
        self.n_unused += later.n_unused;
        let (sum, later) = (&mut self.orientation, &later.orientation);
        sum.n_flipped += later.n_flipped;
        sum.n_inverted_closed += later.n_inverted_closed;
        sum.n_inverted_open += later.n_inverted_open;
        sum.n_undecided = later.n_undecided;
        sum.n_one_sided = later.n_one_sided;
    }
}

/// A repaired copy: vertices welded, duplicate triangles and triangles without area dropped,
/// winding made consistent and outward (see [`orient`]), unused vertices dropped.
///
/// Holes, edges with three or more triangles, self-intersections and vertices that are not finite
/// stay, because filling, cutting or moving would be a guess. Flat triangles stay if they cannot be
/// resolved without damage to their neighbours.
///
/// A repaired surface needs no second repair: `repair` returns it unchanged and reports no change.
pub fn repair(surface: &Surface, options: &RepairOptions) -> (Surface, RepairReport) {
    let (mut surface, mut report) = mend(surface.clone(), options);
    if options.recentre {
        // Moving rounds the coordinates. A nearly flat triangle may then be flat.
        for _ in 0..MAX_MOVES {
            let Some(shift) = recentre(&mut surface) else {
                break;
            };
            let before = report.moved_by.map_or_else(Vec3::zeros, Vec3::from);
            report.moved_by = Some((before + shift).into());
            let (mended, again) = mend(surface, options);
            surface = mended;
            report.add(&again);
        }
    }
    (surface, report)
}

/// The repair without the move. No step creates work for the steps before it, neither in this call
/// nor in the next:
///
/// - Unused vertices go before welding. Otherwise an unused vertex could replace a used one, or
///   widen the bounding box and so the tolerance.
/// - Duplicates go before flat triangles. Otherwise a flat triangle and its double would keep each
///   other.
/// - Resolving flat triangles creates no duplicates.
/// - Whether a triangle is flat does not depend on its winding.
fn mend(mut surface: Surface, options: &RepairOptions) -> (Surface, RepairReport) {
    let n_loose = drop_unused(&mut surface);
    let tolerance = options.weld_tolerance * used_bounds(&surface).map_or(0.0, diagonal);
    let n_before = surface.points.len();
    surface = weld_within(&surface, tolerance).surface;
    let n_welded = n_before - surface.points.len();

    let n_triangles = surface.triangles.len();
    surface.triangles.retain(|&t| !has_repeated_vertex(t));
    let n_repeated = n_triangles - surface.triangles.len();
    let n_duplicate = drop_duplicates(&mut surface);
    let n_degenerate = n_repeated + resolve_flat(&mut surface);
    let orientation = orient(&mut surface);
    let n_unused = n_loose + drop_unused(&mut surface);
    let report = RepairReport {
        n_welded,
        n_degenerate,
        n_duplicate,
        n_unused,
        orientation,
        moved_by: None,
    };
    (surface, report)
}

/// Length of the diagonal of a box. Its square may overflow even if the box itself does not.
fn diagonal((lo, hi): (Vec3, Vec3)) -> f64 {
    let extent = hi - lo;
    let diagonal = extent.norm();
    if diagonal.is_finite() {
        diagonal
    } else {
        let scale = extent.amax();
        extent.unscale(scale).norm() * scale
    }
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

/// Why a triangle has no area.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Flaw {
    /// The same vertex occurs twice.
    RepeatedVertex,
    /// Its corners lie on one line.
    Flat {
        /// The longest side, as the number of its first corner.
        longest: usize,
    },
}

/// The flaw of a triangle, if it has one. A triangle with a corner that is not finite has neither
/// flaw.
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
    // Sides of equal length are ordered by their vertices, so that the winding makes no difference.
    let opposite = |side: usize| surface.triangles[t][(side + 2) % 3];
    let longest = (0..3).max_by(|&i, &j| {
        let by_length = length_sq[i].total_cmp(&length_sq[j]);
        by_length.then_with(|| opposite(i).cmp(&opposite(j)))
    })?;
    // |cross| = longest · height ≤ ratio · longest².
    let is_flat = (b - a).cross(&(c - a)).norm() <= FLAT_HEIGHT * length_sq[longest];
    (is_flat && length_sq[longest].is_finite()).then_some(Flaw::Flat { longest })
}

/// Resolves flat triangles until none can be resolved any more. Returns how many times it dropped a
/// triangle or flipped an edge. There must be no duplicates and no repeated vertices.
///
/// A neighbour over the longest side may need a flat triangle to stay connected to the rest.
/// Dropping the triangle would then leave a slit. Instead, the longest side is flipped, so that the
/// neighbour is split at the middle corner.
///
/// ```text
///        far                far
///        / \                /|\
///       / o \      ─►      / | \
///      a──m──b            a──m──b      t = (a, b, m) is flat
/// ```
fn resolve_flat(surface: &mut Surface) -> usize {
    let is_flat = |&t: &u32| matches!(flaw(surface, t as usize), Some(Flaw::Flat { .. }));
    let flat: Vec<u32> = (0..surface.triangles.len() as u32)
        .filter(is_flat)
        .collect();
    if flat.is_empty() {
        return 0;
    }
    let mut triangles = FlatTriangles::new(surface);
    for t in flat {
        triangles.enqueue(t);
    }
    let mut n = 0;
    while let Some(t) = triangles.next() {
        n += usize::from(triangles.resolve(t));
    }
    let mut dropped = triangles.is_dropped.into_iter();
    surface.triangles.retain(|_| dropped.next() == Some(false));
    n
}

/// The state while flat triangles are resolved.
///
/// The process ends because each change reduces the first of these quantities that it changes: the
/// number of triangles, the number of flat triangles, the lengths of the sides that are flipped.
struct FlatTriangles<'a> {
    surface: &'a mut Surface,
    /// The triangles on each edge, smaller vertex first.
    on_edge: BTreeMap<[u32; 2], Vec<u32>>,
    /// Whether each triangle was dropped. `[n_triangles]`
    is_dropped: Vec<bool>,
    /// Triangles to process, first in, first out.
    queue: VecDeque<u32>,
    /// Whether each triangle is in the queue. `[n_triangles]`
    is_queued: Vec<bool>,
    /// Flat triangles that cannot be resolved while a certain edge exists, by that edge.
    waiting: BTreeMap<[u32; 2], Vec<u32>>,
}

impl<'a> FlatTriangles<'a> {
    fn new(surface: &'a mut Surface) -> Self {
        let on_edge = by_edge(&all_sides(surface))
            .map(|sides| (sides[0].edge, sides.iter().map(|s| s.triangle).collect()))
            .collect();
        let n = surface.triangles.len();
        Self {
            surface,
            on_edge,
            is_dropped: vec![false; n],
            queue: VecDeque::new(),
            is_queued: vec![false; n],
            waiting: BTreeMap::new(),
        }
    }

    fn enqueue(&mut self, t: u32) {
        if !std::mem::replace(&mut self.is_queued[t as usize], true) {
            self.queue.push_back(t);
        }
    }

    fn next(&mut self) -> Option<u32> {
        let t = self.queue.pop_front()?;
        self.is_queued[t as usize] = false;
        Some(t)
    }

    fn is_flat(&self, t: u32) -> bool {
        matches!(flaw(self.surface, t as usize), Some(Flaw::Flat { .. }))
    }

    /// Drops a flat triangle or flips its longest side, if that is possible. Returns whether it
    /// did.
    fn resolve(&mut self, t: u32) -> bool {
        if self.is_dropped[t as usize] {
            return false;
        }
        let Some(Flaw::Flat { longest }) = flaw(self.surface, t as usize) else {
            return false;
        };
        // a → b is the longest side, and m the corner opposite it.
        let [a, b, m] = [0, 1, 2].map(|k| self.surface.triangles[t as usize][(longest + k) % 3]);
        let on_longest = &self.on_edge[&edge(a, b)];
        let &[first, second] = &on_longest[..] else {
            self.unlink(t);
            self.is_dropped[t as usize] = true;
            return true;
        };
        let o = if first == t { second } else { first };
        let neighbour = self.surface.triangles[o as usize];
        let Some(far) = neighbour.into_iter().find(|&v| v != a && v != b) else {
            return false;
        };
        if self.on_edge.contains_key(&edge(far, m)) {
            self.waiting.entry(edge(far, m)).or_default().push(t);
            return false;
        }
        if self.is_flat(o) {
            return false;
        }
        self.turn([t, o], [a, b], [m, far])
    }

    /// Flips the side a–b between a flat triangle `t` and its neighbour `o` to m–far. It does so
    /// only if this leaves fewer flat triangles, or the same number and a shorter side. Returns
    /// whether it did.
    fn turn(&mut self, [t, o]: [u32; 2], [a, b]: [u32; 2], [m, far]: [u32; 2]) -> bool {
        let before = [t, o].map(|t| self.surface.triangles[t as usize]);
        // The neighbour keeps its winding: each half is the neighbour with one end of the side
        // replaced by m.
        let moved = |from: u32| before[1].map(|v| if v == from { m } else { v });
        let after = [moved(b), moved(a)];
        self.put([t, o], after);
        let n_flat = [t, o].into_iter().filter(|&t| self.is_flat(t)).count();
        let point = |v: u32| self.surface.points[v as usize];
        let is_shorter =
            (point(far) - point(m)).norm_squared() < (point(b) - point(a)).norm_squared();
        self.put([t, o], before);
        if n_flat > 1 || (n_flat == 1 && !is_shorter) {
            return false;
        }
        self.unlink(t);
        self.unlink(o);
        self.put([t, o], after);
        self.link(t);
        self.link(o);
        true
    }

    fn put(&mut self, at: [u32; 2], triangles: [[u32; 3]; 2]) {
        for (t, triangle) in at.into_iter().zip(triangles) {
            self.surface.triangles[t as usize] = triangle;
        }
    }

    /// Removes a triangle from its edges. All triangles that this may help are queued again.
    fn unlink(&mut self, t: u32) {
        for edge in edges(self.surface.triangles[t as usize]) {
            let Some(on_edge) = self.on_edge.get_mut(&edge) else {
                continue;
            };
            on_edge.retain(|&other| other != t);
            let mut freed = on_edge.clone();
            if on_edge.is_empty() {
                self.on_edge.remove(&edge);
                freed = self.waiting.remove(&edge).unwrap_or_default();
            }
            for other in freed {
                self.enqueue(other);
            }
        }
    }

    /// Adds a triangle to its edges, and queues it and its neighbours.
    fn link(&mut self, t: u32) {
        for edge in edges(self.surface.triangles[t as usize]) {
            let on_edge = self.on_edge.entry(edge).or_default();
            on_edge.push(t);
            for other in on_edge.clone() {
                self.enqueue(other);
            }
        }
    }
}

/// An edge, smaller vertex first.
fn edge(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// The edges of a triangle.
fn edges([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [edge(a, b), edge(b, c), edge(c, a)]
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

/// Triangles with the same three vertices as an earlier one, as pairs (the first, the double).
/// Triangles with a repeated vertex have a flaw already and are left out.
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

/// Drops the vertices that no triangle uses. The others keep their order. Returns how many were
/// dropped.
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

/// Moves the centre of the bounding box to the origin. Returns the shift, or `None` if the centre
/// is already there. m
fn recentre(surface: &mut Surface) -> Option<Vec3> {
    let (lo, hi) = used_bounds(surface)?;
    // The halves are added because the sum of two large coordinates may overflow.
    let shift = -(lo * 0.5 + hi * 0.5);
    if shift.amax() <= CENTRED * diagonal((lo, hi)) {
        return None;
    }
    surface.points.iter_mut().for_each(|p| *p += shift);
    Some(shift)
}
