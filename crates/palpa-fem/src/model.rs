//! A body ready to be pressed: all data that stays constant during a press.

use palpa_mesh::{LayeredBody, Vec3};

use crate::Material;
use crate::columns::Structure;
use crate::contact::SkinStiffness;
use crate::element::{GroupGeometry, Phase, Shares};
use crate::error::FemError;
use crate::materials::{Materials, assign};
use crate::pairing::{Pairing, pair_triangles_like};
use crate::system::Hold;

/// Nodes whose movement is always restricted.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Supports {
    /// Fixed nodes.
    pub fixed: Vec<usize>,
    /// Nodes restricted to a plane, with its normal. A node may have several planes.
    pub planes: Vec<(usize, Vec3)>,
}

impl Supports {
    /// Supports of a body whose base is fixed to the bone.
    pub fn on_base(body: &LayeredBody) -> Self {
        Self {
            fixed: (0..body.n_nodes()).filter(|&n| body.is_base(n)).collect(),
            planes: Vec::new(),
        }
    }
}

/// Parameters of the element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelParams {
    /// Those of the first layer.
    pub first: Shares,
    /// Those of the layers below it. `alpha` makes little difference to forces there, and soft layers
    /// that are squeezed flat keep their balance longer with 0 and with some `apart`; coarse triangles of
    /// a tense first layer lose theirs with it.
    pub below: Shares,
}

impl ModelParams {
    /// The same share of the pair's mean in all layers, and wedges that may change their volumes against
    /// each other.
    pub fn even(alpha: f64) -> Self {
        let shares = Shares { alpha, apart: 0.0 };
        Self {
            first: shares,
            below: shares,
        }
    }
}

impl Default for ModelParams {
    fn default() -> Self {
        Self::even(0.8)
    }
}

/// A layered body with its materials and supports, and all data that is computed beforehand.
#[derive(Debug)]
pub struct Model {
    pub(crate) body: LayeredBody,
    pub(crate) materials: Vec<Material>,
    pub(crate) structure: Structure,
    /// `[interval × n_groups]`
    pub(crate) geometries: Vec<GroupGeometry>,
    pub(crate) phases: Vec<Phase>,
    /// First phase of each group, and one past the last. `[interval × n_groups + 1]`
    pub(crate) first_phase: Vec<u32>,
    /// The group of each phase, as an index of `geometries`.
    pub(crate) phase_group: Vec<u32>,
    pub(crate) supports: Vec<Hold>,
    /// Lumped mass of every node, kg.
    pub(crate) masses: Vec<f64>,
    /// Area of skin that each skin vertex stands for, m².
    pub(crate) skin_areas: Vec<f64>,
    /// Stiffness of the skin in contact.
    pub(crate) skin_stiffness: SkinStiffness,
    pub(crate) params: ModelParams,
    pairing: Pairing,
    /// Whether any material relaxes or has tension at rest.
    pub(crate) has_memory: bool,
}

impl Model {
    /// Whether any material has tension at rest.
    pub(crate) fn is_tense(&self) -> bool {
        self.materials.iter().any(|m| m.prestress != 0.0)
    }

    /// Shares of a pair's mean and of its wedges in an interval.
    pub(crate) fn shares(&self, interval: usize) -> Shares {
        if self.body.interval_layer[interval] == 0 {
            self.params.first
        } else {
            self.params.below
        }
    }

    /// Builds a model. Cost: the symbolic factor, which grows a little faster than the number of
    /// nodes.
    ///
    /// # Errors
    /// When a prism is not valid, materials do not fit the body or each other, or the body is too
    /// large.
    pub fn build(
        body: &LayeredBody,
        materials: &Materials,
        supports: &Supports,
        params: ModelParams,
    ) -> Result<Self, FemError> {
        Self::build_like(body, materials, supports, params, &[])
    }

