//! The 1 kHz law: from where the tools are, and what the tissue last said of its contact, to forces.
//!
//! Nothing here allocates, waits or panics; the crate has no heap to do it with. All lengths are in metres, forces in
//! newtons, times in seconds.
#![no_std]

mod patch;
mod types;

pub use patch::{Candidate, ContactPatch, MAX_CONTACTS, ToolContact};
pub use types::{DeviceSpec, DeviceState, ForceCommand, MAX_TOOLS, Pose};

/// A vector in space.
pub type Vec3 = nalgebra::Vector3<f64>;
/// A 3 × 3 matrix.
pub type Mat3 = nalgebra::Matrix3<f64>;
