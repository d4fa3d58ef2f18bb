//! The state of a spring model, and the scratch memory of a step.

use palpa_mesh::Vec3;

use crate::constraints::Role;
use crate::model::SpringModel;
use crate::system::System;

/// The method that was used last.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// Incremental finite elements.
    #[default]
    FiniteElements,
    /// Explicit Euler.
    Euler,
}

/// The state of a spring model: the positions of its nodes, and the forces summed along the path.
#[derive(Debug, Clone, PartialEq)]
pub struct SpringState {
    /// Present node positions, in metres. `[n_nodes]`
    pub positions: Vec<Vec3>,
    /// External force on each node, summed along the path, in newtons: from the tool at operated
    /// nodes, from the ground at fixed nodes. At free nodes it is the force not yet in equilibrium.
    /// `[n_nodes]`
    pub node_forces: Vec<Vec3>,
    /// Force on the tool by the body, summed along the path. N
    pub force: Vec3,
    /// Displacement of the operated nodes since rest. m
    pub displacement: Vec3,
    /// The method of the last sub-step.
    pub mode: Mode,
}

impl SpringState {
    /// The rest state: no displacement, no force.
    pub fn new(model: &SpringModel) -> Self {
        Self {
            positions: model.rest.clone(),
            node_forces: vec![Vec3::zeros(); model.n_nodes()],
            force: Vec3::zeros(),
            displacement: Vec3::zeros(),
            mode: Mode::default(),
        }
    }

    /// Displacement of every node since rest, in metres. `[n_nodes]`
    ///
    /// # Panics
    /// If the state belongs to another model.
    pub fn displacements(&self, model: &SpringModel) -> Vec<Vec3> {
        assert_eq!(
            self.positions.len(),
            model.n_nodes(),
            "a state of another model"
        );
        let pairs = self.positions.iter().zip(&model.rest);
        pairs.map(|(now, rest)| now - rest).collect()
    }

    /// Force of the supports on the body, summed over the fixed nodes. N
    ///
    /// # Panics
    /// If the state belongs to another model.
    pub fn fixed_reaction(&self, model: &SpringModel) -> Vec3 {
        assert_eq!(
            self.positions.len(),
            model.n_nodes(),
            "a state of another model"
        );
        let pairs = model.freedoms.iter().zip(&self.node_forces);
        pairs
            .filter(|(freedom, _)| freedom.role == Role::Fixed)
            .map(|(_, force)| force)
            .sum()
    }

    /// Copies another state of the same model without allocating.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.positions.copy_from_slice(&other.positions);
        self.node_forces.copy_from_slice(&other.node_forces);
        self.force = other.force;
        self.displacement = other.displacement;
        self.mode = other.mode;
    }
}

/// Scratch memory of a step; its contents have no meaning between calls. Use one per model and
/// thread.
#[derive(Debug)]
pub struct Workspace {
    pub(crate) system: System,
    /// Displacements of a sub-step. m
    pub(crate) increments: Vec<Vec3>,
    /// Nodal forces of a sub-step. N
    pub(crate) forces: Vec<Vec3>,
    /// A copy of the state before the step, to go back to.
    pub(crate) saved: SpringState,
}

impl Workspace {
    /// Allocates memory for steps of this model.
    pub fn new(model: &SpringModel) -> Self {
        let n_nodes = model.n_nodes();
        Self {
            system: System::new(&model.structure, n_nodes, model.bars.len()),
            increments: vec![Vec3::zeros(); n_nodes],
            forces: vec![Vec3::zeros(); n_nodes],
            saved: SpringState::new(model),
        }
    }
}
