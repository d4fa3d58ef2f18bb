//! Pairs of skin triangles, over which the element takes its mean strains.
//!
//! A single wedge locks if the tissue is nearly incompressible; two wedges with one mean dilatation
//! do not. So the triangles of the skin are matched into as many pairs as possible, each near to a
//! rectangle.
//!
//! ```text
//!        j                   pair of t0 = (a, i, j) and t1 = (b, j, i)
//!       /|\                  corners [a, i, j, b]; the diagonal i–j is the shared edge
//!      / | \                 round the outline, counter-clockwise from outside: a, i, b, j
//!     a  |  b                angles on the skin: at i and j the sum of both triangles'
//!      \ | /
//!       \|/
//!        i
//! ```
//! - The number of pairs comes first, since a triangle left alone locks. An odd number of
//!   triangles, or a triangle that has no partner it could have, leaves some alone.
//! - Triangles are never paired across a fold of more than 60°: a mean of strains says nothing
//!   there.
//! - Pairs with a reflex corner (180° or more) are taken only where the number of pairs needs them.
//! - Among these the sum of the squares of the worst corner's distance from 90° is made small (not
//!   least).

mod matching;
mod swaps;

use std::collections::HashSet;

use matching::Edge;
use palpa_mesh::{Surface, Vec3};

/// Cosine of the sharpest fold across which triangles are paired, 60° between their normals.
const SHARPEST_FOLD_COS: f64 = 0.5;
/// Added to the cost (rad², below 23 for any corners) of a pair with a reflex corner.
const REFLEX_COST: f64 = 100.0;

/// Two triangles that share an edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pair {
    /// The triangles `t0 < t1`.
    pub triangles: [u32; 2],
    /// Vertices `[a, i, j, b]`: `t0` runs a → i → j, `t1` runs b → j → i.
    pub corners: [u32; 4],
}

/// How the triangles of a skin are grouped.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Pairing {
    /// The pairs, ascending by their first triangle.
    pub pairs: Vec<Pair>,
    /// Triangles without a partner, ascending.
    pub singles: Vec<u32>,
}

/// Matches the triangles of a skin as described in the module. Deterministic; 20,000 irregular
/// triangles take about 0.2 s.
///
/// No pairs are made across edges that more than two triangles share, or across edges whose two
/// triangles disagree on the outside.
pub fn pair_triangles(skin: &Surface) -> Pairing {
    pair_triangles_like(skin, &[])
}

/// The same, but pairs with these corners are preferred, as in [`Pair::corners`]: where a part of the
/// skin, or a finer one, has both triangles of a pair, most stay together. The number of pairs still
/// comes first.
pub fn pair_triangles_like(skin: &Surface, preferred: &[[u32; 4]]) -> Pairing {
    let preferred: HashSet<[u32; 4]> = preferred.iter().map(|&corners| sorted(corners)).collect();
    let mut candidates = candidates(skin);
    for (pair, cost) in &mut candidates {
        if preferred.contains(&sorted(pair.corners)) {
            *cost = 0.0;
        }
    }
    let edges: Vec<Edge> = candidates
        .iter()
        .map(|&(pair, cost)| Edge {
            ends: pair.triangles,
            cost,
        })
        .collect();
    let mate = matching::matching(skin.triangles.len(), &edges, REFLEX_COST);
    Pairing {
        pairs: candidates
            .iter()
            .map(|&(pair, _)| pair)
            .filter(|pair| mate[pair.triangles[0] as usize] == Some(pair.triangles[1]))
            .collect(),
        singles: (0..mate.len() as u32)
            .filter(|&t| mate[t as usize].is_none())
            .collect(),
    }
}

/// The corners in an order that does not depend on the order of the triangles.
fn sorted([a, i, j, b]: [u32; 4]) -> [u32; 4] {
    [a.min(b), i.min(j), i.max(j), a.max(b)]
}

/// How far the worst corner of a pair is from 90°, measured along the skin. rad
///
/// 0 for a rectangle, π/6 for two equilateral triangles, π/2 or more with a reflex corner.
///
/// # Panics
/// If `skin` lacks a corner of the pair.
pub fn worst_corner(skin: &Surface, pair: &Pair) -> f64 {
    let [a, i, j, b] = pair.corners.map(|v| skin.points[v as usize]);
    let at_ends = |at: Vec3, to: Vec3| angle(a - at, to - at) + angle(to - at, b - at);
    [
        angle(i - a, j - a),
        angle(i - b, j - b),
        at_ends(i, j),
        at_ends(j, i),
    ]
    .into_iter()
    .map(|corner| (corner - std::f64::consts::FRAC_PI_2).abs())
    .fold(0.0, f64::max)
}

