//! A hard ball in a soft block under a small pressure that moves across it (A4).

use palpa_fem::law::Linear;
use palpa_fem::lump::{Lump, LumpShape};
use palpa_fem::shape::{Pose, Sphere};
use palpa_fem::{Load, Material, Materials, Supports};
use palpa_mesh::generate::{Diagonal, Grid, LevelStack, mapped_grid};
use palpa_mesh::{LayeredBody, Vec3};

use crate::press::Pressed;
use crate::table::Table;
use crate::tolerance::{LUMP, LUMP_LEAST};
use crate::{Findings, Options, Row, StudyPoint, VerifyError};

const CASE: &str = "A4";
const HALF_WIDTH: f64 = 0.05;
const THICKNESS: f64 = 0.04;
/// By how much edges lengthen per metre from where they are fine.
const GROWTH: f64 = 0.5;
/// Farthest offset at which a ball still adds as much as is compared, m.
const FARTHEST: f64 = 0.016;

/// Edges of `h` from `from` to `to`, and lengthening by [`GROWTH`] per metre away from there. m
#[derive(Clone, Copy)]
struct Fine {
    from: f64,
    to: f64,
    h: f64,
}

/// Points from `from` to `to`, as fine as the finest asks for.
fn graded(from: f64, to: f64, fine: &[Fine]) -> Vec<f64> {
    let edge = |x: f64| {
        fine.iter()
            .map(|f| f.h + GROWTH * (f.from - x).max(x - f.to).max(0.0))
            .fold(f64::INFINITY, f64::min)
    };
    // Edges per length, summed finely.
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
            let i = count.partition_point(|&c| c < wanted).clamp(1, count.len() - 1) - 1;
            let share = (wanted - count[i]) / (count[i + 1] - count[i]);
            from + (i as f64 + share) * step
        })
        .collect();
    // But for rounding they are.
    (points[0], points[n]) = (from, to);
    points
}

/// Half of the block, y ≥ 0, fine where pressures and a ball of radius `r` at depth `z` are.
fn body(h: f64, [z, r]: [f64; 2]) -> LayeredBody {
    let n: f64 = std::env::var("NB").map_or(5.0, |s| s.parse().unwrap());
    let ball = |middle: f64| Fine {
        from: middle - r,
        to: middle + r,
        h: (r / n).min(h),
    };
    let load = |from: f64, to: f64| Fine { from, to, h };
    let xs = graded(-HALF_WIDTH, HALF_WIDTH, &[ball(0.0), load(-0.005, FARTHEST + 0.005)]);
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
    mapped_grid(&grid, |u, v| Vec3::new(at(&xs, u), at(&ys, v), 0.0), &levels)
}

/// Forces of 1 N (on the whole block) under the pressure 2/(πa²) (1 − ρ²/a²) round (x, 0).
fn pressure(body: &LayeredBody, x: f64, a: f64) -> Vec<Vec3> {
    /// Small triangles along each side of a triangle.
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
                    let third = (1 + turned) as f64 / 3.0;
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

/// The block's half on its base and plane of symmetry, with or without a ball.
fn block(body: &LayeredBody, materials: &Materials) -> Result<Pressed, VerifyError> {
    let mut supports = Supports::on_base(body);
    let symmetry = &body.cut_faces[2];
    for &v in &symmetry.vertices {
        let nodes = (0..body.n_levels).map(|l| body.node(v as usize, l));
        supports.planes.extend(nodes.map(|node| (node, symmetry.normal)));
    }
    Pressed::new(body, materials, &supports)
}

/// Force over the displacement below it, weighted by the pressure, N/m.
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

pub(crate) fn run(options: &Options) -> Result<Findings, VerifyError> {
    let columns = ["depth_centre_m", "lump_radius_m", "load_radius_m", "E_soft_Pa", "E_lump_Pa", "nu", "x_offset_m", "ratio", "ndof"];
    let table = Table::read(options, "A4_lump_map.csv", &columns)?;
    let mut findings = Findings::default();
    let h: f64 = std::env::var("H").map_or(2e-3, |s| s.parse::<f64>().unwrap()*1e-3);
    let mut last = [0.0; 2];
    let mut n = 0;
    let mut state: Option<(LayeredBody, Pressed, Pressed)> = None;
    for row in 0..table.len() {
        let [depth, radius, a, soft, hard, nu, x, ratio, _] = columns.map(|c| table.number(row, c));
        if ratio - 1.0 < LUMP_LEAST { continue; }
        let t = std::time::Instant::now();
        if last != [depth, radius] {
            last = [depth, radius];
            let body = body(h, [depth, radius]);
            let material = |young: f64| Material::new("x", Linear::from_young(young, nu).unwrap());
            let make = |with: bool| {
                let mut materials = Materials { materials: vec![material(soft), material(hard)], layers: vec![0], ..Materials::default() };
                if with {
                    let shape = LumpShape::Sphere(Sphere::new(radius).unwrap());
                    materials.lumps.push(Lump::new(shape, Pose::translation(0.0, 0.0, -depth - if std::env::var("TIP").is_ok() {radius} else {0.0}), 0.0, 1).unwrap());
                }
                block(&body, &materials)
            };
            let (with, without) = (make(true)?, make(false)?);
            state = Some((body, with, without));
        }
        let (body, with, without) = state.as_mut().unwrap();
        let forces = pressure(body, x, a);
        let (k, k0) = (stiffness(with, &forces)?, stiffness(without, &forces)?);
        let error = (k / k0 - 1.0) / (ratio - 1.0) - 1.0;
        println!("{} x {} {depth} {radius} {x}: k0 {k0:.3} ref {ratio:.5} ours {:.5} error {:+.2}% nodes {} {:?}", body.n_vertices(), body.n_levels, k / k0, 100.0 * error, with.nodes(), t.elapsed());
        n += 1;
    }
    let _ = (Row::ratio(CASE, "", 1.0, 1.0, LUMP, n), StudyPoint { case: CASE, series: String::new(), h, nodes: 0, error: 0.0 });
    Ok(findings)
}
