//! Equilibrium: Newton's method with a line search, and load steps that adapt.

use palpa_mesh::Vec3;

use crate::Mat3;
use crate::assembly::{Inverted, assemble};
use crate::contact::{ContactResiduals, Contacts, PosedTool, settle};
use crate::dynamics::{Dynamics, Inertia};
use crate::gmres::gmres;
use crate::model::Model;
use crate::shape::Pose;
use crate::state::{Memory, State, Touch};
use crate::system::{Hold, LinearSystem};

/// How often a Newton step may be halved before it counts as failed.
const MOST_HALVINGS: usize = 8;
/// From this iteration on the active set changes only when forces have settled, so that it cannot chatter.
const SETTLE_AFTER: usize = 12;
/// A share of the largest contact force that counts as none.
const NO_FORCE: f64 = 1e-9;
/// Share of a load step below which halving it further is given up.
const LEAST_SUBSTEP: f64 = 1.0 / 128.0;
/// A sliding vertex may leave the tool's surface in an iteration by this share of the surface's radius of curvature.
const NEAR_SURFACE: f64 = 0.05;
/// Residual below which tools press and rub by present forces instead of predicted ones.
const NEAR_EQUILIBRIUM: f64 = 1e-3;
/// Residual of a linear system with friction, relative to its right side.
const GMRES_TOLERANCE: f64 = 1e-6;
/// Longest basis for it.
const GMRES_VECTORS: usize = 40;
/// The same with the factor of an earlier iteration: more would save no iteration, and beyond that many vectors a new
/// factor is the cheaper way.
const STALE_TOLERANCE: f64 = 1e-3;
const STALE_VECTORS: usize = 16;
/// Slips over which friction is smoothed, one after the other, where the exact law does not converge at once, m.
const SMOOTHING: [f64; 4] = [1e-3, 2e-4, 4e-5, 1e-5];
/// Smoothing that is small enough to be an answer where the exact law has none within reach, m.
const FINE_SMOOTHING: f64 = 5e-5;
/// Iterations without any progress after which a solve is given up.
const PATIENCE: usize = 12;
/// Residual that is near enough where it falls no further: a body about to buckle has no stiffness that could be factored
/// without a shift, and is approached ever more slowly.
const STALLED: f64 = 1e-6;
/// Solves' worth of iterations after which a step that keeps failing is given up.
const MOST_SOLVES: usize = 10;
/// Newton iterations below which the next substep may be longer.
const EASY: usize = 8;

/// What acts on a body at the end of a step.
#[derive(Debug, Clone, Default)]
pub struct Load<'a> {
    /// Tools, where they are at the end.
    pub tools: &'a [PosedTool],
    /// Nodes that are held, and their displacement at the end, m.
    pub held: &'a [(usize, Vec3)],
    /// Nodes that are guided: unit direction, and displacement along it at the end, m. Across it they are free.
    pub guided: &'a [(usize, Vec3, f64)],
    /// Dead forces on all nodes, N; none if empty.
    pub forces: &'a [Vec3],
    /// Duration of the step, s; 0 is a sudden step, ∞ relaxes fully.
    pub duration: f64,
    /// Inertia and damping; quasi-static without.
    pub dynamics: Option<Dynamics>,
}

/// When to be content, and when to give up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolveParams {
    /// Norm of the forces that are out of balance, as a share of those that hold the body.
    pub tolerance: f64,
    /// Largest gap of an active vertex, m.
    pub gap_tolerance: f64,
    /// Newton iterations of one load step.
    pub max_iterations: usize,
    /// Nodes from which on a factor is kept over iterations and steps, as the preconditioner of the next systems, until that
    /// no longer pays. The cost of a factor grows faster with the body than that of its use.
    pub keep_factor_from: usize,
}

impl Default for SolveParams {
    fn default() -> Self {
        Self {
            tolerance: 1e-7,
            gap_tolerance: 1e-8,
            max_iterations: 40,
            keep_factor_from: 10_000,
        }
    }
}

