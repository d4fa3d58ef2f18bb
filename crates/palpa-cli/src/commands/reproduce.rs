//! `palpa reproduce`: the evaluation of the thesis side by side with Palpa's results.

use std::time::Duration;

use serde::Serialize;

use super::Outcome;
use crate::cli::Context;
use crate::table::Table;
use palpa_lab::reproduce::Body;
use palpa_lab::reproduce::claims::{EULER_STEP_SIZES, combined_steps_to_cross, convergence, euler};
use palpa_lab::reproduce::continuum::{Continuum, Resolution, discs, n_steps};
use palpa_lab::reproduce::curves::{Curves, MAIN, Reading, SweepRow, readings};
use palpa_lab::reproduce::picture::draw;
use palpa_lab::reproduce::report::{Figures, Report};
use palpa_lab::reproduce::speed::{measure, shapes};
use palpa_plot::output::OutDir;

/// Depth ranges of the fits, in mm: the thesis does not say how deep its figures go.
const RANGES_MM: [usize; 3] = [60, 90, 120];

/// Smallest R² of a line through the uniform body's force down to 60 mm (figure 4.2); below it the
/// result is not good.
const LEAST_R2: f64 = 0.99;

/// Reproduce the evaluation of the reference method of 2009: table 4.2, figures 4.2 to 4.4
///
/// Measures steps per second against the dense inverse of 2009. Computes force against depth for a
/// uniform body and two layered ones, for every reading of what the text leaves open. Computes the
/// same bodies as a continuum, to show at which depth of press a hard layer is felt. Writes
/// reproduce.json, table.csv, sweep.csv, curves.csv, continuum.csv, reproduce.svg and
/// reproduce.png.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Largest number of nodes in the speed table
    #[arg(long, value_name = "N", default_value_t = 16_384)]
    max_nodes: usize,
    /// Time to measure each rate of the speed table, in seconds
    #[arg(long, value_name = "S", default_value_t = 0.5, value_parser = seconds)]
    seconds: f64,
}

fn seconds(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if (0.0..=600.0).contains(&value) {
        Ok(value)
    } else {
        Err("expected 0 to 600 seconds".to_owned())
    }
}

/// The results; after an interruption, those completed until then.
#[derive(Debug, Default)]
struct Done {
    report: Report,
    main: Option<Curves>,
    small: Option<Curves>,
}

/// Runs the evaluation.
///
/// # Errors
/// If a result cannot be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Outcome> {
    context.out_dir()?;
    context.begin_recording();
    let mut done = Done::default();
    let is_whole = figures(context, &mut done)?
        && claims(context, &mut done)?
        && continuum(context, &mut done)?
        && table(args, context, &mut done)?;
    done.report.is_complete = is_whole;
    write(context, &done)?;
    context.json(&done.report)?;
    if !is_whole {
        return Ok(Outcome::Interrupted);
    }
    let r2 = done.report.figures.as_ref().and_then(|f| f.uniform.r2_60);
    Ok(if r2.is_some_and(|r2| r2 >= LEAST_R2) {
        Outcome::Done
    } else {
        context.note(format_args!(
            "the uniform body's force should be proportional to the push: R² down to 60 mm is {r2:?}, less than {LEAST_R2}"
        ));
        Outcome::NotGood
    })
}

/// Computes figures and sweep. Returns whether they were finished.
fn figures(context: &Context, done: &mut Done) -> anyhow::Result<bool> {
    let main = Curves::compute(MAIN)?;
    let small = Curves::compute(Reading { n: 3, ..MAIN })?;
    let all = readings();
    let progress = context.progress(all.len(), "sweep");
    let mut sweep = Vec::new();
    for reading in &all {
        if context.is_interrupted() {
            break;
        }
        let curves = Curves::compute(*reading)?;
        sweep.extend(RANGES_MM.map(|range| curves.row(range)));
        progress.inc(1);
    }
    drop(progress);
    let figures = Figures::new(&main, sweep);
    say_figures(context, &figures)?;
    done.report.figures = Some(figures);
    done.main = Some(main);
    done.small = Some(small);
    Ok(!context.is_interrupted())
}

