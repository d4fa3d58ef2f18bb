//! The moving step: the same element and laws, fast enough for a hand.
//!
//! A step follows the tools by one Newton iteration, two where forces are far out of balance. The stiffness of a *zone* round
//! the tools is made anew in every step, in single precision; forces and displacements are in double precision, so that the
//! stiffness decides how fast a step converges, and not to what. The stiffness of the rest of the body is an earlier one,
//! made anew in the background ([`Rebuild`]). Contact is a small problem of its own on the compliance of a few vertices
//! (`contact.rs`), which is also what the haptic loop gets.

mod batch;
mod contact;
mod elementary;
mod kernel;
mod lanes;
mod live;
mod local;
mod principal;
#[cfg(test)]
mod tests;
mod zone;

pub use live::{
    ExteriorMode, FineBodies, Glance, Live, LiveParams, LiveReport, Rebuild, Rebuilt, RoamDone,
    RoamJob, Roaming, StepOutcome,
};
pub use local::{LocalContact, LocalModel, LocalTool};

use palpa_sparse::ColumnPattern;

use crate::model::Model;

/// How many vertices may be candidates for contact.
pub const MOST_CANDIDATES: usize = 160;

/// The columns of a body's skin, and which of them are neighbours.
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
