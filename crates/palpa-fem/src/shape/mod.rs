//! Rigid shapes with exact distance: tools that press, and lumps in the tissue.
//!
//! To add a shape:
//!
//! 1. A file here with its `RigidShape` (`flat_punch.rs` is an example), and its name in `mod`,
//!    `pub use` and [`Shape`].
//! 2. Tests: `cases` of `tests/it/shape.rs`, which runs all tests of shapes over it; a case of
//!    `palpa verify` (`palpa-lab/src/verify`) where the force is known exactly. Now it can be used
//!    from Rust.
//! 3. For scenes: `palpa-scene/src/shape.rs`, where the compiler asks for the rest; a size that no
//!    shape has yet in `file/tool.rs` and in `check_keys` of `resolve/tool.rs`. Then an arm of
//!    `tool_shape` in `palpa/src/continuum.rs`.
//! 4. For the page: bless and generate (`CONTRIBUTING.md` has the commands), then its entry in
//!    `web/src/scene/toolshapes.ts` and its name in `web/src/i18n`, for which the compiler asks.
//! 5. The table of tools in `docs/scenes.md`, and a word in `docs/theory/contact.md`.
//!
//! A shape stands in a frame of its own. Its origin is the *tip*, the point that touches first when
//! the shape moves along −z; z points out of the tissue:
//!
//! ```text
//!      |    |  shaft           z
//!      |    |                  ^
//!       \__/                   |
//!  ------o-------- skin        o--> x
//! ```
//!
//! All shapes are convex, so outside them the distance is smooth (once differentiable everywhere,
//! twice except where the regions of a surface meet). Inside, it is smooth down to the medial axis,
//! where the nearest surface point jumps.

mod capsule;
mod cone;
mod ellipsoid;
mod flat_punch;
mod rounded_box;
mod sphere;
mod tool;

pub use capsule::Capsule;
pub use cone::Cone;
pub use ellipsoid::Ellipsoid;
pub use flat_punch::FlatPunch;
pub use rounded_box::RoundedBox;
pub use sphere::Sphere;
pub use tool::{Pose, Tool};

use palpa_mesh::Vec3;

use crate::Mat3;

/// Range of sizes, m: below, rounding would show; above, nothing is pressed.
const SIZES: std::ops::RangeInclusive<f64> = 1e-6..=10.0;

/// Curvature radii smaller than this share of the shape count as this: a sharp edge would bend the
/// distance infinitely.
const SHARPEST: f64 = 1e-3;

/// The distance of a point from a shape, to second order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// Distance to the nearest point of the surface, negative inside. m
    pub distance: f64,
    /// Its gradient: the unit vector from the nearest surface point, out of the shape.
    /// `p − distance · normal` is that nearest point, inside as outside. Where several points are
    /// equally near (on the medial axis), it is that of the pressing side, toward −z, if that is
    /// among them.
    pub normal: Vec3,
    /// Its second derivative, symmetric, positive semidefinite, zero along `normal`. 1/m
    ///
    /// A principal curvature is 1/(ρ + d) for a surface of curvature radius ρ at distance d. That
    /// is exact outside and down to half of ρ inside. Deeper, where it would grow without limit
    /// toward the medial axis, it stays 2/ρ; and ρ + d counts as no less than a thousandth of the
    /// shape, which only sharp edges notice.
    pub curvature: Mat3,
}

one_of! {
    ($) of_each!
    /// A shape that is pressed into tissue. Lengths in metres.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub enum Shape {
        /// A ball.
        Sphere,
        /// A round punch with a flat face.
        FlatPunch,
        /// A lying cylinder with round ends.
        Capsule,
        /// A box with rounded edges.
        RoundedBox,
        /// An ellipsoid, such as the pad of a finger.
        Ellipsoid,
        /// A cone with a rounded tip.
        Cone,
    }
}

/// Why a shape is refused.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShapeError {
    /// A size that no shape can have.
    #[error(
        "{shape}: the {what} is {value} m, outside {} to {} m; give a positive length in metres",
        SIZES.start(),
        SIZES.end()
    )]
    Size {
        /// Name of the shape.
        shape: &'static str,
        /// Name of the size.
        what: &'static str,
        /// The value given. m
        value: f64,
    },
    /// A rounding that does not fit on the shape.
    #[error(
        "{shape}: an edge radius of {value} m does not fit; give 0 (sharp) to {limit} m, which rounds it completely"
    )]
    EdgeRadius {
        /// Name of the shape.
        shape: &'static str,
        /// The value given. m
        value: f64,
        /// The largest that fits. m
        limit: f64,
    },
    /// A half angle that makes no cone.
    #[error(
        "{shape}: a half angle of {value} rad is outside {least} to {most} rad; give the angle between flank and axis"
    )]
    Angle {
        /// Name of the shape.
        shape: &'static str,
        /// The value given. rad
        value: f64,
        /// The smallest allowed. rad
        least: f64,
        /// The largest allowed. rad
        most: f64,
    },
    /// A coefficient of friction that is none.
    #[error("a friction coefficient of {value} is not possible; give 0 (slippery) or more")]
    Friction {
        /// The value given.
        value: f64,
    },
    /// A coefficient of kinetic friction that is none, or larger than the static one.
    #[error(
        "a kinetic friction coefficient of {value} is not possible; give 0 to {most}, the coefficient of a tool that sticks"
    )]
    KineticFriction {
        /// The value given.
        value: f64,
        /// The largest that is possible.
        most: f64,
    },
}

