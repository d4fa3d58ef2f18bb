//! Uniform blocks and bodies that are graded toward the tool.

use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context as _, anyhow};
use palpa_fem::Model;
use palpa_fem::realtime::LiveParams;

use super::super::Outcome;
use crate::cli::Context;
use crate::table::Table;
use palpa_lab::bench::cases::{BenchCase, BenchShape, Run, Tissue};
use palpa_lab::bench::ratios::{Ratio, dense_inverse, full_factor};
use palpa_lab::bench::refined::Problem;
use palpa_lab::bench::ride::{JUDGED_FROM, Known, Ridden, converged, params as mode_params, ride};
use palpa_lab::bench::{BenchReport, BenchRow, Mode};

/// Computes the forces on refined meshes that the source code records.
pub(super) fn refined(chosen: &[&BenchCase], context: &Context) -> anyhow::Result<Outcome> {
    let mut found = Vec::new();
    for problem in Problem::ALL {
        if !chosen.iter().any(|case| case.problem == problem) {
            continue;
        }
        let (forces, nodes) = problem.compute(f64::INFINITY)?;
        context.say(format_args!(
            "{problem:?}, {nodes} nodes: depth mm, force N, recorded N"
        ))?;
        for known in forces {
            let recorded = problem.force_at(known.depth);
            let shown = recorded.map_or_else(String::new, |force| format!("{force:.5}"));
            context.say(format_args!(
                "{:.1}  {:.5}  {shown}",
                known.depth * 1e3,
                known.force.z
            ))?;
            found.push((problem, nodes, known.depth, known.force.z, recorded));
        }
    }
    context.json(&found)?;
    Ok(Outcome::Done)
}

/// Measures all lines. Returns false if interrupted.
pub(super) fn measure(
    chosen: &[&BenchCase],
    context: &Context,
    report: &mut BenchReport,
) -> anyhow::Result<bool> {
    let n_runs = chosen.iter().map(|case| case.runs.len() + 1).sum();
    let progress = context.progress(n_runs, "measuring");
    for case in chosen {
        progress.set_message(case.name);
        let model = case
            .model()
            .with_context(|| format!("case \"{}\"", case.name))?;
        let mut known: Option<Vec<Known>> = None;
        for run in &case.runs {
            if context.is_interrupted() {
                return Ok(false);
            }
            let mut params = mode_params(run.mode, run.zone_radius);
            if let Some(stale) = run.stale {
                params.stale = stale;
            }
            let ridden = ride(&model, &case.ride(), params)
                .with_context(|| format!("case \"{}\", {}", case.name, run.mode.name()))?;
            progress.inc(1);
            if context.is_interrupted() {
                return Ok(false);
            }
            let known = match &mut known {
                Some(known) => known,
                None => known.insert(truth(case, &model, ridden.travel / ridden.dt)?),
            };
            let mut row = row(case, run, &model, &ridden, known)?;
            if run.mode == Mode::Zone {
                row.worst_of_four_places = worst_of_four_places(case, &model, params)?;
            }
            report.rows.push(row);
        }
        ratios(case, &model, report)?;
        let own: Vec<&BenchRow> = report
            .rows
            .iter()
            .filter(|row| row.case == case.name)
            .collect();
        progress.suspend(|| say_rows(context, &own))?;
        progress.inc(1);
    }
    Ok(true)
}

/// Largest total error with the sphere at four places of a graded mesh; `None` on other meshes.
fn worst_of_four_places(
    case: &BenchCase,
    model: &Arc<Model>,
    params: LiveParams,
) -> anyhow::Result<Option<f64>> {
    let mut worst: Option<f64> = None;
    for at in case.rides_at_four_places() {
        let ridden = ride(model, &at, params)?;
        let error = ridden.error_by_depth(&at, |depth| case.problem.force_at(depth));
        worst = worst.into_iter().chain(error).reduce(f64::max);
    }
    Ok(worst)
}

/// Forces of the converged body.
fn truth(case: &BenchCase, model: &Model, speed: f64) -> anyhow::Result<Vec<Known>> {
    converged(model, &case.ride(), speed, case.every).map_err(|(at, outcome)| {
        anyhow!(
            "case \"{}\": {:.1} mm along the way the body did not converge: {outcome:?}",
            case.name,
            at * 1e3
        )
    })
}

