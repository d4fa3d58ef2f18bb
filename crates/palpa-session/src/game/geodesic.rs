//! Shortest paths along the skin.
//!
//! ```text
//!       a         1. Dijkstra's algorithm over the vertices and a few points on each edge, which are
//!      /|\           joined across each triangle, finds the triangles that a path crosses.
//!   p / | \ q     2. Each crossing slides along its edge ab to where the path from p to q is straight
//!     \ x /          when both triangles are unfolded into a plane:
//!      \|/               t = (t_p h_q + t_q h_p) / (h_p + h_q)
//!       b            with the feet t_p, t_q of p and q on the edge, and their heights h_p, h_q over it.
//! ```
//! A path through a vertex is tried on either side of it, across the edges that meet there, until no side
//! is shorter.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use palpa_mesh::distance::Closest;
use palpa_mesh::{Surface, SurfaceIndex, Vec3};

/// Points on each edge, and the largest number of all: a finer graph would hold up the session.
const POINTS_PER_EDGE: usize = 4;
const MOST_POINTS: usize = 60_000;
/// Sweeps over the crossings; fewer if no crossing moves by more than [`STILL`] of its edge.
const SWEEPS: usize = 200;
const STILL: f64 = 1e-6;
/// Most passages of a vertex that are tried on its sides, and the gain that counts, m.
const MOST_TRIES: usize = 60;
const GAIN: f64 = 1e-9;
/// Where a path that passes a vertex on one side crosses its edges at first, from the vertex.
const NEAR: f64 = 0.1;

/// A path along the skin.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Way {
    /// Length, m.
    pub(super) length: f64,
    /// Its points, m: both ends, and where it crosses an edge.
    pub(super) points: Vec<Vec3>,
}

/// A surface with the graph of its paths.
pub(super) struct Ways<'a> {
    surface: &'a Surface,
    index: SurfaceIndex,
    edges: Vec<[u32; 2]>,
    per_edge: usize,
    /// Triangles around each vertex, and at each edge.
    around: Vec<Vec<u32>>,
    beside: Vec<Vec<u32>>,
    /// Edges of each triangle.
    sides: Vec<[u32; 3]>,
}

/// A point of a path between its ends.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Crossing {
    /// A vertex.
    Vertex(u32),
    /// An edge from `a` to `b`, crossed at `a + t (b − a)`.
    Edge { edge: u32, t: f64 },
}

/// An end of a path, or a crossing.
#[derive(Debug, Clone, Copy)]
enum Stop {
    End { point: Vec3, triangle: u32 },
    At(Crossing),
}

impl<'a> Ways<'a> {
    pub(super) fn new(surface: &'a Surface) -> Self {
        let edges = surface.edges();
        let mut around = vec![Vec::new(); surface.points.len()];
        let mut beside = vec![Vec::new(); edges.len()];
        let mut sides = Vec::with_capacity(surface.triangles.len());
        for (t, &[a, b, c]) in surface.triangles.iter().enumerate() {
            let t = t as u32;
            let side = |a: u32, b: u32| {
                let edge = [a.min(b), a.max(b)];
                edges.binary_search(&edge).unwrap_or_default()
            };
            let all = [side(a, b), side(b, c), side(c, a)];
            for v in [a, b, c] {
                around[v as usize].push(t);
            }
            for e in all {
                beside[e].push(t);
            }
            sides.push(all.map(|e| e as u32));
        }
        Self {
            surface,
            index: SurfaceIndex::build(surface),
            per_edge: (MOST_POINTS / edges.len().max(1)).clamp(1, POINTS_PER_EDGE),
            edges,
            around,
            beside,
            sides,
        }
    }

