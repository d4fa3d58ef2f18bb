//! One Newton iteration of the zone.

use std::sync::Arc;

use palpa_mesh::Vec3;

use super::super::plan::Trouble;
use super::Live;
use super::kept::Kept;
use super::report::{LiveReport, StepOutcome};
use crate::model::Model;

/// If less than this share of an iteration can be taken, it has failed.
const LEAST_SHARE: f64 = 0.05;
/// Length of an iteration that is none any more, as a multiple of the longest way that tools may go in a step: its
/// stiffness is hardly positive definite.
const WILD: f64 = 3.0;
/// A body without contact counts as still if an iteration moves its zone by no more than this, m,
/// and its residual is within this share of the tolerance.
const STILL: f64 = 1e-8;
const STILL_SHARE: f64 = 0.1;

/// The forces that are known for the present state of the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Known {
    /// None: the body or the zone has changed since forces were last evaluated.
    Nothing,
    /// The internal forces of zone and followed exterior.
    Forces,
    /// The forces are known, nothing touched the body in the last step, and the step left it
    /// unchanged. There is nothing to solve until a tool comes near.
    Still,
}

/// The kind of an iteration within a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Pass {
    /// The first one of a step, with new candidates, and with a new stiffness if the kept one is worn.
    First,
    /// The first one of a step, with all that is kept of the last.
    Follow,
    /// A later one, with a new stiffness and new candidates.
    Anew,
    /// As `Anew`, with a stiffness without the pressure of the volume, after one that led nowhere.
    Firm,
    /// A later one near equilibrium, with the factor, compliance and candidates of the previous
    /// one.
    Near,
}

impl Pass {
    /// What may lead on from where this one leads nowhere: its stiffness is of another state, or hardly positive
    /// definite.
    pub(super) fn firmer(self) -> Option<Self> {
        match self {
            Self::First | Self::Follow | Self::Near => Some(Self::Anew),
            Self::Anew => Some(Self::Firm),
            Self::Firm => None,
        }
    }
}

/// Scratch arrays of the iterations.
#[derive(Debug)]
pub(super) struct Scratch {
    /// Internal forces of the zone's prisms, N. `[n_nodes]`
    forces: Vec<Vec3>,
    /// Right side, then displacements, in the order of elimination, N or m. `[n_dofs]`
    x: Vec<f32>,
    /// Scratch of the exterior. `[n_dofs]`
    pub(super) moves: Vec<f32>,
    /// Displacements before the iteration, m. `[n_nodes]`
    before: Vec<Vec3>,
}

impl Scratch {
    pub(super) fn new(model: &Model) -> Self {
        let (n, n_dofs) = (model.n_nodes(), model.structure.n_dofs());
        Self {
            forces: vec![Vec3::zeros(); n],
            x: vec![0.0; n_dofs],
            moves: vec![0.0; n_dofs],
            before: vec![Vec3::zeros(); n],
        }
    }
}

