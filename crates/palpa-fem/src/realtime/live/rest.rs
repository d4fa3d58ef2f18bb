//! The body at rest, where it begins and begins again: in balance with the tension of its layers.
//!
//! A body that has been at rest for long has relaxed. Its viscous stresses are zero and its last
//! elastic stresses are those of the displacements at rest, which a step of infinite duration gives.

use std::sync::Arc;

use palpa_mesh::Vec3;

use super::Live;
use crate::batch::Batches;
use crate::error::FemError;
use crate::model::Model;
use crate::state::{Memory, State};
use crate::statics::{Load, Outcome, SolveParams, Workspace, advance};

/// Displacements of a body at rest, m. `[n_nodes]` Cost: with tension, a static step.
///
/// # Errors
/// When the tension has no equilibrium.
pub(super) fn displacements(model: &Model) -> Result<Arc<[Vec3]>, FemError> {
    let mut state = State::new(model);
    if model.is_tense() {
        let mut ws = Workspace::new(model);
        let load = Load {
            duration: f64::INFINITY,
            ..Load::default()
        };
        let (before, params) = (Load::default(), SolveParams::default());
        let report = advance(model, &mut state, &mut ws, &before, &load, &params);
        let at = match report.outcome {
            Outcome::Converged => None,
            Outcome::IterationLimit { at } | Outcome::Inverted { at } => Some(at),
            Outcome::Singular => Some(model.body.skin.points[0].into()),
        };
        if let Some(at) = at {
            return Err(FemError::NoRest { at });
        }
    }
    Ok(state.displacements.into())
}

/// Sets the memory of these prisms to that of a body that has relaxed at its displacements.
pub(super) fn relax(batches: &mut Batches, model: &Model, memory: &mut Memory, state: &mut State) {
    if model.has_memory {
        memory.begin_materials(model, f64::INFINITY);
        batches.commit(model, memory, state);
    }
}

impl Live {
    /// Puts the body at rest. The next job updates the exterior.
    pub(super) fn lie_down(&mut self) {
        self.state.displacements.copy_from_slice(&self.rest);
        let (model, memory, state) = (&*self.model, &mut self.memory, &mut self.state);
        relax(&mut self.inside.batches, model, memory, state);
        if let Some(follower) = self.exterior.follower_mut() {
            relax(&mut follower.batches, model, memory, state);
        }
        self.exterior.lose();
    }

    /// Distance of a vertex of the skin from its place at rest, m.
    pub(super) fn indentation(&self, vertex: u32) -> f64 {
        let node = self.model.body.node(vertex as usize, 0);
        (self.state.displacements[node] - self.rest[node]).norm()
    }
}
