//! Lumps for display: their share of every prism, and their surface as it moves with the tissue.

use palpa_fem::lump::Lump;
use palpa_mesh::{LayeredBody, Surface, Vec3};

/// Number of sample points along each side of a triangle, and over the height of a prism.
const IN_PLANE: usize = 4;
const IN_DEPTH: usize = 4;
/// To compute a lump's share in the tissue: least number of points inside it, and the number of
/// grid cells across it at first and at most.
const FEWEST_POINTS: usize = 500;
const FIRST_CELLS: usize = 12;
const MOST_CELLS: usize = 48;
/// Tolerance of the point-in-tetrahedron test, as a share of the tetrahedron's height. Neighbouring
/// prisms may be cut along different diagonals of a bent side, which leaves gaps.
const OUTSIDE: f64 = 0.02;
/// Number of corners around the surface of a lump of a simple shape, and from pole to pole.
const AROUND: usize = 48;
const UPWARD: usize = 24;

/// Share of each prism's volume that belongs to lumps, sampled; empty without lumps. `[n_prisms]`
pub fn lump_shares(body: &LayeredBody, lumps: &[Lump]) -> Vec<f64> {
    if lumps.is_empty() {
        return Vec::new();
    }
    let n_intervals = body.n_levels - 1;
    (0..body.n_prisms())
        .map(|p| {
            let nodes = body.prism(p / n_intervals, p % n_intervals);
            let corners = nodes.map(|n| body.positions[n]);
            let middle = corners.iter().sum::<Vec3>() / 6.0;
            let reach = (corners.iter().map(|c| (c - middle).norm())).fold(0.0, f64::max);
            let nearby: Vec<&Lump> = (lumps.iter())
                .filter(|lump| {
                    let (centre, radius) = lump.bounding_sphere();
                    (centre - middle).norm() < radius + reach
                })
                .collect();
            if nearby.is_empty() {
                return 0.0;
            }
            let (mut sum, mut n) = (0.0, 0.0);
            for x in samples(&corners) {
                // Where lumps overlap, the share stays at most 1.
                let left: f64 = nearby.iter().map(|lump| 1.0 - lump.fraction(&x)).product();
                sum += 1.0 - left;
                n += 1.0;
            }
            sum / n
        })
        .collect()
}

/// Points spread evenly over a prism.
fn samples(corners: &[Vec3; 6]) -> impl Iterator<Item = Vec3> + '_ {
    let n = IN_PLANE as f64;
    let upright = (0..IN_PLANE).flat_map(move |i| {
        (0..IN_PLANE - i).map(move |j| [i as f64 + 1.0 / 3.0, j as f64 + 1.0 / 3.0])
    });
    let turned = (0..IN_PLANE - 1).flat_map(move |i| {
        (0..IN_PLANE - 1 - i).map(move |j| [i as f64 + 2.0 / 3.0, j as f64 + 2.0 / 3.0])
    });
    upright.chain(turned).flat_map(move |[i, j]| {
        let weights = [1.0 - (i + j) / n, i / n, j / n];
        (0..IN_DEPTH).map(move |k| {
            let down = (k as f64 + 0.5) / IN_DEPTH as f64;
            (0..3)
                .map(|c| corners[c].lerp(&corners[c + 3], down) * weights[c])
                .sum()
        })
    })
}

/// Share of a lump's volume that lies in the body, sampled.
pub fn share_inside(body: &LayeredBody, lump: &Lump) -> f64 {
    let points = points_inside(lump);
    if points.is_empty() {
        return 1.0; // too thin to be sampled
    }
    let is_in_body = |embedded: &&[f64; 4]| embedded.iter().all(|w| *w >= -OUTSIDE);
    let found = nearest_tetrahedra(body, &points);
    let n_in_body = found.iter().map(|(_, weights)| weights).filter(is_in_body);
    n_in_body.count() as f64 / points.len() as f64
}

/// Points spread evenly over the inside of a lump, m.
fn points_inside(lump: &Lump) -> Vec<Vec3> {
    let (middle, reach) = lump.bounding_sphere();
    let mut n = FIRST_CELLS;
    loop {
        let at = |i: usize| reach * ((2 * i + 1) as f64 / n as f64 - 1.0);
        let cells = (0..n).flat_map(|i| (0..n).flat_map(move |j| (0..n).map(move |k| [i, j, k])));
        let points: Vec<Vec3> = cells
            .map(|cell| middle + Vec3::from(cell.map(at)))
            .filter(|p| lump.signed_distance(p) < 0.0)
            .collect();
        if points.len() >= FEWEST_POINTS || n >= MOST_CELLS {
            return points;
        }
        n *= 2;
    }
}