fn row(
    case: &BenchCase,
    run: &Run,
    model: &Model,
    ridden: &Ridden,
    known: &[Known],
) -> anyhow::Result<BenchRow> {
    let levels = model.body().n_levels;
    let refined = case.problem.recorded();
    let is_full = run.mode == Mode::Full;
    // Under a sudden press, relaxing tissue is as stiff as the elastic one, so its mesh error is
    // measured there.
    let sudden = match case.tissue {
        Tissue::Relaxing if !refined.is_empty() => Some(truth(case, model, f64::INFINITY)?),
        _ => None,
    };
    let on_mesh = sudden.as_deref().unwrap_or(known);
    let force_at = |depth: f64| case.problem.force_at(depth);
    let pressed = on_mesh.iter().filter(|known| known.is_press);
    let mesh_errors =
        pressed.filter_map(|known| Some((known.force.z / force_at(known.depth)? - 1.0).abs()));
    let is_elastic = sudden.is_none();
    let total_error = ridden.error_by_depth(&case.ride(), force_at);
    Ok(BenchRow {
        case: case.name.to_owned(),
        nodes: model.n_nodes(),
        zone_nodes: ridden.zone_columns * levels,
        levels,
        mode: run.mode,
        zone_radius_mm: (!is_full).then_some(run.zone_radius * 1e3),
        h_contact_mm: case.shape.h_contact() * 1e3,
        tool_radius_mm: case.radius * 1e3,
        steps_per_s: 1.0 / ridden.mean(),
        target_steps_per_s: run.target,
        step_ms_mean: ridden.mean() * 1e3,
        step_ms_median: ridden.median() * 1e3,
        step_ms_p99: ridden.quantile(0.99) * 1e3,
        background_cpu_share: ridden.cpu[0] / ridden.cpu[1],
        step_error: ridden.error(known),
        mesh_error: mesh_errors.reduce(f64::max),
        total_error: total_error.filter(|_| is_elastic),
        worst_of_four_places: None,
        tool_mm_per_s: ridden.travel / ridden.dt * 1e3,
        travel_mm: ridden.travel * 1e3,
        n_steps: ridden.times.len(),
        n_zone_switches: ridden.n_zone_switches,
        n_factors: ridden.n_factors,
        n_active_changes: ridden.n_active_changes,
        most_active: ridden.most[0],
        most_candidates: ridden.most[1],
        iterations: ridden.n_iterations as f64 / ridden.n_steps as f64,
        n_backed_off: ridden.n_bad[0],
        n_failed: ridden.n_bad[1],
    })
}

/// Compares a case's zone and whole steps with a full factorization, and the smallest body with the
/// dense inverse.
fn ratios(case: &BenchCase, model: &Arc<Model>, report: &mut BenchReport) -> anyhow::Result<()> {
    const DENSE: [(&str, usize); 1] = [("324", 9)];
    const BUDGET: Duration = Duration::from_millis(500);
    const N_FACTORS: usize = 5;
    if !matches!(case.shape, BenchShape::Block { .. }) || case.tissue != Tissue::Elastic {
        return Ok(());
    }
    let own: Vec<BenchRow> = report
        .rows
        .iter()
        .filter(|row| row.case == case.name)
        .cloned()
        .collect();
    let mut add = |against: &'static str, seconds: f64, nodes: usize| {
        for row in &own {
            report.ratios.push(Ratio {
                against,
                row: format!("{} {}", row.case, row.mode.name()),
                nodes: [row.nodes, nodes],
                ratio: seconds * 1e3 / row.step_ms_median,
                other_ms: seconds * 1e3,
            });
        }
    };
    for (_, n) in DENSE.iter().filter(|dense| dense.0 == case.name) {
        let (seconds, nodes) = dense_inverse(*n, BUDGET)?;
        add("dense inverse of the reference method", seconds, nodes);
    }
    let n_times = if model.n_nodes() > 20_000 {
        1
    } else {
        N_FACTORS
    };
    add(
        "full factor by faer",
        full_factor(model, n_times)?,
        model.n_nodes(),
    );
    Ok(())
}

fn say_rows(context: &Context, rows: &[&BenchRow]) -> anyhow::Result<()> {
    let mut table = Table::new([
        "uniform block",
        "nodes",
        "mode",
        "r mm",
        "h mm",
        "steps/s",
        "asked",
        "median ms",
        "p99 ms",
        "bg CPU",
        "step err",
        "mesh err",
        "total err",
        "4 places",
        "mm/s",
        "switches",
        "bad",
    ])
    .with_left_names();
    let percent = |x: f64| format!("{:.1} %", x * 1e2);
    let maybe = |x: Option<f64>| x.map_or_else(|| "–".to_owned(), percent);
    for row in rows {
        table.push([
            row.case.clone(),
            row.nodes.to_string(),
            row.mode.name().to_owned(),
            row.zone_radius_mm
                .map_or_else(|| "all".to_owned(), |r| format!("{r:.0}")),
            format!("{:.2}", row.h_contact_mm),
            format!("{:.0}", row.steps_per_s),
            row.target_steps_per_s
                .map_or_else(String::new, |t| format!("{t:.0}")),
            format!("{:.2}", row.step_ms_median),
            format!("{:.2}", row.step_ms_p99),
            format!("{:.2}", row.background_cpu_share),
            percent(row.step_error),
            maybe(row.mesh_error),
            maybe(row.total_error),
            maybe(row.worst_of_four_places),
            format!("{:.0}", row.tool_mm_per_s),
            row.n_zone_switches.to_string(),
            (row.n_backed_off + row.n_failed).to_string(),
        ]);
    }
    context.say(&table)
}

pub(super) fn say(context: &Context, report: &BenchReport) -> anyhow::Result<()> {
    context.say(format_args!(
        "Errors are the largest past {:.0} mm; bg CPU is the background's over the steps'.",
        JUDGED_FROM * 1e3
    ))?;
    for growth in &report.growth {
        context.say(format_args!(
            "{}: time grows as nodes^{:.2}, {} to {}",
            growth.mode.name(),
            growth.exponent,
            growth.nodes[0],
            growth.nodes[1]
        ))?;
    }
    for ratio in &report.ratios {
        context.say(format_args!(
            "{}: {:.1} × as fast as the {} ({:.2} ms)",
            ratio.row, ratio.ratio, ratio.against, ratio.other_ms
        ))?;
    }
    Ok(())
}
