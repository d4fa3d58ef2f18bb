//! The moving step.

mod carry;
mod glance;
mod roaming;

use std::sync::Arc;

use palpa_mesh::Vec3;
use palpa_sparse::ColumnPattern;

use super::batch::History;
use super::contact::{Candidate, ContactProblem};
use super::local::LocalModel;
use super::zone::{Follower, Inside, Outside, Plan, Trouble, Workshop};
use super::{MOST_CANDIDATES, column_pattern};
use crate::contact::PosedTool;
use crate::error::FemError;
use crate::law::Prony;
use crate::model::Model;
use crate::state::{Memory, State};
use carry::Come;
pub use glance::Glance;
pub use roaming::{FineBodies, RoamDone, RoamJob, Roaming};

/// First spring that holds vertices under a tool where the free body is not stable, relative to their own stiffness, its
/// growth, the largest, and the least and most iterations after which a smaller one is tried: twice as many each time that it does
/// not do.
const FIRST_SPRING: f64 = 0.03;
const SPRING_GROWTH: f64 = 3.0;
const MOST_SPRING: f64 = 10.0;
const SPRING_PATIENCE: [u32; 2] = [2, 32];
/// How near to the edge of its zone what presses may come, as a share of the radius, before tools are followed no farther that way.
const EDGE: f64 = 0.95;
/// Growth of the zone's radius where vertices of its ring press.
const ZONE_GROWTH: f64 = 1.3;
/// Share of an iteration below which it has failed.
const LEAST_SHARE: f64 = 0.05;
/// Residual above which tools are followed more slowly, and that above which a step has lost the body; the slowest.
const ROUGH: f64 = 0.1;
const LOST: f64 = 0.6;
const LEAST_PACE: f64 = 1.0 / 64.0;
/// Failed steps in a row after which a body begins again at rest; by how much its tools are lifted from it at a time, m, and
/// how often.
const MOST_FAILED: u32 = 8;
const LIFT: f64 = 2e-3;
const MOST_LIFTS: usize = 100;
/// A force below which a residual is not relative to it, N.
const LEAST_FORCE: f64 = 0.01;
/// A body that nothing touches is still where an iteration moves its zone by no more than this, m, and its forces are in
/// balance within this share of the tolerance.
const STILL: f64 = 1e-8;
const STILL_SHARE: f64 = 0.1;
/// A tool may come this fast for the vertices that it reaches to be candidates in time, m/s, and the least reach, m.
const FASTEST: f64 = 0.1;
const LEAST_REACH: f64 = 0.2e-3;
/// Time after which a linear exterior that remembers is asked to be brought up to date, as a share of its shortest time of
/// relaxation, and its limits, s.
const LAG_SHARE: f64 = 0.5;
const LAGS: [f64; 2] = [0.01, 0.05];
/// Vertices beside those that press that are candidates at most, and how many may be candidates anyway.
const MOST_NEAR: usize = 24;
const LEAST_CANDIDATES: usize = 60;

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
    /// How far a tool that is this near to the skin, or nearer, may go in one step, m. One that is asked to go farther is
    /// followed over several steps, so that it cannot jump through the skin.
    pub longest_move: f64,
    /// Indentation after which the exterior's stiffness is asked to be made anew, m.
    pub stale: f64,
}

impl Default for LiveParams {
    fn default() -> Self {
        Self {
            zone_radius: 15e-3,
            exterior: ExteriorMode::Followed,
            max_iterations: 2,
            tolerance: 0.01,
            reach: 1.5e-3,
            leave: 0.2,
            longest_move: 3e-3,
            stale: 1e-3,
        }
    }
}

