//! A ball.

use palpa_mesh::Vec3;

use super::{Distance, RigidShape, ShapeError, checked, from_ball};

const NAME: &str = "sphere";

/// A ball that rests on its tip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    radius: f64,
}

impl Sphere {
    /// A ball of this radius, in metres.
    ///
    /// # Errors
    /// When the radius is not between 1 µm and 10 m.
    pub fn new(radius: f64) -> Result<Self, ShapeError> {
        Ok(Self {
            radius: checked(NAME, "radius", radius)?,
        })
    }

    /// Its radius. m
    pub fn radius(self) -> f64 {
        self.radius
    }

    /// The distance of a point given from the ball's middle.
    pub(crate) fn distance_centred(self, p: &Vec3) -> Distance {
        from_ball(p, self.radius, self.radius)
    }
}

impl RigidShape for Sphere {
    const NAME: &'static str = NAME;

    fn distance(&self, p: &Vec3) -> Distance {
        self.distance_centred(&(p - Vec3::z() * self.radius))
    }

    fn support(&self, u: &Vec3) -> Option<Vec3> {
        Some((u + Vec3::z()) * self.radius)
    }

    fn tip_radius(&self) -> f64 {
        self.radius
    }

    fn bounding_radius(&self) -> f64 {
        2.0 * self.radius
    }

    fn footprint_radius(&self) -> f64 {
        self.radius
    }
}