/// Angle between two vectors, by atan2: exact also near 0 and π. rad
fn angle(u: Vec3, v: Vec3) -> f64 {
    u.cross(&v).norm().atan2(u.dot(&v))
}

/// Every allowed pair with its cost, ascending by triangles. Of two triangles that share two edges,
/// only the better pair.
fn candidates(skin: &Surface) -> Vec<(Pair, f64)> {
    // (smaller end, larger end, triangle, corner opposite): the triangles on one edge stand
    // together.
    let mut sides: Vec<([u32; 2], u32, usize)> = (0..skin.triangles.len() as u32)
        .flat_map(|t| {
            let triangle = skin.triangles[t as usize];
            (0..3).map(move |k| {
                let (i, j) = (triangle[(k + 1) % 3], triangle[(k + 2) % 3]);
                ([i.min(j), i.max(j)], t, k)
            })
        })
        .collect();
    sides.sort_unstable();
    let mut candidates: Vec<(Pair, f64)> = sides
        .chunk_by(|p, q| p.0 == q.0)
        .filter_map(|on_edge| {
            let &[(_, t0, k0), (_, t1, k1)] = on_edge else {
                return None;
            };
            let [from, to] = [skin.triangles[t0 as usize], skin.triangles[t1 as usize]];
            let [a, i, j] = [0, 1, 2].map(|s| from[(k0 + s) % 3]);
            let [b, jj, ii] = [0, 1, 2].map(|s| to[(k1 + s) % 3]);
            let folds_little = fold_cos(skin, t0, t1) >= SHARPEST_FOLD_COS;
            (t0 != t1 && [i, j] == [ii, jj] && a != b && folds_little).then(|| {
                let pair = Pair {
                    triangles: [t0, t1],
                    corners: [a, i, j, b],
                };
                (pair, cost(skin, &pair))
            })
        })
        .collect();
    candidates.sort_by(|(p, p_cost), (q, q_cost)| {
        p.triangles.cmp(&q.triangles).then(p_cost.total_cmp(q_cost))
    });
    candidates.dedup_by_key(|(pair, _)| pair.triangles);
    candidates
}

/// Cosine of the angle between the normals of two triangles; NaN where one has no area.
fn fold_cos(skin: &Surface, t0: u32, t1: u32) -> f64 {
    let [n0, n1] = [t0, t1].map(|t| skin.area_vector(t as usize));
    n0.dot(&n1) / (n0.norm() * n1.norm())
}

fn cost(skin: &Surface, pair: &Pair) -> f64 {
    let worst = worst_corner(skin, pair);
    let is_reflex = worst >= std::f64::consts::FRAC_PI_2 - 1e-9;
    worst * worst + if is_reflex { REFLEX_COST } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use palpa_mesh::generate::{GradedBlock, LevelStack, Outline, graded_block};

    use super::*;

    /// The work is in proportion to the triangles, up to a slowly growing factor.
    #[test]
    fn pairing_irregular_triangles_looks_at_each_a_bounded_number_of_times() {
        let looks = [4e-3, 2e-3, 1e-3].map(|spacing| {
            let block = GradedBlock {
                outline: Outline::Square,
                half_width: 50e-3,
                centre: [0.0, 0.0],
                ring_radius: None,
                spacing,
                inner_growth: 0.0,
                growth: 0.0,
                jitter: Some(1),
            };
            let levels = LevelStack {
                depths: vec![0.0, 0.04],
                interval_layer: vec![0],
            };
            let skin = graded_block(&block, &levels).skin;
            let before = matching::work::n();
            let pairing = pair_triangles(&skin);
            assert!(!pairing.pairs.is_empty());
            (matching::work::n() - before) as f64 / skin.triangles.len() as f64
        });
        println!("neighbours looked at for each triangle, from coarse to fine: {looks:.0?}");
        assert!(looks.iter().all(|&n| n > 1.0 && n < 10_000.0), "{looks:?}");
        assert!(looks[2] < 2.0 * looks[0], "{looks:?}");
    }
}
