//! A layer on a rigid base (A2) and stacks of layers (A3), compared with formulas.

#![expect(
    clippy::float_cmp,
    reason = "numbers of a table are compared as they stand there"
)]

use crate::verify::sector::Finest;
use crate::verify::small_strain::{Layer, STUDIED, Stack, TOUCHED};
use crate::verify::table::Table;
use crate::verify::tolerance::SMALL_STRAIN;
use crate::verify::{Findings, Options, Row, StudyPoint, VerifyError};

/// Depth of a sphere, relative to the radius of the disc. At 0.01, sliding would change the forces
/// by 2 %.
const SHALLOW: f64 = 1e-3;

/// Width of a body that stands for an infinite one, m: a multiple of its thickness and of the
/// radius of the tool. Twice this width changes stiffnesses by less than 0.1 %.
fn width(layers: &[Layer], radius: f64) -> f64 {
    let thickness: f64 = layers.iter().map(|l| l.thickness).sum();
    6.0 * thickness + 4.0 * radius
}

/// A stack for a punch or a pressure on a disc of radius `a`, m.
fn for_disc(a: f64, size: f64, layers: &[Layer]) -> Stack {
    Stack::new(a, size, Finest::Rim, width(layers, a), layers)
}

/// A stack for a sphere with the contact radius `a`, m.
fn for_sphere(a: f64, size: f64, layers: &[Layer]) -> Stack {
    Stack::new(a / TOUCHED, size, Finest::Inside, width(layers, a), layers)
}

/// Thickness of the single layer, m; its table gives only the ratio a/h.
const THICKNESS: f64 = 0.004;

/// One layer: flat punch and sphere (A2).
pub(crate) fn one(options: &Options) -> Result<Findings, VerifyError> {
    const CASE: &str = "A2";
    let columns = [
        "nu",
        "a_over_h",
        "kappa_flat",
        "kappa_sphere",
        "chi_sphere_a2_over_Rdelta",
    ];
    let table = Table::read(options, "A2_hayes_layer.csv", &columns)?;
    let mut findings = Findings::default();
    for row in 0..table.len() {
        let [nu, ratio, flat, sphere, chi] = columns.map(|column| table.number(row, column));
        // The law cannot be used for exactly incompressible material.
        if nu > 0.4999 {
            continue;
        }
        // The shear modulus is 1 Pa, and the unit of stiffness is 4 G a/(1 − ν).
        let a = ratio * THICKNESS;
        let layer = Layer {
            thickness: THICKNESS,
            young: 2.0 * (1.0 + nu),
            nu,
        };
        let unit = 4.0 * a / (1.0 - nu);
        let punch = |size: f64| for_disc(a, size, &[layer]).punch();
        let paraboloid =
            |size: f64| for_sphere(a, size, &[layer]).paraboloid(1.0, a * a / chi, SHALLOW);
        let force_unit = unit * a * a / chi;
        let k = punch(1.0)?;
        let force = paraboloid(1.0)?;
        for (quantity, reference, value, nodes) in [
            ("flat punch: kappa", flat, k.value / unit, k.nodes),
            (
                "sphere: kappa",
                sphere,
                force.value / force_unit,
                force.nodes,
            ),
        ] {
            findings.rows.push(Row::ratio(
                CASE,
                format!("nu {nu}, a/h {ratio}: {quantity}"),
                reference,
                value,
                SMALL_STRAIN,
                nodes,
            ));
        }
        if nu == 0.45 && ratio == 1.0 {
            for size in STUDIED {
                let (k, force) = (punch(size)?, paraboloid(size)?);
                for (series, nodes, error) in [
                    ("flat punch", k.nodes, k.value / unit / flat - 1.0),
                    (
                        "sphere",
                        force.nodes,
                        force.value / force_unit / sphere - 1.0,
                    ),
                ] {
                    findings.study.push(StudyPoint {
                        case: CASE,
                        series: format!("{series}, nu {nu}, a/h {ratio}"),
                        h: size,
                        nodes,
                        error,
                    });
                }
            }
        }
    }
    spheres(options, &mut findings, CASE)?;
    Ok(findings)
}

/// Force against depth of spheres on a layer.
fn spheres(
    options: &Options,
    findings: &mut Findings,
    case: &'static str,
) -> Result<(), VerifyError> {
    let columns = ["h_m", "E_Pa", "nu", "R_m", "a_m", "delta_m", "F_N"];
    let table = Table::read(options, "A2_sphere_on_layer.csv", &columns)?;
    for row in 0..table.len() {
        let [thickness, young, nu, radius, a, depth, reference] =
            columns.map(|column| table.number(row, column));
        let layer = Layer {
            thickness,
            young,
            nu,
        };
        let force = for_sphere(a, 1.0, &[layer]).paraboloid(radius, depth, SHALLOW)?;
        findings.rows.push(Row::ratio(
            case,
            format!(
                "layer of {} mm, nu {nu}, sphere of {} mm: force at {:.3} mm, N",
                thickness * 1e3,
                radius * 1e3,
                depth * 1e3
            ),
            reference,
            force.value,
            SMALL_STRAIN,
            force.nodes,
        ));
    }
    Ok(())
}

