//! `palpa replay`: runs a log again.

use std::path::PathBuf;

use anyhow::Context as _;
use palpa_rt::{
    Ending, Header, Log, ReplayParams, ReplayReport, Table, Tissue, Verdict, replay_watched,
};
use palpa_scene::{ModelKind, Scene};
use serde::Serialize;

use super::Outcome;
use crate::cli::Context;
use crate::named_scene;
use palpa::live::{FileState, LiveScene, Ruler, SpringScene, changed_files, machine, scene_of};
use palpa::one_paragraph;

/// Run a log again and compare the forces, or export it as tables
///
/// Builds the body from the scene in the log. Then runs the steps of the tissue and the 1 kHz law
/// again in one thread, from the logged inputs, and compares all forces and patches. They must be
/// equal bit for bit. Where the log was made on another kind of processor or by another version, a
/// note names each difference and what it can change, and forces must be equal within 0.0001 N.
/// Exit code 1 if they differ by more.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The log (MCAP), as `palpa loop-report` writes it
    log: PathBuf,
    /// Build the body from this scene instead of the one in the log: a file, or the name of a
    /// built-in scene
    #[arg(long)]
    scene: Option<PathBuf>,
    /// Write the log as tables to the output folder; do not run it again
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

/// Content of the `--json` output.
#[derive(Debug, Serialize)]
struct Found {
    verdict: &'static str,
    /// Differences between the machine and program of the log and these.
    differences: Vec<Differs>,
    ticks: u64,
    steps: u64,
    jobs: u64,
    patches_differing: u64,
    first_patch_differing: Option<u64>,
    first_tick_differing: Option<u64>,
    max_force_difference_n: f64,
    stopped: Option<String>,
    /// Whether the log was closed properly.
    is_whole: bool,
    /// The damage, if the log is damaged.
    damage: Option<String>,
    changed_files: Vec<String>,
}

/// A difference between the machine and program of the log and these.
#[derive(Debug, Serialize)]
struct Differs {
    what: String,
    /// `null` if the log does not say.
    logged: Option<String>,
    now: Option<String>,
    /// What it can change: `computation`, `last_bits` or `none`.
    effect: &'static str,
}

/// Content of the `--json` output with `--export`.
#[derive(Debug, Serialize)]
struct Tables {
    files: Vec<PathBuf>,
    is_whole: bool,
    damage: Option<String>,
}

/// Runs the log again on its tissue, until the end or Ctrl-C.
fn again(log: &Log, tissue: impl Tissue, context: &Context) -> ReplayReport {
    context.begin_recording();
    let bar = context.progress(log.ticks.len(), "ticks run again");
    let params = ReplayParams {
        machine: machine(),
        ..ReplayParams::default()
    };
    let report = replay_watched(log, tissue, &params, |tick| {
        if tick.is_multiple_of(100) {
            bar.set_position(tick as u64);
        }
        !context.is_interrupted()
    });
    bar.finish_and_clear();
    report
}

/// Runs the command.
///
/// # Errors
/// If the log cannot be read, its scene cannot be built, or a table cannot be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Outcome> {
    if let Some(format) = args.export {
        return export(args, format, context);
    }
    let log = Log::open(&args.log)?;
    note_ending(&log.ending, context);
    let scene = match &args.scene {
        Some(argument) => named_scene::load(argument)?.scene,
        None => scene_of(&log.header)?,
    };
    let changed = match args.scene {
        Some(_) => Vec::new(),
        None => changed_files(&log.header, &scene),
    };
    for file in &changed {
        context.note(format!("{}: {}", file.path.display(), file.problem));
    }
    for difference in log.header.machine.differences(&machine()) {
        context.note(&difference);
    }
    let of_log = || "the body of the log";
    let report = match scene.model.kind {
        ModelKind::Tissue => {
            let live = LiveScene::build(&scene).with_context(of_log)?;
            again(&log, live.tissue()?, context)
        }
        ModelKind::Reference => {
            let springs = SpringScene::build(&scene).with_context(of_log)?;
            again(&log, springs.tissue(springs.beginning(), None)?, context)
        }
    };
    say_report(&report, &log.ending, context)?;
    context.json(&found_of(&report, &log.ending, &changed))?;
    Ok(match report.verdict {
        _ if context.is_interrupted() => Outcome::Interrupted,
        _ if matches!(log.ending, Ending::Damaged(_)) => Outcome::NotGood,
        Verdict::Same | Verdict::WithinTolerance => Outcome::Done,
        Verdict::Different | Verdict::Incomplete => Outcome::NotGood,
    })
}

