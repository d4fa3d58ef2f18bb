//! The continuum model: tissue as a nonlinear, nearly incompressible, viscoelastic solid on layered
//! prisms.

#[macro_use]
mod one_of;

mod assembly;
mod batch;
mod columns;
mod contact;
mod dynamics;
mod element;
mod error;
mod fields;
mod gmres;
pub mod law;
pub mod lump;
mod materials;
mod model;
pub mod pairing;
mod posed_tool;
pub mod realtime;
pub mod shape;
mod state;
mod statics;
mod system;

pub use contact::Touch;
pub use dynamics::Dynamics;
pub use element::Shares;
pub use error::FemError;
pub use fields::{PrismField, level_forces, prism_fields, relaxed_fields};
pub use law::{Kinematics, Law, Material, Response, VolumeMeasure};
pub use materials::{Materials, StiffnessField};
pub use model::{Model, ModelParams, Supports};
pub use posed_tool::PosedTool;
pub use state::State;
pub use statics::{
    ContactResiduals, Load, Outcome, SolveParams, StepReport, Workspace, advance, assume_pressures,
    equilibrate, pressures_at,
};

/// A 3 × 3 matrix, such as a deformation gradient.
pub type Mat3 = nalgebra::Matrix3<f64>;
/// Derivative of one 3 × 3 matrix by another; entry `(i, j)` of a matrix is the index `i + 3 j`.
pub type Mat9 = nalgebra::SMatrix<f64, 9, 9>;