/// The stacks: name, thickness (mm) and Young's modulus (kPa) of each layer, and Poisson's ratio.
const STACKS: [(&str, &[[f64; 2]], f64); 7] = [
    ("stiff_over_soft_2_38", &[[2.0, 100.0], [38.0, 10.0]], 0.45),
    ("stiff_over_soft_5_15", &[[5.0, 100.0], [15.0, 10.0]], 0.45),
    ("soft_over_stiff_12_28", &[[12.0, 5.0], [28.0, 30.0]], 0.45),
    ("soft_over_stiff_5_15", &[[5.0, 10.0], [15.0, 100.0]], 0.45),
    (
        "skin_fat_muscle_045",
        &[[2.0, 100.0], [10.0, 5.0], [28.0, 30.0]],
        0.45,
    ),
    (
        "skin_fat_muscle_049",
        &[[2.0, 100.0], [10.0, 5.0], [28.0, 30.0]],
        0.49,
    ),
    ("homogeneous_40_045", &[[40.0, 30.0]], 0.45),
];
/// The stack used for the study of errors against mesh size.
const STUDIED_STACK: &str = "skin_fat_muscle_045";

fn layers(name: &str) -> Option<Vec<Layer>> {
    let (_, layers, nu) = STACKS.iter().find(|stack| stack.0 == name)?;
    let layer = |[thickness, young]: &[f64; 2]| Layer {
        thickness: thickness * 1e-3,
        young: young * 1e3,
        nu: *nu,
    };
    Some(layers.iter().map(layer).collect())
}

/// Several layers: flat punch, disc under pressure and sphere (A3).
pub(crate) fn several(options: &Options) -> Result<Findings, VerifyError> {
    const CASE: &str = "A3";
    let mut findings = Findings::default();
    let columns = [
        "a_m",
        "k_flat_punch_frictionless_N_per_m",
        "k_disc_mean_N_per_m",
        "k_disc_centre_N_per_m",
    ];
    let name = "A3_layered_punch_disc.csv";
    let with_case = [&["case"], &columns[..]].concat();
    let table = Table::read(options, name, &with_case)?;
    for row in 0..table.len() {
        let name = table.text(row, "case");
        let layers = known(options, "A3_layered_punch_disc.csv", name)?;
        let [a, punch, mean, centre] = columns.map(|column| table.number(row, column));
        let sizes: &[f64] = if name == STUDIED_STACK && a == 0.005 {
            &STUDIED
        } else {
            &[1.0]
        };
        for &size in sizes {
            let stack = for_disc(a, size, &layers);
            let k = stack.punch()?;
            let (pressed, mean_depth) = stack.under_pressure()?;
            let depth = -pressed.state.displacements[stack.sector.body.node(0, 0)].z;
            for (quantity, reference, value) in [
                ("smooth flat punch", punch, k.value),
                ("pressure over its mean depth", mean, 1.0 / mean_depth),
                ("pressure over its depth in the middle", centre, 1.0 / depth),
            ] {
                if sizes.len() > 1 {
                    findings.study.push(StudyPoint {
                        case: CASE,
                        series: format!("{name}, a {} mm: {quantity}", a * 1e3),
                        h: size,
                        nodes: k.nodes,
                        error: value / reference - 1.0,
                    });
                }
                if size == 1.0 {
                    findings.rows.push(Row::ratio(
                        CASE,
                        format!("{name}, a {} mm: {quantity}, N/m", a * 1e3),
                        reference,
                        value,
                        SMALL_STRAIN,
                        k.nodes,
                    ));
                }
            }
        }
    }
    stacked_spheres(options, &mut findings, CASE)?;
    Ok(findings)
}

fn stacked_spheres(
    options: &Options,
    findings: &mut Findings,
    case: &'static str,
) -> Result<(), VerifyError> {
    let file = "A3_layered_sphere.csv";
    let columns = ["R_m", "a_m", "delta_m", "F_N"];
    let with_case = [&["case"], &columns[..]].concat();
    let table = Table::read(options, file, &with_case)?;
    for row in 0..table.len() {
        let name = table.text(row, "case");
        let layers = known(options, file, name)?;
        let [radius, a, depth, reference] = columns.map(|column| table.number(row, column));
        let force = for_sphere(a, 1.0, &layers).paraboloid(radius, depth, SHALLOW)?;
        findings.rows.push(Row::ratio(
            case,
            format!(
                "{name}, sphere of {} mm: force at {:.3} mm, N",
                radius * 1e3,
                depth * 1e3
            ),
            reference,
            force.value,
            SMALL_STRAIN,
            force.nodes,
        ));
    }
    Ok(())
}

fn known(options: &Options, file: &str, name: &str) -> Result<Vec<Layer>, VerifyError> {
    layers(name).ok_or_else(|| VerifyError::Table {
        path: options.reference.clone().unwrap_or_default().join(file),
        reason: format!("there is no stack of layers called \"{name}\""),
    })
}
