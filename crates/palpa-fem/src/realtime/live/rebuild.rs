//! Jobs for the background thread: a new zone, or a new factor of the exterior.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use palpa_mesh::Vec3;
use palpa_sparse::ColumnPattern;
use palpa_sparse::fronts::{Half, SolveScratch, fronts_above};

use super::super::inside::Inside;
use super::super::outside::{Follower, Outside, Workshop};
use super::super::plan::{Centres, Plan, Trouble};
use crate::batch::{From, History, Pressure, Tangent};
use crate::model::Model;
use crate::state::Memory;

/// A job for the background thread: a new zone with its exterior, or a new factor of the exterior.
#[derive(Debug)]
pub struct Rebuild {
    pub(super) model: Arc<Model>,
    pub(super) pattern: Arc<ColumnPattern>,
    /// The present zone.
    pub(super) plan: Arc<Plan>,
    /// The zone to be made; `None` for a new factor of the present exterior.
    pub(super) target: Option<Target>,
    /// The exterior that determines the displacements outside the zone; `None` if those are up to
    /// date.
    pub(super) old: Option<Arc<Outside>>,
    /// The room to work in. `None` if a job that panicked has taken it along; then this job only
    /// makes another one.
    pub(super) room: Option<Box<Room>>,
    /// Viscous memory of the exterior's prisms at the end of the last job; `None` if there is none,
    /// or if the exterior is followed.
    pub(super) kept: Option<Arc<History>>,
    /// Duration of a step, and the time by which the exterior's memory lags behind, s.
    pub(super) dt: f64,
    pub(super) lag: f64,
    pub(super) is_followed: bool,
    /// Whether a tool presses, so that the displacements of a linear exterior are extrapolated.
    pub(super) is_pressed: bool,
    /// Number of the factor.
    pub(super) id: u64,
    /// Whether the result is no longer wanted. It may become so at any time.
    pub(super) is_given_up: Arc<AtomicBool>,
}

/// A new zone.
#[derive(Debug, Clone, Copy)]
pub(super) struct Target {
    pub(super) id: u64,
    /// Its centres at rest, m.
    pub(super) centres: Centres,
    /// Its radii, m; see [`Plan::new`].
    pub(super) radii: [f64; 2],
}

/// The arrays that go to the background with each job and come back with its result, so that the
/// step allocates and frees nothing.
#[derive(Debug)]
pub(super) struct Room {
    pub(super) shop: Shop,
    /// Factors and constant stresses at the time of the request.
    pub(super) memory: Memory,
    /// Displacements at the time of the request, m: of the zone, or of all nodes if the exterior does
    /// not determine the others. `[n_nodes]`
    pub(super) displacements: Vec<Vec3>,
    /// Viscous memory at the time of the request of the prisms whose memory is updated in every
    /// step; `None` without viscous materials.
    pub(super) history: Option<History>,
    pub(super) retired: Retired,
}

/// Parts of the body that are no longer needed. The next job reuses or frees them.
#[derive(Debug, Default)]
pub(super) struct Retired {
    pub(super) plan: Option<Arc<Plan>>,
    pub(super) outside: Option<Arc<Outside>>,
    pub(super) kept: Option<Arc<History>>,
    pub(super) inside: Option<Box<Inside>>,
    pub(super) follower: Option<Box<Follower>>,
    pub(super) entering: Option<Entering>,
}

/// Columns that enter a zone, and what it takes to update their displacements.
#[derive(Debug)]
pub(super) struct Entering {
    pub(super) columns: Vec<u32>,
    /// The fronts above them in the exterior of the old zone.
    pub(super) fronts: Vec<bool>,
    pub(super) scratch: SolveScratch<f32>,
}

