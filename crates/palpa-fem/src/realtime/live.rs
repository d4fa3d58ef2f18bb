//! The moving step.

use std::sync::Arc;

use palpa_mesh::Vec3;
use palpa_sparse::ColumnPattern;

use super::contact::{Candidate, ContactProblem};
use super::zone::{Inside, Outside, Plan, Trouble};
use super::{MOST_CANDIDATES, column_pattern};
use crate::contact::PosedTool;
use crate::error::FemError;
use crate::model::Model;
use crate::state::{Memory, State};

/// How a moving step goes about its work.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiveParams {
    /// Radius of the zone round the tools, at rest over the skin, m; infinite for one stiffness of the whole body.
    pub zone_radius: f64,
    /// What is done about the rest of the body.
    pub exterior: ExteriorMode,
    /// Most Newton iterations of a step.
    pub max_iterations: usize,
    /// Forces out of balance, as a share of the tools', above which a step takes another iteration.
    pub tolerance: f64,
    /// Gap up to which vertices are candidates for contact, m.
    pub reach: f64,
    /// How far the tool may go from the zone's centre before a new zone is asked for, as a share of the radius.
    pub leave: f64,
    /// Indentation after which the exterior's stiffness is asked to be made anew, m.
    pub stale: f64,
}

impl Default for LiveParams {
    fn default() -> Self {
        Self {
            zone_radius: 15e-3,
            exterior: ExteriorMode::Followed,
            max_iterations: 2,
            tolerance: 0.02,
            reach: 1.5e-3,
            leave: 0.3,
            stale: 3e-3,
        }
    }
}

/// What a step does about the body outside the zone. Its stiffness is always an earlier one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExteriorMode {
    /// It is brought to equilibrium with its true forces in every step: their cost grows with the body.
    Followed,
    /// It answers linearly until the background brings it up to date: the cost of a step is that of the zone.
    Linear,
}

/// How a step ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepOutcome {
    /// The tools are where they were asked to be.
    Arrived,
    /// Part of the way only: tissue would have been turned inside out.
    BackedOff,
    /// Nowhere; the state is the last good one.
    Failed,
}

/// What a moving step did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiveReport {
    /// How it ended.
    pub outcome: StepOutcome,
    /// Newton iterations.
    pub iterations: usize,
    /// Forces out of balance in the zone, as a share of the tools'.
    pub residual: f64,
    /// Vertices that press.
    pub n_active: usize,
    /// Candidates.
    pub n_candidates: usize,
    /// Shift of the diagonal that the zone's stiffness needed, relative.
    pub shift: f32,
    /// Which zone and which factor of the exterior were used.
    pub zone: u64,
    /// Counts factors of the exterior.
    pub factor: u64,
}

/// Work for another thread: a zone, or a factor of its exterior.
#[derive(Debug)]
pub struct Rebuild {
    model: Arc<Model>,
    pattern: Arc<ColumnPattern>,
    memory: Memory,
    displacements: Vec<Vec3>,
    plan: PlanOrCentre,
    outside: Option<Box<Outside>>,
    id: u64,
}

#[derive(Debug)]
enum PlanOrCentre {
    Same(Arc<Plan>),
    New { id: u64, centre: Vec3, radius: f64 },
}

/// What came of a [`Rebuild`].
#[derive(Debug)]
pub struct Rebuilt {
    plan: Arc<Plan>,
    inside: Option<Box<Inside>>,
    /// None where it failed.
    outside: Option<Box<Outside>>,
}

