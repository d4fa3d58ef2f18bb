//! The lines along which columns grow inward from the skin.

use super::core::RigidCore;
use super::depth::{Depth, Place};
use crate::{CutFace, Surface, Vec3};

/// Length over which a column turns from the skin's normal to the core's field, as a share of its
/// room.
const TURN_SHARE: f64 = 0.4;
/// Longest step along a column, as a share of its room.
const STEP_SHARE: f64 = 1.0 / 16.0;
/// A column ends when it is this close to the core, as a share of its room.
const END_SHARE: f64 = 2e-3;
/// A column that is longer than this many times its room and has not met the core ends there.
const MAX_DETOUR: f64 = 3.0;
const MAX_STEPS: usize = 200;
/// Least cosine of the angle between a direction inward and the normals of the triangles at its
/// vertex.
const MIN_COS: f64 = 0.3;
/// Largest length of a straight column as a multiple of its depth: a little more than a direction
/// that leans as far as it may needs.
const MAX_LEAN: f64 = 1.05 / MIN_COS;
/// Less room than this counts as none: the column then only has a direction. m
const NO_ROOM: f64 = 1e-5;

/// A line inward from a skin vertex, given by points with growing arc length.
#[derive(Debug, Clone)]
pub(super) struct Column {
    points: Vec<Vec3>,
    arc: Vec<f64>,
}

impl Column {
    fn starting_at(p: Vec3) -> Self {
        Self {
            points: vec![p],
            arc: vec![0.0],
        }
    }

    fn push(&mut self, p: Vec3) {
        let last = self.points[self.points.len() - 1];
        let s = self.length() + (p - last).norm();
        self.points.push(p);
        self.arc.push(s);
    }

    /// Length of the whole line. m
    pub(super) fn length(&self) -> f64 {
        self.arc[self.arc.len() - 1]
    }

    /// The point at arc length `s`. Beyond the end, the column continues straight on.
    pub(super) fn at(&self, s: f64) -> Vec3 {
        let n = self.arc.len();
        if n == 1 {
            return self.points[0];
        }
        let above = self.arc.partition_point(|&a| a < s).clamp(1, n - 1);
        let (s0, s1) = (self.arc[above - 1], self.arc[above]);
        if s1 <= s0 {
            return self.points[above];
        }
        self.points[above - 1].lerp(&self.points[above], (s - s0) / (s1 - s0))
    }
}

/// Keeps the columns of a flat cut face in that face. For each vertex it holds the normals that its
/// column must not follow.
#[derive(Debug)]
pub(super) struct Confinement {
    normals: Vec<Vec<Vec3>>,
}

impl Confinement {
    pub(super) fn new(n_vertices: usize, cuts: &[CutFace]) -> Self {
        let mut normals = vec![Vec::new(); n_vertices];
        for cut in cuts.iter().filter(|c| c.is_flat) {
            for &v in &cut.vertices {
                normals[v as usize].push(cut.normal);
            }
        }
        Self { normals }
    }

    /// `direction` without its components along the normals of vertex `v`'s cut faces.
    pub(super) fn project(&self, v: usize, direction: Vec3) -> Vec3 {
        let mut taken: Vec<Vec3> = Vec::new();
        for normal in &self.normals[v] {
            let rest = taken
                .iter()
                .fold(*normal, |rest, t| rest - t * t.dot(&rest));
            taken.extend(rest.try_normalize(1e-6));
        }
        taken.iter().fold(direction, |d, t| d - t * t.dot(&d))
    }

    /// The result of [`project`](Self::project) as a unit vector, unless nothing is left.
    pub(super) fn confine(&self, v: usize, direction: Vec3) -> Vec3 {
        if self.normals[v].is_empty() {
            return direction;
        }
        self.project(v, direction)
            .try_normalize(1e-9)
            .unwrap_or(direction)
    }
}

/// The neighbours of each vertex.
pub(super) fn one_rings(skin: &Surface) -> Vec<Vec<u32>> {
    let mut rings = vec![Vec::new(); skin.points.len()];
    for [a, b] in skin.edges() {
        rings[a as usize].push(b);
        rings[b as usize].push(a);
    }
    rings
}

/// Unit directions inward: the normals of the skin, smoothed over a length comparable with the
/// depth. A direction is turned back if smoothing would make it leave a triangle of its vertex on
/// the outer side.
pub(super) fn inward_directions(
    skin: &Surface,
    rings: &[Vec<u32>],
    confinement: &Confinement,
    smoothing_length: f64,
) -> Vec<Vec3> {
    let normals = skin.vertex_normals();
    let edge = skin.mean_edge_length().max(f64::MIN_POSITIVE);
    let n_sweeps = ((smoothing_length / edge).powi(2).round() as usize).clamp(2, 40);
    let mut directions: Vec<Vec3> = normals
        .iter()
        .enumerate()
        .map(|(v, n)| confinement.confine(v, -n))
        .collect();
    for _ in 0..n_sweeps {
        directions = (0..directions.len())
            .map(|v| {
                let ring = &rings[v];
                let sum: Vec3 = ring.iter().map(|&u| directions[u as usize]).sum();
                let mean = directions[v] + sum / ring.len().max(1) as f64;
                confinement.confine(v, mean.try_normalize(0.0).unwrap_or(directions[v]))
            })
            .collect();
    }
    keep_in_sight(skin, &mut directions, confinement);
    directions
}

