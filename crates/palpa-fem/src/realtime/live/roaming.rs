//! A coarse body that is fine where the tools are.

use std::fmt::Debug;
use std::sync::Arc;

use palpa_mesh::Vec3;

use super::carry::{Carry, Come};
use super::pressed::{Pressed, nearest_point};
use super::{Live, LiveParams, LiveReport, Rebuild, Rebuilt, StepOutcome};
use crate::error::FemError;
use crate::model::Model;
use crate::posed_tool::PosedTool;

/// Steps in which a body is brought to equilibrium on a new mesh at most, each with a stiffness of
/// its own.
const MOST_SETTLING: usize = 8;
/// How far the tools may be from the middle of the fine part before the mesh moves, as a share of
/// its radius; and how far ahead of them the next middle is put, likewise.
const LEAVE: f64 = 0.25;
const LEAD: f64 = 0.5;

/// Meshes of one body, each fine round another place. All have the same levels, and the same skin
/// at rest.
pub trait FineBodies: Debug + Send + Sync {
    /// The place (at rest, m) whose mesh serves a point of the skin best. Cost: negligible.
    fn place(&self, point: Vec3) -> Vec3;

    /// Radius round a place within which it is fine, m.
    fn radius(&self) -> f64;

    /// The body that is fine round a place. Not called on the thread that steps.
    ///
    /// # Errors
    /// When there is none.
    fn model(&self, place: Vec3) -> Result<Arc<Model>, FemError>;
}

/// [`Live`] on a mesh that moves with the tools.
///
/// The mesh is fine round a place; when the tools leave its middle, the mesh of a place ahead of
/// them is made in the background, the body as it is then is carried over to it and brought to
/// equilibrium there. The changes since then are added when it takes over. Zones move on each
/// mesh as they do on any.
#[derive(Debug)]
pub struct Roaming {
    bodies: Option<Arc<dyn FineBodies>>,
    params: LiveParams,
    live: Box<Live>,
    /// The middle of the fine part at rest, m.
    place: Vec3,
    /// The mesh that is to be taken up, with its place at rest, m.
    next: Option<(Vec3, Arc<Model>)>,
    is_job_out: bool,
    /// Whether the last job was a zone: then a mesh comes first, if one is due.
    was_zone: bool,
    /// Number of meshes so far, and of meshes that could not be taken up.
    n_meshes: u64,
    n_failed: u64,
    /// The last place without a mesh, or with one that the body could not be carried over to; at
    /// rest, m.
    refused: Option<Vec3>,
    /// No longer needed: freed where nobody waits.
    retired: Option<Box<Live>>,
}

/// Work for another thread.
#[derive(Debug)]
pub struct RoamJob {
    kind: Kind,
    retired: Option<Box<Live>>,
}

#[derive(Debug)]
enum Kind {
    Zone(Box<Rebuild>),
    Mesh(Arc<dyn FineBodies>, Vec3),
    Move(Box<Move>),
}

/// The result of a [`RoamJob`].
#[derive(Debug)]
pub struct RoamDone(Done);

#[derive(Debug)]
enum Done {
    Zone(Rebuilt),
    Mesh(Vec3, Option<Arc<Model>>),
    Move(Result<Box<Moved>, Vec3>),
}

/// A body on its way to another mesh.
#[derive(Debug)]
struct Move {
    place: Vec3,
    old: Arc<Model>,
    new: Arc<Model>,
    come: Come,
    tools: Vec<PosedTool>,
    params: LiveParams,
    centre: Vec3,
    lag: f64,
    n_before: u64,
}

/// A body on another mesh, as it was when the work was asked for.
#[derive(Debug)]
struct Moved {
    place: Vec3,
    live: Box<Live>,
    carry: Carry,
    then: Come,
    lag: f64,
}

impl RoamJob {
    /// Does the work. Cost: that of a zone; of a mesh; or, of a body that moves to it, some zones
    /// and steps.
    pub fn run(self) -> RoamDone {
        drop(self.retired);
        RoamDone(match self.kind {
            Kind::Zone(job) => Done::Zone(job.run()),
            Kind::Mesh(bodies, place) => Done::Mesh(place, bodies.model(place).ok()),
            Kind::Move(job) => {
                let place = job.place;
                Done::Move(job.run().ok_or(place))
            }
        })
    }
}