/// The result as JSON.
fn found_of(report: &ReplayReport, ending: &Ending, changed: &[FileState]) -> Found {
    Found {
        verdict: match report.verdict {
            Verdict::Same if *ending != Ending::Whole => "same_as_far_as_read",
            Verdict::Same => "same",
            Verdict::WithinTolerance => "within_tolerance",
            Verdict::Different => "different",
            Verdict::Incomplete => "incomplete",
        },
        differences: (report.differences.iter())
            .map(|d| Differs {
                what: d.what.clone(),
                logged: known(&d.logged),
                now: known(&d.now),
                effect: d.effect.word(),
            })
            .collect(),
        ticks: report.ticks,
        steps: report.steps,
        jobs: report.jobs,
        patches_differing: report.patches_differing,
        first_patch_differing: report.first_patch,
        first_tick_differing: report.first_force.map(|f| f.tick),
        max_force_difference_n: report.max_force_difference,
        stopped: report.stopped.clone(),
        is_whole: *ending == Ending::Whole,
        damage: damage(ending),
        changed_files: changed
            .iter()
            .map(|f| f.path.display().to_string())
            .collect(),
    }
}

fn known(text: &str) -> Option<String> {
    (!text.is_empty()).then(|| text.to_owned())
}

/// Prints what was run again, and whether it was the same.
fn say_report(report: &ReplayReport, ending: &Ending, context: &Context) -> anyhow::Result<()> {
    context.say(format!(
        "{} ticks, {} steps of the tissue and {} background jobs run again",
        report.ticks, report.steps, report.jobs
    ))?;
    context.say(match report.verdict {
        Verdict::Same if *ending == Ending::Whole => {
            "every force and every patch is the same bit for bit".to_owned()
        }
        Verdict::Same => {
            "every force and every patch that could be read is the same bit for bit".to_owned()
        }
        Verdict::WithinTolerance => format!(
            "made on another machine or by another program, see the notes above; forces differ by {:.2e} N at most, which is within the tolerance",
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
    Ok(())
}

/// Prints a note if a log is not complete.
fn note_ending(ending: &Ending, context: &Context) {
    match ending {
        Ending::Whole => {}
        Ending::CutOff => context.note("the log ends early, as after a crash; the replay uses the part that is there"),
        Ending::Damaged(why) => context.note(format!(
            "the log is damaged, or was still being written when it was copied ({why}); what comes before that is used"
        )),
    }
}

fn damage(ending: &Ending) -> Option<String> {
    match ending {
        Ending::Damaged(why) => Some(why.clone()),
        Ending::Whole | Ending::CutOff => None,
    }
}

/// The skin at rest by which depths and places are measured. Without a scene that can be built, the
/// rest of the log is exported all the same.
fn ruler(args: &Args, context: &Context) -> anyhow::Result<Option<Ruler>> {
    let header = Header::read(&args.log)?;
    let scene = match &args.scene {
        Some(path) => Ok(Scene::load(path)?),
        None => scene_of(&header),
    };
    if let (Ok(scene), None) = (&scene, &args.scene) {
        for file in changed_files(&header, scene) {
            context.note(format!("{}: {}", file.path.display(), file.problem));
        }
    }
    Ok(match scene.and_then(|scene| Ruler::of_scene(&scene)) {
        Ok(ruler) => Some(ruler),
        Err(error) => {
            context.note(format!(
                "depth and place stay empty, because the body of the log cannot be built: {}",
                one_paragraph(&error)
            ));
            None
        }
    })
}

fn export(args: &Args, format: Format, context: &Context) -> anyhow::Result<Outcome> {
    let table = match format {
        Format::Csv => Table::Csv,
        Format::Parquet => Table::Parquet,
    };
    let out = context.out_dir()?;
    let spinner = context.progress(0, "building the body of the log");
    let ruler = ruler(args, context)?;
    drop(spinner);
    let tables = palpa_rt::export(&args.log, out.path(), table, |device| {
        ruler.as_ref()?.measure(device)
    })?;
    note_ending(&tables.ending, context);
    for file in &tables.files {
        context.say(file.display())?;
    }
    let damage = damage(&tables.ending);
    let is_damaged = damage.is_some();
    context.json(&Tables {
        files: tables.files,
        is_whole: tables.ending == Ending::Whole,
        damage,
    })?;
    Ok(if is_damaged {
        Outcome::NotGood
    } else {
        Outcome::Done
    })
}
