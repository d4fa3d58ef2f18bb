//! A circle imprinted in the skin: the edge of a flat punch, so that no triangle lies partly under
//! it.

use std::collections::HashMap;

use super::origin::Origins;
use super::{Refined, assemble, is_valid};
use crate::{LayeredBody, Surface, Vec3};

/// A vertex moves onto the circle if one of its edges crosses it within this share of the edge's
/// length. Otherwise the edge is split.
const SNAP: f64 = 0.35;
/// A move must leave the triangles of the vertex at least this share of their smallest angle.
const ANGLE_KEPT: f64 = 0.5;
/// Least number of vertices in a ring; fewer do not make a circle.
const FEWEST_ON_RING: usize = 8;

/// A circle round an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// A point on the axis, near the skin. m
    pub point: Vec3,
    /// Direction of the axis, of any length.
    pub direction: Vec3,
    /// Distance of the circle from the axis. m
    pub radius: f64,
}

/// A body with a circle imprinted in its skin.
#[derive(Debug, Clone, PartialEq)]
pub struct Imprint {
    /// The body and its origin. Vertices that moved onto the circle have origins of two parts.
    pub refined: Refined,
    /// The vertices on the circle, as a closed run in the direction of the triangles inside.
    pub ring: Vec<u32>,
    /// The triangles inside the circle, ascending.
    pub inside: Vec<u32>,
    /// Radius of a circle with the area of the patch inside, seen along the axis. It is a little
    /// less than the radius of the circle, because the ring is a polygon. m
    pub effective_radius: f64,
    /// Number of vertices that were moved.
    pub n_moved: usize,
}

/// Reason why a circle cannot be imprinted.
#[derive(Debug, Clone, PartialEq, serde::Serialize, schemars::JsonSchema, thiserror::Error)]
#[serde(tag = "kind", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum ImprintError {
    /// The radius or the axis is invalid.
    #[error(
        "a circle of radius {radius} m about the axis ({direction}) is not possible; give a positive radius and an axis"
    )]
    NoCircle {
        /// Radius of the circle. m
        radius: f64,
        /// Axis of the circle.
        direction: String,
    },
    /// The circle crosses the rim of the skin.
    #[error(
        "the circle runs over the rim of the skin at vertex {vertex}; move it inward or make it smaller"
    )]
    OverRim {
        /// A rim vertex inside the circle.
        vertex: u32,
    },
    /// The mesh is too coarse for the circle.
    #[error(
        "the triangles are too large for a circle of radius {:.2} mm; refine the skin there to a third of it first",
        radius * 1e3
    )]
    TooCoarse {
        /// Radius of the circle. m
        radius: f64,
    },
}

/// Position of a vertex relative to the circle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum CircleSide {
    Inside,
    On,
    Outside,
}

/// Turns the circle into a ring of vertices, so that no edge crosses it.
///
/// If an edge crosses the circle near one of its ends, that end moves along the edge onto the
/// circle, with its column. Other edges are split at the circle, which does not change the
/// geometry. A vertex moves only if all prisms stay valid and angles stay good. On a curved skin, a
/// move changes the shape a little. Refine the skin to a third of the radius or finer first.
///
/// # Errors
/// If the circle is invalid, crosses the rim, or is smaller than the triangles there.
pub fn imprint_circle(body: &LayeredBody, circle: &Circle) -> Result<Imprint, ImprintError> {
    let axis = circle.direction.try_normalize(0.0).filter(|axis| {
        circle.radius > 0.0
            && circle.radius.is_finite()
            && axis
                .iter()
                .chain(circle.point.iter())
                .all(|x| x.is_finite())
    });
    let Some(axis) = axis else {
        let [x, y, z] = circle.direction.into();
        return Err(ImprintError::NoCircle {
            radius: circle.radius,
            direction: format!("{x}, {y}, {z}"),
        });
    };
    let mut cut = Cut::new(body, circle, axis)?;
    cut.move_vertices(body);
    let (triangles, parents) = cut.split(body);
    let refined = assemble(
        body,
        cut.origins,
        triangles,
        parents,
        body.cut_faces.clone(),
    );
    let skin = &refined.body.skin;
    let inside = patch(skin, &cut.sides, cut.seed, circle, axis);
    let part = Surface {
        points: skin.points.clone(),
        triangles: inside.iter().map(|&t| skin.triangles[t as usize]).collect(),
    };
    let mut loops = part.boundary_loops();
    let is_ring = |ring: &Vec<u32>| {
        ring.len() >= FEWEST_ON_RING
            && ring
                .iter()
                .all(|&v| cut.sides[v as usize] == CircleSide::On)
    };
    let ring = match loops.pop() {
        Some(ring) if loops.is_empty() && is_ring(&ring) => ring,
        _ => {
            return Err(ImprintError::TooCoarse {
                radius: circle.radius,
            });
        }
    };
    let area: f64 = (0..part.triangles.len())
        .map(|t| part.area_vector(t).dot(&axis).abs())
        .sum();
    Ok(Imprint {
        ring,
        inside,
        effective_radius: (area / std::f64::consts::PI).sqrt(),
        n_moved: cut.n_moved,
        refined,
    })
}

