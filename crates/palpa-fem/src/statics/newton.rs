//! Newton's method with a line search, for tools, holds and forces that do not move.

use std::ops::ControlFlow;

use palpa_mesh::Vec3;

use super::load::{Load, SolveParams};
use super::report::{Outcome, StepReport};
use super::workspace::Workspace;
use crate::assembly::Inverted;
use crate::dynamics::Inertia;
use crate::model::Model;
use crate::state::State;
use crate::system::Hold;

/// Number of iterations without progress after which a solve is given up, and the ratio to the best
/// residual so far that counts as progress.
const PATIENCE: usize = 12;
const PROGRESS: f64 = 0.7;
/// Residual that is accepted if it falls no further: a body about to buckle can be factored only
/// with a shift, and then converges ever more slowly.
const STALLED: f64 = 1e-6;
/// First stiffness of the springs that hold pressed vertices in a factor that is not positive definite
/// without, as a share of the skin's own; growth factor; largest value. Each new factor tries softer
/// ones.
const FIRST_SPRING: f64 = 0.1;
const SPRING_GROWTH: f64 = 4.0;
const MOST_SPRING: f64 = 100.0;

/// One solve, without dividing the step. The state is not restored if the solve fails.
pub fn equilibrate(
    model: &Model,
    state: &mut State,
    ws: &mut Workspace,
    load: &Load<'_>,
    params: &SolveParams,
) -> StepReport {
    // In rayon's pool, whose threads share the work at once.
    rayon::scope(|_| equilibrate_in_pool(model, state, ws, load, params))
}

fn equilibrate_in_pool(
    model: &Model,
    state: &mut State,
    ws: &mut Workspace,
    load: &Load<'_>,
    params: &SolveParams,
) -> StepReport {
    let mut newton = Newton::begin(model, state, ws, load, params);
    let outcome = newton.run(state, ws);
    if outcome == Outcome::Converged {
        ws.memory.commit(model, state);
        (ws.contacts).end(model, &state.displacements, load.tools, &mut state.touches);
        if let Some(inertia) = &newton.inertia {
            inertia.commit(state);
        }
        if load.duration.is_finite() {
            state.time += load.duration;
        }
    }
    newton.report(ws, state, outcome)
}

/// The state of one solve.
pub(super) struct Newton<'a> {
    pub(super) model: &'a Model,
    pub(super) load: &'a Load<'a>,
    pub(super) inertia: Option<Inertia>,
    pub(super) params: &'a SolveParams,
    /// Newton iterations so far.
    pub(super) iterations: usize,
    /// Largest shift of the stiffness so far, relative to its diagonal.
    pub(super) shift: f64,
    /// Residual: unbalanced forces relative to the forces that hold the body.
    pub(super) residual: f64,
    /// What the multipliers of contact lack, relative to the same forces.
    pub(super) mismatch: f64,
}

/// The smallest residual so far, and its iteration.
struct Best {
    residual: f64,
    iteration: usize,
}

impl<'a> Newton<'a> {
    /// Prepares a solve: memory, contacts, inertia, and supports.
    fn begin(
        model: &'a Model,
        state: &State,
        ws: &mut Workspace,
        load: &'a Load<'a>,
        params: &'a SolveParams,
    ) -> Self {
        ws.memory.begin(model, state, load.duration);
        ws.assembler.begin(model, &ws.memory);
        let inertia = load
            .dynamics
            .filter(|_| load.duration > 0.0 && load.duration.is_finite())
            .map(|dynamics| {
                let Workspace {
                    memory,
                    assembler,
                    system,
                    ..
                } = ws;
                let dt = load.duration;
                Inertia::new(model, memory, &dynamics, state, dt, assembler, system)
            });
        ws.origin.tools.clear();
        ws.origin.tools.extend_from_slice(load.tools_before);
        ws.origin.displacements.clone_from(&state.displacements);
        ws.origin.touches.clone_from(&state.touches);
        ws.origin.measure(model, load.tools.len());
        ws.spring = 0.0;
        ws.given.clone_from(&model.supports);
        for &(node, _) in load.held {
            ws.given[node] = Hold::all();
        }
        for (node, direction, _) in load.guided {
            ws.given[*node] = ws.given[*node].and(direction);
        }
        Self {
            model,
            load,
            inertia,
            params,
            iterations: 0,
            shift: 0.0,
            residual: f64::INFINITY,
            mismatch: f64::INFINITY,
        }
    }
}

