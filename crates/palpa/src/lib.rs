//! Feel what lies beneath the skin: the `palpa` command, and the facade that library users depend on.
//!
//! A skin surface is grown inward into layers of triangular prisms, pressed with a tool, and pushes back in newtons.
//! The parts are crates of their own, re-exported here; this crate adds the command and what it writes.

// `println!` panics when the reader has gone, as in `palpa check … | head`: print through `cli::Context`.
#![warn(clippy::print_stdout, clippy::print_stderr)]

pub mod bench;
pub mod build;
pub mod cli;
pub mod commands;
pub mod continuum;
pub mod engine;
pub mod export;
pub mod output;
pub mod plot;
pub mod press;
pub mod reproduce;
pub mod section;
pub mod session;
pub mod table;
pub mod vtu;

pub use palpa_device as device;
pub use palpa_fem as fem;
pub use palpa_mesh as mesh;
pub use palpa_rt as rt;
pub use palpa_servo as servo;
pub use palpa_springs as springs;
pub use palpa_tissue as tissue;
pub use palpa_verify as verify;
pub use palpa_viewer as viewer;
