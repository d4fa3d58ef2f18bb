//! Distance from points to a surface, and intersections of rays with it. Both use an R-tree over
//! the triangles.

use rstar::{AABB, PointDistance, RTree, RTreeObject, SelectionFunction};

use crate::{Surface, Vec3};

/// A surface prepared for distance and ray queries. Building costs `n log n`, a query about
/// `log n`.
#[derive(Debug)]
pub struct SurfaceIndex {
    tree: RTree<IndexedTriangle>,
    /// Vertex normals, weighted by the angles of the triangles. They decide the sign of the
    /// distance if a vertex is closest.
    vertex_normals: Vec<Vec3>,
    /// The unit normal of the triangle at each directed edge, sorted by edge. If an edge is
    /// closest, the normals of both its directions decide the sign of the distance.
    edge_normals: Vec<([u32; 2], Vec3)>,
}

/// The closest point of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closest {
    /// The point on the surface.
    pub point: Vec3,
    /// The triangle that the point lies on.
    pub triangle: u32,
    /// Barycentric weights of the point in the triangle's corners.
    pub weights: [f64; 3],
    /// Distance; negative on the inner side (if the surface is closed and oriented outward). m
    pub signed_distance: f64,
}

#[derive(Debug, Clone, Copy)]
struct IndexedTriangle {
    corners: [Vec3; 3],
    vertices: [u32; 3],
    id: u32,
}

impl RTreeObject for IndexedTriangle {
    type Envelope = AABB<[f64; 3]>;
    fn envelope(&self) -> Self::Envelope {
        let [a, b, c] = &self.corners;
        AABB::from_corners(a.inf(b).inf(c).into(), a.sup(b).sup(c).into())
    }
}

impl PointDistance for IndexedTriangle {
    fn distance_2(&self, point: &[f64; 3]) -> f64 {
        let p = Vec3::from(*point);
        (closest_on_triangle(p, self.corners).0 - p).norm_squared()
    }
}

impl SurfaceIndex {
    /// Builds the index. Triangles with a corner that is not finite are left out.
    pub fn build(surface: &Surface) -> Self {
        let triangles = (0..surface.triangles.len())
            .map(|t| IndexedTriangle {
                corners: surface.corners(t),
                vertices: surface.triangles[t],
                id: t as u32,
            })
            .filter(|t| t.corners.iter().all(|p| p.iter().all(|x| x.is_finite())))
            .collect();
        let (vertex_normals, edge_normals) = pseudo_normals(surface);
        Self {
            tree: RTree::bulk_load(triangles),
            vertex_normals,
            edge_normals,
        }
    }

    /// The point of the surface closest to `p`, or `None` for a surface without triangles.
    pub fn closest(&self, p: Vec3) -> Option<Closest> {
        let triangle = self.tree.nearest_neighbor(p.into())?;
        let (point, weights) = closest_on_triangle(p, triangle.corners);
        let normal = self.pseudo_normal(triangle, weights);
        let offset = p - point;
        let distance = offset.norm();
        let signed_distance = if offset.dot(&normal) < 0.0 {
            -distance
        } else {
            distance
        };
        Some(Closest {
            point,
            triangle: triangle.id,
            weights,
            signed_distance,
        })
    }

    /// The pseudo-normal at the closest point. The sign of its product with the offset tells the
    /// side. It is the normal of the face, the sum of both faces' normals at an edge, or the
    /// angle-weighted sum at a vertex (Bærentzen and Aanæs 2005).
    fn pseudo_normal(&self, triangle: &IndexedTriangle, weights: [f64; 3]) -> Vec3 {
        let on: Vec<usize> = (0..3).filter(|&i| weights[i] > 1e-9).collect();
        match on[..] {
            [i] => self.vertex_normals[triangle.vertices[i] as usize],
            [i, j] => {
                let (a, b) = (triangle.vertices[i], triangle.vertices[j]);
                let of = |edge: [u32; 2]| {
                    let at = self.edge_normals.partition_point(|(e, _)| *e < edge);
                    self.edge_normals[at..]
                        .iter()
                        .take_while(|(e, _)| *e == edge)
                        .map(|(_, n)| n)
                        .sum::<Vec3>()
                };
                of([a, b]) + of([b, a])
            }
            _ => unit_normal(triangle.corners),
        }
    }

