//! Decides when a background job is due, and installs its result.

use std::sync::Arc;

use palpa_mesh::Vec3;

use super::super::outside::Outside;
use super::pressed::{Pressed, nearest_point};
use super::rebuild::{Rebuild, Rebuilt, Shop, Target};
use super::{ExteriorMode, Live};
use crate::batch::History;
use crate::law::Prony;
use crate::model::Model;

/// Growth factor of the zone's radius when vertices of its ring press.
const ZONE_GROWTH: f64 = 1.3;
/// Time after which a linear exterior with viscous memory should be updated, as a share of its
/// shortest relaxation time; and the limits of that time, s.
const LAG_SHARE: f64 = 0.5;
const LAGS: [f64; 2] = [0.01, 0.05];

/// The background jobs of a body.
#[derive(Debug)]
pub(super) struct Jobs {
    job: Job,
    /// Number of jobs requested so far. Factors and zones take their numbers from it.
    pub(super) n_asked: u64,
    pub(super) n_zones: u64,
    /// Steps since the job was requested.
    age: u32,
    /// Duration of the last job in steps.
    pub(super) latency: u32,
    /// Indentation at the last factor of the exterior, m; infinite to request a new factor.
    depth_at_factor: f64,
    /// Longest time by which the memory of a linear exterior may lag behind, s.
    longest_lag: f64,
}

/// Where the job and the memory that jobs work in are.
#[derive(Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "one to a body, and a box would be allocated in a step"
)]
enum Job {
    /// No job is requested.
    Idle {
        shop: Box<Shop>,
        /// An exterior that is no longer needed.
        retired: Option<Arc<Outside>>,
    },
    /// A job is requested, and no thread has taken it.
    Waiting(Rebuild),
    /// A thread is working on it.
    Out,
}

impl Jobs {
    pub(super) fn new(model: &Model, shop: Box<Shop>, n_asked: u64, n_zones: u64) -> Self {
        Self {
            job: Job::Idle {
                shop,
                retired: None,
            },
            n_asked,
            n_zones,
            age: 0,
            latency: 0,
            depth_at_factor: 0.0,
            longest_lag: longest_lag(model),
        }
    }

    /// Counts a step.
    pub(super) fn grow_older(&mut self) {
        self.age = self.age.saturating_add(1);
    }

    /// Requests a new factor of the exterior.
    pub(super) fn ask_for_factor(&mut self) {
        self.depth_at_factor = f64::INFINITY;
    }

    /// Records the indentation (m) at the last factor.
    pub(super) fn is_factored_at(&mut self, depth: f64) {
        self.depth_at_factor = depth;
    }

    /// The exterior's prisms, unless a job has them.
    pub(super) fn shop(&self) -> Option<&Shop> {
        match &self.job {
            Job::Idle { shop, .. } => Some(shop),
            Job::Waiting(_) | Job::Out => None,
        }
    }
}

/// A job that is due.
struct Due {
    /// Centre at rest (m) and radius (m) of a new zone; `None` for a new factor of the present
    /// exterior.
    zone: Option<(Vec3, f64)>,
    /// Indentation, m.
    depth: f64,
}

impl Live {
    /// Requests a job if one is due and none is under way.
    pub(super) fn ask(&mut self, dt: f64) {
        if self.jobs.shop().is_none() || self.plan.exterior.is_empty() {
            return;
        }
        let Some(Due { zone, depth }) = self.due() else {
            return;
        };
        self.jobs.n_asked += 1;
        self.jobs.age = 0;
        self.jobs.depth_at_factor = depth;
        let target = match zone {
            Some((centre, radius)) => {
                self.jobs.n_zones += 1;
                let id = self.jobs.n_zones;
                Target::New { id, centre, radius }
            }
            None => Target::Same(Arc::clone(&self.plan)),
        };
        let is_followed = self.params.exterior == ExteriorMode::Followed;
        let old = self.exterior.origin(&self.plan, &self.outside);
        let history =
            (self.model.has_memory && (zone.is_some() || is_followed)).then(|| self.history());
        let lag = self.exterior.lag();
        self.exterior.set_lag(0.0);
        self.bring_up_others(dt, lag);
        match std::mem::replace(&mut self.jobs.job, Job::Out) {
            Job::Idle { shop, retired } => {
                self.jobs.job = Job::Waiting(Rebuild {
                    model: Arc::clone(&self.model),
                    pattern: Arc::clone(&self.pattern),
                    memory: self.memory.clone(),
                    displacements: self.state.displacements.clone(),
                    old,
                    target,
                    shop,
                    retired,
                    is_followed,
                    dt,
                    lag,
                    history,
                    id: self.jobs.n_asked,
                });
            }
            other => self.jobs.job = other,
        }
    }

