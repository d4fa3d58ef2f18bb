//! One step of the method: it takes the displacement of the tool and returns the force on it.
//!
//! The displacement is split into `n` parts. Each part uses the current directions of the bars,
//! ```text
//!     U'_f = −K_ff⁻¹ K_fc u_c            the free nodes follow, into equilibrium     (3.19, 3.20)
//!     ΔF   =  K_cc u_c + K_cf U'_f       the force of the increment                  (3.17, after the nodes moved)
//! ```
//! and the force on the tool is the sum of the increments along the path. If `K_ff` is singular,
//! explicit Euler (`relax`) does that part. Every part tries finite elements first, so that the
//! method returns to them by itself.

use palpa_mesh::Vec3;
use palpa_sparse::Singular;

use crate::constraints::Role;
use crate::euler::{EulerParams, euler_step};
use crate::model::SpringModel;
use crate::network::Bar;
use crate::relax::relax;
use crate::state::{Mode, SpringState, Workspace};

/// A free node that moves further than this, in multiples of the tool's displacement in one part,
/// is on a mechanism. The matrix can pass as regular all the same, because of rounding or because
/// the node's bars lie very nearly in a plane.
const MECHANISM_TRAVEL: f64 = 1e3;

/// A node has run away if it moved further than this in one step, in sizes of the body.
const RUNAWAY: f64 = 1e2;

/// Parameters of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepParams {
    /// Number of parts that the displacement is split into; 0 counts as 1.
    pub substeps: usize,
    /// Finite elements, or explicit Euler alone.
    pub method: Method,
    /// Corrections by explicit Euler at the end of a step.
    pub corrections: Corrections,
    /// The step's duration in **milliseconds**, for the literal force of (3.18). `None` leaves that
    /// force out.
    pub literal_duration_ms: Option<f64>,
}

impl Default for StepParams {
    fn default() -> Self {
        Self {
            substeps: 1,
            method: Method::FiniteElements,
            corrections: Corrections::default(),
            literal_duration_ms: None,
        }
    }
}

/// How nodes move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// The combined method: finite elements, and explicit Euler where the system is singular.
    FiniteElements,
    /// Explicit Euler alone, with which the thesis compares its method.
    Euler(EulerParams),
}

/// Gains of the corrections (3.21) and (3.22), each from 0 (off) to 1; larger values count as 1.
///
/// Both are scaled by the stiffness at the node, so that no gain in this range overshoots
/// (`relax.rs` has the proof). The pull of springs towards their natural lengths corrects the drift
/// of the incremental method and does not disturb an equilibrium. The pull towards the initial
/// shape does disturb it: a held body creeps back under the tool, by an amount that depends on the
/// number of steps. Therefore it is off by default.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corrections {
    /// Gain of the springs' pull towards their natural lengths (3.21).
    pub spring_gain: f64,
    /// Gain of the pull towards the initial shape (3.22).
    pub shape_gain: f64,
}

impl Corrections {
    /// No correction.
    pub const OFF: Self = Self {
        spring_gain: 0.0,
        shape_gain: 0.0,
    };
}

impl Default for Corrections {
    fn default() -> Self {
        Self {
            spring_gain: 1.0,
            shape_gain: 0.0,
        }
    }
}

/// How a step ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// With the requested method.
    Converged,
    /// The system was singular in some parts; explicit Euler did those.
    EulerFallback {
        /// Number of parts done by explicit Euler.
        n_substeps: usize,
    },
    /// A node ran away or its position is not a number. The state is the one before the step.
    Diverged {
        /// The first such node.
        node: usize,
    },
    /// The displacement is not finite. The state is the one before the step.
    NotFinite,
}

/// The result of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepReport {
    /// How it ended.
    pub outcome: Outcome,
    /// Force on the tool by the body, summed along the path since rest. N
    pub force: Vec3,
    /// Change of `force` in this step. N
    pub force_increment: Vec3,
    /// Force on the tool by the bars at their present lengths and directions. For small
    /// displacements it equals `force`. The difference is the error of the linear increments. N
    pub bar_force: Vec3,
    /// Largest residual force on a free node after the last part that finite elements did, divided
    /// by the largest nodal force in that part; 0 if they did no part.
    pub free_residual: f64,
    /// Largest force on a free node that is not in equilibrium, divided by the largest nodal force.
    /// It is summed along the path, and taken after the corrections, for either method.
    pub imbalance: f64,
    /// The force taken literally from (3.17) and (3.18): the reaction to this step's displacement
    /// *before* the free nodes moved, divided by the duration in ms. For comparison only; never
    /// send it to a device. N/ms
    pub literal_force: Option<Vec3>,
}

