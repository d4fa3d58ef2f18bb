//! Orientation of triangles: a consistent winding in each part, facing outward.

use serde::Serialize;

use crate::topology::{Side, UnionFind, all_sides, by_edge, has_sides, sides};
use crate::{Surface, Vec3};

/// Least volume under an open sheet, as a share of the volume of a ball of the same area. Below it,
/// the sheet is too flat to tell which side is out. A cap of 10° opening is at 0.03; noise on a
/// flat sheet is far below.
const LEAST_BULGE: f64 = 1e-3;

/// Counts of triangles and parts that were turned, and of those that could not be.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct OrientReport {
    /// Triangles that were turned to agree with their neighbours or to face outward.
    pub n_flipped: usize,
    /// Closed parts that faced inward as a whole.
    pub n_inverted_closed: usize,
    /// Open parts that faced their hollow side as a whole.
    pub n_inverted_open: usize,
    /// Open parts that are too flat to tell which side is out; they were only made consistent.
    pub n_undecided: usize,
    /// Parts with only one side, such as a Möbius strip; they have no consistent winding.
    pub n_one_sided: usize,
}

/// A part whose triangles meet in pairs over edges, and which of its triangles must be turned.
#[derive(Debug)]
pub(crate) struct Patch {
    /// Triangles, ascending.
    pub(crate) triangles: Vec<u32>,
    /// Whether each triangle is wound against the majority of its patch.
    pub(crate) is_odd: Vec<bool>,
    /// Whether no consistent winding exists.
    pub(crate) is_one_sided: bool,
}

impl Patch {
    /// The triangles wound against the majority.
    pub(crate) fn odd_triangles(&self) -> impl Iterator<Item = u32> {
        self.triangles
            .iter()
            .zip(&self.is_odd)
            .filter(|(_, odd)| **odd)
            .map(|(&t, _)| t)
    }
}

/// The patches of a surface: triangles joined over edges that exactly two of them share. If three
/// or more share an edge, it is unknown which two belong together, so the winding does not carry
/// over. Triangles that have no side in `sides` are left out.
pub(crate) fn patches(surface: &Surface, sides: &[Side]) -> Vec<Patch> {
    let n = surface.triangles.len();
    let has_sides = has_sides(surface, sides);
    let mut neighbours: Vec<Vec<(u32, bool)>> = vec![Vec::new(); n];
    let mut sets = UnionFind::new(n);
    for on_edge in by_edge(sides) {
        if let &[a, b] = on_edge {
            let agrees = a.is_forward != b.is_forward;
            neighbours[a.triangle as usize].push((b.triangle, agrees));
            neighbours[b.triangle as usize].push((a.triangle, agrees));
            sets.join(a.triangle, b.triangle);
        }
    }
    let mut is_odd: Vec<Option<bool>> = vec![None; n];
    sets.groups()
        .into_iter()
        .filter(|group| has_sides[group[0] as usize])
        .map(|triangles| {
            let mut is_one_sided = false;
            let mut open = vec![triangles[0]];
            is_odd[triangles[0] as usize] = Some(false);
            while let Some(t) = open.pop() {
                let here = is_odd[t as usize] == Some(true);
                for &(other, agrees) in &neighbours[t as usize] {
                    let there = here == agrees;
                    match is_odd[other as usize] {
                        None => {
                            is_odd[other as usize] = Some(there);
                            open.push(other);
                        }
                        Some(known) => is_one_sided |= known != there,
                    }
                }
            }
            let mut is_odd: Vec<bool> = triangles
                .iter()
                .map(|&t| is_odd[t as usize] == Some(true))
                .collect();
            // The majority counts as right, so that as few triangles as possible are turned.
            if 2 * is_odd.iter().filter(|&&odd| odd).count() > is_odd.len() {
                for odd in &mut is_odd {
                    *odd = !*odd;
                }
            }
            Patch {
                triangles,
                is_odd,
                is_one_sided,
            }
        })
        .collect()
}

/// Winds every part consistently and outward.
///
/// A closed part faces outward if its volume is positive. For an open part, the volume is computed
/// as if each boundary loop were closed by a fan from the centre of the loop: a limb cut at both
/// ends becomes a limb with caps, and a sheet faces the side on which it bulges. That is the wrong
/// side for a sheet cut from a hollow (an armpit), and unknown for a flat sheet. The report counts
/// open parts that were turned, and parts that are too flat.
pub fn orient(surface: &mut Surface) -> OrientReport {
    let mut report = OrientReport::default();
    for patch in patches(surface, &all_sides(surface)) {
        if patch.is_one_sided {
            report.n_one_sided += 1;
            continue;
        }
        for t in patch.odd_triangles() {
            flip(surface, t);
        }
        let (shape, facing) = facing(surface, &patch.triangles);
        report.n_undecided += usize::from(facing.is_none());
        let is_inverted = facing == Some(false);
        if is_inverted {
            if shape.is_closed {
                report.n_inverted_closed += 1;
            } else {
                report.n_inverted_open += 1;
            }
            for &t in &patch.triangles {
                flip(surface, t);
            }
        }
        let turned = patch
            .is_odd
            .iter()
            .filter(|&&odd| odd != is_inverted)
            .count();
        report.n_flipped += turned;
    }
    report
}

