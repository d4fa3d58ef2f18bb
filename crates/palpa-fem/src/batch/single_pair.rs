//! A pair whose law the kernel does not have; it is evaluated on its own.

use palpa_mesh::Vec3;
use palpa_sparse::Block;

use super::TURNED;
use super::kernel::{N_BLOCKS, N_NODES};
use crate::assembly::{Inverted, phases_at};
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
        let pair = self.pair as usize;
        phases_at(model, memory, pair, phases);
        let (group, nodes) = group_nodes(model, pair);
        crate::element::evaluate(
            group.shape,
            &model.geometries[pair],
            &nodes.map(|n| displacements[n]),
            phases,
            model.params.alpha,
            with_tangent,
            response,
        );
        if response.energy.is_finite() {
            Ok(())
        } else {
            Err(inverted(model, self.pair))
        }
    }

    /// Adds the stiffness of a response to the matrix.
    pub(super) fn add_blocks(&self, response: &GroupResponse, blocks: &mut [Block<f32>]) {
        for (place, block) in self.blocks.iter().zip(&response.stiffness) {
            let into = &mut blocks[(place & !TURNED) as usize];
            for r in 0..3 {
                for c in 0..3 {
                    let at = if place & TURNED == 0 {
                        r + 3 * c
                    } else {
                        c + 3 * r
                    };
                    into[at] += block[(r, c)] as f32;
                }
            }
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
