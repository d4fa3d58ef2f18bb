//! How stiff the skin is under a single vertex: its column at rest, with the columns round it held,
//! and the shear modulus there.

use crate::Mat3;
use crate::assembly::stiffness_at_rest;
use crate::element::Phase;
use crate::model::Model;

/// The shortest waves of a skin that yields by its own column's stiffness alone would grow under a
/// deep tool: compressed tissue is softer against them. A stiffer law keeps them small; a much stiffer
/// one would let single points carry the tool.
const STIFFER: f64 = 1.5;

/// Stiffness of the columns.
#[derive(Debug, Clone, Default)]
pub(crate) struct SkinStiffness {
    /// Pressure per penetration, `ε`, Pa/m. `[n_vertices]`
    pub(crate) normal: Vec<f64>,
    /// Shear modulus of the tissue under the vertex, Pa. `[n_vertices]`
    pub(crate) shear: Vec<f64>,
}

impl SkinStiffness {
    /// Stiffness of all columns of a model. Cost: an assembly of the stiffness.
    pub(crate) fn new(model: &Model) -> Self {
        let blocks = stiffness_at_rest(model);
        let normals = model.body.skin.vertex_normals();
        let mut out = Self::default();
        for (v, normal) in normals.iter().enumerate() {
            let compliance = column(model, &blocks, v).try_inverse();
            let along = compliance.map_or(0.0, |c| normal.dot(&(c * normal)));
            let area = model.skin_areas[v];
            out.normal.push(if along > 0.0 && area > 0.0 {
                STIFFER / (along * area)
            } else {
                0.0
            });
        }
        out.shear = shear_moduli(model);
        out
    }
}

/// Mean shear modulus of the uppermost prisms round each vertex, Pa. `[n_vertices]`
fn shear_moduli(model: &Model) -> Vec<f64> {
    let n = model.body.n_vertices();
    let (mut sums, mut counts) = (vec![0.0; n], vec![0.0; n]);
    for (g, group) in model.structure.groups.iter().enumerate() {
        let [from, to] = [g, g + 1].map(|g| model.first_phase[g] as usize);
        let of = |phase: &Phase| {
            let law = &model.materials[phase.material as usize].law;
            let factor = phase.points.iter().sum::<f64>() / phase.points.len() as f64;
            phase.volume * factor * law.shear_modulus()
        };
        let shear: f64 = model.phases[from..to].iter().map(of).sum();
        for &t in &group.triangles[..usize::from(group.shape.n_wedges)] {
            for v in model.body.skin.triangles[t as usize] {
                sums[v as usize] += shear;
                counts[v as usize] += 1.0;
            }
        }
    }
    (sums.iter().zip(&counts))
        .map(|(sum, count)| sum / f64::max(*count, 1.0))
        .collect()
}

/// Stiffness of the skin's node of a column, with the nodes below free and all other columns held.
fn column(model: &Model, blocks: &[Mat3], v: usize) -> Mat3 {
    let structure = &model.structure;
    let own = structure.pattern.own(v);
    let mut below = Mat3::zeros();
    for l in (0..structure.n_free_levels).rev() {
        let hold = &model.supports[model.body.node(v, l)];
        if hold.n == 3 {
            below = Mat3::zeros();
            continue;
        }
        let mut here = blocks[own + 2 * l] - below;
        let size = here.trace().abs();
        for k in 0..usize::from(hold.n) {
            let axis = hold.frame.column(k).into_owned();
            here += axis * axis.transpose() * (1e6 * size);
        }
        if l == 0 {
            return here;
        }
        let coupling = blocks[own + 2 * (l - 1) + 1];
        below = here.try_inverse().map_or_else(Mat3::zeros, |inverse| {
            coupling.transpose() * inverse * coupling
        });
    }
    Mat3::zeros()
}