impl LiveParams {
    /// How far a tool may go while a job is under way, m: out of the zone's middle, or as far as the stiffness of a followed
    /// exterior serves.
    pub fn longest_way(&self) -> f64 {
        let way = self.leave * self.zone_radius;
        match self.exterior {
            ExteriorMode::Followed => way.min(self.stale),
            ExteriorMode::Linear => way,
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
    /// On the way there: it was too far for one step. The local model is that of the place reached.
    Behind,
    /// Part of the way only, because tissue would have been turned inside out, or far from equilibrium, or with a matrix that had
    /// to be changed to be factored: the next steps go on from here, and the local model is none to be felt.
    BackedOff,
    /// Nowhere; the state is the last good one, and the tools are followed more slowly from there.
    Failed,
}

/// What a moving step did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiveReport {
    /// How it ended.
    pub outcome: StepOutcome,
    /// Newton iterations; none while nothing touches a body that is at rest.
    pub iterations: usize,
    /// Forces out of balance in the zone, as a share of the tools'.
    pub residual: f64,
    /// The same in an exterior that is followed.
    pub outside: f64,
    /// Vertices that press.
    pub n_active: usize,
    /// Candidates.
    pub n_candidates: usize,
    /// Shift of the diagonal that the zone's stiffness needed, relative.
    pub shift: f32,
    /// Springs that held the vertices under the tools while it was solved, relative to the skin's own stiffness. Their
    /// forces are taken out again.
    pub spring: f64,
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
    /// The exterior that the displacements outside the zone follow; none where they are up to date.
    old: Option<(Arc<Plan>, Arc<Outside>)>,
    plan: PlanOrCentre,
    /// Kept from the last rebuild.
    shop: Option<Box<Shop>>,
    /// Duration of a step, and time that the exterior's memory is behind, s.
    dt: f64,
    lag: f64,
    /// What prisms remember that are not in the shop, or all of them.
    history: Option<History>,
    /// Memory that is no longer needed: used again, or freed where nobody waits.
    retired: Option<Arc<Outside>>,
    is_followed: bool,
    id: u64,
}

#[derive(Debug)]
enum PlanOrCentre {
    Same(Arc<Plan>),
    New { id: u64, centre: Vec3, radius: f64 },
}

/// The exterior's prisms with their tangents, and where it is factored.
#[derive(Debug)]
struct Shop {
    /// The zone that it is the exterior of.
    plan: u64,
    follower: Follower,
    workshop: Workshop,
}

impl Shop {
    fn new(model: &Model, memory: &Memory, pattern: &ColumnPattern, plan: &Plan) -> Self {
        Self {
            plan: plan.id,
            follower: Follower::new(model, memory, pattern, plan, true),
            workshop: Workshop::new(model, pattern, plan),
        }
    }
}

/// What came of a [`Rebuild`].
#[derive(Debug)]
pub struct Rebuilt {
    plan: Arc<Plan>,
    /// What a new zone needs; the follower where the exterior is followed.
    inside: Option<(Box<Inside>, Option<Box<Follower>>)>,
    /// None where it failed.
    outside: Option<Arc<Outside>>,
    shop: Box<Shop>,
}

impl Rebuild {
    /// Does the work. Cost: a factor of the whole body.
    ///
    /// # Panics
    /// Never: a body that could be factored with one zone can with another.
    pub fn run(mut self) -> Rebuilt {
        let (model, pattern, memory) = (&*self.model, &*self.pattern, &self.memory);
        let is_new = matches!(self.plan, PlanOrCentre::New { .. });
        let plan = match self.plan {
            PlanOrCentre::Same(plan) => plan,
            PlanOrCentre::New { id, centre, radius } => {
                let plan = Plan::new(model, pattern, id, centre, radius);
                Arc::new(
                    plan.expect("a body that could be factored with one zone can with another"),
                )
            }
        };
        let (same, mut other) = match self.shop {
            Some(shop) if shop.plan == plan.id => (Some(shop), None),
            other => (None, other),
        };
        let mut shop = same.unwrap_or_else(|| Box::new(Shop::new(model, memory, pattern, &plan)));
        if let Some((plan, old)) = &self.old {
            let mut scratch = palpa_sparse::fronts::SolveScratch::new(&plan.tree);
            let x = &mut shop.workshop.x;
            old.settle(model, plan, None, &mut self.displacements, x, &mut scratch);
        }
        if let Some(mut history) = self.history.take() {
            let is_linear = self.old.is_some();
            if let (true, Some(old)) = (is_linear, &mut other) {
                self.memory.begin_materials(model, self.lag);
                let batches = &mut old.follower.batches;
                batches.commit_lanes(&self.memory, &self.displacements);
                batches.store(&mut history);
            }
            shop.follower.batches.load(&history);
            self.history = Some(history);
        } else if model.has_memory {
            self.memory.begin_materials(model, self.lag);
            let batches = &mut shop.follower.batches;
            batches.commit_lanes(&self.memory, &self.displacements);
        }
        if model.has_memory {
            self.memory.begin_materials(model, self.dt);
            shop.follower.batches.begin_lanes(&self.memory);
        }
        let memory = &self.memory;
        let recycled = self
            .retired
            .filter(|old| old.plan == plan.id)
            .and_then(Arc::into_inner);
        let mut outside = recycled.unwrap_or_else(|| Outside::new(model, &plan));
        outside.id = self.id;
        let Shop {
            follower, workshop, ..
        } = &mut *shop;
        let made = outside.refactor(
            model,
            memory,
            pattern,
            &plan,
            follower,
            workshop,
            &self.displacements,
        );
        let inside = is_new.then(|| {
            let mut follower = self
                .is_followed
                .then(|| Box::new(Follower::new(model, memory, pattern, &plan, false)));
            let mut inside = Box::new(Inside::new(model, memory, pattern, &plan));
            if let Some(history) = &self.history {
                inside.batches.load(history);
                if let Some(follower) = &mut follower {
                    follower.batches.load(history);
                }
            }
            (inside, follower)
        });
        Rebuilt {
            plan,
            inside,
            shop: match (&made, other) {
                (Err(_), Some(old)) => old,
                _ => shop,
            },
            outside: made.is_ok().then(|| Arc::new(outside)),
        }
    }
}

/// A body that follows tools in real time.
#[derive(Debug)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "independent flags, none of them a state"
)]
pub struct Live {
    model: Arc<Model>,
    pattern: Arc<ColumnPattern>,
    params: LiveParams,
    state: State,
    memory: Memory,
    plan: Arc<Plan>,
    inside: Box<Inside>,
    outside: Arc<Outside>,
    /// Where the exterior is followed.
    follower: Option<Box<Follower>>,
    shop: Option<Box<Shop>>,
    retired: Option<Arc<Outside>>,
    problem: ContactProblem,
    has_friction: bool,
    /// Forces of the tools on skin vertices: pressing, N, and of friction, N; and where friction holds them, in the tool's
    /// frame, m. `[n_vertices]`
    pressures: Vec<f64>,
    frictions: Vec<Vec3>,
    anchors: Vec<Vec3>,
    /// Internal forces of the zone's prisms at the present displacements, N. `[n_nodes]`
    forces: Vec<Vec3>,
    /// Whether they are those of the present displacements.
    is_fresh: bool,
    /// Whether the exterior's are, where it is followed, and how much they are out of balance, N.
    is_outside_fresh: bool,
    outside_residual: f64,
    /// Whether nothing touched the body in the last step, which left it as it was: there is nothing to solve.
    is_still: bool,
    x: Vec<f32>,
    moves: Vec<f32>,
    before: Vec<Vec3>,
    tools: Vec<PosedTool>,
    /// The last state of the zone that was near equilibrium, and the share of the longest move that a step may make from
    /// where it is now.
    good: Vec<Vec3>,
    good_pressures: Vec<f64>,
    good_tools: Vec<PosedTool>,
    pace: f64,
    /// Steps in a row that failed.
    n_failed: u32,
    /// Least gap between tools and the zone's skin, m.
    clearance: f64,
    /// Springs under the tools, relative to the skin's stiffness, the iterations since they were changed, and those after which
    /// smaller ones are tried.
    spring: f64,
    spring_age: u32,
    spring_patience: u32,
    job: Option<Rebuild>,
    is_job_out: bool,
    n_jobs: u64,
    n_zones: u64,
    /// Steps since the job was asked for, and those that the last one took.
    job_age: u32,
    latency: u32,
    /// How far the tools go in a step, smoothed, m.
    drift: Vec3,
    depth_at_factor: f64,
    /// Whether the exterior's last state is none to go on from.
    is_outside_lost: bool,
    /// Time that a linear exterior's memory is behind, and may be, s.
    lag: f64,
    longest_lag: f64,
}

