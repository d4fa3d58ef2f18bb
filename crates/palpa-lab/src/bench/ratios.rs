//! Comparison of the moving step with a dense inverse and with a full factorization.

use std::sync::Arc;
use std::time::Duration;

use cpu_time::ThreadTime;
use palpa_fem::Model;
use palpa_fem::pairing::pair_triangles;
use palpa_sparse::{Factor, NodePattern, Pattern, minimum_degree};
use palpa_springs::Solver;
use serde::Serialize;

use crate::reproduce;

/// Comparison of the moving step with another method.
#[derive(Debug, Clone, Serialize)]
pub struct Ratio {
    /// Name of the other method.
    pub against: &'static str,
    /// The row of the table that is compared: case and mode.
    pub row: String,
    /// Number of nodes: in the row, and in the other method's body.
    pub nodes: [usize; 2],
    /// Time of the other method divided by the time of the moving step.
    pub ratio: f64,
    /// Median time of the other method, ms.
    pub other_ms: f64,
}

/// Median time of a step of the reference method with its dense inverse, s, on `n × n` columns of 4
/// nodes; and the number of nodes.
///
/// # Errors
/// If its model cannot be built.
pub fn dense_inverse(n: usize, budget: Duration) -> anyhow::Result<(f64, usize)> {
    let shape = reproduce::Shape::thesis(n);
    let rate = reproduce::speed::steps_per_s(&shape, Solver::HistoricalInverse, budget)?;
    Ok((1.0 / rate, shape.n_nodes()))
}

/// Median time, s, to factor a matrix with the pattern of the model's stiffness and to solve for
/// one right-hand side, nothing else. It uses faer's supernodal factorization in double precision
/// with a minimum-degree ordering. The values of the matrix do not affect the time, so those of a
/// grid of springs are used.
///
/// # Errors
/// If the factor would be too large.
pub fn full_factor(model: &Arc<Model>, n_times: usize) -> anyhow::Result<f64> {
    let body = model.body();
    let n_free = body.n_levels - 1;
    let n_columns = body.n_vertices();
    let pairing = pair_triangles(&body.skin);
    let mut neighbours: Vec<Vec<usize>> = vec![Vec::new(); n_columns];
    let mut join = |corners: &[u32]| {
        for &a in corners {
            neighbours[a as usize].extend(corners.iter().filter(|&&b| b != a).map(|&b| b as usize));
        }
    };
    for pair in &pairing.pairs {
        join(&pair.corners);
    }
    for &single in &pairing.singles {
        join(&body.skin.triangles[single as usize]);
    }
    for list in &mut neighbours {
        list.sort_unstable();
        list.dedup();
    }
    let edges = neighbours
        .iter()
        .enumerate()
        .flat_map(|(a, list)| list.iter().map(move |&b| (a, b)));
    let too_large = |_| anyhow::anyhow!("the factor of {n_columns} columns is too large");
    let order = minimum_degree(n_columns, edges).map_err(too_large)?;
    let mut rank = vec![0; n_columns];
    for (i, &column) in order.iter().enumerate() {
        rank[column] = i;
    }
    // The node at level l of the column with rank r has the number r n_free + l.
    let mut nodes: NodePattern = Vec::with_capacity(n_columns * n_free);
    for &column in &order {
        for level in 0..n_free {
            let near = |other: usize| other + 1 >= level && other <= level + 1;
            let mut later = Vec::new();
            if level + 1 < n_free {
                later.push(rank[column] * n_free + level + 1);
            }
            let ranks = neighbours[column].iter().map(|&other| rank[other]);
            for other in ranks.filter(|&other| other > rank[column]) {
                later.extend((0..n_free).filter(|&l| near(l)).map(|l| other * n_free + l));
            }
            later.sort_unstable();
            nodes.push((rank[column] * n_free + level, later));
        }
    }
    let n = 3 * nodes.len();
    let pattern = Pattern::sparse(&nodes, n, |node| (3 * node, 3))
        .map_err(|_| anyhow::anyhow!("the factor of {n} unknowns is too large"))?;
    // A spring along every edge and one from each node to the ground make the matrix diagonally
    // dominant.
    let mut values = vec![0.0; pattern.n_entries()];
    let mut scale = vec![1e-3; n];
    for (node, later) in &nodes {
        for &other in later {
            for c in 0..3 {
                values[pattern.entry(3 * other + c, 3 * node + c)] = -1.0;
                scale[3 * node + c] += 1.0;
                scale[3 * other + c] += 1.0;
            }
        }
    }
    for (i, value) in scale.iter().enumerate() {
        values[pattern.diagonal(i)] = *value;
    }
    let mut factor = Factor::new(&pattern);
    let mut right_side = vec![1.0; n];
    let mut times = Vec::with_capacity(n_times);
    for _ in 0..n_times.max(1) {
        let clock = ThreadTime::now();
        factor
            .refactor(&pattern, &mut values, &scale, 1e-12)
            .map_err(|_| anyhow::anyhow!("a grid of springs is not positive definite"))?;
        factor.solve(&pattern, &values, &mut right_side);
        times.push(clock.elapsed().as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    Ok(times[times.len() / 2])
}
