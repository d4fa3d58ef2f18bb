//! A block that is fine under the tool and coarse far away: the body for studies of accuracy.

use std::f64::consts::{FRAC_PI_2, TAU};

use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

use super::levels::LevelStack;
use super::random::Random;
use crate::{CutFace, LayeredBody, Surface, Vec3};

/// Ratio of the height to the side of an equilateral triangle: the distance between rings.
const ROW: f64 = 0.866_025_403_784_438_6;
/// Irregular meshes move their vertices by up to this share of the spacing, in x and in y.
const JITTER: f64 = 0.25;
/// Least distance of inner vertices from a straight side, as a share of the spacing there.
const MARGIN: f64 = 0.6;
/// Number of rounds in which the free vertices outside the ring move towards the mean of their
/// neighbours.
const SMOOTHING: usize = 4;

/// The outline of a [`GradedBlock`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outline {
    /// A square with sides along x and y: four flat cut faces, in the order −x, +x, −y, +y.
    Square,
    /// A regular polygon with the area of the circle: a single cut face all round, not flat.
    Disc,
}

/// A flat block, seen from above. Lengths in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GradedBlock {
    /// Outline of the block.
    pub outline: Outline,
    /// Half the side of the square, or the radius of the disc.
    pub half_width: f64,
    /// Position of the middle in x and y. The middle is always a vertex.
    pub centre: [f64; 2],
    /// Radius of a circle with a ring of vertices on it, such as the edge of a punch. The vertices
    /// form a regular polygon with the *area* of the circle: its corners lie a little outside the
    /// circle, the middles of its sides inside.
    pub ring_radius: Option<f64>,
    /// Edge length on the ring and inside it (without a ring: in the middle).
    pub spacing: f64,
    /// Increase of the edge length per metre from the ring towards the middle, 0 to 1. If only the
    /// edge of a punch matters, its middle can be coarser.
    pub inner_growth: f64,
    /// Increase of the edge length per metre outside the ring.
    pub growth: f64,
    /// Seed for an irregular mesh: rings are turned and vertices moved at random.
    pub jitter: Option<u64>,
}

impl GradedBlock {
    /// The same block with all edges half as long, for example for a convergence study.
    #[must_use]
    pub fn halved(&self) -> Self {
        Self {
            spacing: 0.5 * self.spacing,
            inner_growth: 0.5 * self.inner_growth,
            growth: 0.5 * self.growth,
            ..*self
        }
    }

    /// The vertices on the ring and inside it, ascending. Without a ring, only the middle.
    pub fn patch_vertices(&self, body: &LayeredBody) -> Vec<u32> {
        let radius = self
            .ring_radius
            .map_or(0.0, |a| a * equal_area(self.n_on_ring()));
        let centre = Vec3::new(self.centre[0], self.centre[1], 0.0);
        (0..body.n_vertices() as u32)
            .filter(|&v| {
                let p = body.skin.points[v as usize] - centre;
                p.xy().norm() <= radius + 1e-9 * self.half_width
            })
            .collect()
    }

    /// Number of edges along the radius of the ring; 1 without a ring.
    fn n_on_radius(&self) -> usize {
        self.ring_radius
            .map_or(1, |a| (a / self.spacing).round().max(1.0) as usize)
    }

    fn n_on_ring(&self) -> usize {
        6 * self.n_on_radius()
    }

    /// Radii of the rings inside the ring, from the middle outwards, and their numbers of vertices.
    fn inner_rings(&self) -> Vec<(f64, usize)> {
        let (a, h, g) = (self.inner_radius(), self.spacing_at(0.0), self.inner_growth);
        if g == 0.0 {
            return (1..self.n_on_radius())
                .map(|i| (i as f64 * h, 6 * i))
                .collect();
        }
        // Distance from the ring after k rows whose heights grow with that distance: h/g (e^(g k) −
        // 1).
        let rows = (g * a / h).ln_1p() / g;
        let n_rows = rows.round().max(1.0) as usize;
        (1..n_rows)
            .rev()
            .map(|k| {
                let from_ring = h / g * (g * rows * k as f64 / n_rows as f64).exp_m1();
                let r = a - from_ring;
                let n = (6.0 * r / (h + g * from_ring)).round().max(6.0);
                (r, n as usize)
            })
            .collect()
    }

    /// Radius at which edges begin to lengthen outwards.
    fn inner_radius(&self) -> f64 {
        self.ring_radius.unwrap_or(self.spacing)
    }

