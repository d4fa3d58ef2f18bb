//! Plot of the rates.

use super::row::{BenchReport, BenchRow, Mode};
use palpa_plot::{Axis, Chart, Guide, PALETTE, Picture, Series, panels};

/// Draws rates and errors against the size of the body.
pub fn draw(report: &BenchReport, of_growth: impl Fn(&BenchRow) -> bool) -> Picture {
    let rows: Vec<&BenchRow> = report.rows.iter().filter(|row| of_growth(row)).collect();
    let modes = [Mode::Full, Mode::Whole, Mode::Zone];
    let mut rates = Chart::new(Axis::log("nodes"), Axis::log("steps per second"))
        .title("Rate of the moving step")
        .subtitle("4 levels, one core, median of steps in contact; dashed: asked for")
        .guide(Guide::y(1000.0, "1 kHz"));
    for (mode, color) in modes.into_iter().zip(PALETTE) {
        let own: Vec<[f64; 2]> = (rows.iter().filter(|row| row.mode == mode))
            .map(|row| [row.nodes as f64, row.steps_per_s])
            .collect();
        let asked: Vec<[f64; 2]> = (rows.iter().filter(|row| row.mode == mode))
            .filter_map(|row| Some([row.nodes as f64, row.target_steps_per_s?]))
            .collect();
        if !own.is_empty() {
            let exponent = report.growth.iter().find(|growth| growth.mode == mode);
            let name = match exponent {
                Some(growth) => format!("{}, time ~ nodes^{:.2}", mode.name(), growth.exponent),
                None => mode.name().to_owned(),
            };
            rates = rates.series(Series::new(name, own).with_markers().with_color(color));
        }
        if !asked.is_empty() {
            let name = format!("{}, asked for", mode.name());
            let asked = Series::new(name, asked).dashed().with_markers();
            rates = rates.series(asked.with_color(color));
        }
    }
    let mut errors = Chart::new(
        Axis::log("nodes"),
        Axis::log("largest error of the force [%]"),
    )
    .title("What the rate is worth")
    .subtitle("past 2 mm; step: against the same mesh, converged");
    for (mode, color) in modes.into_iter().zip(PALETTE) {
        let own: Vec<[f64; 2]> = (rows.iter().filter(|row| row.mode == mode))
            .filter(|row| row.step_error > 0.0)
            .map(|row| [row.nodes as f64, row.step_error * 1e2])
            .collect();
        if !own.is_empty() {
            let name = format!("step, {}", mode.name());
            errors = errors.series(Series::new(name, own).with_markers().with_color(color));
        }
    }
    let mut mesh: Vec<[f64; 2]> = (rows.iter())
        .filter_map(|row| Some([row.nodes as f64, row.mesh_error.filter(|e| *e > 0.0)? * 1e2]))
        .collect();
    mesh.sort_by(|a, b| a[0].total_cmp(&b[0]));
    mesh.dedup_by_key(|p| p[0].to_bits());
    if !mesh.is_empty() {
        let series = Series::new("mesh", mesh).dashed().with_markers();
        errors = errors.series(series.with_color(PALETTE[6]));
    }
    panels("The moving step", &[rates, errors], 2)
}
