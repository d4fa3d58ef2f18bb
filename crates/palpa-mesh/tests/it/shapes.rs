//! Surfaces by formula, for the tests to damage.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use palpa_mesh::{Surface, Vec3};

/// A unit sphere: an icosahedron with every edge halved `n` times. Closed, outward, `20 · 4ⁿ`
/// triangles.
pub(crate) fn icosphere(n: usize) -> Surface {
    let g = f64::midpoint(1.0, 5.0_f64.sqrt());
    let corners = [
        [-1.0, g, 0.0],
        [1.0, g, 0.0],
        [-1.0, -g, 0.0],
        [1.0, -g, 0.0],
        [0.0, -1.0, g],
        [0.0, 1.0, g],
        [0.0, -1.0, -g],
        [0.0, 1.0, -g],
        [g, 0.0, -1.0],
        [g, 0.0, 1.0],
        [-g, 0.0, -1.0],
        [-g, 0.0, 1.0],
    ];
    let mut points: Vec<Vec3> = corners.iter().map(|&c| Vec3::from(c).normalize()).collect();
    let mut triangles: Vec<[u32; 3]> = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    for _ in 0..n {
        let mut middles: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                points.push((points[a as usize] + points[b as usize]).normalize());
                points.len() as u32 - 1
            })
        };
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    Surface { points, triangles }
}

/// The side of a cylinder of radius 0.04 and length 0.2 along x, open at both ends, outward.
/// `2 · around · along` triangles.
pub(crate) fn tube(around: u32, along: u32) -> Surface {
    let point = |i: u32, j: u32| {
        let (sin, cos) = (TAU * f64::from(i) / f64::from(around)).sin_cos();
        Vec3::new(
            0.2 * f64::from(j) / f64::from(along),
            0.04 * cos,
            0.04 * sin,
        )
    };
    let points = (0..=along)
        .flat_map(|j| (0..around).map(move |i| point(i, j)))
        .collect();
    let id = |i: u32, j: u32| j * around + i % around;
    let triangles = (0..along)
        .flat_map(|j| (0..around).map(move |i| (i, j)))
        .flat_map(|(i, j)| {
            [
                [id(i, j), id(i + 1, j), id(i + 1, j + 1)],
                [id(i, j), id(i + 1, j + 1), id(i, j + 1)],
            ]
        })
        .collect();
    Surface { points, triangles }
}

/// A Möbius strip of `n` quadrilaterals.
pub(crate) fn moebius(n: u32) -> Surface {
    let points = (0..n)
        .flat_map(|i| {
            let u = TAU * f64::from(i) / f64::from(n);
            [-0.3, 0.3].map(|v| {
                let r = 1.0 + v * (u / 2.0).cos();
                Vec3::new(r * u.cos(), r * u.sin(), v * (u / 2.0).sin())
            })
        })
        .collect();
    let id = |i: u32, side: u32| 2 * (i % n) + if i < n { side } else { 1 - side };
    let triangles = (0..n)
        .flat_map(|i| {
            [
                [id(i, 0), id(i, 1), id(i + 1, 0)],
                [id(i, 1), id(i + 1, 1), id(i + 1, 0)],
            ]
        })
        .collect();
    Surface { points, triangles }
}

/// Two surfaces as one, sharing nothing.
pub(crate) fn joined(a: &Surface, b: &Surface) -> Surface {
    let n = a.points.len() as u32;
    let moved = b.triangles.iter().map(|t| t.map(|v| v + n));
    Surface {
        points: a.points.iter().chain(&b.points).copied().collect(),
        triangles: a.triangles.iter().copied().chain(moved).collect(),
    }
}

pub(crate) fn moved(surface: &Surface, by: [f64; 3]) -> Surface {
    Surface {
        points: surface.points.iter().map(|p| p + Vec3::from(by)).collect(),
        triangles: surface.triangles.clone(),
    }
}
