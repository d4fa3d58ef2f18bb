//! Distance from points to a surface, and where rays meet it, through an R-tree over the triangles.

use rstar::{AABB, PointDistance, RTree, RTreeObject, SelectionFunction};

use crate::{Surface, Vec3};

/// A surface prepared for distance and ray queries. Building costs `n log n`, a query about `log n`.
#[derive(Debug)]
pub struct SurfaceIndex {
    tree: RTree<IndexedTriangle>,
    /// Area-weighted normals of vertices: what decides the side when a vertex is closest.
    vertex_normals: Vec<Vec3>,
}

/// The closest point of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closest {
    /// The point on the surface.
    pub point: Vec3,
    /// The triangle that it lies on.
    pub triangle: u32,
    /// Distance, negative on the inner side (where the surface is closed and oriented outward). m
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
    /// Builds the index. Triangles with corners that are not finite are left out.
    pub fn build(surface: &Surface) -> Self {
        let triangles = (0..surface.triangles.len())
            .map(|t| IndexedTriangle {
                corners: surface.corners(t),
                vertices: surface.triangles[t],
                id: t as u32,
            })
            .filter(|t| t.corners.iter().all(|p| p.iter().all(|x| x.is_finite())))
            .collect();
        Self {
            tree: RTree::bulk_load(triangles),
            vertex_normals: surface.vertex_normals(),
        }
    }

    /// The point of the surface closest to `p`, or `None` for a surface without triangles.
    pub fn closest(&self, p: Vec3) -> Option<Closest> {
        let triangle = self.tree.nearest_neighbor(p.into())?;
        let (point, weights) = closest_on_triangle(p, triangle.corners);
        // At an edge or a vertex the face normal of one triangle may lie about the side; the vertex normals, mixed
        // by the barycentric weights, do not.
        let [a, b, c] = triangle.corners;
        let face = (b - a)
            .cross(&(c - a))
            .try_normalize(0.0)
            .unwrap_or_else(Vec3::zeros);
        let is_inside_face = weights.iter().all(|&w| w > 1e-9);
        let normal = if is_inside_face {
            face
        } else {
            let mut sum = Vec3::zeros();
            for (v, w) in triangle.vertices.iter().zip(weights) {
                sum += self.vertex_normals[*v as usize] * w;
            }
            sum
        };
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
            signed_distance,
        })
    }

    /// The nearest meeting of the ray `origin + s direction` with the surface at `s > s_min`: `(s, triangle)`.
    pub fn ray(&self, origin: Vec3, direction: Vec3, s_min: f64) -> Option<(f64, u32)> {
        let along = RaySelection {
            origin,
            inverse: direction.map(|x| 1.0 / x),
        };
        self.tree
            .locate_with_selection_function(along)
            .filter_map(|t| Some((ray_triangle(origin, direction, t.corners)?, t.id)))
            .filter(|&(s, _)| s > s_min)
            .min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// Visits the boxes that a ray passes.
struct RaySelection {
    origin: Vec3,
    inverse: Vec3,
}

impl RaySelection {
    fn meets(&self, envelope: &AABB<[f64; 3]>) -> bool {
        let (lo, hi) = (envelope.lower(), envelope.upper());
        let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
        for i in 0..3 {
            let a = (lo[i] - self.origin[i]) * self.inverse[i];
            let b = (hi[i] - self.origin[i]) * self.inverse[i];
            // `min`/`max` drop the NaN of a ray that runs inside a slab's face.
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        enter <= leave
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

/// The point of a triangle closest to `p`, and its barycentric weights. By regions (Ericson 2005, §5.1.5).
fn closest_on_triangle(p: Vec3, [a, b, c]: [Vec3; 3]) -> (Vec3, [f64; 3]) {
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
        return (a, [1.0, 0.0, 0.0]); // a triangle without area: any corner serves
    }
    let (v, w) = (vb / sum, vc / sum);
    (a + ab * v + ac * w, [1.0 - v - w, v, w])
}

/// How far beyond the edges, in barycentric coordinates, a ray still meets a triangle: through a shared edge or vertex
/// it must not slip between two.
const EDGE: f64 = 1e-6;

/// Ray parameter at which `origin + s direction` passes a triangle (Möller and Trumbore 1997).
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