    /// The shortest path to `from` from the place of the skin that is nearest to each of `marks`, as from the mark to
    /// `from`. None if the skin is in pieces, and the two lie on different ones.
    pub(super) fn from(&self, from: Vec3, marks: &[Vec3]) -> Vec<Option<Way>> {
        let Some(start) = self.index.closest(from) else {
            return vec![None; marks.len()];
        };
        let n = self.surface.points.len() + self.per_edge * self.edges.len();
        let mut reached = vec![(f64::INFINITY, u32::MAX); n];
        let mut queue = BinaryHeap::new();
        for node in self.nodes_of(start.triangle) {
            let distance = (self.point(node) - start.point).norm();
            reached[node as usize] = (distance, u32::MAX);
            // The bits of positive numbers have their order.
            queue.push(Reverse((distance.to_bits(), node)));
        }
        while let Some(Reverse((bits, node))) = queue.pop() {
            let distance = f64::from_bits(bits);
            if distance > reached[node as usize].0 {
                continue;
            }
            let here = self.point(node);
            for &t in self.triangles_at(node) {
                for next in self.nodes_of(t) {
                    let there = distance + (self.point(next) - here).norm();
                    if there < reached[next as usize].0 {
                        reached[next as usize] = (there, node);
                        queue.push(Reverse((there.to_bits(), next)));
                    }
                }
            }
        }
        let way = |mark: &Vec3| {
            let end = self.index.closest(*mark)?;
            if end.triangle == start.triangle {
                return Some(Way::through(vec![end.point, start.point]));
            }
            let last = self.nodes_of(end.triangle).min_by(|&a, &b| {
                let whole =
                    |node: u32| reached[node as usize].0 + (self.point(node) - end.point).norm();
                whole(a).total_cmp(&whole(b))
            })?;
            if !reached[last as usize].0.is_finite() {
                return None;
            }
            let mut crossings = Vec::new();
            let mut node = last;
            while node != u32::MAX {
                crossings.push(self.crossing(node));
                node = reached[node as usize].1;
            }
            let stop = |at: Closest| Stop::End {
                point: at.point,
                triangle: at.triangle,
            };
            Some(self.shortened(stop(end), crossings, stop(start)))
        };
        marks.iter().map(way).collect()
    }

