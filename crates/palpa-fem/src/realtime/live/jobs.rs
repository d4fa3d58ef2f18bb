//! Decides when a background job is due, and installs its result.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use palpa_mesh::Vec3;

use super::super::plan::Centres;
use super::kept::Kept;
use super::pressed::{Pressed, nearest_point};
use super::rebuild::{Made, Rebuild, Rebuilt, Room, Shop, Target};
use super::{ExteriorMode, Live};
use crate::batch::History;
use crate::law::Prony;
use crate::model::Model;

/// Radius of a zone at least, as a multiple of that of the contact: it may grow until the zone is ready.
const ZONE_GROWTH: f64 = 1.3;
/// Radius of a zone above which another one is made, as a multiple of the one that is needed.
const WIDE: f64 = 1.4;
/// Radius within which no vertex is of the ring, as a multiple of that of the contact on its way until the
/// next zone.
const INNER: f64 = 1.1;
/// Where the next zone's centre lies, in ways that the tools go until it is ready. So they are as far behind
/// it when the zone comes as they will be ahead of it when the one after it does.
const AHEAD: f64 = 1.5;
/// Time after which a linear exterior with viscous memory should be updated, as a share of its
/// shortest relaxation time; and the limits of that time, s.
const LAG_SHARE: f64 = 0.5;
const LAGS: [f64; 2] = [0.01, 0.05];

/// Shares of its displacements from rest that a new zone keeps where all of them would turn a prism inside out.
const EASED: [f64; 4] = [0.9, 0.75, 0.5, 0.0];

/// The background jobs of a body.
#[derive(Debug)]
pub(super) struct Jobs {
    job: Job,
    /// Whether the job that is out is no longer wanted.
    is_given_up: Arc<AtomicBool>,
    /// Number of jobs requested so far. Factors and zones take their numbers from it.
    pub(super) n_asked: u64,
    pub(super) n_zones: u64,
    /// Time since the job was requested, s.
    age: f64,
    /// Duration of the last job, s.
    pub(super) latency: f64,
    /// Indentation at the last factor of the exterior, m; infinite to request a new factor.
    depth_at_factor: f64,
    /// Longest time by which the memory of a linear exterior may lag behind, s.
    longest_lag: f64,
    /// Time by which the exterior's memory lagged behind when the present job was requested, s.
    lag_out: f64,
    /// Viscous memory of the exterior's prisms at the end of the last job; `None` if there is none,
    /// or if the exterior is followed.
    pub(super) kept: Option<Arc<History>>,
}

/// Where the job and its room are.
#[derive(Debug)]
enum Job {
    /// No job is requested. The room is `None` after a job that panicked.
    Idle(Option<Box<Room>>),
    /// A job is requested, and no thread has taken it.
    Waiting(Rebuild),
    /// A thread is working on it: on a new zone, or on a new factor of the present exterior.
    Out { is_zone: bool },
}

impl Jobs {
    pub(super) fn new(
        model: &Model,
        room: Box<Room>,
        kept: Option<Arc<History>>,
        n_asked: u64,
        n_zones: u64,
    ) -> Self {
        Self {
            job: Job::Idle(Some(room)),
            is_given_up: Arc::default(),
            n_asked,
            n_zones,
            age: 0.0,
            latency: 0.0,
            depth_at_factor: 0.0,
            longest_lag: longest_lag(model),
            lag_out: 0.0,
            kept,
        }
    }

    /// Counts a step of `dt`, s; infinite for one that takes viscous materials to their end.
    pub(super) fn grow_older(&mut self, dt: f64) {
        if dt.is_finite() {
            self.age += dt;
        }
    }

    /// The prisms of the exterior, if no job has them.
    pub(super) fn shop(&mut self) -> Option<&mut Shop> {
        match &mut self.job {
            Job::Idle(room) => room.as_mut().map(|room| &mut room.shop),
            Job::Waiting(_) | Job::Out { .. } => None,
        }
    }

    /// Requests a new factor of the exterior.
    pub(super) fn ask_for_factor(&mut self) {
        self.depth_at_factor = f64::INFINITY;
    }

    /// Records the indentation (m) at the last factor.
    pub(super) fn is_factored_at(&mut self, depth: f64) {
        self.depth_at_factor = depth;
    }
}

/// A job that is due.
struct Due {
    /// Centres at rest and radii of a new zone, m; `None` for a new factor of the present exterior.
    zone: Option<(Centres, [f64; 2])>,
    /// Indentation, m.
    depth: f64,
}