/// What presses: its middle at rest, weighted with the forces, m, and their direction.
struct Pressed {
    middle: Vec3,
    along: Vec3,
}

impl Live {
    /// A body at rest, with its first zone where the tools are.
    ///
    /// # Errors
    /// When the body is too large to be factored, or cannot be at rest.
    pub fn new(
        model: Arc<Model>,
        tools: &[PosedTool],
        params: LiveParams,
    ) -> Result<Self, FemError> {
        let come = Come::rest(&model);
        let centre = nearest_point(&model, &come.state.displacements, tools, None).1;
        Self::at(model, tools, params, centre, come, 0)
    }

    /// A body that goes on from what it has come to, with its first zone round a point of the skin at rest. Zones are counted from
    /// `n_before` on.
    fn at(
        model: Arc<Model>,
        tools: &[PosedTool],
        params: LiveParams,
        centre: Vec3,
        come: Come,
        n_before: u64,
    ) -> Result<Self, FemError> {
        let pattern = Arc::new(column_pattern(&model));
        let state = come.state;
        let mut memory = Memory::new(&model);
        memory.begin(&model, &state, 0.0);
        let n_zones = n_before + 1;
        let plan = Plan::new(&model, &pattern, n_zones, centre, params.zone_radius)?;
        let mut inside = Box::new(Inside::new(&model, &memory, &pattern, &plan));
        let mut shop = Box::new(Shop::new(&model, &memory, &pattern, &plan));
        let is_followed = params.exterior == ExteriorMode::Followed;
        let mut follower =
            is_followed.then(|| Box::new(Follower::new(&model, &memory, &pattern, &plan, false)));
        if let Some(history) = &come.history {
            inside.batches.load(history);
            shop.follower.batches.load(history);
            if let Some(follower) = &mut follower {
                follower.batches.load(history);
            }
        }
        if model.has_memory {
            shop.follower.batches.begin(&model, &mut memory, &state);
        }
        let mut outside = Outside::new(&model, &plan);
        outside.id = n_before;
        let Shop {
            follower: others,
            workshop,
            ..
        } = &mut *shop;
        let here = &state.displacements;
        outside
            .refactor(&model, &memory, &pattern, &plan, others, workshop, here)
            .map_err(|trouble| match trouble {
                Trouble::Inverted(at) => FemError::NoRest { at: at.into() },
                Trouble::Singular => FemError::NoRest { at: centre.into() },
            })?;
        let n = model.n_nodes();
        let n_dofs = model.structure.n_dofs();
        Ok(Self {
            plan: Arc::new(plan),
            inside,
            outside: Arc::new(outside),
            follower,
            shop: Some(shop),
            retired: None,
            problem: ContactProblem::new(),
            has_friction: false,
            good: state.displacements.clone(),
            good_pressures: come.pressures.clone(),
            pressures: come.pressures,
            frictions: come.frictions,
            anchors: come.anchors,
            forces: vec![Vec3::zeros(); n],
            is_fresh: false,
            is_outside_fresh: false,
            outside_residual: 0.0,
            is_still: false,
            x: vec![0.0; n_dofs],
            moves: vec![0.0; n_dofs],
            before: vec![Vec3::zeros(); n],
            tools: tools.to_vec(),
            good_tools: tools.to_vec(),
            pace: 1.0,
            n_failed: 0,
            clearance: 0.0,
            spring: 0.0,
            spring_age: 0,
            spring_patience: SPRING_PATIENCE[0],
            job: None,
            is_job_out: false,
            n_jobs: n_before,
            n_zones,
            job_age: 0,
            latency: 0,
            drift: Vec3::zeros(),
            depth_at_factor: 0.0,
            is_outside_lost: false,
            lag: 0.0,
            longest_lag: longest_lag(&model),
            model,
            pattern,
            params,
            state,
            memory,
        })
    }

    /// Displacements of all nodes, m. Where the exterior answers linearly those outside the zone are brought up to date by
    /// [`Self::settle`].
    pub fn displacements(&self) -> &[Vec3] {
        &self.state.displacements
    }

    /// The model.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Columns of the zone, of its ring, and of the body.
    pub fn n_columns(&self) -> [usize; 3] {
        let tree = &self.plan.tree;
        [
            tree.n_zone_columns(),
            tree.n_ring_columns(),
            tree.n_columns(),
        ]
    }

    /// Force of the tissue on a tool, N.
    pub fn tool_force(&self, tool: usize) -> Vec3 {
        let candidates = self.problem.candidates.iter();
        -candidates
            .filter(|c| c.tool as usize == tool)
            .map(Candidate::force)
            .sum::<Vec3>()
    }

    /// The local model at the tools' present place, with at most `most` contacts; beyond that, neighbours that press are put
    /// together.
    pub fn local_model(&mut self, most: usize, out: &mut LocalModel) {
        let skin = &self.model.body.skin.points;
        let (tools, has_friction) = (&self.tools, self.has_friction);
        self.problem
            .local_model(tools, skin, has_friction, most, out);
    }

