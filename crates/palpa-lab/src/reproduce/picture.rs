//! Plot of the evaluation.

use super::continuum::{Continuum, PressedDisc};
use super::curves::Curves;
use super::report::{Figures, Report};
use super::{Body, LEVEL_SPACING, Shape};
use palpa_plot::{Axis, Band, Chart, Guide, PALETTE, Picture, Series, panels};

/// Palette indices of the three bodies, in all charts.
const COLORS: [usize; 3] = [0, 1, 2];

/// Draws the report; `small` are the curves of the 3 × 3 patch.
pub fn draw(report: &Report, main: Option<&Curves>, small: Option<&Curves>) -> Picture {
    let mut charts = Vec::new();
    charts.extend(main.map(force_chart));
    charts.extend(small.map(force_chart));
    if let Some(figures) = &report.figures {
        charts.push(slope_chart(figures));
        charts.push(sweep_chart(figures));
    }
    if !report.euler.is_empty() {
        charts.push(crossing_chart(report));
    }
    if !report.table.is_empty() {
        charts.push(speed_chart(report));
    }
    if let Some(continuum) = &report.continuum {
        for disc in &continuum.discs {
            charts.push(continuum_force_chart(continuum, disc));
            charts.push(continuum_ratio_chart(continuum, disc));
        }
    }
    panels("The evaluation of 2009, run again", &charts, 2)
}

fn force_chart(curves: &Curves) -> Chart {
    let n = curves.reading.n;
    let nodes = Shape::thesis(n).n_nodes();
    let mut chart = Chart::new(
        Axis::linear("push [mm]").with_zero(),
        Axis::linear("force on the tool [N]").with_zero(),
    )
    .title(format!(
        "Force against push, {n} × {n} columns, {nodes} nodes"
    ))
    .subtitle("sum along the path; dotted: where the thesis sees the slope change");
    for (i, body) in Body::ALL.into_iter().enumerate() {
        let series = Series::new(body.title(), curves.bodies[i].clone());
        chart = chart.series(series.with_color(PALETTE[COLORS[i]]));
        if let Some(at) = body.thesis_knee_mm() {
            chart = chart.guide(Guide::x(at, body.title()));
        }
    }
    chart
}

fn slope_chart(figures: &Figures) -> Chart {
    let mm = LEVEL_SPACING * 1e3;
    let points = |i: usize| -> Vec<[f64; 2]> {
        let figure = [&figures.middle, &figures.bottom][i];
        let depths = figure.slope_ratio_depth_mm.iter();
        depths
            .zip(&figure.slope_ratio)
            .map(|(d, r)| [*d, *r])
            .collect()
    };
    let mut chart = Chart::new(
        Axis::linear("push [mm]").with_zero(),
        Axis::linear("slope over that of the uniform body").with_zero(),
    )
    .title("What the layers add")
    .subtitle("4 × 4 columns, slices of 10 mm; shaded: the hard layer at rest")
    .band(Band::x(mm, 2.0 * mm, "middle", PALETTE[COLORS[1]]))
    .band(Band::x(2.0 * mm, 3.0 * mm, "bottom", PALETTE[COLORS[2]]));
    for (i, body) in [Body::Middle, Body::Bottom].into_iter().enumerate() {
        let series = Series::new(body.title(), points(i)).with_markers();
        chart = chart.series(series.with_color(PALETTE[COLORS[i + 1]]));
    }
    chart
}

fn sweep_chart(figures: &Figures) -> Chart {
    let mut chart = Chart::new(
        Axis::linear("depth of the knee [mm]").with_zero(),
        Axis::linear("slope after ÷ slope before").with_zero(),
    )
    .title("Knees of all readings")
    .subtitle("patches, spacings, bars, corrections, depth ranges; dotted: the thesis");
    for (i, body) in Body::ALL.into_iter().enumerate() {
        let points = figures.sweep.iter().filter_map(|row| {
            let [at, change] = match body {
                Body::Uniform => [row.uniform_knee_mm, row.uniform_slope_change],
                Body::Middle => [row.middle_knee_mm, row.middle_slope_change],
                Body::Bottom => [row.bottom_knee_mm, row.bottom_slope_change],
            };
            Some([at?, change?])
        });
        let series = Series::new(body.title(), points.collect()).only_markers();
        chart = chart.series(series.with_color(PALETTE[COLORS[i]]));
        if let Some(at) = body.thesis_knee_mm() {
            chart = chart.guide(Guide::x(at, body.title()));
        }
    }
    chart
}

