//! A body with a coarse mesh that is fine where the tools are.

use std::fmt::Debug;
use std::sync::Arc;

use palpa_mesh::Vec3;

use super::super::plan::Centres;
use super::carry::{Carry, Come};
use super::pressed::{Pressed, nearest_point};
use super::{Live, LiveParams, LiveReport, Rebuild, Rebuilt, Start, StepOutcome, rest};
use crate::batch::History;
use crate::error::FemError;
use crate::model::Model;
use crate::posed_tool::PosedTool;

/// Largest number of steps that bring a body to equilibrium on a new mesh, and number of those after which the exterior
/// gets a new stiffness instead of another linearisation only.
const MOST_SETTLING: usize = 7;
const KEEPS_STIFFNESS: usize = 4;
/// Unbalanced forces of the exterior with which a body is taken up there, as a share of the tools' force. The answer of
/// the exterior corrects them to first order.
const MOST_OUTSIDE: f64 = 0.05;
/// Shares of the displacements from rest with which a body begins on a new mesh, until it settles: a deep dent may turn
/// other prisms inside out.
const SHARES: [f64; 3] = [1.0, 0.8, 0.5];
/// Most steps that bring a body with tension to rest on a new mesh, each with a new stiffness, and
/// the largest displacement in a step, m, at which it is at rest.
const REST_STEPS: usize = 8;
const REST_CHANGE: f64 = 1e-8;
/// Distance of the tools from the centre of the fine part at which the mesh moves, and distance by
/// which the next centre lies ahead of them, less than the first, so that a mesh that has just come does not
/// move again; both as a share of the radius of the fine part.
const LEAVE: f64 = 0.45;
const LEAD: f64 = 0.35;
/// Speed of tools in the air above which no job is worth while: where they come down is not known yet, and a job would
/// only keep the one waiting that is needed there. m/s
const FAST: f64 = 0.05;
/// Speed along the skin above which tools that press stroke it, m/s.
const STROKE: f64 = 3e-3;
/// Speed of the tools below which they head nowhere, m/s.
const SLOWEST: f64 = 1e-3;

/// Meshes of one body, each fine around another place. All have the same levels and the same skin
/// at rest.
pub trait FineBodies: Debug + Send + Sync {
    /// The place (at rest, m) whose mesh suits a point of the skin best. Cost: negligible.
    fn place(&self, point: Vec3) -> Vec3;

    /// Radius of the fine part around a place, m.
    fn radius(&self) -> f64;

    /// The body that is fine around a place. Not called on the thread of the steps.
    ///
    /// # Errors
    /// When there is no such mesh.
    fn model(&self, place: Vec3) -> Result<Arc<Model>, FemError>;
}

/// [`Live`] on a mesh that moves with the tools.
///
/// The mesh is fine around a place. When the tools leave its centre, the background makes the mesh
/// of a place ahead of them. It carries the present body over to that mesh and brings it to
/// equilibrium there. Changes since then are added when the new mesh takes over. On each mesh,
/// zones move as usual.
#[derive(Debug)]
pub struct Roaming {
    bodies: Option<Arc<dyn FineBodies>>,
    params: LiveParams,
    live: Box<Live>,
    /// The place (at rest, m) over which the first tool is, or is on its way in the air, if it is known.
    aim: Option<Vec3>,
    /// Centre of the fine part at rest, m.
    place: Vec3,
    /// The mesh to be used next, with its place at rest, m.
    next: Option<(Vec3, Arc<Model>)>,
    is_job_out: bool,
    /// Whether the last job was a zone. Then a mesh comes first, if one is due.
    was_zone: bool,
    /// Number of meshes used so far, and of meshes that could not be taken up.
    n_meshes: u64,
    n_failed: u64,
    /// The last place (at rest, m) that has no mesh, or to whose mesh the body could not be carried
    /// over.
    refused: Option<Vec3>,
    /// A body that is no longer needed; freed by the next job in the background.
    retired: Option<Box<Live>>,
}

/// A job for the background thread.
#[derive(Debug)]
pub struct RoamJob {
    kind: Kind,
    retired: Option<Box<Live>>,
}