    /// Wanted edge length at a distance from the middle.
    fn spacing_at(&self, r: f64) -> f64 {
        let at_ring = self.inner_radius() / self.n_on_radius() as f64;
        at_ring + self.growth * (r - self.inner_radius()).max(0.0)
    }

    /// Number of rows of triangles between the ring and radius `r`.
    fn rows_to(&self, r: f64) -> f64 {
        let (h, beyond) = (self.spacing_at(0.0), r - self.inner_radius());
        if self.growth > 0.0 {
            (self.growth * beyond / h).ln_1p() / (self.growth * ROW)
        } else {
            beyond / (h * ROW)
        }
    }

    /// Radius after that many rows beyond the ring: the inverse of `rows_to`.
    fn radius_of(&self, rows: f64) -> f64 {
        let h = self.spacing_at(0.0);
        self.inner_radius()
            + if self.growth > 0.0 {
                h / self.growth * (self.growth * ROW * rows).exp_m1()
            } else {
                h * ROW * rows
            }
    }

    fn check(&self) {
        let is_length = |x: f64| x > 0.0 && x.is_finite();
        assert!(
            is_length(self.half_width)
                && is_length(self.spacing)
                && self.ring_radius.is_none_or(is_length)
                && self.growth >= 0.0
                && self.growth.is_finite()
                && (0.0..=1.0).contains(&self.inner_growth)
                && self.centre.iter().all(|c| c.is_finite()),
            "lengths must be positive, growth not negative and inner growth 0 to 1: {self:?}"
        );
        assert!(
            self.inner_radius() + 0.5 * self.spacing_at(0.0) < self.half_width,
            "the ring leaves no room in the block: {self:?}"
        );
        let rim = TAU * self.half_width / self.spacing_at(self.half_width);
        let (m, n) = (self.n_on_radius() as f64, self.n_on_ring() as f64);
        assert!(
            3.0 * m * m + self.rows_to(self.half_width) * rim.max(n) < 1e6,
            "over a million vertices: {self:?}"
        );
    }
}

/// The block, with its skin in the plane z = 0 facing +z and straight columns towards −z.
///
/// If edges inside the ring have constant length, ring i of m has 6 i vertices, so that triangles
/// are nearly equilateral. Outside, the distance between rings grows, and Delaunay triangulation
/// joins them. No edge crosses the ring.
///
/// # Panics
/// If lengths or levels do not make a body. (This function is for shapes written in code.)
pub fn graded_block(block: &GradedBlock, levels: &LevelStack) -> LayeredBody {
    block.check();
    let mut plan = Plan::default();
    let mut random = block.jitter.map(Random::new);
    plan.add_inner(block, random.as_mut());
    let rim = match block.outline {
        Outline::Disc => plan.add_outer_disc(block, random.as_mut()),
        Outline::Square => plan.add_outer_square(block, random.as_mut()),
    };
    let mut triangles = plan.triangulate();
    if block.outline == Outline::Square {
        for _ in 0..SMOOTHING {
            plan.smooth(&triangles, block);
            triangles = plan.triangulate();
        }
    }
    let skin = Surface {
        points: plan
            .points
            .iter()
            .map(|p| Vec3::new(p[0] + block.centre[0], p[1] + block.centre[1], 0.0))
            .collect(),
        triangles,
    };
    let cut_faces = cut_faces(block, &skin, rim);
    levels.below(skin, cut_faces)
}

/// Ratio of the circumradius of a regular polygon with `n` corners to the radius of a circle of the
/// same area.
fn equal_area(n: usize) -> f64 {
    let angle = TAU / n as f64;
    (angle / angle.sin()).sqrt()
}

/// The plane mesh under construction, centred on the origin.
#[derive(Debug, Default)]
struct Plan {
    points: Vec<[f64; 2]>,
    /// Whether smoothing may move a point. `[n_points]`
    is_free: Vec<bool>,
    /// Edges that the triangulation must contain.
    fixed_edges: Vec<[usize; 2]>,
}

impl Plan {
    fn push(&mut self, p: [f64; 2], is_free: bool) {
        self.points.push(p);
        self.is_free.push(is_free);
    }

    /// Adds `n` points at the radius, beginning at the angle `turn`. Returns the index of the
    /// first.
    fn ring(&mut self, n: usize, radius: f64, turn: f64, is_free: bool) -> usize {
        let first = self.points.len();
        for k in 0..n {
            let (sin, cos) = (turn + TAU * k as f64 / n as f64).sin_cos();
            self.push([radius * cos, radius * sin], is_free);
        }
        first
    }

