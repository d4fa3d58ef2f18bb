//! Edges that collapse one after the other, and what each collapse must keep.

use std::collections::BTreeSet;

use super::{CoarsenLimits, Coarsened};
use crate::repair::drop_unused;
use crate::topology::{all_sides, by_edge};
use crate::{Surface, Vec3, closest_on_triangle};

/// Least shape of a new triangle, 1 for three equal sides and 0 for none of area; or that of the worst
/// triangle it replaces. Two equal sides at 30° have 0.59, at 150° 0.42.
const LEAST_SHAPE: f64 = 0.5;
/// Least cosine of the angle (45°) between a new triangle and the one in its place before.
const LEAST_COS_BEFORE: f64 = 0.707;
/// Least cosine of the angle (60°) between a new triangle and the given skin at its corners. At the
/// corner of a box the angle is 55°.
const LEAST_COS_GIVEN: f64 = 0.5;

/// A point of the given skin at which the distance is measured.
#[derive(Debug, Clone, Copy)]
struct Sample {
    at: Vec3,
    /// Largest distance allowed, m.
    tolerance: f64,
    /// Distance from the coarse skin, m.
    distance: f64,
}

/// A skin while its edges collapse.
pub(super) struct Mesh<'a, Longest> {
    limits: &'a CoarsenLimits<'a, Longest>,
    /// Given points, and the given normals at them.
    points: &'a [Vec3],
    normals: Vec<Vec3>,
    /// Triangles; those of collapsed edges have the corners that they had last.
    triangles: Vec<[u32; 3]>,
    is_gone: Vec<bool>,
    /// Triangles around each vertex.
    around: Vec<Vec<u32>>,
    /// Vertices that stay because of their place in the mesh.
    is_fixed: Vec<bool>,
    /// For a rim vertex, the given rim vertices between it and the next one of the rim.
    passed: Vec<Vec<u32>>,
    samples: Vec<Sample>,
    /// The samples of each triangle.
    samples_of: Vec<Vec<u32>>,
    /// Edges to try, from the vertex that moves: the bits of the squared length, which sort as
    /// positive numbers do, and the two vertices.
    queue: BTreeSet<(u64, u32, u32)>,
}

/// A collapse that may be done.
struct Collapse {
    /// Triangles that vanish, and those that change with their new corners.
    gone: Vec<u32>,
    changed: Vec<(u32, [u32; 3])>,
    /// For each sample of these triangles, its new triangle (an index into `changed`) and distance.
    samples: Vec<(u32, usize, f64)>,
    /// The vertex of the rim before the one that moves, if it is on the rim.
    rim_from: Option<u32>,
}

impl<'a, Longest: Fn(&[Vec3; 3]) -> f64> Mesh<'a, Longest> {
    pub(super) fn new(skin: &'a Surface, limits: &'a CoarsenLimits<'a, Longest>) -> Self {
        let (n, n_triangles) = (skin.points.len(), skin.triangles.len());
        let mut mesh = Self {
            limits,
            points: &skin.points,
            normals: skin.vertex_normals(),
            triangles: skin.triangles.clone(),
            is_gone: vec![false; n_triangles],
            around: vec![Vec::new(); n],
            is_fixed: vec![false; n],
            passed: vec![Vec::new(); n],
            samples: Vec::new(),
            samples_of: vec![Vec::new(); n_triangles],
            queue: BTreeSet::new(),
        };
        for (t, corners) in (0_u32..).zip(&skin.triangles) {
            for &v in corners {
                mesh.around[v as usize].push(t);
            }
        }
        for v in 0..n as u32 {
            let fan = &mesh.around[v as usize];
            let [out, into] = mesh.open_edges(v);
            mesh.is_fixed[v as usize] = fan.is_empty() || out.len() > 1 || !mesh.is_one_fan(v);
            debug_assert_eq!(out.len(), into.len(), "rim at vertex {v}");
        }
        mesh.take_samples(skin);
        for v in 0..n as u32 {
            mesh.enqueue(v);
        }
        mesh
    }

    /// Collapses edges until none can be collapsed any more.
    pub(super) fn coarsen(mut self) -> Coarsened {
        while let Some((_, v, w)) = self.queue.pop_first() {
            let Some(collapse) = self.check(v, w) else {
                continue;
            };
            self.collapse(v, &collapse);
            self.enqueue(w);
            for x in self.neighbours(w) {
                self.enqueue(x);
            }
        }
        let kept = (self.triangles.iter().zip(&self.is_gone)).filter(|(_, is_gone)| !**is_gone);
        let mut surface = Surface {
            points: self.points.to_vec(),
            triangles: kept.map(|(corners, _)| *corners).collect(),
        };
        // A vertex without triangles in the given skin goes too.
        let given = (0..self.points.len() as u32)
            .filter(|&v| !self.around[v as usize].is_empty())
            .collect();
        drop_unused(&mut surface);
        Coarsened {
            surface,
            given,
            deviation: (self.samples.iter().map(|s| s.distance)).fold(0.0, f64::max),
        }
    }

