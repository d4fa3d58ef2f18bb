//! One step: the tools move, the body follows, and the result is judged.

use super::super::plan::Trouble;
use super::iteration::{Known, Pass};
use super::report::{LiveReport, StepOutcome};
use super::{ExteriorState, Live};
use crate::posed_tool::PosedTool;

/// Residual above which tools are followed more slowly, as a share of the tools' force.
pub(super) const ROUGH: f64 = 0.1;
/// Residual above which a step has lost the body, as a share of the tools' force.
const LOST: f64 = 0.6;

/// Share of the tools' force on the zone's ring above which the next zone is late. In strokes with slow jobs, the
/// force was up to 2.3 % off with less, and 5 % with a third.
const MOST_AT_RING: f64 = 0.25;

/// Tools that stay within this distance of where they were, m, have not moved; the force of a fingertip changes by less
/// than a millinewton there. A hand that holds still stays within it, but never at exactly the same place.
const SAME_PLACE: f64 = 1e-6;
/// The same for their turns: sine of the angle, for tools of some centimetres.
const SAME_TURN: f64 = 3e-5;

/// The verdict on a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Verdict {
    /// Near equilibrium.
    Good,
    /// Good enough to continue from, but not to return to or to render.
    Rough,
    /// Not usable.
    Lost,
}

/// Whether a tool has not moved, for the force on it.
fn is_same_place(at: &PosedTool, now: &PosedTool) -> bool {
    let way = now.pose.translation.vector - at.pose.translation.vector;
    let turn = at.pose.rotation.rotation_to(&now.pose.rotation);
    at.tool == now.tool && way.norm() <= SAME_PLACE && 2.0 * turn.imag().norm() <= SAME_TURN
}

impl Live {
    /// Follows the tools to their new poses. Their number must be that of [`Live::new`]. `dt` is
    /// the time since the last step, s.
    pub fn step(&mut self, tools: &[PosedTool], dt: f64) -> LiveReport {
        if let Some(settled) = self.settled_under(tools) {
            self.course.pace.go_on(tools, dt);
            self.jobs.grow_older(dt);
            self.ask(dt);
            return settled;
        }
        let mut report = self.begin_step(tools, dt);
        self.iterations(dt, &mut report);
        self.refine(dt, &mut report);
        let verdict = self.judge(&mut report);
        if verdict != Verdict::Lost {
            self.end_contact();
        }
        match verdict {
            Verdict::Good => {
                self.recovery.speed_up();
                self.keep_good();
                if self.ring_share() > MOST_AT_RING && report.outcome == StepOutcome::Arrived {
                    report.outcome = StepOutcome::Behind;
                }
                if self.is_still_now(&report) {
                    self.known = Known::Still;
                }
            }
            Verdict::Rough => {
                report.outcome = StepOutcome::BackedOff;
                self.recovery.slow_down();
            }
            Verdict::Lost => {
                report.outcome = self.recover();
            }
        }
        if verdict != Verdict::Lost {
            self.commit_memory(dt);
        }
        self.settled = (verdict == Verdict::Good && self.is_settled_now(&report)).then_some(report);
        self.ask(dt);
        report
    }

    /// The report of a step in which nothing happens: the tools press where the body was left in equilibrium with
    /// them, to within [`SAME_PLACE`].
    fn settled_under(&self, tools: &[PosedTool]) -> Option<LiveReport> {
        let settled = self.settled?;
        let mut pairs = self.course.tools.iter().zip(tools);
        if !pairs.all(|(at, now)| is_same_place(at, now)) {
            return None;
        }
        Some(LiveReport {
            iterations: 0,
            n_factors: 0,
            ..settled
        })
    }

