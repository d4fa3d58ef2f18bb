//! A lying cylinder with round ends: all points near enough to a straight line along x.

use palpa_mesh::Vec3;

use super::{Distance, RigidShape, ShapeError, across, along, checked, offset_radius};

const NAME: &str = "capsule";

/// A lying cylinder with round ends; its axis runs along x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Capsule {
    radius: f64,
    length: f64,
}

impl Capsule {
    /// A capsule of this radius whose straight part has this length, in metres; from end to end it
    /// measures `length + 2 radius`.
    ///
    /// # Errors
    /// When one of them is not between 1 µm and 10 m.
    pub fn new(radius: f64, length: f64) -> Result<Self, ShapeError> {
        Ok(Self {
            radius: checked(NAME, "radius", radius)?,
            length: checked(NAME, "length", length)?,
        })
    }

    /// Its radius. m
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Length of the straight part, between the middles of the round ends. m
    pub fn length(&self) -> f64 {
        self.length
    }

    /// The distance of a point given from the capsule's middle.
    pub(crate) fn distance_centred(&self, p: &Vec3) -> Distance {
        let half = 0.5 * self.length;
        let from_line = p - Vec3::x() * p.x.clamp(-half, half);
        let normal = from_line.try_normalize(0.0).unwrap_or_else(|| -Vec3::z());
        let distance = from_line.norm() - self.radius;
        let directions = if p.x.abs() < half {
            along(&Vec3::x().cross(&normal))
        } else {
            across(&normal)
        };
        Distance {
            distance,
            normal,
            curvature: directions / offset_radius(self.radius, distance, self.radius),
        }
    }
}

impl RigidShape for Capsule {
    const NAME: &'static str = NAME;

    fn distance(&self, p: &Vec3) -> Distance {
        self.distance_centred(&(p - Vec3::z() * self.radius))
    }

    fn support(&self, u: &Vec3) -> Option<Vec3> {
        let end = if u.x == 0.0 { 0.0 } else { u.x.signum() };
        Some(Vec3::x() * (0.5 * self.length * end) + (u + Vec3::z()) * self.radius)
    }

    fn bounding_radius(&self) -> f64 {
        self.radius.hypot(0.5 * self.length) + self.radius
    }

    fn tip_radius(&self) -> f64 {
        f64::INFINITY
    }

    fn footprint_radius(&self) -> f64 {
        0.5 * self.length + self.radius
    }
}
