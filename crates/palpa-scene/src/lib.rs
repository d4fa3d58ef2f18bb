//! The scene file, units, and the catalogue of tissues.
//!
//! A scene is a TOML file with a body, its layers, and the way it is pressed. [`Scene::load`]
//! returns a complete and valid scene: lengths are in metres, tissues are looked up, and defaults
//! are filled in.
//!
//! ```
//! use palpa_scene::Scene;
//!
//! let scene = Scene::parse(
//!     r#"
//!     [body]
//!     surface = "skin.ply"
//!     [[layer]]
//!     tissue = "muscle"
//!     thickness = "20 mm"
//!     "#,
//!     "bodies".as_ref(),
//! )?;
//! assert_eq!(scene.layers[0].tissue.young(), Some(22e3)); // Pa
//! # Ok::<(), palpa_scene::SceneError>(())
//! ```

pub mod built_in;
pub mod units;

mod catalogue;
mod elastic;
mod error;
mod file;
mod frame;
mod law;
mod limits;
mod lump;
mod model;
mod motion;
mod parameters;
mod resolve;
mod scene;
mod schema;
mod shape;
mod status;
mod thickness;
mod tissue;
mod tool;
mod write;

pub use built_in::BuiltIn;
pub use catalogue::catalogue;
pub use elastic::{Elastic, Resistance, Stiffness, Volume};
pub use error::{Place, SceneError, nearest};
pub use law::{Energy, OgdenTerm};
pub use lump::{Lump, LumpPlace, LumpShape};
pub use model::{BelowFirst, Damping, Dynamics, Mesh, Model, ModelKind};
pub use motion::{Device, DeviceKind, DevicePreset, Grip, Motion, MotionKind};
pub use scene::{
    Body, CutFaces, Cutout, Generator, InPlane, Layer, LengthUnit, Press, Reference, Scene, Skin,
    Solver, Target,
};
pub use schema::scene_schema;
pub use shape::ContactShape;
pub use status::{MaterialStatus, Parameter};
pub use thickness::{Thickness, ThicknessError, ThicknessSample, read_thickness};
pub use tissue::{Law, Moduli, Prony, PronyTerm, Sourced, Status, Tissue};
pub use tool::{ContactTool, Tool};
