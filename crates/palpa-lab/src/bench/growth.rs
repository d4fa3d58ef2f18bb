//! Growth of the cost with the size of the body.

use serde::Serialize;

use super::row::{BenchRow, Mode};

/// Fit of the time of a step as a power of the number of nodes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Growth {
    /// Mode of the steps.
    pub mode: Mode,
    /// The exponent.
    pub exponent: f64,
    /// Nodes of the smallest and the largest body.
    pub nodes: [usize; 2],
}

/// Fits a line to the logarithms of time and number of nodes of each mode's rows. Modes with fewer
/// than two bodies are left out.
pub fn growth<'a>(rows: &(impl Iterator<Item = &'a BenchRow> + Clone)) -> Vec<Growth> {
    [Mode::Full, Mode::Whole, Mode::Zone]
        .into_iter()
        .filter_map(|mode| {
            let points: Vec<[f64; 2]> = rows
                .clone()
                .filter(|row| row.mode == mode)
                .map(|row| [(row.nodes as f64).ln(), row.step_ms_median.ln()])
                .collect();
            let n = points.len() as f64;
            let mean = |i: usize| points.iter().map(|p| p[i]).sum::<f64>() / n;
            let [x, y] = [mean(0), mean(1)];
            let spread: f64 = points.iter().map(|p| (p[0] - x) * (p[0] - x)).sum();
            let slope: f64 = points.iter().map(|p| (p[0] - x) * (p[1] - y)).sum();
            let nodes = rows
                .clone()
                .filter(|row| row.mode == mode)
                .map(|row| row.nodes);
            (spread > 0.0).then(|| Growth {
                mode,
                exponent: slope / spread,
                nodes: [nodes.clone().min().unwrap_or(0), nodes.max().unwrap_or(0)],
            })
        })
        .collect()
}
