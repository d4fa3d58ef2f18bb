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
/// A tool with friction goes at most this far in a substep, as a share of the radius of contact:
/// towards the skin, since a vertex is held where it first touches, and along it.
const TOWARDS: f64 = 0.06;
const ALONG: f64 = 0.25;
/// Number of Newton iterations up to which the next substep may be longer.
const EASY: usize = 8;

/// Sums and maxima over the substeps of a step.
#[derive(Default)]
struct Spent {
    iterations: usize,
    substeps: usize,
    shift: f64,
}

impl Spent {
    fn add(&mut self, report: &StepReport) {
        self.iterations += report.iterations;
        self.substeps += 1;
        self.shift = self.shift.max(report.shift);
    }

    /// The report of the last substep, extended to the whole step.
    fn report(&self, last: StepReport) -> StepReport {
        StepReport {
            iterations: self.iterations,
            substeps: self.substeps,
            shift: self.shift,
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
    let starts = starts(model, state, before.tools, load.tools);
    let before = &Load {
        tools: &starts,
        ..before.clone()
    };
    let (mut done, mut size) = (0.0_f64, 1.0_f64);
    let mut spent = Spent::default();
    loop {
        let longest = friction_limit(model, state, before, load, done);
        let share = (done + size.min(longest)).min(1.0);
        let saved = (done > 0.0).then(|| state.clone());
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
                size = (2.0 * size).min(1.0);
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

/// The tools at the start of a step. A tool that was nowhere comes along its axis from where it first
/// touches.
fn starts(
    model: &Model,
    state: &State,
    before: &[PosedTool],
    after: &[PosedTool],
) -> Vec<PosedTool> {
    const MOST_SHIFTS: usize = 50;
    let mut starts = before.to_vec();
    for tool in after.iter().skip(before.len()) {
        let mut start = *tool;
        let axis = start.pose.rotation * Vec3::z();
        for _ in 0..MOST_SHIFTS {
            let gaps = (0..state.touches.len()).map(|v| {
                let node = model.body.node(v, 0);
                let x = model.body.positions[node] + state.displacements[node];
                start.tool.distance_at(&start.pose, &x).distance
            });
            let least = gaps.fold(f64::INFINITY, f64::min);
            if least >= 0.0 {
                break;
            }
            start.pose.translation.vector -= axis * least.min(-1e-6);
        }
        starts.push(start);
    }
    starts
}

/// The share of a step that tools with friction may go in one substep.
fn friction_limit(
    model: &Model,
    state: &State,
    before: &Load<'_>,
    load: &Load<'_>,
    done: f64,
) -> f64 {
    let mut limit = f64::INFINITY;
    for (k, (from, to)) in before.tools.iter().zip(load.tools).enumerate() {
        if to.tool.friction() == 0.0 {
            continue;
        }
        let now = &between(&[*from], &[*to], done)[0];
        let (mut area, mut along, mut clearance) = (0.0, Vec3::zeros(), f64::INFINITY);
        let mut least_area = f64::INFINITY;
        for (v, touch) in state.touches.iter().enumerate() {
            let node = model.body.node(v, 0);
            let x = model.body.positions[node] + state.displacements[node];
            let distance = now.tool.distance_at(&now.pose, &x);
            if distance.distance < clearance {
                clearance = distance.distance;
                least_area = model.skin_areas[v];
            }
            if touch.tool() == Some(k) {
                area += model.skin_areas[v];
                along += distance.normal * (touch.pressure * model.skin_areas[v]);
            }
        }
        let radius = (area.max(least_area) / std::f64::consts::PI).sqrt();
        let way = to.pose.translation.vector - from.pose.translation.vector;
        let turned = (from.pose.rotation.inverse() * to.pose.rotation).angle() * radius;
        let towards = along
            .try_normalize(0.0)
            .map_or(way.norm(), |n| way.dot(&n).abs());
        let aside = (way.norm_squared() - towards.powi(2)).max(0.0).sqrt() + turned;
        let share = (TOWARDS * radius / towards).min(ALONG * radius / aside);
        // Until it touches, it may go.
        limit = limit.min(share + clearance.max(0.0) / way.norm().max(f64::MIN_POSITIVE));
    }
    limit.max(LEAST_SUBSTEP)
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
        tools_before: &between(before.tools, load.tools, done),
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
