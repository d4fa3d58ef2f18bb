//! Energy, forces and stiffness of the whole body, summed over its groups.

use palpa_mesh::Vec3;
use rayon::prelude::*;

use crate::Mat3;
use crate::batch::{Batches, Slots, Sums, Tangent};
use crate::columns::SurfaceGroup;
use crate::element::{GroupResponse, PhaseAt, evaluate};
use crate::model::Model;
use crate::state::{Memory, State};
use crate::system::{LinearSystem, Region};

/// The place where the body is inverted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Inverted {
    /// Middle of the group at rest, m.
    pub(crate) at: Vec3,
}

/// Sums forces and stiffness over the body, outside a region and inside it.
#[derive(Debug)]
pub(crate) struct Assembler {
    outer: Option<Batches>,
    inner: Batches,
    slots: Slots,
}

impl Assembler {
    /// An assembler for a model, with the region of its linear system, if there is one.
    pub(crate) fn new(model: &Model, memory: &Memory, region: Option<&Region>) -> Self {
        let part = |keep: &dyn Fn(&SurfaceGroup) -> bool| {
            let pattern = &model.structure.pattern;
            Batches::new(model, memory, pattern, keep, Tangent::Double)
        };
        Self {
            outer: region.map(|r| part(&|group| !r.holds(group))),
            inner: part(&|group| region.is_none_or(|r| r.holds(group))),
            slots: Slots::new(),
        }
    }

    /// Starts a step, for which `memory` is set up.
    pub(crate) fn begin(&mut self, model: &Model, memory: &Memory) {
        for part in self.outer.iter_mut().chain([&mut self.inner]) {
            part.begin_with(model, memory);
        }
    }

    /// The forces `∂W/∂u` at the given displacements.
    pub(crate) fn forces(
        &mut self,
        model: &Model,
        memory: &Memory,
        displacements: &[Vec3],
        forces: &mut [Vec3],
    ) -> Result<(), Inverted> {
        forces.fill(Vec3::zeros());
        let mut sums = Sums {
            forces,
            blocks: None,
        };
        for part in self.outer.iter().chain([&self.inner]) {
            part.add_to(model, memory, displacements, &mut self.slots, &mut sums)?;
        }
        Ok(())
    }

    /// The forces, and the stiffness in the blocks of the linear system.
    pub(crate) fn stiffness(
        &mut self,
        model: &Model,
        memory: &Memory,
        displacements: &[Vec3],
        forces: &mut [Vec3],
        system: &mut LinearSystem,
    ) -> Result<(), Inverted> {
        forces.fill(Vec3::zeros());
        system.blocks.fill(Mat3::zeros());
        for (part, is_outer) in
            (self.outer.iter().map(|part| (part, true))).chain([(&self.inner, false)])
        {
            let mut sums = Sums {
                forces,
                blocks: Some(&mut system.blocks),
            };
            part.add_to(model, memory, displacements, &mut self.slots, &mut sums)?;
            if is_outer {
                system.note_outer_share();
            }
        }
        Ok(())
    }
}

/// Stiffness at rest, in the order of the model's structure, without supports.
pub(crate) fn stiffness_at_rest(model: &Model) -> Vec<Mat3> {
    let state = State::new(model);
    let mut memory = Memory::new(model);
    memory.begin(model, &state, 0.0);
    let mut assembler = Assembler::new(model, &memory, None);
    assembler.begin(model, &memory);
    let mut forces = vec![Vec3::zeros(); model.n_nodes()];
    let mut blocks = vec![Mat3::zeros(); model.structure.n_blocks()];
    let mut sums = Sums {
        forces: &mut forces,
        blocks: Some(&mut blocks),
    };
    let Assembler { inner, slots, .. } = &mut assembler;
    // A body at rest has no prism that is inverted.
    let _ = inner.add_to(model, &memory, &state.displacements, slots, &mut sums);
    blocks
}

/// Strain energy at the given displacements, J. The sum does not depend on the number of threads.
pub(crate) fn energy(model: &Model, memory: &Memory, displacements: &[Vec3]) -> f64 {
    /// Groups that are summed up by one thread.
    const TOGETHER: usize = 256;
    let indices: Vec<usize> = (0..model.geometries.len()).collect();
    let parts: Vec<f64> = indices
        .par_chunks(TOGETHER)
        .map(|indices| {
            let mut response = GroupResponse::new();
            let mut phases = Vec::with_capacity(4);
            let of = |&index: &usize| {
                evaluate_group(
                    model,
                    memory,
                    index,
                    displacements,
                    &mut phases,
                    &mut response,
                    false,
                );
                response.energy
            };
            indices.iter().map(of).sum()
        })
        .collect();
    parts.iter().sum()
}

/// Evaluates one group.
pub(crate) fn evaluate_group<'a>(
    model: &'a Model,
    memory: &'a Memory,
    index: usize,
    displacements: &[Vec3],
    phases: &mut Vec<PhaseAt<'a>>,
    response: &mut GroupResponse,
    with_tangent: bool,
) {
    let (i, g) = (index / model.n_groups(), index % model.n_groups());
    phases_at(model, memory, index, phases);
    evaluate(
        model.structure.groups[g].shape,
        &model.geometries[index],
        &model.group_nodes(g, i).map(|n| displacements[n]),
        phases,
        model.shares(i),
        with_tangent,
        response,
    );
}

/// Sums energy and forces at the given displacements, and stiffness if `blocks` is given, one group
/// after the other. The forces are `∂W/∂u`.
#[cfg(test)]
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
    for index in 0..model.geometries.len() {
        let (i, g) = (index / n_groups, index % n_groups);
        let with_tangent = blocks.is_some();
        evaluate_group(
            model,
            memory,
            index,
            displacements,
            &mut phases,
            &mut response,
            with_tangent,
        );
        let nodes = model.group_nodes(g, i);
        if !response.energy.is_finite() {
            let middle = nodes.iter().map(|&n| model.body.positions[n]).sum::<Vec3>() / 8.0;
            return Err(Inverted { at: middle });
        }
        energy += response.energy;
        let group = &model.structure.groups[g];
        for (local, &node) in nodes.iter().enumerate().take(group.n_nodes()) {
            forces[node] += response.forces[local];
        }
        if let Some(blocks) = &mut blocks {
            model
                .structure
                .scatter(group, i, &response.stiffness, blocks);
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
    use crate::{Material, Materials, ModelParams, Supports};

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
