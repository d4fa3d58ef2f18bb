//! The shapes of tools that press by contact.
//!
//! To add a shape: its name in [`ToolShape`], its sizes in [`ContactShape`], and an arm in each
//! `match` of this file that the compiler asks for. A size that no shape has yet is a key of
//! `ToolTable` (`file/tool.rs`) with its range in `limits.rs`. Its geometry is one file of
//! `palpa-fem/src/shape`, whose head lists the other places. [`ContactShape`] is also the shape
//! that the page gets, as JSON.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_2_PI, FRAC_PI_3, SQRT_2};
use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::SceneError;
use crate::error::Site;
use crate::file::ToolTable;
use crate::limits::{self, Limits};
use crate::units::{Angle, Kind, Length, Quantity};

/// Default radius of a tool, m.
const RADIUS: f64 = 8e-3;
/// Default length of a capsule's straight part, m.
const LENGTH: f64 = 20e-3;
/// Default size of a box, m.
const SIZE: [f64; 3] = [16e-3; 3];
/// Default radii of a fingertip, m. Its radii of curvature are 9.1 mm along and 7 mm across the
/// finger, within the 7–10 mm and 6–8 mm of index fingers (from memory, after Serina et al. 1998).
const FINGERTIP: [f64; 3] = [8e-3, 7e-3, 7e-3];
/// Default full angle at the tip of a cone, rad.
const OPENING_ANGLE: f64 = 2.0 * FRAC_PI_3;
/// Default radius of a cone's rounded tip, m.
const TIP_RADIUS: f64 = 3e-3;
/// Default radius of rounded edges, as a share of a punch's or a cone's radius, or of half a box's
/// smallest size.
const EDGE: f64 = 0.3;

/// The shapes of tools.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum ToolShape {
    /// A patch of skin bonded to a rigid disc.
    #[default]
    Disc,
    /// A single node of the skin that is moved; for the reference method, or for trying out a mesh.
    Node,
    /// A ball.
    Sphere,
    /// The flat end of a round rod.
    FlatPunch,
    /// A cylinder on its side, with round ends.
    Capsule,
    /// A box.
    Box,
    /// The pad of a finger: an ellipsoid.
    Fingertip,
    /// A cone with a rounded tip, on a round rod.
    Cone,
}

/// The shape of a rigid tool. All lengths in metres. In its own frame the tip is the origin, x
/// points along the length, and z points out of the tissue. At depth 0 the tip, in the middle of
/// the face, touches the skin at rest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum ContactShape {
    /// A ball.
    Sphere {
        /// Its radius.
        radius: f64,
    },
    /// The flat end of a round rod along z, with a rounded edge.
    FlatPunch {
        /// Radius of the rod.
        radius: f64,
        /// Radius of its rounded edge, no more than `radius`.
        edge_radius: f64,
    },
    /// A cylinder along x, on its side, with round ends.
    Capsule {
        /// Radius of the cylinder and its ends.
        radius: f64,
        /// Length of the straight part, between the centres of the ends.
        length: f64,
    },
    /// A box with rounded edges.
    Box {
        /// Its full size along x, y and z.
        size: [f64; 3],
        /// Radius of its rounded edges, no more than half its smallest size.
        edge_radius: f64,
    },
    /// The pad of a finger: an ellipsoid.
    Fingertip {
        /// Its radii along x (the finger), y and z.
        radii: [f64; 3],
    },
    /// A cone with its tip down, on a round rod along z; tip and rim are rounded.
    Cone {
        /// Radius of the rod.
        radius: f64,
        /// Full angle at its tip, in radians.
        opening_angle: f64,
        /// Radius of its rounded tip, no more than `radius`.
        tip_radius: f64,
        /// Radius of the rounding between cone and rod, no more than `radius`.
        edge_radius: f64,
    },
}

