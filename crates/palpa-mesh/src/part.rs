//! A part of a body, as a body of its own.

use crate::{CutFace, LayeredBody, Surface};

/// A part of a body.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// The part.
    pub body: LayeredBody,
    /// The vertex of the whole body of each vertex. `[n_vertices]`
    pub vertices: Vec<u32>,
    /// Whether a vertex touches a triangle of the whole body that is not in the part.
    /// `[n_vertices]`
    pub is_border: Vec<bool>,
}

impl Part {
    /// The prisms below the triangles that `keep` selects by their index. Vertices keep their order.
    pub fn new(whole: &LayeredBody, keep: impl Fn(usize) -> bool) -> Self {
        const UNUSED: u32 = u32::MAX;
        let mut new = vec![UNUSED; whole.n_vertices()];
        let mut is_cut = vec![false; whole.n_vertices()];
        let mut triangles = Vec::new();
        for (t, corners) in whole.skin.triangles.iter().enumerate() {
            if keep(t) {
                triangles.push(*corners);
                for &v in corners {
                    new[v as usize] = 0;
                }
            } else {
                for &v in corners {
                    is_cut[v as usize] = true;
                }
            }
        }
        let vertices: Vec<u32> = (0..whole.n_vertices() as u32)
            .filter(|&v| new[v as usize] != UNUSED)
            .collect();
        for (i, &v) in (0_u32..).zip(&vertices) {
            new[v as usize] = i;
        }
        let n = whole.n_levels;
        let column = |&v: &u32| &whole.positions[v as usize * n..(v as usize + 1) * n];
        let faces = whole.cut_faces.iter().map(|face| CutFace {
            vertices: (face.vertices.iter().map(|&v| new[v as usize]))
                .filter(|&v| v != UNUSED)
                .collect(),
            ..face.clone()
        });
        let body = LayeredBody {
            skin: Surface {
                points: (vertices.iter().map(|&v| whole.skin.points[v as usize])).collect(),
                triangles: (triangles.iter().map(|t| t.map(|v| new[v as usize]))).collect(),
            },
            positions: vertices.iter().flat_map(column).copied().collect(),
            n_levels: n,
            interval_layer: whole.interval_layer.clone(),
            layer_names: whole.layer_names.clone(),
            cut_faces: faces.filter(|face| !face.vertices.is_empty()).collect(),
        };
        Self {
            body,
            is_border: vertices.iter().map(|&v| is_cut[v as usize]).collect(),
            vertices,
        }
    }

    /// Takes a field with the same number of values for each vertex of the whole body to the part.
    ///
    /// # Panics
    /// If the field has fewer values than the part needs.
    pub fn take<T: Copy>(&self, field: &[T], per_vertex: usize) -> Vec<T> {
        let of = |&v: &u32| &field[v as usize * per_vertex..(v as usize + 1) * per_vertex];
        self.vertices.iter().flat_map(of).copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec3;
    use crate::generate::{Diagonal, Grid, LevelStack, mapped_grid};

    #[test]
    fn a_part_keeps_positions_and_knows_its_border() {
        let levels = LevelStack {
            depths: vec![0.0, 2e-3, 7e-3],
            interval_layer: vec![0, 1],
        };
        let grid = Grid {
            n_cells: [4, 3],
            diagonal: Diagonal::Right,
            jitter: None,
        };
        let whole = mapped_grid(&grid, |u, v| Vec3::new(0.04 * u, 0.03 * v, 0.0), &levels);
        let is_left = |t: usize| whole.skin.corners(t).iter().all(|p| p.x < 0.0201);
        let part = Part::new(&whole, is_left);
        assert_eq!(part.body.skin.triangles.len(), 12);
        assert_eq!(part.body.n_vertices(), 12);
        for (v, p) in part.body.skin.points.iter().enumerate() {
            assert_eq!(*p, part.body.positions[part.body.node(v, 0)]);
            assert_eq!(part.is_border[v], (p.x - 0.02).abs() < 1e-9);
        }
        let same = part.take(&whole.positions, whole.n_levels);
        assert_eq!(same, part.body.positions);
        let on_faces = part.body.cut_faces.iter().flat_map(|face| &face.vertices);
        assert!(on_faces.into_iter().all(|&v| (v as usize) < 12));
    }
}
