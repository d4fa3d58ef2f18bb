//! The reference method: a layered body as a network of bars. Incremental finite elements move it;
//! where they fail, explicit Euler takes over.
//!
//! A [`Network`] of pin-jointed bars is built from a layered body. [`Constraints`] say which nodes
//! are fixed, which the device holds (the *operated* nodes), and which move only in a plane. Both
//! make a [`SpringModel`], which never changes. [`step()`] moves a [`SpringState`] by one
//! displacement of the operated nodes; a [`Workspace`] is its scratch memory.
//!
//! ```
//! use palpa_mesh::{Vec3, generate::patch};
//! use palpa_springs::{Constraints, LayerStiffness, SpringModel, SpringParams, SpringState, StepParams, Workspace, step};
//!
//! let body = patch::patch(4, 4, 0.04, &[0.0, 0.04, 0.08, 0.12], &[0, 0, 0]);
//! let held = body.node(patch::centre_vertex(4, 4), 0);
//! let params = SpringParams::new([LayerStiffness::Spring { stiffness: 1.0e-3 }]);
//! let model = SpringModel::build(&body, &params, &Constraints::hold(&body, [held]))?;
//! let (mut state, mut ws) = (SpringState::new(&model), Workspace::new(&model));
//! let report = step(&model, &mut state, &mut ws, Vec3::new(0.0, 0.0, -0.01), &StepParams::default());
//! assert!(report.force.z > 0.0, "the body pushes the tool back out");
//! # Ok::<(), palpa_springs::SpringError>(())
//! ```
//!
//! Displacements are in metres, stiffnesses in N/m, forces in newtons. The force is the one **on
//! the tool by the body**.

mod constraints;
mod error;
mod euler;
mod model;
mod network;
mod params;
mod relax;
mod state;
mod step;
mod stiffness;
mod system;

pub use constraints::Constraints;
pub use error::SpringError;
pub use euler::{Crossing, EulerParams, steps_to_cross};
pub use model::SpringModel;
pub use network::{Bar, Network};
pub use params::{InterfaceBars, LayerStiffness, Solver, SpringParams};
pub use state::{Mode, SpringState, Workspace};
pub use step::{Corrections, Method, Outcome, StepParams, StepReport, step};
