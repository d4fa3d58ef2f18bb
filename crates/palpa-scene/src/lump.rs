//! Lumps: inclusions that are harder or softer than the layers around them.

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
    /// Its place.
    pub place: LumpPlace,
    /// Unit vector of its first radius or its length; `None` is along the skin, see
    /// [`axes`](Self::axes).
    pub axis: Option<[f64; 3]>,
    /// Its tissue; never one given by a spring stiffness.
    pub tissue: Tissue,
    /// Width of the transition between its tissue and the tissue around it, centred on the lump's
    /// surface; 0 for a sharp edge.
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

/// The place of a lump.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LumpPlace {
    /// The centre is below a place of the skin at rest.
    Below {
        /// The place of the skin.
        target: Target,
        /// Depth of the centre along the inward normal of the skin there.
        depth: f64,
    },
    /// The centre is at this point.
    At([f64; 3]),
    /// The position in the mesh file.
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
    /// The lump's own axes: three unit vectors of a right-handed frame. `inward` is the skin's
    /// inward normal.
    ///
    /// The first axis points along `axis`. Without `axis` it lies along the skin, as near to the
    /// body's x as possible, or to y if the skin's normal is along x. The third axis is as near to
    /// `inward` as possible.
    pub fn axes(&self, inward: [f64; 3]) -> [[f64; 3]; 3] {
        match self.axis {
            Some(axis) => frame::keeping_first(axis, inward),
            None => frame::keeping_third(None, inward),
        }
    }
}
