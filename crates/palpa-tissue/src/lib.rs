//! Scene file, units and the tissue catalogue.
//!
//! A scene is a TOML file that says which body is pressed, of which layers it is made, and how it is pressed. What
//! [`Scene::load`] returns is complete and valid: lengths are metres, tissues are looked up, defaults are filled in.
//!
//! ```
//! use palpa_tissue::Scene;
//!
//! let scene = Scene::parse(
//!     r#"
//!     [body]
//!     surface = "skin.ply"
//!     [[layer]]
//!     tissue = "fat"
//!     thickness = "20 mm"
//!     "#,
//!     "bodies".as_ref(),
//! )?;
//! assert_eq!(scene.layers[0].tissue.young(), Some(2500.0)); // Pa
//! # Ok::<(), palpa_tissue::SceneError>(())
//! ```

pub mod units;

mod catalogue;
mod error;
mod file;
mod limits;
mod resolve;
mod scene;
mod schema;
mod thickness;
mod write;

pub use catalogue::{Law, Sourced, Status, Tissue, catalogue};
pub use error::{Place, SceneError};
pub use scene::{
    Body, CutFaces, Cutout, Generator, InPlane, Layer, LengthUnit, MaterialStatus, Press,
    Reference, Scene, Skin, Solver, Target, Tool,
};
pub use schema::scene_schema;
pub use thickness::{Thickness, ThicknessError, ThicknessSample, read_thickness};
