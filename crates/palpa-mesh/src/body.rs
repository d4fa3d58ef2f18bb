//! The layered body: the triangulation of a surface, repeated on every level.

use crate::{Surface, Vec3};

/// A body of triangular prisms. Every vertex of a skin surface carries a *column* of `n_levels`
/// nodes, from the skin (level 0) down to the rigid base (the last level). A prism fills the space
/// between two neighbouring levels below a triangle. It belongs to the layer of its interval.
///
/// ```text
///        v2                 node (v, l) has the index v * n_levels + l
///       /|\                 level 0   skin
///      / | \                level 1   ┐ interval 0, layer interval_layer[0]
///    v0--+--v1   level l    level 2   ┐ interval 1
///     |  v2' |              ...
///     | / \  |
///    v0'---v1'   level l+1
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct LayeredBody {
    /// The skin at rest, oriented outward; its points are the nodes of level 0.
    pub skin: Surface,
    /// Node positions at rest, column by column, in metres. `[n_vertices × n_levels]`
    pub positions: Vec<Vec3>,
    /// Nodes per column, at least 2.
    pub n_levels: usize,
    /// The layer of each interval between levels, from the skin down, ascending. `[n_levels − 1]`
    pub interval_layer: Vec<usize>,
    /// Names of the layers, from the skin down.
    pub layer_names: Vec<String>,
    /// The cut faces, where the body was cut from the rest: ends of a limb, sides of a block, the
    /// rim of a cut-out.
    pub cut_faces: Vec<CutFace>,
}

/// One face at which the body was cut from the rest.
#[derive(Debug, Clone, PartialEq)]
pub struct CutFace {
    /// The skin vertices whose columns lie in the face, along the rim. A corner may belong to two
    /// faces.
    pub vertices: Vec<u32>,
    /// Unit normal that points out of the body (the mean normal if the face is not flat).
    pub normal: Vec3,
    /// A point on the face.
    pub point: Vec3,
    /// Whether the face is a plane. If so, the columns stay exactly in it. If not, the face can be
    /// free or fixed, but it cannot be a plane of symmetry.
    pub is_flat: bool,
}

impl LayeredBody {
    /// Number of columns, which is the number of skin vertices.
    pub fn n_vertices(&self) -> usize {
        self.skin.points.len()
    }

    /// Number of nodes, `n_vertices × n_levels`.
    pub fn n_nodes(&self) -> usize {
        self.positions.len()
    }

    /// Number of prisms, `n_triangles × (n_levels − 1)`.
    pub fn n_prisms(&self) -> usize {
        self.skin.triangles.len() * (self.n_levels - 1)
    }

    /// The index of the node of vertex `v` at level `l`.
    pub fn node(&self, v: usize, l: usize) -> usize {
        debug_assert!(l < self.n_levels);
        v * self.n_levels + l
    }

    /// The six nodes of the prism under triangle `t` in interval `i`: the upper triangle, then the
    /// lower.
    pub fn prism(&self, t: usize, i: usize) -> [usize; 6] {
        let [a, b, c] = self.skin.triangles[t].map(|v| self.node(v as usize, i));
        [a, b, c, a + 1, b + 1, c + 1]
    }

    /// Whether a node belongs to the rigid base (the deepest level).
    pub fn is_base(&self, node: usize) -> bool {
        node % self.n_levels == self.n_levels - 1
    }
}