/// The surface at rest of a lump of a simple convex shape, m.
pub(crate) fn surface_of_shape(lump: &Lump) -> Surface {
    let (middle, reach) = lump.bounding_sphere();
    let axes = lump.pose().rotation;
    let point = |j: usize, i: usize| {
        let up = std::f64::consts::PI * (j as f64 / UPWARD as f64 - 0.5);
        let round = std::f64::consts::TAU * i as f64 / AROUND as f64;
        // The poles lie on the long axis.
        let direction = Vec3::new(up.sin(), up.cos() * round.cos(), up.cos() * round.sin());
        middle + axes * direction * border(lump, &middle, &(axes * direction), 2.0 * reach)
    };
    let mut points = vec![point(0, 0)];
    points.extend(
        (1..UPWARD)
            .flat_map(|j| (0..AROUND).map(move |i| (j, i)))
            .map(|(j, i)| point(j, i)),
    );
    points.push(point(UPWARD, 0));
    let last = points.len() as u32 - 1;
    let at = |j: usize, i: usize| match j {
        0 => 0,
        UPWARD => last,
        _ => (1 + (j - 1) * AROUND + i % AROUND) as u32,
    };
    let triangles = (0..UPWARD)
        .flat_map(|j| (0..AROUND).map(move |i| (j, i)))
        .flat_map(|(j, i)| {
            [
                [at(j, i), at(j, i + 1), at(j + 1, i + 1)],
                [at(j, i), at(j + 1, i + 1), at(j + 1, i)],
            ]
        })
        .filter(|[a, b, c]| a != b && b != c && c != a)
        .collect();
    Surface { points, triangles }
}

/// Distance from the middle of a convex lump to its surface in a direction, m.
fn border(lump: &Lump, middle: &Vec3, direction: &Vec3, most: f64) -> f64 {
    let (mut inside, mut outside) = (0.0, most);
    for _ in 0..50 {
        let half = f64::midpoint(inside, outside);
        if lump.signed_distance(&(middle + direction * half)) < 0.0 {
            inside = half;
        } else {
            outside = half;
        }
    }
    f64::midpoint(inside, outside)
}

/// Points inside a body that move with it.
#[derive(Debug)]
pub struct Embedded {
    /// For each point, four nodes and their weights.
    nodes: Vec<[usize; 4]>,
    weights: Vec<[f64; 4]>,
}

impl Embedded {
    /// Finds for each point (m, at rest) the tetrahedron that contains it; each prism is divided
    /// into tetrahedra. A point outside the body uses the nearest one.
    pub fn new(body: &LayeredBody, points: &[Vec3]) -> Self {
        let found = nearest_tetrahedra(body, points);
        Self {
            nodes: found.iter().map(|f| f.0).collect(),
            weights: found
                .iter()
                .map(|f| {
                    let inside = f.1.map(|w| w.max(0.0));
                    let sum: f64 = inside.iter().sum();
                    inside.map(|w| if sum > 0.0 { w / sum } else { 0.0 })
                })
                .collect(),
        }
    }

    /// Displacement of each point from those of the nodes, m.
    pub fn displacements(&self, of_nodes: &[Vec3]) -> Vec<Vec3> {
        (self.nodes.iter().zip(&self.weights))
            .map(|(nodes, weights)| {
                (nodes.iter().zip(weights))
                    .map(|(&n, &w)| of_nodes[n] * w)
                    .sum()
            })
            .collect()
    }
}

