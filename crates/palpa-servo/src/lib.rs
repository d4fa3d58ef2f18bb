//! The 1 kHz law: from where the tools are, and what the tissue last said of its contact, to forces.
//!
//! ```text
//! readings ─► hand ─► contact problem ─► transfer ─► ramp ─► damping ─► limits ─► commands
//!             NaN,    at the devices'    between     after   by the     size, slew
//!             jumps   poses              patches     faults  energy
//! ```
//! One [`Servo::tick`] serves a loop of ours and a vendor's callback. While the force is ramped, the energy observer
//! stands still: what a ramp up gives out is limited by its time, not by the budget.
//!
//! Nothing here allocates, waits or panics; the crate has no heap to do it with. All lengths are in metres, forces in
//! newtons, times in seconds.
#![no_std]
#![deny(
    clippy::indexing_slicing,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::unreachable
)]

mod axpy;
mod contact;
mod energy;
mod hand;
mod params;
mod patch;
mod report;
mod servo;
mod solver;
mod types;
mod velocity;

pub use params::ServoParams;
pub use patch::{Candidate, ContactPatch, MAX_CONTACTS, PatchSource, ToolContact};
pub use report::{Faults, Limits, TickReport, ToolReport};
pub use servo::Servo;
pub use types::{DeviceSpec, DeviceState, ForceCommand, MAX_TOOLS, Pose};

/// A vector in space.
pub type Vec3 = nalgebra::Vector3<f64>;
/// A 3 × 3 matrix.
pub type Mat3 = nalgebra::Matrix3<f64>;