impl Rebuild {
    /// Does the work. Cost: a factor of the whole body.
    pub fn run(self) -> Rebuilt {
        let (model, pattern, memory) = (&*self.model, &*self.pattern, &self.memory);
        let (plan, inside) = match self.plan {
            PlanOrCentre::Same(plan) => (plan, None),
            PlanOrCentre::New { id, centre, radius } => {
                // Not too large: the whole body's pattern was not when the first zone was made.
                let Ok(plan) = Plan::new(model, pattern, id, centre, radius) else {
                    unreachable!("a zone's factor is smaller than the body's")
                };
                let inside = Inside::new(model, memory, pattern, &plan);
                (Arc::new(plan), Some(Box::new(inside)))
            }
        };
        let recycled = self.outside.filter(|_| inside.is_none());
        let mut outside =
            recycled.unwrap_or_else(|| Box::new(Outside::new(model, memory, pattern, &plan)));
        outside.batches.refresh(model, memory);
        outside.id = self.id;
        let made = outside.refactor(model, memory, pattern, &plan, &self.displacements);
        Rebuilt {
            plan,
            inside,
            outside: made.is_ok().then_some(outside),
        }
    }
}

/// A body that follows tools in real time.
#[derive(Debug)]
pub struct Live {
    model: Arc<Model>,
    pattern: Arc<ColumnPattern>,
    params: LiveParams,
    state: State,
    memory: Memory,
    plan: Arc<Plan>,
    inside: Box<Inside>,
    outside: Box<Outside>,
    spare: Option<Box<Outside>>,
    problem: ContactProblem,
    /// Force of the tools on skin vertices, N, and where friction holds them, in the tool's frame. `[n_vertices]`
    contact_forces: Vec<Vec3>,
    anchors: Vec<Vec3>,
    /// Internal forces of the zone's prisms at the present displacements, N. `[n_nodes]`
    forces: Vec<Vec3>,
    x: Vec<f32>,
    right: Vec<f32>,
    moves: Vec<f32>,
    before: Vec<Vec3>,
    /// The tools where they were last followed to.
    tools: Vec<PosedTool>,
    job: Option<Rebuild>,
    is_job_out: bool,
    n_jobs: u64,
    n_zones: u64,
    depth_at_factor: f64,
}

impl Live {
    /// A body at rest, with its first zone where the tools are.
    ///
    /// # Errors
    /// When the body is too large to be factored, or cannot be at rest.
    pub fn new(model: Arc<Model>, tools: &[PosedTool], params: LiveParams) -> Result<Self, FemError> {
        let pattern = Arc::new(column_pattern(&model));
        let state = State::new(&model);
        let mut memory = Memory::new(&model);
        memory.begin(&model, &state, 0.0);
        let centre = zone_centre(&model, &state.displacements, tools);
        let plan = Arc::new(Plan::new(&model, &pattern, 1, centre, params.zone_radius)?);
        let inside = Box::new(Inside::new(&model, &memory, &pattern, &plan));
        let mut outside = Box::new(Outside::new(&model, &memory, &pattern, &plan));
        outside
            .refactor(&model, &memory, &pattern, &plan, &state.displacements)
            .map_err(|trouble| match trouble {
                Trouble::Inverted(at) => FemError::NoRest { at: at.into() },
                Trouble::Singular => FemError::NoRest { at: centre.into() },
            })?;
        let n = model.n_nodes();
        let n_dofs = model.structure.n_dofs();
        Ok(Self {
            problem: ContactProblem::new(MOST_CANDIDATES),
            contact_forces: vec![Vec3::zeros(); model.body.n_vertices()],
            anchors: vec![Vec3::zeros(); model.body.n_vertices()],
            forces: vec![Vec3::zeros(); n],
            x: vec![0.0; n_dofs],
            right: vec![0.0; n_dofs],
            moves: Vec::with_capacity(n_dofs),
            before: vec![Vec3::zeros(); n],
            tools: tools.to_vec(),
            job: None,
            is_job_out: false,
            n_jobs: 0,
            n_zones: 1,
            depth_at_factor: 0.0,
            spare: None,
            model,
            pattern,
            params,
            state,
            memory,
            plan,
            inside,
            outside,
        })
    }

    /// Displacements of all nodes, m. Those outside the zone are brought up to date by [`Self::settle`].
    pub fn displacements(&self) -> &[Vec3] {
        &self.state.displacements
    }