    /// The nearest intersection of the ray `origin + s direction` with the surface at `s > s_min`,
    /// as `(s, triangle)`.
    pub fn ray(&self, origin: Vec3, direction: Vec3, s_min: f64) -> Option<(f64, u32)> {
        let along = RaySelection { origin, direction };
        self.tree
            .locate_with_selection_function(along)
            .filter_map(|t| Some((ray_triangle(origin, direction, t.corners)?, t.id)))
            .filter(|&(s, _)| s > s_min)
            .min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// Unit normal of a triangle; zero if it has no area.
fn unit_normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a)
        .cross(&(c - a))
        .try_normalize(0.0)
        .unwrap_or_else(Vec3::zeros)
}

/// Angle-weighted vertex normals, and the normals at directed edges in ascending order.
fn pseudo_normals(surface: &Surface) -> (Vec<Vec3>, Vec<([u32; 2], Vec3)>) {
    let mut at_vertices = vec![Vec3::zeros(); surface.points.len()];
    let mut at_edges = Vec::with_capacity(3 * surface.triangles.len());
    for (t, triangle) in surface.triangles.iter().enumerate() {
        let corners = surface.corners(t);
        let normal = unit_normal(corners);
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let angle = (corners[j] - corners[i]).angle(&(corners[k] - corners[i]));
            if angle.is_finite() {
                at_vertices[triangle[i] as usize] += normal * angle;
            }
            at_edges.push(([triangle[i], triangle[j]], normal));
        }
    }
    at_edges.sort_by_key(|(edge, _)| *edge);
    (at_vertices, at_edges)
}

/// Selects the boxes that a ray passes through.
struct RaySelection {
    origin: Vec3,
    direction: Vec3,
}

impl RaySelection {
    fn meets(&self, envelope: &AABB<[f64; 3]>) -> bool {
        let (lo, hi) = (envelope.lower(), envelope.upper());
        let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
        for i in 0..3 {
            let (o, d) = (self.origin[i], self.direction[i]);
            if d == 0.0 {
                // The ray runs parallel to the faces of the slab. 0/0 on a face would lose a box
                // that the ray runs in.
                if o < lo[i] || o > hi[i] {
                    return false;
                }
                continue;
            }
            let (a, b) = ((lo[i] - o) / d, (hi[i] - o) / d);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        // A box that the ray only grazes must not be lost by rounding.
        enter <= leave + 1e-12 * (1.0 + leave.abs())
    }
}

impl SelectionFunction<IndexedTriangle> for RaySelection {
    fn should_unpack_parent(&self, envelope: &AABB<[f64; 3]>) -> bool {
        self.meets(envelope)
    }
    fn should_unpack_leaf(&self, leaf: &IndexedTriangle) -> bool {
        self.meets(&leaf.envelope())
    }
}

/// The point of a triangle closest to `p`, and its barycentric weights. The method distinguishes
/// regions (Ericson 2005, §5.1.5).
pub fn closest_on_triangle(p: Vec3, [a, b, c]: [Vec3; 3]) -> (Vec3, [f64; 3]) {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (a, [1.0, 0.0, 0.0]);
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return (b, [0.0, 1.0, 0.0]);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let v = d1 / (d1 - d3);
        return (a + ab * v, [1.0 - v, v, 0.0]);
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return (c, [0.0, 0.0, 1.0]);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let w = d2 / (d2 - d6);
        return (a + ac * w, [1.0 - w, 0.0, w]);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return (b + (c - b) * w, [0.0, 1.0 - w, w]);
    }
    let sum = va + vb + vc;
    if sum == 0.0 {
        return (a, [1.0, 0.0, 0.0]); // a triangle without area: any corner will do
    }
    let (v, w) = (vb / sum, vc / sum);
    (a + ab * v + ac * w, [1.0 - v - w, v, w])
}

/// A ray also meets a triangle if it passes this far outside its edges, in barycentric coordinates.
/// So it cannot slip through a shared edge or vertex.
const EDGE: f64 = 1e-6;

