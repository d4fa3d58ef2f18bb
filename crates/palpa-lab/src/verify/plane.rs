//! Plane strain at Poisson's ratio 0.4999: Lamé's thick cylinder and Cook's membrane.

use palpa_fem::law::Linear;
use palpa_fem::{Load, Material, Materials, Supports};
use palpa_mesh::generate::{Diagonal, Grid, LevelStack, mapped_grid};
use palpa_mesh::{LayeredBody, Vec3};

use crate::verify::press::Pressed;
use crate::verify::tolerance::NEARLY_INCOMPRESSIBLE;
use crate::verify::{Findings, Options, Row, StudyPoint, VerifyError};

/// Displacement of the upper right corner of Cook's membrane. Our own Q2-Q1 meshes of 8 to 64
/// elements per side tend to 7.77; 7.769 is the value usually quoted.
const COOK: f64 = 7.769;
const COOK_YOUNG: f64 = 250.0;
const COOK_TRACTION: f64 = 6.25;
const POISSON: f64 = 0.4999;

fn one_interval(thickness: f64) -> LevelStack {
    LevelStack {
        depths: vec![0.0, thickness],
        interval_layer: vec![0],
    }
}

/// All nodes slide in planes z = const: plane strain in (x, y).
fn plane_strain(body: &LayeredBody) -> Supports {
    Supports {
        fixed: Vec::new(),
        planes: (0..body.n_nodes()).map(|n| (n, Vec3::z())).collect(),
    }
}

fn slide_in(supports: &mut Supports, body: &LayeredBody, face: usize, normal: Vec3) {
    for &v in &body.cut_faces[face].vertices {
        for l in 0..body.n_levels {
            supports.planes.push((body.node(v as usize, l), normal));
        }
    }
}

/// Nodal forces of a traction on a cut face; `traction` gets the two ends of an edge.
fn face_forces(
    body: &LayeredBody,
    face: usize,
    traction: impl Fn(&Vec3, &Vec3) -> Vec3,
) -> Vec<Vec3> {
    let mut forces = vec![Vec3::zeros(); body.n_nodes()];
    let rim = &body.cut_faces[face].vertices;
    for pair in rim.windows(2) {
        for l in 0..body.n_levels - 1 {
            let nodes = pair
                .iter()
                .flat_map(|&v| [body.node(v as usize, l), body.node(v as usize, l + 1)]);
            let nodes: Vec<usize> = nodes.collect();
            let p: Vec<Vec3> = nodes.iter().map(|&n| body.positions[n]).collect();
            let area = 0.5 * (p[3] - p[0]).cross(&(p[2] - p[1])).norm();
            let share = traction(&p[0], &p[2]) * (area / 4.0);
            for node in nodes {
                forces[node] += share;
            }
        }
    }
    forces
}

fn linear(young: f64) -> Vec<Material> {
    let law = Linear::from_young(young, POISSON).expect("valid constants");
    vec![Material::new("linear", law)]
}

fn solve(
    body: &LayeredBody,
    young: f64,
    supports: &Supports,
    forces: &[Vec3],
    what: &str,
) -> Result<Pressed, VerifyError> {
    let mut pressed = Pressed::new(body, &Materials::of_layers(linear(young)), supports)?;
    let load = Load {
        forces,
        ..Load::default()
    };
    pressed.step(&load, what)?;
    Ok(pressed)
}

/// A quarter of a tube with radii 12 and 35 mm, under 1 kPa from inside.
pub(crate) fn lame(_: &Options) -> Result<Findings, VerifyError> {
    const CASE: &str = "lame";
    let (young, a, b, p) = (30e3, 0.012, 0.035, 1e3);
    let exact = |r: f64| {
        (1.0 + POISSON) / young * p * a * a / (b * b - a * a)
            * ((1.0 - 2.0 * POISSON) * r + b * b / r)
    };
    let mut findings = Findings::default();
    for (mesh, diagonal, jitter) in [
        ("regular", Diagonal::Alternate, None),
        ("irregular", Diagonal::Random(2), Some(3)),
    ] {
        for n in [4, 8, 16, 32] {
            let grid = Grid {
                n_cells: [n, n],
                diagonal,
                jitter,
            };
            let map = |u: f64, v: f64| {
                let (r, angle) = (a * (b / a).powf(u), v * std::f64::consts::FRAC_PI_2);
                Vec3::new(r * angle.cos(), r * angle.sin(), 0.0)
            };
            let body = mapped_grid(&grid, map, &one_interval(2e-3));
            let mut supports = plane_strain(&body);
            slide_in(&mut supports, &body, 2, Vec3::y());
            slide_in(&mut supports, &body, 3, Vec3::x());
            let forces = face_forces(&body, 0, |x, y| (x + y).xy().push(0.0).normalize() * p);
            let pressed = solve(&body, young, &supports, &forces, "thick cylinder")?;
            for face in [0, 1] {
                let rim = &body.cut_faces[face].vertices;
                let radius = [a, b][face];
                let mean = rim
                    .iter()
                    .map(|&v| {
                        let node = body.node(v as usize, 0);
                        let x = body.positions[node];
                        pressed.state.displacements[node].dot(&x) / x.norm()
                    })
                    .sum::<f64>()
                    / rim.len() as f64;
                let error = mean / exact(radius) - 1.0;
                findings.study.push(StudyPoint {
                    case: CASE,
                    series: format!("{mesh}, r {:.0} mm", radius * 1e3),
                    h: 1.0 / n as f64,
                    nodes: pressed.nodes(),
                    error,
                });
                if n == 32 {
                    findings.rows.push(Row::ratio(
                        CASE,
                        format!("{mesh}: displacement at r = {:.0} mm, m", radius * 1e3),
                        exact(radius),
                        mean,
                        NEARLY_INCOMPRESSIBLE,
                        pressed.nodes(),
                    ));
                }
            }
        }
    }
    Ok(findings)
}