fn crossing_chart(report: &Report) -> Chart {
    let mut chart = Chart::new(
        Axis::linear("Euler's step size ÷ stable at rest").with_range(0.0, 1.0),
        Axis::log("steps until the base feels 90 %"),
    )
    .title("How long a push takes to cross")
    .subtitle("64 nodes, 1 mm; dashed: the combined method");
    for (i, body) in Body::ALL.into_iter().enumerate() {
        let points = report.euler.iter();
        let points = points.filter_map(|row| Some([row.step_size, row.steps_to_cross[i]? as f64]));
        let series = Series::new(body.title(), points.collect()).with_markers();
        chart = chart.series(series.with_color(PALETTE[COLORS[i]]));
    }
    if let Some([Some(steps), ..]) = report.combined_steps_to_cross {
        let flat = vec![[0.0, steps as f64], [1.0, steps as f64]];
        chart = chart.series(
            Series::new("combined", flat)
                .dashed()
                .with_color(PALETTE[6]),
        );
    }
    chart
}

fn continuum_force_chart(continuum: &Continuum, disc: &PressedDisc) -> Chart {
    let mut chart = Chart::new(
        Axis::linear("push [mm]").with_zero(),
        Axis::linear("force on the disc [N]").with_zero(),
    )
    .title(format!("As a continuum, {}", disc.name))
    .subtitle(format!(
        "bonded disc of {:.1} mm radius, {:.0} and {:.0} kPa, Poisson's ratio {}",
        disc.radius_mm,
        continuum.soft_young_pa / 1e3,
        continuum.hard_young_pa / 1e3,
        continuum.poisson,
    ));
    for (pressed, color) in disc.bodies.iter().zip(COLORS) {
        let series = Series::new(pressed.body.title(), pressed.curve.clone());
        chart = chart.series(series.with_color(PALETTE[color]));
    }
    chart
}

fn continuum_ratio_chart(continuum: &Continuum, disc: &PressedDisc) -> Chart {
    /// Upper end of the chart, far above the ratios that matter; larger ratios leave the chart.
    const STIFFEST: f64 = 2.0;
    let mut chart = Chart::new(
        Axis::linear("push [mm]").with_zero(),
        Axis::linear("force over that of the uniform body").with_range(0.9, STIFFEST),
    )
    .title(format!("When the layers are felt, {}", disc.name))
    .subtitle("dotted: differences that the attentive and that all people feel");
    for ratio in continuum.felt_ratios {
        chart = chart.guide(Guide::y(ratio, format!("{:.0} %", (ratio - 1.0) * 1e2)));
    }
    for (pressed, color) in disc.bodies.iter().zip(COLORS).skip(1) {
        let series = Series::new(pressed.body.title(), pressed.stiffness_ratio.clone());
        chart = chart.series(series.with_color(PALETTE[color]));
        for (at, ratio) in pressed.felt_from_mm.iter().zip(continuum.felt_ratios) {
            if let Some(at) = at.filter(|at| *at > 0.0) {
                chart = chart.note([at, ratio], format!("from {at:.0} mm on"));
            }
        }
    }
    chart
}

fn speed_chart(report: &Report) -> Chart {
    let points = |rate: &dyn Fn(&super::speed::SpeedRow) -> Option<f64>| -> Vec<[f64; 2]> {
        let rows = report.table.iter();
        rows.filter_map(|row| Some([row.nodes as f64, rate(row)?]))
            .collect()
    };
    Chart::new(Axis::log("nodes"), Axis::log("steps per second"))
        .title("Speed")
        .subtitle("whole steps, one core; dotted: the haptic rate")
        .series(Series::new("ours", points(&|row| Some(row.steps_per_s))).with_markers())
        .series(Series::new("dense inverse", points(&|row| row.naive_steps_per_s)).with_markers())
        .series(Series::new("2009", points(&|row| row.thesis_steps_per_s)).with_markers())
        .guide(Guide::y(1000.0, ""))
}