/// For each point (m, at rest), four nodes and their weights: of the tetrahedron that contains the
/// point, or of the nearest one. Outside a tetrahedron one weight is negative. If no tetrahedron is
/// near the points, all weights are negative.
fn nearest_tetrahedra(body: &LayeredBody, points: &[Vec3]) -> Vec<([usize; 4], [f64; 4])> {
    let far = f64::NEG_INFINITY;
    let mut found = vec![([0; 4], [far; 4]); points.len()];
    let mut least_of = vec![far; points.len()];
    let bounds = points.iter().fold(
        (Vec3::repeat(f64::INFINITY), Vec3::repeat(far)),
        |(lo, hi), p| (lo.inf(p), hi.sup(p)),
    );
    for t in 0..body.skin.triangles.len() {
        for i in 0..body.n_levels - 1 {
            let prism = body.prism(t, i);
            let corners = prism.map(|n| body.positions[n]);
            let (lo, hi) = corners
                .iter()
                .fold((corners[0], corners[0]), |(lo, hi), c| {
                    (lo.inf(c), hi.sup(c))
                });
            if (0..3).any(|k| hi[k] < bounds.0[k] || lo[k] > bounds.1[k]) {
                continue;
            }
            for tet in [[0, 1, 2, 5], [0, 1, 5, 4], [0, 4, 5, 3]] {
                let Some(inverse) = inverse(&tet.map(|k| corners[k])) else {
                    continue;
                };
                for ((point, best), best_least) in points.iter().zip(&mut found).zip(&mut least_of)
                {
                    let w = inverse * (point - corners[tet[0]]);
                    let weights = [1.0 - w.sum(), w.x, w.y, w.z];
                    // Inside, the least weight is positive. Outside, the tetrahedron with the
                    // largest least weight is the nearest.
                    let least = weights.iter().copied().fold(f64::INFINITY, f64::min);
                    if least > *best_least {
                        (*best_least, *best) = (least, (tet.map(|k| prism[k]), weights));
                    }
                }
            }
        }
    }
    found
}

/// The matrix that gives the weights of the last three corners; `None` for a flat tetrahedron.
fn inverse(corners: &[Vec3; 4]) -> Option<nalgebra::Matrix3<f64>> {
    let edges = [1, 2, 3].map(|k| corners[k] - corners[0]);
    nalgebra::Matrix3::from_columns(&edges).try_inverse()
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpa_fem::lump::LumpShape;
    use palpa_fem::shape::{Pose, Sphere};
    use palpa_mesh::generate;

    fn block() -> LayeredBody {
        let skin = generate::block_skin([0.04, 0.04], 0.005);
        let layer = palpa_mesh::LayerSpec {
            name: "all".into(),
            thickness: Some(palpa_mesh::growth::Thickness::Constant(0.02)),
            n_levels: 4,
            min_thickness: 1e-3,
        };
        let params = palpa_mesh::GrowthParams {
            layers: vec![layer],
            cut_out: None,
            coarsening: None,
            max_nodes: palpa_mesh::growth::MAX_NODES,
        };
        palpa_mesh::grow(&skin, &[], &params).unwrap().body
    }

    #[test]
    fn shares_of_a_ball_add_up_to_its_volume() {
        let body = block();
        let pose = Pose::translation(0.001, 0.002, -0.01);
        let shape = LumpShape::Sphere(Sphere::new(0.006).unwrap());
        let lump = Lump::new(shape, pose, 0.0, 1).unwrap();
        let shares = lump_shares(&body, std::slice::from_ref(&lump));
        // All prisms of the block are alike.
        let each = 0.04 * 0.04 * 0.02 / body.n_prisms() as f64;
        let volume = shares.iter().sum::<f64>() * each;
        assert!(
            (volume / lump.volume() - 1.0).abs() < 0.05,
            "{volume} of {}",
            lump.volume()
        );
    }

    #[test]
    fn the_share_of_a_ball_in_the_body_is_that_of_its_volume() {
        let body = block();
        for (z, share) in [(-0.01, 1.0), (0.0, 0.5), (0.5, 0.0)] {
            let pose = Pose::translation(0.001, 0.002, z);
            let shape = LumpShape::Sphere(Sphere::new(0.006).unwrap());
            let lump = Lump::new(shape, pose, 0.0, 1).unwrap();
            let found = share_inside(&body, &lump);
            assert!((found - share).abs() < 0.03, "{z}: {found}");
        }
    }

    #[test]
    fn points_fill_a_long_lump() {
        let shape = LumpShape::Capsule(palpa_fem::shape::Capsule::new(0.001, 0.02).unwrap());
        let lump = Lump::new(shape, Pose::identity(), 0.0, 1).unwrap();
        assert!(points_inside(&lump).len() > 100);
    }

    #[test]
    fn embedded_points_follow_an_affine_map() {
        let body = block();
        let points = [
            Vec3::new(0.0012, -0.0034, -0.0071),
            Vec3::new(-0.011, 0.004, -0.0002),
        ];
        let stretch = nalgebra::Matrix3::new(0.1, 0.2, 0.0, -0.3, 0.05, 0.1, 0.0, 0.4, -0.2);
        let of_nodes: Vec<Vec3> = body.positions.iter().map(|p| stretch * p).collect();
        let moved = Embedded::new(&body, &points).displacements(&of_nodes);
        for (moved, point) in moved.iter().zip(&points) {
            assert!((moved - stretch * point).norm() < 1e-15, "{moved}");
        }
    }
}
