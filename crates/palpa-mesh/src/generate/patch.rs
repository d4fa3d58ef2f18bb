//! A flat patch of square cells with straight columns: the shape in the evaluation of the reference
//! method.

use crate::body::CutFace;
use crate::{LayeredBody, Surface, Vec3};

/// A flat patch of `nx × ny` skin vertices in the plane z = 0, with columns towards −z.
///
/// ```text
///   j
///   2   6---7---8      vertex (i, j) is j nx + i, at (i, j) spacing
///       | / | / |      every cell is cut from its lower left to its upper right corner
///   1   3---4---5
///       | / | / |
///   0   0---1---2
///       0   1   2  i
/// ```
/// `spacing` is the side of a cell, and `level_depths` are the depths of the levels below the skin,
/// both in metres (`[n_levels]`, ascending from 0). `interval_layer` is as in [`LayeredBody`]. The
/// four sides are flat cut faces, in the order −x, +x, −y, +y; a corner column belongs to two of
/// them. Layers are named `layer 1`, `layer 2`, …
///
/// # Panics
/// If there is no cell, or if lengths and layers do not make a body. (This function is for shapes
/// written in code.)
pub fn patch(
    nx: usize,
    ny: usize,
    spacing: f64,
    level_depths: &[f64],
    interval_layer: &[usize],
) -> LayeredBody {
    assert!(
        nx >= 2 && ny >= 2,
        "a patch has at least 2 × 2 vertices, not {nx} × {ny}"
    );
    assert!(spacing > 0.0, "the spacing must be positive, not {spacing}");
    assert!(
        level_depths.len() >= 2
            && level_depths[0] == 0.0
            && level_depths.windows(2).all(|d| d[0] < d[1]),
        "depths must ascend from 0, not {level_depths:?}"
    );
    assert_eq!(
        interval_layer.len() + 1,
        level_depths.len(),
        "one layer per interval between levels"
    );
    assert!(
        interval_layer.is_sorted(),
        "layers must ascend, not {interval_layer:?}"
    );

    let mut points = Vec::with_capacity(nx * ny);
    for j in 0..ny {
        for i in 0..nx {
            points.push(Vec3::new(i as f64, j as f64, 0.0) * spacing);
        }
    }
    let mut triangles = Vec::with_capacity(2 * (nx - 1) * (ny - 1));
    for j in 0..ny - 1 {
        for i in 0..nx - 1 {
            let v = (j * nx + i) as u32;
            let above = v + nx as u32;
            triangles.push([v, v + 1, above + 1]);
            triangles.push([v, above + 1, above]);
        }
    }
    let positions = points
        .iter()
        .flat_map(|p| level_depths.iter().map(move |depth| p - Vec3::z() * *depth))
        .collect();
    let n_layers = interval_layer.last().map_or(0, |last| last + 1);
    LayeredBody {
        cut_faces: sides(nx, ny, spacing),
        skin: Surface { points, triangles },
        positions,
        n_levels: level_depths.len(),
        interval_layer: interval_layer.to_vec(),
        layer_names: (1..=n_layers).map(|l| format!("layer {l}")).collect(),
    }
}

/// Index of the vertex nearest to the centre of an `nx × ny` [`patch`].
///
/// With an even count, no vertex lies in the middle. The function then takes the vertex before the
/// middle, towards vertex 0: in a 4 × 4 patch this is vertex 5, at (1, 1).
pub fn centre_vertex(nx: usize, ny: usize) -> usize {
    (ny - 1) / 2 * nx + (nx - 1) / 2
}

fn sides(nx: usize, ny: usize, spacing: f64) -> Vec<CutFace> {
    let far = Vec3::new((nx - 1) as f64, (ny - 1) as f64, 0.0) * spacing;
    let side = |normal: Vec3, point: Vec3, vertices: Vec<usize>| CutFace {
        vertices: vertices.into_iter().map(|v| v as u32).collect(),
        normal,
        point,
        is_flat: true,
    };
    let row = |j: usize| (0..nx).map(|i| j * nx + i).collect();
    let column = |i: usize| (0..ny).map(|j| j * nx + i).collect();
    vec![
        side(-Vec3::x(), Vec3::zeros(), column(0)),
        side(Vec3::x(), far, column(nx - 1)),
        side(-Vec3::y(), Vec3::zeros(), row(0)),
        side(Vec3::y(), far, row(ny - 1)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_thesis_shapes_have_8_and_18_prisms_and_their_skin_looks_outward() {
        let small = patch(3, 3, 0.04, &[0.0, 0.04, 0.08], &[0, 0]);
        assert_eq!((small.n_nodes(), small.skin.triangles.len()), (27, 8));
        let large = patch(4, 4, 0.04, &[0.0, 0.04, 0.08, 0.12], &[0, 0, 1]);
        assert_eq!((large.n_nodes(), large.skin.triangles.len()), (64, 18));
        assert_eq!(large.layer_names.len(), 2);
        for normal in large.skin.vertex_normals() {
            assert!((normal - Vec3::z()).norm() < 1e-15);
        }
        assert_eq!(
            large.positions[large.node(15, 3)],
            Vec3::new(0.12, 0.12, -0.12)
        );
        assert_eq!((centre_vertex(3, 3), centre_vertex(4, 4)), (4, 5));
    }

    #[test]
    fn cut_faces_lie_in_their_planes() {
        let body = patch(4, 3, 0.01, &[0.0, 0.02], &[0]);
        for face in &body.cut_faces {
            for &v in &face.vertices {
                let p = body.skin.points[v as usize];
                assert!((p - face.point).dot(&face.normal).abs() < 1e-15);
            }
        }
        let on_rim: usize = body.cut_faces.iter().map(|f| f.vertices.len()).sum();
        assert_eq!(on_rim, 2 * (4 + 3));
    }
}
