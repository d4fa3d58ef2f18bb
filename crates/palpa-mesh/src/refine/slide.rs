//! Vertices moved along the skin, so that one of them lies exactly where a tool presses.

use super::imprint::{reached, smallest_angle};
use super::origin::Origins;
use super::{Refined, assemble, is_valid};
use crate::{LayeredBody, SurfaceIndex, Vec3};

/// The shift fades out over this many times its length: with the smooth step below, triangles are
/// then sheared by at most 1.5/8.
const FADE: f64 = 8.0;
/// A move must leave every triangle at least this share of its smallest angle.
const ANGLE_KEPT: f64 = 0.5;
/// Shorter shifts are not made, m.
const SHORTEST: f64 = 1e-9;

/// A shift of vertices along the skin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slide {
    /// The vertex that is moved.
    pub vertex: u32,
    /// The point of the skin that the vertex is moved to. m
    pub to: Vec3,
    /// Vertices within this distance of the point are moved by the same vector, so that the mesh
    /// keeps its shape there. Farther away the shift fades out. m
    pub radius: f64,
}

/// Moves a vertex along the skin to a point of it, and the vertices around it with it.
///
/// ```text
/// share of the shift        1 ______
///                                   \
///                           0        \_______
///                             to     ^      ^ distance from the point
///                                 radius  radius + 8 shifts
/// ```
/// New columns are means of old ones, as in [`refine`](super::refine). Vertices of the rim stay. On
/// a curved skin the edges between flat facets move a little, as in
/// [`imprint_circle`](super::imprint_circle): the shape changes by at most the shift times the
/// angle between the facets.
///
/// `None` if the vertex is at the point already, if it or the point lies on the rim, or if triangles
/// or prisms would become poor.
pub fn slide_vertices(body: &LayeredBody, slide: &Slide) -> Option<Refined> {
    let skin = &body.skin;
    let vertex = slide.vertex as usize;
    let index = SurfaceIndex::build(skin);
    let target = index.closest(slide.to)?;
    let way = target.point - skin.points[vertex];
    if way.norm() < SHORTEST {
        return None;
    }
    let fade = FADE * way.norm();
    let reach = slide.radius + fade;
    let is_near = |v: u32| (skin.points[v as usize] - target.point).norm() < reach;
    let edges = skin.edges();
    let near = reached(skin.points.len(), &edges, slide.vertex, is_near);
    let rim: Vec<u32> = skin.boundary_loops().into_iter().flatten().collect();
    let near_rim: Vec<Vec3> = (rim.iter())
        .map(|&v| skin.points[v as usize])
        .filter(|p| (p - target.point).norm() < reach + fade)
        .collect();
    let from_rim = |p: Vec3| {
        (near_rim.iter())
            .map(|q| (p - q).norm())
            .fold(f64::INFINITY, f64::min)
    };
    // Beside the rim the shift fades out as well, but not where the place itself is.
    let free = fade.min(from_rim(target.point));
    if rim.contains(&slide.vertex) || free < way.norm() {
        return None;
    }
    let share = |p: Vec3| {
        let beyond = ((p - target.point).norm() - slide.radius) / fade;
        smooth(1.0 - beyond) * smooth(from_rim(p) / free)
    };

    let normals = skin.vertex_normals();
    let mut origins = Origins::identity(0);
    let mut is_moved = vec![false; skin.points.len()];
    for (v, &p) in skin.points.iter().enumerate() {
        let share = if near[v] { share(p) } else { 0.0 };
        let place = if v == vertex {
            target
        } else if share > 0.0 && normals[v].dot(&normals[vertex]) > 0.0 {
            index.closest(p + way * share)?
        } else {
            origins.push(vec![(v as u32, 1.0)]);
            continue;
        };
        is_moved[v] = true;
        let corners = skin.triangles[place.triangle as usize];
        let parts = corners.into_iter().zip(place.weights);
        origins.push(parts.filter(|&(_, weight)| weight > 0.0).collect());
    }

    let n_triangles = skin.triangles.len() as u32;
    let slid = assemble(
        body,
        origins,
        skin.triangles.clone(),
        (0..n_triangles).collect(),
        body.cut_faces.clone(),
    );
    let is_good = |t: usize| {
        let one = [t as u32];
        smallest_angle(&slid.body, &one) >= ANGLE_KEPT * smallest_angle(body, &one)
            && slid.body.skin.area_vector(t).dot(&skin.area_vector(t)) > 0.0
            && (0..body.n_levels - 1).all(|i| is_valid(&slid.body, t, i) || !is_valid(body, t, i))
    };
    (0..skin.triangles.len())
        .filter(|&t| skin.triangles[t].iter().any(|&v| is_moved[v as usize]))
        .all(is_good)
        .then_some(slid)
}

/// The cubic step from 0 at `x ≤ 0` to 1 at `x ≥ 1`, with slope 1.5 in the middle.
fn smooth(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}
