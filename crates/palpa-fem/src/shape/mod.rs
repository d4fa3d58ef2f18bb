//! Rigid shapes with exact distance: what presses, and what lies hidden in the tissue.
//!
//! To add a tool shape:
//! 1. A file like `sphere.rs`. Here: a variant of [`Shape`], its arms (the compiler asks), its name in `from_shape!`.
//! 2. `palpa-scene`: `file/tool.rs` (keys), `ContactShape` in `tool.rs`, `resolve/tool.rs`, `write/tool.rs`. Then
//!    `tool_shape` in `palpa/src/continuum.rs` and `footprint` in `palpa/src/press/mesh.rs`.
//! 3. For the page: `ToolForm` in `palpa-viewer/src/control.rs`, `palpa-session/src/world/info.rs`, and what the head of
//!    `web/src/scene/toolshapes.ts` says. Tests: the list of shapes in `tests/it/shape.rs`.
//!
//! A shape stands in a frame of its own. Its origin is the *tip*, the point that touches first when the shape moves
//! along −z; z points out of the tissue:
//!
//! ```text
//!      |    |  shaft           z
//!      |    |                  ^
//!       \__/                   |
//!  ------o-------- skin        o--> x
//! ```
//!
//! All shapes are convex, so outside them the distance is smooth (once differentiable everywhere, twice except where
//! the regions of a surface meet). Inside, it is smooth down to the medial axis, where the nearest surface point jumps.

mod capsule;
mod ellipsoid;
mod flat_punch;
mod rounded_box;
mod sphere;
mod tool;

pub use capsule::Capsule;
pub use ellipsoid::Ellipsoid;
pub use flat_punch::FlatPunch;
pub use rounded_box::RoundedBox;
pub use sphere::Sphere;
pub use tool::{Pose, Tool};

use palpa_mesh::Vec3;

use crate::Mat3;

/// What a size may be, in metres: below, rounding would show; above, nothing is pressed.
const SIZES: std::ops::RangeInclusive<f64> = 1e-6..=10.0;

/// Curvature radii smaller than this share of the shape count as this: a sharp edge would bend the distance infinitely.
const SHARPEST: f64 = 1e-3;

/// The distance of a point from a shape, to second order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// Distance to the nearest point of the surface, negative inside. m
    pub distance: f64,
    /// Its gradient: the unit vector from the nearest surface point, out of the shape. `p − distance · normal` is that
    /// nearest point, inside as outside. Where several points are equally near (on the medial axis), it is that of the
    /// pressing side, toward −z, if that is among them.
    pub normal: Vec3,
    /// Its second derivative, symmetric, positive semidefinite, zero along `normal`. 1/m
    ///
    /// A principal curvature is 1/(ρ + d) for a surface of curvature radius ρ at distance d. That is exact outside and
    /// down to half of ρ inside. Deeper, where it would grow without limit toward the medial axis, it stays 2/ρ; and
    /// ρ + d counts as no less than a thousandth of the shape, which only sharp edges notice.
    pub curvature: Mat3,
}

/// A shape that is pressed into tissue. Lengths in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// A ball.
    Sphere(Sphere),
    /// A round punch with a flat face.
    FlatPunch(FlatPunch),
    /// A lying cylinder with round ends.
    Capsule(Capsule),
    /// A box with rounded edges.
    RoundedBox(RoundedBox),
    /// An ellipsoid, such as the pad of a finger.
    Ellipsoid(Ellipsoid),
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
    /// A coefficient of friction that is none.
    #[error("a friction coefficient of {value} is not possible; give 0 (slippery) or more")]
    Friction {
        /// The value given.
        value: f64,
    },
}

