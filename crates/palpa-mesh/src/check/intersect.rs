//! Triangles of one surface that cross or touch each other.
//!
//! Exact predicates decide, so that a near miss or a graze is never judged wrongly. Candidates come
//! from a tree of bounding boxes.

use robust::{Coord, Coord3D, orient2d, orient3d};
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

use super::{Finding, FindingKind, Findings, N_LISTED, Severity, Spot};
use crate::repair::flaw;
use crate::{Surface, Vec3};

/// Largest number of pairs with overlapping boxes that are tested. A clean surface has about 12
/// pairs per triangle, so this is enough for more than a million triangles. For a surface folded
/// into many layers, the search stops here.
const MAX_TESTS: usize = 20_000_000;
/// Largest number of pairs that are kept.
const MAX_PAIRS: usize = 10_000;

/// The result of a search for self-intersections.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Intersections {
    /// Pairs of triangles, with the smaller index first, ascending.
    pub pairs: Vec<[u32; 2]>,
    /// Whether the search was completed; if not, there may be more pairs.
    pub is_complete: bool,
}

/// Finds pairs of triangles that have more in common than their shared vertices and their shared
/// edge.
///
/// Triangles that touch in a point count, and so do triangles that overlap in one plane. The search
/// leaves out doubles (the same three vertices), triangles without area, and triangles with a
/// corner that is not finite.
pub fn self_intersections(surface: &Surface) -> Intersections {
    search(surface, MAX_TESTS, MAX_PAIRS)
}

pub(super) fn check(surface: &Surface, findings: &mut Findings) {
    let Intersections { pairs, is_complete } = self_intersections(surface);
    if pairs.is_empty() {
        return;
    }
    let mut triangles: Vec<u32> = pairs.iter().flatten().copied().collect();
    triangles.sort_unstable();
    triangles.dedup();
    let at_least = if is_complete { "" } else { "at least " };
    findings.0.push(Finding {
        kind: FindingKind::SelfIntersection,
        severity: Severity::Unrepairable,
        count: pairs.len(),
        is_at_least: !is_complete,
        spots: pairs.iter().take(N_LISTED).map(|pair| Spot::triangles(surface, pair)).collect(),
        message: format!(
            "{at_least}{} pair(s) of triangles cross or touch, {} triangles in all",
            pairs.len(),
            triangles.len()
        ),
        advice: "smooth or cut the fold away, or remesh by volume (Blender: Remesh > Voxel; MeshLab: Alpha Wrap), which \
                 keeps the outside only"
            .to_owned(),
    });
}

fn search(surface: &Surface, max_tests: usize, max_pairs: usize) -> Intersections {
    let boxes: Vec<GeomWithData<Rectangle<[f64; 3]>, u32>> = (0..surface.triangles.len())
        .filter_map(|t| {
            let corners = surface.corners(t);
            let is_finite = corners.iter().flatten().all(|x| x.is_finite());
            let [a, b, c] = corners;
            let (lo, hi) = (a.inf(&b).inf(&c), a.sup(&b).sup(&c));
            (is_finite && flaw(surface, t).is_none())
                .then(|| GeomWithData::new(Rectangle::from_corners(lo.into(), hi.into()), t as u32))
        })
        .collect();
    let mut found = Intersections {
        pairs: vec![],
        is_complete: true,
    };
    let mut n_tests = 0;
    let tree = RTree::bulk_load(boxes.clone());
    for one in &boxes {
        let envelope = AABB::from_corners(one.geom().lower(), one.geom().upper());
        for other in tree.locate_in_envelope_intersecting(envelope) {
            n_tests += 1;
            if n_tests > max_tests || found.pairs.len() >= max_pairs {
                found.is_complete = false;
                found.pairs.sort_unstable();
                return found;
            }
            if one.data < other.data && do_intersect(surface, one.data, other.data) {
                found.pairs.push([one.data, other.data]);
            }
        }
    }
    found.pairs.sort_unstable();
    found
}

/// Whether two triangles have more in common than their shared vertices.
fn do_intersect(surface: &Surface, one: u32, other: u32) -> bool {
    let (s, t) = (
        surface.triangles[one as usize],
        surface.triangles[other as usize],
    );
    let shared: Vec<usize> = (0..3).filter(|&k| t.contains(&s[k])).collect();
    let (p, q) = (
        surface.corners(one as usize),
        surface.corners(other as usize),
    );
    // Shared vertices lie in both planes. The predicate would give the same zero, but by its slow
    // way.
    let mut own = (0..3).filter(|&k| !s.contains(&t[k]));
    if own.all(|k| side(&p[0], &p[1], &p[2], &q[k]) == 0) {
        return shared.len() < 3 && do_overlap_in_plane(&p, &q);
    }
    match shared[..] {
        [] => (0..3).any(|k| {
            let next = (k + 1) % 3;
            crosses(&p[k], &p[next], &q) || crosses(&q[k], &q[next], &p)
        }),
        // At a shared vertex, all sides through it touch. Only the opposite side of each triangle
        // must be tested.
        [k] => {
            let m = (0..3).find(|&m| t[m] == s[k]).unwrap_or(0);
            crosses(&p[(k + 1) % 3], &p[(k + 2) % 3], &q)
                || crosses(&q[(m + 1) % 3], &q[(m + 2) % 3], &p)
        }
        // Two planes through a shared edge have no other points in common.
        _ => false,
    }
}

fn coord(p: &Vec3) -> Coord3D<f64> {
    Coord3D {
        x: p.x,
        y: p.y,
        z: p.z,
    }
}

