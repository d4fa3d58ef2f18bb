//! Errors against the size of the mesh, a panel for each case.

use std::fmt::Write as _;

use palpa_verify::{Findings, StudyPoint};

use super::report::share;
use crate::plot::{Axis, Chart, Guide, PALETTE, Picture, Series, panels};
use crate::reproduce::fit::line;

/// As many curves as can be told apart in a panel.
const MOST_CURVES: usize = 6;
/// Errors further below the tolerance than this share of it are not looked at.
const LEAST_SHARE: f64 = 1e-3;

/// One curve of a study: errors on meshes, from coarse to fine.
struct Curve<'a> {
    name: &'a str,
    points: Vec<&'a StudyPoint>,
}

impl Curve<'_> {
    /// Sizes relative to the coarsest mesh's, and errors without their sign.
    fn placed(&self) -> Vec<[f64; 2]> {
        let coarsest = self.points.iter().map(|p| p.h).fold(0.0, f64::max);
        (self.points.iter())
            .map(|p| [p.h / coarsest, p.error.abs()])
            .collect()
    }

    /// The power of the mesh's size that the error falls with, by least squares over all meshes. An error that changes its
    /// sign on the way has none: where it passes zero says nothing of how it falls.
    fn order(&self) -> Option<f64> {
        let is_one_sided =
            self.points.iter().all(|p| p.error > 0.0) || self.points.iter().all(|p| p.error < 0.0);
        let logs: Vec<[f64; 2]> = self.placed().iter().map(|p| p.map(f64::ln)).collect();
        if is_one_sided {
            line(&logs).map(|l| l.slope)
        } else {
            None
        }
    }
}

/// The order of the root of the mean square over all curves, if they are on the same meshes: of single curves it is rough
/// where an error comes near zero or near that of the reference.
fn mean_order(curves: &[Curve<'_>]) -> Option<f64> {
    let placed: Vec<Vec<[f64; 2]>> = curves.iter().map(Curve::placed).collect();
    let sizes: Vec<f64> = placed.first()?.iter().map(|p| p[0]).collect();
    let is_same = |other: &Vec<[f64; 2]>| {
        other.len() == sizes.len()
            && other
                .iter()
                .zip(&sizes)
                .all(|(p, h)| p[0].to_bits() == h.to_bits())
    };
    if placed.len() < 2 || !placed.iter().all(is_same) {
        return None;
    }
    let logs: Vec<[f64; 2]> = (sizes.iter().enumerate())
        .map(|(i, h)| {
            let squares: f64 = placed.iter().map(|c| c[i][1].powi(2)).sum();
            [h.ln(), 0.5 * (squares / placed.len() as f64).ln()]
        })
        .collect();
    line(&logs).map(|l| l.slope)
}

/// Draws the study of all cases that have one.
pub(super) fn draw(found: &Findings) -> Picture {
    let mut names: Vec<&str> = Vec::new();
    for point in &found.study {
        if !names.contains(&point.case) {
            names.push(point.case);
        }
    }
    let charts: Vec<Chart> = names.iter().map(|case| panel(case, found)).collect();
    let n_columns = if charts.len() <= 4 { 2 } else { 3 };
    panels(
        "Errors against mesh size; beside each curve its observed order, ± where the error changes its sign",
        &charts,
        n_columns,
    )
}

fn panel(case: &str, found: &Findings) -> Chart {
    let curves = curves(case, found);
    let n_all = curves.len();
    let mean_order = mean_order(&curves);
    let shown = spread(curves, MOST_CURVES);
    let tolerances = tolerances(case, found, &shown);
    let errors = || shown.iter().flat_map(Curve::placed).map(|p| p[1]);
    let strictest = tolerances.iter().copied().fold(f64::INFINITY, f64::min);
    let low = errors()
        .filter(|e| *e > 0.0)
        .fold(strictest, f64::min)
        .max(LEAST_SHARE * strictest);
    let high = errors()
        .chain(tolerances.iter().copied())
        .fold(low, f64::max);
    let nodes = || shown.iter().flat_map(|c| &c.points).map(|p| p.nodes);
    let [fewest, most] = [nodes().min(), nodes().max()].map(Option::unwrap_or_default);
    let mut title = case.to_owned();
    if let Some(order) = mean_order {
        let order = format!("{order:.1}").replace('-', "−");
        let _ = write!(title, ": order {order} in the mean");
    }
    if n_all > shown.len() {
        let _ = write!(title, ", {} of {n_all} curves", shown.len());
    }
    let what = palpa_verify::cases().iter().find(|c| c.name == case);
    let mut chart = Chart::new(
        Axis::log(format!(
            "mesh size ÷ the coarsest ({fewest} to {most} nodes)"
        )),
        Axis::log("|error| [%]").with_range(low * 1e2, high * 1e2),
    )
    .title(title)
    .subtitle(what.map_or("", |c| c.title));
    for (i, curve) in shown.iter().enumerate() {
        let name = match curve.order() {
            Some(order) => format!("{}: {order:.1}", curve.name),
            None => format!("{}: ±", curve.name),
        };
        let points = curve.placed().iter().map(|[h, e]| [*h, e * 1e2]).collect();
        let series = Series::new(name, points).with_markers();
        chart = chart.series(series.with_color(PALETTE[i % PALETTE.len()]));
    }
    for tolerance in tolerances {
        chart = chart.guide(Guide::y(
            tolerance * 1e2,
            format!("tolerance {}", share(tolerance)),
        ));
    }
    chart
}

fn curves<'a>(case: &str, found: &'a Findings) -> Vec<Curve<'a>> {
    let mut curves: Vec<Curve<'a>> = Vec::new();
    for point in found.study.iter().filter(|p| p.case == case) {
        match curves.iter_mut().find(|c| c.name == point.series) {
            Some(curve) => curve.points.push(point),
            None => curves.push(Curve {
                name: &point.series,
                points: vec![point],
            }),
        }
    }
    for curve in &mut curves {
        curve.points.sort_by(|a, b| b.h.total_cmp(&a.h));
    }
    curves
}

