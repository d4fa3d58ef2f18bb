//! A cone with a rounded tip, point down, that passes through a rounded rim into a shaft without
//! end.
//!
//! ```text
//!   |<- radius ->|
//!   |            .            |   shaft
//!    \           .           /    rim: rounded by edge_radius
//!      \         .         /
//!        \       .   α   /        flank: inclined by the half angle α to the axis
//!          \     .     /
//!            `---o---'            tip: rounded by tip_radius
//! ```
//! All four parts are smooth and meet without a corner. In the half plane of distance from the axis
//! and height, `n = (cos α, −sin α)` is the flank's normal and `τ = (sin α, cos α)` goes up along
//! it. A convex body is all that lies behind its supporting lines, and a point's distance is that
//! from the farthest of these, outside as inside:
//!
//! ```text
//! tip    where (p − c_tip)·τ ≤ 0            |p − c_tip| − tip_radius
//! rim    where (p − c_rim)·τ ≥ 0, z ≤ z_rim   |p − c_rim| − edge_radius
//! else   the greater of                      n·(p − c_tip) − tip_radius  (flank),  r − radius  (shaft)
//! ```

use palpa_mesh::Vec3;

use super::{
    Distance, RigidShape, ShapeError, along, checked, checked_edge, from_axis, from_ball,
    offset_radius,
};

const NAME: &str = "cone";
/// Half angles that make a cone, rad: a needle below, a flat punch above.
const HALF_ANGLES: std::ops::RangeInclusive<f64> = 0.05..=1.55;

/// A cone with a rounded tip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cone {
    radius: f64,
    tip_radius: f64,
    edge_radius: f64,
    /// `sin α`, `cos α`.
    sin: f64,
    cos: f64,
    /// Height of the middle of the rim's rounding over the tip.
    rim_height: f64,
}

impl Cone {
    /// A cone whose shaft has this radius and whose flank this angle to the axis (rad), with tip
    /// and rim rounded by `tip_radius` and `edge_radius`, `radius` at most. An edge radius of 0 is
    /// sharp. In metres.
    ///
    /// # Errors
    /// When radius or tip radius is not between 1 µm and 10 m, a rounding is negative or larger
    /// than it, or the half angle is not between 0.05 and 1.55 rad.
    pub fn new(
        radius: f64,
        half_angle: f64,
        tip_radius: f64,
        edge_radius: f64,
    ) -> Result<Self, ShapeError> {
        let radius = checked(NAME, "radius", radius)?;
        if !HALF_ANGLES.contains(&half_angle) {
            return Err(ShapeError::Angle {
                shape: NAME,
                value: half_angle,
                least: *HALF_ANGLES.start(),
                most: *HALF_ANGLES.end(),
            });
        }
        let tip_radius = checked(NAME, "tip radius", tip_radius)?;
        let tip_radius = checked_edge(NAME, tip_radius, radius)?;
        let edge_radius = checked_edge(NAME, edge_radius, radius)?;
        let (sin, cos) = half_angle.sin_cos();
        // The flank touches both roundings: n·(c_rim − c_tip) = tip_radius − edge_radius.
        let rise = (cos * (radius - edge_radius) - (tip_radius - edge_radius)) / sin;
        Ok(Self {
            radius,
            tip_radius,
            edge_radius,
            sin,
            cos,
            rim_height: tip_radius + rise,
        })
    }

    /// A distance with the unit normal `out · radial − down · z`, on a surface whose curvature
    /// radius in the half plane is `bend` (infinite where it is straight), at a point of this
    /// distance from the axis.
    fn on_meridian(
        &self,
        distance: f64,
        [out, down]: [f64; 2],
        radial: &Vec3,
        bend: f64,
        from_axis: f64,
    ) -> Distance {
        let normal = radial * out - Vec3::z() * down;
        let along_meridian = radial * down + Vec3::z() * out;
        let around = Vec3::z().cross(radial);
        let curvature = |radius: f64| {
            if radius.is_finite() {
                1.0 / offset_radius(radius, distance, self.radius)
            } else {
                0.0
            }
        };
        // Round the axis the surface turns with the radius of the nearest point, seen along the
        // normal.
        let on_surface = (from_axis - distance * out).max(0.0);
        let turn = if out > 0.0 {
            on_surface / out
        } else {
            f64::INFINITY
        };
        Distance {
            distance,
            normal,
            curvature: along(&along_meridian) * curvature(bend) + along(&around) * curvature(turn),
        }
    }
}

impl RigidShape for Cone {
    const NAME: &'static str = NAME;

    fn distance(&self, p: &Vec3) -> Distance {
        let (from_axis, radial) = from_axis(p);
        let over_tip = p.z - self.tip_radius;
        if from_axis * self.sin + over_tip * self.cos <= 0.0 {
            let from_middle = p - Vec3::z() * self.tip_radius;
            return from_ball(&from_middle, self.tip_radius, self.radius);
        }
        let out = from_axis - (self.radius - self.edge_radius);
        let down = self.rim_height - p.z;
        let from_rim = out.hypot(down);
        if out * self.sin - down * self.cos >= 0.0 && down >= 0.0 && from_rim > 0.0 {
            let distance = from_rim - self.edge_radius;
            let normal = [out / from_rim, down / from_rim];
            return self.on_meridian(distance, normal, &radial, self.edge_radius, from_axis);
        }
        let to_flank = from_axis * self.cos - over_tip * self.sin - self.tip_radius;
        let to_shaft = from_axis - self.radius;
        let (distance, normal) = if to_flank >= to_shaft {
            (to_flank, [self.cos, self.sin])
        } else {
            (to_shaft, [1.0, 0.0])
        };
        self.on_meridian(distance, normal, &radial, f64::INFINITY, from_axis)
    }

    fn support(&self, u: &Vec3) -> Option<Vec3> {
        if u.z > 0.0 {
            return None;
        }
        let from_axis = u.x.hypot(u.y);
        if from_axis * self.sin + u.z * self.cos <= 0.0 {
            return Some((u + Vec3::z()) * self.tip_radius);
        }
        let radial = Vec3::new(u.x, u.y, 0.0) / from_axis;
        let middle = radial * (self.radius - self.edge_radius) + Vec3::z() * self.rim_height;
        Some(middle + u * self.edge_radius)
    }

    fn tip_radius(&self) -> f64 {
        self.tip_radius
    }

    fn bounding_radius(&self) -> f64 {
        f64::INFINITY
    }

    fn footprint_radius(&self) -> f64 {
        self.radius
    }
}
