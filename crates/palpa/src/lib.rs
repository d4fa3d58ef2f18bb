//! Feel what lies beneath the skin: from a scene to a layered body that is pressed by script or touched live.
//!
//! A skin surface is grown inward into layers of triangular prisms, pressed with a tool, and pushes back in newtons.
//! The parts are crates of their own, re-exported here. Pictures and files are in `palpa-plot`, the viewer in
//! `palpa-viewer` and `palpa-session`, verification and benchmarks in `palpa-lab`, the command in `palpa-cli`.

pub mod build;
pub mod continuum;
mod error;
pub mod live;
mod note;
mod prepare;
pub mod press;

pub use error::one_paragraph;
pub use note::{LayerAspect, Note, in_words, note_schema};
pub use palpa_device as device;
pub use palpa_fem as fem;
pub use palpa_mesh as mesh;
pub use palpa_rt as rt;
pub use palpa_scene as scene;
pub use palpa_servo as servo;
pub use palpa_springs as springs;
pub use prepare::{Approach, PrepareParams, Prepared};