impl ToolShape {
    /// Name in a sentence, and the keys that it takes.
    pub(crate) fn takes(self) -> (&'static str, &'static [&'static str]) {
        match self {
            Self::Disc => ("a disc", &["radius"]),
            Self::Node => ("a node", &[]),
            Self::Sphere => ("a sphere", &["radius", "friction"]),
            Self::FlatPunch => ("a flat punch", &["radius", "edge_radius", "friction"]),
            Self::Capsule => ("a capsule", &["radius", "length", "axis", "friction"]),
            Self::Box => ("a box", &["size", "edge_radius", "axis", "friction"]),
            Self::Fingertip => ("a fingertip", &["radii", "axis", "friction"]),
            Self::Cone => (
                "a cone",
                &[
                    "radius",
                    "opening_angle",
                    "tip_radius",
                    "edge_radius",
                    "friction",
                ],
            ),
        }
    }
}

impl ContactShape {
    /// The shape in a scene's table; `None` for a tool that does not press by contact.
    pub(crate) fn read(at: &Site<'_>, table: &ToolTable) -> Result<Option<Self>, SceneError> {
        let sizes = Sizes { at, table };
        Ok(Some(match table.shape {
            ToolShape::Disc | ToolShape::Node => return Ok(None),
            ToolShape::Sphere => Self::Sphere {
                radius: sizes.radius()?,
            },
            ToolShape::FlatPunch => {
                let radius = sizes.radius()?;
                let edge_radius = sizes.edge_radius(radius)?;
                Self::FlatPunch {
                    radius,
                    edge_radius,
                }
            }
            ToolShape::Capsule => Self::Capsule {
                radius: sizes.radius()?,
                length: sizes.one("length", table.length, LENGTH, &limits::TOOL_LENGTH)?,
            },
            ToolShape::Box => {
                let size = sizes.three("size", table.size, SIZE, &limits::TOOL_SIZE)?;
                let smallest = size.iter().copied().fold(f64::INFINITY, f64::min);
                Self::Box {
                    size,
                    edge_radius: sizes.edge_radius(smallest / 2.0)?,
                }
            }
            ToolShape::Fingertip => Self::Fingertip {
                radii: sizes.three("radii", table.radii, FINGERTIP, &limits::TOOL_RADIUS)?,
            },
            ToolShape::Cone => {
                let radius = sizes.radius()?;
                Self::Cone {
                    radius,
                    opening_angle: sizes.opening_angle()?,
                    tip_radius: sizes.tip_radius(radius)?,
                    edge_radius: sizes.edge_radius(radius)?,
                }
            }
        }))
    }

    /// Writes name and sizes into a scene's table.
    pub(crate) fn write(&self, table: &mut ToolTable) {
        let length = |length: f64| Some(Length::from_si(length));
        let three = |lengths: [f64; 3]| Some(lengths.map(Length::from_si));
        table.shape = match *self {
            Self::Sphere { radius } => {
                table.radius = length(radius);
                ToolShape::Sphere
            }
            Self::FlatPunch {
                radius,
                edge_radius,
            } => {
                table.radius = length(radius);
                table.edge_radius = length(edge_radius);
                ToolShape::FlatPunch
            }
            Self::Capsule {
                radius,
                length: straight,
            } => {
                table.radius = length(radius);
                table.length = length(straight);
                ToolShape::Capsule
            }
            Self::Box { size, edge_radius } => {
                table.size = three(size);
                table.edge_radius = length(edge_radius);
                ToolShape::Box
            }
            Self::Fingertip { radii } => {
                table.radii = three(radii);
                ToolShape::Fingertip
            }
            Self::Cone {
                radius,
                opening_angle,
                tip_radius,
                edge_radius,
            } => {
                table.radius = length(radius);
                table.opening_angle = Some(Angle::from_si(opening_angle));
                table.tip_radius = length(tip_radius);
                table.edge_radius = length(edge_radius);
                ToolShape::Cone
            }
        };
    }

