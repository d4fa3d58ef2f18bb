//! Lumps: what is harder or softer than the layers round it.

use std::path::PathBuf;

use crate::scene::Target;
use crate::{Tissue, frame};

/// A lump in the tissue. All lengths in metres.
#[derive(Debug, Clone, PartialEq)]
pub struct Lump {
    /// Its name in reports.
    pub name: String,
    /// Its shape.
    pub shape: LumpShape,
    /// Where it lies.
    pub place: LumpPlace,
    /// Unit vector along which its first radius or its length points; `None` is along the skin, see
    /// [`axes`](Self::axes).
    pub axis: Option<[f64; 3]>,
    /// What it is made of; never a tissue given by a spring stiffness.
    pub tissue: Tissue,
    /// Width of the zone, with its middle on the lump's surface, over which its tissue passes into the one round it; 0
    /// for a sharp edge.
    pub transition: f64,
}

/// The shape of a lump, with its centre at the origin of its own frame.
#[derive(Debug, Clone, PartialEq)]
pub enum LumpShape {
    /// A ball.
    Sphere {
        /// Its radius.
        radius: f64,
    },
    /// An ellipsoid.
    Ellipsoid {
        /// Its radii along the three [`axes`](Lump::axes).
        radii: [f64; 3],
    },
    /// A cylinder with round ends, lying along the first of its [`axes`](Lump::axes).
    Capsule {
        /// Radius of the cylinder and its ends.
        radius: f64,
        /// Length of the straight part, between the centres of the ends.
        length: f64,
    },
    /// A closed triangle mesh in a file, in the unit of the body.
    Mesh(PathBuf),
}

/// Where a lump lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LumpPlace {
    /// Its centre is below a place of the skin at rest.
    Below {
        /// The place of the skin.
        target: Target,
        /// Depth of the centre along the inward normal of the skin there.
        depth: f64,
    },
    /// Its centre is here.
    At([f64; 3]),
    /// Where its mesh has it.
    AsRead,
}

impl LumpShape {
    /// Its smallest radius, in metres; `None` for a mesh.
    pub fn smallest_radius(&self) -> Option<f64> {
        match self {
            Self::Sphere { radius } | Self::Capsule { radius, .. } => Some(*radius),
            Self::Ellipsoid { radii } => radii.iter().copied().min_by(f64::total_cmp),
            Self::Mesh(_) => None,
        }
    }
}

impl Lump {
    /// The lump's own axes, three unit vectors of a right-handed frame, where the skin's inward normal is `inward`.
    ///
    /// The first points along `axis`, or else along the skin as near to the body's x as it goes (to y where the skin looks
    /// along x); the third inward as nearly as the first lets it.
    pub fn axes(&self, inward: [f64; 3]) -> [[f64; 3]; 3] {
        match self.axis {
            Some(axis) => frame::keeping_first(axis, inward),
            None => frame::keeping_third(None, inward),
        }
    }
}