fn say_figures(context: &Context, figures: &Figures) -> anyhow::Result<()> {
    context
        .say("Figures 4.2 to 4.4: force against push, 4 × 4 columns 40 mm apart, 0 to 120 mm")?;
    let mut table = Table::new([
        "body",
        "R² 60 mm",
        "R² 120 mm",
        "knee mm",
        "in the thesis",
        "slope change",
    ]);
    let uniform = &figures.uniform;
    table.push([
        "uniform".into(),
        shown(uniform.r2_60, 4),
        shown(uniform.r2_120, 4),
        shown(uniform.knee_mm, 1),
        "none".into(),
        shown(uniform.slope_change, 2),
    ]);
    for (name, figure) in [
        ("hard middle", &figures.middle),
        ("hard bottom", &figures.bottom),
    ] {
        table.push([
            name.into(),
            String::new(),
            String::new(),
            shown(figure.knee_mm, 1),
            shown(figure.thesis_knee_mm, 0),
            shown(figure.slope_change, 2),
        ]);
    }
    context.say(&table)?;

    context.say(format_args!(
        "\nThe same over all {} readings of what the text leaves open, lowest to highest",
        figures.sweep.len() / RANGES_MM.len()
    ))?;
    let mut table = Table::new([
        "range mm",
        "uniform R²",
        "uniform knee",
        "middle knee",
        "bottom knee",
        "uniform change",
        "middle change",
        "bottom change",
    ]);
    for range in RANGES_MM {
        let rows: Vec<&SweepRow> = figures
            .sweep
            .iter()
            .filter(|r| r.depth_mm == range)
            .collect();
        let span = |value: &dyn Fn(&SweepRow) -> Option<f64>, digits: usize| {
            let values = || rows.iter().filter_map(|row| value(row));
            let low = values().fold(f64::INFINITY, f64::min);
            let high = values().fold(f64::NEG_INFINITY, f64::max);
            format!("{low:.digits$}–{high:.digits$}")
        };
        table.push([
            range.to_string(),
            span(&|r| r.uniform_r2, 3),
            span(&|r| r.uniform_knee_mm, 0),
            span(&|r| r.middle_knee_mm, 0),
            span(&|r| r.bottom_knee_mm, 0),
            span(&|r| r.uniform_slope_change, 2),
            span(&|r| r.middle_slope_change, 2),
            span(&|r| r.bottom_slope_change, 2),
        ]);
    }
    context.say(&table)
}

/// Computes convergence and explicit Euler. Returns whether they were finished.
fn claims(context: &Context, done: &mut Done) -> anyhow::Result<bool> {
    done.report.convergence = convergence()?;
    context.say("\nForce at 40 mm in 4 steps, each in n parts (uniform body)")?;
    let mut table = Table::new(["n", "force N", "error"]);
    for row in &done.report.convergence {
        let force = format!("{:.4e}", row.force);
        table.push([row.substeps.to_string(), force, percent(row.error)]);
    }
    context.say(&table)?;

    done.report.combined_steps_to_cross = Some(combined_steps_to_cross()?);
    let progress = context.progress(EULER_STEP_SIZES.len(), "explicit Euler");
    for step_size in EULER_STEP_SIZES {
        if context.is_interrupted() {
            return Ok(false);
        }
        done.report.euler.push(euler(step_size)?);
        progress.inc(1);
    }
    drop(progress);
    context.say("\nExplicit Euler alone: the pull at which it diverges, and steps until the base feels 90 % of a push (combined method: 1)")?;
    let mut table = Table::new([
        "step size",
        "diverges at mm",
        "combined bears it",
        "uniform",
        "hard middle",
        "hard bottom",
    ]);
    for row in &done.report.euler {
        let [uniform, middle, bottom] = row
            .steps_to_cross
            .map(|steps| steps.map_or_else(|| "> 20000".into(), |s| s.to_string()));
        table.push([
            row.step_size.to_string(),
            row.diverges_at_mm
                .map_or_else(|| "> 160".into(), |mm| mm.to_string()),
            match row.is_borne_by_combined {
                Some(true) => "yes".into(),
                Some(false) => "no".into(),
                None => String::new(),
            },
            uniform,
            middle,
            bottom,
        ]);
    }
    context.say(&table)?;
    Ok(!context.is_interrupted())
}

/// Computes the bodies as a continuum. Returns whether they were finished.
fn continuum(context: &Context, done: &mut Done) -> anyhow::Result<bool> {
    let discs = discs();
    let progress = context.progress(n_steps(&discs), "continuum");
    let continuum = Continuum::compute(&discs, Resolution::FULL, || {
        progress.inc(1);
        context.is_interrupted()
    })?;
    drop(progress);
    context.say(format_args!(
        "\nThe same bodies as a continuum, {:.0} and {:.0} kPa, Poisson's ratio {}: the push from which on a layer is felt",
        continuum.soft_young_pa / 1e3,
        continuum.hard_young_pa / 1e3,
        continuum.poisson,
    ))?;
    let [attentive, all] = continuum.felt_ratios.map(|r| format!("felt at {r} mm"));
    let mut table = Table::new([
        "disc mm",
        "body",
        "to mm",
        "force N",
        "times as stiff: first",
        "last",
        &attentive,
        &all,
        "upper layer left",
    ]);
    let felt = |at: Option<f64>| match at {
        None => "not".to_owned(),
        Some(0.0) => "at once".to_owned(),
        Some(at) => format!("{at:.0}"),
    };
    for disc in &continuum.discs {
        for pressed in &disc.bodies {
            let is_uniform = pressed.body == Body::Uniform;
            let [push, force] = pressed.curve.last().copied().unwrap_or_default();
            let of_layered = |text: String| if is_uniform { String::new() } else { text };
            let ratios = &pressed.stiffness_ratio;
            table.push([
                format!("{:.1}", disc.radius_mm),
                pressed.body.title().into(),
                format!("{push:.0}"),
                format!("{force:.3}"),
                of_layered(shown(ratios.first().map(|r| r[1]), 2)),
                of_layered(shown(ratios.last().map(|r| r[1]), 2)),
                of_layered(felt(pressed.felt_from_mm[0])),
                of_layered(felt(pressed.felt_from_mm[1])),
                format!("{:.0} %", pressed.upper_layer_left * 1e2),
            ]);
        }
    }
    context.say(&table)?;
    done.report.continuum = Some(continuum);
    Ok(!context.is_interrupted())
}