/// How a step ended.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Outcome {
    /// All laws hold to the tolerances.
    Converged,
    /// The iterations were used up.
    IterationLimit {
        /// Where the forces are most out of balance, at rest, m.
        at: [f64; 3],
    },
    /// Tissue would be turned inside out.
    Inverted {
        /// Where, at rest, m.
        at: [f64; 3],
    },
    /// The stiffness could not be made positive definite.
    Singular,
}

/// What a step did.
#[derive(Debug, Clone, PartialEq)]
pub struct StepReport {
    /// How it ended; unless it converged the state is what it was before.
    pub outcome: Outcome,
    /// Newton iterations, of all substeps.
    pub iterations: usize,
    /// Substeps into which the step was divided, 1 if it went in one.
    pub substeps: usize,
    /// Forces out of balance, as a share of those that hold the body.
    pub residual: f64,
    /// How well the laws of contact hold.
    pub contact: ContactResiduals,
    /// Slip over which friction had to be smoothed, m: vertices that would be held creep by about as much. 0 for the
    /// exact law, which nearly every step obeys.
    pub friction_smoothing: f64,
    /// Strain energy, J (of a viscous material that of the step's potential).
    pub energy: f64,
    /// For each tool the force of the tissue on it, N.
    pub tool_forces: Vec<Vec3>,
    /// For each tool the area of skin that touches it, m² at rest.
    pub tool_areas: Vec<f64>,
    /// For each tool the largest pressure on a vertex, Pa (force by its area at rest).
    pub tool_pressures: Vec<f64>,
    /// Force of the tissue on what holds and guides nodes, N.
    pub held_force: Vec3,
    /// Force of the tissue on its supports (bone, cut faces), N.
    pub support_force: Vec3,
    /// Largest shift that the stiffness needed to be positive definite, relative to its diagonal.
    pub shift: f64,
}

/// Scratch of the solver. Between calls it keeps nothing that a result depends on by more than the tolerance.
#[derive(Debug)]
pub struct Workspace {
    system: LinearSystem,
    pub(crate) memory: Memory,
    forces: Vec<Vec3>,
    trial_forces: Vec<Vec3>,
    right_side: Vec<Vec3>,
    demand: Vec<Vec3>,
    delta: Vec<Vec3>,
    /// Forces on nodes as the linear system has them after the step that was taken.
    predicted: Vec<Vec3>,
    /// Those of them, or of the present ones, that tools press and rub by.
    contact_forces: Vec<Vec3>,
    trial: Vec<Vec3>,
    given: Vec<Hold>,
    holds: Vec<Hold>,
    contacts: Contacts,
    /// What contact has added to blocks of the stiffness.
    added: Vec<(usize, Mat3)>,
}

impl Workspace {
    /// Scratch for a model.
    pub fn new(model: &Model) -> Self {
        let zeros = || vec![Vec3::zeros(); model.n_nodes()];
        Self {
            system: LinearSystem::new(&model.structure, model.n_nodes()),
            memory: Memory::new(model),
            forces: zeros(),
            trial_forces: zeros(),
            right_side: zeros(),
            demand: zeros(),
            delta: zeros(),
            predicted: zeros(),
            contact_forces: zeros(),
            trial: zeros(),
            given: model.supports.clone(),
            holds: model.supports.clone(),
            contacts: Contacts::default(),
            added: Vec::new(),
        }
    }

    /// Force that holds every node at the state that was solved last, N; zero where a node is free. `[n_nodes]`
    pub fn reactions(&self) -> &[Vec3] {
        &self.forces
    }
}