    /// Puts samples at vertices, at the middles of edges and at the centres of triangles.
    fn take_samples(&mut self, skin: &Surface) {
        let mut put = |vertices: &[u32], t: u32| {
            let n = vertices.len() as f64;
            let tolerances = vertices.iter().map(|&v| self.limits.tolerance[v as usize]);
            self.samples_of[t as usize].push(self.samples.len() as u32);
            self.samples.push(Sample {
                at: (vertices.iter().map(|&v| skin.points[v as usize])).sum::<Vec3>() / n,
                tolerance: tolerances.fold(f64::INFINITY, f64::min),
                distance: 0.0,
            });
        };
        for (v, fan) in (0_u32..).zip(&self.around) {
            if let Some(&t) = fan.first() {
                put(&[v], t);
            }
        }
        for on_edge in by_edge(&all_sides(skin)) {
            put(&on_edge[0].edge, on_edge[0].triangle);
        }
        for (t, corners) in (0_u32..).zip(&skin.triangles) {
            put(corners, t);
        }
    }

    /// Puts the edges of a vertex into the queue, as those along which it may move.
    fn enqueue(&mut self, v: u32) {
        if self.limits.is_kept[v as usize] || self.is_fixed[v as usize] {
            return;
        }
        for w in self.neighbours(v) {
            let length = (self.points[v as usize] - self.points[w as usize]).norm_squared();
            self.queue.insert((length.to_bits(), v, w));
        }
    }

