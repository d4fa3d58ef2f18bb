//! One run of a press at one speed, sample by sample.

use palpa_fem::{
    Dynamics, Load, Outcome, PosedTool, PrismField, SolveParams, State, StepReport, Workspace,
    advance, equilibrate, prism_fields,
};
use palpa_mesh::Vec3;

use super::sample::{Failure, Sample, SampleOutcome};
use super::{Grip, Indentation};
use crate::press::{Phase, Waypoint, tidy};

/// Tolerance of the force balance of a body at rest, relative to the force that counts as zero:
/// only rounding is left.
const REST_TOLERANCE: f64 = 1e-3;

/// The state of a run at one speed.
#[derive(Debug)]
pub struct Run<'a> {
    pub(super) indentation: &'a Indentation,
    /// Number of the speed.
    pub index: usize,
    /// The body's state.
    pub state: State,
    /// Memory of the solver, reused between steps.
    pub workspace: Workspace,
    /// State of every prism at the last sample that converged. `[n_prisms]`
    pub fields: Vec<PrismField>,
    pub(super) path: Vec<Waypoint>,
    pub(super) next: usize,
    /// The load of the previous sample.
    pub(super) before: Acting,
    pub(super) earlier: Earlier,
    pub(super) time: f64,
    pub(super) last: Option<Sample>,
    /// Reason why the run ended early, if it did.
    pub failure: Option<Failure>,
}

/// The load at one moment: tools and held nodes.
#[derive(Debug, Clone, Default)]
pub(super) struct Acting {
    pub(super) tools: Vec<PosedTool>,
    pub(super) held: Vec<(usize, Vec3)>,
}

/// Displacements at the last samples of one phase, newest first, for extrapolation along a
/// parabola. Newton's method then starts where it would otherwise be after its first iteration,
/// which saves that iteration.
#[derive(Debug, Default)]
pub(super) struct Earlier {
    phase: Option<Phase>,
    displacements: Vec<Vec<Vec3>>,
}

impl Earlier {
    fn note(&mut self, phase: Phase, displacements: &[Vec3]) {
        if self.phase != Some(phase) {
            // The last sample of one phase is the first of the next.
            self.displacements.truncate(1);
            self.phase = Some(phase);
        }
        self.displacements.truncate(2);
        self.displacements.insert(0, displacements.to_vec());
    }

    /// Extrapolated node displacements at the next sample, from three or two samples at equal
    /// distances.
    fn guess(&self, phase: Phase) -> Option<Vec<Vec3>> {
        if self.phase != Some(phase) {
            return None;
        }
        match &self.displacements[..] {
            [a, b, c, ..] => Some(
                (a.iter().zip(b).zip(c))
                    .map(|((a, b), c)| a * 3.0 - b * 3.0 + c)
                    .collect(),
            ),
            [a, b] => Some(a.iter().zip(b).map(|(a, b)| a * 2.0 - b).collect()),
            _ => None,
        }
    }
}

impl Acting {
    pub(super) fn load(&self, duration: f64, dynamics: Option<Dynamics>) -> Load<'_> {
        Load {
            tools: &self.tools,
            held: &self.held,
            duration,
            dynamics,
            ..Load::default()
        }
    }
}

