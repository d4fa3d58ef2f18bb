//! A sixth or a half of a round body or an eighth of a square one, between planes of symmetry.
//!
//! ```text
//!            .·'\           rings of vertices about the corner; the one round the inner disc is a polygon with the
//!        .·'  /\ \          *area* of its circle
//!    .·' \  /  _\ \
//!   o─────┴──'────+--      base fixed, rim free, both straight sides planes of symmetry
//! ```

use std::f64::consts::TAU;

use palpa_fem::Supports;
use palpa_mesh::{CutFace, LayeredBody, Surface, Vec3};

/// The body that a sector is cut from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outline {
    /// A disc: a sixth of it.
    Round,
    /// A disc: a half of it, for tools that move along x.
    Half,
    /// A square: an eighth of it, from the middle of a side to a corner.
    Square,
}

impl Outline {
    /// Number of sectors in a full turn.
    pub(crate) fn n_sectors(self) -> f64 {
        match self {
            Self::Round => 6.0,
            Self::Half => 2.0,
            Self::Square => 8.0,
        }
    }

    fn angle(self) -> f64 {
        TAU / self.n_sectors()
    }
}

/// The region of the disc with the finest edges.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Finest {
    /// At its rim, where a punch has its edge.
    Rim,
    /// The whole disc, for a contact whose edge lies inside it.
    Inside,
    /// The disc and some radii around it, for displacements there.
    Around,
}

impl Finest {
    /// Distance over which edges begin to lengthen outside the finest region, in radii of the disc.
    fn reach(self) -> f64 {
        match self {
            Self::Rim => 0.5,
            Self::Inside => 1.0,
            Self::Around => 2.0,
        }
    }
}

/// A sector of a stack of layers on a rigid base.
pub(crate) struct Sector {
    pub(crate) body: LayeredBody,
    pub(crate) supports: Supports,
    /// Radius of the inner disc, m.
    pub(crate) ring: f64,
    /// Vertices of the inner disc, ascending.
    pub(crate) patch: Vec<u32>,
}

impl Sector {
    /// A sector with an inner disc of radius `ring`, m, and layers of the given thicknesses, m.
    /// Edges at the rim of the disc are about `ring/n` long. `width` is the radius of the whole
    /// body or half the side of the square, m.
    pub(crate) fn new(
        outline: Outline,
        ring: f64,
        n: usize,
        finest: Finest,
        width: f64,
        thicknesses: &[f64],
    ) -> Self {
        let h = ring / n as f64;
        let mut skin = Surface {
            points: vec![Vec3::zeros()],
            triangles: Vec::new(),
        };
        let angle = outline.angle();
        // A full ring has six edges per edge length of its radius, so that rings with equal steps
        // form a lattice of equilateral triangles.
        let edges = |r: f64, h: f64| (6.0 / outline.n_sectors() * r / h).round() as usize;
        let on_rim = edges(ring, h);
        let step = angle / on_rim as f64;
        let equal_area = (step / step.sin()).sqrt();
        let mut inner = Ring { first: 0, n: 0 };
        let grading = Grading {
            h,
            reach: finest.reach() * ring,
        };
        let edges_at = |r: f64| edges(r, grading.spacing((r - ring).abs()));
        let inside = match finest {
            Finest::Rim => grading.divide(0.0, ring, 1),
            Finest::Inside | Finest::Around => (0..=n).map(|i| i as f64 * h).collect(),
        };
        for x in inside[1..inside.len() - 1].iter().rev() {
            let r = ring - x;
            let n = match finest {
                Finest::Rim => edges_at(r),
                Finest::Inside | Finest::Around => edges(r, h),
            };
            inner = add_ring(&mut skin, inner, n.max(1), angle, |_| r);
        }
        inner = add_ring(&mut skin, inner, on_rim, angle, |_| ring * equal_area);
        let patch = (0..skin.points.len() as u32).collect();
        for x in &grading.divide(0.0, width - ring, 1)[1..] {
            let share = x / (width - ring);
            let radius = |angle: f64| match outline {
                Outline::Round | Outline::Half => ring + x,
                Outline::Square => ring + share * (width / angle.cos() - ring),
            };
            inner = add_ring(&mut skin, inner, edges_at(ring + x).max(3), angle, radius);
        }
        let mut depths = vec![0.0];
        let mut interval_layer = Vec::new();
        for (layer, thickness) in thicknesses.iter().enumerate() {
            let top = depths[depths.len() - 1];
            let least = n.div_ceil(4);
            let levels = grading.divide(top, top + thickness, least);
            interval_layer.extend(std::iter::repeat_n(layer, levels.len() - 1));
            depths.extend(&levels[1..]);
        }
        let body = LayeredBody {
            positions: skin
                .points
                .iter()
                .flat_map(|p| depths.iter().map(move |depth| p - Vec3::z() * *depth))
                .collect(),
            n_levels: depths.len(),
            interval_layer,
            layer_names: (1..=thicknesses.len())
                .map(|l| format!("layer {l}"))
                .collect(),
            cut_faces: sides(&skin, outline),
            skin,
        };
        let mut supports = Supports::on_base(&body);
        for side in &body.cut_faces {
            for &v in &side.vertices {
                let nodes = (0..body.n_levels).map(|l| body.node(v as usize, l));
                supports
                    .planes
                    .extend(nodes.map(|node| (node, side.normal)));
            }
        }
        Self {
            body,
            supports,
            ring,
            patch,
        }
    }
}

