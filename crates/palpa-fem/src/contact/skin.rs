//! How stiff the skin is under a single vertex: its column at rest, with the columns round it held.

use crate::Mat3;
use crate::assembly::stiffness_at_rest;
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
    /// Stiffness against a force along the skin, N/m. `[n_vertices]`
    pub(crate) tangential: Vec<f64>,
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
            let across = compliance.map_or(0.0, |c| 0.5 * (c.trace() - along));
            let area = model.skin_areas[v];
            out.normal.push(if along > 0.0 && area > 0.0 {
                STIFFER / (along * area)
            } else {
                0.0
            });
            out.tangential
                .push(if across > 0.0 { 1.0 / across } else { 0.0 });
        }
        out
    }
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
