//! The real-time step of a body that follows tools. Algorithm and limits:
//! `docs/theory/moving_step.md`.
//!
//! | file | what happens there |
//! | --- | --- |
//! | `params`, `report` | how a step is set up, and how it ended |
//! | `step` | one step from begin to end: iterations, verdict, memory, jobs |
//! | `iteration` | one Newton iteration |
//! | `kept` | what is kept from step to step: factor, candidates, compliance |
//! | `springs` | the zone's factor, and the springs that make it possible deep under a tool |
//! | `candidates` | triangles near the tools, and the contact forces on the skin |
//! | `course` | how far the tools may go in a step |
//! | `pressed` | where the tools press, how deep and how wide |
//! | `exterior` | the body outside the zone |
//! | `beyond` | contact outside the zone |
//! | `rest` | the body at rest |
//! | `recovery` | the last good state, the way back to it, and the start again at rest |
//! | `rebuild` | a job for the background: a new zone, or a new factor of the exterior |
//! | `jobs` | when a job is due, and how its result is installed |
//! | `glance` | a copy of the displacements for pictures |
//! | `carry`, `roaming` | the change from one mesh of a body to another |
//!
//! A body is in one of these states, each an enum:
//!
//! ```text
//! Known          Nothing ──first iteration──► Forces ──nothing touches, nothing moved──► Still
//!                   ▲                            │ ▲─────────a tool comes near────────────┘
//!                   └──job installed, step lost──┘
//! ExteriorState  Followed, or Linear { .., is_lost } (lost from a start again to the next factor)
//! Job            Idle ──ask──► Waiting ──take_job──► Out ──install──► Idle; a factor may be given up
//! Verdict        Good, Rough or Lost: how a step is judged, and so how fast the next may go
//! ```

mod beyond;
mod candidates;
mod carry;
mod course;
mod exterior;
mod glance;
mod iteration;
mod jobs;
mod kept;
mod params;
mod pressed;
mod rebuild;
mod recovery;
mod report;
mod rest;
mod roaming;
mod springs;
mod step;

use std::sync::Arc;

use palpa_mesh::Vec3;
use palpa_sparse::ColumnPattern;

use super::candidate::Candidate;
use super::contact_problem::ContactProblem;
use super::inside::Inside;
use super::local::LocalModel;
use super::outside::{Follower, Outside};
use super::plan::{Centres, Plan, Trouble};
use crate::batch::{History, Pressure, Tangent};
use crate::error::FemError;
use crate::model::Model;
use crate::posed_tool::PosedTool;
use crate::state::{Memory, State};
use beyond::Beyond;
use candidates::{Search, SkinForces};
use carry::Come;
use course::Course;
use exterior::ExteriorState;
use iteration::{Known, Scratch};
use jobs::Jobs;
use kept::Kept;
use pressed::nearest_point;
use rebuild::Room;
use recovery::Recovery;
use springs::Springs;

pub use glance::Glance;
pub use params::{ExteriorMode, LiveParams};
pub use rebuild::{Rebuild, Rebuilt};
pub use report::{LiveReport, StepOutcome};
pub use roaming::{FineBodies, RoamDone, RoamJob, Roaming};

/// A body that follows tools in real time.
#[derive(Debug)]
pub struct Live {
    model: Arc<Model>,
    pattern: Arc<ColumnPattern>,
    params: LiveParams,
    /// Displacements of all nodes, and the memory of prisms that are evaluated one by one.
    state: State,
    /// Factors and constant stresses of the materials in this step.
    memory: Memory,
    /// Which columns are in the zone.
    plan: Arc<Plan>,
    /// Displacements at rest, m: zero unless a layer has tension. `[n_nodes]`
    rest: Arc<[Vec3]>,
    /// The zone's prisms and factor.
    inside: Box<Inside>,
    /// The exterior, linearised about an earlier state.
    outside: Arc<Outside>,
    exterior: ExteriorState,
    /// The pairs that are evaluated one by one.
    singles: Vec<u32>,
    skin: SkinForces,
    known: Known,
    /// The report of the last step, if it left nothing to do while the tools stay where they are.
    settled: Option<LiveReport>,
    kept: Kept,
    course: Course,
    recovery: Recovery,
    springs: Springs,
    jobs: Jobs,
    /// The contact candidates with their forces, and the compliance used to find them.
    problem: ContactProblem,
    search: Search,
    beyond: Beyond,
    ws: Scratch,
}

/// The state in which a body begins.
#[derive(Debug)]
struct Start {
    /// Points of the skin at rest around which the first zone is, and its radii, m; see [`Plan::new`].
    zone: (Centres, [f64; 2]),
    /// Without a history the body has relaxed.
    come: Come,
    /// Zones are numbered from here on.
    n_before: u64,
}

