//! Explicit Euler alone: the method with which the thesis compares its own.
//!
//! Every step moves each free node by (3.21), with the sign that makes it restoring,
//! ```text
//!     U_a = ½ h Σ_i k_i (l_i − L_i) (P_i − P_a)
//! ```
//! with one step size `h` for all nodes. Taken literally, the vector `P_i − P_a` is not a unit
//! vector. So the pull grows with the square of the stretch, and its tangent is up to `k (2l − L)`.
//! A step size `h` that is stable at rest therefore becomes unstable at a large enough stretch, and
//! the nodes fly apart. A node feels only its neighbours, so a force crosses one level per step.

use palpa_mesh::Vec3;

use crate::constraints::Role;
use crate::model::SpringModel;
use crate::network::{Bar, direction};
use crate::state::{Mode, SpringState, Workspace};
use crate::step::{Method, Outcome, StepParams, bar_force, move_operated, nodal_forces, step};

/// The step size of explicit Euler.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EulerParams {
    /// `h` above, in 1/N; all nodes use it.
    pub step_size: f64,
}

impl EulerParams {
    /// A fraction of the largest step size that is stable at rest, that is, under small loads.
    ///
    /// A smaller step size stays stable under a larger load, but a force then needs more steps to
    /// cross the body.
    pub fn of_stable(model: &SpringModel, fraction: f64) -> Self {
        Self {
            step_size: fraction * 4.0 / largest_tangent(model),
        }
    }
}

/// The largest eigenvalue, in N, of the tangent of `Σ_i k_i (l_i − L_i) (P_i − P_a)` at rest, over
/// the free nodes. That tangent is the stiffness matrix of bars with the stiffness `k L`. Computed
/// by power iteration to about 1 %, because the next eigenvalues are that close.
fn largest_tangent(model: &SpringModel) -> f64 {
    const ITERATIONS: usize = 200;
    let rest = &model.rest;
    let span = |bar: &Bar| rest[bar.b as usize] - rest[bar.a as usize];
    let directions: Vec<Vec3> = model.bars.iter().map(|bar| direction(span(bar))).collect();
    let bars: Vec<Bar> = model
        .bars
        .iter()
        .map(|bar| Bar {
            stiffness: bar.stiffness * bar.length,
            ..*bar
        })
        .collect();
    // Any start that is not orthogonal to the mode will do. A fixed one gives the same result in
    // every run.
    let mut x: Vec<Vec3> = (0..model.n_nodes())
        .map(|i| {
            let phase = i as f64;
            Vec3::new(
                (1.3 * phase).cos(),
                (1.7 * phase).sin(),
                (2.3 * phase).cos(),
            )
        })
        .collect();
    let mut image = x.clone();
    let mut largest = 0.0;
    for _ in 0..ITERATIONS {
        for (freedom, x) in model.freedoms.iter().zip(&mut x) {
            *x = freedom.project(x);
        }
        let norm = x.iter().map(Vec3::norm_squared).sum::<f64>().sqrt();
        if norm == 0.0 {
            break;
        }
        for x in &mut x {
            *x /= norm;
        }
        nodal_forces(&bars, &directions, &x, &mut image);
        largest = x.iter().zip(&image).map(|(x, kx)| x.dot(kx)).sum();
        std::mem::swap(&mut x, &mut image);
    }
    largest
}

/// One step of explicit Euler: the operated nodes move, then every free node once, all computed
/// from the same positions.
pub(crate) fn euler_step(
    model: &SpringModel,
    state: &mut SpringState,
    ws: &mut Workspace,
    displacement: Vec3,
    params: EulerParams,
) {
    for &node in &model.operated {
        state.positions[node] += displacement;
    }
    move_operated(model, ws, Vec3::zeros());
    for bar in &model.bars {
        let (a, b) = (bar.a as usize, bar.b as usize);
        let d = state.positions[b] - state.positions[a];
        let pull = d * (bar.stiffness * (d.norm() - bar.length));
        ws.increments[a] += pull;
        ws.increments[b] -= pull;
    }
    let h = 0.5 * params.step_size;
    for (node, freedom) in model.freedoms.iter().enumerate() {
        if freedom.role == Role::Free {
            state.positions[node] += freedom.project(&ws.increments[node]) * h;
        }
    }
    update_forces(model, state);
    state.mode = Mode::Euler;
}

/// Sets the forces of the state to those of the bars at their present lengths. Euler does not sum
/// forces along a path.
fn update_forces(model: &SpringModel, state: &mut SpringState) {
    state.node_forces.fill(Vec3::zeros());
    for bar in &model.bars {
        let (a, b) = (bar.a as usize, bar.b as usize);
        let d = state.positions[b] - state.positions[a];
        let pull = direction(d) * (bar.stiffness * (d.norm() - bar.length));
        state.node_forces[a] -= pull;
        state.node_forces[b] += pull;
    }
    state.force = bar_force(model, &state.positions);
}

/// Number of steps until the reaction at the fixed nodes reaches a fraction of its final value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Steps until the fixed nodes feel a reaction (more than 1e-12 of the final one).
    pub first_steps: usize,
    /// Steps until their reaction has reached the requested fraction and stays there.
    pub settled_steps: usize,
    /// The final reaction. N
    pub reaction: f64,
}

/// Applies `displacement` in the first step, then counts steps until the base feels it.
///
/// `None` if the method diverges, if the base feels no force, or if the reaction at half of
/// `max_steps` differs from the final one by more than a thousandth.
pub fn steps_to_cross(
    model: &SpringModel,
    displacement: Vec3,
    params: &StepParams,
    fraction: f64,
    max_steps: usize,
) -> Option<Crossing> {
    let (mut state, mut ws) = (SpringState::new(model), Workspace::new(model));
    let mut trace = Vec::with_capacity(max_steps);
    for i in 0..max_steps.max(1) {
        let moved = if i == 0 { displacement } else { Vec3::zeros() };
        let report = step(model, &mut state, &mut ws, moved, params);
        if matches!(
            report.outcome,
            Outcome::Diverged { .. } | Outcome::NotFinite
        ) {
            return None;
        }
        trace.push(state.fixed_reaction(model).norm());
    }
    let reaction = trace[trace.len() - 1];
    let has_settled = (trace[trace.len() / 2] - reaction).abs() <= 1e-3 * reaction;
    if reaction <= 0.0 || !has_settled {
        return None;
    }
    let within = |r: &f64| (r - reaction).abs() <= (1.0 - fraction) * reaction;
    Some(Crossing {
        first_steps: 1 + trace.iter().position(|r| *r > 1e-12 * reaction)?,
        settled_steps: 1 + trace.iter().rposition(|r| !within(r)).map_or(0, |i| i + 1),
        reaction,
    })
}

impl StepParams {
    /// Explicit Euler alone. The step size is a fraction of the largest one that is stable at rest.
    pub fn euler(model: &SpringModel, fraction_of_stable: f64) -> Self {
        Self {
            method: Method::Euler(EulerParams::of_stable(model, fraction_of_stable)),
            ..Self::default()
        }
    }
}
