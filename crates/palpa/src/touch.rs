//! The first touch of a tool that moves straight down to the skin.
//!
//! The skin is its triangles, not only their corners. So the depth of a press, which counts from
//! the first touch, does not depend on where the vertices lie.

use palpa_fem::shape::{Distance, Pose, Tool};
use palpa_mesh::Vec3;

/// The touch is found to this accuracy, m: parts of triangles that are smaller are not divided, and
/// a tool this deep in the skin touches it.
const TOLERANCE: f64 = 1e-8;
/// Largest number of parts in a generation. Some hundreds are usual; there are more only if a line
/// or a face of the tool lies on the skin almost exactly.
const MOST_PARTS: usize = 100_000;
const HALVINGS: usize = 60;
/// The tool is moved back by no more than this to get it off the skin, m.
const FARTHEST: f64 = 1.0;

/// A tool on its way along a straight line.
pub(crate) struct Way<'a> {
    /// The tool.
    pub(crate) tool: &'a Tool,
    /// Its pose with the tip on the skin.
    pub(crate) pose: &'a Pose,
    /// Unit vector of its movement.
    pub(crate) direction: Vec3,
}

impl Way<'_> {
    /// Distance along the way from the tool's pose to its first touch with one of the triangles, m:
    /// 0 if the tip touches first, negative if the skin beside the tip is higher.
    ///
    /// The distance f of a convex tool is a convex function: `f(y) ≥ f(x) + n(x)·(y − x)`. So a few
    /// points of a triangle bound the distance of the whole triangle from below. Triangles that the
    /// tool could reach before the first touch found so far are divided into four, generation by
    /// generation.
    pub(crate) fn first_touch(&self, triangles: impl Iterator<Item = [Vec3; 3]>) -> f64 {
        let mut touch = 0.0;
        let mut parts: Vec<_> = triangles.collect();
        loop {
            parts.retain(|part| self.may_touch(part, &mut touch));
            if parts.is_empty() || parts.len() > MOST_PARTS {
                return touch;
            }
            parts = parts.into_iter().flat_map(quarters).collect();
        }
    }

    /// Whether a part of a triangle may be touched earlier than at `touch` and has to be divided.
    /// If one of the points looked at is touched earlier, `touch` becomes that.
    fn may_touch(&self, part: &[Vec3; 3], touch: &mut f64) -> bool {
        let middle = part.iter().sum::<Vec3>() / 3.0;
        let size = (part.iter())
            .map(|p| (p - middle).norm())
            .fold(0.0, f64::max);
        if self.gap(*touch, &middle).distance - size >= -TOLERANCE {
            return false;
        }
        let points = [middle, part[0], part[1], part[2]];
        for p in &points {
            if self.gap(*touch, p).distance < -1e-3 * TOLERANCE {
                *touch = self.touch_of(p, *touch);
            }
        }
        if size < TOLERANCE {
            return false;
        }
        // The tangent at each of the points: its values at the three corners.
        let tangents = points.map(|p| {
            let gap = self.gap(*touch, &p);
            part.map(|q| gap.distance + gap.normal.dot(&(q - p)))
        });
        let is_free = |(i, j): (usize, usize)| least(tangents[i], tangents[j]) >= -TOLERANCE;
        !(0..4)
            .flat_map(|i| (0..=i).map(move |j| (i, j)))
            .any(is_free)
    }

    /// The distance of a point from the tool after the tool has moved by `s`.
    fn gap(&self, s: f64, p: &Vec3) -> Distance {
        self.tool.distance_at(self.pose, &(p - self.direction * s))
    }

    /// Distance along the way at which the tool touches a point that is inside it at `deep`.
    fn touch_of(&self, p: &Vec3, deep: f64) -> f64 {
        let mut back = 1e-4;
        while self.gap(deep - back, p).distance < 0.0 && back < FARTHEST {
            back *= 2.0;
        }
        let (mut free, mut deep) = (deep - back, deep);
        for _ in 0..HALVINGS {
            let middle = f64::midpoint(free, deep);
            if self.gap(middle, p).distance < 0.0 {
                deep = middle;
            } else {
                free = middle;
            }
        }
        free
    }
}

/// A lower bound in a triangle of the larger of two linear functions, which are given by their values
/// at the corners: the least value of the best mixture of the two.
fn least(a: [f64; 3], b: [f64; 3]) -> f64 {
    let of_mixture = |share: f64| {
        (0..3)
            .map(|k| b[k] + share * (a[k] - b[k]))
            .fold(f64::INFINITY, f64::min)
    };
    // The best mixture is one of the two, or has equal values at two corners.
    let equal = [(0, 1), (1, 2), (2, 0)].map(|(k, l)| (b[l] - b[k]) / (a[k] - b[k] - a[l] + b[l]));
    (equal.into_iter().filter(|share| (0.0..1.0).contains(share)))
        .chain([0.0, 1.0])
        .map(of_mixture)
        .fold(f64::NEG_INFINITY, f64::max)
}