/// Edges that lengthen with the distance x from the load as `h (1 + x/x₀)^(4/3)`. As the field of
/// the load decays, this puts vertices where they reduce the error most.
struct Grading {
    h: f64,
    reach: f64,
}

impl Grading {
    fn spacing(&self, x: f64) -> f64 {
        self.h * (1.0 + x / self.reach).powf(4.0 / 3.0)
    }

    /// Number of edges from 0 to x.
    fn count(&self, x: f64) -> f64 {
        3.0 * self.reach / self.h * (1.0 - (1.0 + x / self.reach).powf(-1.0 / 3.0))
    }

    /// Inverse of `count`.
    fn position(&self, count: f64) -> f64 {
        self.reach * ((1.0 - count * self.h / (3.0 * self.reach)).powi(-3) - 1.0)
    }

    /// Divides an interval into at least `least` edges. Returns the points, both ends included.
    fn divide(&self, from: f64, to: f64, least: usize) -> Vec<f64> {
        let (a, b) = (self.count(from), self.count(to));
        let n = ((b - a).round() as usize).max(least);
        let mut at: Vec<f64> = (0..=n)
            .map(|i| self.position(a + (b - a) * i as f64 / n as f64))
            .collect();
        // Set exactly, because rounding moves the end points slightly.
        (at[0], at[n]) = (from, to);
        at
    }
}

#[derive(Clone, Copy)]
struct Ring {
    first: usize,
    /// Number of edges.
    n: usize,
}

/// Adds an arc of `n` edges and a radius for every angle, and the triangles between it and the one
/// inside.
fn add_ring(
    skin: &mut Surface,
    inner: Ring,
    n: usize,
    angle: f64,
    radius: impl Fn(f64) -> f64,
) -> Ring {
    let outer = Ring {
        first: skin.points.len(),
        n,
    };
    for k in 0..=n {
        let at = angle * k as f64 / n as f64;
        let (sin, cos) = at.sin_cos();
        skin.points.push(Vec3::new(cos, sin, 0.0) * radius(at));
    }
    let (mut i, mut j) = (0, 0);
    while i < inner.n || j < n {
        let [a, b] = [inner.first + i, outer.first + j].map(|v| v as u32);
        // Of the next inner and outer edge, the one that ends first is used; the outer one if both
        // end at the same angle.
        if i == inner.n || (j < n && (j + 1) * inner.n <= (i + 1) * n) {
            skin.triangles.push([a, b, b + 1]);
            j += 1;
        } else {
            skin.triangles.push([a, b, a + 1]);
            i += 1;
        }
    }
    outer
}

/// The straight sides, as cut faces: two, or the one of a half.
fn sides(skin: &Surface, outline: Outline) -> Vec<CutFace> {
    let angles: &[f64] = match outline {
        Outline::Half => &[0.0],
        Outline::Round | Outline::Square => &[0.0, outline.angle()],
    };
    (angles.iter())
        .map(|&angle| {
            let (sin, cos) = angle.sin_cos();
            let along = Vec3::new(cos, sin, 0.0);
            let vertices = (0..skin.points.len() as u32).filter(|&v| {
                let p = skin.points[v as usize];
                (p - along * along.dot(&p)).norm() <= 1e-9 * p.norm()
            });
            let out = if angle == 0.0 { -1.0 } else { 1.0 };
            CutFace {
                vertices: vertices.collect(),
                normal: Vec3::new(-sin, cos, 0.0) * out,
                point: Vec3::zeros(),
                is_flat: true,
            }
        })
        .collect()
}
