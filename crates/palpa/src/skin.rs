//! Points of a skin between its vertices.

use palpa_mesh::{LayeredBody, Surface, SurfaceIndex, Vec3};

/// A point with a smaller weight of a corner than this lies on the opposite edge.
const ON_EDGE: f64 = 1e-9;

/// A point of a skin, between the corners of a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkinPoint {
    /// The point at rest, m.
    pub at: Vec3,
    /// The corners of its triangle, indices of skin vertices.
    pub corners: [usize; 3],
    /// The weights of the corners, which sum up to 1.
    pub weights: [f64; 3],
}

impl SkinPoint {
    /// A vertex of a skin.
    pub(crate) fn vertex(skin: &Surface, v: usize) -> Self {
        Self {
            at: skin.points[v],
            corners: [v; 3],
            weights: [1.0, 0.0, 0.0],
        }
    }

    /// The mean of a quantity of the corners, with their weights.
    pub fn mean(&self, of: impl Fn(usize) -> Vec3) -> Vec3 {
        self.parts().map(|(v, weight)| of(v) * weight).sum()
    }

    /// Length of the column under the point, m. The columns of the corners are interpolated.
    pub fn column_length(&self, body: &LayeredBody) -> f64 {
        let at = |l: usize| self.mean(|v| body.positions[body.node(v, l)]);
        (1..body.n_levels).map(|l| (at(l) - at(l - 1)).norm()).sum()
    }

    /// The corners between which the point lies: one at a vertex, two on an edge.
    fn parts(&self) -> impl Iterator<Item = (usize, f64)> {
        (self.corners.into_iter().zip(self.weights)).filter(|&(_, weight)| weight > 0.0)
    }
}

/// A skin with an index for nearest-point queries.
pub(crate) struct Skin<'a> {
    surface: &'a Surface,
    index: SurfaceIndex,
    normals: Vec<Vec3>,
}

impl<'a> Skin<'a> {
    pub(crate) fn new(surface: &'a Surface) -> Self {
        Self {
            surface,
            index: SurfaceIndex::build(surface),
            normals: surface.vertex_normals(),
        }
    }

    /// The point of the skin nearest to `p`; `None` for a skin without triangles.
    pub(crate) fn nearest(&self, p: Vec3) -> Option<SkinPoint> {
        let closest = self.index.closest(p)?;
        Some(SkinPoint {
            at: closest.point,
            corners: self.surface.triangles[closest.triangle as usize].map(|v| v as usize),
            weights: closest.weights,
        })
    }

    /// The inward unit normal at a point, interpolated between the normals of the vertices.
    pub(crate) fn inward(&self, point: &SkinPoint) -> Vec3 {
        (-point.mean(|v| self.normals[v]))
            .try_normalize(0.0)
            .unwrap_or_else(|| -self.normals[point.corners[0]])
    }
}

/// The rim of a skin: the edges that belong to a single triangle.
pub(crate) struct Rim {
    /// Edges with the smaller vertex first, ascending.
    edges: Vec<[usize; 2]>,
    /// Vertices, ascending.
    vertices: Vec<usize>,
}

impl Rim {
    pub(crate) fn of(skin: &Surface) -> Self {
        let mut sides: Vec<[usize; 2]> = (skin.triangles.iter())
            .map(|t| t.map(|v| v as usize))
            .flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]])
            .map(|[a, b]| [a.min(b), a.max(b)])
            .collect();
        sides.sort_unstable();
        let edges: Vec<_> = (sides.chunk_by(|a, b| a == b))
            .filter(|same| same.len() == 1)
            .map(|same| same[0])
            .collect();
        let mut vertices: Vec<usize> = edges.iter().copied().flatten().collect();
        vertices.sort_unstable();
        vertices.dedup();
        Self { edges, vertices }
    }

    /// Whether a point of the skin lies on the rim.
    pub(crate) fn has(&self, point: &SkinPoint) -> bool {
        let on: Vec<usize> = (point.parts())
            .filter(|&(_, weight)| weight > ON_EDGE)
            .map(|(v, _)| v)
            .collect();
        match on[..] {
            [v] => self.vertices.binary_search(&v).is_ok(),
            [a, b] => self.edges.binary_search(&[a.min(b), a.max(b)]).is_ok(),
            _ => false,
        }
    }
}