impl Shape {
    /// The distance of the point `p_local`, in the shape's frame.
    ///
    /// Any finite point is answered, also deep inside: distance and normal are then those of the nearest surface.
    pub fn distance(&self, p_local: &Vec3) -> Distance {
        match self {
            Self::Sphere(shape) => shape.distance(p_local),
            Self::FlatPunch(shape) => shape.distance(p_local),
            Self::Capsule(shape) => shape.distance(p_local),
            Self::RoundedBox(shape) => shape.distance(p_local),
            Self::Ellipsoid(shape) => shape.distance(p_local),
        }
    }

    /// The point of the shape that lies farthest along `direction` (of any length but 0), in the shape's frame; `None`
    /// where the shape has no end, up the shaft of a punch.
    pub fn support(&self, direction: &Vec3) -> Option<Vec3> {
        let u = direction.normalize();
        match self {
            Self::Sphere(shape) => Some(shape.support(&u)),
            Self::FlatPunch(shape) => shape.support(&u),
            Self::Capsule(shape) => Some(shape.support(&u)),
            Self::RoundedBox(shape) => Some(shape.support(&u)),
            Self::Ellipsoid(shape) => Some(shape.support(&u)),
        }
    }

    /// The larger principal radius of curvature at the tip, infinite where the tip is flat or straight. m
    pub fn tip_radius(&self) -> f64 {
        match self {
            Self::Sphere(shape) => shape.radius(),
            Self::FlatPunch(shape) if shape.flat_radius() > 0.0 => f64::INFINITY,
            Self::FlatPunch(shape) => shape.radius(),
            Self::Capsule(_) => f64::INFINITY,
            Self::RoundedBox(shape) => {
                if shape.is_flat() {
                    f64::INFINITY
                } else {
                    shape.edge_radius()
                }
            }
            Self::Ellipsoid(shape) => shape.tip_radius(),
        }
    }

    /// Radius of a ball round the tip that holds the shape; infinite for a shaft. m
    pub fn bounding_radius(&self) -> f64 {
        match self {
            Self::Sphere(shape) => 2.0 * shape.radius(),
            Self::FlatPunch(_) => f64::INFINITY,
            Self::Capsule(shape) => shape.bounding_radius(),
            Self::RoundedBox(shape) => shape.bounding_radius(),
            Self::Ellipsoid(shape) => shape.bounding_radius(),
        }
    }

    /// Radius of the cylinder round z that holds the shape: how far its shadow on the skin reaches. m
    pub fn footprint_radius(&self) -> f64 {
        match self {
            Self::Sphere(shape) => shape.radius(),
            Self::FlatPunch(shape) => shape.radius(),
            Self::Capsule(shape) => 0.5 * shape.length() + shape.radius(),
            Self::RoundedBox(shape) => shape.footprint_radius(),
            Self::Ellipsoid(shape) => shape.radii().x.max(shape.radii().y),
        }
    }

    /// What the shape is called, such as `flat punch`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Sphere(_) => sphere::NAME,
            Self::FlatPunch(_) => flat_punch::NAME,
            Self::Capsule(_) => capsule::NAME,
            Self::RoundedBox(_) => rounded_box::NAME,
            Self::Ellipsoid(_) => ellipsoid::NAME,
        }
    }
}

macro_rules! from_shape {
    ($($name:ident),*) => {$(
        impl From<$name> for Shape {
            fn from(shape: $name) -> Self {
                Self::$name(shape)
            }
        }
    )*};
}
from_shape!(Sphere, FlatPunch, Capsule, RoundedBox, Ellipsoid);

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

/// ρ + d, the curvature radius at distance `d` from a surface of curvature radius `rho`, kept from 0 as
/// [`Distance::curvature`] tells.
fn offset_radius(rho: f64, d: f64, size: f64) -> f64 {
    (rho + d).max(0.5 * rho).max(SHARPEST * size)
}

/// The projector on a unit vector, `u uᵀ`.
fn along(u: &Vec3) -> Mat3 {
    u * u.transpose()
}

/// The projector on the plane across a unit vector, `1 − u uᵀ`.
fn across(u: &Vec3) -> Mat3 {
    Mat3::identity() - along(u)
}