impl Room {
    /// A room for jobs of a zone.
    pub(super) fn new(
        model: &Model,
        pattern: &ColumnPattern,
        plan: &Plan,
        kept: Option<&History>,
    ) -> Box<Self> {
        let memory = Memory::new(model);
        let mut shop = Shop::new(model, &memory, pattern, plan);
        if let Some(kept) = kept {
            shop.follower.batches.load(kept);
        }
        Box::new(Self {
            shop,
            memory,
            displacements: vec![Vec3::zeros(); model.n_nodes()],
            history: model.has_memory.then(|| History::new(model)),
            retired: Retired::default(),
        })
    }
}

/// The exterior's prisms with their tangents, and the arrays that it is factored in.
#[derive(Debug)]
pub(super) struct Shop {
    pub(super) follower: Follower,
    pub(super) workshop: Workshop,
}

impl Shop {
    pub(super) fn new(
        model: &Model,
        memory: &Memory,
        pattern: &ColumnPattern,
        plan: &Plan,
    ) -> Self {
        Self {
            follower: Follower::new(model, memory, pattern, plan, Tangent::Single),
            workshop: Workshop::new(model, pattern, plan),
        }
    }

    /// Takes the prisms of another zone's exterior, and makes room to factor it. Returns the old ones.
    fn enter(&mut self, plan: &Plan, follower: Follower) -> Follower {
        self.workshop.fit(plan);
        std::mem::replace(&mut self.follower, follower)
    }

    /// Factors an exterior at these displacements.
    #[expect(clippy::too_many_arguments, reason = "a model and its zone")]
    pub(super) fn refactor(
        &mut self,
        outside: &mut Outside,
        model: &Model,
        memory: &Memory,
        pattern: &ColumnPattern,
        plan: &Plan,
        displacements: &[Vec3],
        pressure: Pressure<'_>,
        is_wanted: &(dyn Fn() -> bool + Sync),
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
            pressure,
            is_wanted,
        )
    }
}

/// The result of a [`Rebuild`].
#[derive(Debug)]
pub struct Rebuilt {
    pub(super) room: Box<Room>,
    /// As [`Rebuild::kept`], at the time of the request.
    pub(super) kept: Option<Arc<History>>,
    /// The new parts; `None` if the factor failed or was given up, or if only a room was made.
    pub(super) made: Option<Made>,
}

/// The new parts of a body.
#[derive(Debug)]
pub(super) struct Made {
    pub(super) plan: Arc<Plan>,
    pub(super) outside: Arc<Outside>,
    /// Those of a new zone.
    pub(super) zone: Option<MadeZone>,
}

/// The prisms of a new zone.
#[derive(Debug)]
pub(super) struct MadeZone {
    pub(super) inside: Box<Inside>,
    /// The prisms of its exterior, if it is followed.
    pub(super) follower: Option<Box<Follower>>,
    /// The columns that were in the old exterior, if it responds linearly.
    pub(super) entering: Option<Entering>,
}