#[derive(Debug)]
enum Kind {
    Zone(Rebuild),
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
    /// Whether tools press outside the zone of the old mesh.
    was_beyond: bool,
    /// Whether tools go along the skin that they press.
    is_stroke: bool,
    /// Displacements of the old mesh at rest, m.
    rest: Arc<[Vec3]>,
    tools: Vec<PosedTool>,
    params: LiveParams,
    /// Centres at rest and radii of the first zone, which holds what the tools press: outside a zone, a body may not be
    /// stable without its tools. m
    zone: (Centres, [f64; 2]),
    lag: f64,
    n_before: u64,
}

/// A body on another mesh, in the state of the time of the request.
#[derive(Debug)]
struct Moved {
    place: Vec3,
    live: Box<Live>,
    carry: Carry,
    then: Come,
    /// As [`Move::was_beyond`].
    was_beyond: bool,
    /// Whether the exterior has its own stiffness.
    has_own: bool,
    lag: f64,
}

impl RoamJob {
    /// Does the work. Cost: that of a zone, or of a mesh; or, for moving a body to a mesh, of some
    /// zones and steps.
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
        let rest = self.rest_on(&carry)?;
        let come = if self.come.is_at_rest() {
            Come::rest(&self.new, &rest)
        } else {
            carry.onto(&self.old, &self.come, &self.new, [&self.rest, &rest])
        };
        let live = SHARES.iter().find_map(|&share| {
            let come = come.nearer_to(&rest, share);
            self.settled(come, Arc::clone(&rest))
        })?;
        Some(Box::new(Moved {
            place: self.place,
            live,
            carry,
            then: self.come,
            was_beyond: self.was_beyond,
            has_own: !self.is_stroke,
            lag: self.lag,
        }))
    }

    /// The body on the new mesh in equilibrium with the tools, found from a state near it.
    fn settled(&self, come: Come, rest: Arc<[Vec3]>) -> Option<Box<Live>> {
        let model = Arc::clone(&self.new);
        let start = Start {
            zone: self.zone,
            come,
            n_before: self.n_before,
        };
        let live = Live::at(model, &self.tools, self.params, start, rest).ok()?;
        let mut live = Box::new(live);
        live.exterior.set_lag(self.lag);
        // The whole body must be in balance, so each step is followed by another linearisation of the exterior. Its
        // unbalanced forces, N; infinite before the first. At last it gets its own stiffness, without which forces were up
        // to 16 % too large as soon as the tools went deeper. A stroke cannot wait for that: its next zone brings it.
        let mut outside = f64::INFINITY;
        let mut is_own = self.come.is_at_rest() || self.is_stroke;
        for round in 1..=MOST_SETTLING {
            let report = live.step(&self.tools, 0.0);
            live.take_back_job();
            if matches!(report.outcome, StepOutcome::Held | StepOutcome::Failed) {
                return None;
            }
            let is_good = report.outcome == StepOutcome::Arrived
                && report.residual <= self.params.tolerance
                && report.iterations == 1;
            let is_balanced = is_good && outside <= MOST_OUTSIDE * live.tools_force();
            if is_balanced && is_own {
                return Some(live);
            }
            let keeps = round <= KEEPS_STIFFNESS && !is_balanced;
            let found = if keeps { live.linearise_again() } else { None };
            outside = found.unwrap_or(0.0);
            if found.is_none() {
                is_own = true;
                live.jobs.ask_for_factor();
                live.ask(0.0);
                if let Some(job) = live.take_job() {
                    live.install(job.run());
                }
            }
        }
        None
    }
}

impl Move {
    /// Displacements of the new mesh at rest, m. With tension the static solver finds them where the
    /// steps do not; it uses the threads of rayon's pool.
    fn rest_on(&self, carry: &Carry) -> Option<Arc<[Vec3]>> {
        if self.new.is_tense() {
            let found = self.rest_by_steps(carry);
            return found.or_else(|| rest::displacements(&self.new).ok());
        }
        Some(Arc::from(vec![Vec3::zeros(); self.new.n_nodes()]))
    }

