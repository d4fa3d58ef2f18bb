//! A pair whose law the kernel does not have; it is evaluated on its own.

use palpa_mesh::Vec3;
use palpa_sparse::Block;

use super::kernel::{N_BLOCKS, N_NODES};
use super::places::{add_block, index_of};
use crate::assembly::{Inverted, evaluate_group};
use crate::columns::SurfaceGroup;
use crate::element::{GroupResponse, PhaseAt};
use crate::model::Model;
use crate::state::Memory;

/// A pair whose law the kernel does not have.
#[derive(Debug)]
pub(super) struct SinglePair {
    /// Index of its geometry and phases.
    pub(super) pair: u32,
    /// Places of its blocks; see [`places`](super::places::places).
    pub(super) blocks: [u32; N_BLOCKS],
}

impl SinglePair {
    /// Evaluates the pair into `response`.
    pub(super) fn evaluate<'a>(
        &self,
        model: &'a Model,
        memory: &'a Memory,
        displacements: &[Vec3],
        phases: &mut Vec<PhaseAt<'a>>,
        response: &mut GroupResponse,
        with_tangent: bool,
    ) -> Result<(), Inverted> {
        let index = self.pair as usize;
        evaluate_group(
            model,
            memory,
            index,
            displacements,
            phases,
            response,
            with_tangent,
        );
        if response.energy.is_finite() {
            Ok(())
        } else {
            Err(inverted(model, self.pair))
        }
    }

    /// Adds the stiffness of a response to the matrix.
    pub(super) fn add_blocks(&self, response: &GroupResponse, blocks: &mut [Block<f32>]) {
        for (&place, block) in self.blocks.iter().zip(&response.stiffness) {
            let into = &mut blocks[index_of(place)];
            add_block(place, |r, c| block[(r, c)] as f32, into);
        }
    }
}

/// The group and nodes of a pair.
pub(super) fn group_nodes(model: &Model, pair: usize) -> (&SurfaceGroup, [usize; N_NODES]) {
    let (i, g) = (pair / model.n_groups(), pair % model.n_groups());
    (&model.structure.groups[g], model.group_nodes(g, i))
}

/// The error of a prism that is inside out, with its middle at rest.
pub(super) fn inverted(model: &Model, pair: u32) -> Inverted {
    let (_, nodes) = group_nodes(model, pair as usize);
    Inverted {
        at: nodes.iter().map(|&n| model.body.positions[n]).sum::<Vec3>() / N_NODES as f64,
    }
}
