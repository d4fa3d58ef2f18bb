//! A triangle surface: points and triangles only.

use std::collections::BTreeMap;

use crate::Vec3;

/// A triangle mesh. The triangles are counter-clockwise seen from outside, so that the normals
/// point outward.
///
/// The topology may have any defect; [`check_surface`](crate::check::check_surface) finds them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surface {
    /// Vertices, in metres. `[n_vertices]`
    pub points: Vec<Vec3>,
    /// Vertex indices of each triangle, all below `points.len()`. `[n_triangles]`
    pub triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// The corners of triangle `t`.
    pub fn corners(&self, t: usize) -> [Vec3; 3] {
        self.triangles[t].map(|v| self.points[v as usize])
    }

    /// The area vector of triangle `t`: half the cross product of its edges, along its outward
    /// normal. m²
    pub fn area_vector(&self, t: usize) -> Vec3 {
        let [a, b, c] = self.corners(t);
        (b - a).cross(&(c - a)) * 0.5
    }

    /// Unit vertex normals, weighted by the area of the triangles around each vertex.
    /// `[n_vertices]`
    ///
    /// A vertex without triangles, or with triangles whose normals cancel, gets the zero vector.
    pub fn vertex_normals(&self) -> Vec<Vec3> {
        let mut normals = vec![Vec3::zeros(); self.points.len()];
        for (t, triangle) in self.triangles.iter().enumerate() {
            let area = self.area_vector(t);
            for &v in triangle {
                normals[v as usize] += area;
            }
        }
        for n in &mut normals {
            *n = n
                .try_normalize(f64::MIN_POSITIVE)
                .unwrap_or_else(Vec3::zeros);
        }
        normals
    }

    /// Every edge once, as a vertex pair with the smaller index first. The pairs are in ascending
    /// order.
    pub fn edges(&self) -> Vec<[u32; 2]> {
        let mut edges: Vec<[u32; 2]> = self
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
            .map(|[a, b]| [a.min(b), a.max(b)])
            .collect();
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    /// Closed loops of vertices along the boundary. The boundary is the set of directed edges
    /// without a partner in the opposite direction.
    ///
    /// Loops have the direction of their triangles. Edges that form no closed loop (at non-manifold
    /// vertices) are left out.
    pub fn boundary_loops(&self) -> Vec<Vec<u32>> {
        let mut next: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        let mut directed: Vec<[u32; 2]> = self
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
            .collect();
        directed.sort_unstable();
        for &[a, b] in &directed {
            if directed.binary_search(&[b, a]).is_err() {
                next.entry(a).or_default().push(b);
            }
        }
        let mut loops = Vec::new();
        while let Some((&start, _)) = next.iter().next() {
            let mut chain = vec![start];
            let mut at = start;
            let is_closed = loop {
                let Some(ends) = next.get_mut(&at) else {
                    break false;
                };
                let Some(to) = ends.pop() else { break false };
                if ends.is_empty() {
                    next.remove(&at);
                }
                if to == start {
                    break true;
                }
                chain.push(to);
                at = to;
            };
            if is_closed {
                loops.push(chain);
            }
        }
        loops
    }

    /// A copy with every coordinate multiplied by `factor`; 0.001 converts millimetres to metres.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self {
            points: self.points.iter().map(|p| p * factor).collect(),
            triangles: self.triangles.clone(),
        }
    }

    /// Smallest and largest coordinates, or `None` if there are no points.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let first = *self.points.first()?;
        Some(
            self.points
                .iter()
                .fold((first, first), |(lo, hi), p| (lo.inf(p), hi.sup(p))),
        )
    }

    /// Mean edge length, in metres; 0 if there are no edges.
    pub fn mean_edge_length(&self) -> f64 {
        let edges = self.edges();
        if edges.is_empty() {
            return 0.0;
        }
        let sum: f64 = edges
            .iter()
            .map(|&[a, b]| (self.points[a as usize] - self.points[b as usize]).norm())
            .sum();
        sum / edges.len() as f64
    }
}
