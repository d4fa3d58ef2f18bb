//! Runs the script; writes every sample to the table and some of the bodies to the series for
//! ParaView.

use super::super::Job;
use super::super::files::Series;
use super::fields::grid;
use palpa::press::tissue::{Indentation, Record, Sample};
use palpa_plot::output::CsvTable;

/// Runs the script at every speed. Every sample goes to the table at once, so that an interrupted
/// run leaves a valid table. `with_bars` says whether error bars are wanted later.
pub(super) fn record<'a>(
    job: &Job<'_>,
    indentation: &'a Indentation,
    with_bars: bool,
) -> anyhow::Result<Record<'a>> {
    let Job {
        args, context, out, ..
    } = *job;
    let mut table = table(job)?;
    let n_samples = indentation.n_samples();
    let lump_shares = indentation.prepared.lump_shares();
    let mut series = Series::new(args.frames, n_samples, indentation.deepest());
    let mut record = if with_bars {
        Record::with_displacements(indentation)
    } else {
        Record::new(indentation)
    };
    let n_runs = indentation.speeds.len();
    let progress = context.progress(n_samples * n_runs, "pressing");
    'runs: for index in 0..n_runs {
        let mut run = indentation.start(index);
        while let Some(sample) = run.advance() {
            table.push(&sample)?;
            // The samples of the first run are the first of the record.
            if index == 0 && sample.outcome.is_converged() && series.wants(record.samples.len()) {
                series.push(out, sample.time_s, &grid(indentation, &lump_shares, &run))?;
            }
            record.push(&run, sample);
            progress.inc(1);
            if context.is_interrupted() {
                break 'runs;
            }
        }
    }
    table.finish()?;
    series.finish(out, &indentation.prepared.grown.bones)?;
    Ok(record)
}

/// Opens the table: the fields of [`Sample`], then one column for the thickness of each layer.
pub(super) fn table(job: &Job<'_>) -> anyhow::Result<CsvTable<Sample>> {
    let names = (job.scene.layers.iter()).map(|layer| layer.tissue.name.as_str());
    let column = |(i, layer): (usize, &str)| {
        let word = layer.replace(|c: char| !c.is_alphanumeric(), "_");
        // The index is needed because two layers may have the same tissue.
        format!("layer_{i}_{word}_mm")
    };
    let columns = names.enumerate().map(column).collect();
    job.out.table_with_list("press.csv", columns)
}