    /// Follows the tools, as many as it was made with, to where they are now. `dt` is the time since the last step, s.
    pub fn step(&mut self, tools: &[PosedTool], dt: f64) -> LiveReport {
        let is_short = self.move_tools(tools);
        self.job_age = self.job_age.saturating_add(1);
        self.has_friction = tools.iter().any(|t| t.tool.friction() > 0.0);
        if self.model.has_memory {
            let (model, state) = (&*self.model, &self.state);
            self.memory.begin_materials(model, dt);
            self.inside.batches.begin(model, &mut self.memory, state);
            if let Some(follower) = &mut self.follower {
                follower.batches.begin(model, &mut self.memory, state);
            }
            self.is_fresh = false;
            self.is_outside_fresh = false;
        }
        let mut report = LiveReport {
            outcome: if is_short {
                StepOutcome::Behind
            } else {
                StepOutcome::Arrived
            },
            iterations: 0,
            residual: 0.0,
            outside: 0.0,
            n_active: 0,
            n_candidates: 0,
            shift: 0.0,
            spring: 0.0,
            zone: self.plan.id,
            factor: self.outside.id,
        };
        while report.iterations < self.params.max_iterations {
            // Once the first iteration has come near, its stiffness and contact directions serve.
            let is_near = report.iterations > 0 && report.residual < ROUGH && report.shift == 0.0;
            report.iterations += 1;
            match self.iterate(dt, is_near, &mut report) {
                Ok(()) if report.residual <= self.params.tolerance => break,
                Ok(()) => {}
                Err(_) => {
                    report.outcome = StepOutcome::Failed;
                    break;
                }
            }
        }
        let mut is_lost = report.outcome == StepOutcome::Failed
            || report.residual.is_nan()
            || report.residual > LOST;
        // What has failed goes back to where the exterior is known.
        if !is_lost {
            is_lost = !self.is_still && self.bring_exterior().is_err();
            report.outside = self.outside_residual / self.tools_force();
            is_lost |= report.outside.is_nan() || report.outside > LOST;
        }
        if is_lost {
            report.outcome = StepOutcome::Failed;
            self.n_failed += 1;
            if self.n_failed < MOST_FAILED {
                self.return_to_good();
            } else {
                self.start_again();
            }
            self.pace = (self.pace * 0.25).max(LEAST_PACE);
        } else if report.residual.max(report.outside) > ROUGH || report.shift > 0.0 {
            report.outcome = StepOutcome::BackedOff;
            self.pace = (self.pace * 0.5).max(LEAST_PACE);
        } else {
            self.pace = (self.pace * 2.0).min(1.0);
            self.n_failed = 0;
            self.keep_good();
            self.is_still = self.is_still || self.is_still_now(&report);
        }
        if self.model.has_memory && report.outcome != StepOutcome::Failed {
            let (model, memory) = (&*self.model, &self.memory);
            self.inside.batches.commit(model, memory, &mut self.state);
            match &mut self.follower {
                Some(follower) => follower.batches.commit(model, memory, &mut self.state),
                None => self.lag += dt,
            }
        }
        self.ask(dt);
        report
    }

    /// The residual of a body that nothing touches, if it is still where it was.
    fn residual_at_rest(&mut self) -> Option<f64> {
        let is_untouched = self.is_still && self.problem.candidates.is_empty();
        let residual = is_untouched.then(|| self.residual());
        let residual = residual.filter(|r| *r <= STILL_SHARE * self.params.tolerance);
        self.is_still = residual.is_some();
        residual
    }

    /// Whether nothing touches the body, and the iteration before moved nothing.
    fn is_still_now(&self, report: &LiveReport) -> bool {
        let move_of = |node: u32| {
            (self.state.displacements[node as usize] - self.before[node as usize]).amax()
        };
        report.n_candidates == 0
            && report.residual.max(report.outside) <= STILL_SHARE * self.params.tolerance
            && self.plan.zone.iter().all(|n| move_of(n[0]) <= STILL)
    }

    /// The body is elsewhere, or another: what was known of its forces is so no more.
    fn forget_forces(&mut self) {
        self.is_still = false;
        self.is_fresh = false;
        self.is_outside_fresh = false;
    }

    /// Remembers the zone's state as one to come back to.
    fn keep_good(&mut self) {
        // Where the exterior answers linearly it goes with the zone.
        if self.follower.is_some() {
            self.good.copy_from_slice(&self.state.displacements);
        } else {
            for &[node, _] in &self.plan.zone {
                self.good[node as usize] = self.state.displacements[node as usize];
            }
        }
        for &v in &self.plan.vertices {
            self.good_pressures[v as usize] = self.pressures[v as usize];
        }
        self.good_tools.copy_from_slice(&self.tools);
    }

    fn return_to_good(&mut self) {
        if self.follower.is_some() {
            self.state.displacements.copy_from_slice(&self.good);
        } else {
            for &[node, _] in &self.plan.zone {
                self.state.displacements[node as usize] = self.good[node as usize];
            }
        }
        for &v in &self.plan.vertices {
            self.pressures[v as usize] = self.good_pressures[v as usize];
            self.frictions[v as usize] = Vec3::zeros();
        }
        self.tools.copy_from_slice(&self.good_tools);
        self.clearance = 0.0;
        self.spring = 0.0;
        self.forget_forces();
    }

