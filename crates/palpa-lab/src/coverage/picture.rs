//! True errors against error bars.

use palpa_plot::{Axis, Chart, PALETTE, Picture, Series, panels};

use super::{Case, Summary, tools};

/// Limits of the axes: true errors and bars, % of the force, and widths, true errors.
const ERRORS: [f64; 2] = [0.01, 100.0];
const BARS: [f64; 2] = [0.1, 100.0];
const WIDTHS: [f64; 2] = [0.1, 100.0];

/// Draws the true error of each case against its bar, and the share of cases by the width of the
/// bar.
pub fn draw(cases: &[Case], summary: &Summary) -> Picture {
    let mut scatter = Chart::new(
        Axis::log("half the error bar [% of the force]").with_range(BARS[0], BARS[1]),
        Axis::log("true error [% of the force]").with_range(ERRORS[0], ERRORS[1]),
    )
    .title("Each press: true error and its bar")
    .subtitle(format!(
        "below the line: within the bar, {:.1} % of {} presses",
        100.0 * summary.coverage,
        summary.n_judged
    ))
    .series(Series::new("bar", BARS.map(|bar| [bar, bar]).to_vec()).dashed());
    for (tool, color) in tools(cases).into_iter().zip(PALETTE.into_iter().skip(1)) {
        let points: Vec<[f64; 2]> = (cases.iter().filter(|case| case.tool == tool))
            .filter_map(|case| {
                let share = |n: f64| Some(100.0 * n / case.force_n?);
                let error = share(case.error_n()?.abs())?.max(ERRORS[0]);
                Some([share(case.error_bar_n()?)?, error])
            })
            .collect();
        scatter = scatter.series(Series::new(tool, points).only_markers().with_color(color));
    }
    let mut widths: Vec<f64> = cases.iter().filter_map(Case::width).collect();
    widths.sort_by(f64::total_cmp);
    let n = widths.len() as f64;
    let shares = (widths.iter().enumerate())
        .map(|(i, width)| {
            [
                width.clamp(WIDTHS[0], WIDTHS[1]),
                100.0 * (i + 1) as f64 / n,
            ]
        })
        .collect();
    let sharpness = Chart::new(
        Axis::log("half the error bar, in true errors").with_range(WIDTHS[0], WIDTHS[1]),
        Axis::linear("share of the presses [%]").with_range(0.0, 100.0),
    )
    .title("How wide the bars are")
    .subtitle(format!(
        "left of 1: outside; median {:.1}",
        summary.median_width
    ))
    .line("presses with a narrower bar", shares);
    panels("Error bars", &[scatter, sharpness], 2)
}
