//! From surfaces to layered bodies of triangular prisms.
//!
//! The modules are listed in the order of the data flow: a [`Surface`] is read, checked and
//! repaired, coarsened if asked, and then grown inward into a [`LayeredBody`].

pub mod body;
pub mod check;
pub mod coarsen;
pub mod distance;
pub mod generate;
pub mod growth;
pub mod orient;
mod part;
pub mod quality;
pub mod read;
pub mod refine;
pub mod repair;
pub mod surface;
mod topology;
pub mod weld;
pub mod write;

pub use body::{CutFace, LayeredBody};
pub use check::{SurfaceReport, Verdict, check_surface, examine};
pub use coarsen::Coarsening;
pub use distance::{SurfaceIndex, closest_on_triangle};
pub use growth::{Growth, GrowthError, GrowthParams, LayerSpec, grow};
pub use part::Part;
pub use read::{
    Format, ReadError, SurfaceFile, read_surface, read_surface_bytes, read_surface_named,
};
pub use repair::{RepairOptions, RepairReport, repair};
pub use surface::Surface;
pub use weld::{weld_exact, weld_within};
pub use write::{WriteError, write_surface};

/// A point or vector in space, in metres unless a name says otherwise.
pub type Vec3 = nalgebra::Vector3<f64>;