    /// Begins at rest, with the tools off the skin: from the last good state there is no way on.
    fn start_again(&mut self) {
        self.n_failed = 0;
        self.state.displacements.fill(Vec3::zeros());
        self.pressures.fill(0.0);
        self.frictions.fill(Vec3::zeros());
        self.spring = 0.0;
        self.forget_forces();
        self.depth_at_factor = f64::INFINITY;
        self.is_outside_lost = true;
        let body = &self.model.body;
        let (_, vertex) = nearest_vertex(&self.model, &self.state.displacements, &self.tools, None);
        let outward = body.positions[body.node(vertex, 0)] - body.positions[body.node(vertex, 1)];
        let step = outward.normalize() * LIFT;
        for _ in 0..MOST_LIFTS {
            let (gap, _) = nearest_vertex(
                &self.model,
                &self.state.displacements,
                &self.tools,
                Some(&self.plan.vertices),
            );
            if gap > 0.0 {
                break;
            }
            for tool in &mut self.tools {
                tool.pose.translation.vector += step;
            }
        }
        self.clearance = 0.0;
        self.keep_good();
    }

    /// Moves the tools, no farther than one step may; returns whether that is short of where they were to go.
    fn move_tools(&mut self, tools: &[PosedTool]) -> bool {
        /// Share of the last step in the smoothed one.
        const NEW: f64 = 0.2;
        debug_assert_eq!(self.tools.len(), tools.len());
        let mut is_short = false;
        let held = self.held_direction();
        let before: Vec3 = self.tools.iter().map(|t| t.pose.translation.vector).sum();
        for (tool, target) in self.tools.iter_mut().zip(tools) {
            let mut target = *target;
            let way = target.pose.translation.vector - tool.pose.translation.vector;
            let outward = held.map_or(0.0, |outward| outward.dot(&way));
            if let (Some(direction), true) = (held, outward > 0.0) {
                is_short = true;
                target.pose.translation.vector -= direction * outward;
            }
            let way = (target.pose.translation.vector - tool.pose.translation.vector).norm();
            let most = (self.params.longest_move * self.pace).max(self.clearance);
            let pose = if way <= most {
                target.pose
            } else {
                is_short = true;
                tool.pose.lerp_slerp(&target.pose, most / way)
            };
            *tool = PosedTool {
                tool: target.tool,
                pose,
            };
        }
        let after: Vec3 = self.tools.iter().map(|t| t.pose.translation.vector).sum();
        let way = (after - before) / self.tools.len().max(1) as f64;
        self.drift += (way - self.drift) * NEW;
        is_short
    }

    /// Where what presses has come to the edge of the zone and none is there to take over: the direction across the skin in which
    /// tools are not followed, for there they would press what is no candidate.
    fn held_direction(&self) -> Option<Vec3> {
        if self.plan.exterior.is_empty()
            || self.contact_radius(self.plan.centre) < EDGE * self.plan.radius
        {
            return None;
        }
        let pressed = self.pressed()?;
        let out = pressed.middle - self.plan.centre;
        let out = out - pressed.along * pressed.along.dot(&out);
        out.try_normalize(1e-9)
    }

    /// The middle of what presses.
    fn pressed(&self) -> Option<Pressed> {
        let points = &self.model.body.skin.points;
        let (mut force, mut middle, mut along) = (0.0, Vec3::zeros(), Vec3::zeros());
        for candidate in &self.problem.candidates {
            force += candidate.pressure;
            middle += points[candidate.vertex as usize] * candidate.pressure;
            along += candidate.normal * candidate.pressure;
        }
        (force > 0.0).then(|| Pressed {
            middle: middle / force,
            along: along.normalize(),
        })
    }

    /// One Newton iteration. After an error the state is none to go on from.
    fn iterate(&mut self, dt: f64, is_near: bool, report: &mut LiveReport) -> Result<(), Trouble> {
        let plan = Arc::clone(&self.plan);
        if !self.is_fresh {
            self.internal_forces()?;
        }
        if !self.is_outside_fresh {
            self.follow()?;
        }
        if is_near {
            self.measure_gaps();
        } else {
            self.find_candidates(dt);
            if let Some(residual) = self.residual_at_rest() {
                report.iterations = 0;
                report.residual = residual;
                return Ok(());
            }
            self.refactor(report)?;
        }
        self.right_side();
        self.inside.substitute(&plan, &mut self.x);
        if !is_near {
            self.inside
                .comply(&plan, self.has_friction, &mut self.problem);
        }
        self.inside
            .project(&plan, &self.x, self.has_friction, &mut self.problem);
        self.problem.solve(&self.tools, self.has_friction);
        self.inside.push(&plan, &self.problem, &mut self.x);
        self.inside.back_substitute(&plan, &mut self.x);
        for &[node, _] in &plan.zone {
            self.before[node as usize] = self.state.displacements[node as usize];
        }
        let mut share = 1.0;
        loop {
            self.take(share);
            if self.internal_forces().is_ok() {
                break;
            }
            share *= 0.5;
            report.outcome = StepOutcome::BackedOff;
            if share < LEAST_SHARE {
                self.take(0.0);
                return Err(Trouble::Singular);
            }
        }
        self.accept_contact(share);
        report.n_candidates = self.problem.candidates.len();
        report.n_active = self
            .problem
            .candidates
            .iter()
            .filter(|c| c.pressure > 0.0)
            .count();
        report.residual = self.residual();
        Ok(())
    }

    /// Where the exterior is followed: its displacements and forces with those of the ring, once a step. Within the step it answers
    /// linearly.
    fn bring_exterior(&mut self) -> Result<(), Trouble> {
        let Some(follower) = &mut self.follower else {
            return Ok(());
        };
        self.outside.settle(
            &self.model,
            &self.plan,
            None,
            &mut self.state.displacements,
            &mut self.moves,
            &mut follower.solve,
        );
        self.follow()
    }

    /// Where the exterior is followed: its forces at the present displacements.
    fn follow(&mut self) -> Result<(), Trouble> {
        self.is_outside_fresh = false;
        if let (Some(follower), Some(outside)) =
            (&mut self.follower, Arc::get_mut(&mut self.outside))
        {
            let displacements = &self.state.displacements;
            self.outside_residual = outside.follow(
                &self.model,
                &self.memory,
                &self.plan,
                follower,
                displacements,
            )?;
        }
        self.is_outside_fresh = true;
        Ok(())
    }

