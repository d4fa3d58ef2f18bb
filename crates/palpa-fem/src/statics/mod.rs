//! Static equilibrium under tools, held nodes and forces, with optional inertia.
//!
//! | file | what happens there |
//! | --- | --- |
//! | `load`, `report` | input and result of a step |
//! | `load_steps` | [`advance`]: a step that does not converge is divided |
//! | `newton` | [`equilibrate`]: the iterations of one solve, and its outcome |
//! | `active_set` | vertices that touch a tool: gaps, normals, friction |
//! | `constraints` | which vertices touch, slide and stick; holds and friction in the linear system |
//! | `linear_step` | the linear system's solution; GMRES for friction and for kept factors |
//! | `line_search` | how far to go along it |
//! | `smoothing` | smoothed friction, where the exact law does not converge |
//! | `workspace` | the arrays |
//!
//! How contact is solved: `docs/theory/contact.md`. Contact is solved in two more places of the
//! project, for the moving step and for the 1 kHz loop; `realtime/contact_problem.rs` compares the
//! three.

mod active_set;
mod constraints;
mod line_search;
mod linear_step;
mod load;
mod load_steps;
mod newton;
mod report;
mod smoothing;
mod workspace;

pub use active_set::{ContactResiduals, assume_touches};
pub use load::{Load, SolveParams};
pub use load_steps::advance;
pub use newton::equilibrate;
pub use report::{Outcome, StepReport};
pub use workspace::Workspace;
