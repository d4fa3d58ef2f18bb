//! Table 4.2: steps per second.

use std::time::{Duration, Instant};

use cpu_time::ThreadTime;
use palpa_mesh::Vec3;
use palpa_springs::{InterfaceBars, Solver, SpringError, SpringState, StepParams, Workspace, step};
use serde::Serialize;

use super::{SOFT, Shape};

/// Description for the report of how the rates are measured.
pub const HOW: &str = "median thread-CPU time of one whole step on one core: assemble from the current positions, \
    factor, solve (n = 1), spring correction, forces; a push of 1 mm, 20 down and 20 up, again and again; naive is the \
    same step with a Gauss-Jordan inverse of the dense 3N x 3N matrix; thesis is its table 4.2 (Core2Duo E8400, 2009)";

/// Largest number of nodes for the dense inverse; above it, one inverse takes minutes.
const NAIVE_LIMIT: usize = 343;

/// The shapes of the table (columns, columns, levels), with the rate in the thesis if it gives one.
const SHAPES: [([usize; 3], Option<f64>); 10] = [
    ([3, 3, 3], Some(64.0)),
    ([3, 3, 4], Some(32.0)),
    ([4, 4, 3], Some(15.0)),
    ([4, 4, 4], Some(7.0)),
    ([5, 5, 5], None),
    ([7, 7, 7], None),
    ([10, 10, 5], None),
    ([16, 16, 4], None),
    ([32, 32, 4], None),
    ([64, 64, 4], None),
];

/// One line of the table.
#[derive(Debug, Clone, Serialize)]
pub struct SpeedRow {
    /// Nodes of the body.
    pub nodes: usize,
    /// Nodes per column.
    pub levels: usize,
    /// Steps per second with sparse Cholesky.
    pub steps_per_s: f64,
    /// Steps per second with the dense inverse on this machine; `None` if it would take too long.
    pub naive_steps_per_s: Option<f64>,
    /// Steps per second in the thesis.
    pub thesis_steps_per_s: Option<f64>,
}

/// The shapes up to a number of nodes, in the order of the table.
pub fn shapes(max_nodes: usize) -> Vec<(Shape, Option<f64>)> {
    SHAPES
        .into_iter()
        .map(|([nx, ny, n_levels], thesis)| {
            let shape = Shape {
                columns: [nx, ny],
                n_levels,
                ..Shape::thesis(nx)
            };
            (shape, thesis)
        })
        .filter(|(shape, _)| shape.n_nodes() <= max_nodes)
        .collect()
}

/// Measures one line of the table: for about `budget`, and as long again for the dense inverse.
///
/// # Errors
/// If the model cannot be built.
pub fn measure(
    shape: &Shape,
    thesis: Option<f64>,
    budget: Duration,
) -> Result<SpeedRow, SpringError> {
    let nodes = shape.n_nodes();
    let naive = if nodes <= NAIVE_LIMIT {
        Some(steps_per_s(shape, Solver::HistoricalInverse, budget)?)
    } else {
        None
    };
    Ok(SpeedRow {
        nodes,
        levels: shape.n_levels,
        steps_per_s: steps_per_s(shape, Solver::Auto, budget)?,
        naive_steps_per_s: naive,
        thesis_steps_per_s: thesis,
    })
}

/// The median rate of a step of this shape with a solver, measured for about `budget`.
///
/// # Errors
/// If the model cannot be built.
pub fn steps_per_s(shape: &Shape, solver: Solver, budget: Duration) -> Result<f64, SpringError> {
    // A batch is much longer than the time to read the clock.
    const BATCH: Duration = Duration::from_micros(200);
    const LEAST_BATCHES: usize = 3;

    let stiffnesses = vec![SOFT; shape.n_levels - 1];
    let model = shape.model(&stiffnesses, InterfaceBars::default(), solver)?;
    let (mut state, mut ws) = (SpringState::new(&model), Workspace::new(&model));
    let params = StepParams::default();
    let mut n_done = 0_usize;
    let mut one = || {
        let way = if (n_done / 20).is_multiple_of(2) {
            -1.0e-3
        } else {
            1.0e-3
        };
        n_done += 1;
        step(
            &model,
            &mut state,
            &mut ws,
            Vec3::new(0.0, 0.0, way),
            &params,
        )
    };
    // The first step allocates and touches its memory, so it is not measured.
    one();
    let began = ThreadTime::now();
    one();
    let batch = BATCH.div_duration_f64(began.elapsed().max(Duration::from_nanos(100)));
    let batch = (1..=1000).find(|n| f64::from(*n) >= batch).unwrap_or(1000);

    let mut times = Vec::new();
    let began = Instant::now();
    while began.elapsed() < budget || times.len() < LEAST_BATCHES {
        let clock = ThreadTime::now();
        for _ in 0..batch {
            one();
        }
        times.push(clock.elapsed().as_secs_f64() / f64::from(batch));
    }
    times.sort_by(f64::total_cmp);
    Ok(1.0 / times[times.len() / 2])
}