    /// Moves the tools, and updates viscous materials for the duration of the step.
    fn begin_step(&mut self, tools: &[PosedTool], dt: f64) -> LiveReport {
        self.problem.tools_before.clear();
        self.problem
            .tools_before
            .extend_from_slice(&self.course.tools);
        self.note_origins();
        let is_short = self.move_tools(tools, dt);
        self.jobs.grow_older(dt);
        self.problem.has_friction = tools.iter().any(|t| t.tool.friction() > 0.0);
        if self.model.has_memory {
            let (model, state) = (&*self.model, &self.state);
            self.memory.begin_materials(model, dt);
            self.inside.batches.begin(model, &mut self.memory, state);
            if let Some(follower) = self.exterior.follower_mut() {
                follower.batches.begin(model, &mut self.memory, state);
            }
        }
        LiveReport {
            outcome: if is_short {
                StepOutcome::Behind
            } else {
                StepOutcome::Arrived
            },
            iterations: 0,
            n_factors: 0,
            residual: 0.0,
            outside: 0.0,
            n_active: 0,
            n_candidates: 0,
            n_left_out: 0,
            n_far: 0,
            is_contact_settled: true,
            n_raised: 0,
            is_altered: false,
            is_catching_up: self.beyond.is_catching_up(is_short),
            spring: 0.0,
            zone: self.plan.id,
            factor: self.outside.id,
        }
    }

    /// Runs Newton iterations until the zone is in balance or the limit is reached.
    fn iterations(&mut self, dt: f64, report: &mut LiveReport) {
        let mut before = f64::INFINITY;
        let mut firmer = None;
        while report.iterations < self.params.max_iterations {
            let pass = match firmer.take() {
                Some(pass) => pass,
                None if report.iterations == 0 => self.first_pass(),
                None => {
                    let left = self.params.max_iterations - report.iterations;
                    self.next_pass(report.residual, before, left)
                }
            };
            before = if report.iterations == 0 {
                f64::INFINITY
            } else {
                report.residual
            };
            report.iterations += 1;
            match self.iterate(dt, pass, report) {
                Ok(()) if report.residual <= self.params.tolerance => break,
                Ok(()) => {}
                Err(trouble) => {
                    firmer = pass.firmer().filter(|_| trouble == Trouble::Singular);
                    if firmer.is_none() || report.iterations == self.params.max_iterations {
                        report.outcome = StepOutcome::Failed;
                        break;
                    }
                }
            }
        }
    }

    /// If the last stiffness of the step had to be altered, takes one more iteration: near equilibrium it is mostly
    /// positive definite again. Else the local model could be much too stiff, five times for a ball over thin fat.
    fn refine(&mut self, dt: f64, report: &mut LiveReport) {
        let is_near = report.outcome != StepOutcome::Failed && report.residual <= ROUGH;
        if !(is_near && self.kept.is_altered()) {
            return;
        }
        report.iterations += 1;
        if self.iterate(dt, Pass::Anew, report).is_err() {
            report.outcome = StepOutcome::Failed;
        }
        report.is_altered = self.kept.is_altered();
    }

    /// Updates a followed exterior, unless the zone is lost already, and judges both.
    fn judge(&mut self, report: &mut LiveReport) -> Verdict {
        let is_lost = |residual: f64| residual.is_nan() || residual > LOST;
        // If the zone is lost, the step returns to a state with a known exterior.
        if report.outcome == StepOutcome::Failed || is_lost(report.residual) {
            return Verdict::Lost;
        }
        let has_failed = self.known != Known::Still && self.bring_exterior().is_err();
        report.outside = self.exterior.residual() / self.tools_force();
        if has_failed || is_lost(report.outside) {
            return Verdict::Lost;
        }
        let is_far = report.residual.max(report.outside) > ROUGH;
        if is_far || !report.is_contact_settled {
            Verdict::Rough
        } else {
            Verdict::Good
        }
    }

    /// Updates the memory of viscous materials at the end of the step.
    fn commit_memory(&mut self, dt: f64) {
        if !self.model.has_memory {
            return;
        }
        let (model, memory) = (&*self.model, &self.memory);
        self.inside.batches.commit(model, memory, &mut self.state);
        match &mut self.exterior {
            ExteriorState::Followed { follower, .. } => {
                follower.batches.commit(model, memory, &mut self.state);
            }
            ExteriorState::Linear { .. } => self.exterior.age(dt),
        }
    }
}
