//! Shape of prisms: the smallest Jacobian determinant anywhere in a prism, and the scaled Jacobian.
//!
//! ```text
//! upper triangle v0 v1 v2 (ζ = 0, towards the skin), lower v3 v4 v5 (ζ = 1)
//! x(ξ, η, ζ) = Σ N_a(ξ, η, ζ) x_a,  N_a = λ_i (1 − ζ) or λ_i ζ,  λ = (1 − ξ − η, ξ, η)
//! ```
//! Seen from outside the skin, v0 v1 v2 run counter-clockwise and ζ points inward, so
//! `det ∂x/∂(ξ, η, ζ)` of a good prism is *negative*. Everything in this module returns the
//! sign-corrected value, which is positive for a good prism.
//!
//! Along a column at corner i, with edge vectors that go linearly from the upper to the lower triangle, the determinant is
//! a parabola in ζ; across the triangle it is linear. So its smallest value lies on one of the three columns, and is known
//! exactly. If it is positive, each part of the prism is valid, too, however finely the mesh is divided later.

use crate::{LayeredBody, Vec3};

/// Quadrature points of an element: 3 in the triangle, times 2 in depth.
const TRIANGLE_POINTS: [[f64; 2]; 3] = [
    [1.0 / 6.0, 1.0 / 6.0],
    [2.0 / 3.0, 1.0 / 6.0],
    [1.0 / 6.0, 2.0 / 3.0],
];
const DEPTH_POINTS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

/// The shape of one prism.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrismShape {
    /// Smallest Jacobian determinant anywhere in the prism. m³
    pub min_jacobian: f64,
    /// Smallest scaled Jacobian of the six corners. It is the determinant divided by the lengths of
    /// the three edges at the corner, times 2/√3, so that a right prism over an equilateral
    /// triangle has 1. Below 0, the prism is inverted.
    pub scaled_jacobian: f64,
}

impl PrismShape {
    /// Measures the prism with corners `x`: upper triangle, then lower triangle.
    pub fn of(x: &[Vec3; 6]) -> Self {
        let mut scaled = f64::INFINITY;
        let mut ends = [0.0; 6];
        for corner in 0..6 {
            let (i, base) = (corner % 3, corner - corner % 3);
            let e1 = x[base + (i + 1) % 3] - x[corner];
            let e2 = x[base + (i + 2) % 3] - x[corner];
            let e3 = x[i + 3] - x[i];
            let det = -e1.cross(&e2).dot(&e3);
            ends[corner] = det;
            let lengths = e1.norm() * e2.norm() * e3.norm();
            scaled = scaled.min(if lengths > 0.0 {
                det / lengths * 2.0 / 3.0_f64.sqrt()
            } else {
                0.0
            });
        }
        // The edges across do not depend on the column.
        let [upper, lower] = [0, 3].map(|base| [x[base + 1] - x[base], x[base + 2] - x[base]]);
        let across = upper[0].cross(&lower[1]) + lower[0].cross(&upper[1]);
        let min_jacobian = (0..3)
            .map(|i| {
                let middle = -0.5 * across.dot(&(x[i + 3] - x[i]));
                least_of_parabola([ends[i], middle, ends[i + 3]])
            })
            .fold(f64::INFINITY, f64::min);
        // The minimum ignores NaN. A corner that is not finite must not count as good.
        if !x.iter().all(|p| p.iter().all(|c| c.is_finite())) {
            return Self {
                min_jacobian: f64::NAN,
                scaled_jacobian: -1.0,
            };
        }
        // The value is limited to 1: a right prism over a flat triangle can exceed it, by rounding
        // or by an obtuse corner.
        Self {
            min_jacobian,
            scaled_jacobian: scaled.clamp(-1.0, 1.0),
        }
    }

    /// Whether every determinant is positive. NaN is not valid.
    pub fn is_valid(&self) -> bool {
        self.min_jacobian > 0.0
    }
}

/// The smallest value in 0 ≤ ζ ≤ 1 of a (1 − ζ)² + 2 b ζ (1 − ζ) + c ζ².
fn least_of_parabola([a, b, c]: [f64; 3]) -> f64 {
    if b < a.min(c) {
        (a * c - b * b) / (a - 2.0 * b + c)
    } else {
        a.min(c)
    }
}