    /// Makes the zone's stiffness and factor. Where the body is not stable without its tools, springs hold the vertices
    /// under them.
    fn refactor(&mut self, report: &mut LiveReport) -> Result<(), Trouble> {
        let (model, pattern, plan) = (&*self.model, &*self.pattern, &*self.plan);
        let inside = &mut self.inside;
        inside.assemble(
            model,
            &self.memory,
            pattern,
            plan,
            &self.state.displacements,
        )?;
        let pressed = self
            .problem
            .candidates
            .iter()
            .filter(|c| c.pressure > 0.0)
            .map(|c| c.vertex);
        let size = inside.skin_stiffness(pattern, pressed);
        self.spring_age += 1;
        let mut is_less = false;
        if self.spring > 0.0 && self.spring_age > self.spring_patience {
            self.spring_age = 0;
            is_less = true;
            self.spring /= SPRING_GROWTH;
            if self.spring < 0.5 * FIRST_SPRING {
                self.spring = 0.0;
            }
        }
        let (mut there, usual) = (0.0, self.spring);
        loop {
            let springs = self.spring * size;
            for candidate in &mut self.problem.candidates {
                candidate.support = if candidate.pressure > 0.0 {
                    springs
                } else {
                    0.0
                };
            }
            inside.add_springs(pattern, &self.problem.candidates, springs - there);
            there = springs;
            let may_shift = size == 0.0 || self.spring >= MOST_SPRING;
            match inside.factor(model, pattern, plan, &self.outside, may_shift) {
                Ok(shift) => {
                    report.shift = report.shift.max(shift);
                    report.spring = self.spring;
                    if shift > 0.0 {
                        // Springs were no help; kept, they would hold the skin stiff for a hundred steps.
                        self.spring = usual;
                    }
                    if self.spring == 0.0 {
                        self.spring_patience = SPRING_PATIENCE[0];
                    }
                    return Ok(());
                }
                Err(trouble) if may_shift => return Err(trouble),
                Err(_) => {
                    self.spring_age = 0;
                    if is_less {
                        is_less = false;
                        self.spring_patience = (2 * self.spring_patience).min(SPRING_PATIENCE[1]);
                    }
                    self.spring = (self.spring * SPRING_GROWTH).max(FIRST_SPRING);
                }
            }
        }
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
        self.is_fresh = false;
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
        self.is_fresh = true;
        Ok(())
    }

    /// Forces out of balance, with those of the tools, reduced to the zone, into `x`.
    fn right_side(&mut self) {
        for &[node, dof] in &self.plan.zone {
            let node = node as usize;
            let force = self.model.supports[node].free_part(&-self.forces[node]);
            for c in 0..3 {
                self.x[dof as usize + c] = force[c] as f32;
            }
        }
        for candidate in &self.problem.candidates {
            let vertex = candidate.vertex as usize;
            let force = candidate.force();
            let dof = self.plan.tree.first_dof(vertex);
            let node = self.model.body.node(vertex, 0);
            let sum = self.model.supports[node].free_part(&(force - self.forces[node]));
            for c in 0..3 {
                self.x[dof + c] = sum[c] as f32;
            }
        }
        let displacements = &self.state.displacements;
        self.outside
            .push(&self.plan, displacements, &mut self.x, &mut self.moves);
    }

    /// Forces out of balance in the zone off its ring, as a share of the tools'.
    fn residual(&self) -> f64 {
        let levels = self.model.body.n_levels;
        let ring = self.x.len() - 3 * self.plan.ring.len();
        let sum: f64 = self
            .plan
            .zone
            .iter()
            .filter(|n| (n[1] as usize) < ring && !(n[0] as usize).is_multiple_of(levels))
            .map(|n| self.model.supports[n[0] as usize].free_part(&self.forces[n[0] as usize]))
            .map(|force| force.norm_squared())
            .sum();
        let skin: f64 = self
            .plan
            .vertices
            .iter()
            .filter(|&&v| self.plan.tree.first_dof(v as usize) < ring)
            .map(|&v| {
                let node = self.model.body.node(v as usize, 0);
                let pressed = self
                    .problem
                    .candidates
                    .binary_search_by_key(&v, |c| c.vertex);
                let tool = pressed.map_or(Vec3::zeros(), |i| self.problem.candidates[i].force());
                let force = tool - self.forces[node];
                self.model.supports[node].free_part(&force).norm_squared()
            })
            .sum();
        (sum + skin).sqrt() / self.tools_force()
    }

    /// What forces out of balance are relative to, N.
    fn tools_force(&self) -> f64 {
        let candidates = self.problem.candidates.iter();
        let size: f64 = candidates.map(|c| c.force().norm()).sum();
        size.max(LEAST_FORCE)
    }

