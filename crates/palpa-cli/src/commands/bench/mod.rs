//! `palpa bench`: rates of the moving step, and its errors at these rates.

mod shipped;
mod uniform;

use std::path::PathBuf;

use anyhow::bail;
use palpa_plot::output::OutDir;
use palpa_scene::built_in::LOOPED;
use palpa_scene::units::Share;
use serde::Serialize;

use super::Outcome;
use crate::cli::Context;
use crate::named_scene;
use palpa_lab::bench::cases::{BenchCase, BenchShape, Tissue, cases};
use palpa_lab::bench::shipped::{MeasureParams, ShippedCase, shipped_cases};
use palpa_lab::bench::{BenchReport, BenchRow, growth, picture};

/// Description for the report of how the tables are measured.
const METHOD: &str = "shipped scenes: the scene with its default mesh, as the loop and the viewer set it up, pressed, stroked and \
    lifted at random places, in random directions and at speeds of the hand from 5 to 50 mm/s, with an ideal hand at 1 kHz in \
    virtual time, in which each step of the tissue and each job of the background takes its own thread-CPU time; rate: steps with \
    contact per second of their CPU time, patch and installed results included; total error: force at 1 kHz against static \
    forces on finer meshes at the same pose, past 2 mm. uniform blocks and graded bodies: thread-CPU time of a step with its patch \
    and of installing results of the background, one core; a frictionless sphere comes down at up to 50 mm/s and no more \
    than 0.25 mm a step, presses 5 mm deep, strokes 20 mm sideways and lifts (the graded bodies: presses and lifts); rate: steps in \
    contact per second of their whole time; 99th percentile over these steps; background work runs apart, is taken over as many \
    steps later as its CPU time is long, and is counted as a share of the steps' CPU time; step error: largest error of the \
    force past 2 mm against the converged quasi-static force at the same place on the same mesh; mesh error: converged forces \
    against those on a refined mesh, while pressing; total error: forces of the moving step against those on the refined mesh, \
    down, across and up; worst of four places: the largest total error with the sphere on a vertex, on the middle of an edge, near \
    the middle of a triangle and half-way there";

/// Measure the speed and the error of the moving step
///
/// Shipped scenes: an ideal hand presses, strokes and lifts at random places of the scenes that users
/// run, on the mesh that they get; forces are compared with static forces on finer meshes. Uniform
/// blocks: bodies of 1,000 to 64,000 nodes, and meshes graded toward the tool. Rates are those of
/// thread-CPU time on one core. Writes `bench.json`, `bench_shipped.csv`, `bench_poses.csv`, `bench.csv`,
/// `bench.svg` and `bench.png`.
#[derive(Debug, clap::Args)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is an option of the command line"
)]
pub struct Args {
    /// Run only this case; may be repeated [default: all but the variants of the shipped forearm, lump
    /// and calf]
    #[arg(long = "case", value_name = "NAME")]
    cases: Vec<String>,
    /// Use small uniform bodies only; takes seconds
    #[arg(long, conflicts_with = "cases")]
    quick: bool,
    /// Run all variants of the shipped scenes too: with friction, nearly incompressible, relaxing
    #[arg(long, conflicts_with_all = ["cases", "quick"])]
    all: bool,
    /// Places drawn on each shipped scene, 1 to 1000
    #[arg(long, default_value_t = 6, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1000))]
    places: u16,
    /// Poses that are solved again on the way down, on the way across, and on the way up at each
    /// place, 0 to 100; with 0, only the error that the speed of the steps costs is measured
    #[arg(long, default_value_t = 2, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=100))]
    poses: u16,
    /// Accuracy that the shipped scenes ask of their meshes [default: 3 %]
    #[arg(long, value_name = "SHARE")]
    accuracy: Option<Share>,
    /// Folder with surfaces from scans, for the cases shipped-calf…
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// List the cases and run none
    #[arg(long)]
    list: bool,
    /// Compute the forces on refined meshes, the reference for mesh errors of the uniform blocks, and
    /// run no case
    #[arg(long)]
    refined: bool,
}

/// The cases to run.
struct Chosen {
    shipped: Vec<ShippedCase>,
    uniform: Vec<&'static BenchCase>,
}