/// Ray parameter at which `origin + s direction` meets a triangle (Möller and Trumbore 1997).
fn ray_triangle(origin: Vec3, direction: Vec3, [a, b, c]: [Vec3; 3]) -> Option<f64> {
    let (e1, e2) = (b - a, c - a);
    let h = direction.cross(&e2);
    let det = e1.dot(&h);
    if det == 0.0 {
        return None;
    }
    let s = origin - a;
    let u = s.dot(&h) / det;
    let q = s.cross(&e1);
    let v = direction.dot(&q) / det;
    (u >= -EDGE && v >= -EDGE && u + v <= 1.0 + EDGE).then(|| e2.dot(&q) / det)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::cylinder;

    /// A closed box from 0 to 1 with `n` × `n` cells on each face. Rays along an axis meet its
    /// vertices and edges.
    fn gridded_box(n: u32) -> Surface {
        let mut surface = Surface::default();
        for side in 0..6_usize {
            let (axis, is_far) = (side / 2, side % 2 == 1);
            let start = surface.points.len() as u32;
            for i in 0..=n {
                for j in 0..=n {
                    let mut p = Vec3::zeros();
                    p[axis] = f64::from(u8::from(is_far));
                    p[(axis + 1) % 3] = f64::from(i) / f64::from(n);
                    p[(axis + 2) % 3] = f64::from(j) / f64::from(n);
                    surface.points.push(p);
                }
            }
            for i in 0..n {
                for j in 0..n {
                    let [a, b] = [start + i * (n + 1) + j, start + (i + 1) * (n + 1) + j];
                    let quad = if is_far {
                        [[a, b, b + 1], [a, b + 1, a + 1]]
                    } else {
                        [[a, b + 1, b], [a, a + 1, b + 1]]
                    };
                    surface.triangles.extend(quad);
                }
            }
        }
        crate::weld_exact(&surface).surface
    }

    #[test]
    fn rays_along_an_axis_meet_the_far_side_under_every_vertex() {
        let index = SurfaceIndex::build(&gridded_box(4));
        for i in 0..=4 {
            for j in 0..=4 {
                let [u, v] = [i, j].map(|k| f64::from(k) / 4.0);
                for (origin, direction) in [
                    (Vec3::new(u, v, 0.0), Vec3::z()),
                    (Vec3::new(1.0, u, v), -Vec3::x()),
                    (Vec3::new(u, 1.0, v), -Vec3::y()),
                ] {
                    let hit = index.ray(origin, direction, 1e-6);
                    assert!(
                        hit.is_some_and(|(s, _)| (s - 1.0).abs() < 1e-12),
                        "{origin:?} {direction:?}: {hit:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn rays_and_closest_points_agree_with_brute_force() {
        let (_, bone) = cylinder(0.1, 0.04, 0.015, 8e-3);
        let index = SurfaceIndex::build(&bone);
        let mut rng = fastrand::Rng::with_seed(7);
        let mut random = || rng.f64() - 0.5;
        for _ in 0..500 {
            let p = Vec3::new(0.05 + 0.15 * random(), 0.08 * random(), 0.08 * random());
            let d = Vec3::new(random(), random(), random());
            let all = || (0..bone.triangles.len()).map(|t| bone.corners(t));
            let nearest = all()
                .map(|c| (closest_on_triangle(p, c).0 - p).norm())
                .fold(f64::INFINITY, f64::min);
            let found = index.closest(p).unwrap();
            assert!((found.signed_distance.abs() - nearest).abs() < 1e-15);
            // The bone is a polygon with 20 or more sides in a circle of 15 mm radius.
            let radial = p.yz().norm();
            if p.x > 0.002 && p.x < 0.098 && (radial - 0.015).abs() > 4e-4 {
                assert_eq!(
                    found.signed_distance < 0.0,
                    radial < 0.015,
                    "{p:?}: {found:?}"
                );
            }
            let first = all()
                .filter_map(|c| ray_triangle(p, d, c))
                .filter(|&s| s > 0.0)
                .min_by(f64::total_cmp);
            assert_eq!(index.ray(p, d, 0.0).map(|(s, _)| s), first);
        }
    }

    #[test]
    fn the_side_is_right_at_sharp_edges_and_corners() {
        let index = SurfaceIndex::build(&gridded_box(3));
        for (p, is_inside) in [
            (Vec3::new(-0.1, -0.1, -0.1), false),
            (Vec3::new(-0.2, -0.01, 0.5), false),
            (Vec3::new(0.01, 0.02, 0.01), true),
            (Vec3::new(1.3, 1.0, 1.0), false),
            (Vec3::new(0.99, 0.999, 0.98), true),
        ] {
            assert_eq!(
                index.closest(p).unwrap().signed_distance < 0.0,
                is_inside,
                "{p:?}"
            );
        }
    }
}