    /// As [`Self::rest_on`]: the rest of the old mesh, brought to equilibrium on the new one in steps
    /// of infinite duration without tools. `None` if that fails, as in coarse triangles that tension
    /// bends strongly.
    fn rest_by_steps(&self, carry: &Carry) -> Option<Arc<[Vec3]>> {
        let model = Arc::clone(&self.new);
        let rest: Arc<[Vec3]> = carry.displacements(&model, &self.rest).into();
        let come = Come::rest(&model, &rest);
        let start = Start {
            zone: self.zone,
            come,
            n_before: 0,
        };
        let mut live = Live::at(model, &[], self.params, start, rest).ok()?;
        let mut before = live.state.displacements.clone();
        for _ in 0..REST_STEPS {
            live.jobs.ask_for_factor();
            if live.step(&[], f64::INFINITY).outcome != StepOutcome::Arrived {
                return None;
            }
            if let Some(mut job) = live.take_job() {
                // Nothing presses, so the zone need not move.
                job.target = None;
                live.install(job.run());
            }
            live.settle();
            let now = &live.state.displacements;
            let changes = now.iter().zip(&before).map(|(now, before)| now - before);
            if changes.map(|change| change.amax()).fold(0.0, f64::max) < REST_CHANGE {
                return Some(live.state.displacements.into());
            }
            before.copy_from_slice(now);
        }
        None
    }
}

impl Moved {
    /// Continues from the present state of the old mesh.
    fn take_over(self, old: &mut Live) -> Box<Live> {
        old.take_back_job();
        if !self.was_beyond {
            // Else the new mesh is in equilibrium with tools that pressed there already.
            old.ease_beyond();
        }
        old.settle();
        let mut live = self.live;
        let model = Arc::clone(&live.model);
        for v in 0..model.body.n_vertices() {
            let models = [&*old.model, &*model];
            let now = self.carry.touch(v, &old.skin, models);
            let before = self.carry.touch(v, &self.then.skin, models);
            let skin = &mut live.skin;
            let more = now.pressure - before.pressure;
            skin.pressures[v] = (skin.pressures[v] + more).max(0.0);
            skin.pushes[v] += now.push - before.push;
            skin.frictions[v] += now.friction - before.friction;
            skin.anchors[v] = now.anchor;
            if skin.pressures[v] == 0.0 {
                skin.clear(v);
                continue;
            }
            skin.is_anchored[v] = now.is_anchored;
            skin.is_sliding[v] = now.is_sliding;
        }
        if model.has_memory {
            let mut change = History::new(&old.model);
            old.remember(&mut change);
            if let Some(then) = &self.then.history {
                change.add(-1.0, then, false);
            }
            let change = self.carry.history(&old.model, &change, &model);
            live.inside.batches.add(&change);
            if let Some(follower) = live.exterior.follower_mut() {
                follower.batches.add(&change);
            }
        }
        let lag = live.exterior.lag() + old.exterior.lag() - self.lag;
        live.exterior.set_lag(lag.max(0.0));
        live.course.tools.copy_from_slice(&old.course.tools);
        live.course.pace.clone_from(&old.course.pace);
        live.course.clearance = old.course.clearance;
        live.jobs.latency = old.jobs.latency;
        live.recovery.pace = old.recovery.pace;
        live.forget_forces();
        if self.has_own {
            live.jobs.is_factored_at(old.depth());
        } else {
            live.jobs.ask_for_factor();
        }
        live.add_change(&self.carry, &self.then.state.displacements, old);
        live
    }
}

impl Live {
    /// Brings the exterior up to the zone, and linearises it about that state with the stiffness that it has, if no job
    /// is out. Returns its unbalanced forces, N; `None` if that cannot be done: it needs a new stiffness then. Cost: two
    /// substitutions and the forces of the exterior's prisms.
    fn linearise_again(&mut self) -> Option<f64> {
        if self.model.has_memory || !self.exterior.answers_linearly() {
            return None;
        }
        self.load_exterior();
        if self.presses_beyond() {
            return None;
        }
        self.settle();
        let outside = Arc::get_mut(&mut self.outside)?;
        let shop = self.jobs.shop()?;
        let residual = outside.follow(
            &self.model,
            &self.memory,
            &self.plan,
            &mut shop.follower,
            &self.state.displacements,
        );
        let kept = self.kept;
        self.forget_forces();
        self.kept = kept;
        residual.ok()
    }

