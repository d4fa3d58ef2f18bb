//! Feel what lies beneath the skin: from a scene to a layered body that is pressed by script or
//! touched live.
//!
//! A skin surface is grown inward into layers of triangular prisms, pressed with a tool, and pushes
//! back in newtons. The parts are crates of their own, re-exported here. Pictures and files are in
//! `palpa-plot`, the viewer in `palpa-viewer` and `palpa-session`, verification and benchmarks in
//! `palpa-lab`, the command in `palpa-cli`.
//!
//! ```
//! use std::path::Path;
//! use std::sync::Arc;
//!
//! use palpa::Prepared;
//! use palpa::press::tissue::{Indentation, Record};
//! use palpa::scene::Scene;
//!
//! fn main() -> anyhow::Result<()> {
//!     let text = r#"
//!         [body]
//!         generator = { kind = "block", size = ["40 mm", "40 mm", "16 mm"], spacing = "10 mm" }
//!         [[layer]]
//!         tissue = { name = "gel", young = "10 kPa", poisson = 0.45 }
//!         [tool]
//!         shape = "sphere"
//!         radius = "8 mm"
//!         [press]
//!         depth = "2 mm"
//!         step = "1 mm"
//!     "#;
//!     let scene = Scene::parse(text, Path::new("."))?; // or Scene::load("limb.toml".as_ref())?
//!     let press = Indentation::build(Arc::new(Prepared::build(&scene)?))?;
//!     let mut record = Record::new(&press);
//!     let mut run = press.start(0); // the first speed
//!     while let Some(sample) = run.advance() {
//!         // A step that fails is the last. Its sample repeats the forces of the sample before.
//!         if sample.outcome.is_converged() {
//!             println!("{} mm, {} N", sample.depth_mm, sample.force_n);
//!         }
//!         record.push(&run, sample);
//!     }
//!     for note in press.notes.iter().chain(&record.notes()) {
//!         println!("note: {note}");
//!     }
//!     assert!(record.outcome().is_converged());
//!     let first = &record.runs()[0];
//!     assert!(first.at_depth_mm == 2.0 && first.max_force_n > 0.05);
//!     Ok(())
//! }
//! ```

pub mod accuracy;
pub mod audit;
pub mod build;
pub mod check;
pub mod continuum;
mod error;
pub mod live;
pub mod map;
mod note;
mod prepare;
pub mod press;
mod skin;
mod touch;

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
pub use skin::SkinPoint;

// The example of the README is compiled and run as well.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