/// Sign-corrected determinant of the prism's map at a point.
fn jacobian(x: &[Vec3; 6], xi: f64, eta: f64, zeta: f64) -> f64 {
    let lambda = [1.0 - xi - eta, xi, eta];
    let d_xi = (x[1] - x[0]) * (1.0 - zeta) + (x[4] - x[3]) * zeta;
    let d_eta = (x[2] - x[0]) * (1.0 - zeta) + (x[5] - x[3]) * zeta;
    let d_zeta: Vec3 = (0..3).map(|i| (x[i + 3] - x[i]) * lambda[i]).sum();
    -d_xi.cross(&d_eta).dot(&d_zeta)
}

/// The shapes of all prisms at the given node positions, ordered by triangle, then by interval.
/// `[n_prisms]`
///
/// # Panics
/// If `positions` does not hold one point per node.
pub fn prism_shapes(body: &LayeredBody, positions: &[Vec3]) -> Vec<PrismShape> {
    assert_eq!(positions.len(), body.n_nodes(), "one position per node");
    (0..body.skin.triangles.len())
        .flat_map(|t| (0..body.n_levels - 1).map(move |i| (t, i)))
        .map(|(t, i)| PrismShape::of(&body.prism(t, i).map(|n| positions[n])))
        .collect()
}

/// Volume of the prism with corners `x` (exact for the trilinear map: 3 × 2 points). m³
pub fn prism_volume(x: &[Vec3; 6]) -> f64 {
    let sum: f64 = TRIANGLE_POINTS
        .iter()
        .flat_map(|&[xi, eta]| {
            DEPTH_POINTS
                .iter()
                .map(move |&zeta| jacobian(x, xi, eta, zeta))
        })
        .sum();
    sum / 12.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn right_prism(height: f64) -> [Vec3; 6] {
        let top = [
            Vec3::zeros(),
            Vec3::x(),
            Vec3::new(0.5, 0.75_f64.sqrt(), 0.0),
        ];
        std::array::from_fn(|i| top[i % 3] - Vec3::z() * if i < 3 { 0.0 } else { height })
    }

    #[test]
    fn a_right_prism_over_an_equilateral_triangle_is_perfect() {
        for height in [0.01, 1.0, 30.0] {
            let shape = PrismShape::of(&right_prism(height));
            assert!(
                (shape.scaled_jacobian - 1.0).abs() < 1e-12 && shape.is_valid(),
                "{shape:?}"
            );
            let volume = 0.75_f64.sqrt() / 2.0 * height;
            assert!((prism_volume(&right_prism(height)) / volume - 1.0).abs() < 1e-12);
            assert!((shape.min_jacobian / (2.0 * volume) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn turned_over_flat_and_unknown_prisms_are_not_valid() {
        let turned = PrismShape::of(&right_prism(-1.0));
        assert!(!turned.is_valid() && turned.scaled_jacobian < -0.99);
        assert!(!PrismShape::of(&right_prism(0.0)).is_valid());
        let mut one_corner_through = right_prism(1.0);
        one_corner_through[4].z = 0.1;
        assert!(!PrismShape::of(&one_corner_through).is_valid());
        for bad in [f64::NAN, f64::INFINITY] {
            let mut x = right_prism(1.0);
            x[2].y = bad;
            assert!(!PrismShape::of(&x).is_valid(), "{bad}");
        }
    }

    /// The smallest determinant is found anywhere in a prism, also where neither its corners nor the points of a
    /// quadrature show that it is folded.
    #[test]
    fn the_smallest_determinant_is_exact() {
        const N: usize = 200;
        let mut seed = 1_u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(seed) / f64::from(u32::MAX) - 0.5
        };
        let mut n_hidden = 0;
        for _ in 0..3000 {
            let x = right_prism(1.0).map(|p| p + 1.4 * Vec3::new(random(), random(), random()));
            let shape = PrismShape::of(&x);
            let at = |xi: f64, eta: f64, zeta: f64| jacobian(&x, xi, eta, zeta);
            let sampled = (0..=N)
                .flat_map(|k| {
                    [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|c| (c, k as f64 / N as f64))
                })
                .map(|([xi, eta], zeta)| at(xi, eta, zeta))
                .fold(f64::INFINITY, f64::min);
            let off = sampled - shape.min_jacobian;
            assert!((-1e-12..1e-3).contains(&off), "{sampled} {shape:?}");
            let seems_good = shape.scaled_jacobian > 0.0
                && TRIANGLE_POINTS
                    .iter()
                    .all(|&[xi, eta]| DEPTH_POINTS.iter().all(|&zeta| at(xi, eta, zeta) > 0.0));
            n_hidden += usize::from(seems_good && !shape.is_valid());
        }
        assert!(n_hidden > 0);
    }
}
