//! A box with rounded edges: all points within the edge radius of a smaller box.

use palpa_mesh::Vec3;

use super::{Distance, RigidShape, ShapeError, across, checked, checked_edge, offset_radius};
use crate::Mat3;

const NAME: &str = "box";

/// A box that rests on the middle of its lower face, with rounded edges and corners.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RoundedBox {
    half_extents: Vec3,
    edge_radius: f64,
}

impl RoundedBox {
    /// A box that reaches this far from its middle, rounding included, and whose edges and corners
    /// are rounded by `edge_radius`; 0 is sharp. In metres.
    ///
    /// # Errors
    /// When an extent is not between 1 µm and 10 m, or the edge radius is negative or larger than
    /// the smallest.
    pub fn new(half_extents: Vec3, edge_radius: f64) -> Result<Self, ShapeError> {
        for (what, value) in ["half width", "half length", "half height"]
            .into_iter()
            .zip(half_extents.iter())
        {
            checked(NAME, what, *value)?;
        }
        Ok(Self {
            half_extents,
            edge_radius: checked_edge(NAME, edge_radius, half_extents.min())?,
        })
    }

    /// How far it reaches from its middle along x, y and z. m
    pub fn half_extents(&self) -> Vec3 {
        self.half_extents
    }

    /// Radius of the rounding. m
    pub fn edge_radius(&self) -> f64 {
        self.edge_radius
    }

    /// The half extents of the box whose corners are the middles of the rounding.
    fn core(&self) -> Vec3 {
        self.half_extents.add_scalar(-self.edge_radius)
    }

    /// Whether the tip lies on a flat face or straight edge.
    pub(super) fn is_flat(&self) -> bool {
        self.core().xy().max() > 0.0
    }

    /// For points in the core: the nearest of the six faces, the pressing one first.
    fn distance_to_face(&self, beyond_core: &Vec3, sign: &Vec3) -> Distance {
        let nearest = [2, 0, 1]
            .into_iter()
            .reduce(|a, b| {
                if beyond_core[b] > beyond_core[a] {
                    b
                } else {
                    a
                }
            })
            .unwrap_or(2);
        let mut normal = Vec3::zeros();
        normal[nearest] = sign[nearest];
        Distance {
            distance: beyond_core[nearest] - self.edge_radius,
            normal,
            curvature: Mat3::zeros(),
        }
    }
}

impl RigidShape for RoundedBox {
    const NAME: &'static str = NAME;

    fn distance(&self, p: &Vec3) -> Distance {
        let p = p - Vec3::z() * self.half_extents.z;
        // By symmetry in the octant of positive coordinates; in the middle, the pressing side is
        // the lower one.
        let sign = Vec3::new(
            1.0_f64.copysign(p.x),
            1.0_f64.copysign(p.y),
            if p.z > 0.0 { 1.0 } else { -1.0 },
        );
        let beyond_core = p.abs() - self.core();
        let outward = beyond_core.sup(&Vec3::zeros());
        let from_core = outward.norm();
        if from_core == 0.0 {
            return self.distance_to_face(&beyond_core, &sign);
        }
        let normal = (outward / from_core).component_mul(&sign);
        let distance = from_core - self.edge_radius;
        // Round along the axes on which the point is beyond the core: none at a face, one at an
        // edge, all at a corner.
        let is_round =
            Vec3::from_fn(|i, _| f64::from(u8::from(outward[i] > 0.0 || self.core()[i] == 0.0)));
        let round = Mat3::from_diagonal(&is_round);
        let radius = offset_radius(self.edge_radius, distance, self.half_extents.min());
        Distance {
            distance,
            normal,
            curvature: (round * across(&normal) * round) / radius,
        }
    }

    fn support(&self, u: &Vec3) -> Option<Vec3> {
        let corner = u.map(|x| if x == 0.0 { 0.0 } else { x.signum() });
        Some(
            corner.component_mul(&self.core())
                + u * self.edge_radius
                + Vec3::z() * self.half_extents.z,
        )
    }

    fn bounding_radius(&self) -> f64 {
        let corner = self.core() + Vec3::z() * self.half_extents.z;
        corner.norm() + self.edge_radius
    }

    fn footprint_radius(&self) -> f64 {
        self.core().xy().norm() + self.edge_radius
    }

    fn tip_radius(&self) -> f64 {
        if self.is_flat() {
            f64::INFINITY
        } else {
            self.edge_radius
        }
    }
}
