//! Coarsening of a skin before growth: edges are collapsed where the given triangles are smaller
//! than wanted.
//!
//! ```text
//! v → w:    a───b               a───b
//!          / \ / \             / \ / \
//!         c───v───w     ──►   c───────w
//!          \ / \ /             \ ` . /
//!           d───e               d───e
//! ```
//! A vertex moves onto a neighbour (a half-edge collapse), the shortest edge first. So every vertex
//! of the coarse skin is one of the given skin. A collapse is refused if a new triangle is longer
//! than wanted, thin, or turned; if the skin would no longer be a manifold; or if a point of the
//! given skin would be further from the coarse one than allowed. A vertex of the rim moves along the
//! rim only.
//!
//! The distance is measured at the given vertices, at the middles of the given edges and at the
//! centres of the given triangles. Each of these points belongs to the triangle of the coarse skin
//! that it is nearest to among those that took the place of its own.
//!
//! *Not used:* libraries that simplify meshes (`meshopt`, `baby_shark`, `threecrate`,
//! `axiolid-decimate`). None takes lengths of edges by place, and triangles that are good for pictures
//! may be too thin for finite elements.

mod collapse;
mod sizes;

use crate::Surface;
use crate::Vec3;
use collapse::Mesh;
pub use sizes::Coarsening;

/// A coarsened skin.
#[derive(Debug, Clone, PartialEq)]
pub struct Coarsened {
    /// The coarse skin. Vertices keep their order.
    pub surface: Surface,
    /// For each vertex of the coarse skin, its index in the given one, ascending. `[n_vertices]`
    pub given: Vec<u32>,
    /// Largest distance of a point of the given skin from the coarse skin, m. It is an upper bound
    /// at the points where it is measured.
    pub deviation: f64,
}

/// Limits of coarsening.
#[derive(Debug)]
pub struct CoarsenLimits<'a, Longest> {
    /// For each vertex, whether it stays. `[n_vertices]`
    pub is_kept: &'a [bool],
    /// Largest distance from the given skin at each vertex, m. `[n_vertices]`
    pub tolerance: &'a [f64],
    /// Longest edge of a triangle with these corners, m; infinite for no limit.
    pub longest: Longest,
}

/// Coarsens a skin. Vertices at which separate fans of triangles meet stay; those without triangles
/// are left out.
///
/// # Panics
/// If an edge belongs to more than two triangles, or to two of the same direction; or if the limits
/// are not those of the skin's vertices.
pub fn coarsen(
    skin: &Surface,
    limits: &CoarsenLimits<'_, impl Fn(&[Vec3; 3]) -> f64>,
) -> Coarsened {
    let n = skin.points.len();
    assert_eq!([limits.is_kept.len(), limits.tolerance.len()], [n; 2]);
    Mesh::new(skin, limits).coarsen()
}