/// Takes the body to equilibrium under `load`, in as many substeps as that needs. `before` is where the tools were.
///
/// A step that fails leaves the state as it was, and says where it failed.
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
    let (mut iterations, mut substeps) = (0, 0);
    let (mut shift, mut smoothing) = (0.0_f64, 0.0_f64);
    loop {
        let share = (done + size).min(1.0);
        let tools = between(before.tools, load.tools, share);
        let held = held_between(&start, load.held, share);
        let guided = guided_between(&start, load.guided, share);
        let forces = forces_between(before.forces, load.forces, share);
        let part = Load {
            tools: &tools,
            held: &held,
            guided: &guided,
            forces: &forces,
            duration: load.duration * (share - done),
            dynamics: load.dynamics,
        };
        let saved = (size < 1.0).then(|| state.clone());
        let mut report = equilibrate(model, state, ws, &part, params);
        iterations += report.iterations;
        substeps += 1;
        shift = shift.max(report.shift);
        smoothing = smoothing.max(report.friction_smoothing);
        if report.outcome == Outcome::Converged {
            done = share;
            if done >= 1.0 {
                report.iterations = iterations;
                report.substeps = substeps;
                report.shift = shift;
                report.friction_smoothing = smoothing;
                return report;
            }
            if report.iterations <= EASY {
                size *= 2.0;
            }
        } else {
            // Equilibrium from here on is not found: go back to the last good state, and try half as far.
            if let Some(saved) = saved {
                *state = saved;
            } else {
                state.clone_from(&start);
            }
            size *= 0.5;
            if size < LEAST_SUBSTEP || iterations > MOST_SOLVES * params.max_iterations {
                *state = start;
                report.iterations = iterations;
                report.substeps = substeps;
                report.shift = shift;
                report.friction_smoothing = smoothing;
                return report;
            }
        }
    }
}

/// Poses between two lists of tools.
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

/// One solve, without dividing the step. The state is not restored if it fails.
pub fn equilibrate(
    model: &Model,
    state: &mut State,
    ws: &mut Workspace,
    load: &Load<'_>,
    params: &SolveParams,
) -> StepReport {
    ws.memory.begin(model, state, load.duration);
    ws.contacts.smoothing = 0.0;
    let inertia = load
        .dynamics
        .filter(|_| load.duration > 0.0 && load.duration.is_finite())
        .map(|dynamics| Inertia::new(model, &ws.memory, &dynamics, state, load.duration));
    ws.given.clone_from(&model.supports);
    for &(node, _) in load.held {
        ws.given[node] = Hold::all();
    }
    for (node, direction, _) in load.guided {
        ws.given[*node] = ws.given[*node].and(direction);
    }
    let mut newton = Newton {
        model,
        load,
        inertia,
        params,
        iterations: 0,
        shift: 0.0,
        residual: f64::INFINITY,
        energy: 0.0,
    };
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
        settle(model, &state.displacements, load.tools, &mut state.touches);
        if let Some(inertia) = &newton.inertia {
            inertia.commit(state);
        }
        if load.duration.is_finite() {
            state.time += load.duration;
        }
    }
    newton.report(state, ws, outcome)
}

/// Gives sliding vertices the friction of the pressure in `forces`: `f −= μ d (n · f)`.
fn couple(sliding: &[(usize, Vec3, Vec3)], forces: &mut [Vec3]) {
    for (node, friction, normal) in sliding {
        let pressure = normal.dot(&forces[*node]);
        forces[*node] -= friction * pressure;
    }
}

/// Takes from every vector its part in held directions.
fn keep_free(holds: &[Hold], vectors: &mut [Vec3]) {
    for (vector, hold) in vectors.iter_mut().zip(holds) {
        *vector = hold.free_part(vector);
    }
}

/// By which forces touches are judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Forces {
    /// Those where the body is now: right in equilibrium. After a large step they may be many times too large, and pull.
    Present,
    /// Those to which the linear system leads, as if they were unknowns of their own.
    Predicted,
}

struct Newton<'a> {
    model: &'a Model,
    load: &'a Load<'a>,
    inertia: Option<Inertia>,
    params: &'a SolveParams,
    iterations: usize,
    shift: f64,
    residual: f64,
    energy: f64,
}

