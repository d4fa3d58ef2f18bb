//! Columns with exact one-dimensional solutions (B5): confined; layers in series; unconfined
//! between smooth plates.

use palpa_fem::law::NeoHookean;
use palpa_fem::{Law, Load, Mat3, Material, Materials, Supports};
use palpa_mesh::generate::{Diagonal, Grid, LevelStack, mapped_grid};
use palpa_mesh::{LayeredBody, Vec3};

use crate::verify::press::Pressed;
use crate::verify::tolerance::COLUMN;
use crate::verify::{Findings, Options, Row, VerifyError};

const CASE: &str = "columns";
/// Height of the columns, m.
const HEIGHT: f64 = 0.04;
const SIDE: f64 = 0.02;

pub(crate) fn run(_: &Options) -> Result<Findings, VerifyError> {
    let mut findings = Findings::default();
    for nu in [0.45, 0.49] {
        let uniform = vec![(HEIGHT, law(30e3, nu))];
        let layered = vec![
            (0.002, law(100e3, nu)),
            (0.010, law(5e3, nu)),
            (0.028, law(30e3, nu)),
        ];
        for (what, layers) in [("uniform", uniform), ("layered", layered)] {
            for diagonal in [Diagonal::Right, Diagonal::Left, Diagonal::Random(3)] {
                confined(&mut findings, what, nu, &layers, diagonal)?;
            }
        }
        for diagonal in [Diagonal::Right, Diagonal::Left, Diagonal::Random(3)] {
            unconfined(&mut findings, nu, diagonal)?;
        }
    }
    Ok(findings)
}

fn law(young: f64, poisson: f64) -> Law {
    NeoHookean::from_young(young, poisson)
        .expect("valid constants")
        .into()
}

/// A block of the given layers, with an irregular grid of columns.
fn body(layers: &[(f64, Law)], diagonal: Diagonal) -> LayeredBody {
    let mut levels = LevelStack {
        depths: vec![0.0],
        interval_layer: Vec::new(),
    };
    let mut top = 0.0;
    for (i, (thickness, _)) in layers.iter().enumerate() {
        levels
            .depths
            .extend([top + 0.4 * thickness, top + thickness]);
        levels.interval_layer.extend([i, i]);
        top += thickness;
    }
    let grid = Grid {
        n_cells: [3, 3],
        diagonal,
        jitter: Some(11),
    };
    mapped_grid(&grid, |u, v| Vec3::new(u, v, 0.0) * SIDE, &levels)
}

/// Supports: the nodes slide in the planes of `faces` and, if `base_slides`, of the base.
fn sliding(body: &LayeredBody, faces: &[usize], base_slides: bool) -> Supports {
    let mut supports = Supports::default();
    for face in faces.iter().map(|&i| &body.cut_faces[i]) {
        for &v in &face.vertices {
            for l in 0..body.n_levels {
                supports
                    .planes
                    .push((body.node(v as usize, l), face.normal));
            }
        }
    }
    for v in 0..body.n_vertices() {
        let node = body.node(v, body.n_levels - 1);
        if base_slides {
            supports.planes.push((node, Vec3::z()));
        } else {
            supports.fixed.push(node);
        }
    }
    supports
}

/// Nominal pressure at a stretch of a confined column.
fn confined_pressure(law: &Law, stretch: f64) -> f64 {
    let f = Mat3::from_diagonal(&Vec3::new(1.0, 1.0, stretch));
    -law.stress(&f)[(2, 2)]
}

/// Root of an increasing function, by bisection.
fn root(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..200 {
        let middle = f64::midpoint(low, high);
        if f(middle) < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    f64::midpoint(low, high)
}

/// Pressure that compresses layers in series by `compression` (m) in total.
fn series_pressure(layers: &[(f64, Law)], compression: f64) -> f64 {
    let compressed = |pressure: f64| -> f64 {
        layers
            .iter()
            .map(|(thickness, law)| {
                let stretch = root(0.01, 1.0, |s| pressure - confined_pressure(law, s));
                thickness * (1.0 - stretch)
            })
            .sum()
    };
    root(0.0, 1e7, |pressure| compressed(pressure) - compression)
}

fn confined(
    findings: &mut Findings,
    what: &str,
    nu: f64,
    layers: &[(f64, Law)],
    diagonal: Diagonal,
) -> Result<(), VerifyError> {
    let body = body(layers, diagonal);
    let materials = layers
        .iter()
        .map(|(_, law)| Material::new("tissue", *law))
        .collect();
    let supports = sliding(&body, &[0, 1, 2, 3], false);
    let mut pressed = Pressed::new(&body, &Materials::of_layers(materials), &supports)?;
    pressed.params.tolerance = 1e-11;
    let top: Vec<u32> = (0..body.n_vertices() as u32).collect();
    for step in 1..=6 {
        let compression = 0.002 * f64::from(step);
        let force = pressed.hold_down(&top, compression)?;
        if step % 3 == 0 {
            let exact = series_pressure(layers, compression) * SIDE * SIDE;
            findings.rows.push(Row::ratio(
                CASE,
                format!(
                    "confined, {what}, nu {nu}, {diagonal:?}: force at {:.0} mm, N",
                    compression * 1e3
                ),
                exact,
                force,
                COLUMN,
                pressed.nodes(),
            ));
        }
    }
    Ok(())
}

/// Axial nominal stress at a stretch of an unconfined column with free width.
fn uniaxial_stress(law: &Law, stretch: f64) -> f64 {
    let at = |side: f64| Mat3::from_diagonal(&Vec3::new(side, side, stretch));
    let side = root(0.3, 3.0, |side| law.stress(&at(side))[(0, 0)]);
    law.stress(&at(side))[(2, 2)]
}

fn unconfined(findings: &mut Findings, nu: f64, diagonal: Diagonal) -> Result<(), VerifyError> {
    let law = law(30e3, nu);
    let body = body(&[(HEIGHT, law)], diagonal);
    // Two sides are planes of symmetry; the other two are free.
    let supports = sliding(&body, &[0, 2], true);
    for (name, stretches) in [
        ("compression", [0.9, 0.8, 0.7, 0.6]),
        ("tension", [1.1, 1.2, 1.3, 1.4]),
    ] {
        let materials = Materials::of_layers(vec![Material::new("tissue", law)]);
        let mut pressed = Pressed::new(&body, &materials, &supports)?;
        pressed.params.tolerance = 1e-11;
        for (i, stretch) in stretches.into_iter().enumerate() {
            let guided: Vec<(usize, Vec3, f64)> = (0..body.n_vertices())
                .map(|v| (body.node(v, 0), Vec3::z(), HEIGHT * (stretch - 1.0)))
                .collect();
            let load = Load {
                guided: &guided,
                ..Load::default()
            };
            let report = pressed.step(&load, "unconfined column")?;
            if i % 2 == 1 {
                findings.rows.push(Row::ratio(
                    CASE,
                    format!(
                        "unconfined {name}, nu {nu}, {diagonal:?}: force at stretch {stretch}, N"
                    ),
                    uniaxial_stress(&law, stretch) * SIDE * SIDE,
                    -report.held_force.z,
                    COLUMN,
                    pressed.nodes(),
                ));
            }
        }
    }
    Ok(())
}
