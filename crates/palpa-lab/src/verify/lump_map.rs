//! A hard ball in a soft block, with a small pressure that moves across the block (A4).

#![expect(
    clippy::float_cmp,
    reason = "numbers of a table are compared as they stand there"
)]

use palpa_fem::law::Linear;
use palpa_fem::lump::{Lump, LumpShape};
use palpa_fem::shape::{Pose, Sphere};
use palpa_fem::{Load, Material, Materials, Supports};
use palpa_mesh::generate::{Diagonal, Grid, LevelStack, mapped_grid};
use palpa_mesh::{LayeredBody, Vec3};

use crate::verify::press::Pressed;
use crate::verify::table::Table;
use crate::verify::tolerance::{LUMP, LUMP_LEAST};
use crate::verify::{Findings, Options, Row, StudyPoint, VerifyError};

const CASE: &str = "A4";
/// Edges per radius of a ball.
const PER_RADIUS: f64 = 4.0;
/// Edge length under pressures, m.
const LOAD_EDGE: f64 = 1.75e-3;
/// Edge lengths of the meshes in the error study, relative to the mesh of the quoted results.
const STUDIED: [f64; 4] = [2.0, 1.5, 1.0, 0.75];
/// The ball of the error study, used at all offsets.
const STUDIED_BALL: Ball = Ball {
    depth: 0.014,
    radius: 0.008,
};
const HALF_WIDTH: f64 = 0.05;
const THICKNESS: f64 = 0.04;
/// Growth of the edge length per metre of distance from a fine region.
const GROWTH: f64 = 0.5;
/// Largest offset at which a ball still adds enough stiffness to be compared, m.
const FARTHEST: f64 = 0.016;

/// A fine region, m: edges have the length `h` between `from` and `to`, and lengthen by [`GROWTH`]
/// per metre outside.
#[derive(Clone, Copy)]
struct Fine {
    from: f64,
    to: f64,
    h: f64,
}

/// Points from `from` to `to`; the finest request holds everywhere.
fn graded(from: f64, to: f64, fine: &[Fine]) -> Vec<f64> {
    let edge = |x: f64| {
        fine.iter()
            .map(|f| f.h + GROWTH * (f.from - x).max(x - f.to).max(0.0))
            .fold(f64::INFINITY, f64::min)
    };
    // Integrate the number of edges with a fine step.
    let n_steps = 4000;
    let step = (to - from) / f64::from(n_steps);
    let mut count = vec![0.0];
    for i in 0..n_steps {
        let x = from + (f64::from(i) + 0.5) * step;
        count.push(count[count.len() - 1] + step / edge(x));
    }
    let total = count[count.len() - 1];
    let n = total.round().max(1.0) as usize;
    let mut points: Vec<f64> = (0..=n)
        .map(|k| {
            let wanted = total * k as f64 / n as f64;
            let i = count
                .partition_point(|&c| c < wanted)
                .clamp(1, count.len() - 1)
                - 1;
            let share = (wanted - count[i]) / (count[i + 1] - count[i]);
            from + (i as f64 + share) * step
        })
        .collect();
    // Set exactly, because rounding moves the end points slightly.
    (points[0], points[n]) = (from, to);
    points
}

/// Half of the block, y ≥ 0, fine under the pressures and round the ball. `size` scales the edge
/// length; 1 is the mesh of the quoted results.
fn body(ball: &Ball, size: f64) -> LayeredBody {
    let Ball {
        depth: z,
        radius: r,
    } = *ball;
    let h = size * LOAD_EDGE;
    let n = PER_RADIUS / size;
    let ball = |middle: f64| Fine {
        from: middle - r,
        to: middle + r,
        h: (r / n).min(h),
    };
    let load = |from: f64, to: f64| Fine { from, to, h };
    let xs = graded(
        -HALF_WIDTH,
        HALF_WIDTH,
        &[ball(0.0), load(-0.005, FARTHEST + 0.005)],
    );
    let ys = graded(0.0, HALF_WIDTH, &[ball(0.0), load(0.0, 0.005)]);
    let depths = graded(0.0, THICKNESS, &[ball(z), load(0.0, 0.0)]);
    let levels = LevelStack {
        interval_layer: vec![0; depths.len() - 1],
        depths,
    };
    let grid = Grid {
        n_cells: [xs.len() - 1, ys.len() - 1],
        diagonal: Diagonal::Alternate,
        jitter: None,
    };
    let at = |points: &[f64], u: f64| points[(u * (points.len() - 1) as f64).round() as usize];
    mapped_grid(
        &grid,
        |u, v| Vec3::new(at(&xs, u), at(&ys, v), 0.0),
        &levels,
    )
}