impl Rebuild {
    /// Does the work. Cost: a factor of the whole body.
    ///
    /// # Panics
    /// Never: a body that could be factored with one zone can be factored with another.
    pub fn run(mut self) -> Rebuilt {
        let (model, pattern) = (Arc::clone(&self.model), Arc::clone(&self.pattern));
        let Some(mut room) = self.room.take() else {
            let kept = self.kept;
            return Rebuilt {
                room: Room::new(&model, &pattern, &self.plan, kept.as_deref()),
                kept,
                made: None,
            };
        };
        let Retired { outside, kept, .. } = std::mem::take(&mut room.retired);
        let plan = match self.target {
            None => Arc::clone(&self.plan),
            Some(Target { id, centres, radii }) => {
                let plan = Plan::new(&model, &pattern, id, centres, radii);
                Arc::new(
                    plan.expect("a body that could be factored with one zone can be with another"),
                )
            }
        };
        let is_new = self.target.is_some();
        let mut old = is_new.then(|| {
            let new = Follower::new(&model, &room.memory, &pattern, &plan, Tangent::Single);
            room.shop.enter(&plan, new)
        });
        let entering = self.settle(&mut room, &plan);
        if model.has_memory {
            self.bring_up_memory(&mut room, old.as_mut());
        }
        let mut outside = outside
            .and_then(Arc::into_inner)
            .unwrap_or_else(|| Outside::new(&model, &plan));
        outside.fit(&plan);
        outside.id = self.id;
        let Room {
            shop,
            memory,
            displacements,
            history,
            ..
        } = &mut *room;
        let extrapolated = self.old.as_ref().filter(|_| self.is_pressed);
        let pressure = extrapolated.map_or(Pressure::Own, |old| {
            Pressure::Predicted(From {
                displacements: &old.at,
                is_known: &self.plan.is_inside,
                n_levels: model.body.n_levels,
            })
        });
        let result = shop.refactor(
            &mut outside,
            &model,
            memory,
            &pattern,
            &plan,
            displacements,
            pressure,
            &|| !self.is_given_up.load(Ordering::Relaxed),
        );
        let zone = (is_new && result.is_ok())
            .then(|| self.zone(memory, history.as_ref(), &plan, entering));
        if let (Err(_), Some(old)) = (&result, old) {
            shop.enter(&self.plan, old);
        }
        let kept = (model.has_memory && !self.is_followed).then(|| {
            let recycled = kept.and_then(Arc::into_inner);
            let mut kept = recycled.unwrap_or_else(|| History::new(&model));
            kept.forget();
            shop.follower.batches.store(&mut kept);
            Arc::new(kept)
        });
        Rebuilt {
            room,
            kept,
            made: result.is_ok().then(|| Made {
                plan,
                outside: Arc::new(outside),
                zone,
            }),
        }
    }

    /// Updates the displacements outside the present zone. Returns the columns that enter another
    /// one.
    fn settle(&self, room: &mut Room, plan: &Plan) -> Option<Entering> {
        let old = self.old.as_ref()?;
        let tree = &self.plan.tree;
        let mut scratch = SolveScratch::new(tree);
        let (displacements, x) = (&mut room.displacements, &mut room.shop.workshop.x);
        old.settle(
            &self.model,
            &self.plan,
            None,
            None,
            displacements,
            x,
            &mut scratch,
        );
        let entering = plan.vertices.iter().copied();
        let columns: Vec<u32> = entering
            .filter(|&v| !self.plan.is_inside[v as usize])
            .collect();
        Some(Entering {
            fronts: fronts_above(tree, Half::Exterior, columns.iter().copied()),
            columns,
            scratch,
        })
    }

    /// Updates the viscous memory of the exterior's prisms, and gives it to the shop; `old` is that
    /// of the present zone, if there is a new one.
    fn bring_up_memory(&self, room: &mut Room, old: Option<&mut Follower>) {
        let Room {
            shop,
            memory,
            displacements,
            history,
            ..
        } = room;
        let is_new = old.is_some();
        if !self.is_followed {
            // Nothing else updates the memory of a linear exterior.
            memory.begin_materials(&self.model, self.lag);
            let batches = &mut old.unwrap_or(&mut shop.follower).batches;
            batches.commit_lanes(memory, displacements);
            if let (true, Some(history)) = (is_new, &mut *history) {
                batches.store(history);
            }
        }
        if let (true, Some(history)) = (is_new || self.is_followed, history) {
            shop.follower.batches.load(history);
        }
        memory.begin_materials(&self.model, self.dt);
        shop.follower.batches.begin_lanes(memory);
    }

    /// The prisms of a new zone.
    fn zone(
        &self,
        memory: &Memory,
        history: Option<&History>,
        plan: &Plan,
        entering: Option<Entering>,
    ) -> MadeZone {
        let (model, pattern) = (&self.model, &self.pattern);
        let mut inside = Box::new(Inside::new(model, memory, pattern, plan));
        let mut follower = self
            .is_followed
            .then(|| Box::new(Follower::new(model, memory, pattern, plan, Tangent::None)));
        if let Some(history) = history {
            inside.batches.load(history);
            if let Some(follower) = &mut follower {
                follower.batches.load(history);
            }
        }
        MadeZone {
            inside,
            follower,
            entering,
        }
    }
}
