//! Least-squares fits of straight lines and knees to force curves.

use serde::Serialize;

/// A straight line `y = intercept + slope x`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// `y` at `x = 0`.
    pub intercept: f64,
    /// `dy/dx`.
    pub slope: f64,
    /// Share of the variance that the line explains, 1 for points on a line.
    pub r2: f64,
}

/// Two straight lines that meet at a knee.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Knee {
    /// Position of the knee, in the unit of `x`.
    pub at: f64,
    /// Slope before the knee.
    pub slope_before: f64,
    /// Slope after the knee relative to the slope before it; 1 means no knee.
    pub slope_change: f64,
    /// Share of the residual of one line that the second one removes, 0 to 1.
    pub gain: f64,
}

/// The line through at least two points `[x, y]` with different `x`.
pub fn line(points: &[[f64; 2]]) -> Option<Line> {
    let n = points.len() as f64;
    let mean = |axis: usize| points.iter().map(|p| p[axis]).sum::<f64>() / n;
    let (x0, y0) = (mean(0), mean(1));
    let moment = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
        points.iter().map(|[x, y]| f(x - x0, y - y0)).sum()
    };
    let xx = moment(&|x, _| x * x);
    let xy = moment(&|x, y| x * y);
    let yy = moment(&|_, y| y * y);
    (points.len() >= 2 && xx > 0.0).then(|| Line {
        intercept: y0 - xy / xx * x0,
        slope: xy / xx,
        r2: if yy > 0.0 { xy * xy / (xx * yy) } else { 1.0 },
    })
}

/// The best continuous pair of lines, `y = a + b x + c max(0, x − knee)`.
///
/// The knee is searched from a tenth to nine tenths of the range, in steps of a 400th. Nearer to
/// the ends, a segment has too few points.
pub fn knee(points: &[[f64; 2]]) -> Option<Knee> {
    const N_TRIALS: usize = 400;
    let single = line(points)?;
    let residual = |[x, y]: &[f64; 2]| (y - single.intercept - single.slope * x).powi(2);
    let before: f64 = points.iter().map(residual).sum();
    let low = points.iter().map(|p| p[0]).fold(f64::INFINITY, f64::min);
    let high = points
        .iter()
        .map(|p| p[0])
        .fold(f64::NEG_INFINITY, f64::max);
    let mut best: Option<(f64, Knee)> = None;
    for trial in N_TRIALS / 10..=N_TRIALS * 9 / 10 {
        let at = low + (high - low) * trial as f64 / N_TRIALS as f64;
        let Some(([_, b, c], left)) = bent(points, at) else {
            continue;
        };
        if best.is_none_or(|(least, _)| left < least) {
            let found = Knee {
                at,
                slope_before: b,
                slope_change: (b + c) / b,
                gain: if before > 0.0 {
                    1.0 - left / before
                } else {
                    0.0
                },
            };
            best = Some((left, found));
        }
    }
    best.map(|(_, knee)| knee)
}

/// The coefficients `[a, b, c]` for a given knee, and the remaining sum of squares.
fn bent(points: &[[f64; 2]], at: f64) -> Option<([f64; 3], f64)> {
    let basis = |x: f64| nalgebra::Vector3::new(1.0, x - at, (x - at).max(0.0));
    let mut normal = nalgebra::Matrix3::zeros();
    let mut right = nalgebra::Vector3::zeros();
    for &[x, y] in points {
        let row = basis(x);
        normal += row * row.transpose();
        right += row * y;
    }
    let found = normal.cholesky()?.solve(&right);
    let left = points
        .iter()
        .map(|&[x, y]| (y - basis(x).dot(&found)).powi(2))
        .sum();
    Some(([found.x, found.y, found.z], left))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_found_exactly() {
        let points: Vec<_> = (0..20)
            .map(|i| [f64::from(i), 3.0 - 0.5 * f64::from(i)])
            .collect();
        let found = line(&points).unwrap();
        assert!((found.slope + 0.5).abs() < 1e-12 && (found.intercept - 3.0).abs() < 1e-12);
        assert!((found.r2 - 1.0).abs() < 1e-12);
        assert_eq!(line(&points[..1]), None);
    }

    #[test]
    fn r2_is_that_of_the_textbook() {
        // y = x² at 0..4: slope 4, R² = 0.9183 (Anscombe-like check by hand: Sxy² / (Sxx Syy) = 40²
        // / (10 · 174)).
        let points = [[0.0, 0.0], [1.0, 1.0], [2.0, 4.0], [3.0, 9.0], [4.0, 16.0]];
        let found = line(&points).unwrap();
        assert!((found.slope - 4.0).abs() < 1e-12);
        assert!((found.r2 - 1600.0 / 1740.0).abs() < 1e-12);
    }

    #[test]
    fn a_knee_is_found_where_it_is() {
        for (at, change) in [(40.0, 3.0), (75.0, 0.5), (20.0, 1.6)] {
            let points: Vec<_> = (1..=120)
                .map(|i| {
                    let x = f64::from(i);
                    [x, 2.0 * (x + (change - 1.0) * (x - at).max(0.0))]
                })
                .collect();
            let found = knee(&points).unwrap();
            assert!((found.at - at).abs() < 0.3, "{found:?}");
            assert!((found.slope_change - change).abs() < 0.02, "{found:?}");
            assert!(found.gain > 0.99, "{found:?}");
        }
    }

    #[test]
    fn a_straight_line_has_no_knee_to_speak_of() {
        let points: Vec<_> = (0..50)
            .map(|i| [f64::from(i), 2.0 * f64::from(i)])
            .collect();
        let found = knee(&points).unwrap();
        assert!((found.slope_change - 1.0).abs() < 1e-9);
    }
}
