//! Tools.

use std::fmt;

use schemars::JsonSchema;
use serde::Serialize;

use crate::{ContactShape, frame};

/// The tool of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Tool {
    /// A patch of skin bonded to a rigid disc of this radius, in metres.
    Disc {
        /// Radius in metres.
        radius: f64,
    },
    /// A single node that is moved.
    Node,
    /// A rigid body that presses by contact: it pushes and rubs, but never pulls.
    Contact(ContactTool),
}

/// A rigid body that presses by contact.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct ContactTool {
    /// Its shape.
    pub shape: ContactShape,
    /// Coulomb's coefficient of friction; 0 for no friction.
    pub friction: f64,
    /// Unit vector of its length; only the part across the press counts. `None` is as near to the
    /// body's x as possible, see [`axes`](Self::axes).
    pub axis: Option<[f64; 3]>,
}

impl Tool {
    /// Whether the skin is bonded to it: true for a disc or a node, false for a body in contact.
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

    /// Typical contact radius in metres: the radius of a disc, 0 for a node, and
    /// [`ContactShape::contact_radius`] for a shape.
    pub fn contact_radius(&self) -> f64 {
        match self {
            Self::Disc { radius } => *radius,
            Self::Node => 0.0,
            Self::Contact(tool) => tool.shape.contact_radius(),
        }
    }

    /// Whether the tool touches more than a node: only then has its force a limit for ever finer meshes.
    pub fn has_size(&self) -> bool {
        self.contact_radius() > 0.0
    }

    /// Whether the tool has a flat face with a rounded edge.
    pub fn is_flat(&self) -> bool {
        self.rounded_edge().is_some()
    }

    /// Length of the skin's edges near the tool, m: a share of the contact radius, at most 0.8 times
    /// the radius of the rounded edge, so that vertices lie on it. 0 for a node.
    pub fn edge_length(&self, share: f64) -> f64 {
        let wanted = share * self.contact_radius();
        self.rounded_edge()
            .map_or(wanted, |edge| wanted.min(0.8 * edge))
    }

    /// Radius of the rounded edge of a flat tool, m.
    pub fn rounded_edge(&self) -> Option<f64> {
        self.contact().and_then(|tool| tool.shape.edge_radius())
    }
}

impl ContactTool {
    /// The tool's own axes, for a tool that moves along the unit vector `direction`: three unit
    /// vectors of a right-handed frame. They are its length, its width, and the direction out of
    /// the tissue (against `direction`).
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