impl Move {
    fn run(self) -> Option<Box<Moved>> {
        let carry = Carry::new(&self.old, &self.new);
        let come = carry.onto(&self.old, &self.come, &self.new);
        let model = Arc::clone(&self.new);
        let (params, n) = (self.params, self.n_before);
        let live = Live::at(model, &self.tools, params, self.centre, come, n).ok()?;
        let mut live = Box::new(live);
        live.exterior.set_lag(self.lag);
        for round in 0..MOST_SETTLING {
            // All of the body takes part: each step asks for a stiffness of the exterior.
            live.jobs.ask_for_factor();
            let report = live.step(&self.tools, 0.0);
            if let Some(job) = live.take_job() {
                live.install(job.run());
            }
            let is_good = report.outcome == StepOutcome::Arrived
                && report.residual <= params.tolerance
                && report.iterations == 1;
            // Once with an exterior of this state at least.
            if round > 0 && is_good {
                return Some(Box::new(Moved {
                    place: self.place,
                    live,
                    carry,
                    then: self.come,
                    lag: self.lag,
                }));
            }
        }
        None
    }
}

impl Moved {
    /// Goes on where the old mesh is by now.
    fn take_over(self, old: &mut Live) -> Box<Live> {
        old.take_back_job();
        old.settle();
        let mut live = self.live;
        let (now, then) = (&old.state.displacements, &self.then.state.displacements);
        let plan = Arc::clone(&live.plan);
        let model = Arc::clone(&live.model);
        let is_followed = live.exterior.is_followed();
        let is_moved = |v: usize| is_followed || plan.is_inside[v];
        for v in (0..model.body.n_vertices()).filter(|&v| is_moved(v)) {
            for l in 0..model.structure.n_free_levels {
                let by = |u: &[Vec3]| self.carry.displacement(v, l, &model, u);
                live.state.displacements[model.body.node(v, l)] += by(now) - by(then);
            }
            let Some(u) = self.carry.same(v) else {
                continue;
            };
            let (skin, now, then) = (&mut live.skin, &old.skin, &self.then.skin);
            let more = now.pressures[u] - then.pressures[u];
            skin.pressures[v] = (skin.pressures[v] + more).max(0.0);
            skin.frictions[v] += now.frictions[u] - then.frictions[u];
            skin.anchors[v] = now.anchors[u];
        }
        if model.has_memory {
            let history = self.carry.history(&old.model, &old.history(), &model);
            live.inside.batches.load(&history);
            if let Some(follower) = live.exterior.follower_mut() {
                follower.batches.load(&history);
            }
        }
        let lag = live.exterior.lag() + old.exterior.lag() - self.lag;
        live.exterior.set_lag(lag.max(0.0));
        live.course.tools.copy_from_slice(&old.course.tools);
        live.course.drift = old.course.drift;
        live.course.clearance = old.course.clearance;
        live.jobs.latency = old.jobs.latency;
        live.recovery.pace = old.recovery.pace;
        live.forget_forces();
        live.jobs.is_factored_at(old.depth());
        live.keep_good();
        live
    }
}

impl Roaming {
    /// On one mesh that stays.
    pub fn fixed(live: Live) -> Self {
        Self {
            bodies: None,
            params: live.params,
            place: Vec3::zeros(),
            live: Box::new(live),
            next: None,
            is_job_out: false,
            was_zone: false,
            n_meshes: 1,
            n_failed: 0,
            refused: None,
            retired: None,
        }
    }

    /// At rest, fine where the tools are.
    ///
    /// # Errors
    /// When there is no mesh for the place, the body is too large to be factored, or cannot be at
    /// rest.
    pub fn new(
        bodies: Arc<dyn FineBodies>,
        tools: &[PosedTool],
        params: LiveParams,
        point: Vec3,
    ) -> Result<Self, FemError> {
        let place = bodies.place(point);
        let live = Live::new(bodies.model(place)?, tools, params)?;
        Ok(Self {
            bodies: Some(bodies),
            place,
            ..Self::fixed(live)
        })
    }

    /// The moving step on the present mesh.
    pub fn live(&self) -> &Live {
        &self.live
    }

    /// The same, to be read from.
    pub fn live_mut(&mut self) -> &mut Live {
        &mut self.live
    }