/// Moves the operated nodes by `displacement` (m); the body follows.
///
/// The state always stays finite: a step that diverges leaves the state unchanged, and the report
/// says so.
///
/// # Panics
/// If `state` or `ws` belong to another model.
pub fn step(
    model: &SpringModel,
    state: &mut SpringState,
    ws: &mut Workspace,
    displacement: Vec3,
    params: &StepParams,
) -> StepReport {
    assert_eq!(
        state.positions.len(),
        model.n_nodes(),
        "a state of another model"
    );
    assert_eq!(
        ws.increments.len(),
        model.n_nodes(),
        "a workspace of another model"
    );
    ws.saved.copy_from(state);
    let mut free_residual = 0.0;
    let mut literal = Vec3::zeros();
    let outcome = if displacement.iter().all(|x| x.is_finite()) {
        let (residual, f1) = (&mut free_residual, &mut literal);
        advance(model, state, ws, displacement, params, residual, f1)
    } else {
        Outcome::NotFinite
    };
    if matches!(outcome, Outcome::Diverged { .. } | Outcome::NotFinite) {
        state.copy_from(&ws.saved);
    } else {
        state.displacement += displacement;
    }
    StepReport {
        outcome,
        force: state.force,
        force_increment: state.force - ws.saved.force,
        bar_force: bar_force(model, &state.positions),
        free_residual,
        imbalance: residual_of_free_nodes(model, &state.node_forces),
        literal_force: params.literal_duration_ms.map(|dt| -literal / dt),
    }
}

fn advance(
    model: &SpringModel,
    state: &mut SpringState,
    ws: &mut Workspace,
    displacement: Vec3,
    params: &StepParams,
    free_residual: &mut f64,
    literal: &mut Vec3,
) -> Outcome {
    // If the tool is at rest, finite elements would move nothing. Only the corrections continue.
    let is_resting = displacement == Vec3::zeros() && params.method == Method::FiniteElements;
    let n = if is_resting {
        0
    } else {
        params.substeps.max(1)
    };
    let part = displacement / n.max(1) as f64;
    let mut n_fallbacks = 0;
    for _ in 0..n {
        match params.method {
            Method::Euler(euler) => {
                euler_step(model, state, ws, part, euler);
            }
            Method::FiniteElements => {
                if finite_elements(model, state, ws, part, literal).is_ok() {
                    *free_residual = residual_of_free_nodes(model, &ws.forces);
                    commit(model, state, ws);
                    state.mode = Mode::FiniteElements;
                } else {
                    n_fallbacks += 1;
                    push_through(model, state, ws, part);
                    commit(model, state, ws);
                    let springs = Corrections {
                        spring_gain: 1.0,
                        ..params.corrections
                    };
                    relax(model, state, ws, &springs);
                    commit(model, state, ws);
                    state.mode = Mode::Euler;
                }
            }
        }
        if let Some(node) = runaway(model, &state.positions, &ws.saved.positions) {
            return Outcome::Diverged { node };
        }
    }
    let is_corrected = params.corrections != Corrections::OFF;
    if params.method == Method::FiniteElements && is_corrected {
        relax(model, state, ws, &params.corrections);
        commit(model, state, ws);
    }
    if n_fallbacks > 0 {
        Outcome::EulerFallback {
            n_substeps: n_fallbacks,
        }
    } else {
        Outcome::Converged
    }
}