    /// Adds how the displacements of the old mesh have changed, or a smaller share of it where all of it would turn a
    /// prism inside out: what is missing then comes with the next steps. The state to return to remains the one in
    /// which the body settled.
    fn add_change(&mut self, carry: &Carry, then: &[Vec3], old: &Self) {
        let (plan, model) = (Arc::clone(&self.plan), Arc::clone(&self.model));
        let now = &old.state.displacements;
        let is_followed = self.exterior.is_followed();
        let mut added = 0.0;
        for share in [1.0, 0.5, 0.0] {
            for v in 0..model.body.n_vertices() {
                // Displacements outside the zone follow from the exterior's.
                let n_moved = if is_followed || plan.is_inside[v] {
                    model.structure.n_free_levels
                } else {
                    0
                };
                for l in 0..n_moved {
                    let by = |u: &[Vec3]| carry.displacement(v, l, &model, u);
                    let change = (by(now) - by(then)) * (share - added);
                    self.state.displacements[model.body.node(v, l)] += change;
                }
            }
            added = share;
            if self.internal_forces().is_ok() {
                break;
            }
        }
    }
}

impl Roaming {
    /// A body on one mesh that does not move.
    pub fn fixed(live: Live) -> Self {
        Self {
            bodies: None,
            params: live.params,
            place: Vec3::zeros(),
            live: Box::new(live),
            aim: None,
            next: None,
            is_job_out: false,
            was_zone: false,
            n_meshes: 1,
            n_failed: 0,
            refused: None,
            retired: None,
        }
    }

    /// A body at rest, fine around the tools.
    ///
    /// # Errors
    /// When there is no mesh for the place, the body is too large to be factored, or is not stable
    /// at rest.
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

    /// The body on the present mesh.
    pub fn live(&self) -> &Live {
        &self.live
    }

    /// As [`Self::live`], mutable.
    pub fn live_mut(&mut self) -> &mut Live {
        &mut self.live
    }

    /// Centre (at rest, m) and radius (m) of the fine part of the mesh; `None` for a mesh that does
    /// not move.
    pub fn fine(&self) -> Option<(Vec3, f64)> {
        let bodies = self.bodies.as_ref()?;
        Some((self.place, bodies.radius()))
    }

    /// Number of meshes used so far, and of meshes that could not be taken up.
    pub fn n_meshes(&self) -> [u64; 2] {
        [self.n_meshes, self.n_failed]
    }

    /// See [`Live::step`]. If the tools press outside the zone or the fine part of the mesh, the
    /// outcome is "behind".
    pub fn step(&mut self, tools: &[PosedTool], dt: f64) -> LiveReport {
        let mut report = self.live.step(tools, dt);
        self.forget_places();
        let is_beyond = report.n_far > 0 || self.is_beyond();
        if report.outcome == StepOutcome::Arrived && is_beyond {
            report.outcome = StepOutcome::Behind;
        }
        report
    }

    /// See [`Live::has_given_up_job`].
    pub fn has_given_up_job(&self) -> bool {
        self.live.has_given_up_job()
    }

    fn is_beyond(&self) -> bool {
        let (Some(bodies), Some(pressed)) = (&self.bodies, self.live.pressed()) else {
            return false;
        };
        let middle = Centres::new(1, |_| pressed.middle);
        let reach = self.live.contact_radius(&middle);
        (pressed.middle - self.place).norm() + reach > bodies.radius()
    }

    /// Tells where (at rest, m) the first tool will touch the skin, while it is in the air; `None` if that is not known.
    /// The mesh and the zone for that place are made while the tool is on its way.
    pub fn set_aim(&mut self, aim: Option<Vec3>) {
        self.aim = aim;
    }

    fn is_in_air(&self) -> bool {
        self.live.problem.pressing().next().is_none()
    }

    /// Whether the tools fly to another place.
    fn is_on_way(&self) -> bool {
        let is_fast = || self.live.course.pace.velocity().norm() > FAST;
        self.bodies.is_some() && self.is_in_air() && is_fast()
    }

    /// Drops what is no longer wanted while the tools are in the air.
    fn forget_places(&mut self) {
        if self.bodies.is_none() || !self.is_in_air() {
            return;
        }
        if self.is_on_way() {
            // A zone would be for a place on the way.
            self.live.take_back_job();
        }
        if let Some((place, _)) = &self.next
            && !self.is_useful(*place)
        {
            self.next = None;
        }
        if self.aim.is_some() && self.live.has_factor_out() && self.next_place().is_some() {
            self.live.give_up_factor();
        }
    }

