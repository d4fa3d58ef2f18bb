//! Faces where a body part was cut from the rest: flat caps of a closed mesh, rims of an open one,
//! cut-outs.

use crate::repair::drop_unused;
use crate::topology::{UnionFind, all_sides, by_edge};
use crate::{CutFace, Surface, Vec3};

/// Cosine of 0.5°. Neighbouring triangles belong to one flat region if the angle between their
/// normals is smaller.
const FLAT_COS: f64 = 0.999_962;
/// Cosine of 30°. A cap meets the skin at a crease that is sharper than this on average.
const CREASE_COS: f64 = 0.866;
/// Least area of a cap, as a share of the whole area.
const MIN_CAP_SHARE: f64 = 0.01;
/// If flat regions make up more than this share of the area, the body is a box, not a limb with cut
/// ends.
const MAX_CAPS_SHARE: f64 = 0.6;
/// A rim is flat if its points are within this distance of its plane, as a share of its extent.
const FLAT_TOLERANCE: f64 = 5e-3;
/// Cosine of 40°. A rim is split into several cut faces at sharper turns.
const CORNER_COS: f64 = 0.766;
/// Largest number of faces in one rim. A rim with more is a ragged edge, not a polygon.
const MAX_SIDES: usize = 8;

/// The triangles that form flat caps, one list per cap.
pub(super) fn find_caps(surface: &Surface) -> Vec<Vec<u32>> {
    let n = surface.triangles.len();
    let areas: Vec<Vec3> = (0..n).map(|t| surface.area_vector(t)).collect();
    let normal = |t: u32| {
        areas[t as usize]
            .try_normalize(0.0)
            .unwrap_or_else(Vec3::zeros)
    };
    let pairs = triangle_pairs(surface);
    let mut flat = UnionFind::new(n);
    for &(a, b) in pairs
        .iter()
        .filter(|(a, b)| normal(*a).dot(&normal(*b)) > FLAT_COS)
    {
        flat.join(a, b);
    }
    let area_of = |members: &[u32]| {
        members
            .iter()
            .map(|&t| areas[t as usize].norm())
            .sum::<f64>()
    };
    let total: f64 = areas.iter().map(nalgebra::Matrix::norm).sum();
    let is_cap = |members: &Vec<u32>| {
        // The region must also be flat as a whole, because a smooth round surface also bends little
        // between neighbouring triangles.
        let is_flat = members
            .iter()
            .all(|&t| normal(t).dot(&normal(members[0])) > FLAT_COS);
        is_flat && members.len() >= 3 && area_of(members) >= MIN_CAP_SHARE * total
    };
    let mut caps: Vec<Vec<u32>> = flat.groups().into_iter().filter(is_cap).collect();
    caps.retain(|cap| {
        let is_in = |t: u32| cap.binary_search(&t).is_ok();
        let border: Vec<f64> = pairs
            .iter()
            .filter(|(a, b)| is_in(*a) != is_in(*b))
            .map(|(a, b)| normal(*a).dot(&normal(*b)))
            .collect();
        !border.is_empty() && border.iter().sum::<f64>() / (border.len() as f64) < CREASE_COS
    });
    let caps_area: f64 = caps.iter().map(|cap| area_of(cap)).sum();
    if caps_area > MAX_CAPS_SHARE * total {
        Vec::new()
    } else {
        caps
    }
}

/// Pairs of triangles that share an edge of exactly two triangles.
fn triangle_pairs(surface: &Surface) -> Vec<(u32, u32)> {
    by_edge(&all_sides(surface))
        .filter_map(|on_edge| match on_edge {
            [a, b] => Some((a.triangle, b.triangle)),
            _ => None,
        })
        .collect()
}

/// The surface without the triangles for which `is_dropped` is true, and without the vertices that
/// only those used. The remaining vertices keep their order.
pub(super) fn without_triangles(surface: &Surface, is_dropped: impl Fn(usize) -> bool) -> Surface {
    let triangles = surface
        .triangles
        .iter()
        .enumerate()
        .filter(|(t, _)| !is_dropped(*t))
        .map(|(_, t)| *t);
    let mut kept = Surface {
        points: surface.points.clone(),
        triangles: triangles.collect(),
    };
    drop_unused(&mut kept);
    kept
}

/// The part of a surface within `radius` of `centre` that is connected with the nearest vertex.
/// Ragged teeth and vertices at which triangles meet only in a corner are trimmed.
pub(super) fn cut_out(surface: &Surface, centre: Vec3, radius: f64) -> Surface {
    let is_near: Vec<bool> = surface
        .points
        .iter()
        .map(|p| (p - centre).norm() <= radius)
        .collect();
    let mut part = without_triangles(surface, |t| {
        !surface.triangles[t].iter().all(|&v| is_near[v as usize])
    });
    loop {
        let before = part.triangles.len();
        part = trim_teeth(&part);
        part = connected_with(&part, centre);
        if part.triangles.len() == before {
            return part;
        }
    }
}

/// Drops triangles that are connected by only one edge, and triangles at vertices where separate
/// fans meet.
fn trim_teeth(surface: &Surface) -> Surface {
    let pairs = triangle_pairs(surface);
    let mut n_neighbours = vec![0; surface.triangles.len()];
    for &(a, b) in &pairs {
        n_neighbours[a as usize] += 1;
        n_neighbours[b as usize] += 1;
    }
    let mut loops_at = vec![0; surface.points.len()];
    for v in surface.boundary_loops().into_iter().flatten() {
        loops_at[v as usize] += 1;
    }
    without_triangles(surface, |t| {
        n_neighbours[t] < 2
            || surface.triangles[t]
                .iter()
                .any(|&v| loops_at[v as usize] > 1)
    })
}

