//! Results inside a pressed body: stress, stretch, energy, and the forces between layers.

use palpa_mesh::Vec3;
use rayon::prelude::*;

use crate::Mat3;
use crate::assembly::{evaluate_group, phases_at};
use crate::element::{GroupResponse, element_fields};
use crate::model::Model;
use crate::state::{Memory, State};
use crate::statics::Workspace;

/// The state of one prism, averaged over its volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrismField {
    /// Cauchy stress, Pa.
    pub cauchy: Mat3,
    /// Stretches along the principal directions, ascending.
    pub stretches: [f64; 3],
    /// Volume divided by the volume at rest.
    pub volume_ratio: f64,
    /// Strain energy divided by the volume at rest, J/m³; for a viscous material, the elastic part
    /// of its present law.
    pub energy: f64,
}

impl PrismField {
    /// Von Mises stress, Pa: 0 under pressure alone.
    pub fn von_mises(&self) -> f64 {
        let deviator = self.cauchy - Mat3::identity() * (self.cauchy.trace() / 3.0);
        (1.5 * deviator.norm_squared()).sqrt()
    }

    /// Pressure, Pa, positive in compression: minus the mean normal stress.
    pub fn pressure(&self) -> f64 {
        -self.cauchy.trace() / 3.0
    }
}

/// The state of every prism, prism (t, i) at `t (n_levels − 1) + i`. `[n_prisms]`
///
/// `ws` must be the workspace that solved the state last.
pub fn prism_fields(model: &Model, state: &State, ws: &Workspace) -> Vec<PrismField> {
    fields_with(model, &state.displacements, &ws.memory)
}

/// The state of every prism at these displacements after full relaxation, without the memory of
/// viscous materials. `[n_prisms]`
pub fn relaxed_fields(model: &Model, displacements: &[Vec3]) -> Vec<PrismField> {
    let mut memory = Memory::new(model);
    memory.begin(model, &State::new(model), f64::INFINITY);
    fields_with(model, displacements, &memory)
}

fn fields_with(model: &Model, displacements: &[Vec3], memory: &Memory) -> Vec<PrismField> {
    let n_intervals = model.body.n_levels - 1;
    let none = PrismField {
        cauchy: Mat3::zeros(),
        stretches: [1.0; 3],
        volume_ratio: 1.0,
        energy: 0.0,
    };
    let n_groups = model.n_groups();
    let indices: Vec<usize> = (0..model.geometries.len()).collect();
    let of_groups: Vec<[PrismField; 2]> = indices
        .par_iter()
        .map_init(Vec::new, |phases, &index| {
            let (i, g) = (index / n_groups, index % n_groups);
            let group = &model.structure.groups[g];
            phases_at(model, memory, index, phases);
            let local = model.group_nodes(g, i).map(|n| displacements[n]);
            let geometry = &model.geometries[index];
            let wedges = element_fields(group.shape, geometry, &local, phases, model.shares(i));
            wedges.map(|(cauchy, f, volume_ratio, energy)| PrismField {
                cauchy,
                stretches: stretches(&f),
                volume_ratio,
                energy,
            })
        })
        .collect();
    let mut fields = vec![none; model.body.n_prisms()];
    for (index, of_group) in of_groups.into_iter().enumerate() {
        let (i, group) = (index / n_groups, &model.structure.groups[index % n_groups]);
        let triangles = &group.triangles[..usize::from(group.shape.n_wedges)];
        for (&triangle, field) in triangles.iter().zip(of_group) {
            fields[triangle as usize * n_intervals + i] = field;
        }
    }
    fields
}

/// Principal stretches of a deformation gradient, ascending.
fn stretches(f: &Mat3) -> [f64; 3] {
    let mut stretches: [f64; 3] = (f.transpose() * f)
        .symmetric_eigenvalues()
        .map(|x| x.max(0.0).sqrt())
        .into();
    stretches.sort_by(f64::total_cmp);
    stretches
}

/// For each level, the force of the tissue below on it, N; for the deepest level, that of the bone.
/// `[n_levels]`
///
/// If the body has no held cut faces, all of them equal the force of the tool, which passes through
/// all layers.
pub fn level_forces(model: &Model, state: &State, ws: &Workspace) -> Vec<Vec3> {
    let below = |i: usize| {
        let (mut phases, mut response) = (Vec::with_capacity(4), GroupResponse::new());
        let mut sum = Vec3::zeros();
        for (g, group) in model.structure.groups.iter().enumerate() {
            evaluate_group(
                model,
                &ws.memory,
                i * model.n_groups() + g,
                &state.displacements,
                &mut phases,
                &mut response,
                false,
            );
            for node in (0..group.n_nodes()).step_by(2) {
                sum -= response.forces[node];
            }
        }
        sum
    };
    let intervals = (0..model.body.n_levels - 1).into_par_iter();
    let mut forces: Vec<Vec3> = intervals.map(below).collect();
    forces.push(Vec3::zeros());
    let base = model.body.n_levels - 1;
    for v in 0..model.body.n_vertices() {
        forces[base] += ws.reactions()[model.body.node(v, base)];
    }
    forces
}