    /// The vertices that share a triangle with `v`, ascending.
    fn neighbours(&self, v: u32) -> Vec<u32> {
        let corners = (self.around[v as usize].iter()).flat_map(|&t| self.triangles[t as usize]);
        let mut all: Vec<u32> = corners.filter(|&x| x != v).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// The ends of the rim's edges that leave `v`, and the starts of those that lead to it, in the
    /// direction of their triangles.
    fn open_edges(&self, v: u32) -> [Vec<u32>; 2] {
        let (mut out, mut into) = (Vec::new(), Vec::new());
        for &t in &self.around[v as usize] {
            let corners = self.triangles[t as usize];
            let k = corners.iter().position(|&x| x == v).unwrap_or(0);
            out.push(corners[(k + 1) % 3]);
            into.push(corners[(k + 2) % 3]);
        }
        let only = |these: &[u32], others: &[u32]| {
            (these.iter().copied().filter(|x| !others.contains(x))).collect()
        };
        [only(&out, &into), only(&into, &out)]
    }

    /// Whether the triangles around `v` are connected by their edges at `v`.
    fn is_one_fan(&self, v: u32) -> bool {
        let fan = &self.around[v as usize];
        let Some(&first) = fan.first() else {
            return false;
        };
        let mut reached = vec![first];
        let mut i = 0;
        while let Some(&t) = reached.get(i) {
            let corners = self.triangles[t as usize];
            let beside = |u: u32| {
                let shared = |x: &&u32| **x != v && corners.contains(*x);
                self.triangles[u as usize].iter().filter(shared).count() > 0
            };
            let next = fan.iter().filter(|&&u| !reached.contains(&u) && beside(u));
            let next: Vec<u32> = next.copied().collect();
            reached.extend(next);
            i += 1;
        }
        reached.len() == fan.len()
    }

    /// Whether `v` may move onto `w`, and what changes then.
    fn check(&self, v: u32, w: u32) -> Option<Collapse> {
        let (gone, moved): (Vec<u32>, Vec<u32>) = (self.around[v as usize].iter())
            .partition(|&&t| self.triangles[t as usize].contains(&w));
        // Only the triangles at the edge may join the two, else sheets of the skin would be glued
        // together (the link condition).
        let of_w = self.neighbours(w);
        let common = self.neighbours(v).into_iter();
        let n_common = common.filter(|x| of_w.binary_search(x).is_ok()).count();
        if gone.is_empty() || n_common != gone.len() || moved.is_empty() {
            return None;
        }
        let [out, into] = self.open_edges(v);
        let rim_from = match (out.first(), into.first()) {
            (Some(&next), Some(&before)) => {
                let is_along = w == next || w == before;
                (is_along && self.is_near_rim(before, v, next)).then_some(Some(before))?
            }
            _ => None,
        };
        // Nor may two triangles have the same corners.
        let is_doubled = |&t: &u32| {
            let stay = self.triangles[t as usize];
            let fan = self.around[w as usize].iter();
            fan.map(|&u| self.triangles[u as usize]).any(|other| {
                !other.contains(&v) && stay.iter().all(|x| *x == v || other.contains(x))
            })
        };
        if moved.iter().any(is_doubled) {
            return None;
        }
        let changed: Vec<(u32, [u32; 3])> = (moved.iter())
            .map(|&t| {
                (
                    t,
                    self.triangles[t as usize].map(|x| if x == v { w } else { x }),
                )
            })
            .collect();
        let corners = |of: [u32; 3]| of.map(|x| self.points[x as usize]);
        let fan = self.around[v as usize].iter();
        let worst = fan.map(|&t| shape(&corners(self.triangles[t as usize])));
        let least = worst.fold(LEAST_SHAPE, f64::min);
        for &(t, new) in &changed {
            let places = corners(new);
            let normal = area_vector(&places);
            let agrees = |other: &Vec3, least: f64| {
                normal.dot(other) >= least * normal.norm() * other.norm()
            };
            let is_good = longest_edge(&places) <= (self.limits.longest)(&places)
                && shape(&places) >= least
                && agrees(
                    &area_vector(&corners(self.triangles[t as usize])),
                    LEAST_COS_BEFORE,
                )
                && (new.iter()).all(|&x| agrees(&self.normals[x as usize], LEAST_COS_GIVEN));
            if !is_good {
                return None;
            }
        }
        let places: Vec<[Vec3; 3]> = changed.iter().map(|(_, new)| corners(*new)).collect();
        let mut samples = Vec::new();
        for &t in &self.around[v as usize] {
            for &s in &self.samples_of[t as usize] {
                let sample = &self.samples[s as usize];
                let far =
                    |of: &[Vec3; 3]| (closest_on_triangle(sample.at, *of).0 - sample.at).norm();
                let distances = places.iter().map(far).enumerate();
                let (i, distance) = distances.min_by(|a, b| a.1.total_cmp(&b.1))?;
                if distance > sample.tolerance {
                    return None;
                }
                samples.push((s, i, distance));
            }
        }
        Some(Collapse {
            gone,
            changed,
            samples,
            rim_from,
        })
    }

    /// Whether the rim stays near enough if its vertex `v` goes.
    fn is_near_rim(&self, before: u32, v: u32, next: u32) -> bool {
        let [a, b] = [before, next].map(|x| self.points[x as usize]);
        let along = b - a;
        let is_near = |&x: &u32| {
            let p = self.points[x as usize];
            let share = ((p - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
            (a + along * share - p).norm() <= self.limits.tolerance[x as usize]
        };
        let passed = [before, v].map(|x| &self.passed[x as usize]);
        before != next && is_near(&v) && passed.into_iter().flatten().all(is_near)
    }

    fn collapse(&mut self, v: u32, collapse: &Collapse) {
        if let Some(from) = collapse.rim_from {
            let beyond = std::mem::take(&mut self.passed[v as usize]);
            let passed = &mut self.passed[from as usize];
            passed.push(v);
            passed.extend(beyond);
        }
        for &t in &collapse.gone {
            for x in self.triangles[t as usize] {
                self.around[x as usize].retain(|&other| other != t);
            }
            self.is_gone[t as usize] = true;
            self.samples_of[t as usize].clear();
        }
        for &(t, new) in &collapse.changed {
            // The new corner is the one that the triangle did not have.
            let old = self.triangles[t as usize];
            let added = new.into_iter().filter(|x| !old.contains(x));
            for x in added {
                self.around[x as usize].push(t);
            }
            self.triangles[t as usize] = new;
            self.samples_of[t as usize].clear();
        }
        for &(s, i, distance) in &collapse.samples {
            self.samples[s as usize].distance = distance;
            self.samples_of[collapse.changed[i].0 as usize].push(s);
        }
        self.around[v as usize].clear();
    }
}

fn area_vector([a, b, c]: &[Vec3; 3]) -> Vec3 {
    (b - a).cross(&(c - a)) * 0.5
}

fn edges([a, b, c]: &[Vec3; 3]) -> [f64; 3] {
    [a - b, b - c, c - a].map(|edge| edge.norm())
}

fn longest_edge(corners: &[Vec3; 3]) -> f64 {
    edges(corners).into_iter().fold(0.0, f64::max)
}

/// 4√3 times the area over the sum of the squared edges: 1 for three equal sides.
fn shape(corners: &[Vec3; 3]) -> f64 {
    let squares: f64 = edges(corners).iter().map(|edge| edge * edge).sum();
    4.0 * 3_f64.sqrt() * area_vector(corners).norm() / squares
}
