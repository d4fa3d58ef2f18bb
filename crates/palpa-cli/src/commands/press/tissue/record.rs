//! Runs the script; writes every sample to the table and some of the bodies to the series for
//! ParaView. Error bars are computed beside the way back.

use indicatif::ProgressBar;
use palpa::accuracy::{Descent, ErrorBars, LumpChange, Stops, change_by_lumps};
use palpa::press::tissue::{Indentation, Record, Run, Sample};
use palpa_plot::output::{CsvTable, OutDir};

use super::super::Job;
use super::super::files::Series;
use super::fields::grid;
use crate::cli::Context;

/// What probes found.
pub(super) struct Bars {
    /// The error bars of the force.
    pub(super) bars: ErrorBars,
    /// The change by the lumps, if it was asked for and found.
    pub(super) lumps: Option<LumpChange>,
}

/// What is computed for the error bars beside the press.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Probing {
    Nothing,
    /// The contribution of the load steps only: the others are known.
    LoadSteps,
    Everything,
}

/// What was recorded.
pub(super) struct Recorded<'a> {
    pub(super) record: Record<'a>,
    /// `None` without [`Probing::Everything`], or if it was interrupted.
    pub(super) bars: Option<Bars>,
    /// The contribution of the load steps, as in [`ErrorBars::load_step`].
    pub(super) load_step: Option<f64>,
}

/// Runs the script at every speed. Every sample goes to the table at once, so that an interrupted
/// run leaves a valid table. The first press down is probed while its rest and the way back are
/// computed, without its lumps too if their change is asked for.
pub(super) fn record<'a>(
    job: &Job<'_>,
    indentation: &'a Indentation,
    probing: Probing,
) -> anyhow::Result<Recorded<'a>> {
    let with_bars = probing == Probing::Everything;
    let n_samples = indentation.n_samples() * indentation.speeds.len();
    let progress = job.context.progress(n_samples, "pressing");
    let mut recorder = Recorder::new(job, indentation, with_bars, &progress)?;
    let mut run = indentation.start(0);
    let n_down = indentation.deepest() + 1;
    recorder.follow(&mut run, n_down)?;
    let stops = with_bars.then(|| Stops::of(&recorder.record));
    let context = job.context;
    let is_deepest = recorder.record.samples.len() == n_down;
    let last = (recorder.record.samples.last()).filter(|s| is_deepest && s.outcome.is_converged());
    let at_deepest = last
        .filter(|_| probing != Probing::Nothing)
        .map(|s| s.force_n);
    let goes_on = || !context.is_interrupted();
    let probe = || {
        // Without its lumps, the body moves outside the part that is probed too.
        let settle = if job.args.lump_change || !indentation.has_history() {
            Descent::at
        } else {
            Descent::in_part
        };
        let Some(descent) = stops.and_then(|stops| settle(indentation, &stops)) else {
            return Ok(None);
        };
        let Some(bars) = descent.probe(indentation, |_, _| goes_on()) else {
            return Ok(None);
        };
        let lumps = if job.args.lump_change {
            change_by_lumps(indentation, &descent, &bars, goes_on)?
        } else {
            None
        };
        anyhow::Ok(Some(Bars { bars, lumps }))
    };
    let change_steps = || indentation.load_step_change(at_deepest?, goes_on);
    let (record, (bars, load_step)) = rayon::join(
        move || recorder.finish(run),
        || rayon::join(probe, change_steps),
    );
    drop(progress);
    Ok(Recorded {
        record: record?,
        bars: bars?,
        load_step,
    })
}

struct Recorder<'a, 'j> {
    context: &'j Context,
    out: &'j OutDir,
    indentation: &'a Indentation,
    lump_shares: Vec<f64>,
    table: CsvTable<Sample>,
    series: Series,
    record: Record<'a>,
    progress: &'j ProgressBar,
}

impl<'a, 'j> Recorder<'a, 'j> {
    fn new(
        job: &Job<'j>,
        indentation: &'a Indentation,
        with_bars: bool,
        progress: &'j ProgressBar,
    ) -> anyhow::Result<Self> {
        let n_samples = indentation.n_samples();
        Ok(Self {
            context: job.context,
            out: job.out,
            indentation,
            lump_shares: indentation.prepared.lump_shares(),
            table: table(job)?,
            series: Series::new(job.args.frames, n_samples, indentation.deepest()),
            record: if with_bars {
                Record::with_displacements(indentation)
            } else {
                Record::new(indentation)
            },
            progress,
        })
    }

    /// Records the samples of a run, at most `most`.
    fn follow(&mut self, run: &mut Run<'a>, most: usize) -> anyhow::Result<()> {
        for _ in 0..most {
            if self.context.is_interrupted() && !self.record.samples.is_empty() {
                break;
            }
            let Some(sample) = run.advance() else {
                break;
            };
            self.table.push(&sample)?;
            let n_before = self.record.samples.len();
            // The samples of the first run are the first of the record.
            if run.index == 0 && sample.outcome.is_converged() && self.series.wants(n_before) {
                let grid = grid(self.indentation, &self.lump_shares, run);
                self.series.push(self.out, sample.time_s, &grid)?;
            }
            self.record.push(run, sample);
            self.progress.inc(1);
        }
        Ok(())
    }

    /// Records the rest of the first run, and the other runs.
    fn finish(mut self, mut run: Run<'a>) -> anyhow::Result<Record<'a>> {
        self.follow(&mut run, usize::MAX)?;
        for index in 1..self.indentation.speeds.len() {
            if self.context.is_interrupted() {
                break;
            }
            self.follow(&mut self.indentation.start(index), usize::MAX)?;
        }
        self.table.finish()?;
        self.series
            .finish(self.out, &self.indentation.prepared.grown.bones)?;
        Ok(self.record)
    }
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