fn connected_with(surface: &Surface, centre: Vec3) -> Surface {
    let distance = |t: &u32| {
        surface
            .corners(*t as usize)
            .iter()
            .map(|p| (p - centre).norm())
            .fold(f64::INFINITY, f64::min)
    };
    let all = 0..surface.triangles.len() as u32;
    let Some(seed) = all.min_by(|a, b| distance(a).total_cmp(&distance(b))) else {
        return surface.clone();
    };
    let mut parts = UnionFind::new(surface.triangles.len());
    for (a, b) in triangle_pairs(surface) {
        parts.join(a, b);
    }
    let root = parts.find(seed);
    let is_apart: Vec<bool> = (0..surface.triangles.len() as u32)
        .map(|t| parts.find(t) != root)
        .collect();
    without_triangles(surface, |t| is_apart[t])
}

/// The cut faces along the rims of an open surface.
pub(super) fn find_cut_faces(skin: &Surface) -> Vec<CutFace> {
    let normals = skin.vertex_normals();
    let mut faces = Vec::new();
    for rim in skin.boundary_loops() {
        if let Some(end) = limb_end(skin, &normals, &rim) {
            faces.push(end);
            continue;
        }
        let sides = split_at_corners(skin, &rim);
        let planes: Vec<CutFace> = sides
            .iter()
            .map(|side| side_face(skin, &normals, side))
            .collect();
        if sides.len() > 1 && sides.len() <= MAX_SIDES && planes.iter().all(|f| f.is_flat) {
            faces.extend(planes);
        } else {
            let mut closed = rim.clone();
            closed.extend(rim.first());
            let mut face = side_face(skin, &normals, &closed);
            face.vertices = rim;
            face.is_flat = false;
            faces.push(face);
        }
    }
    faces
}

/// The rim as a cut face, if it is the flat end of a limb: the plane of the rim cuts the skin at a
/// steep angle.
fn limb_end(skin: &Surface, normals: &[Vec3], rim: &[u32]) -> Option<CutFace> {
    let points: Vec<Vec3> = rim.iter().map(|&v| skin.points[v as usize]).collect();
    let centre = points.iter().sum::<Vec3>() / points.len() as f64;
    // Rims have the direction of their triangles: clockwise as seen from beyond the cut.
    let mut area = Vec3::zeros();
    for i in 0..points.len() {
        area -= (points[i] - centre).cross(&(points[(i + 1) % points.len()] - centre));
    }
    let normal = area.try_normalize(0.0)?;
    let extent = points
        .iter()
        .map(|p| (p - centre).norm())
        .fold(0.0, f64::max);
    let is_flat = points
        .iter()
        .all(|p| (p - centre).dot(&normal).abs() <= FLAT_TOLERANCE * extent);
    let steepness = rim
        .iter()
        .map(|&v| normals[v as usize].dot(&normal).abs())
        .sum::<f64>()
        / rim.len() as f64;
    (is_flat && steepness < 0.6).then(|| CutFace {
        vertices: rim.to_vec(),
        normal,
        point: centre,
        is_flat: true,
    })
}

/// Splits a closed rim into runs of vertices between sharp turns. Each run ends where the next
/// begins.
fn split_at_corners(skin: &Surface, rim: &[u32]) -> Vec<Vec<u32>> {
    let n = rim.len();
    let p = |i: usize| skin.points[rim[i % n] as usize];
    let is_corner = |i: usize| {
        let (before, after) = (p(i) - p(i + n - 1), p(i + 1) - p(i));
        before.dot(&after) < CORNER_COS * before.norm() * after.norm()
    };
    let Some(first) = (0..n).find(|&i| is_corner(i)) else {
        return Vec::new();
    };
    let mut sides = Vec::new();
    let mut side = vec![rim[first]];
    for i in first + 1..=first + n {
        side.push(rim[i % n]);
        if is_corner(i % n) {
            sides.push(std::mem::replace(&mut side, vec![rim[i % n]]));
        }
    }
    sides
}

/// A run of rim vertices as a cut face. Its normal points out of the body and lies along the skin.
fn side_face(skin: &Surface, normals: &[Vec3], side: &[u32]) -> CutFace {
    let p = |v: u32| skin.points[v as usize];
    let outward: Vec3 = side
        .windows(2)
        .map(|e| (p(e[1]) - p(e[0])).cross(&(normals[e[0] as usize] + normals[e[1] as usize])))
        .sum();
    let length: f64 = side.windows(2).map(|e| (p(e[1]) - p(e[0])).norm()).sum();
    // All round a flat patch, the contributions cancel. The normal is then zero rather than the
    // direction of a rounding error.
    let normal = outward
        .try_normalize(1e-6 * length)
        .unwrap_or_else(Vec3::zeros);
    let point = side.iter().map(|&v| p(v)).sum::<Vec3>() / side.len() as f64;
    let extent = side
        .iter()
        .map(|&v| (p(v) - point).norm())
        .fold(0.0, f64::max);
    let is_flat = normal != Vec3::zeros()
        && side
            .iter()
            .all(|&v| (p(v) - point).dot(&normal).abs() <= FLAT_TOLERANCE * extent);
    CutFace {
        vertices: side.to_vec(),
        normal,
        point,
        is_flat,
    }
}
