//! The shipped scenes.

use palpa_lab::bench::BenchReport;
use palpa_lab::bench::shipped::{MeasureParams, ShippedCase, ShippedRow, measure};

use crate::cli::Context;
use crate::table::Table;

/// Measures the cases, and keeps the report after each. Returns false if interrupted.
pub(super) fn measure_all(
    cases: &[ShippedCase],
    params: &MeasureParams,
    context: &Context,
    report: &mut BenchReport,
    keep: impl Fn(&BenchReport) -> anyhow::Result<()>,
) -> anyhow::Result<bool> {
    let progress = context.progress(cases.len(), "measuring");
    for case in cases {
        if context.is_interrupted() {
            break;
        }
        progress.set_message(case.name.clone());
        match measure(case, params, || !context.is_interrupted()) {
            // What an interrupted case measured until then is its row.
            Ok(found) => {
                report.shipped.push(found.row);
                report.poses.extend(found.poses);
                keep(report)?;
            }
            Err(_) if context.is_interrupted() => break,
            Err(error) => return Err(error.context(format!("case \"{}\"", case.name))),
        }
        progress.inc(1);
    }
    progress.finish_and_clear();
    if !report.shipped.is_empty() {
        context.say(table(&report.shipped))?;
        context.say(
            "Errors are 95th percentiles past 2 mm: in motion, against the same way with steps that take no time; the others \
             against static forces on finer meshes. Let go: share of the time in which the law gave less than the whole \
             force. bg CPU is the share of a core during the motion.",
        )?;
    }
    Ok(!context.is_interrupted())
}

fn table(rows: &[ShippedRow]) -> Table<18> {
    let mut table = Table::new([
        "shipped scene",
        "accuracy",
        "nodes",
        "steps/s",
        "p99 ms",
        "in motion",
        "let go",
        "error",
        "largest",
        "down",
        "across",
        "up",
        "of the mesh",
        "of the reference",
        "places",
        "behind",
        "bg CPU",
        "mm/s",
    ])
    .with_left_names();
    let percent =
        |x: Option<f64>| x.map_or_else(|| "–".to_owned(), |x| format!("{:.1} %", 1e2 * x));
    for row in rows {
        table.push([
            row.case.clone(),
            percent(Some(row.accuracy)),
            row.nodes.to_string(),
            format!("{:.0}", row.steps_per_s_mean),
            format!("{:.2}", row.step_ms_p99),
            percent(row.motion_error_p95),
            percent(Some(row.let_go_share)),
            percent(row.total_error_p95),
            percent(row.total_error_max),
            percent(row.total_error_p95_press),
            percent(row.total_error_p95_stroke),
            percent(row.total_error_p95_lift),
            percent(row.mesh_error_p95),
            percent(row.reference_change),
            row.n_places.to_string(),
            format!("{} of {}", row.n_behind, row.n_steps),
            format!("{:.2}", row.background_cpu_share),
            format!("{:.0}–{:.0}", row.hand_mm_per_s_min, row.hand_mm_per_s_max),
        ]);
    }
    table
}
