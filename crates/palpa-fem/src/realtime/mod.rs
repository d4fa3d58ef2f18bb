//! The moving step: the same element and laws, fast enough for a hand.

mod batch;
mod kernel;
mod lanes;
#[cfg(test)]
mod tests;

use palpa_sparse::ColumnPattern;

use crate::model::Model;

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