impl Live {
    /// A body at rest, with its first zone around the tools.
    ///
    /// # Errors
    /// When the body is too large to be factored, or is not stable at rest.
    pub fn new(
        model: Arc<Model>,
        tools: &[PosedTool],
        params: LiveParams,
    ) -> Result<Self, FemError> {
        let rest = rest::displacements(&model)?;
        let centres = Centres::new(tools.len(), |tool| {
            let tools = tools.get(tool..=tool).unwrap_or(&[]);
            nearest_point(&model, &rest, tools, None).1
        });
        let start = Start {
            zone: (centres, [0.0, params.zone_radius]),
            come: Come::rest(&model, &rest),
            n_before: 0,
        };
        Self::at(model, tools, params, start, rest)
    }

    /// A body in a given state. If that is not rest, the exterior has the stiffness without the pressure of the volume:
    /// displacements that come from another mesh do not keep the volume, so that their pressure is off by as much as the
    /// shear modulus, and with it the stiffness is mostly not positive definite.
    fn at(
        model: Arc<Model>,
        tools: &[PosedTool],
        params: LiveParams,
        start: Start,
        rest: Arc<[Vec3]>,
    ) -> Result<Self, FemError> {
        let Start {
            zone: (centres, radii),
            come,
            n_before,
        } = start;
        let pattern = Arc::new(model.structure.pattern.clone());
        let mut state = come.state;
        let mut memory = Memory::new(&model);
        let n_zones = n_before + 1;
        let plan = Plan::new(&model, &pattern, n_zones, centres, radii)?;
        let mut inside = Box::new(Inside::new(&model, &memory, &pattern, &plan));
        let mut room = Room::new(&model, &pattern, &plan, come.history.as_ref());
        let shop = &mut room.shop;
        let singles = (inside.batches.singles()).chain(shop.follower.batches.singles());
        let singles = singles.collect();
        let is_followed = params.exterior == ExteriorMode::Followed;
        let mut follower = is_followed.then(|| {
            Box::new(Follower::new(
                &model,
                &memory,
                &pattern,
                &plan,
                Tangent::None,
            ))
        });
        if let Some(history) = &come.history {
            inside.batches.load(history);
            if let Some(follower) = &mut follower {
                follower.batches.load(history);
            }
        }
        if come.history.is_none() {
            rest::relax(&mut inside.batches, &model, &mut memory, &mut state);
            rest::relax(&mut shop.follower.batches, &model, &mut memory, &mut state);
            if let Some(follower) = &mut follower {
                rest::relax(&mut follower.batches, &model, &mut memory, &mut state);
            }
        }
        memory.begin(&model, &state, 0.0);
        if model.has_memory {
            shop.follower.batches.begin(&model, &mut memory, &state);
        }
        let mut outside = Outside::new(&model, &plan);
        outside.id = n_before;
        let pressure = if *state.displacements == *rest {
            Pressure::Own
        } else {
            Pressure::None
        };
        shop.refactor(
            &mut outside,
            &model,
            &memory,
            &pattern,
            &plan,
            &state.displacements,
            pressure,
            &|| true,
        )
        .map_err(|trouble| match trouble {
            Trouble::Inverted(at) => FemError::NoRest { at: at.into() },
            Trouble::Singular | Trouble::GivenUp => FemError::NoRest {
                at: centres.of(0).into(),
            },
        })?;
        let kept = (model.has_memory && !is_followed).then(|| {
            let mut kept = History::new(&model);
            shop.follower.batches.store(&mut kept);
            Arc::new(kept)
        });
        Ok(Self {
            plan: Arc::new(plan),
            inside,
            outside: Arc::new(outside),
            exterior: ExteriorState::new(follower),
            rest,
            recovery: Recovery::new(&state.displacements, &come.skin, tools),
            skin: come.skin,
            singles,
            known: Known::Nothing,
            settled: None,
            kept: Kept::NONE,
            course: Course::new(tools),
            springs: Springs::NONE,
            jobs: Jobs::new(&model, room, kept, n_before, n_zones),
            problem: ContactProblem::new(),
            search: Search::new(&model),
            beyond: Beyond::new(&model, tools.len()),
            ws: Scratch::new(&model),
            model,
            pattern,
            params,
            state,
            memory,
        })
    }

    /// Displacements of all nodes, m. `[n_nodes]` If the exterior answers linearly,
    /// [`Self::settle`] updates those outside the zone.
    pub fn displacements(&self) -> &[Vec3] {
        &self.state.displacements
    }

    /// The model.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Number of columns of the zone, of its ring, and of the body.
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

    /// The local model at the tools' present place, with at most `most` contacts; beyond that,
    /// neighbours that press are merged. After a failed step there is none: it has no contacts, and
    /// the forces are those of the state that the body has returned to.
    pub fn local_model(&mut self, most: usize, out: &mut LocalModel) {
        if !self.kept.has_contact() {
            self.problem.no_local_model(&self.course.tools, out);
            return;
        }
        let skin = &self.model.body.skin.points;
        self.problem
            .local_model(&self.course.tools, skin, most, out);
    }
}