/// Which side of the plane through `a`, `b`, `c` the point `d` lies on, as a sign.
fn side(a: &Vec3, b: &Vec3, c: &Vec3, d: &Vec3) -> i8 {
    sign(orient3d(coord(a), coord(b), coord(c), coord(d)))
}

fn sign(x: f64) -> i8 {
    i8::from(x > 0.0) - i8::from(x < 0.0)
}

/// Whether the segment from `a` to `b` meets a triangle; the segment's ends and the triangle's rim
/// count. A segment in the plane of the triangle does not count: the other sides of the two
/// triangles decide then.
fn crosses(a: &Vec3, b: &Vec3, [u, v, w]: &[Vec3; 3]) -> bool {
    let (at_a, at_b) = (side(u, v, w, a), side(u, v, w, b));
    if at_a * at_b > 0 || (at_a == 0 && at_b == 0) {
        return false;
    }
    let around = [side(a, b, u, v), side(a, b, v, w), side(a, b, w, u)];
    around.iter().all(|&s| s >= 0) || around.iter().all(|&s| s <= 0)
}

/// Whether two triangles in one plane overlap in an area: no side of either separates them.
fn do_overlap_in_plane(p: &[Vec3; 3], q: &[Vec3; 3]) -> bool {
    // Both triangles keep their area when they are projected along the axis of the largest normal
    // component. Dropping a coordinate causes no rounding.
    let normal = (p[1] - p[0]).cross(&(p[2] - p[0]));
    let axis = normal.iamax();
    let flat = |x: &Vec3| Coord {
        x: x[(axis + 1) % 3],
        y: x[(axis + 2) % 3],
    };
    let turned = |t: &[Vec3; 3]| {
        let [a, b, c] = [flat(&t[0]), flat(&t[1]), flat(&t[2])];
        match sign(orient2d(a, b, c)) {
            1 => Some([a, b, c]),
            -1 => Some([a, c, b]),
            _ => None,
        }
    };
    let (Some(p), Some(q)) = (turned(p), turned(q)) else {
        return false;
    };
    let separates = |p: &[Coord<f64>; 3], q: &[Coord<f64>; 3]| {
        (0..3).any(|k| q.iter().all(|&x| orient2d(p[k], p[(k + 1) % 3], x) <= 0.0))
    };
    !separates(&p, &q) && !separates(&q, &p)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pair(t: [[f64; 3]; 6]) -> Surface {
        Surface {
            points: t.map(Vec3::from).to_vec(),
            triangles: vec![[0, 1, 2], [3, 4, 5]],
        }
    }

    const FLOOR: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];

    fn with_floor(t: [[f64; 3]; 3]) -> bool {
        let [a, b, c] = FLOOR;
        !self_intersections(&pair([a, b, c, t[0], t[1], t[2]]))
            .pairs
            .is_empty()
    }

    #[test]
    fn crossing_touching_and_missing() {
        let upright = |z: f64| [[1.0, 1.0, z], [1.0, 1.0, z + 1.0], [1.0, 2.0, z + 1.0]];
        assert!(with_floor(upright(-0.5)), "through");
        assert!(with_floor(upright(0.0)), "touching by a corner");
        assert!(
            !with_floor(upright(f64::MIN_POSITIVE)),
            "missing by the least that there is"
        );
    }

    #[test]
    fn overlap_in_one_plane() {
        assert!(
            with_floor([[0.5, 0.5, 0.0], [1.0, 0.5, 0.0], [0.5, 1.0, 0.0]]),
            "inside"
        );
        assert!(
            with_floor([[-1.0, 1.0, 0.0], [5.0, 1.0, 0.0], [-1.0, 1.5, 0.0]]),
            "across"
        );
        assert!(
            !with_floor([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [2.0, -1.0, 0.0]]),
            "edge to edge"
        );
    }

    #[test]
    fn a_shared_edge_is_no_intersection_unless_folded_flat() {
        let mut s = pair([
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, -1.0, 0.0],
            [0.0; 3],
            [0.0; 3],
        ]);
        s.triangles = vec![[0, 1, 2], [1, 0, 3]];
        assert!(self_intersections(&s).pairs.is_empty());
        s.points[3] = Vec3::new(0.2, 0.2, 0.0);
        assert_eq!(self_intersections(&s).pairs, [[0, 1]]);
    }

    #[test]
    fn a_shared_corner_is_none_but_a_stab_beyond_it_is() {
        let mut s = pair([
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.5, 0.2, 1.0],
            [0.3, 0.4, -1.0],
            [0.0; 3],
        ]);
        s.triangles = vec![[0, 1, 2], [0, 3, 4]];
        assert_eq!(self_intersections(&s).pairs, [[0, 1]]);
        s.points[4].z = 2.0;
        assert!(self_intersections(&s).pairs.is_empty());
    }

    #[test]
    fn the_search_says_when_it_stops() {
        let n = 30_u32;
        let mut points = vec![];
        for i in 0..n {
            // Triangles round one axis, all crossing in it.
            let (y, x) = f64::from(i).sin_cos();
            points.extend(
                [[-x, -y, 0.0], [x, y, 0.0], [0.0, 0.0, 1.0 + f64::from(i)]].map(Vec3::from),
            );
        }
        let triangles = (0..n).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let surface = Surface { points, triangles };
        let all = search(&surface, usize::MAX, usize::MAX);
        assert!(all.is_complete);
        assert_eq!(all.pairs.len(), 30 * 29 / 2);
        let some = search(&surface, usize::MAX, 7);
        assert!(!some.is_complete && some.pairs.len() == 7);
    }
}