impl Live {
    /// One Newton iteration. After an error the state must not be used any more.
    pub(super) fn iterate(
        &mut self,
        dt: f64,
        pass: Pass,
        report: &mut LiveReport,
    ) -> Result<(), Trouble> {
        let plan = Arc::clone(&self.plan);
        self.evaluate_forces(pass)?;
        self.look_outside(pass);
        let keeps_compliance = matches!(pass, Pass::Follow | Pass::Near);
        if pass == Pass::Follow {
            self.touch_again();
        }
        if keeps_compliance {
            self.measure_gaps();
        } else {
            self.find_candidates(dt);
            if let Some(residual) = self.residual_at_rest() {
                report.iterations = 0;
                report.residual = residual;
                return Ok(());
            }
            let is_firm = pass == Pass::Firm;
            if is_firm || pass == Pass::Anew || !self.keeps_factor() {
                self.refactor(is_firm, report)?;
            }
        }
        // Where the tool has moved along the skin, its pressure turns before anything else changes.
        self.problem.turn_aside();
        self.right_side();
        let x = &mut self.ws.x;
        self.inside.substitute(&plan, x);
        if !keeps_compliance {
            self.inside.comply(&plan, &self.outside, &mut self.problem);
            self.kept
                .renew_contact(self.search.covered, self.problem.has_friction);
        }
        self.inside.project(&plan, x, &mut self.problem);
        self.problem.solve(&self.course.tools);
        self.inside.push(&plan, &self.problem, x);
        self.inside.back_substitute(&plan, x);
        let share = self.advance(report)?;
        self.accept_contact(share);
        report.n_candidates = self.problem.candidates.len();
        report.n_left_out = self.search.n_left_out;
        report.n_far = self.problem.pressing().filter(|c| c.is_far).count();
        report.is_contact_settled = self.problem.is_settled;
        report.n_active = self.problem.pressing().count();
        report.residual = self.residual();
        Ok(())
    }

    /// Evaluates the internal forces if those of the last iteration are out of date: the body has
    /// changed, or its materials have memory and time has passed.
    fn evaluate_forces(&mut self, pass: Pass) -> Result<(), Trouble> {
        let is_first = matches!(pass, Pass::First | Pass::Follow);
        let has_aged = is_first && self.model.has_memory;
        if !has_aged && self.known != Known::Nothing {
            return Ok(());
        }
        self.internal_forces()?;
        self.follow()?;
        if self.known == Known::Nothing {
            self.known = Known::Forces;
        }
        Ok(())
    }

    /// Takes the step in `x`, or the largest share of it that turns no prism inside out. Returns
    /// the share.
    fn advance(&mut self, report: &mut LiveReport) -> Result<f64, Trouble> {
        for &[node, _] in &self.plan.zone {
            self.ws.before[node as usize] = self.state.displacements[node as usize];
        }
        self.beyond.is_settled = false;
        let zone = self.plan.zone.iter();
        let longest = zone.flat_map(|&[_, dof]| &self.ws.x[dof as usize..dof as usize + 3]);
        let longest = longest.fold(0.0, |most: f32, x| most.max(x.abs()));
        if f64::from(longest) <= WILD * self.params.longest_way() {
            let mut share = 1.0;
            while share >= LEAST_SHARE {
                self.take(share);
                if self.internal_forces().is_ok() {
                    return Ok(share);
                }
                share *= 0.5;
                report.outcome = StepOutcome::BackedOff;
            }
            self.take(0.0);
            self.known = Known::Nothing;
        }
        Err(Trouble::Singular)
    }

    /// Applies a share of the step in `x` to the displacements before it.
    fn take(&mut self, share: f64) {
        for &[node, dof] in &self.plan.zone {
            let step = Vec3::from_fn(|c, _| f64::from(self.ws.x[dof as usize + c]));
            let step = self.model.supports[node as usize].free_part(&step);
            self.state.displacements[node as usize] = self.ws.before[node as usize] + step * share;
        }
    }

    /// Internal forces of the zone's prisms at the present displacements.
    pub(super) fn internal_forces(&mut self) -> Result<(), Trouble> {
        let levels = self.model.body.n_levels;
        for &v in &self.plan.vertices {
            let first = v as usize * levels;
            self.ws.forces[first..first + levels].fill(Vec3::zeros());
        }
        self.inside.batches.add_forces(
            &self.model,
            &self.memory,
            &self.state.displacements,
            &mut self.ws.forces,
        )?;
        Ok(())
    }

