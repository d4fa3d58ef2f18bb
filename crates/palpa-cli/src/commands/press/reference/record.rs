//! Runs the script; writes every sample to the table and some of the bodies to the series for
//! ParaView.

use palpa_mesh::Vec3;

use super::super::Args;
use super::super::files::{Series, with_making};
use crate::cli::Context;
use palpa::build::BuiltBody;
use palpa::press::reference::{BarIndentation, BarOutcome, BarRun, BarSample};
use palpa_plot::output::OutDir;
use palpa_plot::vtu::Grid;

/// Result of a run.
pub(super) struct BarRecord {
    pub(super) samples: Vec<BarSample>,
    /// Positions at the deepest sample reached.
    pub(super) deepest: Vec<Vec3>,
    pub(super) deepest_depth: f64,
}

/// Runs the script. Every sample goes to the table at once, so that an interrupted run leaves a
/// valid table.
pub(super) fn record(
    args: &Args,
    context: &Context,
    out: &OutDir,
    built: &BuiltBody,
    indentation: &BarIndentation,
) -> anyhow::Result<BarRecord> {
    let mut table = out.table::<BarSample>("press.csv")?;
    let mut series = Series::new(args.frames, indentation.n_samples(), indentation.deepest());
    let mut run = indentation.start(&built.growth.body);
    let mut recorded = BarRecord {
        samples: Vec::new(),
        deepest: run.state.positions.clone(),
        deepest_depth: 0.0,
    };
    let progress = context.progress(indentation.n_samples(), "pressing");
    while let Some(sample) = run.advance() {
        table.push(&sample)?;
        if sample.outcome != BarOutcome::Diverged {
            if series.wants(recorded.samples.len()) {
                series.push(out, sample.time_s, &grid(built, &run))?;
            }
            if sample.depth_mm > recorded.deepest_depth {
                recorded.deepest_depth = sample.depth_mm;
                recorded.deepest.clone_from(&run.state.positions);
            }
        }
        recorded.samples.push(sample);
        progress.inc(1);
        if context.is_interrupted() {
            break;
        }
    }
    table.finish()?;
    series.finish(out, &built.bones)?;
    Ok(recorded)
}

/// The present body, with the forces that move it and the fields that show how it was made.
fn grid(built: &BuiltBody, run: &BarRun<'_>) -> Grid {
    let growth = &built.growth;
    let body = &growth.body;
    let displacement: Vec<Vec3> = (run.state.positions.iter().zip(&body.positions))
        .map(|(now, rest)| now - rest)
        .collect();
    let grid = Grid::of_body(body, &run.state.positions)
        .with_point_vectors("displacement", &displacement)
        .with_point_vectors("force", &run.state.node_forces);
    with_making(grid, body, &growth.thinning, &growth.stand_off)
}
