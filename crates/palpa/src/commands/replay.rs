//! `palpa replay`: a log run again.

use std::path::PathBuf;

use anyhow::Context as _;
use palpa_rt::{Log, ReplayParams, Table, Verdict, replay};
use palpa_tissue::Scene;
use serde::Serialize;

use super::Outcome;
use crate::cli::Context;
use crate::engine::{LiveScene, changed_files, scene_of};

/// Run a log again and compare, or export it as tables
///
/// Makes the body anew from the scene in the log, runs the tissue's steps and the 1 kHz law from what was logged, in one
/// thread, and compares all forces and patches: to the bit on the same kind of processor, within a tolerance on another.
/// Exits with 1 when they differ.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The log (MCAP), as `palpa loop-report` writes it
    log: PathBuf,
    /// Make the body from this scene instead of the one in the log
    #[arg(long)]
    scene: Option<PathBuf>,
    /// Write the log as tables into the output folder, and do not run it again
    #[arg(long, value_enum)]
    export: Option<Format>,
}

/// The kinds of tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// Text, comma-separated
    Csv,
    /// Apache Parquet
    Parquet,
}

/// What is printed with `--json`.
#[derive(Debug, Serialize)]
struct Found {
    verdict: &'static str,
    is_same_cpu: bool,
    ticks: u64,
    steps: u64,
    jobs: u64,
    patches_differing: u64,
    first_patch_differing: Option<u64>,
    first_tick_differing: Option<u64>,
    max_force_difference_n: f64,
    stopped: Option<String>,
    changed_files: Vec<String>,
}

/// Runs the command.
///
/// # Errors
/// When the log cannot be read, its scene not be built, or a table not be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Outcome> {
    if let Some(format) = args.export {
        return export(args, format, context);
    }
    let log = Log::open(&args.log)?;
    if !log.is_whole {
        context.note("the log ends early, as after a crash; what is there is run");
    }
    let scene = match &args.scene {
        Some(path) => Scene::load(path)?,
        None => scene_of(&log.header)?,
    };
    let changed = match args.scene {
        Some(_) => Vec::new(),
        None => changed_files(&log.header, &scene),
    };
    for file in &changed {
        context.note(format!("{}: {}", file.path.display(), file.problem));
    }
    let live = LiveScene::build(&scene).context("the body of the log")?;
    let report = replay(&log, live.tissue()?, &ReplayParams::default());
    let found = Found {
        verdict: match report.verdict {
            Verdict::Same => "same",
            Verdict::WithinTolerance => "within_tolerance",
            Verdict::Different => "different",
            Verdict::Incomplete => "incomplete",
        },
        is_same_cpu: report.is_same_cpu,
        ticks: report.ticks,
        steps: report.steps,
        jobs: report.jobs,
        patches_differing: report.patches_differing,
        first_patch_differing: report.first_patch,
        first_tick_differing: report.first_force.map(|f| f.tick),
        max_force_difference_n: report.max_force_difference,
        stopped: report.stopped.clone(),
        changed_files: changed
            .iter()
            .map(|f| f.path.display().to_string())
            .collect(),
    };
    context.say(format!(
        "{} ticks, {} steps of the tissue and {} background jobs run again",
        report.ticks, report.steps, report.jobs
    ))?;
    context.say(match report.verdict {
        Verdict::Same => "every force and every patch is the same to the bit".to_owned(),
        Verdict::WithinTolerance => format!(
            "made on another kind of processor; forces differ by {:.2e} N at most, which is within the tolerance",
            report.max_force_difference
        ),
        Verdict::Different => format!(
            "{} patches differ{}; forces differ by {:.2e} N at most{}",
            report.patches_differing,
            report.first_patch.map_or(String::new(), |s| format!(", first that of step {s}")),
            report.max_force_difference,
            report.first_force.map_or(String::new(), |f| format!(
                ", first at tick {}: {:?} N in the log, {:?} N now",
                f.tick, f.logged, f.replayed
            )),
        ),
        Verdict::Incomplete => "what could be run again is the same".to_owned(),
    })?;
    if let Some(why) = &report.stopped {
        context.say(format!("it had to stop early: {why}"))?;
    }
    context.json(&found)?;
    Ok(match report.verdict {
        Verdict::Same | Verdict::WithinTolerance => Outcome::Done,
        Verdict::Different | Verdict::Incomplete => Outcome::NotGood,
    })
}

fn export(args: &Args, format: Format, context: &Context) -> anyhow::Result<Outcome> {
    let table = match format {
        Format::Csv => Table::Csv,
        Format::Parquet => Table::Parquet,
    };
    let out = context.out_dir()?;
    let files = palpa_rt::export(&args.log, out.path(), table)?;
    for file in &files {
        context.say(file.display())?;
    }
    context.json(&files)?;
    Ok(Outcome::Done)
}