/// Runs the command.
///
/// # Errors
/// If a case does not exist, a body cannot be computed with, or a result cannot be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Outcome> {
    let chosen = chosen(args)?;
    if args.list {
        let shipped = chosen.shipped.iter().map(|case| case.name.as_str());
        let names: Vec<&str> = shipped
            .chain(chosen.uniform.iter().map(|case| case.name))
            .collect();
        for name in &names {
            context.say(name)?;
        }
        context.json(&names)?;
        return Ok(Outcome::Done);
    }
    if args.refined {
        return uniform::refined(&chosen.uniform, context);
    }
    context.out_dir()?;
    context.begin_recording();
    let mut report = BenchReport {
        method: METHOD,
        ..BenchReport::default()
    };
    let params = MeasureParams {
        n_places: args.places.into(),
        n_poses: args.poses.into(),
    };
    report.is_complete =
        shipped::measure_all(&chosen.shipped, &params, context, &mut report, |report| {
            keep(report, context.out_dir()?)
        })? && uniform::measure(&chosen.uniform, context, &mut report)?;
    finish(&mut report, context)?;
    Ok(if report.is_complete {
        Outcome::Done
    } else {
        Outcome::Interrupted
    })
}

fn finish(report: &mut BenchReport, context: &Context) -> anyhow::Result<()> {
    let is_of_growth = |row: &BenchRow| {
        cases().iter().any(|case| {
            case.name == row.case
                && case.tissue == Tissue::Elastic
                && matches!(case.shape, BenchShape::Block { .. })
        })
    };
    report.growth = growth::growth(&report.rows.iter().filter(|row| is_of_growth(row)));
    if !report.rows.is_empty() {
        uniform::say(context, report)?;
    }
    let out = context.out_dir()?;
    keep(report, out)?;
    if !report.rows.is_empty() {
        picture::draw(report, is_of_growth).save(out, "bench")?;
    }
    context.json(&report)
}

/// Writes what was measured.
fn keep(report: &BenchReport, out: &OutDir) -> anyhow::Result<()> {
    out.write_json("bench.json", report)?;
    write_rows(&report.shipped, "bench_shipped.csv", out)?;
    write_rows(&report.poses, "bench_poses.csv", out)?;
    write_rows(&report.rows, "bench.csv", out)
}

/// Writes rows as a table, if there are any.
fn write_rows(rows: &[impl Serialize], name: &str, out: &OutDir) -> anyhow::Result<()> {
    if rows.is_empty() {
        return Ok(());
    }
    let mut table = out.table(name)?;
    for row in rows {
        table.push(row)?;
    }
    table.finish()?;
    Ok(())
}

fn chosen(args: &Args) -> anyhow::Result<Chosen> {
    let lump_forearm = named_scene::load_or(None, LOOPED)?.scene;
    let mut shipped = shipped_cases(&lump_forearm, args.data.as_deref())?;
    if let Some(accuracy) = args.accuracy {
        for case in &mut shipped {
            case.scene.mesh.accuracy = Some(accuracy.si());
            let mesh = &case.scene.mesh;
            mesh.check(&case.scene.tool).map_err(anyhow::Error::msg)?;
        }
    }
    let names = || {
        let shipped = shipped.iter().map(|case| case.name.as_str());
        shipped.chain(cases().iter().map(|case| case.name))
    };
    let unknown = (args.cases.iter()).find(|name| names().all(|known| known != name.as_str()));
    if let Some(unknown) = unknown {
        let scans = if args.data.is_none() && unknown.starts_with("shipped-calf") {
            "; shipped-calf needs --data"
        } else {
            ""
        };
        let known: Vec<&str> = names().collect();
        bail!(
            "there is no case \"{unknown}\"{scans}; the cases are {}",
            known.join(", ")
        );
    }
    let is_named = |known: &str| args.cases.iter().any(|name| name == known);
    let by_name = !args.cases.is_empty();
    let uniform = (cases().iter())
        .filter(|case| is_named(case.name) || !by_name && (!args.quick || case.is_quick))
        .collect();
    let shipped = (shipped.iter())
        .filter(|case| {
            let is_usual = args.all || args.list || case.is_usual;
            is_named(&case.name) || !by_name && !args.quick && is_usual
        })
        .cloned()
        .collect();
    Ok(Chosen { shipped, uniform })
}
