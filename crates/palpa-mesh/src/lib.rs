//! Surfaces in, and layered bodies of triangular prisms out.
//!
//! The modules stand in the order in which data flows: a [`Surface`] is read, checked and repaired, and then grown
//! inward into a [`LayeredBody`].

pub mod body;
pub mod surface;

pub use body::LayeredBody;
pub use surface::Surface;

/// A point or vector in space, in metres unless a name says otherwise.
pub type Vec3 = nalgebra::Vector3<f64>;