/// Measures the speed table. Returns whether it was finished.
fn table(args: &Args, context: &Context, done: &mut Done) -> anyhow::Result<bool> {
    let budget = Duration::from_secs_f64(args.seconds);
    let shapes = shapes(args.max_nodes);
    let progress = context.progress(shapes.len(), "speed");
    for (shape, thesis) in &shapes {
        if context.is_interrupted() {
            break;
        }
        done.report.table.push(measure(shape, *thesis, budget)?);
        progress.inc(1);
    }
    drop(progress);
    context.say("\nTable 4.2: steps per second")?;
    let mut table = Table::new([
        "nodes",
        "levels",
        "ours",
        "dense inverse",
        "ratio",
        "thesis 2009",
    ]);
    for row in &done.report.table {
        table.push([
            row.nodes.to_string(),
            row.levels.to_string(),
            rate(Some(row.steps_per_s)),
            rate(row.naive_steps_per_s),
            row.naive_steps_per_s.map_or_else(String::new, |naive| {
                format!("{:.0}", row.steps_per_s / naive)
            }),
            rate(row.thesis_steps_per_s),
        ]);
    }
    context.say(&table)?;
    Ok(!context.is_interrupted())
}

/// A point of the main curves.
#[derive(Debug, Serialize)]
struct CurveRow {
    columns: usize,
    push_mm: f64,
    uniform_n: Option<f64>,
    hard_middle_n: Option<f64>,
    hard_bottom_n: Option<f64>,
}

/// A point of the continuum's curves.
#[derive(Debug, Serialize)]
struct ContinuumRow {
    disc_radius_mm: f64,
    push_mm: f64,
    uniform_n: Option<f64>,
    hard_middle_n: Option<f64>,
    hard_bottom_n: Option<f64>,
}

fn write_continuum(dir: &OutDir, continuum: &Continuum) -> anyhow::Result<()> {
    let mut curves = dir.table("continuum.csv")?;
    for disc in &continuum.discs {
        let n_points = disc.bodies.iter().map(|b| b.curve.len()).max();
        for i in 0..n_points.unwrap_or(0) {
            let force = |body: usize| disc.bodies.get(body)?.curve.get(i).map(|p| p[1]);
            curves.push(&ContinuumRow {
                disc_radius_mm: disc.radius_mm,
                push_mm: i as f64,
                uniform_n: force(0),
                hard_middle_n: force(1),
                hard_bottom_n: force(2),
            })?;
        }
    }
    curves.finish()?;
    Ok(())
}

fn write(context: &Context, done: &Done) -> anyhow::Result<()> {
    let dir = context.out_dir()?;
    let mut curves = dir.table("curves.csv")?;
    for set in [&done.main, &done.small].into_iter().flatten() {
        let n_points = set.bodies.iter().map(Vec::len).max().unwrap_or(0);
        for i in 0..n_points {
            let force = |body: usize| set.bodies[body].get(i).map(|p| p[1]);
            curves.push(&CurveRow {
                columns: set.reading.n,
                push_mm: i as f64,
                uniform_n: force(0),
                hard_middle_n: force(1),
                hard_bottom_n: force(2),
            })?;
        }
    }
    curves.finish()?;
    let mut sweep = dir.table("sweep.csv")?;
    for row in done.report.figures.iter().flat_map(|f| &f.sweep) {
        sweep.push(row)?;
    }
    sweep.finish()?;
    let mut speed = dir.table("table.csv")?;
    for row in &done.report.table {
        speed.push(row)?;
    }
    speed.finish()?;
    if let Some(continuum) = &done.report.continuum {
        write_continuum(dir, continuum)?;
    }
    dir.write_json("reproduce.json", &done.report)?;
    let picture = draw(&done.report, done.main.as_ref(), done.small.as_ref());
    let [_, png] = picture.save(dir, "reproduce")?;
    context.say(format_args!("\nPicture: {}", png.display()))
}

fn shown(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "–".into(), |v| format!("{v:.digits$}"))
}

fn percent(value: f64) -> String {
    format!("{:.2} %", value * 100.0)
}

fn rate(value: Option<f64>) -> String {
    value.map_or_else(String::new, |v| {
        let digits = usize::from(v < 100.0);
        format!("{v:.digits$}")
    })
}