    /// The model.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Force of the tissue on a tool, N.
    pub fn tool_force(&self, tool: usize) -> Vec3 {
        -self
            .problem
            .candidates
            .iter()
            .filter(|c| c.tool as usize == tool)
            .map(|c| c.force)
            .sum::<Vec3>()
    }

    /// Follows the tools to where they are now.
    pub fn step(&mut self, tools: &[PosedTool], dt: f64) -> LiveReport {
        if self.model.has_memory {
            self.memory.begin(&self.model, &self.state, dt);
            self.inside.batches.refresh(&self.model, &self.memory);
            self.outside.batches.refresh(&self.model, &self.memory);
        }
        self.tools.clear();
        self.tools.extend_from_slice(tools);
        let mut report = LiveReport {
            outcome: StepOutcome::Arrived,
            iterations: 0,
            residual: 0.0,
            n_active: 0,
            n_candidates: 0,
            shift: 0.0,
            zone: self.plan.id,
            factor: self.outside.id,
        };
        while report.iterations < self.params.max_iterations {
            report.iterations += 1;
            match self.iterate(&mut report) {
                Ok(()) if report.residual <= self.params.tolerance => break,
                Ok(()) => {}
                Err(_) => {
                    report.outcome = StepOutcome::Failed;
                    break;
                }
            }
        }
        if self.model.has_memory && report.outcome != StepOutcome::Failed {
            self.memory.commit(&self.model, &mut self.state);
        }
        self.ask();
        report
    }

    /// One Newton iteration. An error leaves the state as it was.
    fn iterate(&mut self, report: &mut LiveReport) -> Result<(), Trouble> {
        let (model, plan) = (Arc::clone(&self.model), Arc::clone(&self.plan));
        let is_followed = self.params.exterior == ExteriorMode::Followed;
        self.internal_forces()?;
        if is_followed {
            self.outside.follow(&model, &self.memory, &plan, &self.state.displacements)?;
        }
        let shift = self.inside.refactor(
            &model,
            &self.memory,
            &self.pattern,
            &plan,
            &self.outside,
            &self.state.displacements,
        )?;
        report.shift = report.shift.max(shift);
        self.right_side();
        self.x.copy_from_slice(&self.right);
        self.inside.solve(&plan, &mut self.x);
        self.find_candidates();
        report.n_candidates = self.problem.candidates.len();
        let vertices = self.problem.candidates.iter().map(|c| c.vertex);
        self.inside.compliance(&plan, vertices, &mut self.problem.compliance);
        self.problem.solve(&self.tools);
        // The same system with the forces that contact has found.
        let width = model.body.n_levels;
        for candidate in &self.problem.candidates {
            let vertex = candidate.vertex as usize;
            let change = candidate.force - self.contact_forces[vertex];
            let dof = plan.tree.first_dof(vertex);
            for c in 0..3 {
                self.right[dof + c] += change[c] as f32;
            }
        }
        self.x.copy_from_slice(&self.right);
        self.inside.solve(&plan, &mut self.x);
        for &[node, _] in &plan.zone {
            self.before[node as usize] = self.state.displacements[node as usize];
        }
        debug_assert!(width > 0);
        let mut share = 1.0;
        loop {
            self.take(share);
            let ok = self.internal_forces();
            if ok.is_ok() {
                break;
            }
            share *= 0.5;
            report.outcome = StepOutcome::BackedOff;
            if share < 0.05 {
                self.take(0.0);
                return Err(Trouble::Singular);
            }
        }
        self.accept_contact(share);
        if is_followed {
            self.outside.settle(&model, &plan, &mut self.state.displacements, &mut self.x);
        }
        report.n_active = self.problem.candidates.iter().filter(|c| c.force != Vec3::zeros()).count();
        report.residual = self.residual();
        Ok(())
    }

