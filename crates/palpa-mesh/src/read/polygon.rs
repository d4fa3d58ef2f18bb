//! Cutting polygons into triangles by clipping ears.
//!
//! Every corner of the polygon stays a corner of some triangle. A triangulator that drops collinear
//! corners (as `earcut` does) would tear the surface open if the neighbour across the edge keeps
//! them. Exact predicates decide the orientation, on the projection along the polygon's mean
//! normal.

use robust::{Coord, orient2d};

use crate::Vec3;

/// How often the search for ears is repeated when a polygon has none left. A polygon that needs
/// more repeats is folded all over.
const MAX_SEARCHES: usize = 4;

/// Appends the `corners.len() − 2` triangles of a polygon, with the winding of the polygon. Returns
/// whether they lie flat beside each other.
///
/// A polygon that folds over itself, has no area, or has a corner that is not finite cannot be cut
/// cleanly. It is cut nevertheless.
pub(super) fn triangulate(points: &[Vec3], corners: &[u32], triangles: &mut Vec<[u32; 3]>) -> bool {
    let flat = project(points, corners);
    let is_upright = |t: [usize; 3]| orient2d(flat[t[0]], flat[t[1]], flat[t[2]]) > 0.0;
    if let &[a, b, c, d] = corners {
        let first = is_upright([0, 1, 2]) && is_upright([0, 2, 3]);
        let second = is_upright([0, 1, 3]) && is_upright([1, 2, 3]);
        // Cut along the shorter diagonal, unless only the other one keeps both halves upright.
        let length_sq = |i: usize, j: usize| {
            (points[corners[i] as usize] - points[corners[j] as usize]).norm_squared()
        };
        let is_first_shorter = length_sq(0, 2) <= length_sq(1, 3);
        let is_first = if first == second {
            is_first_shorter
        } else {
            first
        };
        triangles.extend(if is_first {
            [[a, b, c], [a, c, d]]
        } else {
            [[a, b, d], [b, c, d]]
        });
        return first || second;
    }
    // The remaining corners, as a ring, and which of them are ears. Clipping an ear affects only
    // its two neighbours.
    let mut ring: Vec<usize> = (0..corners.len()).collect();
    let ears = |ring: &[usize]| -> Vec<bool> {
        (0..ring.len()).map(|i| check_ear(&flat, ring, i)).collect()
    };
    let mut is_ear = ears(&ring);
    let mut n_searches = 0;
    let mut is_clean = true;
    let mut from = 0;
    while ring.len() > 3 {
        // Searching onwards from the last ear, and not from the start, avoids a fan of triangles at
        // one corner.
        let n = ring.len();
        let find_ear = |is_ear: &[bool]| (0..n).map(|k| (from + k) % n).find(|&i| is_ear[i]);
        let mut ear = find_ear(&is_ear);
        // Where corners touch, such as along the seam of a hole, clipping may create an ear further
        // away.
        if ear.is_none() && n_searches < MAX_SEARCHES {
            n_searches += 1;
            is_ear = ears(&ring);
            ear = find_ear(&is_ear);
        }
        is_clean &= ear.is_some();
        let at = ear.unwrap_or(from % n);
        let (before, after) = ((at + n - 1) % n, (at + 1) % n);
        triangles.push([before, at, after].map(|i| corners[ring[i]]));
        ring.remove(at);
        is_ear.remove(at);
        for i in [before, after] {
            let i = if i > at { i - 1 } else { i };
            is_ear[i] = check_ear(&flat, &ring, i);
        }
        from = at + 1;
    }
    triangles.push([0, 1, 2].map(|i| corners[ring[i]]));
    is_clean && is_upright([ring[0], ring[1], ring[2]])
}

/// The corners projected along the mean normal, counter-clockwise.
fn project(points: &[Vec3], corners: &[u32]) -> Vec<Coord<f64>> {
    let origin = points[corners[0] as usize];
    let at = |i: usize| points[corners[i % corners.len()] as usize] - origin;
    let normal: Vec3 = (0..corners.len()).map(|i| at(i).cross(&at(i + 1))).sum();
    // Dropping the coordinate of the normal's largest component causes no rounding, so that
    // collinear corners stay collinear.
    let axis = normal.iamax();
    let (x, y) = match (axis, normal[axis] < 0.0) {
        (0, false) => (1, 2),
        (0, true) => (2, 1),
        (1, false) => (2, 0),
        (1, true) => (0, 2),
        (_, false) => (0, 1),
        (_, true) => (1, 0),
    };
    corners
        .iter()
        .map(|&v| {
            let p = points[v as usize];
            Coord { x: p[x], y: p[y] }
        })
        .collect()
}