/// The triangles within the circle that are connected with the vertex in its middle.
fn patch(skin: &Surface, sides: &[CircleSide], seed: u32, circle: &Circle, axis: Vec3) -> Vec<u32> {
    let side = |v: u32| sides[v as usize];
    let is_within = |t: &u32| {
        let corners = skin.triangles[*t as usize];
        if corners.iter().any(|&v| side(v) == CircleSide::Outside) {
            return false;
        }
        // All three corners lie on the circle: the triangle is between chords, or on another sheet
        // of the skin.
        let centre = skin.corners(*t as usize).iter().sum::<Vec3>() / 3.0;
        across(centre - circle.point, axis).norm() < circle.radius
    };
    let within: Vec<u32> = (0..skin.triangles.len() as u32).filter(is_within).collect();
    let sides_of = crate::topology::sides(skin, within.iter().copied());
    crate::topology::components(skin, &sides_of)
        .into_iter()
        .find(|part| {
            part.iter()
                .any(|&t| skin.triangles[t as usize].contains(&seed))
        })
        .unwrap_or_default()
}

/// The component of a vector perpendicular to a unit axis.
fn across(v: Vec3, axis: Vec3) -> Vec3 {
    v - axis * v.dot(&axis)
}

/// A cut of the skin under construction.
struct Cut {
    sides: Vec<CircleSide>,
    /// Edges that cross the circle, from the inner to the outer vertex.
    crossing: Vec<[u32; 2]>,
    /// The vector from the axis to each vertex, perpendicular to the axis.
    across: Vec<Vec3>,
    radius: f64,
    is_rim: Vec<bool>,
    origins: Origins,
    /// The vertex nearest to the point on the axis; it is inside.
    seed: u32,
    n_moved: usize,
}

impl Cut {
    fn new(body: &LayeredBody, circle: &Circle, axis: Vec3) -> Result<Self, ImprintError> {
        let skin = &body.skin;
        let too_coarse = ImprintError::TooCoarse {
            radius: circle.radius,
        };
        let across: Vec<Vec3> = skin
            .points
            .iter()
            .map(|p| across(p - circle.point, axis))
            .collect();
        let is_within = |v: u32| across[v as usize].norm() < circle.radius;
        let distance = |v: u32| (skin.points[v as usize] - circle.point).norm_squared();
        let seed = (0..skin.points.len() as u32)
            .min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
            .filter(|&v| is_within(v))
            .ok_or_else(|| too_coarse.clone())?;
        // The cylinder of the circle may meet the skin again on the far side. Only vertices
        // connected with the seed count.
        let edges = skin.edges();
        let inside = reached(skin.points.len(), &edges, seed, is_within);
        let mut is_rim = vec![false; skin.points.len()];
        for v in skin.boundary_loops().into_iter().flatten() {
            is_rim[v as usize] = true;
        }
        if let Some(v) = (0..inside.len()).find(|&v| inside[v] && is_rim[v]) {
            return Err(ImprintError::OverRim { vertex: v as u32 });
        }
        let crossing: Vec<[u32; 2]> = edges
            .iter()
            .filter(|[a, b]| inside[*a as usize] != inside[*b as usize])
            .map(|&[a, b]| if inside[a as usize] { [a, b] } else { [b, a] })
            .collect();
        // Longer edges could pass through the circle with both ends outside.
        let is_long = |[a, b]: &[u32; 2]| {
            (skin.points[*a as usize] - skin.points[*b as usize]).norm() > circle.radius
        };
        if crossing.iter().any(is_long) {
            return Err(too_coarse);
        }
        Ok(Self {
            sides: inside
                .iter()
                .map(|&is_in| {
                    if is_in {
                        CircleSide::Inside
                    } else {
                        CircleSide::Outside
                    }
                })
                .collect(),
            crossing,
            across,
            radius: circle.radius,
            is_rim,
            origins: Origins::identity(0),
            seed,
            n_moved: 0,
        })
    }