/// At most `n` of the items, evenly, the first and the last among them.
fn spread<T>(items: Vec<T>, n: usize) -> Vec<T> {
    let len = items.len();
    if len <= n {
        return items;
    }
    let wanted: Vec<usize> = (0..n).map(|i| i * (len - 1) / (n - 1)).collect();
    let kept = items.into_iter().enumerate();
    kept.filter(|(i, _)| wanted.contains(i))
        .map(|(_, item)| item)
        .collect()
}

/// The tolerances of the figures that the curves end in; those of the case if none of them is a figure.
fn tolerances(case: &str, found: &Findings, curves: &[Curve<'_>]) -> Vec<f64> {
    let is_end = |error: f64| {
        let ends = curves.iter().filter_map(|c| c.points.last());
        ends.into_iter()
            .any(|end| end.error.to_bits() == error.to_bits())
    };
    let of_case = || found.rows.iter().filter(|row| row.case == case);
    let mut tolerances: Vec<f64> = of_case()
        .filter(|row| is_end(row.rel_error))
        .map(|row| row.tolerance)
        .collect();
    if tolerances.is_empty() {
        tolerances = of_case().map(|row| row.tolerance).collect();
    }
    tolerances.sort_by(f64::total_cmp);
    tolerances.dedup();
    tolerances
}

#[cfg(test)]
mod tests {
    use super::*;

    fn study(errors: [f64; 4]) -> Findings {
        let point = |i: usize| StudyPoint {
            case: "lame",
            series: "r 12 mm".into(),
            h: 0.25 / f64::from(1_u32 << i),
            nodes: 10 << (2 * i),
            error: errors[i],
        };
        Findings {
            rows: Vec::new(),
            study: (0..4).map(point).collect(),
        }
    }

    #[test]
    fn the_observed_order_is_that_of_the_errors() {
        let found = study([-0.08, -0.02, -0.005, -0.00125]);
        let order = curves("lame", &found)[0].order().unwrap();
        assert!((order - 2.0).abs() < 1e-9, "{order}");
        let svg = draw(&found).svg().to_owned();
        assert!(svg.contains("r 12 mm: 2.0"), "{svg}");
    }

    #[test]
    fn the_mean_order_needs_the_same_meshes() {
        let mut found = study([-0.08, -0.02, -0.005, -0.00125]);
        let mut other = study([0.04, 0.01, 0.0025, 0.000625]).study;
        for point in &mut other {
            point.series = "r 35 mm".into();
        }
        found.study.extend(other);
        let order = mean_order(&curves("lame", &found)).unwrap();
        assert!((order - 2.0).abs() < 1e-9, "{order}");
        found.study.pop();
        assert_eq!(mean_order(&curves("lame", &found)), None);
    }

    #[test]
    fn an_error_that_changes_its_sign_has_no_order() {
        let found = study([-0.08, -0.02, 0.005, 0.004]);
        assert_eq!(curves("lame", &found)[0].order(), None);
    }

    #[test]
    fn of_many_curves_first_and_last_are_kept() {
        assert_eq!(spread((0..14).collect(), 6), [0, 2, 5, 7, 10, 13]);
        assert_eq!(spread(vec![1, 2], 6), [1, 2]);
    }
}