impl Run<'_> {
    /// Computes the next sample; `None` at the end. A sample that did not converge is the last.
    pub fn advance(&mut self) -> Option<Sample> {
        let indentation = self.indentation;
        let waypoint = *self.path.get(self.next)?;
        let acting = indentation.acting(waypoint.depth);
        let report = self.solve(&waypoint, &acting);
        self.earlier.note(waypoint.phase, &self.state.displacements);
        let speed_mm_s = tidy(indentation.speeds[self.index] * 1e3);
        let depth_mm = tidy(waypoint.depth * 1e3);
        let outcome = report.outcome;
        if outcome == Outcome::Converged || self.last.is_none() {
            self.fields = prism_fields(&indentation.model, &self.state, &self.workspace);
        }
        let sample = if outcome == Outcome::Converged {
            self.before = acting;
            self.next += 1;
            self.measured(&waypoint, &report)
        } else {
            self.next = self.path.len();
            self.failure = Some(Failure {
                speed_mm_s,
                depth_mm,
                outcome,
            });
            let unmoved = || self.measured(&waypoint, &report);
            self.last.clone().unwrap_or_else(unmoved)
        };
        self.time = waypoint.time;
        let sample = Sample {
            iterations: report.iterations,
            substeps: report.substeps,
            residual: report.residual,
            phase: waypoint.phase,
            cycle: waypoint.cycle,
            time_s: tidy(waypoint.time),
            depth_mm,
            outcome: SampleOutcome::from(&outcome),
            ..sample
        };
        self.last = Some(sample.clone());
        Some(sample)
    }

    /// Moves the tool to a waypoint and solves for equilibrium, first from an extrapolated guess.
    fn solve(&mut self, waypoint: &Waypoint, acting: &Acting) -> StepReport {
        let indentation = self.indentation;
        let (before, load) = (
            self.before.load(0.0, None),
            acting.load(waypoint.time - self.time, indentation.dynamics),
        );
        let (model, params) = (&*indentation.model, &indentation.params);
        let has_memory = indentation.is_viscous || indentation.dynamics.is_some();
        if waypoint.depth == 0.0 && (self.next == 0 || !has_memory) {
            // The body is at rest and may bear no force at all, so a tolerance relative to its
            // forces would not work.
            let saved = std::mem::replace(&mut self.state, indentation.rest.clone());
            let tolerance = if indentation.prepared.is_tense() {
                params.tolerance
            } else {
                REST_TOLERANCE
            };
            let params = SolveParams {
                tolerance,
                ..*params
            };
            let workspace = &mut self.workspace;
            let report = equilibrate(model, &mut self.state, workspace, &load, &params);
            if report.outcome == Outcome::Converged {
                return report;
            }
            self.state = saved;
        }
        // Friction remembers the way, and so does inertia.
        let remembers = indentation.dynamics.is_some()
            || acting.tools.iter().any(|tool| tool.tool.friction() > 0.0);
        let guess = (self.earlier.guess(waypoint.phase)).filter(|_| !remembers);
        if let Some(guess) = guess {
            let saved = self.state.clone();
            self.state.displacements = guess;
            let workspace = &mut self.workspace;
            let report = equilibrate(model, &mut self.state, workspace, &load, params);
            if report.outcome == Outcome::Converged {
                return report;
            }
            self.state = saved;
        }
        let workspace = &mut self.workspace;
        advance(model, &mut self.state, workspace, &before, &load, params)
    }

    /// The results of a step, in the units of the table.
    fn measured(&self, waypoint: &Waypoint, report: &StepReport) -> Sample {
        let indentation = self.indentation;
        let direction = &indentation.place().direction;
        let (pull, area, n_touching) = match &indentation.grip {
            Grip::Bond { nodes, areas } => (report.held_force, areas.iter().sum(), nodes.len()),
            Grip::Contact(_) => {
                let touching = self.state.touches.iter().filter(|t| t.tool().is_some());
                let n_touching = touching.count();
                (report.tool_forces[0], report.tool_areas[0], n_touching)
            }
        };
        let max_pressure = match &indentation.grip {
            Grip::Bond { areas, .. } if areas.iter().all(|&area| area == 0.0) => None,
            _ => Some((indentation.skin_pressure(self).into_iter()).fold(0.0, f64::max)),
        };
        let ratios = self.fields.iter().map(|field| field.volume_ratio);
        let contact = &report.contact;
        // Adding zero turns -0 into 0.
        let force_n = -pull.dot(direction) + 0.0;
        let depth_mm = waypoint.depth * 1e3;
        let work_mj = self.last.as_ref().map_or(0.0, |last| {
            last.work_mj + 0.5 * (last.force_n + force_n) * (depth_mm - last.depth_mm)
        });
        Sample {
            run: self.index,
            speed_mm_s: tidy(indentation.speeds[self.index] * 1e3),
            phase: waypoint.phase,
            cycle: waypoint.cycle,
            time_s: waypoint.time,
            depth_mm,
            force_n,
            force_x_n: pull.x,
            force_y_n: pull.y,
            force_z_n: pull.z,
            contact_area_mm2: area * 1e6 + 0.0,
            max_pressure_kpa: max_pressure.map(|p| p * 1e-3),
            n_touching,
            penetration_um: contact.penetration * 1e6,
            contact_mismatch: contact.mismatch,
            residual: report.residual,
            iterations: report.iterations,
            substeps: report.substeps,
            outcome: SampleOutcome::Converged,
            energy_mj: report.energy * 1e3,
            work_mj,
            volume_ratio_min: ratios.clone().fold(f64::INFINITY, f64::min),
            volume_ratio_max: ratios.fold(0.0, f64::max),
            error_bar_n: None,
            extrapolated_n: None,
            error_near_n: None,
            error_skin_far_n: None,
            error_levels_deep_n: None,
            error_contact_n: None,
            error_load_step_n: None,
            layer_thickness_mm: (indentation.thicknesses(&self.state).iter())
                .map(|t| t * 1e3)
                .collect(),
        }
    }
}