impl Live {
    /// Requests a job if one is due and none is under way. A factor that is under way is given up for a zone
    /// that is due: it would keep the zone waiting, and the zone has a factor of its own. A followed exterior
    /// needs each factor soon, to come near equilibrium. Cost: a copy of the zone's displacements
    /// and viscous memory; of the whole body's displacements if the exterior is followed.
    pub(super) fn ask(&mut self, dt: f64) {
        if self.has_factor_out() && self.next_zone().is_some() {
            self.give_up_factor();
        }
        if !matches!(self.jobs.job, Job::Idle(_)) || self.plan.exterior.is_empty() {
            return;
        }
        let has_room = matches!(self.jobs.job, Job::Idle(Some(_)));
        let due = if has_room { self.due() } else { None };
        if due.is_none() && has_room {
            return;
        }
        let is_followed = self.params.exterior == ExteriorMode::Followed;
        let mut job = Rebuild {
            model: Arc::clone(&self.model),
            pattern: Arc::clone(&self.pattern),
            plan: Arc::clone(&self.plan),
            target: None,
            old: None,
            room: None,
            kept: self.jobs.kept.clone(),
            dt,
            lag: 0.0,
            is_followed,
            is_pressed: self.problem.pressing().next().is_some(),
            id: self.jobs.n_asked,
            is_given_up: Arc::clone(&self.jobs.is_given_up),
        };
        if let Some(Due { zone, depth }) = due {
            self.jobs.n_asked += 1;
            self.jobs.age = 0.0;
            self.jobs.depth_at_factor = depth;
            job.id = self.jobs.n_asked;
            job.target = zone.map(|(centres, radii)| {
                self.jobs.n_zones += 1;
                let id = self.jobs.n_zones;
                Target { id, centres, radii }
            });
            job.old = self.exterior.origin(&self.outside);
            job.lag = self.exterior.lag();
            self.exterior.set_lag(0.0);
            self.bring_up_singles(dt);
            if let Job::Idle(room) = &mut self.jobs.job {
                job.room = room.take();
            }
            if let Some(room) = &mut job.room {
                let needs_memory = job.target.is_some() || is_followed;
                self.furnish(room, job.old.is_some(), needs_memory);
            }
        }
        self.jobs.job = Job::Waiting(job);
    }

    /// Whether a thread works on a new factor of the exterior that may be given up.
    pub(super) fn has_factor_out(&self) -> bool {
        matches!(self.jobs.job, Job::Out { is_zone: false })
            && self.params.exterior == ExteriorMode::Linear
            && !self.has_given_up_job()
    }

    /// Gives up the factor that a thread works on.
    pub(super) fn give_up_factor(&mut self) {
        self.jobs.is_given_up.store(true, Ordering::Relaxed);
    }

    /// Copies the state that a job needs into its room.
    fn furnish(&self, room: &mut Room, of_zone: bool, with_memory: bool) {
        let (model, displacements) = (&*self.model, &self.state.displacements);
        if of_zone {
            for &[node, _] in &self.plan.zone {
                room.displacements[node as usize] = displacements[node as usize];
            }
        } else {
            room.displacements.copy_from_slice(displacements);
        }
        room.memory.copy_from(model, &self.memory, &self.singles);
        if let (true, Some(history)) = (with_memory, &mut room.history) {
            history.forget();
            self.remember(history);
        }
    }

    /// The job that is due: a new zone if the tools leave the present one or press its ring, or a
    /// new factor if the exterior's is out of date.
    fn due(&self) -> Option<Due> {
        let zone = self.next_zone();
        let depth = self.depth();
        let is_stale = (depth - self.jobs.depth_at_factor).abs() > self.params.stale
            || self.exterior.lag() > self.jobs.longest_lag
            || self.exterior.residual() > self.params.tolerance * self.tools_force();
        (zone.is_some() || is_stale).then_some(Due { zone, depth })
    }

    /// Centres at rest and radii of a new zone, m, if the tools leave the present one or press its ring.
    fn next_zone(&self) -> Option<(Centres, [f64; 2])> {
        let reaches_ring = self.pressing_firmly().any(|c| self.is_at_ring(c.vertex));
        let radius = self.plan.radius;
        let centres = self.next_centres();
        let is_leaving = centres.farthest_from(&self.plan.centres) > self.params.leave * radius;
        let reach = self.reach();
        // Wider than it needs to be: made for coarser triangles, or for a deeper press.
        let needed = self.radius_for(reach);
        let is_wide = radius.is_finite() && radius > WIDE * needed;
        (is_leaving || reaches_ring || is_wide).then(|| {
            // A hand that hurries to another place after a slow job would make the whole body a zone, and each job
            // slower than the one before.
            let even = self.course.pace.velocity().norm() * self.jobs.latency;
            let even = even.min(self.params.longest_ahead());
            let on_its_way = reach + (AHEAD - 1.0) * even;
            (centres, [INNER * on_its_way, needed])
        })
    }