    /// Vertices of the zone that press or are near a tool, those nearest first.
    fn find_candidates(&mut self, dt: f64) {
        let model = &self.model;
        let reach = (FASTEST * 2.0 * dt).clamp(LEAST_REACH, self.params.reach);
        let candidates = &mut self.problem.candidates;
        candidates.clear();
        self.clearance = f64::INFINITY;
        for &v in &self.plan.vertices {
            let vertex = v as usize;
            let node = model.body.node(vertex, 0);
            if model.supports[node].n == 3 {
                continue;
            }
            let start = model.body.positions[node] + self.state.displacements[node];
            let distances = self
                .tools
                .iter()
                .map(|tool| tool.tool.distance_at(&tool.pose, &start));
            let nearest = distances
                .enumerate()
                .min_by(|a, b| a.1.distance.total_cmp(&b.1.distance));
            let Some((tool, distance)) = nearest else {
                continue;
            };
            let pressure = self.pressures[vertex];
            self.clearance = self.clearance.min(distance.distance);
            if distance.distance > reach && pressure == 0.0 {
                continue;
            }
            let normal = distance.normal;
            let mut friction = self.frictions[vertex];
            friction -= normal * normal.dot(&friction);
            let anchor = if pressure > 0.0 {
                self.anchors[vertex]
            } else {
                // Where it would touch.
                let surface = start - normal * distance.distance;
                self.tools[tool]
                    .pose
                    .inverse_transform_point(&surface.into())
                    .coords
            };
            candidates.push(Candidate {
                vertex: v,
                tool: tool as u32,
                start,
                normal,
                gap: distance.distance,
                pressure,
                friction,
                support: 0.0,
                anchor,
                displacement: Vec3::zeros(),
            });
        }
        let n_pressing = candidates.iter().filter(|c| c.pressure > 0.0).count();
        let most = (n_pressing + MOST_NEAR).clamp(LEAST_CANDIDATES, MOST_CANDIDATES);
        if candidates.len() > most {
            let order = |c: &Candidate| {
                if c.pressure > 0.0 {
                    f64::NEG_INFINITY
                } else {
                    c.gap
                }
            };
            candidates.select_nth_unstable_by(most - 1, |a, b| {
                order(a).total_cmp(&order(b)).then(a.vertex.cmp(&b.vertex))
            });
            for lost in &candidates[most..] {
                self.pressures[lost.vertex as usize] = 0.0;
                self.frictions[lost.vertex as usize] = Vec3::zeros();
            }
            candidates.truncate(most);
        }
        candidates.sort_unstable_by_key(|c| c.vertex);
    }

    /// Where candidates are now; their normals stay those that the compliance is along.
    fn measure_gaps(&mut self) {
        for candidate in &mut self.problem.candidates {
            let vertex = candidate.vertex as usize;
            let node = self.model.body.node(vertex, 0);
            let PosedTool { tool, pose } = &self.tools[candidate.tool as usize];
            candidate.start = self.model.body.positions[node] + self.state.displacements[node];
            candidate.gap = tool.distance_at(pose, &candidate.start).distance;
            candidate.pressure = self.pressures[vertex];
            candidate.friction = self.frictions[vertex];
            candidate.displacement = Vec3::zeros();
        }
    }

    /// Takes over a share of what contact has found.
    fn accept_contact(&mut self, share: f64) {
        for candidate in &mut self.problem.candidates {
            let vertex = candidate.vertex as usize;
            let before = self.pressures[vertex];
            candidate.pressure = before + (candidate.pressure - before) * share;
            self.pressures[vertex] = candidate.pressure;
            self.frictions[vertex] = candidate.friction;
            if !self.has_friction {
                continue;
            }
            let PosedTool { tool, pose } = &self.tools[candidate.tool as usize];
            let most = tool.friction() * candidate.pressure;
            if candidate.friction.norm() >= most * (1.0 - 1e-6) {
                let node = self.model.body.node(vertex, 0);
                let x = self.model.body.positions[node] + self.state.displacements[node];
                let distance = tool.distance_at(pose, &x);
                let surface = x - distance.normal * distance.distance;
                candidate.anchor = pose.inverse_transform_point(&surface.into()).coords;
            }
            self.anchors[vertex] = candidate.anchor;
        }
    }

    /// Asks for a rebuild where it is due.
    fn ask(&mut self, dt: f64) {
        if self.is_job_out || self.job.is_some() || self.plan.exterior.is_empty() {
            return;
        }
        let ring = self.x.len() - 3 * self.plan.ring.len();
        let reaches_ring = self
            .problem
            .candidates
            .iter()
            .any(|c| c.pressure > 0.0 && self.plan.tree.first_dof(c.vertex as usize) >= ring);
        let radius = self.plan.radius;
        let centre = self.next_centre();
        let is_leaving = (centre - self.plan.centre).norm() > self.params.leave * radius;
        let depth = self.depth();
        let is_stale = (depth - self.depth_at_factor).abs() > self.params.stale
            || self.lag > self.longest_lag
            || self.outside_residual > self.params.tolerance * self.tools_force();
        if !(is_leaving || is_stale || reaches_ring) {
            return;
        }
        self.n_jobs += 1;
        self.job_age = 0;
        self.depth_at_factor = depth;
        let plan = if is_leaving || reaches_ring {
            let mut radius = self
                .params
                .zone_radius
                .max(ZONE_GROWTH * self.contact_radius(centre));
            if reaches_ring && !is_leaving {
                radius = radius.max(ZONE_GROWTH * self.plan.radius);
            }
            self.n_zones += 1;
            let id = self.n_zones;
            PlanOrCentre::New { id, centre, radius }
        } else {
            PlanOrCentre::Same(Arc::clone(&self.plan))
        };
        let is_followed = self.params.exterior == ExteriorMode::Followed;
        let follows_old = !is_followed && !self.is_outside_lost;
        let old = follows_old.then(|| (Arc::clone(&self.plan), Arc::clone(&self.outside)));
        let history = (self.model.has_memory && (is_leaving || reaches_ring || is_followed))
            .then(|| self.history());
        let lag = std::mem::take(&mut self.lag);
        self.bring_up_others(dt, lag);
        self.job = Some(Rebuild {
            model: Arc::clone(&self.model),
            pattern: Arc::clone(&self.pattern),
            memory: self.memory.clone(),
            displacements: self.state.displacements.clone(),
            old,
            plan,
            shop: self.shop.take(),
            retired: self.retired.take(),
            is_followed,
            dt,
            lag,
            history,
            id: self.n_jobs,
        });
    }

    /// What the prisms remember that step by step are moved on here.
    fn history(&self) -> History {
        let mut history = History::new(&self.model);
        self.remember(&mut history);
        history
    }

