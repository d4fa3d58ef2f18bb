//! Plot of the errors against mesh size, one panel for each case.

use std::fmt::Write as _;

use super::{Findings, StudyPoint};

use super::tolerance::share;
use crate::reproduce::fit::line;
use palpa_plot::{Axis, Chart, Guide, PALETTE, Picture, Series, panels};

/// Largest number of curves shown by name; with more curves, the worst and the mean are shown.
const MOST_NAMED: usize = 4;
/// Lower end of the axis, as a share of the lowest error of the named curves; smaller errors are
/// not shown.
const LEAST_SHARE: f64 = 0.3;
/// Smallest ratio of mesh sizes for which an order of convergence is computed.
const LEAST_RANGE: f64 = 2.0;
/// Opacity of a curve without a name.
const FAINT: f64 = 0.3;

/// One curve of a study: errors on meshes, from coarse to fine.
struct StudyCurve<'a> {
    name: &'a str,
    points: Vec<&'a StudyPoint>,
}

impl StudyCurve<'_> {
    /// Mesh sizes, numbers of nodes, and absolute errors.
    fn placed(&self) -> Vec<Placed> {
        (self.points.iter())
            .map(|p| Placed {
                h: p.h,
                nodes: p.nodes as f64,
                error: p.error.abs(),
            })
            .collect()
    }
}

/// An absolute error on a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Placed {
    h: f64,
    nodes: f64,
    error: f64,
}

/// Order of convergence in mesh size, by least squares over all meshes. `None` if the error does
/// not fall from each mesh to the next: then it passes through zero or has reached the accuracy of
/// the reference.
fn order(points: &[Placed]) -> Option<f64> {
    if points.first()?.h < LEAST_RANGE * points.last()?.h {
        return None;
    }
    let falls = |p: &[Placed]| p[1].error < p[0].error && p[1].h < p[0].h;
    if !points.windows(2).all(falls) {
        return None;
    }
    let logs: Vec<[f64; 2]> = (points.iter()).map(|p| [p.h.ln(), p.error.ln()]).collect();
    line(&logs).map(|l| l.slope)
}

/// A curve's name, with its order if it has one.
fn with_order(name: &str, points: &[Placed]) -> String {
    order(points).map_or_else(
        || name.to_owned(),
        |order| format!("{name}: order {order:.1}"),
    )
}

/// The largest error of the curves on each mesh and their root mean square; `None` if the curves
/// use different meshes.
fn summary(curves: &[StudyCurve<'_>]) -> Option<[Vec<Placed>; 2]> {
    let placed: Vec<Vec<Placed>> = curves.iter().map(StudyCurve::placed).collect();
    let first = placed.first()?;
    let is_same = |other: &Vec<Placed>| {
        other.len() == first.len()
            && (other.iter().zip(first)).all(|(a, b)| a.h.to_bits() == b.h.to_bits())
    };
    if !placed.iter().all(is_same) {
        return None;
    }
    let over = |figure: &dyn Fn(&[f64]) -> f64| {
        (first.iter().enumerate())
            .map(|(i, p)| {
                let errors: Vec<f64> = placed.iter().map(|curve| curve[i].error).collect();
                Placed {
                    error: figure(&errors),
                    ..*p
                }
            })
            .collect()
    };
    let worst = over(&|errors| errors.iter().copied().fold(0.0, f64::max));
    let mean = over(&|errors| {
        let squares: f64 = errors.iter().map(|e| e * e).sum();
        (squares / errors.len() as f64).sqrt()
    });
    Some([worst, mean])
}

/// Draws the study of all cases that have one.
pub fn draw(found: &Findings) -> Picture {
    let mut names: Vec<&str> = Vec::new();
    for point in &found.study {
        if !names.contains(&point.case) {
            names.push(point.case);
        }
    }
    let charts: Vec<Chart> = names.iter().map(|case| panel(case, found)).collect();
    let n_columns = if charts.len() <= 4 { 2 } else { 3 };
    panels(
        "Errors of ever finer meshes (grey: single curves). Order in mesh size, where an error falls on every finer mesh",
        &charts,
        n_columns,
    )
}

fn panel(case: &str, found: &Findings) -> Chart {
    let curves = curves(case, found);
    let common = common_start(&curves);
    let summary = if curves.len() > MOST_NAMED {
        summary(&curves)
    } else {
        None
    };
    let named: Vec<(String, Vec<Placed>)> = match summary {
        Some([worst, mean]) => vec![
            (with_order("worst", &worst), worst),
            (with_order("root mean square", &mean), mean),
        ],
        None => (curves.iter())
            .map(|curve| {
                let placed = curve.placed();
                (with_order(&curve.name[common.len()..], &placed), placed)
            })
            .collect(),
    };
    let tolerances = tolerances(case, found, &curves);
    let errors = || named.iter().flat_map(|(_, points)| points).map(|p| p.error);
    let low = (errors().chain(tolerances.iter().copied()))
        .filter(|e| *e > 0.0)
        .fold(f64::INFINITY, f64::min);
    let high = errors()
        .chain(tolerances.iter().copied())
        .fold(low, f64::max);
    let what = crate::verify::cases().iter().find(|c| c.name == case);
    let mut chart = Chart::new(
        Axis::log("nodes that can move"),
        Axis::log("|error| [%]").with_range(LEAST_SHARE * low * 1e2, high * 1e2),
    )
    .title(title(case, common, curves.len(), named.len()))
    .subtitle(what.map_or("", |c| c.title));
    if named.len() < curves.len() {
        for curve in &curves {
            let series = Series::new("", in_percent(&curve.placed()));
            chart = chart.series(series.with_color(PALETTE[6].tint(FAINT)));
        }
    }
    for (i, (name, points)) in named.into_iter().enumerate() {
        let series = Series::new(name, in_percent(&points)).with_markers();
        chart = chart.series(series.with_color(PALETTE[i % PALETTE.len()]));
    }
    for tolerance in tolerances {
        let name = format!("tolerance {}", share(tolerance));
        chart = chart.guide(Guide::y(tolerance * 1e2, name).named_right());
    }
    chart
}

/// Title of a panel: the name of the case, and the common part of the names of its curves.
fn title(case: &str, common: &str, n_curves: usize, n_named: usize) -> String {
    let common = common.trim_end_matches([' ', ':', ',']);
    let mut title = case.to_owned();
    if !common.is_empty() {
        let _ = write!(title, ", {common}");
    }
    if n_named < n_curves {
        let _ = write!(title, ", {n_curves} curves");
    }
    title
}

fn in_percent(points: &[Placed]) -> Vec<[f64; 2]> {
    points.iter().map(|p| [p.nodes, p.error * 1e2]).collect()
}

/// Common start of the names of all curves, up to the end of a phrase.
fn common_start<'a>(curves: &[StudyCurve<'a>]) -> &'a str {
    let Some(first) = curves.first().filter(|_| curves.len() > 1) else {
        return "";
    };
    let ends = first.name.match_indices([':', ',']).map(|(at, _)| at + 2);
    ends.filter_map(|end| first.name.get(..end))
        .take_while(|start| curves.iter().all(|c| c.name.starts_with(start)))
        .last()
        .unwrap_or("")
}