fn flip(surface: &mut Surface, t: u32) {
    surface.triangles[t as usize].swap(1, 2);
}

/// Volume and area of some consistently wound triangles, and whether they face outward; `None` if
/// that is not clear. The triangles are flipped for a test and restored.
///
/// Triangles face inward only if they face outward after they are flipped. If the volume is only
/// rounding error, both windings may seem to face inward.
pub(crate) fn facing(surface: &mut Surface, triangles: &[u32]) -> (Enclosed, Option<bool>) {
    let shape = Enclosed::of(surface, triangles);
    let mut facing = shape.facing();
    if facing == Some(false) {
        for &t in triangles {
            flip(surface, t);
        }
        let turned = Enclosed::of(surface, triangles).facing();
        for &t in triangles {
            flip(surface, t);
        }
        facing = (turned == Some(true)).then_some(false);
    }
    (shape, facing)
}

/// Volume and area of some triangles, with their boundary loops capped. Triangles with a corner
/// that is not finite are left out.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Enclosed {
    /// Signed volume, positive when the triangles face outward. m³
    pub(crate) volume: f64,
    /// Area of the triangles, without caps. m²
    pub(crate) area: f64,
    /// Whether there is no boundary loop.
    pub(crate) is_closed: bool,
}

impl Enclosed {
    pub(crate) fn of(surface: &Surface, triangles: &[u32]) -> Self {
        let is_finite = |corners: &[Vec3; 3]| corners.iter().flatten().all(|x| x.is_finite());
        let finite: Vec<[Vec3; 3]> = triangles
            .iter()
            .map(|&t| surface.corners(t as usize))
            .filter(is_finite)
            .collect();
        // Volumes are taken about a point of the part. About a far origin, they would be
        // differences of huge numbers.
        let origin = finite
            .first()
            .map_or_else(Vec3::zeros, |corners| corners[0]);
        let cross = |[a, b, c]: [Vec3; 3]| (b - a).cross(&(c - a));
        let sixfold = |corners: [Vec3; 3]| {
            let [a, b, c] = corners.map(|p| p - origin);
            a.cross(&b).dot(&c)
        };
        let mut volume: f64 = finite.iter().map(|&t| sixfold(t)).sum();
        let area = finite.iter().map(|&t| cross(t).norm() / 2.0).sum();
        let boundary = boundary_sides(&sides(surface, triangles.iter().copied()));
        for chain in chains(&boundary) {
            let ends = |side: &Side| side.directed().map(|v| surface.points[v as usize]);
            let centre = chain.iter().map(|side| ends(side)[0]).sum::<Vec3>() / chain.len() as f64;
            let caps = chain
                .iter()
                .map(|side| [ends(side)[1], ends(side)[0], centre]);
            volume += caps.filter(is_finite).map(sixfold).sum::<f64>();
        }
        Self {
            volume: volume / 6.0,
            area,
            is_closed: boundary.is_empty(),
        }
    }

    /// Whether the triangles face outward, or `None` if an open part is too flat to tell.
    fn facing(&self) -> Option<bool> {
        let ball = self.area.powf(1.5) / (6.0 * std::f64::consts::PI.sqrt());
        let is_clear = self.is_closed || self.volume.abs() > LEAST_BULGE * ball;
        is_clear.then_some(self.volume >= 0.0)
    }
}

/// The sides without a partner in the opposite direction.
pub(crate) fn boundary_sides(sides: &[Side]) -> Vec<Side> {
    by_edge(sides)
        .flat_map(|on_edge| {
            let n_forward = on_edge.iter().filter(|s| s.is_forward).count();
            let n_paired = n_forward.min(on_edge.len() - n_forward);
            let unpaired = |is_forward: bool| {
                on_edge
                    .iter()
                    .filter(move |s| s.is_forward == is_forward)
                    .skip(n_paired)
            };
            unpaired(true).chain(unpaired(false)).copied()
        })
        .collect()
}

/// Groups boundary sides that are connected over common vertices. A chain need not be closed: the
/// rim of a fin ends at an edge of three triangles.
pub(crate) fn chains(boundary: &[Side]) -> Vec<Vec<Side>> {
    let mut at_vertex: Vec<(u32, u32)> = boundary
        .iter()
        .enumerate()
        .flat_map(|(i, side)| side.edge.map(|v| (v, i as u32)))
        .collect();
    at_vertex.sort_unstable();
    let mut sets = UnionFind::new(boundary.len());
    for pair in at_vertex.windows(2).filter(|p| p[0].0 == p[1].0) {
        sets.join(pair[0].1, pair[1].1);
    }
    sets.groups()
        .into_iter()
        .map(|group| group.into_iter().map(|i| boundary[i as usize]).collect())
        .collect()
}