    /// Where the edge from the inner vertex `a` to the outer vertex `b` meets the circle, as a
    /// share of its length.
    fn share(&self, [a, b]: [u32; 2]) -> f64 {
        let (p, step) = (
            self.across[a as usize],
            self.across[b as usize] - self.across[a as usize],
        );
        // Solves |p + t step| = radius. The product of the roots is negative. The form of the root
        // is chosen so that it only adds terms of the same sign, without cancellation.
        let (aa, bb) = (step.norm_squared(), p.dot(&step));
        let cc = p.norm_squared() - self.radius * self.radius;
        let root = (bb * bb - aa * cc).max(0.0).sqrt();
        let share = if bb > 0.0 {
            -cc / (bb + root)
        } else {
            (root - bb) / aa
        };
        share.clamp(0.0, 1.0)
    }

    /// Moves vertices onto the circle, nearest first.
    fn move_vertices(&mut self, body: &LayeredBody) {
        let mut moves: Vec<(f64, [u32; 2])> = Vec::new();
        for &[a, b] in &self.crossing {
            let share = self.share([a, b]);
            moves.push((share, [a, b]));
            moves.push((1.0 - share, [b, a]));
        }
        moves.retain(|&(share, [v, _])| share < SNAP && !self.is_rim[v as usize] && v != self.seed);
        moves.sort_by(|p, q| p.0.total_cmp(&q.0).then(p.1.cmp(&q.1)));
        let mut around: HashMap<u32, Vec<u32>> =
            moves.iter().map(|&(_, [v, _])| (v, Vec::new())).collect();
        for (t, triangle) in body.skin.triangles.iter().enumerate() {
            for v in triangle {
                if let Some(triangles) = around.get_mut(v) {
                    triangles.push(t as u32);
                }
            }
        }
        let mut moved = body.clone();
        let mut place: Vec<Option<(u32, f64)>> = vec![None; body.n_vertices()];
        for (share, [v, to]) in moves {
            if [v, to]
                .iter()
                .any(|&u| self.sides[u as usize] == CircleSide::On)
            {
                continue;
            }
            let old: Vec<Vec3> = (0..body.n_levels)
                .map(|l| moved.positions[body.node(v as usize, l)])
                .collect();
            let angle = smallest_angle(&moved, &around[&v]);
            for l in 0..body.n_levels {
                let (from, to) = (body.node(v as usize, l), body.node(to as usize, l));
                moved.positions[from] = body.positions[from].lerp(&body.positions[to], share);
            }
            moved.skin.points[v as usize] = moved.positions[body.node(v as usize, 0)];
            let is_good = smallest_angle(&moved, &around[&v]) >= ANGLE_KEPT * angle
                && around[&v]
                    .iter()
                    .all(|&t| (0..body.n_levels - 1).all(|i| is_valid(&moved, t as usize, i)));
            if is_good {
                let step = self.across[to as usize] - self.across[v as usize];
                self.across[v as usize] += step * share;
                self.sides[v as usize] = CircleSide::On;
                place[v as usize] = Some((to, share));
                self.n_moved += 1;
            } else {
                moved.skin.points[v as usize] = old[0];
                for (l, p) in old.into_iter().enumerate() {
                    moved.positions[body.node(v as usize, l)] = p;
                }
            }
        }
        self.origins = Origins::moved(&place);
    }