/// Nodal forces with a sum of 1 N (on the whole block) for the pressure 2/(πa²) (1 − ρ²/a²) round
/// (x, 0).
fn pressure(body: &LayeredBody, x: f64, a: f64) -> Vec<Vec3> {
    /// Number of small triangles along each side of a triangle, for the integration.
    const N: usize = 12;
    let mut forces = vec![Vec3::zeros(); body.n_nodes()];
    for triangle in &body.skin.triangles {
        let [p, q, r] = triangle.map(|v| body.skin.points[v as usize] - Vec3::x() * x);
        let reach = (q - p).norm().max((r - p).norm());
        if p.norm() > a + reach {
            continue;
        }
        let area = 0.5 * (q - p).cross(&(r - p)).norm() / (N * N) as f64;
        for i in 0..N {
            for j in 0..N - i {
                for turned in 0..2 {
                    if turned == 1 && i + j + 1 == N {
                        continue;
                    }
                    let third = f64::from(1 + turned) / 3.0;
                    let (s, t) = ((i as f64 + third) / N as f64, (j as f64 + third) / N as f64);
                    let at = p * (1.0 - s - t) + q * s + r * t;
                    let load = area * (1.0 - at.norm_squared() / (a * a)).max(0.0);
                    for (&v, share) in triangle.iter().zip([1.0 - s - t, s, t]) {
                        forces[body.node(v as usize, 0)].z -= load * share;
                    }
                }
            }
        }
    }
    let total: f64 = forces.iter().map(|f| -2.0 * f.z).sum();
    forces.iter().map(|f| f / total).collect()
}

/// Force divided by the pressure-weighted displacement below it, N/m.
fn stiffness(pressed: &mut Pressed, forces: &[Vec3]) -> Result<f64, VerifyError> {
    let load = Load {
        forces,
        ..Load::default()
    };
    pressed.step(&load, "pressure on the block")?;
    let work: f64 = forces
        .iter()
        .zip(&pressed.state.displacements)
        .map(|(force, u)| force.dot(u))
        .sum();
    Ok(1.0 / (2.0 * work))
}

/// A ball: depth of its middle and radius, m.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Ball {
    depth: f64,
    radius: f64,
}

/// Young's moduli of block and ball, Pa, and Poisson's ratio of both.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Moduli {
    soft: f64,
    hard: f64,
    nu: f64,
}

/// The half block on its base and plane of symmetry, with the ball and without.
struct Blocks {
    ball: Ball,
    body: LayeredBody,
    with: Pressed,
    without: Pressed,
}

impl Blocks {
    fn new(ball: Ball, moduli: &Moduli, size: f64) -> Result<Self, VerifyError> {
        let body = body(&ball, size);
        let mut supports = Supports::on_base(&body);
        // The faces are in the order −x, +x, y = 0, +y.
        let symmetry = &body.cut_faces[2];
        for &v in &symmetry.vertices {
            let nodes = (0..body.n_levels).map(|l| body.node(v as usize, l));
            supports
                .planes
                .extend(nodes.map(|node| (node, symmetry.normal)));
        }
        let material = |name: &str, young: f64| {
            let law = Linear::from_young(young, moduli.nu).expect("valid constants");
            Material::new(name, law)
        };
        let mut materials = Materials::of_layers(vec![material("soft", moduli.soft)]);
        let without = Pressed::new(&body, &materials, &supports)?;
        materials.materials.push(material("hard", moduli.hard));
        let shape = LumpShape::Sphere(Sphere::new(ball.radius).expect("valid size"));
        let pose = Pose::translation(0.0, 0.0, -ball.depth);
        materials
            .lumps
            .push(Lump::new(shape, pose, 0.0, 1).expect("a valid lump"));
        let with = Pressed::new(&body, &materials, &supports)?;
        Ok(Self {
            ball,
            body,
            with,
            without,
        })
    }

    /// Stiffness of the block with the ball relative to without it, under a pressure over the
    /// radius `a`, m, round (x, 0).
    fn ratio(&mut self, x: f64, a: f64) -> Result<f64, VerifyError> {
        let forces = pressure(&self.body, x, a);
        Ok(stiffness(&mut self.with, &forces)? / stiffness(&mut self.without, &forces)?)
    }
}

pub(crate) fn run(options: &Options) -> Result<Findings, VerifyError> {
    let columns = [
        "depth_centre_m",
        "lump_radius_m",
        "load_radius_m",
        "E_soft_Pa",
        "E_lump_Pa",
        "nu",
        "x_offset_m",
        "ratio",
    ];
    let table = Table::read(options, "A4_lump_map.csv", &columns)?;
    let mut findings = Findings::default();
    for size in STUDIED {
        let mut blocks: Option<Blocks> = None;
        for row in 0..table.len() {
            let [depth, radius, a, soft, hard, nu, x, reference] =
                columns.map(|column| table.number(row, column));
            let ball = Ball { depth, radius };
            let is_studied = ball == STUDIED_BALL;
            // Smaller contributions of a ball are not compared.
            if reference - 1.0 < LUMP_LEAST || (size != 1.0 && !is_studied) {
                continue;
            }
            let blocks = match &mut blocks {
                Some(blocks) if blocks.ball == ball => blocks,
                other => other.insert(Blocks::new(ball, &Moduli { soft, hard, nu }, size)?),
            };
            let ratio = blocks.ratio(x, a)?;
            let nodes = blocks.with.nodes();
            let error = (ratio - 1.0) / (reference - 1.0) - 1.0;
            let name = format!(
                "ball of {} mm {} mm deep, pressure {} mm beside",
                radius * 1e3,
                depth * 1e3,
                x * 1e3
            );
            if is_studied {
                findings.study.push(StudyPoint {
                    case: CASE,
                    series: name.clone(),
                    h: size,
                    nodes,
                    error,
                });
            }
            if size == 1.0 {
                findings.rows.push(Row::with_error(
                    CASE,
                    format!("{name}: stiffness over that without (error of what it adds)"),
                    [reference, ratio],
                    error,
                    LUMP,
                    nodes,
                ));
            }
        }
    }
    Ok(findings)
}