    /// The same with triangles paired as in another model, as far as they are the same: for a part of
    /// its body, or a finer mesh of it. `pairs` are the corners of its pairs, as in
    /// [`pair_triangles_like`]. Without them, the forces of two models with the same triangles may
    /// differ by 1 %.
    ///
    /// # Errors
    /// As [`build`](Self::build).
    pub fn build_like(
        body: &LayeredBody,
        materials: &Materials,
        supports: &Supports,
        params: ModelParams,
        pairs: &[[u32; 4]],
    ) -> Result<Self, FemError> {
        for Shares { alpha, apart } in [params.first, params.below] {
            if !(0.0..1.0).contains(&alpha) {
                return Err(FemError::Alpha { alpha });
            }
            if !(0.0..=1.0).contains(&apart) {
                return Err(FemError::Apart { apart });
            }
        }
        materials.check(body)?;
        let mut holds = vec![Hold::free(); body.n_nodes()];
        for &(node, normal) in &supports.planes {
            holds[node] = holds[node].and(&normal);
        }
        for &node in &supports.fixed {
            holds[node] = Hold::all();
        }
        let base_is_fixed = (0..body.n_nodes()).all(|n| !body.is_base(n) || holds[n].n == 3);
        let n_free_levels = body.n_levels - usize::from(base_is_fixed);
        let pairing = pair_triangles_like(&body.skin, pairs);
        let structure = Structure::build(&body.skin, &pairing, body.n_levels, n_free_levels)?;
        let geometries = geometries(body, &structure)?;
        let (phases, first_phase) = assign(body, &structure, &geometries, materials);
        let mut phase_group = vec![0; phases.len()];
        for (g, range) in first_phase.windows(2).enumerate() {
            phase_group[range[0] as usize..range[1] as usize].fill(g as u32);
        }
        let masses = masses(body, &structure, &geometries, materials);
        let mut model = Self {
            skin_areas: skin_areas(body),
            skin_stiffness: SkinStiffness::default(),
            has_memory: materials
                .materials
                .iter()
                .any(|m| m.prony.is_some() || m.prestress != 0.0),
            body: body.clone(),
            materials: materials.materials.clone(),
            pairing,
            structure,
            geometries,
            phases,
            first_phase,
            phase_group,
            supports: holds,
            masses,
            params,
        };
        model.skin_stiffness = SkinStiffness::new(&model);
        Ok(model)
    }

    /// The body at rest.
    pub fn body(&self) -> &LayeredBody {
        &self.body
    }

    /// Its materials.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// Number of nodes, including fixed ones.
    pub fn n_nodes(&self) -> usize {
        self.body.n_nodes()
    }

    /// Number of nodes that can move.
    pub fn n_free_nodes(&self) -> usize {
        self.supports.iter().filter(|hold| hold.n < 3).count()
    }

    /// Number of skin triangles without a partner. Prisms under them are too stiff if the tissue is
    /// nearly incompressible.
    pub fn n_single_triangles(&self) -> usize {
        self.pairing.singles.len()
    }

    /// How the triangles of the skin are paired.
    pub fn pairing(&self) -> &Pairing {
        &self.pairing
    }

    /// Area of skin that each skin vertex stands for at rest, m². `[n_vertices]`
    pub fn skin_areas(&self) -> &[f64] {
        &self.skin_areas
    }

    /// Number of groups in an interval.
    pub(crate) fn n_groups(&self) -> usize {
        self.structure.groups.len()
    }

    /// The nodes of a group in interval `i`, in the element's order.
    pub(crate) fn group_nodes(&self, group: usize, i: usize) -> [usize; 8] {
        let vertices = &self.structure.groups[group].vertices;
        std::array::from_fn(|n| self.body.node(vertices[n / 2] as usize, i + n % 2))
    }
}

/// Corners of the wedges of a group.
fn corners(body: &LayeredBody, triangles: &[u32], i: usize) -> Vec<[Vec3; 6]> {
    triangles
        .iter()
        .map(|&t| body.prism(t as usize, i).map(|node| body.positions[node]))
        .collect()
}

fn geometries(body: &LayeredBody, structure: &Structure) -> Result<Vec<GroupGeometry>, FemError> {
    let mut geometries = Vec::with_capacity((body.n_levels - 1) * structure.groups.len());
    for i in 0..body.n_levels - 1 {
        for group in &structure.groups {
            let triangles = &group.triangles[..usize::from(group.shape.n_wedges)];
            let corners = corners(body, triangles, i);
            let geometry = GroupGeometry::new(&corners);
            for (w, corners) in corners.iter().enumerate() {
                if !geometry.wedges[w].volumes.iter().all(|&v| v > 0.0) {
                    let middle = corners.iter().sum::<Vec3>() / 6.0;
                    return Err(FemError::InvertedPrism {
                        triangle: triangles[w],
                        interval: i,
                        at: middle.into(),
                    });
                }
            }
            geometries.push(geometry);
        }
    }
    Ok(geometries)
}

fn masses(
    body: &LayeredBody,
    structure: &Structure,
    geometries: &[GroupGeometry],
    materials: &Materials,
) -> Vec<f64> {
    let mut masses = vec![0.0; body.n_nodes()];
    for (g, geometry) in geometries.iter().enumerate() {
        let (i, group) = (g / structure.groups.len(), g % structure.groups.len());
        let group = &structure.groups[group];
        let material = materials.layers[body.interval_layer[i]];
        let density = materials.materials[material].density;
        for w in 0..usize::from(group.shape.n_wedges) {
            let share = density * geometry.wedges[w].volume() / 6.0;
            for node in body.prism(group.triangles[w] as usize, i) {
                masses[node] += share;
            }
        }
    }
    masses
}

fn skin_areas(body: &LayeredBody) -> Vec<f64> {
    let mut areas = vec![0.0; body.n_vertices()];
    for triangle in &body.skin.triangles {
        let [a, b, c] = triangle.map(|v| body.skin.points[v as usize]);
        let area = 0.5 * (b - a).cross(&(c - a)).norm();
        for &v in triangle {
            areas[v as usize] += area / 3.0;
        }
    }
    areas
}