    fn remember(&self, history: &mut History) {
        self.inside.batches.store(history);
        if let Some(follower) = &self.follower {
            follower.batches.store(history);
        }
    }

    /// Moves on the memory of those prisms of a linear exterior that are evaluated one by one: they are few.
    fn bring_up_others(&mut self, dt: f64, lag: f64) {
        let Some(shop) = self
            .shop
            .as_ref()
            .filter(|_| self.model.has_memory && lag > 0.0)
        else {
            return;
        };
        let batches = &shop.follower.batches;
        self.memory.begin_materials(&self.model, lag);
        batches.commit_others(&self.model, &self.memory, &mut self.state);
        self.memory.begin_materials(&self.model, dt);
        batches.begin_others(&self.model, &mut self.memory, &self.state);
    }

    /// Where a zone is to be that is asked for now: at rest, the middle of what presses, and as far ahead as it will go on
    /// until the zone is there.
    fn next_centre(&self) -> Vec3 {
        let Some(Pressed { middle, along }) = self.pressed() else {
            let displacements = &self.state.displacements;
            let near = nearest_point(
                &self.model,
                displacements,
                &self.tools,
                Some(&self.plan.vertices),
            );
            if near.0 < self.plan.radius {
                return near.1;
            }
            return nearest_point(&self.model, displacements, &self.tools, None).1;
        };
        let lead = self.drift * f64::from(self.latency);
        let lead = lead - along * along.dot(&lead);
        let most = self.params.leave * self.plan.radius;
        middle + lead * (most / lead.norm()).min(1.0)
    }

    /// How far from a point of the skin at rest vertices press, m.
    fn contact_radius(&self, centre: Vec3) -> f64 {
        let points = &self.model.body.skin.points;
        let pressing = self.problem.candidates.iter().filter(|c| c.pressure > 0.0);
        pressing
            .map(|c| (points[c.vertex as usize] - centre).norm())
            .fold(0.0, f64::max)
    }

    /// Deepest displacement of a vertex that presses, m.
    fn depth(&self) -> f64 {
        self.problem
            .candidates
            .iter()
            .filter(|c| c.pressure > 0.0)
            .map(|c| self.state.displacements[self.model.body.node(c.vertex as usize, 0)].norm())
            .fold(0.0, f64::max)
    }

    /// Brings the displacements outside the zone up to date. Cost: a substitution through the exterior, and memory.
    pub fn settle(&mut self) {
        self.settle_columns(None);
    }

    fn settle_columns(&mut self, only: Option<&[u32]>) {
        let mut scratch = palpa_sparse::fronts::SolveScratch::new(&self.plan.tree);
        self.outside.settle(
            &self.model,
            &self.plan,
            only,
            &mut self.state.displacements,
            &mut self.moves,
            &mut scratch,
        );
    }

    /// Takes back work that was asked for and not given out.
    fn take_back_job(&mut self) {
        if let Some(job) = self.job.take() {
            self.shop = job.shop;
            self.retired = job.retired;
            self.lag += job.lag;
        }
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
        self.latency = self.job_age;
        self.shop = Some(done.shop);
        let Some(outside) = done.outside else { return };
        let was_lost = std::mem::take(&mut self.is_outside_lost);
        if done.inside.is_some() && self.follower.is_none() && !was_lost {
            // What was in no zone until now is where the old exterior puts it.
            let entering = done.plan.vertices.iter().copied();
            let entering: Vec<u32> = entering
                .filter(|&v| !self.plan.is_inside[v as usize])
                .collect();
            self.settle_columns(Some(&entering));
        }
        self.plan = done.plan;
        self.retired = Some(std::mem::replace(&mut self.outside, outside));
        if let Some((mut inside, mut follower)) = done.inside {
            if self.model.has_memory {
                // What has been remembered since the job was given out.
                let history = self.history();
                inside.batches.load(&history);
                inside
                    .batches
                    .begin(&self.model, &mut self.memory, &self.state);
                if let Some(follower) = &mut follower {
                    follower.batches.load(&history);
                    follower
                        .batches
                        .begin(&self.model, &mut self.memory, &self.state);
                }
            }
            self.inside = inside;
            self.follower = follower;
            self.keep_good();
        }
        self.forget_forces();
    }
}

fn longest_lag(model: &Model) -> f64 {
    let materials = model.materials.iter().filter_map(|m| m.prony.as_ref());
    let shortest = materials
        .flat_map(Prony::terms)
        .map(|term| term.tau)
        .fold(f64::INFINITY, f64::min);
    if shortest.is_finite() {
        (LAG_SHARE * shortest).clamp(LAGS[0], LAGS[1])
    } else {
        f64::INFINITY
    }
}

/// The least distance of the skin (or of these vertices) from the tools, and the point at rest where that is.
fn nearest_point(
    model: &Model,
    displacements: &[Vec3],
    tools: &[PosedTool],
    among: Option<&[u32]>,
) -> (f64, Vec3) {
    let (distance, vertex) = nearest_vertex(model, displacements, tools, among);
    (distance, model.body.skin.points[vertex])
}

fn nearest_vertex(
    model: &Model,
    displacements: &[Vec3],
    tools: &[PosedTool],
    among: Option<&[u32]>,
) -> (f64, usize) {
    let mut best = (f64::INFINITY, 0);
    let mut look = |vertex: usize| {
        let point = model.body.skin.points[vertex];
        let x = point + displacements[model.body.node(vertex, 0)];
        for tool in tools {
            let distance = tool.tool.distance_at(&tool.pose, &x).distance;
            if distance < best.0 {
                best = (distance, vertex);
            }
        }
    };
    match among {
        Some(vertices) => vertices.iter().for_each(|&v| look(v as usize)),
        None => (0..model.body.n_vertices()).for_each(look),
    }
    best
}