/// The questions that every shape answers. All lengths in metres, in the shape's frame.
trait RigidShape {
    /// Name of the shape, such as `flat punch`.
    const NAME: &'static str;

    fn name(&self) -> &'static str {
        Self::NAME
    }

    /// The distance of the point `p`, for any finite point.
    fn distance(&self, p: &Vec3) -> Distance;

    /// The point that lies farthest along the unit vector `u`; `None` up a shaft without end.
    fn support(&self, u: &Vec3) -> Option<Vec3>;

    /// The larger principal radius of curvature at the tip, infinite where the tip is flat or
    /// straight.
    fn tip_radius(&self) -> f64;

    /// Radius of a ball round the tip that holds the shape; infinite for a shaft.
    fn bounding_radius(&self) -> f64;

    /// Radius of the cylinder round z that holds the shape.
    fn footprint_radius(&self) -> f64;
}

impl Shape {
    /// The distance of the point `p_local`, in the shape's frame.
    ///
    /// Any finite point is answered, also deep inside: distance and normal are then those of the
    /// nearest surface.
    pub fn distance(&self, p_local: &Vec3) -> Distance {
        of_each!(self, shape => shape.distance(p_local))
    }

    /// The point of the shape that lies farthest along `direction` (of any length but 0), in the
    /// shape's frame; `None` where the shape has no end, up the shaft of a punch.
    pub fn support(&self, direction: &Vec3) -> Option<Vec3> {
        let u = direction.normalize();
        of_each!(self, shape => shape.support(&u))
    }

    /// The larger principal radius of curvature at the tip, infinite where the tip is flat or
    /// straight. m
    pub fn tip_radius(&self) -> f64 {
        of_each!(self, shape => shape.tip_radius())
    }

    /// Radius of a ball round the tip that holds the shape; infinite for a shaft. m
    pub fn bounding_radius(&self) -> f64 {
        of_each!(self, shape => shape.bounding_radius())
    }

    /// Radius of the cylinder round z that holds the shape: how far its shadow on the skin reaches.
    /// m
    pub fn footprint_radius(&self) -> f64 {
        of_each!(self, shape => shape.footprint_radius())
    }

    /// Name of the shape, such as `flat punch`.
    pub fn name(&self) -> &'static str {
        of_each!(self, shape => shape.name())
    }
}

/// `value`, if a shape can have this size.
fn checked(shape: &'static str, what: &'static str, value: f64) -> Result<f64, ShapeError> {
    if SIZES.contains(&value) {
        Ok(value)
    } else {
        Err(ShapeError::Size { shape, what, value })
    }
}

/// `value`, if it can round the edges of a shape that `limit` would round completely.
fn checked_edge(shape: &'static str, value: f64, limit: f64) -> Result<f64, ShapeError> {
    if (0.0..=limit).contains(&value) {
        Ok(value)
    } else {
        Err(ShapeError::EdgeRadius {
            shape,
            value,
            limit,
        })
    }
}

/// ρ + d, the curvature radius at distance `d` from a surface of curvature radius `rho`, kept from
/// 0 as [`Distance::curvature`] tells.
fn offset_radius(rho: f64, d: f64, size: f64) -> f64 {
    (rho + d).max(0.5 * rho).max(SHARPEST * size)
}

/// A point's distance from the z axis, and the unit vector from the axis to it; x on the axis.
fn from_axis(p: &Vec3) -> (f64, Vec3) {
    let radial = Vec3::new(p.x, p.y, 0.0)
        .try_normalize(0.0)
        .unwrap_or_else(Vec3::x);
    (p.x.hypot(p.y), radial)
}

/// The distance from a ball of a shape of this size; the point is given from the ball's middle.
fn from_ball(p: &Vec3, radius: f64, size: f64) -> Distance {
    let normal = p.try_normalize(0.0).unwrap_or_else(|| -Vec3::z());
    let distance = p.norm() - radius;
    Distance {
        distance,
        normal,
        curvature: across(&normal) / offset_radius(radius, distance, size),
    }
}

/// The projector on a unit vector, `u uᵀ`.
fn along(u: &Vec3) -> Mat3 {
    u * u.transpose()
}

/// The projector on the plane across a unit vector, `1 − u uᵀ`.
fn across(u: &Vec3) -> Mat3 {
    Mat3::identity() - along(u)
}
