//! The data for pages: the picture (meshes, frames, fields) and the texts (state, figures,
//! notices).
//!
//! ```text
//!  body, tick, look ──► Screen ── mesh before its frames ──────┐
//!                         ├─ Fields, on a thread of their own  ├──► Publisher ──► pages
//!                         └─ Pace: seldom at rest              │
//!  state, problem ────► Status ── state, figures, notices ─────┘
//! ```

mod events;
mod fields;
mod figures;
mod frame;
mod notes;
mod pace;
mod screen;
mod status;

pub(crate) use events::granted;
pub(crate) use fields::Fields;
pub(crate) use figures::Figures;
pub(crate) use notes::shown;
pub(crate) use screen::{MeshBytes, Screen};
pub(crate) use status::{Status, Told};