    /// Round which place (at rest, m) the mesh is fine, and up to which distance, m; none where it
    /// is the same all over or stays.
    pub fn fine(&self) -> Option<(Vec3, f64)> {
        let bodies = self.bodies.as_ref()?;
        Some((self.place, bodies.radius()))
    }

    /// How many meshes there were, and how many could not be taken up.
    pub fn n_meshes(&self) -> [u64; 2] {
        [self.n_meshes, self.n_failed]
    }

    /// See [`Live::step`]. Where the tools press beyond the fine part of the mesh,
    /// the body counts as behind.
    pub fn step(&mut self, tools: &[PosedTool], dt: f64) -> LiveReport {
        let mut report = self.live.step(tools, dt);
        if report.outcome == StepOutcome::Arrived && self.is_beyond() {
            report.outcome = StepOutcome::Behind;
        }
        report
    }

    fn is_beyond(&self) -> bool {
        let (Some(bodies), Some(pressed)) = (&self.bodies, self.live.pressed()) else {
            return false;
        };
        let reach = self.live.contact_radius(pressed.middle);
        (pressed.middle - self.place).norm() + reach > bodies.radius()
    }

    /// Work for another thread, if any is due; its result is to be given to [`Self::install`].
    /// Zones and meshes take turns; a mesh that is made is taken up first.
    pub fn take_job(&mut self) -> Option<RoamJob> {
        if self.is_job_out {
            return None;
        }
        let is_mesh_first = self.next.is_some() || self.was_zone;
        let zone = |live: &mut Live| Some(Kind::Zone(Box::new(live.take_job()?)));
        // Where nothing presses, to ask is a search over the skin: once a step.
        let kind = if is_mesh_first {
            self.ask().or_else(|| zone(&mut self.live))
        } else {
            zone(&mut self.live).or_else(|| self.ask())
        }?;
        self.was_zone = matches!(kind, Kind::Zone(_));
        self.is_job_out = true;
        let retired = self.retired.take();
        Some(RoamJob { kind, retired })
    }

    fn ask(&mut self) -> Option<Kind> {
        let bodies = Arc::clone(self.bodies.as_ref()?);
        if let Some((place, new)) = self.next.take() {
            self.live.take_back_job();
            return Some(Kind::Move(Box::new(Move {
                place,
                old: Arc::clone(&self.live.model),
                new,
                come: Come::of(&mut self.live),
                tools: self.live.course.tools.clone(),
                params: self.params,
                centre: self.live.next_centre(),
                lag: self.live.exterior.lag(),
                n_before: self.live.jobs.n_zones.max(self.live.jobs.n_asked),
            })));
        }
        let (middle, ahead) = self.heading(bodies.radius());
        if (middle - self.place).norm() < LEAVE * bodies.radius() {
            return None;
        }
        let place = bodies.place(middle + ahead);
        let is_nearer = (place - middle).norm() < (self.place - middle).norm();
        let is_new = place != self.place && self.refused != Some(place);
        (is_nearer && is_new).then(|| Kind::Mesh(bodies, place))
    }

    /// Where the skin is pressed, or would be, and how far ahead of that the next mesh is to be
    /// fine; at rest, m.
    fn heading(&self, radius: f64) -> (Vec3, Vec3) {
        let live = &self.live;
        if let Some(Pressed { middle, along }) = live.pressed() {
            let drift = live.course.drift - along * along.dot(&live.course.drift);
            let ahead = drift.try_normalize(1e-6).unwrap_or_default();
            return (middle, ahead * (LEAD * radius));
        }
        let displacements = &live.state.displacements;
        let (_, point) = nearest_point(&live.model, displacements, &live.course.tools, None);
        (point, Vec3::zeros())
    }

    /// Takes over the result of a job.
    pub fn install(&mut self, done: RoamDone) {
        self.is_job_out = false;
        match done.0 {
            Done::Zone(done) => self.live.install(done),
            Done::Mesh(place, Some(model)) => self.next = Some((place, model)),
            Done::Move(Ok(moved)) => {
                self.refused = None;
                self.place = moved.place;
                self.n_meshes += 1;
                let live = moved.take_over(&mut self.live);
                self.retired = Some(std::mem::replace(&mut self.live, live));
            }
            Done::Mesh(place, None) | Done::Move(Err(place)) => {
                self.n_failed += 1;
                self.refused = Some(place);
            }
        }
    }
}