    /// Radius of a flat tool's rounded edge in metres. `None` for a cone: its rim is the last part
    /// to touch the skin.
    pub fn edge_radius(&self) -> Option<f64> {
        match *self {
            Self::FlatPunch { edge_radius, .. } | Self::Box { edge_radius, .. } => {
                Some(edge_radius)
            }
            Self::Sphere { .. }
            | Self::Capsule { .. }
            | Self::Fingertip { .. }
            | Self::Cone { .. } => None,
        }
    }

    /// Typical contact radius in metres. A punch has its own radius, and a box half its smaller
    /// width. A round tool has Hertz's `√(R d)` at a depth `d` of half its smaller radius of
    /// curvature `R`. A cone has Sneddon's `2/π d tan α` at a depth `d` of its radius, but at least
    /// the value of its tip and at most its radius.
    pub fn contact_radius(&self) -> f64 {
        let hertz = |curvature: f64| curvature * FRAC_1_SQRT_2;
        match *self {
            Self::FlatPunch { radius, .. } => radius,
            Self::Box {
                size: [x, y, _], ..
            } => x.min(y) / 2.0,
            Self::Sphere { radius } | Self::Capsule { radius, .. } => hertz(radius),
            Self::Fingertip { radii: [a, b, c] } => hertz((a * a / c).min(b * b / c)),
            Self::Cone {
                radius,
                opening_angle,
                tip_radius,
                ..
            } => (FRAC_2_PI * radius * (0.5 * opening_angle).tan())
                .max(hertz(tip_radius))
                .min(radius),
        }
    }

    /// Radius of the contact of the tool pressed to this depth, m, and no more than [`Self::contact_radius`], which
    /// is that of a round tool half its radius deep.
    pub fn contact_radius_at(&self, depth: f64) -> f64 {
        let radius = self.contact_radius();
        match self {
            Self::Sphere { .. } | Self::Capsule { .. } | Self::Fingertip { .. } => {
                radius.min((SQRT_2 * radius * depth).sqrt())
            }
            Self::FlatPunch { .. } | Self::Box { .. } | Self::Cone { .. } => radius,
        }
    }

    /// Extent along the skin of the tool pressed to this depth, in metres: half widths of a
    /// rectangle along x and y, and the radius of a margin around the rectangle.
    pub fn reach(&self, depth: f64) -> ([f64; 2], f64) {
        // A round tool sinks in: radius of the circle in which it cuts the plane of the undeformed
        // skin.
        let sunk = |r: f64| (depth * (2.0 * r - depth).max(0.0)).sqrt();
        match *self {
            Self::Sphere { radius } => ([0.0; 2], sunk(radius)),
            Self::FlatPunch { radius, .. } => ([0.0; 2], radius),
            Self::Capsule { radius, length } => ([length / 2.0, 0.0], sunk(radius)),
            Self::Box {
                size: [x, y, _], ..
            } => ([x / 2.0, y / 2.0], 0.0),
            Self::Fingertip { radii: [a, b, c] } => ([0.0; 2], sunk((a * a / c).max(b * b / c))),
            Self::Cone {
                radius,
                opening_angle,
                tip_radius,
                ..
            } => {
                let (sin, cos) = (0.5 * opening_angle).sin_cos();
                let over_tip = depth - tip_radius * (1.0 - sin);
                let cut = if over_tip > 0.0 {
                    tip_radius * cos + over_tip * sin / cos
                } else {
                    sunk(tip_radius)
                };
                ([0.0; 2], cut.min(radius))
            }
        }
    }

    /// Half the larger width along the skin, in metres.
    pub fn half_width(&self) -> f64 {
        match *self {
            Self::Sphere { radius }
            | Self::FlatPunch { radius, .. }
            | Self::Cone { radius, .. } => radius,
            Self::Capsule { radius, length } => radius + 0.5 * length,
            Self::Box { size, .. } => 0.5 * size[0].max(size[1]),
            Self::Fingertip { radii } => radii[0].max(radii[1]),
        }
    }
}

/// Reads the sizes in a scene's table: checks them or takes their defaults.
struct Sizes<'a> {
    at: &'a Site<'a>,
    table: &'a ToolTable,
}

