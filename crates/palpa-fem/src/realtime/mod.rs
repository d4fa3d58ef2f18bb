//! Real-time steps: the same element and laws, fast enough for a hand.
//!
//! A step follows the tools by one Newton iteration, or by two where forces are far out of balance.
//! The stiffness of a *zone* around the tools is computed anew in every step, in single precision.
//! Forces and displacements are in double precision. So the stiffness determines how fast a step
//! converges, but not the result. The stiffness of the rest of the body, the *exterior*, is an
//! earlier one; the background renews it ([`Rebuild`]). Contact is a small problem of its own on
//! the compliance of a few vertices (`contact_problem.rs`); the haptic loop gets the same
//! compliance.
//!
//! ```text
//! lanes, elementary, principal ─► kernel ─► batch ─► inside (zone) ────┐
//!                                             └────► outside (exterior) ┤─► live ─► local ─► haptic loop
//! plan (which columns are in the zone) ─────────────────────────────────┤
//! candidate ─► contact_problem ─────────────────────────────────────────┘
//! ```

mod batch;
mod candidate;
mod contact_problem;
mod elementary;
mod inside;
mod kernel;
mod lanes;
mod live;
mod local;
mod outside;
mod plan;
mod principal;
#[cfg(test)]
mod tests;

pub use live::{
    ExteriorMode, FineBodies, Glance, Live, LiveParams, LiveReport, Rebuild, Rebuilt, RoamDone,
    RoamJob, Roaming, StepOutcome,
};
pub use local::{LocalContact, LocalModel, LocalTool};

use palpa_sparse::ColumnPattern;

use crate::model::Model;

/// Largest number of contact candidates.
pub const MOST_CANDIDATES: usize = 160;

/// The columns of a body's skin, and their neighbours.
fn column_pattern(model: &Model) -> ColumnPattern {
    let edges = model.structure.groups.iter().flat_map(|group| {
        let vertices = &group.vertices[..group.n_columns()];
        vertices
            .iter()
            .enumerate()
            .flat_map(move |(i, &a)| vertices[..i].iter().map(move |&b| (a as usize, b as usize)))
    });
    ColumnPattern::new(
        model.body.n_vertices(),
        model.structure.n_free_levels,
        edges,
    )
}