/// The four parts of a triangle, divided at the middles of its edges.
fn quarters([a, b, c]: [Vec3; 3]) -> [[Vec3; 3]; 4] {
    let [ab, bc, ca] = [(a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0];
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpa_fem::shape::{Capsule, Cone, Ellipsoid, FlatPunch, RoundedBox, Shape, Sphere};

    fn shapes() -> Vec<Shape> {
        vec![
            Sphere::new(0.008).unwrap().into(),
            FlatPunch::new(0.005, 0.0).unwrap().into(),
            FlatPunch::new(0.005, 0.001).unwrap().into(),
            Capsule::new(0.004, 0.012).unwrap().into(),
            RoundedBox::new(Vec3::new(0.006, 0.004, 0.003), 0.0)
                .unwrap()
                .into(),
            Ellipsoid::new(Vec3::new(0.008, 0.007, 0.006))
                .unwrap()
                .into(),
            Cone::new(0.006, 0.7, 0.0005, 0.0005).unwrap().into(),
        ]
    }

    /// A bumpy skin of 5 × 5 cells of 5 mm round the origin, its height 0 at the origin.
    fn bumpy(slope: f64, seed: u64) -> Vec<[Vec3; 3]> {
        let p = |i: usize, j: usize| {
            let [x, y] = [i, j].map(|i| 0.005 * (i as f64 - 2.5));
            // The cell in the middle is a plane through the origin.
            let is_middle = (2..4).contains(&i) && (2..4).contains(&j);
            let bump = if is_middle {
                0.0
            } else {
                1e-3 * ((37 * seed + 7 * i as u64 + 13 * j as u64) as f64).sin()
            };
            Vec3::new(x, y, slope * x + bump)
        };
        let cells = (0..5).flat_map(|i| (0..5).map(move |j| (i, j)));
        cells
            .flat_map(|(i, j)| {
                let [a, b, c, d] = [p(i, j), p(i + 1, j), p(i + 1, j + 1), p(i, j + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect()
    }

    #[test]
    fn the_tool_touches_the_triangles_and_passes_through_none() {
        const N: i32 = 100;
        for (seed, shape) in shapes().into_iter().cycle().take(21).enumerate() {
            let triangles = bumpy([0.0, 0.3, -0.6][seed / 7], seed as u64);
            let tool = Tool::new(shape, 0.0).unwrap();
            let way = Way {
                tool: &tool,
                pose: &Pose::identity(),
                direction: -Vec3::z(),
            };
            let touch = way.first_touch(triangles.iter().copied());
            let mut least = f64::INFINITY;
            for [a, b, c] in &triangles {
                for i in 0..=N {
                    for j in 0..=N - i {
                        let [u, v] = [i, j].map(|i| f64::from(i) / f64::from(N));
                        let p = a * (1.0 - u - v) + b * u + c * v;
                        least = least.min(way.gap(touch, &p).distance);
                    }
                }
            }
            // Samples are 50 µm apart. Beside a sharp edge they are off by up to half of that.
            assert!(
                (-4.0 * TOLERANCE..20e-6).contains(&least),
                "{} {seed}: {least}",
                shape.name()
            );
            assert!(touch <= 0.0);
        }
    }

    #[test]
    fn on_a_plane_the_touch_of_a_ball_is_known() {
        let plane = |slope: f64| {
            let p = |x: f64, y: f64| Vec3::new(x, y, slope * x);
            [
                [p(-0.1, -0.1), p(0.2, -0.1), p(-0.1, 0.3)],
                [p(0.2, -0.1), p(0.2, 0.3), p(-0.1, 0.3)],
            ]
        };
        let tool = Tool::new(Sphere::new(0.01).unwrap(), 0.0).unwrap();
        let touch = |slope: f64| {
            let way = Way {
                tool: &tool,
                pose: &Pose::identity(),
                direction: -Vec3::z(),
            };
            way.first_touch(plane(slope).into_iter())
        };
        assert!(touch(0.0).abs() < 1e-15);
        for slope in [0.1_f64, -0.5, 1.0] {
            // The middle of the ball is as far from the plane as its radius.
            let higher = 0.01 * ((1.0 + slope * slope).sqrt() - 1.0);
            assert!((touch(slope) + higher).abs() < 4.0 * TOLERANCE, "{slope}");
        }
    }

    #[test]
    fn a_flat_face_rests_on_a_plane_of_many_triangles() {
        let flat = bumpy(0.0, 0)
            .into_iter()
            .map(|t| t.map(|p| Vec3::new(p.x, p.y, 0.0)));
        for shape in shapes() {
            let tool = Tool::new(shape, 0.0).unwrap();
            let way = Way {
                tool: &tool,
                pose: &Pose::identity(),
                direction: -Vec3::z(),
            };
            let touch = way.first_touch(flat.clone());
            assert!(touch.abs() < 1e-15, "{}: {touch}", shape.name());
        }
    }
}