    /// Centres at rest and radii of a zone as far ahead of the tools as it still holds what they press now, m. None of
    /// that is of the ring.
    pub(super) fn present_zone(&self) -> (Centres, [f64; 2]) {
        let reach = self.reach();
        let (inner, radius) = (INNER * reach, self.radius_for(reach));
        let way = self.next_way(radius - inner);
        (self.centres_after(way), [inner + way.norm(), radius])
    }

    /// Radius of a zone for tools whose contact reaches so far, m.
    fn radius_for(&self, reach: f64) -> f64 {
        self.params.zone_radius.max(ZONE_GROWTH * reach)
    }

    /// Whether a vertex lies on the ring: the zone's outermost columns, which answer nearly linearly.
    pub(super) fn is_at_ring(&self, vertex: u32) -> bool {
        self.plan.tree.first_dof(vertex as usize) >= self.first_ring_dof()
    }

    /// Share of the tools' force that vertices of the ring bear.
    pub(super) fn ring_share(&self) -> f64 {
        if self.plan.exterior.is_empty() {
            return 0.0;
        }
        let at_ring = self
            .problem
            .pressing()
            .filter(|c| !c.is_far && self.is_at_ring(c.vertex));
        at_ring.map(|c| c.force().norm()).sum::<f64>() / self.tools_force()
    }

    /// Centres at rest of a zone requested now, one for each tool, m: ahead of the tools by the way that they will
    /// go until the zone is ready, and half of that.
    fn next_centres(&self) -> Centres {
        self.centres_after(self.next_way(AHEAD * self.params.longest_ahead()))
    }

    /// The way that the tools will go until a zone requested now is ready, and half of that, but no more than `most`, m.
    /// None in the air, where a hand that sets out would get a zone for a place on its way.
    fn next_way(&self, most: f64) -> Vec3 {
        if self.problem.pressing().next().is_none() {
            return Vec3::zeros();
        }
        let way = self.course.pace.way_in(AHEAD * self.jobs.latency);
        way * (most / way.norm()).min(1.0)
    }

    fn centres_after(&self, way: Vec3) -> Centres {
        Centres::new(self.course.tools.len(), |tool| self.centre_after(way, tool))
    }

    /// Centre at rest of a zone for a tool that has gone this way, m: the middle of the vertices that it presses,
    /// moved along the skin.
    fn centre_after(&self, way: Vec3, tool: usize) -> Vec3 {
        let Some(Pressed { middle, along }) = self.pressed_by(tool) else {
            let displacements = &self.state.displacements;
            let tools = &self.course.tools;
            let tools = tools.get(tool..=tool).unwrap_or(&[]);
            let zone = Some(&*self.plan.vertices);
            let near = nearest_point(&self.model, displacements, tools, zone);
            if near.0 < self.plan.radius {
                return near.1;
            }
            return nearest_point(&self.model, displacements, tools, None).1;
        };
        middle + (way - along * along.dot(&way))
    }

    /// Writes the memory of the prisms whose memory is updated in every step into a history.
    pub(super) fn remember(&self, history: &mut History) {
        self.inside.batches.store(history);
        if let Some(follower) = self.exterior.follower() {
            follower.batches.store(history);
        }
    }

    /// Updates the memory of those prisms of a linear exterior that are evaluated one by one: they
    /// are few.
    fn bring_up_singles(&mut self, dt: f64) {
        let lag = self.exterior.take_singles_lag();
        if !self.model.has_memory || lag <= 0.0 {
            return;
        }
        let (model, memory, state) = (&*self.model, &mut self.memory, &mut self.state);
        let plan = &self.plan;
        let is_outside =
            |pair: usize| !plan.holds(&model.structure.groups[pair % model.n_groups()]);
        let singles = self.singles.iter().map(|&pair| pair as usize);
        let singles = singles.filter(|&pair| is_outside(pair));
        memory.begin_materials(model, lag);
        for pair in singles.clone() {
            memory.commit_group(model, state, pair);
        }
        memory.begin_materials(model, dt);
        for pair in singles {
            memory.begin_group(model, state, pair);
        }
    }

    /// Takes back a job that no thread has taken.
    pub(super) fn take_back_job(&mut self) {
        match std::mem::replace(&mut self.jobs.job, Job::Idle(None)) {
            Job::Waiting(job) => {
                self.jobs.job = Job::Idle(job.room);
                self.exterior.set_lag(self.exterior.lag() + job.lag);
            }
            other => self.jobs.job = other,
        }
    }