/// Finds directions that leave a triangle of their vertex on the outer side (or nearly so), and
/// turns them towards the inside of that triangle.
fn keep_in_sight(skin: &Surface, directions: &mut [Vec3], confinement: &Confinement) {
    let mut faces: Vec<Vec<Vec3>> = vec![Vec::new(); directions.len()];
    for (t, triangle) in skin.triangles.iter().enumerate() {
        if let Some(n) = skin.area_vector(t).try_normalize(0.0) {
            for &v in triangle {
                faces[v as usize].push(-n);
            }
        }
    }
    for (v, direction) in directions.iter_mut().enumerate() {
        // Perceptron steps: each adds a little of the normal of the worst triangle. The loop ends
        // when the direction is inside all triangles, or gives up. A spike has no such direction;
        // its prisms are then invalid, and the growth reports where.
        for _ in 0..100 {
            let Some(worst) = faces[v]
                .iter()
                .min_by(|a, b| a.dot(direction).total_cmp(&b.dot(direction)))
            else {
                break;
            };
            if worst.dot(direction) >= MIN_COS {
                break;
            }
            let turned = (*direction + worst * 0.15).normalize();
            *direction = confinement.confine(v, turned);
        }
    }
}

/// Straight columns along `directions`, down to the depth `asked`, but at most about half (0.45) of
/// the distance between the skin and its far side.
pub(super) fn straight_columns(
    skin: &Surface,
    directions: &[Vec3],
    asked: impl Fn(usize) -> f64,
    depth: &Depth,
) -> Vec<Column> {
    const SHARE_OF_THICKNESS: f64 = 0.45;
    let mut across: Vec<f64> = (0..skin.points.len())
        .map(|v| {
            depth
                .index()
                .ray(skin.points[v], directions[v], 1e-6 * asked(v))
                .map_or(f64::INFINITY, |(s, _)| s)
        })
        .collect();
    limit_slope(skin, &mut across);
    (0..skin.points.len())
        .map(|v| {
            let to = |length: f64| {
                let mut column = Column::starting_at(skin.points[v]);
                column.push(skin.points[v] + directions[v] * length);
                column
            };
            let asked = asked(v);
            let longest = (MAX_LEAN * asked).min(SHARE_OF_THICKNESS * across[v]);
            match depth.reach(&to(longest), Place::SKIN, asked, longest) {
                Ok(place) | Err(place) => to(place.arc),
            }
        })
        .collect()
}

/// Lowers values until none exceeds a neighbour's by more than the length of the edge between them.
/// A ray that leaves a limb through its open end finds no far side, but the rays of its neighbours
/// do.
fn limit_slope(skin: &Surface, values: &mut [f64]) {
    let edges = skin.edges();
    loop {
        let mut is_changed = false;
        // Both ways through the edges, so that a value travels far in one sweep whatever the order
        // of the edges.
        for &[a, b] in edges.iter().chain(edges.iter().rev()) {
            let (a, b) = (a as usize, b as usize);
            let length = (skin.points[a] - skin.points[b]).norm();
            for (from, to) in [(a, b), (b, a)] {
                if values[to] > (values[from] + length) * (1.0 + 1e-12) {
                    values[to] = values[from] + length;
                    is_changed = true;
                }
            }
        }
        if !is_changed {
            return;
        }
    }
}

/// A column from the skin vertex `v` down to the core. It starts along `direction` and turns into
/// the core's field.
pub(super) fn column_to_core(
    v: usize,
    start: Vec3,
    direction: Vec3,
    core: &RigidCore,
    confinement: &Confinement,
) -> Column {
    let mut column = Column::starting_at(start);
    let room = core.distance(start);
    if room < NO_ROOM {
        // The skin touches the core. The column goes straight on, for the minimum thicknesses of
        // the layers.
        column.push(start + direction * NO_ROOM);
        return column;
    }
    let heading = |x: Vec3, s: f64| {
        let t = (s / (TURN_SHARE * room)).clamp(0.0, 1.0);
        let turn = t * t * (3.0 - 2.0 * t);
        let mixed = direction * (1.0 - turn) + core.direction(x) * turn;
        confinement.confine(v, mixed.try_normalize(1e-9).unwrap_or(direction))
    };
    let (mut x, mut last) = (start, direction);
    for _ in 0..MAX_STEPS {
        let s = column.length();
        let gap = core.distance(x);
        if gap <= END_SHARE * room || s > MAX_DETOUR * room {
            break;
        }
        let step = (0.9 * gap).min(STEP_SHARE * room);
        let midpoint = x + heading(x, s) * (0.5 * step);
        let next = heading(midpoint, s + 0.5 * step);
        // Beyond a minimum of the field (beside a bone that ends just before a cut face), the line
        // would swing to and fro.
        if s > 0.5 * room && next.dot(&last) < 0.0 {
            break;
        }
        last = next;
        x += next * step;
        column.push(x);
    }
    column
}