/// Solves one part and writes the results to `ws.increments` and `ws.forces`. Adds the part's
/// literal force (3.17) to `literal`.
fn finite_elements(
    model: &SpringModel,
    state: &SpringState,
    ws: &mut Workspace,
    part: Vec3,
    literal: &mut Vec3,
) -> Result<(), Singular> {
    ws.system.update_directions(&model.bars, &state.positions);
    ws.system
        .refactor(&model.structure, &model.bars, &model.freedoms)?;
    move_operated(model, ws, part);
    // M1 u_c: all operated nodes have the same displacement, so only bars with one operated end are
    // stretched.
    ws.forces.fill(Vec3::zeros());
    let mut f1 = Vec3::zeros();
    for &(i, a_is_operated) in &model.operated_bars {
        let (bar, c) = (&model.bars[i], &ws.system.directions[i]);
        let pull = c * (bar.stiffness * c.dot(&part));
        let other = if a_is_operated { bar.b } else { bar.a };
        ws.forces[other as usize] -= pull;
        f1 += pull;
    }
    ws.system.solve(
        &model.structure,
        &model.freedoms,
        &ws.forces,
        &mut ws.increments,
    );

    let limit = MECHANISM_TRAVEL * part.norm();
    // Written so that NaN exceeds the limit.
    let stays = |u: &Vec3| u.norm() <= limit;
    if !ws.increments.iter().all(stays) {
        return Err(Singular);
    }
    *literal += f1;
    nodal_forces(
        &model.bars,
        &ws.system.directions,
        &ws.increments,
        &mut ws.forces,
    );
    Ok(())
}

/// Moves only the operated nodes. Their bars are stretched, and the free nodes do not follow yet.
fn push_through(model: &SpringModel, state: &SpringState, ws: &mut Workspace, part: Vec3) {
    ws.system.update_directions(&model.bars, &state.positions);
    move_operated(model, ws, part);
    nodal_forces(
        &model.bars,
        &ws.system.directions,
        &ws.increments,
        &mut ws.forces,
    );
}

pub(crate) fn move_operated(model: &SpringModel, ws: &mut Workspace, part: Vec3) {
    ws.increments.fill(Vec3::zeros());
    for &node in &model.operated {
        ws.increments[node] = part;
    }
}

/// `M1 U`: the nodal forces of the increments.
pub(crate) fn nodal_forces(
    bars: &[Bar],
    directions: &[Vec3],
    increments: &[Vec3],
    forces: &mut [Vec3],
) {
    forces.fill(Vec3::zeros());
    for (bar, c) in bars.iter().zip(directions) {
        let (a, b) = (bar.a as usize, bar.b as usize);
        let tension = bar.stiffness * c.dot(&(increments[b] - increments[a]));
        let pull = c * tension;
        forces[a] -= pull;
        forces[b] += pull;
    }
}

/// Adds the increments to the state, and their forces to the sums along the path.
pub(crate) fn commit(model: &SpringModel, state: &mut SpringState, ws: &Workspace) {
    for (p, u) in state.positions.iter_mut().zip(&ws.increments) {
        *p += u;
    }
    for (sum, f) in state.node_forces.iter_mut().zip(&ws.forces) {
        *sum += f;
    }
    for &node in &model.operated {
        state.force -= ws.forces[node];
    }
}

/// Force on the tool by the bars at their present lengths and directions.
pub(crate) fn bar_force(model: &SpringModel, positions: &[Vec3]) -> Vec3 {
    let mut force = Vec3::zeros();
    for &(i, a_is_operated) in &model.operated_bars {
        let bar = &model.bars[i];
        let d = positions[bar.b as usize] - positions[bar.a as usize];
        let length = d.norm();
        if length > 0.0 {
            let pull = d * (bar.stiffness * (length - bar.length) / length);
            force += if a_is_operated { pull } else { -pull };
        }
    }
    force
}

fn residual_of_free_nodes(model: &SpringModel, forces: &[Vec3]) -> f64 {
    let (mut left, mut largest) = (0.0_f64, 0.0_f64);
    for (freedom, force) in model.freedoms.iter().zip(forces) {
        largest = largest.max(force.norm());
        if freedom.role == Role::Free {
            left = left.max(freedom.project(force).norm());
        }
    }
    if largest > 0.0 { left / largest } else { 0.0 }
}

fn runaway(model: &SpringModel, now: &[Vec3], before: &[Vec3]) -> Option<usize> {
    let limit = RUNAWAY * model.size;
    let stays = |(p, q): (&Vec3, &Vec3)| (p - q).norm() <= limit;
    now.iter().zip(before).position(|pair| !stays(pair))
}