/// The trapezoid (0, 0) (48, 44) (48, 60) (0, 44), clamped on the left, sheared on the right.
pub(crate) fn cook(_: &Options) -> Result<Findings, VerifyError> {
    const CASE: &str = "cook";
    let mut findings = Findings::default();
    for (orientation, in_plane) in [
        ("triangles in the plane", true),
        ("extrusion in the plane", false),
    ] {
        for n in [4, 8, 16, 32] {
            let (body, supports, up) = if in_plane {
                cook_in_plane(n)
            } else {
                cook_across(n)
            };
            let forces = face_forces(&body, 1, |_, _| up * COOK_TRACTION);
            let pressed = solve(&body, COOK_YOUNG, &supports, &forces, "Cook's membrane")?;
            let corner = (0..body.n_nodes())
                .max_by(|&x, &y| {
                    let height = |n: usize| body.positions[n].dot(&up);
                    height(x).total_cmp(&height(y))
                })
                .unwrap_or(0);
            let deflection = pressed.state.displacements[corner].dot(&up);
            findings.study.push(StudyPoint {
                case: CASE,
                series: orientation.to_owned(),
                h: 1.0 / n as f64,
                nodes: pressed.nodes(),
                error: deflection / COOK - 1.0,
            });
            if n == 32 {
                findings.rows.push(Row::ratio(
                    CASE,
                    format!("{orientation}: deflection of the upper right corner"),
                    COOK,
                    deflection,
                    NEARLY_INCOMPRESSIBLE,
                    pressed.nodes(),
                ));
            }
        }
    }
    Ok(findings)
}

fn clamp_left(body: &LayeredBody, supports: &mut Supports) {
    for &v in &body.cut_faces[0].vertices {
        for l in 0..body.n_levels {
            supports.fixed.push(body.node(v as usize, l));
        }
    }
}

fn cook_in_plane(n: usize) -> (LayeredBody, Supports, Vec3) {
    let grid = Grid {
        n_cells: [n, n],
        diagonal: Diagonal::Alternate,
        jitter: None,
    };
    let map = |u: f64, v: f64| {
        let (low, high) = (44.0 * u, 44.0 + 16.0 * u);
        Vec3::new(48.0 * u, low + (high - low) * v, 0.0)
    };
    let body = mapped_grid(&grid, map, &one_interval(1.0));
    let mut supports = plane_strain(&body);
    clamp_left(&body, &mut supports);
    (body, supports, Vec3::y())
}

/// A mesh of the membrane whose upper side is the skin, one cell wide; the levels go down through
/// it.
fn cook_across(n: usize) -> (LayeredBody, Supports, Vec3) {
    let grid = Grid {
        n_cells: [n, 1],
        diagonal: Diagonal::Alternate,
        jitter: None,
    };
    let width = 48.0 / n as f64;
    let levels = LevelStack {
        depths: (0..=n).map(|l| l as f64).collect(),
        interval_layer: vec![0; n],
    };
    let map = |u: f64, v: f64| Vec3::new(48.0 * u, width * v, 0.0);
    let mut body = mapped_grid(&grid, map, &levels);
    for v in 0..body.n_vertices() {
        for l in 0..=n {
            let node = body.node(v, l);
            let u = body.positions[node].x / 48.0;
            let (low, high) = (44.0 * u, 44.0 + 16.0 * u);
            body.positions[node].z = high + (low - high) * l as f64 / n as f64;
        }
        body.skin.points[v] = body.positions[body.node(v, 0)];
    }
    let mut supports = Supports {
        fixed: Vec::new(),
        planes: (0..body.n_nodes()).map(|node| (node, Vec3::y())).collect(),
    };
    clamp_left(&body, &mut supports);
    (body, supports, Vec3::z())
}
