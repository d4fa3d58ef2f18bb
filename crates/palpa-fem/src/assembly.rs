//! Energy, forces and stiffness of the whole body, summed over its groups in their order.

use palpa_mesh::Vec3;

use crate::Mat3;
use crate::element::{GroupResponse, PhaseAt, evaluate};
use crate::model::Model;
use crate::state::Memory;

/// The place where the body is inverted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Inverted {
    /// Middle of the group at rest, m.
    pub(crate) at: Vec3,
}

/// Sums energy and forces at the given displacements, and stiffness if `blocks` is given. The
/// forces are `∂W/∂u`.
///
/// Groups are stored interval by interval, so consecutive groups have the material of one layer.
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

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;
    use palpa_mesh::generate::{Diagonal, Grid, LevelStack, mapped_grid};
    use palpa_mesh::{LayeredBody, Vec3};

    use super::*;
    use crate::law::NeoHookean;
    use crate::{Material, Materials, ModelParams, State, Supports};

    fn body(n_cells: [usize; 2], diagonal: Diagonal, jitter: Option<u64>) -> LayeredBody {
        let levels = LevelStack {
            depths: vec![0.0, 2e-3, 7e-3],
            interval_layer: vec![0, 1],
        };
        let grid = Grid {
            n_cells,
            diagonal,
            jitter,
        };
        mapped_grid(&grid, |u, v| Vec3::new(0.02 * u, 0.015 * v, 0.0), &levels)
    }

    /// Stiffness at rest of a body that nothing holds.
    fn stiffness(body: &LayeredBody) -> (DMatrix<f64>, usize) {
        let material = |young| Material::new("t", NeoHookean::from_young(young, 0.49).unwrap());
        let materials = Materials::of_layers(vec![material(100e3), material(20e3)]);
        let params = ModelParams::default();
        let model = Model::build(body, &materials, &Supports::default(), params).unwrap();
        let mut memory = Memory::new(&model);
        memory.begin(&model, &State::new(&model), 0.0);
        let n = model.n_nodes();
        let zeros = vec![Vec3::zeros(); n];
        let mut forces = zeros.clone();
        let mut blocks = vec![Mat3::zeros(); model.structure.n_blocks()];
        assemble(&model, &memory, &zeros, &mut forces, Some(&mut blocks)).unwrap();
        let mut matrix = DMatrix::zeros(3 * n, 3 * n);
        let (mut x, mut y) = (zeros.clone(), zeros);
        for column in 0..3 * n {
            x[column / 3][column % 3] = 1.0;
            y.fill(Vec3::zeros());
            model.structure.multiply(&blocks, &x, &mut y);
            x[column / 3][column % 3] = 0.0;
            for (node, y) in y.iter().enumerate() {
                for c in 0..3 {
                    matrix[(3 * node + c, column)] = y[c];
                }
            }
        }
        (matrix, model.n_single_triangles())
    }

    #[test]
    fn a_free_body_has_the_six_rigid_motions_and_no_other_mode_without_energy() {
        let bodies = [
            ("right", body([4, 3], Diagonal::Right, None)),
            ("left", body([4, 3], Diagonal::Left, None)),
            ("alternate", body([4, 3], Diagonal::Alternate, None)),
            ("irregular", body([4, 3], Diagonal::Right, Some(5))),
            ("one cell", body([1, 1], Diagonal::Right, None)),
        ];
        for (name, body) in bodies {
            let (matrix, n_singles) = stiffness(&body);
            assert_eq!(n_singles, 0, "{name}");
            let asymmetry = (&matrix - matrix.transpose()).norm();
            assert!(asymmetry < 1e-10 * matrix.norm(), "{name}");
            let mut modes: Vec<f64> = matrix.symmetric_eigenvalues().iter().copied().collect();
            modes.sort_by(f64::total_cmp);
            let largest = modes[modes.len() - 1];
            let (rigid, others) = modes.split_at(6);
            assert!(
                rigid.iter().all(|m| m.abs() < 1e-10 * largest),
                "{name}: {rigid:?}"
            );
            assert!(
                others[0] > 1e-6 * largest,
                "{name}: {:e} of {largest:e}",
                others[0]
            );
        }
    }
}
