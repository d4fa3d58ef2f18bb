//! Runs the script; writes every sample to the table and some of the bodies to the series for
//! ParaView.

use palpa_fem::{level_forces, prism_fields};
use palpa_mesh::quality::prism_shapes;
use palpa_mesh::{LayeredBody, Vec3};

use super::super::Job;
use super::super::files::Series;
use super::fields::grid;
use palpa::press::tissue::{Failure, Indentation, Run, Sample};
use palpa_plot::output::{CsvTable, OutDir};

/// Result of the runs.
pub(super) struct Recorded {
    pub(super) samples: Vec<Sample>,
    pub(super) failures: Vec<Failure>,
    /// The body at the deepest sample of the first run.
    pub(super) deepest: Deepest,
}

/// The body at its deepest sample.
pub(super) struct Deepest {
    /// Index of the sample.
    pub(super) sample: usize,
    pub(super) depth_mm: f64,
    pub(super) displacements: Vec<Vec3>,
    /// Force of the tissue below on each level, N; shape `[n_levels]`.
    pub(super) level_forces: Vec<Vec3>,
    /// Von Mises stress of every prism, Pa; shape `[n_prisms]`.
    pub(super) von_mises: Vec<f64>,
    /// Prisms with a corner turned inside out, if any.
    pub(super) turned: Option<Turned>,
}

/// Prisms that are turned inside out at a corner, although the volume is positive at every
/// integration point.
pub(super) struct Turned {
    pub(super) n: usize,
    /// Middle of the worst prism, m.
    pub(super) at: Vec3,
}

/// Runs the script at every speed. Every sample goes to the table at once, so that an interrupted
/// run leaves a valid table.
pub(super) fn record(job: &Job<'_>, indentation: &Indentation) -> anyhow::Result<Recorded> {
    let Job {
        args,
        context,
        out,
        scene,
        ..
    } = *job;
    let names = scene.layers.iter().map(|layer| layer.tissue.name.as_str());
    let mut table = table(out, names)?;
    let n_samples = indentation.n_samples();
    let lump_shares = indentation.prepared.lump_shares();
    let mut series = Series::new(args.frames, n_samples, indentation.deepest());
    let mut recorded = Recorded {
        samples: Vec::new(),
        failures: Vec::new(),
        deepest: Deepest {
            sample: 0,
            depth_mm: 0.0,
            displacements: vec![Vec3::zeros(); indentation.model.n_nodes()],
            level_forces: Vec::new(),
            von_mises: vec![0.0; indentation.mesh().body.n_prisms()],
            turned: None,
        },
    };
    let n_runs = indentation.speeds.len();
    let progress = context.progress(n_samples * n_runs, "pressing");
    'runs: for index in 0..n_runs {
        let mut run = indentation.start(index);
        let mut number = 0;
        while let Some(sample) = run.advance() {
            table.push(&sample)?;
            if run.failure.is_none() && index == 0 {
                if series.wants(number) {
                    series.push(out, sample.time_s, &grid(indentation, &lump_shares, &run))?;
                }
                if sample.depth_mm > recorded.deepest.depth_mm {
                    recorded.deepest = deepest(indentation, &run, number, sample.depth_mm);
                }
            }
            recorded.samples.push(sample);
            number += 1;
            progress.inc(1);
            if context.is_interrupted() {
                break 'runs;
            }
        }
        recorded.failures.extend(run.failure);
    }
    table.finish()?;
    series.finish(out, &indentation.prepared.grown.bones)?;
    Ok(recorded)
}

fn deepest(indentation: &Indentation, run: &Run<'_>, sample: usize, depth_mm: f64) -> Deepest {
    let (model, state, ws) = (&indentation.model, &run.state, &run.workspace);
    Deepest {
        sample,
        depth_mm,
        displacements: state.displacements.clone(),
        level_forces: level_forces(model, state, ws),
        von_mises: prism_fields(model, state, ws)
            .iter()
            .map(palpa_fem::PrismField::von_mises)
            .collect(),
        turned: turned(&indentation.mesh().body, &state.positions(model)),
    }
}

fn turned(body: &LayeredBody, positions: &[Vec3]) -> Option<Turned> {
    let shapes = prism_shapes(body, positions);
    let invalid = || shapes.iter().enumerate().filter(|(_, s)| !s.is_valid());
    let (p, _) = invalid().min_by(|a, b| a.1.scaled_jacobian.total_cmp(&b.1.scaled_jacobian))?;
    let n_intervals = body.n_levels - 1;
    let corners = body.prism(p / n_intervals, p % n_intervals);
    Some(Turned {
        n: invalid().count(),
        at: corners.iter().map(|&node| positions[node]).sum::<Vec3>() / 6.0,
    })
}

/// Opens the table: the fields of [`Sample`], then one column for the thickness of each layer.
fn table<'a>(
    out: &OutDir,
    layers: impl Iterator<Item = &'a str>,
) -> anyhow::Result<CsvTable<Sample>> {
    let column = |(i, layer): (usize, &str)| {
        let word = layer.replace(|c: char| !c.is_alphanumeric(), "_");
        // The index is needed because two layers may have the same tissue.
        format!("layer_{i}_{word}_mm")
    };
    out.table_with_list("press.csv", layers.enumerate().map(column).collect())
}
