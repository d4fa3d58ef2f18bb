//! Arrays of the static solver.

use palpa_mesh::Vec3;

use super::active_set::ActiveSet;
use crate::Mat3;
use crate::model::Model;
use crate::state::Memory;
use crate::system::{Hold, LinearSystem};

/// Scratch memory of the solver. Its content between calls changes no result by more than the
/// tolerance.
#[derive(Debug)]
pub struct Workspace {
    pub(super) system: LinearSystem,
    pub(crate) memory: Memory,
    /// Unbalanced forces at the present displacements, without those of contact, N. `[n_nodes]`
    pub(super) forces: Vec<Vec3>,
    /// Unbalanced forces at the displacements of a trial, N. `[n_nodes]`
    pub(super) trial_forces: Vec<Vec3>,
    /// Forces with friction, N. `[n_nodes]`
    pub(super) right_side: Vec<Vec3>,
    /// Displacements prescribed by holds, guides and tools, m. `[n_nodes]`
    pub(super) demand: Vec<Vec3>,
    /// The linear system's solution, m. `[n_nodes]`
    pub(super) delta: Vec<Vec3>,
    /// Forces on nodes as the linear system predicts them after the step, N. `[n_nodes]`
    pub(super) predicted: Vec<Vec3>,
    /// The forces, present or predicted, that determine pressure and friction, N. `[n_nodes]`
    pub(super) contact_forces: Vec<Vec3>,
    /// Displacements of a trial, m. `[n_nodes]`
    pub(super) trial: Vec<Vec3>,
    /// Directions held by supports and loads. `[n_nodes]`
    pub(super) given: Vec<Hold>,
    /// Directions held by supports, loads and tools. `[n_nodes]`
    pub(super) holds: Vec<Hold>,
    pub(super) contacts: ActiveSet,
    /// Stiffness that contact has added to the system's blocks: block, and stiffness, N/m.
    pub(super) added: Vec<(usize, Mat3)>,
}

impl Workspace {
    /// Scratch for a model.
    pub fn new(model: &Model) -> Self {
        let zeros = || vec![Vec3::zeros(); model.n_nodes()];
        Self {
            system: LinearSystem::new(&model.structure, model.n_nodes()),
            memory: Memory::new(model),
            forces: zeros(),
            trial_forces: zeros(),
            right_side: zeros(),
            demand: zeros(),
            delta: zeros(),
            predicted: zeros(),
            contact_forces: zeros(),
            trial: zeros(),
            given: model.supports.clone(),
            holds: model.supports.clone(),
            contacts: ActiveSet::default(),
            added: Vec::new(),
        }
    }

    /// Force that holds each node in the last solved state, N; zero for a free node. `[n_nodes]`
    pub fn reactions(&self) -> &[Vec3] {
        &self.forces
    }
}