    /// Takes a share of the step that is in `x`, from `before`.
    fn take(&mut self, share: f64) {
        for &[node, dof] in &self.plan.zone {
            let step = Vec3::from_fn(|c, _| f64::from(self.x[dof as usize + c]));
            let step = self.model.supports[node as usize].free_part(&step);
            self.state.displacements[node as usize] = self.before[node as usize] + step * share;
        }
    }

    /// Internal forces of the zone's prisms.
    fn internal_forces(&mut self) -> Result<(), Trouble> {
        let levels = self.model.body.n_levels;
        for &v in &self.plan.vertices {
            let first = v as usize * levels;
            self.forces[first..first + levels].fill(Vec3::zeros());
        }
        self.inside.batches.add_forces(
            &self.model,
            &self.memory,
            &self.state.displacements,
            &mut self.forces,
        )?;
        Ok(())
    }

    /// Forces out of balance, reduced to the zone.
    fn right_side(&mut self) {
        self.right.fill(0.0);
        let levels = self.model.body.n_levels;
        for &[node, dof] in &self.plan.zone {
            let node = node as usize;
            let mut force = -self.forces[node];
            if node % levels == 0 {
                force += self.contact_forces[node / levels];
            }
            let force = self.model.supports[node].free_part(&force);
            for c in 0..3 {
                self.right[dof as usize + c] = force[c] as f32;
            }
        }
        self.outside
            .push(&self.plan, &self.state.displacements, &mut self.right, &mut self.moves);
    }

    /// Forces out of balance in the zone off its ring, as a share of the tools'.
    fn residual(&self) -> f64 {
        let levels = self.model.body.n_levels;
        let ring = self.model.structure.n_dofs() - 3 * self.plan.ring.len();
        let mut sum = 0.0;
        for &[node, dof] in &self.plan.zone {
            let node = node as usize;
            if dof as usize >= ring {
                continue;
            }
            let mut force = -self.forces[node];
            if node % levels == 0 {
                force += self.contact_forces[node / levels];
            }
            sum += self.model.supports[node].free_part(&force).norm_squared();
        }
        let size: f64 = self.problem.candidates.iter().map(|c| c.force.norm_squared()).sum();
        (sum / size.max(1e-12)).sqrt()
    }

    /// Vertices of the zone that press or are near a tool, those nearest first; where the step in `x` takes them.
    fn find_candidates(&mut self) {
        let model = &self.model;
        let candidates = &mut self.problem.candidates;
        candidates.clear();
        for &v in &self.plan.vertices {
            let vertex = v as usize;
            let node = model.body.node(vertex, 0);
            if model.supports[node].n == 3 {
                continue;
            }
            let x = model.body.positions[node] + self.state.displacements[node];
            let dof = self.plan.tree.first_dof(vertex);
            let step = Vec3::from_fn(|c, _| f64::from(self.x[dof + c]));
            let position = x + model.supports[node].free_part(&step);
            let force = self.contact_forces[vertex];
            let nearest = self
                .tools
                .iter()
                .enumerate()
                .map(|(t, tool)| (t, tool.tool.distance_at(&tool.pose, &position).distance))
                .min_by(|a, b| a.1.total_cmp(&b.1));
            let Some((tool, gap)) = nearest else { continue };
            let presses = force != Vec3::zeros();
            if gap > self.params.reach && !presses {
                continue;
            }
            candidates.push(Candidate {
                vertex: v,
                tool: tool as u32,
                position,
                force,
                anchor: self.anchors[vertex],
                is_new: !presses,
                normal: Vec3::z(),
                gap: if presses { f64::NEG_INFINITY } else { gap },
            });
        }
        if candidates.len() > MOST_CANDIDATES {
            candidates.select_nth_unstable_by(MOST_CANDIDATES - 1, |a, b| a.gap.total_cmp(&b.gap));
            candidates.truncate(MOST_CANDIDATES);
        }
        candidates.sort_unstable_by_key(|c| c.vertex);
    }

