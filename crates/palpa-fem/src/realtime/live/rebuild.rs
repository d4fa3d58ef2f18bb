//! Jobs for the background thread: a new zone, or a new factor of the exterior.

use std::sync::Arc;

use palpa_mesh::Vec3;
use palpa_sparse::ColumnPattern;
use palpa_sparse::fronts::SolveScratch;

use super::super::inside::Inside;
use super::super::outside::{Follower, Outside, Workshop};
use super::super::plan::{Plan, Trouble};
use crate::batch::{History, Tangent};
use crate::model::Model;
use crate::state::Memory;

/// A job for the background thread: a new zone with its exterior, or a new factor of the exterior.
#[derive(Debug)]
pub struct Rebuild {
    pub(super) model: Arc<Model>,
    pub(super) pattern: Arc<ColumnPattern>,
    pub(super) memory: Memory,
    /// Displacements at the time of the request, m. `[n_nodes]`
    pub(super) displacements: Vec<Vec3>,
    /// The exterior that determines the displacements outside the zone; `None` if those are up to
    /// date.
    pub(super) old: Option<(Arc<Plan>, Arc<Outside>)>,
    pub(super) target: Target,
    /// Memory kept from the last job.
    pub(super) shop: Box<Shop>,
    /// Duration of a step, and the time by which the exterior's memory lags behind, s.
    pub(super) dt: f64,
    pub(super) lag: f64,
    /// Viscous memory of the prisms that the shop lacks, or of all prisms.
    pub(super) history: Option<History>,
    /// An exterior that is no longer needed. The background reuses its memory or frees it, so that
    /// the step need not.
    pub(super) retired: Option<Arc<Outside>>,
    pub(super) is_followed: bool,
    /// Number of the factor.
    pub(super) id: u64,
}

/// The zone whose exterior is to be factored.
#[derive(Debug)]
pub(super) enum Target {
    /// The present zone.
    Same(Arc<Plan>),
    /// A new zone.
    New {
        id: u64,
        /// Its centre at rest, m.
        centre: Vec3,
        /// Its radius, m.
        radius: f64,
    },
}

/// The exterior's prisms with their tangents, and the arrays that it is factored in.
#[derive(Debug)]
pub(super) struct Shop {
    /// Number of the zone whose exterior this is.
    plan: u64,
    pub(super) follower: Follower,
    workshop: Workshop,
}

impl Shop {
    pub(super) fn new(
        model: &Model,
        memory: &Memory,
        pattern: &ColumnPattern,
        plan: &Plan,
    ) -> Self {
        Self {
            plan: plan.id,
            follower: Follower::new(model, memory, pattern, plan, Tangent::Single),
            workshop: Workshop::new(model, pattern, plan),
        }
    }

    /// Factors an exterior at these displacements.
    pub(super) fn refactor(
        &mut self,
        outside: &mut Outside,
        model: &Model,
        memory: &Memory,
        pattern: &ColumnPattern,
        plan: &Plan,
        displacements: &[Vec3],
    ) -> Result<(), Trouble> {
        let (follower, workshop) = (&mut self.follower, &mut self.workshop);
        outside.refactor(
            model,
            memory,
            pattern,
            plan,
            follower,
            workshop,
            displacements,
        )
    }
}

/// The result of a [`Rebuild`].
#[derive(Debug)]
pub struct Rebuilt {
    pub(super) plan: Arc<Plan>,
    /// The prisms of a new zone, and those of its exterior if it is followed.
    pub(super) inside: Option<(Box<Inside>, Option<Box<Follower>>)>,
    /// The new exterior; `None` if the factor failed.
    pub(super) outside: Option<Arc<Outside>>,
    pub(super) shop: Box<Shop>,
}

impl Rebuild {
    /// Does the work. Cost: a factor of the whole body.
    ///
    /// # Panics
    /// Never: a body that could be factored with one zone can be factored with another.
    pub fn run(mut self) -> Rebuilt {
        let model = Arc::clone(&self.model);
        let pattern = Arc::clone(&self.pattern);
        let is_new = matches!(self.target, Target::New { .. });
        let plan = match self.target {
            Target::Same(plan) => plan,
            Target::New { id, centre, radius } => {
                let plan = Plan::new(&model, &pattern, id, centre, radius);
                Arc::new(
                    plan.expect("a body that could be factored with one zone can be with another"),
                )
            }
        };
        let (mut shop, mut other) = if self.shop.plan == plan.id {
            (self.shop, None)
        } else {
            let shop = Box::new(Shop::new(&model, &self.memory, &pattern, &plan));
            (shop, Some(self.shop))
        };
        if let Some((plan, old)) = &self.old {
            let mut scratch = SolveScratch::new(&plan.tree);
            let x = &mut shop.workshop.x;
            old.settle(&model, plan, None, &mut self.displacements, x, &mut scratch);
        }
        let past = ExteriorMemory {
            memory: &mut self.memory,
            displacements: &self.displacements,
            is_linear: self.old.is_some(),
            lag: self.lag,
        };
        past.bring_up(
            &model,
            self.history.as_mut(),
            &mut shop,
            other.as_deref_mut(),
        );
        if model.has_memory {
            self.memory.begin_materials(&model, self.dt);
            shop.follower.batches.begin_lanes(&self.memory);
        }
        let recycled = self
            .retired
            .filter(|old| old.plan == plan.id)
            .and_then(Arc::into_inner);
        let mut outside = recycled.unwrap_or_else(|| Outside::new(&model, &plan));
        outside.id = self.id;
        let (memory, here) = (&self.memory, &self.displacements);
        let made = shop.refactor(&mut outside, &model, memory, &pattern, &plan, here);
        let inside = is_new.then(|| {
            let mut follower = self.is_followed.then(|| {
                Box::new(Follower::new(
                    &model,
                    memory,
                    &pattern,
                    &plan,
                    Tangent::None,
                ))
            });
            let mut inside = Box::new(Inside::new(&model, memory, &pattern, &plan));
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

/// The viscous memory of the exterior's prisms, which may lag behind.
struct ExteriorMemory<'a> {
    memory: &'a mut Memory,
    displacements: &'a [Vec3],
    /// Whether the exterior answers linearly; then only background jobs update its memory.
    is_linear: bool,
    /// Time by which the memory lags behind, s.
    lag: f64,
}

impl ExteriorMemory<'_> {
    /// Updates the memory in a shop. `history` holds that of the prisms that no shop has; the
    /// memory of `other`, the shop of another zone, is added to it.
    fn bring_up(
        self,
        model: &Model,
        history: Option<&mut History>,
        shop: &mut Shop,
        other: Option<&mut Shop>,
    ) {
        if let Some(history) = history {
            if let (true, Some(old)) = (self.is_linear, other) {
                self.memory.begin_materials(model, self.lag);
                let batches = &mut old.follower.batches;
                batches.commit_lanes(self.memory, self.displacements);
                batches.store(history);
            }
            shop.follower.batches.load(history);
        } else if model.has_memory {
            self.memory.begin_materials(model, self.lag);
            let batches = &mut shop.follower.batches;
            batches.commit_lanes(self.memory, self.displacements);
        }
    }
}
