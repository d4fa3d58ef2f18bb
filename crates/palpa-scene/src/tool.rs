//! Tools: what presses.

use std::fmt;

use crate::frame;
use crate::units::Length;

/// What presses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tool {
    /// A patch of skin bonded to a rigid disc of this radius, in metres.
    Disc {
        /// Radius in metres.
        radius: f64,
    },
    /// A single node that is moved.
    Node,
    /// A rigid body that presses by contact: it pushes and rubs, and never pulls.
    Contact(ContactTool),
}

/// A rigid body that presses by contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactTool {
    /// Its shape.
    pub shape: ContactShape,
    /// Coulomb's coefficient of friction; 0 is without friction.
    pub friction: f64,
    /// Unit vector that its length points along as nearly as a lying tool can; `None` is as near to the body's x as it
    /// goes, see [`axes`](Self::axes).
    pub axis: Option<[f64; 3]>,
}

/// The shape of a rigid tool. All lengths in metres. At depth 0 it touches the skin at rest with the point that goes
/// first, in the middle of its face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ContactShape {
    /// A ball.
    Sphere {
        /// Its radius.
        radius: f64,
    },
    /// The flat end of a round rod, with a rounded edge.
    FlatPunch {
        /// Radius of the rod.
        radius: f64,
        /// Radius of its edge's rounding, no more than `radius`.
        edge_radius: f64,
    },
    /// A lying cylinder with round ends.
    Capsule {
        /// Radius of the cylinder and its ends.
        radius: f64,
        /// Length of the straight part, between the centres of the ends.
        length: f64,
    },
    /// A box with rounded edges.
    Box {
        /// Its whole size along, across, and in the direction of the press.
        size: [f64; 3],
        /// Radius of its edges' rounding, no more than half its smallest size.
        edge_radius: f64,
    },
    /// The pad of a finger: an ellipsoid.
    Fingertip {
        /// Its radii along the finger, across it, and in the direction of the press.
        radii: [f64; 3],
    },
}

impl Tool {
    /// Whether the skin sticks to it: a held disc or node, not a body that touches.
    pub fn is_bonded(&self) -> bool {
        !matches!(self, Self::Contact(_))
    }

    /// The rigid body, if it presses by contact.
    pub fn contact(&self) -> Option<&ContactTool> {
        match self {
            Self::Contact(tool) => Some(tool),
            Self::Disc { .. } | Self::Node => None,
        }
    }

    /// Radius of a circle of skin that it presses on in metres, as a size: of a disc or punch its own, of a box half its
    /// smaller width; of a round tool that of the patch which Hertz's `√(R d)` gives at a depth `d` of half its smaller
    /// radius of curvature `R`; 0 of a node.
    pub fn contact_radius(&self) -> f64 {
        let hertz = |curvature: f64| curvature * std::f64::consts::FRAC_1_SQRT_2;
        let tool = match self {
            Self::Disc { radius } => return *radius,
            Self::Node => return 0.0,
            Self::Contact(tool) => tool,
        };
        match tool.shape {
            ContactShape::FlatPunch { radius, .. } => radius,
            ContactShape::Box {
                size: [x, y, _], ..
            } => x.min(y) / 2.0,
            ContactShape::Sphere { radius } | ContactShape::Capsule { radius, .. } => hertz(radius),
            ContactShape::Fingertip { radii: [a, b, c] } => hertz((a * a / c).min(b * b / c)),
        }
    }
}

impl ContactShape {
    /// Radius of the rounding of a flat tool's edge in metres.
    pub fn edge_radius(&self) -> Option<f64> {
        match *self {
            Self::FlatPunch { edge_radius, .. } | Self::Box { edge_radius, .. } => {
                Some(edge_radius)
            }
            Self::Sphere { .. } | Self::Capsule { .. } | Self::Fingertip { .. } => None,
        }
    }
}

impl ContactTool {
    /// The tool's own axes, three unit vectors of a right-handed frame, where it moves along the unit vector `direction`:
    /// its length, its width, and out of the tissue, against `direction`.
    pub fn axes(&self, direction: [f64; 3]) -> [[f64; 3]; 3] {
        frame::keeping_third(self.axis, direction.map(|x| -x))
    }
}

impl fmt::Display for Tool {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Disc { radius } => write!(f, "bonded disc, radius {:.1} mm", radius * 1e3),
            Self::Node => f.write_str("single operated node"),
            Self::Contact(tool) if tool.friction > 0.0 => {
                write!(f, "{}, friction {}", tool.shape, tool.friction)
            }
            Self::Contact(tool) => write!(f, "{}, without friction", tool.shape),
        }
    }
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
        }
    }
}