/// Whether the corner `at` can be cut off: it is convex, and no other corner lies in or on the
/// triangle. Corners at the same place as one of the three do not count; otherwise the seam of a
/// polygon with a hole could never be cut.
fn check_ear(flat: &[Coord<f64>], ring: &[usize], at: usize) -> bool {
    let n = ring.len();
    let [a, b, c] = [(at + n - 1) % n, at, (at + 1) % n].map(|i| flat[ring[i]]);
    if orient2d(a, b, c) <= 0.0 {
        return false;
    }
    !ring.iter().map(|&i| flat[i]).any(|p| {
        p != a
            && p != b
            && p != c
            && orient2d(a, b, p) >= 0.0
            && orient2d(b, c, p) >= 0.0
            && orient2d(c, a, p) >= 0.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polygon(xy: &[(f64, f64)]) -> (Vec<Vec3>, Vec<u32>) {
        let points = xy.iter().map(|&(x, y)| Vec3::new(x, y, 1.0)).collect();
        (points, (0..xy.len() as u32).collect())
    }

    /// Signed areas along +z: half the cross product of each triangle.
    fn areas(points: &[Vec3], triangles: &[[u32; 3]]) -> Vec<f64> {
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| points[v as usize]);
            (b - a).cross(&(c - a)).z / 2.0
        };
        triangles.iter().map(area).collect()
    }

    #[test]
    fn a_concave_polygon_is_covered_once() {
        // A star of eight corners, every other one pulled inward: area 8 · ½ · 2 · 0.6 · sin 45°.
        let star: Vec<_> = (0..8)
            .map(|i| {
                let (s, c) = (f64::from(i) * std::f64::consts::FRAC_PI_4).sin_cos();
                let r = if i % 2 == 0 { 2.0 } else { 0.6 };
                (r * c, r * s)
            })
            .collect();
        let (points, corners) = polygon(&star);
        let mut triangles = vec![];
        assert!(triangulate(&points, &corners, &mut triangles));
        let areas = areas(&points, &triangles);
        assert_eq!(triangles.len(), 6);
        assert!(areas.iter().all(|&a| a > 0.0), "{areas:?}");
        let exact = 8.0 * 0.5 * 2.0 * 0.6 * std::f64::consts::FRAC_1_SQRT_2;
        assert!((areas.iter().sum::<f64>() - exact).abs() < 1e-12);
    }

    #[test]
    fn a_dart_is_cut_through_its_inner_corner() {
        let (points, corners) = polygon(&[(0.0, 0.0), (2.0, 1.0), (0.0, 2.0), (0.5, 1.0)]);
        let mut triangles = vec![];
        assert!(triangulate(&points, &corners, &mut triangles));
        assert!(areas(&points, &triangles).iter().all(|&a| a > 0.0));
    }

    #[test]
    fn collinear_corners_stay() {
        let (points, corners) =
            polygon(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)]);
        let mut triangles = vec![];
        assert!(triangulate(&points, &corners, &mut triangles));
        assert!(areas(&points, &triangles).iter().all(|&a| a > 0.0));
        assert!(triangles.iter().flatten().any(|&v| v == 1));
    }

    #[test]
    fn a_hole_joined_by_a_seam_is_left_open() {
        // A 4 × 4 square and a 2 × 2 hole with the opposite winding. The seam 0–4 is passed in both
        // directions.
        let (mut points, _) = polygon(&[(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)]);
        points.extend(polygon(&[(1.0, 1.0), (1.0, 3.0), (3.0, 3.0), (3.0, 1.0)]).0);
        let mut triangles = vec![];
        let ring = [0, 1, 2, 3, 0, 4, 5, 6, 7, 4];
        assert!(triangulate(&points, &ring, &mut triangles));
        let areas = areas(&points, &triangles);
        assert!(areas.iter().all(|&a| a > 0.0), "{areas:?}");
        assert!((areas.iter().sum::<f64>() - 12.0).abs() < 1e-12);
    }

    #[test]
    fn folded_and_flat_polygons_still_end() {
        for xy in [
            vec![(0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0), (1.0, 3.0)],
            vec![(0.0, 0.0); 7],
            vec![
                (f64::NAN, 0.0),
                (1.0, f64::INFINITY),
                (0.0, 1.0),
                (3.0, 4.0),
                (5.0, 5.0),
            ],
        ] {
            let (points, corners) = polygon(&xy);
            let mut triangles = vec![];
            assert!(!triangulate(&points, &corners, &mut triangles));
            assert_eq!(triangles.len(), xy.len() - 2);
        }
    }
}
