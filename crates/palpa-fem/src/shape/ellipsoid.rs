//! An ellipsoid. Its distance has no closed form: the nearest point is the root of one equation.
//!
//! ```text
//! surface      Σ (xᵢ/eᵢ)² = 1
//! nearest      xᵢ = eᵢ² pᵢ / (t + eᵢ²)                   from p − x = t ∇, with ∇ᵢ = xᵢ/eᵢ²
//! equation     N(t) = ‖eᵢ pᵢ / (t + eᵢ²)‖ = 1             its largest root, t > −min eᵢ²
//! distance     t ‖∇‖, normal ∇/‖∇‖, shape operator  S = (1 − n nᵀ) diag(1/eᵢ²) (1 − n nᵀ) / ‖∇‖
//! ```
//! N falls from ∞ to 0 there, and 1/N is concave and nearly straight, so Newton's method on 1/N = 1
//! from the left converges in a few steps without overshooting (as in trust regions: Conn, Gould,
//! Toint 2000, §7.3.3).

use palpa_mesh::Vec3;

use super::{Distance, RigidShape, ShapeError, along, checked, offset_radius};
use crate::Mat3;

const NAME: &str = "ellipsoid";

/// More steps than rounding leaves to take; from a bad start an aspect ratio of 10⁷ takes about
/// ten.
const MAX_STEPS: usize = 60;

/// Coordinates below this share of the shortest radius are none: their squares would vanish.
const NOTHING: f64 = 1e-100;

/// An ellipsoid with its axes along x, y and z, resting on its tip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipsoid {
    radii: Vec3,
}

impl Ellipsoid {
    /// An ellipsoid of these radii along x, y and z, in metres.
    ///
    /// # Errors
    /// When one of them is not between 1 µm and 10 m.
    pub fn new(radii: Vec3) -> Result<Self, ShapeError> {
        for (what, value) in ["radius along x", "radius along y", "radius along z"]
            .into_iter()
            .zip(radii.iter())
        {
            checked(NAME, what, *value)?;
        }
        Ok(Self { radii })
    }

    /// Its radii along x, y and z. m
    pub fn radii(&self) -> Vec3 {
        self.radii
    }

    /// The distance of a point given from the ellipsoid's middle.
    pub(crate) fn distance_centred(&self, p: &Vec3) -> Distance {
        let nearest = self.nearest(p);
        let gradient = nearest.component_div(&self.radii);
        let steepness = gradient.norm();
        let normal = gradient / steepness;
        let distance = (p - nearest.component_mul(&self.radii)).dot(&normal);
        Distance {
            distance,
            normal,
            curvature: self.curvature(&normal, steepness, distance),
        }
    }

    /// The surface point nearest to `p`, given by its unit vector `xᵢ/eᵢ`.
    fn nearest(&self, p: &Vec3) -> Vec3 {
        // Lengths in units of the shortest radius, and s = t + 1, exact also where t nears −1: the
        // poles are at s = −cᵢ.
        let shortest = self.radii.min();
        let e = self.radii / shortest;
        let p = (p / shortest).map(|p| if p.abs() < NOTHING { 0.0 } else { p });
        let c = e.map(|e| (e - 1.0) * (e + 1.0));
        let at = |s: f64| {
            e.zip_zip_map(
                &p,
                &c,
                |e, p, c| if p == 0.0 { 0.0 } else { e * p / (s + c) },
            )
        };
        // Where one component alone is 1, N is at least 1: this lies left of the root.
        let mut s = e
            .zip_zip_map(&p, &c, |e, p, c| e * p.abs() - c)
            .max()
            .max(0.0);
        let mut x = at(s);
        if s == 0.0 && x.norm_squared() <= 1.0 {
            // On the medial axis, where s = 0 is the root: across it the nearest points lie on all
            // sides.
            let side = if c.z == 0.0 {
                -Vec3::z()
            } else if c.x == 0.0 {
                Vec3::x()
            } else {
                Vec3::y()
            };
            return x + side * (1.0 - x.norm_squared()).sqrt();
        }
        for _ in 0..MAX_STEPS {
            let n_sq = x.norm_squared();
            let fall: f64 = (0..3)
                .filter(|&i| x[i] != 0.0)
                .map(|i| x[i] * x[i] / (s + c[i]))
                .sum();
            let next = s + (n_sq.sqrt() - 1.0) * n_sq / fall;
            if next <= s || next.is_nan() {
                break;
            }
            s = next;
            x = at(s);
        }
        x.normalize()
    }

    /// The shape operator in its principal directions, moved out by `distance`.
    fn curvature(&self, normal: &Vec3, steepness: f64, distance: f64) -> Mat3 {
        let weight = self.radii.map(|e| 1.0 / (e * e));
        let b1 = Vec3::ith(normal.iamin(), 1.0).cross(normal).normalize();
        let b2 = normal.cross(&b1);
        let entry = |a: &Vec3, b: &Vec3| a.component_mul(&weight).dot(b) / steepness;
        let (s11, s12, s22) = (entry(&b1, &b1), entry(&b1, &b2), entry(&b2, &b2));
        let angle = 0.5 * (2.0 * s12).atan2(s11 - s22);
        let first = b1 * angle.cos() + b2 * angle.sin();
        let second = normal.cross(&first);
        let k1 = 0.5 * (s11 + s22) + (0.5 * (s11 - s22)).hypot(s12);
        // Through the Gaussian curvature, since the difference of the above loses a small k2.
        let k2 = (weight.product() / steepness.powi(4)) / k1;
        let size = self.radii.min();
        along(&first) / offset_radius(1.0 / k1, distance, size)
            + along(&second) / offset_radius(1.0 / k2, distance, size)
    }
}

impl RigidShape for Ellipsoid {
    const NAME: &'static str = NAME;

    fn distance(&self, p: &Vec3) -> Distance {
        self.distance_centred(&(p - Vec3::z() * self.radii.z))
    }

    fn support(&self, u: &Vec3) -> Option<Vec3> {
        let stretched = u.component_mul(&self.radii);
        Some(stretched.component_mul(&self.radii) / stretched.norm() + Vec3::z() * self.radii.z)
    }

    fn tip_radius(&self) -> f64 {
        self.radii.x.max(self.radii.y).powi(2) / self.radii.z
    }

    fn bounding_radius(&self) -> f64 {
        self.radii.z + self.radii.max()
    }

    fn footprint_radius(&self) -> f64 {
        self.radii.x.max(self.radii.y)
    }
}