    /// Splits the edges that still cross. Returns the new triangles, and for each the old triangle
    /// that it is a part of.
    fn split(&mut self, body: &LayeredBody) -> (Vec<[u32; 3]>, Vec<u32>) {
        let mut on_edge: HashMap<[u32; 2], u32> = HashMap::new();
        for &[a, b] in &self.crossing {
            let ends = [self.sides[a as usize], self.sides[b as usize]];
            if ends == [CircleSide::Inside, CircleSide::Outside] {
                on_edge.insert([a.min(b), a.max(b)], self.origins.len() as u32);
                self.origins.push_between([a, b], self.share([a, b]));
            }
        }
        self.sides.resize(self.origins.len(), CircleSide::On);
        let points = self.origins.interpolate(&body.skin.points, 1);
        let mut triangles = Vec::new();
        let mut parents = Vec::new();
        for (t, &corners) in body.skin.triangles.iter().enumerate() {
            let parts = divide(corners, &points, |a, b| {
                on_edge.get(&[a.min(b), a.max(b)]).copied()
            });
            parents.extend(std::iter::repeat_n(t as u32, parts.len()));
            triangles.extend(parts);
        }
        (triangles, parents)
    }
}

/// The vertices that are connected with `seed` over edges with both ends within.
pub(super) fn reached(
    n: usize,
    edges: &[[u32; 2]],
    seed: u32,
    is_within: impl Fn(u32) -> bool,
) -> Vec<bool> {
    let mut sets = crate::topology::UnionFind::new(n);
    for &[a, b] in edges.iter().filter(|e| e.iter().all(|&v| is_within(v))) {
        sets.join(a, b);
    }
    let root = sets.find(seed);
    (0..n as u32).map(|v| sets.find(v) == root).collect()
}

/// The parts of a triangle whose edges are split at up to two vertices.
fn divide(
    [a, b, c]: [u32; 3],
    points: &[Vec3],
    on_edge: impl Fn(u32, u32) -> Option<u32>,
) -> Vec<[u32; 3]> {
    match [on_edge(a, b), on_edge(b, c), on_edge(c, a)] {
        [None, None, None] => vec![[a, b, c]],
        [Some(m), None, None] => vec![[a, m, c], [m, b, c]],
        [None, Some(m), None] => vec![[b, m, a], [m, c, a]],
        [None, None, Some(m)] => vec![[c, m, b], [m, a, b]],
        [Some(m), Some(n), _] => corner_off([b, n, m], [a, c], points),
        [_, Some(m), Some(n)] => corner_off([c, n, m], [b, a], points),
        [Some(n), _, Some(m)] => corner_off([a, n, m], [c, b], points),
    }
}

/// The corner triangle `[tip, n, m]`, and the quad between `m`, `n` and `[p, q]`, cut along its
/// shorter diagonal. `n` lies on the edge from the tip to `q`, and `m` on the edge from the tip to
/// `p`.
fn corner_off([tip, n, m]: [u32; 3], [p, q]: [u32; 2], points: &[Vec3]) -> Vec<[u32; 3]> {
    let length = |a: u32, b: u32| (points[a as usize] - points[b as usize]).norm_squared();
    let quad = if length(m, q) < length(n, p) {
        [[m, n, q], [m, q, p]]
    } else {
        [[m, n, p], [n, q, p]]
    };
    vec![[tip, n, m], quad[0], quad[1]]
}

/// Smallest angle of some triangles. rad
pub(super) fn smallest_angle(body: &LayeredBody, triangles: &[u32]) -> f64 {
    triangles
        .iter()
        .flat_map(|&t| {
            let p = body.skin.corners(t as usize);
            (0..3).map(move |k| (p[(k + 1) % 3] - p[k]).angle(&(p[(k + 2) % 3] - p[k])))
        })
        .fold(f64::INFINITY, f64::min)
}