fn curves<'a>(case: &str, found: &'a Findings) -> Vec<StudyCurve<'a>> {
    let mut curves: Vec<StudyCurve<'a>> = Vec::new();
    for point in found.study.iter().filter(|p| p.case == case) {
        match curves.iter_mut().find(|c| c.name == point.series) {
            Some(curve) => curve.points.push(point),
            None => curves.push(StudyCurve {
                name: &point.series,
                points: vec![point],
            }),
        }
    }
    for curve in &mut curves {
        curve.points.sort_by_key(|p| p.nodes);
    }
    curves
}

/// The tolerances of the figures at the ends of the curves; those of the whole case if no curve
/// ends in a figure.
fn tolerances(case: &str, found: &Findings, curves: &[StudyCurve<'_>]) -> Vec<f64> {
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
        let order = order(&curves("lame", &found)[0].placed()).unwrap();
        assert!((order - 2.0).abs() < 1e-9, "{order}");
        let svg = draw(&found).svg().to_owned();
        assert!(svg.contains("r 12 mm: order 2.0"), "{svg}");
        // Over a single panel the title has two lines.
        assert!(!svg.contains("single curves). Order in mesh size, where an error falls on every"));
    }

    #[test]
    fn an_error_that_rises_on_a_finer_mesh_has_no_order() {
        for errors in [[-0.08, -0.02, 0.005, 0.006], [-0.08, 0.01, -0.02, 0.004]] {
            let found = study(errors);
            assert_eq!(order(&curves("lame", &found)[0].placed()), None);
        }
    }

    #[test]
    fn meshes_of_nearly_one_size_have_no_order() {
        let mut found = study([-0.08, -0.02, -0.005, -0.00125]);
        found.study.truncate(2);
        assert!(order(&curves("lame", &found)[0].placed()).is_some());
        found.study[1].h = 0.15;
        assert_eq!(order(&curves("lame", &found)[0].placed()), None);
    }

    /// Curves at five depths; the errors of each are those of the first times its factor.
    fn many(factors: [f64; 5]) -> Findings {
        let mut found = Findings::default();
        for (i, factor) in factors.into_iter().enumerate() {
            let mut points = study([-0.08, -0.02, -0.005, -0.00125]).study;
            for point in &mut points {
                point.series = format!("nu 0.45: {i} mm");
                point.error *= factor;
            }
            found.study.extend(points);
        }
        found
    }

    #[test]
    fn of_many_curves_the_worst_and_the_mean_are_named() {
        let mut found = many([1.0, -1.0, 1.0, -2.0, 1.0]);
        let [worst, mean] = summary(&curves("lame", &found)).unwrap();
        assert!((worst[1].error - 0.04).abs() < 1e-12, "{worst:?}");
        // The mean square is (4 · 1 + 4)/5 of the square.
        assert!((mean[1].error - 0.02 * 1.6_f64.sqrt()).abs() < 1e-12);
        let svg = draw(&found).svg().to_owned();
        for text in [
            "lame, nu 0.45, 5 curves",
            "worst: order 2.0",
            "root mean square: order 2.0",
        ] {
            assert!(svg.contains(text), "{svg}");
        }
        // Curves on different meshes have no summary; they keep their names.
        found.study.pop();
        assert!(summary(&curves("lame", &found)).is_none());
        assert!(draw(&found).svg().contains("4 mm: order"));
    }

    #[test]
    fn what_names_have_in_common_is_said_once() {
        let found = many([1.0; 5]);
        assert_eq!(common_start(&curves("lame", &found)), "nu 0.45: ");
        assert_eq!(common_start(&curves("lame", &study([1.0; 4]))), "");
    }
}