    /// The nodes of the graph on the border of a triangle.
    fn nodes_of(&self, triangle: u32) -> impl Iterator<Item = u32> + '_ {
        let first = self.surface.points.len() as u32;
        let k = self.per_edge as u32;
        let vertices = self.surface.triangles[triangle as usize];
        let sides = self.sides[triangle as usize];
        (vertices.into_iter()).chain(
            sides
                .into_iter()
                .flat_map(move |e| (0..k).map(move |i| first + e * k + i)),
        )
    }

    fn triangles_at(&self, node: u32) -> &[u32] {
        match (node as usize).checked_sub(self.surface.points.len()) {
            None => &self.around[node as usize],
            Some(at) => &self.beside[at / self.per_edge],
        }
    }

    fn crossing(&self, node: u32) -> Crossing {
        match (node as usize).checked_sub(self.surface.points.len()) {
            None => Crossing::Vertex(node),
            Some(at) => Crossing::Edge {
                edge: (at / self.per_edge) as u32,
                t: (at % self.per_edge + 1) as f64 / (self.per_edge + 1) as f64,
            },
        }
    }

    fn point(&self, node: u32) -> Vec3 {
        self.at(self.crossing(node))
    }

    fn at(&self, crossing: Crossing) -> Vec3 {
        let points = &self.surface.points;
        match crossing {
            Crossing::Vertex(v) => points[v as usize],
            Crossing::Edge { edge, t } => {
                let [a, b] = self.edges[edge as usize].map(|v| points[v as usize]);
                a + (b - a) * t
            }
        }
    }

    /// The shortest path near a given one.
    fn shortened(&self, begin: Stop, crossings: Vec<Crossing>, end: Stop) -> Way {
        let mut best = self.straightened(begin, crossings, end);
        let mut length = self.way(begin, &best, end).length;
        for _ in 0..MOST_TRIES {
            let vertices = (0..best.len()).filter(|&i| matches!(best[i], Crossing::Vertex(_)));
            let shorter = vertices
                .flat_map(|i| self.sides_of(begin, &best, end, i))
                .find_map(|crossings| {
                    let crossings = self.straightened(begin, crossings, end);
                    let other = self.way(begin, &crossings, end).length;
                    (other < length - GAIN).then_some((other, crossings))
                });
            let Some(shorter) = shorter else { break };
            (length, best) = shorter;
        }
        self.way(begin, &best, end)
    }

    fn way(&self, begin: Stop, crossings: &[Crossing], end: Stop) -> Way {
        let inner = crossings.iter().map(|&crossing| self.at(crossing));
        let points = std::iter::once(self.place(begin)).chain(inner);
        Way::through(points.chain([self.place(end)]).collect())
    }

    fn place(&self, stop: Stop) -> Vec3 {
        match stop {
            Stop::End { point, .. } => point,
            Stop::At(crossing) => self.at(crossing),
        }
    }

    /// The triangles that a stop lies on.
    fn triangles_of(&self, stop: Stop) -> &[u32] {
        match stop {
            Stop::End { triangle, .. } => {
                let all = &self.around[self.surface.triangles[triangle as usize][0] as usize];
                let at = all.iter().position(|&t| t == triangle).unwrap_or_default();
                &all[at..=at]
            }
            Stop::At(Crossing::Vertex(v)) => &self.around[v as usize],
            Stop::At(Crossing::Edge { edge, .. }) => &self.beside[edge as usize],
        }
    }

    /// The crossings with edges that slide to where the path is shortest. One that comes to a vertex
    /// becomes that vertex.
    fn straightened(&self, begin: Stop, mut crossings: Vec<Crossing>, end: Stop) -> Vec<Crossing> {
        let [begin, end] = [begin, end].map(|stop| self.place(stop));
        for _ in 0..SWEEPS {
            let mut moved: f64 = 0.0;
            for i in 0..crossings.len() {
                let Crossing::Edge { edge, t } = crossings[i] else {
                    continue;
                };
                let p = i.checked_sub(1).map_or(begin, |i| self.at(crossings[i]));
                let q = crossings.get(i + 1).map_or(end, |&next| self.at(next));
                let [a, b] = self.edges[edge as usize].map(|v| self.surface.points[v as usize]);
                let along = b - a;
                let scale = along.norm_squared().max(f64::MIN_POSITIVE);
                let on = |x: Vec3| {
                    let foot = (x - a).dot(&along) / scale;
                    (foot, (x - a - along * foot).norm())
                };
                let ((t_p, h_p), (t_q, h_q)) = (on(p), on(q));
                let heights = h_p + h_q;
                if heights > 1e-9 * scale.sqrt() {
                    let best = ((t_p * h_q + t_q * h_p) / heights).clamp(0.0, 1.0);
                    moved = moved.max((best - t).abs());
                    crossings[i] = Crossing::Edge { edge, t: best };
                }
            }
            if moved < STILL {
                break;
            }
        }
        for crossing in &mut crossings {
            if let Crossing::Edge { edge, t } = *crossing {
                let [a, b] = self.edges[edge as usize];
                if t < STILL {
                    *crossing = Crossing::Vertex(a);
                } else if t > 1.0 - STILL {
                    *crossing = Crossing::Vertex(b);
                }
            }
        }
        crossings.dedup();
        crossings
    }

    /// The paths that pass the vertex at `i` on its sides, across the edges between the triangles
    /// before and after it.
    fn sides_of(
        &self,
        begin: Stop,
        crossings: &[Crossing],
        end: Stop,
        i: usize,
    ) -> Vec<Vec<Crossing>> {
        let Crossing::Vertex(v) = crossings[i] else {
            return Vec::new();
        };
        let before = i.checked_sub(1).map_or(begin, |i| Stop::At(crossings[i]));
        let after = (crossings.get(i + 1)).map_or(end, |&next| Stop::At(next));
        let around = &self.around[v as usize];
        let of = |stop: Stop| {
            let all = self.triangles_of(stop).iter().copied();
            all.filter(|t| around.contains(t)).collect::<Vec<u32>>()
        };
        let (from, to) = (of(before), of(after));
        let mut all = Vec::new();
        for &first in &from {
            for way_out in self.edges_at(first, v) {
                let Some(fan) = self.fan(v, first, way_out, &to) else {
                    continue;
                };
                let mut path = crossings[..i].to_vec();
                path.extend(fan.into_iter().map(|edge| Crossing::Edge {
                    edge,
                    t: if self.edges[edge as usize][0] == v {
                        NEAR
                    } else {
                        1.0 - NEAR
                    },
                }));
                path.extend_from_slice(&crossings[i + 1..]);
                all.push(path);
            }
        }
        all
    }

    /// The edges of a triangle that meet in a vertex.
    fn edges_at(&self, triangle: u32, v: u32) -> impl Iterator<Item = u32> + '_ {
        let sides = self.sides[triangle as usize];
        (sides.into_iter()).filter(move |&e| self.edges[e as usize].contains(&v))
    }

    /// The edges at a vertex that are crossed from a triangle, at first across `way_out`, to one of `to`. None
    /// if a rim is in the way.
    fn fan(&self, v: u32, first: u32, way_out: u32, to: &[u32]) -> Option<Vec<u32>> {
        let (mut triangle, mut edge, mut crossed) = (first, way_out, Vec::new());
        for _ in 0..=self.around[v as usize].len() {
            if to.contains(&triangle) {
                return Some(crossed);
            }
            crossed.push(edge);
            let beside = &self.beside[edge as usize];
            triangle = *beside.iter().find(|&&t| t != triangle)?;
            edge = self.edges_at(triangle, v).find(|&e| e != edge)?;
        }
        None
    }
}

