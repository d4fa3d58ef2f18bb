//! Energy, forces and stiffness of the whole body, summed over its groups in their order.

use palpa_mesh::Vec3;

use crate::Mat3;
use crate::element::{GroupResponse, PhaseAt, evaluate};
use crate::model::Model;
use crate::state::Memory;

/// Where the body is inverted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Inverted {
    /// Middle of the group at rest, m.
    pub(crate) at: Vec3,
}

/// Sums energy and forces at the given displacements, and stiffness if `blocks` is given. Forces are `∂W/∂u`.
///
/// Groups are stored interval by interval, so that a run of them has one layer's material.
pub(crate) fn assemble(
    model: &Model,
    memory: &Memory,
    displacements: &[Vec3],
    forces: &mut [Vec3],
    mut blocks: Option<&mut [Mat3]>,
) -> Result<f64, Inverted> {
    let mut response = GroupResponse::new();
    forces.fill(Vec3::zeros());
    if let Some(blocks) = &mut blocks {
        blocks.fill(Mat3::zeros());
    }
    let mut energy = 0.0;
    let mut phases: Vec<PhaseAt<'_>> = Vec::with_capacity(4);
    let n_groups = model.n_groups();
    for i in 0..model.body.n_levels - 1 {
        for (g, group) in model.structure.groups.iter().enumerate() {
            let index = i * n_groups + g;
            let nodes = model.group_nodes(g, i);
            let local = nodes.map(|n| displacements[n]);
            phases_at(model, memory, index, &mut phases);
            evaluate(
                group.shape,
                &model.geometries[index],
                &local,
                &phases,
                model.params.alpha,
                blocks.is_some(),
                &mut response,
            );
            if !response.energy.is_finite() {
                let middle = nodes.iter().map(|&n| model.body.positions[n]).sum::<Vec3>() / 8.0;
                return Err(Inverted { at: middle });
            }
            energy += response.energy;
            for (local, &node) in nodes.iter().enumerate().take(group.n_nodes()) {
                forces[node] += response.forces[local];
            }
            if let Some(blocks) = &mut blocks {
                model
                    .structure
                    .scatter(group, i, &response.stiffness, blocks);
            }
        }
    }
    Ok(energy)
}

/// The phases of a group with all that their response depends on.
pub(crate) fn phases_at<'a>(
    model: &'a Model,
    memory: &'a Memory,
    index: usize,
    phases: &mut Vec<PhaseAt<'a>>,
) {
    phases.clear();
    for p in model.first_phase[index] as usize..model.first_phase[index + 1] as usize {
        let phase = &model.phases[p];
        let material = phase.material as usize;
        phases.push(PhaseAt {
            law: &model.materials[material].law,
            phase,
            scale: memory.scales[material],
            overstress: memory.overstress.get(p),
        });
    }
}
