//! Newton's method with a line search, for tools, holds and forces that do not move.

use std::ops::ControlFlow;

use palpa_mesh::Vec3;

use super::active_set::anchor_slides;
use super::constraints::ForcesBy;
use super::load::{Load, SolveParams};
use super::report::{Outcome, StepReport};
use super::workspace::Workspace;
use crate::assembly::Inverted;
use crate::dynamics::Inertia;
use crate::model::Model;
use crate::state::State;
use crate::system::Hold;

/// Residual below which contact uses present forces instead of predicted ones.
const NEAR_EQUILIBRIUM: f64 = 1e-3;
/// Number of iterations without progress after which a solve is given up, and the ratio to the best
/// residual so far that counts as progress.
const PATIENCE: usize = 12;
const PROGRESS: f64 = 0.7;
/// Residual that is accepted if it falls no further: a body about to buckle can be factored only
/// with a shift, and then converges ever more slowly.
const STALLED: f64 = 1e-6;

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
    let start =
        (!load.tools.is_empty()).then(|| (state.displacements.clone(), state.touches.clone()));
    let mut outcome = newton.run(state, ws);
    if let Some((displacements, touches)) = start
        && outcome != Outcome::Converged
        && load.tools.iter().any(|t| t.tool.friction() > 0.0)
    {
        state.displacements = displacements;
        state.touches = touches;
        outcome = newton.run_smoothed(state, ws);
    }
    if outcome == Outcome::Converged {
        ws.memory.commit(model, state);
        anchor_slides(model, &state.displacements, load.tools, &mut state.touches);
        if let Some(inertia) = &newton.inertia {
            inertia.commit(state);
        }
        if load.duration.is_finite() {
            state.time += load.duration;
        }
    }
    newton.report(state, ws, outcome)
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
}

/// The distance of a state from equilibrium.
#[derive(Clone, Copy)]
pub(super) struct Imbalance {
    /// Norm of the forces in free directions, N.
    pub(super) free: f64,
    /// Largest displacement still prescribed by holds, guides and tools, m.
    pub(super) demand: f64,
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
        ws.contacts.smoothing = 0.0;
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
        let n_new = self.linearise(state, ws)?;
        let mut imbalance = self.constrain(state, ws, n_new);
        if n_new == 0 && self.is_settled(imbalance, self.params.tolerance) {
            // The forces are correct for these touches. Now check the touches against the forces.
            if self.iterations == 0 || self.revise(state, ws, ForcesBy::Present) == 0 {
                return ControlFlow::Break(Outcome::Converged);
            }
            imbalance = self.put_constraints(state, ws, ForcesBy::Present);
            *best = Best {
                residual: f64::INFINITY,
                iteration: self.iterations,
            };
        }
        if self.iterations > 0 && self.residual < PROGRESS * best.residual {
            *best = Best {
                residual: self.residual,
                iteration: self.iterations,
            };
        }
        let is_lost = self.iterations > best.iteration + PATIENCE;
        if is_lost || self.iterations == self.params.max_iterations {
            return ControlFlow::Break(self.give_up(state, ws, imbalance, n_new));
        }
        self.iterations += 1;
        self.find_step(ws)?;
        self.take_step(state, ws, imbalance)
    }

    /// Finds the vertices in contact, and the forces and stiffness of the body. Returns the number
    /// of new vertices.
    fn linearise(&mut self, state: &mut State, ws: &mut Workspace) -> ControlFlow<Outcome, usize> {
        let n_new = ws.contacts.update(
            self.model,
            &state.displacements,
            self.load.tools,
            &ws.given,
            &mut state.touches,
            self.params.gap_tolerance,
        );
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
        ws.added.clear();
        self.add_loads(state, ws);
        ControlFlow::Continue(n_new)
    }

    /// Revises touches and puts constraints on the system, using predicted forces far from
    /// equilibrium and present forces near it.
    fn constrain(&mut self, state: &mut State, ws: &mut Workspace, n_new: usize) -> Imbalance {
        if self.iterations > 0 && n_new == 0 {
            self.revise(state, ws, ForcesBy::Predicted);
        }
        let was_far =
            self.iterations > 0 && self.residual > NEAR_EQUILIBRIUM && ws.contacts.smoothing == 0.0;
        let by = if was_far {
            ForcesBy::Predicted
        } else {
            ForcesBy::Present
        };
        let imbalance = self.put_constraints(state, ws, by);
        if was_far && self.residual <= NEAR_EQUILIBRIUM {
            return self.put_constraints(state, ws, ForcesBy::Present);
        }
        imbalance
    }

    fn is_settled(&self, imbalance: Imbalance, tolerance: f64) -> bool {
        self.residual <= tolerance && imbalance.demand <= self.params.gap_tolerance
    }

    /// The outcome of a solve without progress.
    fn give_up(
        &self,
        state: &mut State,
        ws: &mut Workspace,
        imbalance: Imbalance,
        n_new: usize,
    ) -> Outcome {
        let is_near = n_new == 0 && self.is_settled(imbalance, self.params.tolerance.max(STALLED));
        if is_near && self.revise(state, ws, ForcesBy::Present) == 0 {
            return Outcome::Converged;
        }
        Outcome::IterationLimit {
            at: self.worst_node(ws).into(),
        }
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
        let is_usable = is_kept || ws.system.refactor_region(&model.structure, &ws.holds);
        if is_usable && self.solve(ws, true) {
            return ControlFlow::Continue(());
        }
        if self.params.is_near {
            let is_definite = ws.system.factor_unshifted(&model.structure, &ws.holds);
            let is_solved = if is_definite {
                self.solve(ws, false)
            } else {
                self.solve_from_rest(ws)
            };
            if is_solved {
                return ControlFlow::Continue(());
            }
        }
        match ws.system.refactor(&model.structure, &ws.holds) {
            Ok(shift) => self.shift = self.shift.max(shift),
            Err(_) => return ControlFlow::Break(Outcome::Singular),
        }
        self.solve(ws, false);
        ControlFlow::Continue(())
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
            assembled.is_ok() && ws.system.factor_unshifted(&model.structure, &ws.holds);
        ws.system.blocks = present;
        is_factored && self.solve(ws, true)
    }

    /// Takes the step as far as the line search allows, and keeps the forces that the linear system
    /// predicts there.
    fn take_step(
        &self,
        state: &mut State,
        ws: &mut Workspace,
        imbalance: Imbalance,
    ) -> ControlFlow<Outcome> {
        match self.search(state, ws, imbalance) {
            Ok(share) => {
                for (predicted, force) in ws.predicted.iter_mut().zip(&ws.forces) {
                    *predicted = force + *predicted * share;
                }
                ControlFlow::Continue(())
            }
            Err(inverted) => ControlFlow::Break(inverted.into()),
        }
    }

    /// Subtracts loads from the forces, and adds forces and stiffness of inertia.
    fn add_loads(&self, state: &State, ws: &mut Workspace) {
        for (force, load) in ws.forces.iter_mut().zip(self.load.forces) {
            *force -= load;
        }
        if let Some(inertia) = &self.inertia {
            inertia.add(
                self.model,
                &state.displacements,
                &mut ws.forces,
                Some(&mut ws.system.blocks),
            );
        }
    }

    /// Position at rest of the node with the largest unbalanced force, m.
    fn worst_node(&self, ws: &Workspace) -> Vec3 {
        let worst = (0..ws.holds.len()).max_by(|&a, &b| {
            let size = |n: usize| ws.holds[n].free_part(&ws.right_side[n]).norm();
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