    /// The job that is due: a new zone if the tools leave the present one or press its ring, or a
    /// new factor if the exterior's is out of date.
    fn due(&self) -> Option<Due> {
        let ring = self.first_ring_dof();
        let reaches_ring = self
            .problem
            .pressing()
            .any(|c| self.plan.tree.first_dof(c.vertex as usize) >= ring);
        let radius = self.plan.radius;
        let centre = self.next_centre();
        let is_leaving = (centre - self.plan.centre).norm() > self.params.leave * radius;
        let depth = self.depth();
        let is_stale = (depth - self.jobs.depth_at_factor).abs() > self.params.stale
            || self.exterior.lag() > self.jobs.longest_lag
            || self.exterior.residual() > self.params.tolerance * self.tools_force();
        if !(is_leaving || is_stale || reaches_ring) {
            return None;
        }
        let zone = (is_leaving || reaches_ring).then(|| {
            let mut radius = self
                .params
                .zone_radius
                .max(ZONE_GROWTH * self.contact_radius(centre));
            if reaches_ring && !is_leaving {
                radius = radius.max(ZONE_GROWTH * self.plan.radius);
            }
            (centre, radius)
        });
        Some(Due { zone, depth })
    }

    /// Centre at rest of a zone requested now, m: the middle of the pressed vertices, moved ahead
    /// by the distance that the tools will go until the zone is ready.
    pub(super) fn next_centre(&self) -> Vec3 {
        let Some(Pressed { middle, along }) = self.pressed() else {
            let (displacements, tools) = (&self.state.displacements, &self.course.tools);
            let zone = Some(&*self.plan.vertices);
            let near = nearest_point(&self.model, displacements, tools, zone);
            if near.0 < self.plan.radius {
                return near.1;
            }
            return nearest_point(&self.model, displacements, tools, None).1;
        };
        let lead = self.course.drift * f64::from(self.jobs.latency);
        let lead = lead - along * along.dot(&lead);
        let most = self.params.leave * self.plan.radius;
        middle + lead * (most / lead.norm()).min(1.0)
    }

    /// Memory of the prisms whose memory is updated in every step.
    pub(super) fn history(&self) -> History {
        let mut history = History::new(&self.model);
        self.remember(&mut history);
        history
    }

    /// Writes the memory of those prisms into a history.
    pub(super) fn remember(&self, history: &mut History) {
        self.inside.batches.store(history);
        if let Some(follower) = self.exterior.follower() {
            follower.batches.store(history);
        }
    }

    /// Updates the memory of those prisms of a linear exterior that are evaluated one by one: they
    /// are few.
    fn bring_up_others(&mut self, dt: f64, lag: f64) {
        if !self.model.has_memory || lag <= 0.0 {
            return;
        }
        let Some(shop) = self.jobs.shop() else {
            return;
        };
        let batches = &shop.follower.batches;
        self.memory.begin_materials(&self.model, lag);
        batches.commit_others(&self.model, &self.memory, &mut self.state);
        self.memory.begin_materials(&self.model, dt);
        batches.begin_others(&self.model, &mut self.memory, &self.state);
    }

    /// Takes back a job that no thread has taken.
    pub(super) fn take_back_job(&mut self) {
        match std::mem::replace(&mut self.jobs.job, Job::Out) {
            Job::Waiting(job) => {
                self.jobs.job = Job::Idle {
                    shop: job.shop,
                    retired: job.retired,
                };
                self.exterior.set_lag(self.exterior.lag() + job.lag);
            }
            other => self.jobs.job = other,
        }
    }

    /// A job for the background thread, if one is due. Give its result to [`Self::install`].
    pub fn take_job(&mut self) -> Option<Rebuild> {
        match std::mem::replace(&mut self.jobs.job, Job::Out) {
            Job::Waiting(job) => Some(job),
            other => {
                self.jobs.job = other;
                None
            }
        }
    }

    /// Installs the result of a job of this body.
    pub fn install(&mut self, done: Rebuilt) {
        self.jobs.latency = self.jobs.age;
        let Some(outside) = done.outside else {
            self.jobs.job = Job::Idle {
                shop: done.shop,
                retired: None,
            };
            return;
        };
        let was_linear = self.exterior.renew();
        if done.inside.is_some() && was_linear {
            // Columns that enter the zone start at their positions in the old exterior.
            let entering = done.plan.vertices.iter().copied();
            let entering: Vec<u32> = entering
                .filter(|&v| !self.plan.is_inside[v as usize])
                .collect();
            self.settle_columns(Some(&entering));
        }
        self.plan = done.plan;
        let retired = std::mem::replace(&mut self.outside, outside);
        self.jobs.job = Job::Idle {
            shop: done.shop,
            retired: Some(retired),
        };
        if let Some((mut inside, mut follower)) = done.inside {
            if self.model.has_memory {
                // The memory has changed since the job was taken.
                let (model, history) = (&*self.model, self.history());
                inside.batches.load(&history);
                inside.batches.begin(model, &mut self.memory, &self.state);
                if let Some(follower) = &mut follower {
                    follower.batches.load(&history);
                    follower.batches.begin(model, &mut self.memory, &self.state);
                }
            }
            self.inside = inside;
            self.exterior.replace_follower(follower);
            self.keep_good();
        }
        self.forget_forces();
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