    fn fix_loop(&mut self, first: usize, n: usize) {
        let edges = (0..n).map(|k| [first + k, first + (k + 1) % n]);
        self.fixed_edges.extend(edges);
    }

    fn jitter_from(&mut self, first: usize, spacing: f64, random: &mut Random) {
        for p in &mut self.points[first..] {
            *p = p.map(|x| x + JITTER * spacing * random.both_ways());
        }
    }

    /// Adds the middle and all rings up to the ring of the block.
    fn add_inner(&mut self, block: &GradedBlock, mut random: Option<&mut Random>) {
        self.push([0.0, 0.0], false);
        let h = block.spacing_at(0.0);
        for (k, (radius, n)) in block.inner_rings().into_iter().enumerate() {
            let turn = match random.as_mut() {
                Some(random) => random.both_ways(),
                // Rings of 6 i vertices fit without turning. Otherwise every second ring is turned
                // by half a step, as outside.
                None if block.inner_growth > 0.0 && k % 2 == 1 => 0.5 * TAU / n as f64,
                None => 0.0,
            };
            let first = self.ring(n, radius, turn, false);
            if let Some(random) = random.as_mut() {
                self.jitter_from(first, h, random);
            }
        }
        let n = block.n_on_ring();
        let scale = block.ring_radius.map_or(1.0, |_| equal_area(n));
        let first = self.ring(n, block.inner_radius() * scale, 0.0, false);
        self.fix_loop(first, n);
    }

    /// Adds a ring outside the ring of the block; smoothing may move it. Every second one is turned
    /// by half a step.
    fn add_outer_ring(
        &mut self,
        block: &GradedBlock,
        k: usize,
        r: f64,
        random: Option<&mut Random>,
    ) {
        let spacing = block.spacing_at(r);
        let n = ((TAU * r / spacing).round() as usize).max(6);
        let step = TAU / n as f64;
        let regular = if k % 2 == 1 { 0.5 * step } else { 0.0 };
        let Some(random) = random else {
            self.ring(n, r, regular, true);
            return;
        };
        let first = self.ring(n, r, step * random.both_ways(), true);
        self.jitter_from(first, spacing, random);
    }

    /// Adds the rings up to the rim, and the rim; returns the vertices of the rim.
    fn add_outer_disc(&mut self, block: &GradedBlock, mut random: Option<&mut Random>) -> Vec<u32> {
        let rows = block.rows_to(block.half_width);
        let n_rows = rows.round().max(1.0) as usize;
        for k in 1..n_rows {
            let r = block.radius_of(rows * k as f64 / n_rows as f64);
            self.add_outer_ring(block, k, r, random.as_deref_mut());
        }
        // An even number, so that the number of triangles is even and they can be paired.
        let n = 0.5 * TAU * block.half_width / block.spacing_at(block.half_width);
        let n = 2 * (n.round() as usize).max(4);
        let turn = if n_rows % 2 == 1 {
            0.5 * TAU / n as f64
        } else {
            0.0
        };
        let first = self.ring(n, block.half_width * equal_area(n), turn, false);
        self.fix_loop(first, n);
        (first..first + n).map(|v| v as u32).collect()
    }

    /// Adds the rings, cut off at the sides, and the sides. Returns the rim counter-clockwise, from
    /// the corner (−, −).
    fn add_outer_square(
        &mut self,
        block: &GradedBlock,
        mut random: Option<&mut Random>,
    ) -> Vec<u32> {
        let w = block.half_width;
        // The last row is the side itself, measured straight from the middle to the side.
        let to_side = block.rows_to(w);
        let n_rows = to_side.round().max(1.0);
        let mut k = 1;
        loop {
            let r = block.radius_of(to_side * k as f64 / n_rows);
            if r > w * std::f64::consts::SQRT_2 {
                break;
            }
            let first = self.points.len();
            self.add_outer_ring(block, k, r, random.as_deref_mut());
            let room = w - MARGIN * block.spacing_at(r);
            let mut at = first;
            for from in first..self.points.len() {
                let p = self.points[from];
                if p.iter().all(|x| x.abs() < room) {
                    self.points[at] = p;
                    at += 1;
                }
            }
            self.points.truncate(at);
            self.is_free.truncate(at);
            k += 1;
        }
        let side = side_points(block);
        let first = self.points.len();
        for quarter in 0..4 {
            for &x in &side {
                let p = [[x, -w], [w, x], [-x, w], [-w, -x]][quarter];
                self.push(p, false);
            }
        }
        let n = 4 * side.len();
        self.fix_loop(first, n);
        (first..first + n).map(|v| v as u32).collect()
    }