    /// Writes the unbalanced forces, with those of the tools and reduced to the zone, into `x`.
    fn right_side(&mut self) {
        let (x, forces) = (&mut self.ws.x, &self.ws.forces);
        for &[node, dof] in &self.plan.zone {
            let node = node as usize;
            let force = self.model.supports[node].free_part(&-forces[node]);
            for c in 0..3 {
                x[dof as usize + c] = force[c] as f32;
            }
        }
        for candidate in self.problem.candidates.iter().filter(|c| !c.is_far) {
            let vertex = candidate.vertex as usize;
            let force = candidate.force();
            let dof = self.plan.tree.first_dof(vertex);
            let node = self.model.body.node(vertex, 0);
            let sum = self.model.supports[node].free_part(&(force - forces[node]));
            for c in 0..3 {
                x[dof + c] = sum[c] as f32;
            }
        }
        let displacements = &self.state.displacements;
        self.outside
            .push(&self.plan, displacements, x, &mut self.ws.moves);
        if let Some(load) = self.beyond.load() {
            let ring = x.len() - 3 * self.plan.ring.len();
            let pairs = x[ring..].iter_mut().zip(&load[ring..]);
            pairs.for_each(|(x, load)| *x += load);
        }
    }

    /// Residual of the zone without its ring: unbalanced forces relative to the tools' force.
    fn residual(&self) -> f64 {
        let levels = self.model.body.n_levels;
        let ring = self.first_ring_dof();
        let sum: f64 = self
            .plan
            .zone
            .iter()
            .filter(|n| (n[1] as usize) < ring && !(n[0] as usize).is_multiple_of(levels))
            .map(|n| self.model.supports[n[0] as usize].free_part(&self.ws.forces[n[0] as usize]))
            .map(|force| force.norm_squared())
            .sum();
        let skin: f64 = self
            .plan
            .vertices
            .iter()
            .filter(|&&v| !self.is_at_ring(v))
            .map(|&v| {
                let node = self.model.body.node(v as usize, 0);
                let pressed = self
                    .problem
                    .candidates
                    .binary_search_by_key(&v, |c| c.vertex);
                let tool = pressed.map_or(Vec3::zeros(), |i| self.problem.candidates[i].force());
                let force = tool - self.ws.forces[node];
                self.model.supports[node].free_part(&force).norm_squared()
            })
            .sum();
        (sum + skin).sqrt() / self.tools_force()
    }

    /// First unknown of the zone's ring, whose columns are eliminated last.
    pub(super) fn first_ring_dof(&self) -> usize {
        self.ws.x.len() - 3 * self.plan.ring.len()
    }

    /// The residual of a body without contact, if it has not moved.
    fn residual_at_rest(&mut self) -> Option<f64> {
        if self.known != Known::Still {
            return None;
        }
        let is_untouched = self.problem.candidates.is_empty();
        let residual = is_untouched.then(|| self.residual());
        let residual = residual.filter(|r| *r <= STILL_SHARE * self.params.tolerance);
        if residual.is_none() {
            self.known = Known::Forces;
        }
        residual
    }

    /// Whether nothing touches the body, and the last iteration moved nothing.
    pub(super) fn is_still_now(&self, report: &LiveReport) -> bool {
        let move_of = |node: u32| {
            (self.state.displacements[node as usize] - self.ws.before[node as usize]).amax()
        };
        report.n_candidates == 0
            && report.residual.max(report.outside) <= STILL_SHARE * self.params.tolerance
            && self.plan.zone.iter().all(|n| move_of(n[0]) <= STILL)
    }

    /// Whether a step with this report left nothing to do while the tools that press stay where they are.
    pub(super) fn is_settled_now(&self, report: &LiveReport) -> bool {
        report.n_candidates > 0
            && report.outcome == StepOutcome::Arrived
            && report.residual.max(report.outside) <= STILL_SHARE * self.params.tolerance
            && !self.model.has_memory
    }

    /// Marks the forces as unknown, and the factor as that of another body. Call it when the body has
    /// moved to another state or has another zone.
    pub(super) fn forget_forces(&mut self) {
        self.known = Known::Nothing;
        self.settled = None;
        self.kept = Kept::NONE;
        self.beyond.is_settled = false;
    }
}
