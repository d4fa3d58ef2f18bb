//! Recovery from failed steps: the last good state, a slower pace, and a restart from rest.

use palpa_mesh::Vec3;

use super::super::MOST_CANDIDATES;
use super::super::candidate::Candidate;
use super::Live;
use super::candidates::SkinForces;
use super::pressed::nearest_vertex;
use super::report::StepOutcome;
use crate::posed_tool::PosedTool;

/// The slowest pace.
const LEAST_PACE: f64 = 1.0 / 64.0;
/// Failed steps in a row after which a body restarts from rest. Until then it holds its last good state, whose
/// local model is right for a moment only: after 200 steps without a restart, forces were up to four times too
/// large where the tool had gone on.
const MOST_FAILED: u32 = 8;
/// Distance by which tools are lifted off a body at rest each time, m, and the largest number of
/// lifts.
const LIFT: f64 = 2e-3;
const MOST_LIFTS: usize = 100;

/// The state to return to, and the pace after that.
#[derive(Debug)]
pub(super) struct Recovery {
    /// Displacements of the last state near equilibrium, m; up to date in the zone, and everywhere
    /// if the exterior is followed. `[n_nodes]`
    displacements: Vec<Vec3>,
    /// Contact forces of that state.
    skin: SkinForces,
    /// The candidates with these forces. Those of a failed step may be of any size and sign.
    candidates: Vec<Candidate>,
    /// Tools of that state.
    tools: Vec<PosedTool>,
    /// Limit of a step's move, as a share of the longest move, 1/64 to 1.
    pub(super) pace: f64,
    /// Steps in a row that failed.
    n_failed: u32,
}

impl Recovery {
    pub(super) fn new(displacements: &[Vec3], skin: &SkinForces, tools: &[PosedTool]) -> Self {
        Self {
            displacements: displacements.to_vec(),
            skin: skin.clone(),
            candidates: Vec::with_capacity(MOST_CANDIDATES),
            tools: tools.to_vec(),
            pace: 1.0,
            n_failed: 0,
        }
    }

    /// Called after a good step.
    pub(super) fn speed_up(&mut self) {
        self.pace = (self.pace * 2.0).min(1.0);
        self.n_failed = 0;
    }

    /// Called after a rough step.
    pub(super) fn slow_down(&mut self) {
        self.pace = (self.pace * 0.5).max(LEAST_PACE);
    }
}

impl Live {
    /// Keeps the present state to return to.
    pub(super) fn keep_good(&mut self) {
        let good = &mut self.recovery;
        // A linear exterior follows from the zone.
        if self.exterior.is_followed() {
            good.displacements
                .copy_from_slice(&self.state.displacements);
        } else {
            for &[node, _] in &self.plan.zone {
                good.displacements[node as usize] = self.state.displacements[node as usize];
            }
        }
        for v in 0..self.model.body.n_vertices() {
            good.skin.copy(v, &self.skin);
        }
        good.candidates.clone_from(&self.problem.candidates);
        good.tools.copy_from_slice(&self.course.tools);
    }

    /// Called after a step that has lost the body. Returns to the last good state, or after several
    /// such steps in a row to rest. The tools are followed more slowly from there.
    pub(super) fn recover(&mut self) -> StepOutcome {
        self.recovery.n_failed += 1;
        let outcome = if self.recovery.n_failed < MOST_FAILED {
            self.return_to_good();
            // The exterior may be what it fails on.
            self.jobs.ask_for_factor();
            StepOutcome::Held
        } else {
            self.start_again();
            StepOutcome::Failed
        };
        self.recovery.pace = (self.recovery.pace * 0.25).max(LEAST_PACE);
        outcome
    }

    /// Goes back to the last good state.
    fn return_to_good(&mut self) {
        let good = &self.recovery;
        if self.exterior.is_followed() {
            self.state
                .displacements
                .copy_from_slice(&good.displacements);
        } else {
            for &[node, _] in &self.plan.zone {
                self.state.displacements[node as usize] = good.displacements[node as usize];
            }
        }
        for v in 0..self.model.body.n_vertices() {
            self.skin.copy(v, &good.skin);
        }
        self.problem.clear();
        self.problem.candidates.clone_from(&good.candidates);
        if self.problem.pressing().next().is_some() {
            self.course.tools.copy_from_slice(&good.tools);
        } else {
            // They may have been far away in the air then. The way from there to where they press now leads through the
            // body, so they come down anew.
            self.lift_tools();
        }
        self.beyond.take_back_tools();
        self.course.clearance = 0.0;
        self.springs.take_off();
        self.forget_forces();
    }