impl Sizes<'_> {
    fn one<K: Kind>(
        &self,
        key: &'static str,
        given: Option<Quantity<K>>,
        default: f64,
        limits: &Limits<Quantity<K>>,
    ) -> Result<f64, SceneError> {
        let size = given.unwrap_or(Quantity::from_si(default));
        Ok(self.at.key(key).within(size, limits)?.si())
    }

    fn three(
        &self,
        key: &'static str,
        given: Option<[Length; 3]>,
        default: [f64; 3],
        limits: &Limits<Length>,
    ) -> Result<[f64; 3], SceneError> {
        let lengths = given.unwrap_or(default.map(Length::from_si));
        crate::resolve::each(&self.at.key(key), lengths, limits)
    }

    fn radius(&self) -> Result<f64, SceneError> {
        self.one("radius", self.table.radius, RADIUS, &limits::TOOL_RADIUS)
    }

    fn opening_angle(&self) -> Result<f64, SceneError> {
        let given = self.table.opening_angle;
        self.one(
            "opening_angle",
            given,
            OPENING_ANGLE,
            &limits::OPENING_ANGLE,
        )
    }

    /// Radius of a rounded tip, at most `most`, in metres.
    fn tip_radius(&self, most: f64) -> Result<f64, SceneError> {
        let given = self.table.tip_radius;
        let default = TIP_RADIUS.min(most);
        let words = ["a tip", "is rounder than the cone"];
        self.rounding("tip_radius", given, default, most, words)
    }

    /// Radius of rounded edges, at most `most`, in metres.
    fn edge_radius(&self, most: f64) -> Result<f64, SceneError> {
        let given = self.table.edge_radius;
        let words = ["edges", "are rounder than the tool"];
        self.rounding("edge_radius", given, EDGE * most, most, words)
    }

    /// A radius of rounding, at most `most`, in metres. The words are of the error when it is
    /// larger: what is rounded, and what it does not fit.
    fn rounding(
        &self,
        key: &'static str,
        given: Option<Length>,
        default: f64,
        most: f64,
        [rounded, misfit]: [&str; 2],
    ) -> Result<f64, SceneError> {
        let radius = self.one(key, given, default, &limits::EDGE_RADIUS)?;
        if radius > most {
            return Err(self.at.key(key).invalid(format!(
                "{rounded} rounded by {} {misfit}, which has room for {}; make `{key}` smaller",
                Length::from_si(radius),
                Length::from_si(most)
            )));
        }
        Ok(radius)
    }
}

/// Radius of a bonded disc, in metres.
pub(crate) fn disc_radius(at: &Site<'_>, table: &ToolTable) -> Result<f64, SceneError> {
    Sizes { at, table }.radius()
}

impl fmt::Display for ContactShape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mm = |length: f64| format!("{:.1} mm", length * 1e3);
        let three = |[a, b, c]: [f64; 3]| {
            let [a, b, c] = [a, b, c].map(|length| format!("{:.1}", length * 1e3));
            format!("{a} × {b} × {c} mm")
        };
        match *self {
            Self::Sphere { radius } => write!(f, "sphere, radius {}", mm(radius)),
            Self::FlatPunch {
                radius,
                edge_radius,
            } => write!(
                f,
                "flat punch, radius {}, edge rounded by {}",
                mm(radius),
                Length::from_si(edge_radius)
            ),
            Self::Capsule { radius, length } => {
                write!(f, "capsule, radius {}, length {}", mm(radius), mm(length))
            }
            Self::Box { size, edge_radius } => write!(
                f,
                "box, {}, edges rounded by {}",
                three(size),
                Length::from_si(edge_radius)
            ),
            Self::Fingertip { radii } => write!(f, "fingertip, radii {}", three(radii)),
            Self::Cone {
                radius,
                opening_angle,
                tip_radius,
                ..
            } => write!(
                f,
                "cone, opening {:.0}°, radius {}, tip rounded by {}",
                opening_angle.to_degrees(),
                mm(radius),
                Length::from_si(tip_radius)
            ),
        }
    }
}
