//! The 1 kHz law: computes the force on each device from the tools' poses and the tissue's newest
//! contact patch.
//!
//! ```text
//! readings ─► hand ─► contact problem ─► transfer ─► ramp ─► damping ─► limits ─► commands
//!             NaN,    at the devices'    between     after   by the     size, slew
//!             jumps   poses              patches     faults  energy
//! ```
//! [`Servo::tick`] may be called from Palpa's own loop or from a vendor's callback. While the force
//! is ramped, the energy observer counts the share that is let through. The duration of the ramp
//! limits the energy that a ramp up gives out, not the budget.
//!
//! Nothing here allocates, waits or panics; the crate has no heap. All lengths are in metres,
//! forces in newtons, times in seconds.
#![no_std]
#![deny(
    clippy::indexing_slicing,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::unreachable
)]

// Types that callers pass in and get back.
mod params;
mod patch;
mod report;
mod types;

// The stages of the law, in the order of a tick.
mod servo;

mod hand;
mod velocity;

mod solver;

mod axpy;
mod contact;

mod energy;

pub use params::ServoParams;
pub use patch::{Candidate, ContactPatch, MAX_CONTACTS, PatchSource, ToolContact};
pub use report::{Faults, Limits, TickReport, ToolReport};
pub use servo::Servo;
pub use types::{DeviceSpec, DeviceState, ForceCommand, MAX_TOOLS, Pose};

/// A vector in space.
pub type Vec3 = nalgebra::Vector3<f64>;
/// A 3 × 3 matrix.
pub type Mat3 = nalgebra::Matrix3<f64>;
