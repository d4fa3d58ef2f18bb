//! Adaptive load steps: a step that does not converge is divided.

use palpa_mesh::Vec3;

use super::equilibrate;
use super::load::{Load, SolveParams};
use super::report::{Outcome, StepReport};
use super::workspace::Workspace;
use crate::model::Model;
use crate::posed_tool::PosedTool;
use crate::shape::Pose;
use crate::state::State;

/// Least share of a load step; below it, halving is given up.
const LEAST_SUBSTEP: f64 = 1.0 / 128.0;
/// A failing step is given up after this multiple of the iterations of one solve.
const MOST_SOLVES: usize = 10;
/// Number of Newton iterations up to which the next substep may be longer.
const EASY: usize = 8;

/// Sums and maxima over the substeps of a step.
#[derive(Default)]
struct Spent {
    iterations: usize,
    substeps: usize,
    shift: f64,
    smoothing: f64,
}

impl Spent {
    fn add(&mut self, report: &StepReport) {
        self.iterations += report.iterations;
        self.substeps += 1;
        self.shift = self.shift.max(report.shift);
        self.smoothing = self.smoothing.max(report.friction_smoothing);
    }

    /// The report of the last substep, extended to the whole step.
    fn report(&self, last: StepReport) -> StepReport {
        StepReport {
            iterations: self.iterations,
            substeps: self.substeps,
            shift: self.shift,
            friction_smoothing: self.smoothing,
            ..last
        }
    }
}

/// Brings the body to equilibrium under `load`, in as many substeps as needed. `before` has the
/// tools at the start of the step.
///
/// A failed step leaves the state unchanged; the report says where it failed.
pub fn advance(
    model: &Model,
    state: &mut State,
    ws: &mut Workspace,
    before: &Load<'_>,
    load: &Load<'_>,
    params: &SolveParams,
) -> StepReport {
    let start = state.clone();
    let (mut done, mut size) = (0.0_f64, 1.0_f64);
    let mut spent = Spent::default();
    loop {
        let share = (done + size).min(1.0);
        let saved = (size < 1.0).then(|| state.clone());
        let report = substep(
            model,
            state,
            ws,
            &start,
            [before, load],
            [done, share],
            params,
        );
        spent.add(&report);
        if report.outcome == Outcome::Converged {
            done = share;
            if done >= 1.0 {
                return spent.report(report);
            }
            if report.iterations <= EASY {
                size *= 2.0;
            }
        } else {
            // No equilibrium is found from here: go back to the last good state, and try half the
            // distance.
            if let Some(saved) = saved {
                *state = saved;
            } else {
                state.clone_from(&start);
            }
            size *= 0.5;
            if size < LEAST_SUBSTEP || spent.iterations > MOST_SOLVES * params.max_iterations {
                *state = start;
                return spent.report(report);
            }
        }
    }
}

/// Solves one part of a step, given by its start and end as shares of the step.
fn substep(
    model: &Model,
    state: &mut State,
    ws: &mut Workspace,
    start: &State,
    [before, load]: [&Load<'_>; 2],
    [done, share]: [f64; 2],
    params: &SolveParams,
) -> StepReport {
    let part = Load {
        tools: &between(before.tools, load.tools, share),
        held: &held_between(start, load.held, share),
        guided: &guided_between(start, load.guided, share),
        forces: &forces_between(before.forces, load.forces, share),
        duration: load.duration * (share - done),
        dynamics: load.dynamics,
    };
    equilibrate(model, state, ws, &part, params)
}

/// Poses interpolated between two lists of tools.
fn between(before: &[PosedTool], after: &[PosedTool], share: f64) -> Vec<PosedTool> {
    after
        .iter()
        .enumerate()
        .map(|(k, tool)| match before.get(k) {
            Some(from) if share < 1.0 => {
                let (a, b) = (&from.pose, &tool.pose);
                let translation = a.translation.vector.lerp(&b.translation.vector, share);
                let rotation = a.rotation.slerp(&b.rotation, share);
                PosedTool {
                    tool: tool.tool,
                    pose: Pose::from_parts(translation.into(), rotation),
                }
            }
            _ => *tool,
        })
        .collect()
}

fn held_between(start: &State, held: &[(usize, Vec3)], share: f64) -> Vec<(usize, Vec3)> {
    held.iter()
        .map(|&(node, target)| {
            let from = start.displacements[node];
            let target = if share < 1.0 {
                from.lerp(&target, share)
            } else {
                target
            };
            (node, target)
        })
        .collect()
}

fn guided_between(
    start: &State,
    guided: &[(usize, Vec3, f64)],
    share: f64,
) -> Vec<(usize, Vec3, f64)> {
    guided
        .iter()
        .map(|&(node, direction, target)| {
            let from = start.displacements[node].dot(&direction);
            (node, direction, from + (target - from) * share)
        })
        .collect()
}

fn forces_between(before: &[Vec3], after: &[Vec3], share: f64) -> Vec<Vec3> {
    after
        .iter()
        .enumerate()
        .map(|(node, force)| {
            let from = before.get(node).copied().unwrap_or_else(Vec3::zeros);
            from.lerp(force, share)
        })
        .collect()
}
