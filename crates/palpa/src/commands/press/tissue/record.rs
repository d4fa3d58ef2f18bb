//! The runs themselves: every sample to the table, some of the bodies to the series for ParaView.

use palpa_fem::{level_forces, prism_fields};
use palpa_mesh::Vec3;

use super::super::Job;
use super::super::files::Series;
use super::fields::grid;
use crate::build::BuiltBody;
use crate::output::{CsvTable, OutDir};
use crate::press::tissue::{Failure, Indentation, Run, Sample};

/// What came out of the runs.
pub(super) struct Recorded {
    pub(super) samples: Vec<Sample>,
    pub(super) failures: Vec<Failure>,
    /// At the deepest sample of the first run.
    pub(super) deepest: Deepest,
}

/// The body where it is pressed deepest.
pub(super) struct Deepest {
    /// Its number among the samples.
    pub(super) sample: usize,
    pub(super) depth_mm: f64,
    pub(super) displacements: Vec<Vec3>,
    /// For each level the force on it of the tissue below. N `[n_levels]`
    pub(super) level_forces: Vec<Vec3>,
    /// Von Mises stress of every prism. Pa `[n_prisms]`
    pub(super) von_mises: Vec<f64>,
}

/// Runs the script at every speed; each sample goes to the table at once, so that an interrupted run leaves a valid one.
pub(super) fn record(
    job: &Job<'_>,
    built: &BuiltBody,
    indentation: &Indentation,
) -> anyhow::Result<Recorded> {
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
    let mut series = Series::new(args.frames, n_samples, indentation.deepest());
    let mut recorded = Recorded {
        samples: Vec::new(),
        failures: Vec::new(),
        deepest: Deepest {
            sample: 0,
            depth_mm: 0.0,
            displacements: vec![Vec3::zeros(); indentation.model.n_nodes()],
            level_forces: Vec::new(),
            von_mises: vec![0.0; indentation.mesh.body.n_prisms()],
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
                    series.push(out, sample.time_s, &grid(indentation, &run))?;
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
    series.finish(out, &built.bones)?;
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
    }
}

/// The table: the fields of [`Sample`], and at the end a column for the thickness of each layer.
fn table<'a>(
    out: &OutDir,
    layers: impl Iterator<Item = &'a str>,
) -> anyhow::Result<CsvTable<Sample>> {
    let mut header = Sample::COLUMNS.map(str::to_owned).to_vec();
    for (i, layer) in layers.enumerate() {
        // Two layers may be of one tissue.
        let word: String = layer
            .chars()
            .map(|c| if c.is_alphanumeric() { c } else { '_' })
            .collect();
        header.push(format!("layer_{i}_{word}_mm"));
    }
    out.table_under("press.csv", &header)
}
