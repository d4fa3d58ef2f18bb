//! A round punch with a flat face, rounded at its rim, on a shaft without end.
//!
//! ```text
//!   |<- radius ->|
//!   |            .            |   side
//!   |            .            |   . . . . . z = edge_radius
//!    \           .           /    rim: a quarter torus
//!     -----------o-----------     face, z = 0
//!                |<-- flat ->|<->| edge_radius
//! ```

use palpa_mesh::Vec3;

use super::{
    Distance, RigidShape, ShapeError, along, checked, checked_edge, from_axis, offset_radius,
};
use crate::Mat3;

const NAME: &str = "flat punch";

/// A round punch with a flat face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlatPunch {
    radius: f64,
    edge_radius: f64,
}

impl FlatPunch {
    /// A punch whose shaft has this radius and whose rim is rounded by `edge_radius`: 0 is sharp,
    /// `radius` half a ball. In metres.
    ///
    /// # Errors
    /// When the radius is not between 1 µm and 10 m, or the edge radius is negative or larger.
    pub fn new(radius: f64, edge_radius: f64) -> Result<Self, ShapeError> {
        let radius = checked(NAME, "radius", radius)?;
        Ok(Self {
            radius,
            edge_radius: checked_edge(NAME, edge_radius, radius)?,
        })
    }

    /// Radius of the shaft. m
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Radius of the rounding between face and shaft. m
    pub fn edge_radius(&self) -> f64 {
        self.edge_radius
    }

    /// Radius of the part of the face that is flat, `radius − edge_radius`. m
    pub fn flat_radius(&self) -> f64 {
        self.radius - self.edge_radius
    }

    /// To the quarter torus, whose middle line has the radius of the flat and lies at
    /// `z = edge_radius`.
    fn distance_to_rim(&self, from_axis: f64, radial: &Vec3, out: f64, down: f64) -> Distance {
        let from_line = out.hypot(down);
        let distance = from_line - self.edge_radius;
        let normal = (radial * out - Vec3::z() * down) / from_line;
        let along_meridian = (radial * down + Vec3::z() * out) / from_line;
        let around = Vec3::z().cross(radial);
        // The second curvature is normal·radial / from_axis, bounded like the first by the share
        // that `out` is of it.
        let bend = 1.0 / offset_radius(self.edge_radius, distance, self.radius);
        let share = if out < from_axis {
            out / from_axis
        } else {
            1.0
        };
        let turn = share * bend;
        Distance {
            distance,
            normal,
            curvature: along(&along_meridian) * bend + along(&around) * turn,
        }
    }
}

impl RigidShape for FlatPunch {
    const NAME: &'static str = NAME;

    fn distance(&self, p: &Vec3) -> Distance {
        let (from_axis, radial) = from_axis(p);
        let beyond_flat = from_axis - self.flat_radius();
        let below_side = self.edge_radius - p.z;
        let is_half_ball = self.flat_radius() == 0.0;
        if (beyond_flat > 0.0 || is_half_ball) && below_side > 0.0 {
            return self.distance_to_rim(from_axis, &radial, beyond_flat, below_side);
        }
        let to_side = from_axis - self.radius;
        let is_face_nearer = -p.z >= to_side;
        if below_side > 0.0 || (beyond_flat <= 0.0 && is_face_nearer) {
            return Distance {
                distance: -p.z,
                normal: -Vec3::z(),
                curvature: Mat3::zeros(),
            };
        }
        let around = Vec3::z().cross(&radial);
        Distance {
            distance: to_side,
            normal: radial,
            curvature: along(&around) / offset_radius(self.radius, to_side, self.radius),
        }
    }

    fn support(&self, u: &Vec3) -> Option<Vec3> {
        if u.z > 0.0 {
            return None;
        }
        let radial = Vec3::new(u.x, u.y, 0.0)
            .try_normalize(0.0)
            .unwrap_or_else(Vec3::zeros);
        Some(radial * self.flat_radius() + (u + Vec3::z()) * self.edge_radius)
    }

    fn tip_radius(&self) -> f64 {
        if self.flat_radius() > 0.0 {
            f64::INFINITY
        } else {
            self.radius
        }
    }

    fn bounding_radius(&self) -> f64 {
        f64::INFINITY
    }

    fn footprint_radius(&self) -> f64 {
        self.radius
    }
}
