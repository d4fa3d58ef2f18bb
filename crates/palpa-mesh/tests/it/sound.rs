//! What every body keeps, whatever made it.

use palpa_mesh::quality::{PrismShape, prism_shapes, prism_volume};
use palpa_mesh::{LayeredBody, Surface};

/// All prisms valid, skin and levels and cut faces in accord, conforming.
pub(crate) fn assert_sound(body: &LayeredBody) {
    let shapes = prism_shapes(body, &body.positions);
    assert!(shapes.iter().all(PrismShape::is_valid));
    assert_eq!(body.positions.len(), body.n_vertices() * body.n_levels);
    assert_eq!(body.interval_layer.len(), body.n_levels - 1);
    for (v, p) in body.skin.points.iter().enumerate() {
        assert_eq!(body.positions[body.node(v, 0)], *p, "the skin is level 0");
    }
    assert_conforming(&body.skin);
    assert_cut_faces(body);
}

/// Every edge has two triangles that walk it in opposite directions, or lies on the rim; every
/// vertex is used.
pub(crate) fn assert_conforming(skin: &Surface) {
    let mut directed: Vec<[u32; 2]> = skin
        .triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .collect();
    directed.sort_unstable();
    assert!(directed.windows(2).all(|e| e[0] != e[1]));
    let n_rim: usize = skin.boundary_loops().iter().map(Vec::len).sum();
    let n_open = directed
        .iter()
        .filter(|[a, b]| directed.binary_search(&[*b, *a]).is_err())
        .count();
    assert_eq!(n_open, n_rim);
    let mut is_used = vec![false; skin.points.len()];
    for &v in skin.triangles.iter().flatten() {
        is_used[v as usize] = true;
    }
    assert!(is_used.iter().all(|&u| u));
}

/// Cut faces run along the rim from neighbour to neighbour, cover it, and are flat where they say
/// so.
fn assert_cut_faces(body: &LayeredBody) {
    let loops = body.skin.boundary_loops();
    let n_rim: usize = loops.iter().map(Vec::len).sum();
    let mut rim: Vec<[u32; 2]> = loops
        .iter()
        .flat_map(|l| (0..l.len()).map(|k| [l[k], l[(k + 1) % l.len()]]))
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    rim.sort_unstable();
    let is_rim = |a: u32, b: u32| rim.binary_search(&[a.min(b), a.max(b)]).is_ok();
    let mut n_edges = 0;
    for face in &body.cut_faces {
        for e in face.vertices.windows(2) {
            assert!(is_rim(e[0], e[1]), "{e:?} is not on the rim");
            n_edges += 1;
        }
        let ends = [face.vertices[0], face.vertices[face.vertices.len() - 1]];
        if face.vertices.len() > 2 && is_rim(ends[0], ends[1]) {
            n_edges += 1;
        }
        if face.is_flat {
            for &v in &face.vertices {
                for l in 0..body.n_levels {
                    let p = body.positions[body.node(v as usize, l)];
                    let height = (p - face.point).dot(&face.normal);
                    let rim = (body.skin.points[v as usize] - face.point).dot(&face.normal);
                    assert!((height - rim).abs() < 1e-9);
                }
            }
        }
    }
    assert_eq!(n_edges, n_rim, "cut faces cover the rim");
}

/// Volume of all prisms.
pub(crate) fn volume(body: &LayeredBody) -> f64 {
    (0..body.skin.triangles.len())
        .flat_map(|t| (0..body.n_levels - 1).map(move |i| (t, i)))
        .map(|(t, i)| prism_volume(&body.prism(t, i).map(|n| body.positions[n])))
        .sum()
}

/// Smallest angle of any triangle, in degrees.
pub(crate) fn smallest_angle(skin: &Surface) -> f64 {
    (0..skin.triangles.len())
        .flat_map(|t| {
            let p = skin.corners(t);
            (0..3).map(move |k| {
                let (u, v) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
                u.cross(&v).norm().atan2(u.dot(&v)).to_degrees()
            })
        })
        .fold(f64::INFINITY, f64::min)
}
