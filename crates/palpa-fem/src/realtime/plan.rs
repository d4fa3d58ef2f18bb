//! The columns of a zone, and the elimination order of all columns.

use palpa_mesh::Vec3;
use palpa_sparse::fronts::Tree;
use palpa_sparse::{Block, ColumnPattern, Singular, TooLarge};

use crate::assembly::Inverted;
use crate::columns::{SurfaceGroup, places};
use crate::model::Model;

/// Stiffness of the springs that hold a supported node, relative to its own.
const SUPPORT: f64 = 1e3;
/// The reason why a step failed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Trouble {
    /// A prism is turned inside out; its middle at rest, m.
    Inverted(Vec3),
    /// A matrix could not be made positive definite.
    Singular,
}

impl From<Inverted> for Trouble {
    fn from(inverted: Inverted) -> Self {
        Self::Inverted(inverted.at)
    }
}

impl From<Singular> for Trouble {
    fn from(_: Singular) -> Self {
        Self::Singular
    }
}

/// The columns of a zone, and the elimination order of all columns.
#[derive(Debug)]
pub(super) struct Plan {
    /// Number of the zone, counted from 1.
    pub(super) id: u64,
    /// Centre at rest, m.
    pub(super) centre: Vec3,
    /// Radius, m; infinite for the whole body.
    pub(super) radius: f64,
    /// Order of elimination: exterior, zone, ring.
    pub(super) tree: Tree,
    /// Whether a vertex is in the zone. `[n_vertices]`
    pub(super) is_inside: Vec<bool>,
    /// Skin vertices of the zone, ascending.
    pub(super) vertices: Vec<u32>,
    /// Nodes with unknowns, each with the first of its three unknowns: nodes of the zone (ring
    /// included), of the ring, and of the exterior.
    pub(super) zone: Vec<[u32; 2]>,
    pub(super) ring: Vec<[u32; 2]>,
    pub(super) exterior: Vec<[u32; 2]>,
}

impl Plan {
    /// The zone of all columns whose skin vertex at rest is within `radius` of `centre`; all
    /// columns if there is none.
    pub(super) fn new(
        model: &Model,
        pattern: &ColumnPattern,
        id: u64,
        centre: Vec3,
        radius: f64,
    ) -> Result<Self, TooLarge> {
        let points = &model.body.skin.points;
        let mut is_inside: Vec<bool> = points
            .iter()
            .map(|p| (p - centre).norm() <= radius)
            .collect();
        if !is_inside.contains(&true) {
            is_inside.fill(true);
        }
        let tree = Tree::zone_last(pattern, &places(&model.body.skin), &is_inside)?;
        let nodes = |keep: &dyn Fn(usize) -> bool| -> Vec<[u32; 2]> {
            (0..points.len())
                .filter(|&v| keep(v))
                .flat_map(|v| {
                    let first = tree.first_dof(v);
                    (0..model.structure.n_free_levels)
                        .map(move |l| [model.body.node(v, l) as u32, (first + 3 * l) as u32])
                })
                .collect()
        };
        let ring_start = model.structure.n_dofs() - tree.n_ring_columns() * pattern.width();
        let has_ring = tree.n_ring_columns() > 0;
        let zone = nodes(&|v| is_inside[v]);
        let ring = nodes(&|v| has_ring && is_inside[v] && tree.first_dof(v) >= ring_start);
        let exterior = nodes(&|v| !is_inside[v]);
        Ok(Self {
            id,
            centre,
            radius,
            vertices: (0..points.len() as u32)
                .filter(|&v| is_inside[v as usize])
                .collect(),
            zone,
            ring,
            exterior,
            tree,
            is_inside,
        })
    }

    /// Whether all columns of a group are in the zone.
    pub(super) fn holds(&self, group: &SurfaceGroup) -> bool {
        group.is_within(&self.is_inside)
    }

    /// Adds stiff springs where nodes are supported.
    pub(super) fn support(
        &self,
        model: &Model,
        pattern: &ColumnPattern,
        inside: bool,
        blocks: &mut [Block<f32>],
    ) {
        for &[node, _] in if inside { &self.zone } else { &self.exterior } {
            let hold = &model.supports[node as usize];
            if hold.n == 0 {
                continue;
            }
            let (v, l) = (
                node as usize / model.body.n_levels,
                node as usize % model.body.n_levels,
            );
            let block = &mut blocks[pattern.own(v) + 2 * l];
            let size = (block[0] + block[4] + block[8]) / 3.0 * SUPPORT as f32;
            for k in 0..usize::from(hold.n) {
                let axis = hold.frame.column(k);
                for c in 0..3 {
                    for r in 0..3 {
                        block[r + 3 * c] += size * (axis[r] * axis[c]) as f32;
                    }
                }
            }
        }
    }
}
