//! One frame of the series: the deformed body with its fields.

use palpa_fem::PrismField;

use super::super::files::with_making;
use palpa::accuracy::{ErrorBars, Source};
use palpa::press::tissue::{Indentation, Run};
use palpa_plot::vtu::Grid;

/// Point arrays: `displacement` (m), `force` (N) that holds a node, `contact_pressure` on the skin
/// (Pa), and how the body was made. Cell arrays, each a mean over the prism: `cauchy`, `von_mises`
/// and `pressure` (Pa), `stretch_min` and `stretch_max`, `volume_ratio`, `strain_energy` (J/m³),
/// `lump` (volume share of lump in the prism).
pub(super) fn grid(indentation: &Indentation, lump_shares: &[f64], run: &Run<'_>) -> Grid {
    let (model, mesh) = (&indentation.model, indentation.mesh());
    let body = &mesh.body;
    let fields = &run.fields;
    let scalar = |of: fn(&PrismField) -> f64| fields.iter().map(of).collect::<Vec<f64>>();
    let cauchy: Vec<_> = fields.iter().map(|field| field.cauchy).collect();
    let mut pressure = vec![0.0; body.n_nodes()];
    for (v, p) in indentation.skin_pressure(run).into_iter().enumerate() {
        pressure[body.node(v, 0)] = p;
    }
    let mut grid = Grid::of_body(body, &run.state.positions(model))
        .with_point_vectors("displacement", &run.state.displacements)
        .with_point_vectors("force", run.workspace.reactions())
        .with_point_scalars("contact_pressure", pressure)
        .with_cell_tensors("cauchy", &cauchy)
        .with_cell_scalars("von_mises", scalar(PrismField::von_mises))
        .with_cell_scalars("pressure", scalar(PrismField::pressure))
        .with_cell_scalars("stretch_min", scalar(|field| field.stretches[0]))
        .with_cell_scalars("stretch_max", scalar(|field| field.stretches[2]))
        .with_cell_scalars("volume_ratio", scalar(|field| field.volume_ratio))
        .with_cell_scalars("strain_energy", scalar(|field| field.energy));
    if !lump_shares.is_empty() {
        grid = grid.with_cell_scalars("lump", lump_shares.to_vec());
    }
    with_making(grid, body, &mesh.thinning, &mesh.stand_off)
}

/// Where errors of the mesh arise, on the body at rest. Point arrays (m): `displacement_error_bar`, how
/// far the node may be from its place on an infinitely fine mesh at the deepest, and for each source
/// how far its probe moves the node.
pub(super) fn error_grid(indentation: &Indentation, bars: &ErrorBars) -> Grid {
    let body = &indentation.mesh().body;
    let mut grid = Grid::of_body(body, &body.positions)
        .with_point_scalars("displacement_error_bar", bars.displacement_bars());
    for (source, moves) in Source::ALL.into_iter().zip(&bars.moves) {
        let name = match source {
            Source::Near => "moved_near",
            Source::SkinFar => "moved_skin_far",
            Source::LevelsDeep => "moved_levels_deep",
        };
        grid = grid.with_point_scalars(name, moves.clone());
    }
    grid
}
