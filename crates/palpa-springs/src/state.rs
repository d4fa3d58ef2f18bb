//! What evolves, and the scratch memory of a step.

use palpa_mesh::Vec3;

use crate::constraints::Role;
use crate::model::SpringModel;
use crate::system::System;

/// Which of its two ways the method took last.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// Incremental finite elements.
    #[default]
    FiniteElements,
    /// Explicit Euler.
    Euler,
}

/// The state of a spring model: where its nodes are, and the forces that built up on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct SpringState {
    /// Nodes now, in metres. `[n_nodes]`
    pub positions: Vec<Vec3>,
    /// Force on each node from outside, summed along the path, in newtons: by the tool at operated nodes, by the
    /// ground at fixed ones; at free nodes what has not been brought to equilibrium. `[n_nodes]`
    pub node_forces: Vec<Vec3>,
    /// Force on the tool by the body, summed along the path. N
    pub force: Vec3,
    /// Displacement of the operated nodes since rest. m
    pub displacement: Vec3,
    /// How the last sub-step was done.
    pub mode: Mode,
}

impl SpringState {
    /// The state at rest: no displacement, no force.
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
    /// If the state is not of this model.
    pub fn displacements(&self, model: &SpringModel) -> Vec<Vec3> {
        assert_eq!(
            self.positions.len(),
            model.n_nodes(),
            "a state of another model"
        );
        let pairs = self.positions.iter().zip(&model.rest);
        pairs.map(|(now, rest)| now - rest).collect()
    }

    /// Force on the body by what holds its fixed nodes. N
    ///
    /// # Panics
    /// If the state is not of this model.
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

/// Scratch memory of a step; meaningless between calls. One model, one thread.
#[derive(Debug)]
pub struct Workspace {
    pub(crate) system: System,
    /// Displacements of a sub-step. m
    pub(crate) increments: Vec<Vec3>,
    /// Nodal forces of a sub-step. N
    pub(crate) forces: Vec<Vec3>,
    /// The last good state.
    pub(crate) saved: SpringState,
}

impl Workspace {
    /// Memory for steps of this model.
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
