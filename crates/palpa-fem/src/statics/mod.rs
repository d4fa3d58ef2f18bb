//! Static equilibrium under tools, held nodes and forces, with optional inertia.
//!
//! | file | what happens there |
//! | --- | --- |
//! | `load`, `report` | input and result of a step |
//! | `load_steps` | [`advance`]: a step that does not converge is divided |
//! | `newton` | [`equilibrate`]: the iterations of one solve, and its outcome |
//! | `contacts` | pressure and friction at the present displacements, and their changes |
//! | `constraints` | supports, loads and contact in the linear system |
//! | `linear_step` | its solution: displacements and pressures together |
//! | `line_search` | how far to go along it |
//! | `workspace` | the arrays |
//!
//! How contact is solved: `docs/theory/contact.md`. Contact is solved in two more places of the
//! project, for the moving step and for the 1 kHz loop; `realtime/contact_problem.rs` compares the
//! three.

mod constraints;
mod contacts;
mod line_search;
mod linear_step;
mod load;
mod load_steps;
mod newton;
mod report;
mod workspace;

pub use contacts::{ContactResiduals, assume_pressures, pressures_at};
pub use load::{Load, SolveParams};
pub use load_steps::advance;
pub use newton::equilibrate;
pub use report::{Outcome, StepReport};
pub use workspace::Workspace;