    /// A job for the background thread, if one is due. Give its result to [`Self::install`].
    pub fn take_job(&mut self) -> Option<Rebuild> {
        match std::mem::replace(&mut self.jobs.job, Job::Idle(None)) {
            Job::Waiting(job) => {
                let is_zone = job.target.is_some();
                self.jobs.job = Job::Out { is_zone };
                self.jobs.is_given_up.store(false, Ordering::Relaxed);
                self.jobs.lag_out = job.lag;
                Some(job)
            }
            other => {
                self.jobs.job = other;
                None
            }
        }
    }

    /// Whether the job that a thread is working on is given up: its result changes nothing, and comes as
    /// soon as the thread notices.
    pub fn has_given_up_job(&self) -> bool {
        matches!(self.jobs.job, Job::Out { .. }) && self.jobs.is_given_up.load(Ordering::Relaxed)
    }

    /// Call it instead of [`Self::install`] if the job panicked. Its room is lost; the next job makes
    /// another one, with the memory kept at the end of the last good job.
    pub fn job_failed(&mut self) {
        let lag = self.exterior.lag() + self.jobs.lag_out;
        self.exterior.set_lag(lag);
        self.jobs.job = Job::Idle(None);
        self.jobs.ask_for_factor();
    }

    /// Installs the result of a job of this body.
    pub fn install(&mut self, done: Rebuilt) {
        let Rebuilt {
            mut room,
            kept,
            made,
        } = done;
        room.retired.kept = std::mem::replace(&mut self.jobs.kept, kept);
        if self.has_given_up_job() {
            // Whether the thread has noticed is a matter of time, and must make no difference.
            room.retired.outside = made.map(|made| made.outside);
            self.jobs.ask_for_factor();
        } else if let Some(made) = made {
            self.jobs.latency = self.jobs.age;
            self.put_in(made, &mut room);
        }
        self.jobs.job = Job::Idle(Some(room));
    }

    /// Puts new parts in the place of old ones, which stay in the room for the next job.
    fn put_in(&mut self, made: Made, room: &mut Room) {
        let was_linear = self.exterior.renew();
        let (mut inside, mut follower) = (None, None);
        // An older factor does for another exterior of the same zone.
        let kept = if made.zone.is_some() {
            Kept::NONE
        } else {
            self.kept
        };
        if let Some(zone) = made.zone {
            (inside, follower) = (Some(zone.inside), zone.follower);
            room.retired.entering = zone.entering;
        }
        if was_linear && inside.is_some() {
            self.ease_beyond();
        }
        if let (true, Some(entering)) = (was_linear, &mut room.retired.entering) {
            // Columns that enter the zone start at their positions in the old exterior.
            self.outside.settle(
                &self.model,
                &self.plan,
                Some((&entering.columns, &entering.fronts)),
                self.beyond.load(),
                &mut self.state.displacements,
                &mut self.ws.moves,
                &mut entering.scratch,
            );
        }
        room.retired.plan = Some(std::mem::replace(&mut self.plan, made.plan));
        room.retired.outside = Some(std::mem::replace(&mut self.outside, made.outside));
        if let Some(mut inside) = inside {
            if let Some(history) = &mut room.history {
                // The memory has changed since the job was taken.
                history.forget();
                self.remember(history);
                inside.batches.load(history);
                inside
                    .batches
                    .begin(&self.model, &mut self.memory, &self.state);
                if let Some(follower) = &mut follower {
                    follower.batches.load(history);
                    let batches = &mut follower.batches;
                    batches.begin(&self.model, &mut self.memory, &self.state);
                }
            }
            room.retired.inside = Some(std::mem::replace(&mut self.inside, inside));
            room.retired.follower = self.exterior.replace_follower(follower);
            self.ease_zone();
            self.keep_good();
        }
        self.forget_forces();
        self.kept = kept;
    }

    /// Brings a new zone nearer to rest if a prism in it is inside out: no step could go on from there. The old exterior
    /// answers linearly, and where a tool presses deep beside the old zone, its answer may fold prisms.
    fn ease_zone(&mut self) {
        let mut before = 1.0;
        for share in EASED {
            if self.internal_forces().is_ok() {
                break;
            }
            for &[node, _] in &self.plan.zone {
                let rest = self.rest[node as usize];
                let u = &mut self.state.displacements[node as usize];
                *u = rest + (*u - rest) * (share / before);
            }
            before = share;
        }
    }
}

/// Longest time by which the memory of a linear exterior may lag behind, s; infinite without
/// viscous materials.
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