    /// Restarts from rest with the tools off the skin, because no step continues from the last good
    /// state.
    fn start_again(&mut self) {
        self.recovery.n_failed = 0;
        self.lie_down();
        self.skin.clear_all();
        self.problem.clear();
        self.springs.take_off();
        self.forget_forces();
        self.jobs.ask_for_factor();
        self.lift_tools();
        self.course.clearance = 0.0;
        self.keep_good();
    }

    /// Lifts the tools off the skin.
    fn lift_tools(&mut self) {
        let (model, displacements) = (&self.model, &self.state.displacements);
        let tools = &mut self.course.tools;
        let (_, vertex) = nearest_vertex(model, displacements, tools, None);
        let body = &model.body;
        let outward = body.positions[body.node(vertex, 0)] - body.positions[body.node(vertex, 1)];
        let step = outward.normalize() * LIFT;
        for _ in 0..MOST_LIFTS {
            let (gap, _) = nearest_vertex(model, displacements, tools, None);
            if gap > 0.0 {
                break;
            }
            for tool in tools.iter_mut() {
                tool.pose.translation.vector += step;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use palpa_mesh::generate::{Diagonal, Grid, LevelStack, mapped_grid};

    use super::super::LiveParams;
    use super::*;
    use crate::law::NeoHookean;
    use crate::shape::{Pose, Sphere, Tool};
    use crate::{Material, Materials, Model, ModelParams, Supports};

    /// A body that came to another mesh while its tool was on its way in the air may not get along with where the tool
    /// presses meanwhile. From where the tool was in the air, the way there leads through the body.
    #[test]
    fn a_tool_that_was_far_away_in_the_air_comes_down_anew_where_it_presses() {
        let grid = Grid {
            n_cells: [13, 13],
            diagonal: Diagonal::Alternate,
            jitter: None,
        };
        let levels = LevelStack {
            depths: vec![0.0, 10e-3, 20e-3],
            interval_layer: vec![0, 0],
        };
        let place = |u: f64, v: f64| Vec3::new(0.06 * (u - 0.5), 0.06 * (v - 0.5), 0.0);
        let body = mapped_grid(&grid, place, &levels);
        let law = NeoHookean::from_young(10e3, 0.45).unwrap();
        let materials = Materials::of_layers(vec![Material::new("gel", law)]);
        let supports = Supports::on_base(&body);
        let model = Model::build(&body, &materials, &supports, ModelParams::default()).unwrap();
        let tool = Tool::new(Sphere::new(8e-3).unwrap(), 0.0).unwrap();
        let at = |x: f64, z: f64| {
            let pose = Pose::translation(x, 0.0, z);
            [PosedTool { tool, pose }]
        };
        let (in_air, pressed) = (at(-12e-3, 6e-3), at(8e-3, -2e-3));
        let mut live = Live::new(Arc::new(model), &in_air, LiveParams::default()).unwrap();
        live.course.tools.copy_from_slice(&pressed);
        assert_eq!(live.recover(), StepOutcome::Held);
        let lifted = live.course.tools[0].pose.translation.vector;
        assert!((lifted.x - 8e-3).abs() < 0.5e-3, "{lifted}");
        assert!((0.0..2.5e-3).contains(&lifted.z), "{lifted}");
        // Until it is back its force is too small, and the steps say so.
        let mut n_short = 0;
        for _ in 0..30 {
            let report = live.step(&pressed, 0.002);
            let is_short = live.course.tools[0].pose != pressed[0].pose;
            assert_eq!(report.is_catching_up, is_short);
            n_short += u32::from(is_short);
            if let Some(job) = live.take_job() {
                live.install(job.run());
            }
        }
        assert!((1..10).contains(&n_short), "{n_short}");
        assert!(live.tool_force(0).z > 0.02, "{}", live.tool_force(0));
    }
}