    /// A job for the background thread, if one is due. Give its result to [`Self::install`]. Zones and meshes take
    /// turns under contact; a finished mesh is taken up first. In the air, and where tools press outside the zone, a mesh
    /// comes first: it brings a zone.
    ///
    /// A call that returns no job changes nothing: a replay makes only those that returned one.
    pub fn take_job(&mut self) -> Option<RoamJob> {
        if self.is_job_out {
            return None;
        }
        let is_in_air = self.is_in_air();
        let is_on_way = self.is_on_way();
        if is_on_way {
            self.aim?;
        }
        let is_mesh_first =
            self.next.is_some() || self.was_zone || is_in_air || self.live.presses_beyond();
        let zone = |live: &mut Live| live.take_job().map(Kind::Zone);
        // Without contact and aim this check searches the skin, so it is made once a step.
        let kind = if is_on_way {
            self.ask()
        } else if is_mesh_first {
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
                was_beyond: self.live.presses_beyond(),
                is_stroke: self.is_stroke(),
                rest: Arc::clone(&self.live.rest),
                tools: self.live.course.tools.clone(),
                params: self.params,
                zone: self.zone_on_new_mesh(),
                lag: self.live.exterior.lag(),
                n_before: self.live.jobs.n_zones.max(self.live.jobs.n_asked),
            })));
        }
        (self.next_place()).map(|place| Kind::Mesh(bodies, place))
    }

    /// Whether a mesh that was made for a place still does: the tools may have gone elsewhere meanwhile.
    fn is_useful(&self, place: Vec3) -> bool {
        let radius = self
            .bodies
            .as_ref()
            .map_or(f64::INFINITY, |bodies| bodies.radius());
        (place - self.heading(radius).0).norm() < LEAVE * radius
    }

    /// The place of the mesh that is due, m, if one is.
    fn next_place(&self) -> Option<Vec3> {
        let bodies = self.bodies.as_ref()?;
        let (middle, ahead) = self.heading(bodies.radius());
        if (middle - self.place).norm() < LEAVE * bodies.radius() {
            return None;
        }
        let place = bodies.place(middle + ahead);
        let is_nearer = (place - middle).norm() < (self.place - middle).norm();
        let is_new = place != self.place && self.refused != Some(place);
        (is_nearer && is_new).then_some(place)
    }

    /// Centres and radii of the first zone on a new mesh, m: where the tools press, or where the first will touch.
    fn zone_on_new_mesh(&self) -> (Centres, [f64; 2]) {
        let (centres, radii) = self.live.present_zone();
        let Some(aim) = self.aim.filter(|_| self.is_in_air()) else {
            return (centres, radii);
        };
        let n = self.live.course.tools.len();
        let centres = Centres::new(n, |tool| if tool == 0 { aim } else { centres.of(tool) });
        (centres, radii)
    }

    fn velocity_along_skin(&self, Pressed { along, .. }: &Pressed) -> Vec3 {
        let velocity = self.live.course.pace.velocity();
        velocity - along * along.dot(&velocity)
    }

    fn is_stroke(&self) -> bool {
        let pressed = self.live.pressed();
        pressed.is_some_and(|pressed| self.velocity_along_skin(&pressed).norm() > STROKE)
    }

    /// The place where the skin is pressed, or would be, and the centre of the next fine part ahead
    /// of it; at rest, m.
    fn heading(&self, radius: f64) -> (Vec3, Vec3) {
        let live = &self.live;
        if let Some(pressed) = live.pressed() {
            let ahead = self.velocity_along_skin(&pressed).try_normalize(SLOWEST);
            return (pressed.middle, ahead.unwrap_or_default() * (LEAD * radius));
        }
        if let Some(aim) = self.aim {
            return (aim, Vec3::zeros());
        }
        let displacements = &live.state.displacements;
        let (_, point) = nearest_point(&live.model, displacements, &live.course.tools, None);
        (point, Vec3::zeros())
    }

    /// Call it instead of [`Self::install`] if the job panicked. The body keeps its zone and mesh,
    /// and requests another job.
    pub fn job_failed(&mut self) {
        self.is_job_out = false;
        // The body's own job is out only if it was a zone.
        if self.was_zone {
            self.live.job_failed();
        }
    }

    /// Installs the result of a job.
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