    /// Takes over a share of what contact has found.
    fn accept_contact(&mut self, share: f64) {
        for candidate in &mut self.problem.candidates {
            let vertex = candidate.vertex as usize;
            let before = self.contact_forces[vertex];
            candidate.force = before + (candidate.force - before) * share;
            self.contact_forces[vertex] = candidate.force;
            let PosedTool { tool, pose } = &self.tools[candidate.tool as usize];
            let pressure = candidate.force.dot(&candidate.normal);
            let friction = candidate.force - candidate.normal * pressure;
            let slides = friction.norm() >= tool.friction() * pressure * (1.0 - 1e-6);
            if candidate.is_new || slides {
                let node = self.model.body.node(vertex, 0);
                let x = self.model.body.positions[node] + self.state.displacements[node];
                let surface = x - candidate.normal * tool.distance_at(pose, &x).distance;
                candidate.anchor = pose.inverse_transform_point(&surface.into()).coords;
            }
            self.anchors[vertex] = candidate.anchor;
        }
    }

    /// Asks for a rebuild where it is due.
    fn ask(&mut self) {
        if self.is_job_out || self.job.is_some() || self.params.zone_radius.is_infinite() {
            return;
        }
        let centre = zone_centre(&self.model, &self.state.displacements, &self.tools);
        let is_leaving =
            (centre - self.plan.centre).norm() > self.params.leave * self.params.zone_radius;
        let depth = self.depth();
        let is_stale = (depth - self.depth_at_factor).abs() > self.params.stale;
        if !(is_leaving || is_stale) {
            return;
        }
        self.n_jobs += 1;
        self.depth_at_factor = depth;
        let plan = if is_leaving {
            self.n_zones += 1;
            let (id, radius) = (self.n_zones, self.params.zone_radius);
            PlanOrCentre::New { id, centre, radius }
        } else {
            PlanOrCentre::Same(Arc::clone(&self.plan))
        };
        self.job = Some(Rebuild {
            model: Arc::clone(&self.model),
            pattern: Arc::clone(&self.pattern),
            memory: self.memory.clone(),
            displacements: self.state.displacements.clone(),
            plan,
            outside: self.spare.take(),
            id: self.n_jobs,
        });
    }

    /// Deepest displacement of a vertex that presses, m.
    fn depth(&self) -> f64 {
        self.problem
            .candidates
            .iter()
            .filter(|c| c.force != Vec3::zeros())
            .map(|c| self.state.displacements[self.model.body.node(c.vertex as usize, 0)].norm())
            .fold(0.0, f64::max)
    }

    /// Brings the displacements outside the zone up to date. Cost: a substitution through the exterior.
    pub fn settle(&mut self) {
        self.outside
            .settle(&self.model, &self.plan, &mut self.state.displacements, &mut self.x);
    }

    /// Work for another thread, if any is due; its result is to be given to [`Self::install`].
    pub fn take_job(&mut self) -> Option<Rebuild> {
        let job = self.job.take();
        self.is_job_out |= job.is_some();
        job
    }

    /// Takes over what came of a job.
    pub fn install(&mut self, done: Rebuilt) {
        self.is_job_out = false;
        let Some(outside) = done.outside else { return };
        self.settle();
        self.plan = done.plan;
        let old = std::mem::replace(&mut self.outside, outside);
        if let Some(inside) = done.inside {
            self.inside = inside;
            self.spare = None;
        } else {
            self.spare = Some(old);
        }
        // Nodes that were in the old zone and are outside the new one follow from here on.
        self.settle();
    }
}

/// The skin's point nearest to the tools, at rest.
fn zone_centre(model: &Model, displacements: &[Vec3], tools: &[PosedTool]) -> Vec3 {
    let mut best = (f64::INFINITY, Vec3::zeros());
    for (vertex, point) in model.body.skin.points.iter().enumerate() {
        let x = point + displacements[model.body.node(vertex, 0)];
        for tool in tools {
            let distance = tool.tool.distance_at(&tool.pose, &x).distance;
            if distance < best.0 {
                best = (distance, *point);
            }
        }
    }
    best.1
}