impl Newton<'_> {
    fn run(&mut self, state: &mut State, ws: &mut Workspace) -> Outcome {
        let model = self.model;
        // The smallest residual since the first solve, and when.
        let mut best = (f64::INFINITY, 0);
        loop {
            let n_new = ws.contacts.update(
                model,
                &state.displacements,
                self.load.tools,
                &ws.given,
                &mut state.touches,
                self.params.gap_tolerance,
            );
            match assemble(
                model,
                &ws.memory,
                &state.displacements,
                &mut ws.forces,
                Some(&mut ws.system.blocks),
            ) {
                Ok(energy) => self.energy = energy,
                Err(Inverted { at }) => return Outcome::Inverted { at: at.into() },
            }
            ws.added.clear();
            self.add_loads(state, ws, true);
            if self.iterations > 0 && n_new == 0 {
                self.revise(state, ws, Forces::Predicted);
            }
            let was_far = self.iterations > 0
                && self.residual > NEAR_EQUILIBRIUM
                && ws.contacts.smoothing == 0.0;
            let by = if was_far {
                Forces::Predicted
            } else {
                Forces::Present
            };
            let (mut free, mut demand) = self.put_constraints(state, ws, by);
            if was_far && self.residual <= NEAR_EQUILIBRIUM {
                (free, demand) = self.put_constraints(state, ws, Forces::Present);
            }
            let is_settled = self.residual <= self.params.tolerance
                && demand <= self.params.gap_tolerance
                && n_new == 0;
            if is_settled {
                // Forces are right for these touches; are the touches right for these forces?
                if self.iterations == 0 || self.revise(state, ws, Forces::Present) == 0 {
                    return Outcome::Converged;
                }
                (free, demand) = self.put_constraints(state, ws, Forces::Present);
                best = (f64::INFINITY, self.iterations);
            }
            if self.iterations > 0 && self.residual < 0.7 * best.0 {
                best = (self.residual, self.iterations);
            }
            let is_lost = self.iterations > best.1 + PATIENCE;
            if is_lost || self.iterations == self.params.max_iterations {
                let is_near = self.residual <= self.params.tolerance.max(STALLED)
                    && demand <= self.params.gap_tolerance
                    && n_new == 0;
                if is_near && self.revise(state, ws, Forces::Present) == 0 {
                    return Outcome::Converged;
                }
                return Outcome::IterationLimit {
                    at: self.worst_node(ws).into(),
                };
            }
            self.iterations += 1;
            let is_large = model.n_free_nodes() >= self.params.keep_factor_from;
            // The first step of a load is the largest, and stiffness after it near that at the end.
            let is_kept = is_large && ws.system.is_factored && self.iterations != 2;
            if !(is_kept && self.solve(ws, true)) {
                match ws.system.refactor(&model.structure, &ws.holds) {
                    Ok(shift) => self.shift = self.shift.max(shift),
                    Err(_) => return Outcome::Singular,
                }
                self.solve(ws, false);
            }
            match self.search(state, ws, free, demand) {
                Ok(share) => {
                    for (predicted, force) in ws.predicted.iter_mut().zip(&ws.forces) {
                        *predicted = force + *predicted * share;
                    }
                }
                Err(Inverted { at }) => return Outcome::Inverted { at: at.into() },
            }
        }
    }

    /// The detour by smoothed friction, then the exact law from there.
    fn run_smoothed(&mut self, state: &mut State, ws: &mut Workspace) -> Outcome {
        for touch in &mut state.touches {
            if let Touch::Stick { tool, anchor } = *touch {
                *touch = Touch::Slip { tool, anchor };
            }
        }
        let mut spent = self.iterations;
        let mut good = None;
        for smoothing in SMOOTHING {
            ws.contacts.smoothing = smoothing;
            self.iterations = 0;
            let outcome = self.run(state, ws);
            spent += self.iterations;
            if outcome != Outcome::Converged {
                if good.is_none() {
                    self.iterations = spent;
                    return outcome;
                }
                break;
            }
            good = Some((
                smoothing,
                state.displacements.clone(),
                state.touches.clone(),
            ));
        }
        for contact in &ws.contacts.active {
            state.touches[contact.vertex] = contact.sharpened();
        }
        ws.contacts.smoothing = 0.0;
        self.iterations = 0;
        let mut outcome = self.run(state, ws);
        spent += self.iterations;
        if let Some((smoothing, displacements, touches)) = good
            && outcome != Outcome::Converged
            && smoothing <= FINE_SMOOTHING
        {
            state.displacements = displacements;
            state.touches = touches;
            ws.contacts.smoothing = smoothing;
            self.iterations = 0;
            outcome = self.run(state, ws);
            spent += self.iterations;
        }
        self.iterations = spent;
        outcome
    }

    /// Below this the body counts as free of forces, N. The tolerance of it is still above what rounding leaves.
    fn floor(&self) -> f64 {
        let stiffest = self
            .model
            .materials
            .iter()
            .map(|m| m.law.shear_modulus())
            .fold(0.0, f64::max);
        let area: f64 = self.model.skin_areas.iter().sum();
        1e-6 * stiffest * area / self.model.skin_areas.len() as f64
    }

    /// Takes loads off the forces and adds what inertia and contact put on the stiffness.
    fn add_loads(&self, state: &State, ws: &mut Workspace, with_stiffness: bool) {
        let model = self.model;
        for (force, load) in ws.forces.iter_mut().zip(self.load.forces) {
            *force -= load;
        }
        if let Some(inertia) = &self.inertia {
            inertia.add(
                model,
                &state.displacements,
                &mut ws.forces,
                with_stiffness.then_some(&mut ws.system.blocks),
            );
        }
    }

    /// Lets go what would be pulled, and turns sticking to sliding and back; late in a solve only the one vertex of which
    /// that is least in doubt, so that touches cannot chatter.
    fn revise(&self, state: &mut State, ws: &mut Workspace, by: Forces) -> usize {
        let forces = match by {
            Forces::Present => &ws.forces,
            Forces::Predicted => &ws.predicted,
        };
        let largest = ws
            .contacts
            .active
            .iter()
            .map(|c| forces[c.node].norm())
            .fold(0.0, f64::max);
        let least = NO_FORCE * largest.max(self.floor());
        let changes = ws
            .contacts
            .active
            .iter()
            .enumerate()
            .filter_map(|(i, contact)| {
                let force = &forces[contact.node];
                let (touch, doubt) = contact.revised(force, least)?;
                Some((i, touch, doubt))
            });
        let mut changes: Vec<(usize, Touch, f64)> = changes.collect();
        if self.iterations >= SETTLE_AFTER {
            changes.sort_by(|a, b| b.2.total_cmp(&a.2));
            changes.truncate(1);
        }
        for &(i, touch, _) in &changes {
            let contact = &mut ws.contacts.active[i];
            contact.touch = touch;
            state.touches[contact.vertex] = touch;
        }
        ws.contacts.active.retain(|c| c.touch != Touch::Open);
        changes.len()
    }

    /// Collects what is held and which moves that demands; puts friction and the tools' curvature into the system.
    /// Returns the norm of the free forces, N, and the largest demand, m.
    fn put_constraints(&mut self, state: &State, ws: &mut Workspace, by: Forces) -> (f64, f64) {
        // What contact has put on since the last assembly comes off first.
        for (block, stiffness) in ws.added.drain(..) {
            ws.system.blocks[block] -= stiffness;
        }
        ws.holds.copy_from_slice(&ws.given);
        ws.demand.fill(Vec3::zeros());
        ws.right_side.copy_from_slice(&ws.forces);
        ws.contact_forces.copy_from_slice(match by {
            Forces::Present => &ws.forces,
            Forces::Predicted => &ws.predicted,
        });
        let mut largest = 0.0_f64;
        for &(node, target) in self.load.held {
            let demand = target - state.displacements[node];
            ws.demand[node] = demand;
            largest = largest.max(demand.norm());
        }
        for &(node, direction, target) in self.load.guided {
            let demand = target - state.displacements[node].dot(&direction);
            ws.demand[node] += direction * demand;
            largest = largest.max(demand.abs());
        }
        for contact in &ws.contacts.active {
            let node = contact.node;
            let force = ws.contact_forces[node];
            let (hold, demand) = contact.demand(ws.given[node], &force);
            ws.holds[node] = hold;
            ws.demand[node] = demand;
            largest = largest.max(demand.norm());
            let mut stiffness = contact.geometric(&force);
            if let Touch::Slip { .. } = contact.touch {
                let (friction, slope) = contact.friction(&force);
                ws.right_side[node] -= friction;
                stiffness += slope;
            }
            let block = self.model.structure.diagonal(node);
            ws.system.blocks[block] += stiffness;
            ws.added.push((block, stiffness));
        }
        let (free, held) = self.norms(ws);
        self.residual = free / held.max(self.floor());
        (free, largest)
    }

    /// Norms of the forces in free and in held directions, N.
    fn norms(&self, ws: &Workspace) -> (f64, f64) {
        let (mut free_sq, mut held_sq) = (0.0, 0.0);
        for ((force, whole), hold) in ws.right_side.iter().zip(&ws.forces).zip(&ws.holds) {
            let free = hold.free_part(force);
            free_sq += free.norm_squared();
            held_sq += (whole - free).norm_squared();
        }
        let loads: f64 = self.load.forces.iter().map(Vec3::norm_squared).sum();
        (free_sq.sqrt(), held_sq.max(loads).sqrt())
    }

    fn worst_node(&self, ws: &Workspace) -> Vec3 {
        let worst = (0..ws.holds.len()).max_by(|&a, &b| {
            let size = |n: usize| ws.holds[n].free_part(&ws.right_side[n]).norm();
            size(a).total_cmp(&size(b))
        });
        worst.map_or(Vec3::zeros(), |n| self.model.body.positions[n])
    }

    /// `δ = demand` in held directions, and in free ones what balances the linearised forces. Says whether it does, which an
    /// old factor may not manage.
    ///
    /// Friction at a sliding vertex grows with its pressure, which makes the stiffness unsymmetric,
    /// `(I − μ d ⊗ n) K` in the rows of that vertex. The symmetric factor is then a good guess for GMRES, as is that of a
    /// stiffness which has changed little, under constraints of which few have changed.
    fn solve(&self, ws: &mut Workspace, is_stale: bool) -> bool {
        let structure = &self.model.structure;
        let Workspace {
            system,
            contact_forces,
            right_side,
            demand,
            delta,
            predicted,
            holds,
            contacts,
            added,
            ..
        } = ws;
        predicted.fill(Vec3::zeros());
        let mut carried = vec![Vec3::zeros(); right_side.len()];
        structure.multiply(&system.blocks, demand, &mut carried);
        let sliding = contacts.sliding(contact_forces);
        couple(&sliding, &mut carried);
        for ((force, carried), hold) in right_side.iter().zip(&mut carried).zip(holds.iter()) {
            *carried = hold.free_part(&-(*force + *carried));
        }
        let mut is_solved = true;
        if sliding.is_empty() && !is_stale {
            system.solve(structure, &carried, delta);
        } else {
            let (tolerance, most) = if is_stale {
                (STALE_TOLERANCE, STALE_VECTORS)
            } else {
                (GMRES_TOLERANCE, GMRES_VECTORS)
            };
            let solution = gmres(&carried, tolerance, most, |x, out| {
                system.solve(structure, x, delta);
                keep_free(holds, delta);
                out.clear();
                out.resize(x.len(), Vec3::zeros());
                structure.multiply(&system.blocks, delta, out);
                couple(&sliding, out);
                keep_free(holds, out);
            });
            is_solved = solution.residual <= tolerance;
            system.solve(structure, &solution.vector, delta);
            keep_free(holds, delta);
        }
        for (delta, demand) in delta.iter_mut().zip(demand.iter()) {
            *delta += demand;
        }
        structure.multiply(&system.blocks, delta, predicted);
        // What contact has put on the stiffness is none of the body's.
        for (contact, (_, stiffness)) in contacts.active.iter().zip(added.iter()) {
            predicted[contact.node] -= stiffness * delta[contact.node];
        }
        is_solved
    }

    /// Goes along `δ` as far as no prism inverts and forces do not grow; gives the share of it.
    fn search(
        &self,
        state: &mut State,
        ws: &mut Workspace,
        free_before: f64,
        demand: f64,
    ) -> Result<f64, Inverted> {
        let mut share = 1.0;
        let mut last = None;
        // While the tool still has to be met, forces must grow.
        let must_fall = demand <= self.params.gap_tolerance.max(1e-6)
            && ws.contacts.active.iter().all(|c| c.friction == 0.0);
        for _ in 0..=MOST_HALVINGS {
            for ((trial, u), delta) in ws.trial.iter_mut().zip(&state.displacements).zip(&ws.delta)
            {
                *trial = u + delta * share;
            }
            let result = assemble(
                self.model,
                &ws.memory,
                &ws.trial,
                &mut ws.trial_forces,
                None,
            );
            match result {
                Err(inverted) => last = Some(inverted),
                Ok(energy) => {
                    let is_good = self.keeps_touch(ws, share)
                        && (!must_fall || self.is_better(ws, energy, free_before));
                    if is_good {
                        std::mem::swap(&mut state.displacements, &mut ws.trial);
                        return Ok(share);
                    }
                    last = None;
                }
            }
            share *= 0.5;
        }
        if let Some(inverted) = last {
            return Err(inverted);
        }
        // Rounding, or a bad model of the forces: the shortest move, and the iterations decide.
        std::mem::swap(&mut state.displacements, &mut ws.trial);
        Ok(2.0 * share)
    }

    /// Whether sliding vertices stay near the tool's surface, whose bend the linear step does not see.
    fn keeps_touch(&self, ws: &Workspace, share: f64) -> bool {
        ws.contacts.active.iter().all(|contact| {
            let x = self.model.body.positions[contact.node] + ws.trial[contact.node];
            let gap = contact.moved(self.load.tools, &x).gap.abs();
            let radius = 1.0 / contact.sharpness().max(1.0);
            gap <= ((1.0 - 0.5 * share) * contact.gap.abs()).max(NEAR_SURFACE * radius)
        })
    }

    /// Whether the trial has less energy, or smaller free forces.
    fn is_better(&self, ws: &mut Workspace, energy: f64, free_before: f64) -> bool {
        let mut forces = std::mem::take(&mut ws.trial_forces);
        for (force, load) in forces.iter_mut().zip(self.load.forces) {
            *force -= load;
        }
        if let Some(inertia) = &self.inertia {
            inertia.add(self.model, &ws.trial, &mut forces, None);
        }
        let free_sq: f64 = forces
            .iter()
            .zip(&ws.holds)
            .map(|(force, hold)| hold.free_part(force).norm_squared())
            .sum();
        ws.trial_forces = forces;
        free_sq.sqrt() <= free_before * 1.000_1
            || (ws.contacts.active.is_empty() && energy < self.energy)
    }

    fn report(&self, state: &State, ws: &mut Workspace, outcome: Outcome) -> StepReport {
        let model = self.model;
        let n_tools = self.load.tools.len();
        let mut report = StepReport {
            outcome,
            iterations: self.iterations,
            substeps: 1,
            residual: self.residual,
            contact: ContactResiduals::default(),
            friction_smoothing: ws.contacts.smoothing,
            energy: self.energy,
            tool_forces: vec![Vec3::zeros(); n_tools],
            tool_areas: vec![0.0; n_tools],
            tool_pressures: vec![0.0; n_tools],
            held_force: Vec3::zeros(),
            support_force: Vec3::zeros(),
            shift: self.shift,
        };
        for contact in &ws.contacts.active {
            let Some(tool) = contact.touch.tool() else {
                continue;
            };
            let force = ws.forces[contact.node];
            contact.measure(&force, &mut report.contact);
            report.tool_forces[tool] -= force;
            let area = model.skin_areas[contact.vertex];
            report.tool_areas[tool] += area;
            let pressure = contact.pressure(&force) / area;
            report.tool_pressures[tool] = report.tool_pressures[tool].max(pressure);
        }
        for (vertex, touch) in state.touches.iter().enumerate() {
            let node = model.body.node(vertex, 0);
            if *touch == Touch::Open && ws.given[node].n < 3 {
                let x = model.body.positions[node] + state.displacements[node];
                for PosedTool { tool, pose } in self.load.tools {
                    let depth = -tool.distance_at(pose, &x).distance;
                    report.contact.penetration = report.contact.penetration.max(depth);
                }
            }
        }
        for &(node, _) in self.load.held {
            report.held_force -= ws.forces[node];
        }
        for (node, direction, _) in self.load.guided {
            report.held_force -= direction * direction.dot(&ws.forces[*node]);
        }
        for (node, hold) in model.supports.iter().enumerate() {
            if hold.n > 0 {
                report.support_force -= ws.forces[node] - hold.free_part(&ws.forces[node]);
            }
        }
        report
    }
}
