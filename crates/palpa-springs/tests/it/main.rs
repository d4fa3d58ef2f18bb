//! Laws, closed forms and oracles of the reference method.

mod euler;
mod fallback;
mod network;
mod solver;
mod statics;
mod stiffness;

use palpa_mesh::generate::patch::{centre_vertex, patch};
use palpa_mesh::{LayeredBody, Vec3};
use palpa_springs::{
    Constraints, LayerStiffness, Outcome, Solver, SpringModel, SpringParams, SpringState,
    StepParams, StepReport, Workspace, step,
};

/// 1 and 90 dyn/cm.
pub(crate) const SOFT: f64 = 1.0e-3;
pub(crate) const HARD: f64 = 90.0e-3;

/// The thesis's patch of `n × n` columns, 40 mm apart in all directions, one layer in each
/// interval.
pub(crate) fn thesis_body(n: usize, n_levels: usize) -> LayeredBody {
    let depths: Vec<f64> = (0..n_levels).map(|l| 0.04 * l as f64).collect();
    let layers: Vec<usize> = (0..n_levels - 1).collect();
    patch(n, n, 0.04, &depths, &layers)
}

pub(crate) fn springs(stiffnesses: &[f64]) -> SpringParams {
    let layers: Vec<_> = stiffnesses
        .iter()
        .map(|&stiffness| LayerStiffness::Spring { stiffness })
        .collect();
    SpringParams::new(layers)
}

/// The thesis's 64 nodes, its centre node held.
pub(crate) fn thesis_model(stiffnesses: [f64; 3], solver: Solver) -> SpringModel {
    let body = thesis_body(4, 4);
    let held = body.node(centre_vertex(4, 4), 0);
    let params = SpringParams {
        solver,
        ..springs(&stiffnesses)
    };
    SpringModel::build(&body, &params, &Constraints::hold(&body, [held])).expect("a model")
}

/// A displacement in equal steps from rest; returns the state and the report of the last step.
pub(crate) fn pushed(
    model: &SpringModel,
    displacement: Vec3,
    n_steps: usize,
    params: &StepParams,
) -> (SpringState, StepReport) {
    let (mut state, mut ws) = (SpringState::new(model), Workspace::new(model));
    let part = displacement / n_steps as f64;
    let mut report = step(model, &mut state, &mut ws, part, params);
    for _ in 1..n_steps {
        report = step(model, &mut state, &mut ws, part, params);
    }
    (state, report)
}

pub(crate) fn assert_converged(report: &StepReport) {
    assert_eq!(report.outcome, Outcome::Converged);
}