    /// The Delaunay triangulation that contains the fixed edges. Triangles are counter-clockwise
    /// and in a fixed order.
    fn triangulate(&self) -> Vec<[u32; 3]> {
        let points = self
            .points
            .iter()
            .map(|p| Point2::new(p[0], p[1]))
            .collect();
        let mesh =
            ConstrainedDelaunayTriangulation::<_>::bulk_load_cdt(points, self.fixed_edges.clone())
                .expect("coordinates are finite");
        assert_eq!(
            mesh.num_vertices(),
            self.points.len(),
            "no two points coincide"
        );
        let mut triangles: Vec<[u32; 3]> = mesh
            .inner_faces()
            .map(|face| {
                let mut corners = face.vertices().map(|v| v.index() as u32);
                let smallest = (0..3).min_by_key(|&k| corners[k]).unwrap_or(0);
                corners.rotate_left(smallest);
                corners
            })
            .collect();
        triangles.sort_unstable();
        triangles
    }

    /// Moves the free points towards the mean of their neighbours, because rings cut off by a side
    /// leave gaps.
    fn smooth(&mut self, triangles: &[[u32; 3]], block: &GradedBlock) {
        let mut sums = vec![[0.0_f64; 3]; self.points.len()];
        for t in triangles {
            for k in 0..3 {
                let (from, to) = (t[k] as usize, t[(k + 1) % 3] as usize);
                let p = self.points[from];
                let sum = &mut sums[to];
                *sum = [sum[0] + p[0], sum[1] + p[1], sum[2] + 1.0];
            }
        }
        for (v, [x, y, n]) in sums.into_iter().enumerate() {
            let p = &mut self.points[v];
            // Only near the sides; elsewhere the rings are in their right places.
            let reach = 1.5 * block.spacing_at(p[0].hypot(p[1]));
            let is_near_side = p.iter().any(|c| c.abs() > block.half_width - reach);
            if self.is_free[v] && is_near_side {
                *p = [0.5 * (p[0] + x / n), 0.5 * (p[1] + y / n)];
            }
        }
    }
}

/// Coordinates of the vertices along a side, from its first corner, without its last.
fn side_points(block: &GradedBlock) -> Vec<f64> {
    let w = block.half_width;
    // Number of edges up to each point, integrated in small steps along half the side. The middle
    // of the side is always a vertex.
    let n_steps = 2000;
    let step = w / n_steps as f64;
    let mut count = vec![0.0];
    for i in 0..n_steps {
        let x = -w + (i as f64 + 0.5) * step;
        count.push(count[i] + step / block.spacing_at(x.hypot(w)));
    }
    let total = count[n_steps];
    let n = total.round().max(1.0) as usize;
    let mut half = vec![-w];
    for k in 1..n {
        let wanted = total * k as f64 / n as f64;
        let i = count.partition_point(|&c| c < wanted) - 1;
        let share = (wanted - count[i]) / (count[i + 1] - count[i]);
        half.push(-w + (i as f64 + share) * step);
    }
    let mirrored: Vec<f64> = half[1..].iter().rev().map(|x| -x).collect();
    half.push(0.0);
    half.extend(mirrored);
    half
}

fn cut_faces(block: &GradedBlock, skin: &Surface, rim: Vec<u32>) -> Vec<CutFace> {
    let centre = Vec3::new(block.centre[0], block.centre[1], 0.0);
    if block.outline == Outline::Disc {
        return vec![CutFace {
            vertices: rim,
            normal: Vec3::zeros(),
            point: centre,
            is_flat: false,
        }];
    }
    let n = rim.len() / 4;
    let face = |quarter: usize| {
        let (sin, cos) = (quarter as f64 * FRAC_PI_2 - FRAC_PI_2).sin_cos();
        let normal = Vec3::new(cos.round(), sin.round(), 0.0);
        let mut vertices: Vec<u32> = rim[quarter * n..(quarter + 1) * n].to_vec();
        vertices.push(rim[(quarter + 1) * n % rim.len()]);
        CutFace {
            point: skin.points[vertices[0] as usize],
            vertices,
            normal,
            is_flat: true,
        }
    };
    [3, 1, 0, 2].map(face).to_vec()
}
