//! Local refinement of a body: new columns where the skin's triangles are too large, new levels
//! where intervals are too high.
//!
//! The geometry stays exactly the same. A new column is the weighted mean, level by level, of the
//! columns of the triangle that contains it. A new level divides the columns between two old
//! levels. So every new prism is a part of an old one.
//!
//! ```text
//! red: 1 → 4          green: 1 → 2, next to a red one
//!       c                   c
//!      / \                 /|\
//!    mc───mb              / | \
//!    / \ / \             /  |  \
//!   a──ma───b           a───m───b
//! ```
//! [`refine`] is red–green refinement (Bank, Sherman & Weiser 1983). The triangles of the red
//! forest are all similar to their ancestors. The green triangles only close it and are never
//! refined themselves, so that angles do not get worse with the number of rounds. To refine
//! further, or elsewhere, start again from the body as it was grown.
//!
//! Red triangles have half the edges of their parents, and four times the vertices. If asked, triangles
//! that are too large by less than √2 are divided into two at the end, at a long side that their
//! neighbour divides as well: twice the vertices.

mod forest;
mod imprint;
mod levels;
mod origin;
mod size;
mod slide;

use crate::quality::PrismShape;
use crate::{CutFace, LayeredBody, Surface, Vec3};

use forest::Forest;
pub use imprint::{Circle, Imprint, ImprintError, imprint_circle};
pub use levels::{LevelSplit, along, mean_depths, near_depth, parts_for, split_levels};
pub use origin::Origins;
pub use size::near_points;
pub use slide::{Slide, slide_vertices};

/// Limits of refinement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RefineParams {
    /// Once the skin has this many vertices, no more triangles are split because of their size.
    /// Splits that keep the mesh conforming still happen, so that the number can be exceeded,
    /// usually by a few per cent.
    pub max_vertices: usize,
    /// How often a triangle of the skin may be divided into four.
    pub max_depth: u32,
    /// Whether a triangle that is too large by less than a factor of √2 is divided into two instead. Its
    /// size is then not its longest edge but twice the root of its area, which is the same in a right
    /// triangle with equal legs, and at least 0.75 times its longest edge.
    pub divides_in_two: bool,
}

impl Default for RefineParams {
    fn default() -> Self {
        Self {
            max_vertices: 100_000,
            max_depth: 10,
            divides_in_two: false,
        }
    }
}

/// A refined body, and the origin of its parts.
#[derive(Debug, Clone, PartialEq)]
pub struct Refined {
    /// The refined body. Its first vertices are those of the old body, with the same indices.
    pub body: LayeredBody,
    /// For each vertex, its place on the old skin.
    pub origins: Origins,
    /// For each triangle, the old triangle that it is a part of, ascending. `[n_triangles]`
    pub parents: Vec<u32>,
    /// Number of triangles that are still larger than wanted because a limit was reached; 0 if
    /// there are none.
    pub n_too_large: usize,
    /// Number of prisms that are turned over although the old prism around them passes the checks
    /// of [`crate::quality`]: it is folded inside. It is 0 except for prisms on the brink.
    pub n_invalid: usize,
    /// Number of vertices of the old body.
    n_old: usize,
}

impl Refined {
    /// Combines two refinements. `self` was made from the body of `earlier`; the result refers to
    /// the body that `earlier` was made from.
    ///
    /// # Panics
    /// If `self` was made from a body with another number of vertices.
    #[must_use]
    pub fn after(self, earlier: &Self) -> Self {
        assert_eq!(
            self.n_old,
            earlier.body.n_vertices(),
            "vertices of the body in between"
        );
        Self {
            origins: self.origins.after(&earlier.origins),
            parents: self
                .parents
                .iter()
                .map(|&t| earlier.parents[t as usize])
                .collect(),
            n_too_large: self.n_too_large + earlier.n_too_large,
            n_invalid: self.n_invalid + earlier.n_invalid,
            n_old: earlier.n_old,
            body: self.body,
        }
    }

    /// Carries a field from the old vertices to the new ones, linearly in each triangle.
    ///
    /// `field` holds the same number of values for each vertex of the old body, vertex by vertex:
    /// one (`[n_vertices]`), or one per level (`[n_nodes]`, like positions).
    ///
    /// # Panics
    /// If the length of `field` is not a multiple of the number of old vertices.
    pub fn interpolate<T>(&self, field: &[T]) -> Vec<T>
    where
        T: Copy + std::ops::Mul<f64, Output = T> + std::ops::Add<Output = T>,
    {
        assert!(
            field.len().is_multiple_of(self.n_old),
            "{} values for {} vertices",
            field.len(),
            self.n_old
        );
        self.origins.interpolate(field, field.len() / self.n_old)
    }
}

/// Refines the skin until no triangle has an edge longer than wanted, and builds the columns below
/// it.
///
/// `wanted` returns the smallest wanted edge length (m) in a triangle. It takes the index of the
/// old triangle that contains it, and the triangle's corners. [`near_points`] makes such functions.
/// NaN means no limit.
///
/// # Panics
/// If the skin is not conforming and oriented (no directed edge twice); grown bodies are.
pub fn refine(
    body: &LayeredBody,
    params: &RefineParams,
    wanted: impl Fn(u32, &[Vec3; 3]) -> f64,
) -> Refined {
    let mut forest = Forest::new(&body.skin);
    forest.refine(params, wanted);
    let (triangles, parents) = forest.triangles();
    let origins = forest.origins();
    let cut_faces = body
        .cut_faces
        .iter()
        .map(|face| CutFace {
            vertices: forest.along_rim(&face.vertices, is_closed(&body.skin, &face.vertices)),
            ..face.clone()
        })
        .collect();
    let mut refined = assemble(body, origins, triangles, parents, cut_faces);
    refined.n_too_large = forest.n_too_large();
    refined
}

/// Whether a rim edge joins the last vertex of a run to the first.
fn is_closed(skin: &Surface, run: &[u32]) -> bool {
    let &[first, .., last] = run else {
        return false;
    };
    let has_edge = |t: &&[u32; 3]| t.contains(&first) && t.contains(&last);
    run.len() > 2 && skin.triangles.iter().filter(has_edge).count() == 1
}

/// The body over the new triangles. Its columns are the weighted means in `origins`.
fn assemble(
    body: &LayeredBody,
    origins: Origins,
    triangles: Vec<[u32; 3]>,
    parents: Vec<u32>,
    cut_faces: Vec<CutFace>,
) -> Refined {
    let positions = origins.interpolate(&body.positions, body.n_levels);
    let refined = LayeredBody {
        skin: Surface {
            points: positions.iter().step_by(body.n_levels).copied().collect(),
            triangles,
        },
        positions,
        n_levels: body.n_levels,
        interval_layer: body.interval_layer.clone(),
        layer_names: body.layer_names.clone(),
        cut_faces,
    };
    let is_new =
        |t: &usize| refined.skin.triangles[*t] != body.skin.triangles[parents[*t] as usize];
    let n_invalid = (0..parents.len())
        .filter(is_new)
        .flat_map(|t| (0..body.n_levels - 1).map(move |i| (t, i)))
        .filter(|&(t, i)| !is_valid(&refined, t, i) && is_valid(body, parents[t] as usize, i))
        .count();
    Refined {
        body: refined,
        origins,
        parents,
        n_too_large: 0,
        n_invalid,
        n_old: body.n_vertices(),
    }
}

fn is_valid(body: &LayeredBody, t: usize, interval: usize) -> bool {
    PrismShape::of(&body.prism(t, interval).map(|n| body.positions[n])).is_valid()
}