impl Way {
    fn through(mut points: Vec<Vec3>) -> Self {
        points.dedup_by(|a, b| (*a - *b).norm() < 1e-9);
        // Not `sum`: of nothing it is −0.
        let length = (points.windows(2)).fold(0.0, |sum, pair| sum + (pair[1] - pair[0]).norm());
        Self { length, points }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    /// A grid of `n` by `m` cells, rolled up or flat.
    fn grid(n: u32, m: u32, place: impl Fn(f64, f64) -> Vec3) -> Surface {
        let mut surface = Surface::default();
        for j in 0..=m {
            for i in 0..=n {
                let [u, v] = [f64::from(i) / f64::from(n), f64::from(j) / f64::from(m)];
                surface.points.push(place(u, v));
            }
        }
        for j in 0..m {
            for i in 0..n {
                let at = |i: u32, j: u32| j * (n + 1) + i;
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                surface.triangles.push([a, b, c]);
                surface.triangles.push([a, c, d]);
            }
        }
        surface
    }

    fn length(surface: &Surface, a: Vec3, b: Vec3) -> f64 {
        Ways::new(surface).from(a, &[b])[0].as_ref().unwrap().length
    }

    #[test]
    fn on_flat_skin_the_path_is_straight() {
        let flat = grid(12, 9, |u, v| Vec3::new(0.2 * u, 0.15 * v, 0.0));
        for (a, b) in [
            ([0.013, 0.021], [0.187, 0.132]),
            ([0.01, 0.14], [0.19, 0.01]),
            ([0.1, 0.07], [0.103, 0.071]),
            ([0.05, 0.075], [0.15, 0.0753]),
        ] {
            let [a, b] = [a, b].map(|[x, y]: [f64; 2]| Vec3::new(x, y, 0.0));
            let (found, exact) = (length(&flat, a, b), (a - b).norm());
            assert!(found > exact - 1e-9, "{found} is shorter than {exact}");
            assert!(found < 1.001 * exact, "{found} is longer than {exact}");
        }
    }

    #[test]
    fn round_a_limb_the_path_goes_along_the_skin() {
        let (radius, long) = (0.04, 0.25);
        let around = |angle: f64, x: f64| Vec3::new(x, radius * angle.cos(), radius * angle.sin());
        // Open along the line of angle 0, as skin that was cut.
        let limb = grid(24, 20, |u, v| around(2.0 * PI * u, long * v));
        for (a, b) in [
            ((1.0_f64, 0.05_f64), (1.0 + PI, 0.05)),
            ((0.5, 0.1), (2.5, 0.2)),
            ((3.0, 0.2), (3.3, 0.03)),
        ] {
            let exact = (radius * (a.0 - b.0)).hypot(a.1 - b.1);
            let found = length(&limb, around(a.0, a.1), around(b.0, b.1));
            // Chords of 24 sides are shorter than the circle by 0.3 %.
            assert!((found / exact - 1.0).abs() < 0.004, "{found} for {exact}");
            let through = (around(a.0, a.1) - around(b.0, b.1)).norm();
            assert!(found > through - 1e-9);
        }
    }

    #[test]
    fn a_path_begins_at_the_mark_and_lies_on_the_skin() {
        let limb = grid(24, 20, |u, v| {
            let angle = 2.0 * PI * u;
            Vec3::new(0.25 * v, 0.04 * angle.cos(), 0.03 * angle.sin())
        });
        let index = SurfaceIndex::build(&limb);
        let on = |p: Vec3| index.closest(p).unwrap().point;
        let (over, mark) = (
            on(Vec3::new(0.05, 0.0, 0.1)),
            on(Vec3::new(0.2, -0.1, 0.01)),
        );
        let way = Ways::new(&limb).from(over, &[mark])[0].clone().unwrap();
        assert!((way.points[0] - mark).norm() < 1e-12);
        assert!((way.points.last().unwrap() - over).norm() < 1e-12);
        for pair in way.points.windows(2) {
            let middle = (pair[0] + pair[1]) / 2.0;
            assert!((on(middle) - middle).norm() < 1e-9, "{middle}");
        }
        let backward = length(&limb, mark, over);
        assert!((way.length - backward).abs() < 0.001 * way.length);
    }

    #[test]
    fn skin_in_pieces_has_no_path_between_them() {
        let mut two = grid(2, 2, |u, v| Vec3::new(u, v, 0.0));
        let n = two.points.len() as u32;
        let other = grid(2, 2, |u, v| Vec3::new(u + 3.0, v, 0.0));
        two.points.extend(other.points);
        two.triangles
            .extend(other.triangles.iter().map(|t| t.map(|v| v + n)));
        let ways = Ways::new(&two);
        let found = ways.from(
            Vec3::zeros(),
            &[Vec3::new(3.5, 0.5, 0.0), Vec3::new(0.5, 0.5, 0.0)],
        );
        assert!(found[0].is_none());
        assert!((found[1].as_ref().unwrap().length - 0.5_f64.sqrt()).abs() < 1e-6);
    }
}