impl Newton<'_> {
    /// Iterates until all laws are satisfied, or the solve is given up.
    pub(super) fn run(&mut self, state: &mut State, ws: &mut Workspace) -> Outcome {
        let mut best = Best {
            residual: f64::INFINITY,
            iteration: 0,
        };
        loop {
            if let ControlFlow::Break(outcome) = self.iterate(state, ws, &mut best) {
                return outcome;
            }
        }
    }

    /// One iteration; breaks when the solve ends.
    fn iterate(
        &mut self,
        state: &mut State,
        ws: &mut Workspace,
        best: &mut Best,
    ) -> ControlFlow<Outcome> {
        self.linearise(state, ws)?;
        let imbalance = self.balance(ws);
        let demand = self.demand(state, ws);
        let is_led = demand > self.params.gap_tolerance.max(1e-6);
        let is_there = demand <= self.params.gap_tolerance;
        if is_there && self.is_settled(self.params.tolerance) {
            return ControlFlow::Break(Outcome::Converged);
        }
        let whole = self.residual.max(self.mismatch);
        if self.iterations > 0 && whole < PROGRESS * best.residual {
            *best = Best {
                residual: whole,
                iteration: self.iterations,
            };
        }
        let is_lost = self.iterations > best.iteration + PATIENCE;
        if is_lost || self.iterations == self.params.max_iterations {
            let tolerance = self.params.tolerance.max(STALLED);
            if is_there && self.is_settled(tolerance) {
                return ControlFlow::Break(Outcome::Converged);
            }
            return ControlFlow::Break(Outcome::IterationLimit {
                at: self.worst_node(ws).into(),
            });
        }
        self.iterations += 1;
        self.stiffen(ws);
        self.find_step(ws)?;
        match self.search(state, ws, imbalance, is_led) {
            Ok(_) => ControlFlow::Continue(()),
            Err(inverted) => ControlFlow::Break(inverted.into()),
        }
    }

    /// Finds the contacts, and the forces and stiffness of the body.
    fn linearise(&mut self, state: &State, ws: &mut Workspace) -> ControlFlow<Outcome> {
        self.touch(state, ws);
        let assembled = ws.assembler.stiffness(
            self.model,
            &ws.memory,
            &state.displacements,
            &mut ws.forces,
            &mut ws.system,
        );
        if let Err(inverted) = assembled {
            return ControlFlow::Break(inverted.into());
        }
        ws.forget_added();
        self.add_loads(state, ws, true);
        ControlFlow::Continue(())
    }

    fn is_settled(&self, tolerance: f64) -> bool {
        let looser = self.params.contact_tolerance.max(tolerance);
        self.residual <= tolerance && self.mismatch <= looser
    }

    /// Solves the linear system, with as little of a new factor as works: with a new factor of the
    /// region round the tools; in a large body without a region, with the factor of an earlier
    /// iteration; else with a new factor of everything. Near an equilibrium, the last factor is kept
    /// first of all.
    fn find_step(&mut self, ws: &mut Workspace) -> ControlFlow<Outcome> {
        let model = self.model;
        let is_large = model.n_free_nodes() >= self.params.keep_factor_from;
        // The first step of a load is the largest. After it, the stiffness is near that at the end.
        let is_large = is_large && ws.system.region.is_none() && self.iterations != 2;
        // A shifted factor is a poor approximation.
        let is_near = self.params.is_near && ws.system.shift == 0.0;
        let is_kept = ws.system.is_factored && (is_large || is_near);
        let is_usable = is_kept || ws.system.refactor_region(&model.structure, &ws.given);
        if is_usable && self.solve(ws, true) {
            return ControlFlow::Continue(());
        }
        if self.params.is_near {
            let is_definite = ws.system.factor_unshifted(&model.structure, &ws.given);
            let is_solved = if is_definite {
                self.solve(ws, false)
            } else {
                self.solve_from_rest(ws)
            };
            if is_solved {
                return ControlFlow::Continue(());
            }
        }
        if !self.factor_with_springs(ws) {
            match ws.system.refactor(&model.structure, &ws.given) {
                Ok(shift) => self.shift = self.shift.max(shift),
                Err(_) => return ControlFlow::Break(Outcome::Singular),
            }
        }
        self.solve(ws, false);
        ControlFlow::Continue(())
    }

    /// Factors the system with the softest springs under the tools that make it positive definite.
    /// Deep under a tool the free body is not stable, and only the tool holds it. Returns whether
    /// any do.
    fn factor_with_springs(&self, ws: &mut Workspace) -> bool {
        if ws.contacts.slots.is_empty() {
            return false;
        }
        let before = ws.spring / SPRING_GROWTH;
        let softer = if before < FIRST_SPRING { 0.0 } else { before };
        let mut share = softer;
        while share <= MOST_SPRING {
            self.spring(ws, share);
            if ws.system.factor_unshifted(&self.model.structure, &ws.given) {
                return true;
            }
            share = (share * SPRING_GROWTH).max(FIRST_SPRING);
        }
        self.spring(ws, softer);
        false
    }

    /// Solves the linear system with the factor of the body at rest. Displacements that come from a
    /// coarser mesh press some prisms and stretch others, so that the stiffness there may not be
    /// positive definite, although it is both at rest and in equilibrium.
    fn solve_from_rest(&self, ws: &mut Workspace) -> bool {
        let model = self.model;
        let present = ws.system.blocks.clone();
        ws.trial.fill(Vec3::zeros());
        let assembled = ws.assembler.stiffness(
            model,
            &ws.memory,
            &ws.trial,
            &mut ws.trial_forces,
            &mut ws.system,
        );
        let is_factored =
            assembled.is_ok() && ws.system.factor_unshifted(&model.structure, &ws.given);
        ws.system.blocks = present;
        is_factored && self.solve(ws, true)
    }

    /// Subtracts loads from the forces, and adds forces and stiffness of inertia.
    pub(super) fn add_loads(&self, state: &State, ws: &mut Workspace, with_stiffness: bool) {
        for (force, load) in ws.forces.iter_mut().zip(self.load.forces) {
            *force -= load;
        }
        if let Some(inertia) = &self.inertia {
            inertia.add(
                self.model,
                &state.displacements,
                &mut ws.forces,
                with_stiffness.then_some(&mut ws.system.blocks),
            );
        }
    }

    /// Position at rest of the node with the largest unbalanced force, m.
    fn worst_node(&self, ws: &Workspace) -> Vec3 {
        let worst = (0..ws.given.len()).max_by(|&a, &b| {
            let size = |n: usize| ws.given[n].free_part(&ws.right_side[n]).norm();
            size(a).total_cmp(&size(b))
        });
        worst.map_or(Vec3::zeros(), |n| self.model.body.positions[n])
    }
}

impl From<Inverted> for Outcome {
    fn from(inverted: Inverted) -> Self {
        Self::Inverted {
            at: inverted.at.into(),
        }
    }
}
