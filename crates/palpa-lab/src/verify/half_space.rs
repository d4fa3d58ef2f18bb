//! A half-space (A1): a body of linear material, hundreds to thousands of times as wide and deep as
//! the tool.
//!
//! The problem has no length scale. A stiffness is proportional to E a, a force on a sphere to E √R
//! δ^1.5, and a displacement under a point force to P/(E r). So the factors are computed once for
//! each Poisson's ratio, and every row of the tables is compared with them.

use crate::verify::sector::Finest;
use crate::verify::small_strain::{self, Layer, Measured, STUDIED, Stack};
use crate::verify::table::Table;
use crate::verify::tolerance::SMALL_STRAIN;
use crate::verify::{Findings, Options, Row, StudyPoint, VerifyError};

const CASE: &str = "A1";
/// Width and depth of the body, relative to the radius of the disc. At 1,000 the finite size still
/// changes the result of a punch by 0.1 %. A sphere is pressed so little that rounding of the
/// strains far away would matter first, so its body is smaller.
const WIDTH: f64 = 3000.0;
const WIDTH_FOR_SPHERE: f64 = 500.0;
/// Depth of a sphere, relative to the radius of the disc. The skin hardly slides along it, because
/// nearly incompressible material moves straight down.
const SHALLOW: f64 = 1e-2;
/// Poisson's ratio used in place of ½; by the formulas this changes stiffnesses by 0.01 %.
const NEARLY_HALF: f64 = 0.4999;
/// Contact radii of spheres, relative to the disc's radius. Several are used because the edge of
/// the contact lies at different places between rings of vertices.
const TOUCHED: [f64; 5] = [0.75, 0.8, 0.85, 0.9, 0.95];
/// Distances at which displacements are compared, relative to the radius of the disc under
/// pressure. The finite size of the disc adds 0.8 % to the displacement at the nearest distance.
const DISTANCES: [f64; 5] = [4.0, 4.5, 5.0, 5.5, 6.0];

/// Radius of the disc, m.
const RADIUS: f64 = 0.01;

/// A half-space with E = 1 Pa and the disc in its middle.
pub(crate) fn unit(nu: f64, size: f64, finest: Finest) -> Stack {
    let width = match finest {
        Finest::Rim | Finest::Around => WIDTH * RADIUS,
        Finest::Inside => WIDTH_FOR_SPHERE * RADIUS,
    };
    let layer = Layer {
        thickness: width,
        young: 1.0,
        nu,
    };
    Stack::new(RADIUS, size, finest, width, &[layer])
}

pub(crate) fn run(options: &Options) -> Result<Findings, VerifyError> {
    let mut findings = Findings::default();
    let punch = Table::read(
        options,
        "A1_flat_punch.csv",
        &[
            "E_Pa",
            "nu",
            "a_m",
            "k_frictionless_N_per_m",
            "k_bonded_N_per_m",
        ],
    )?;
    let sphere = Table::read(
        options,
        "A1_hertz_sphere.csv",
        &["E_Pa", "nu", "R_m", "delta_m", "F_N"],
    )?;
    for nu in [0.45, 0.5] {
        let solved = f64::min(nu, NEARLY_HALF);
        let stack = unit(solved, 1.0, Finest::Rim);
        flat(&mut findings, &punch, nu, [stack.punch()?, stack.bonded()?]);
        let stack = unit(solved, 1.0, Finest::Inside);
        let mut factors = Vec::new();
        for touched in TOUCHED {
            // For a sphere with R = 1 m, a² = R δ.
            let depth = (touched * RADIUS).powi(2);
            let force = stack.paraboloid(1.0, depth, SHALLOW)?;
            factors.push(Measured {
                value: force.value / depth.powf(1.5),
                ..force
            });
        }
        hertz(&mut findings, &sphere, nu, &factors);
    }
    point_force(options, &mut findings)?;
    let modulus = 1.0 / (1.0 - 0.45 * 0.45);
    let a = small_strain::TOUCHED * RADIUS;
    for size in STUDIED {
        let k = unit(0.45, size, Finest::Rim).punch()?;
        let force = unit(0.45, size, Finest::Inside).paraboloid(1.0, a * a, SHALLOW)?;
        for (series, measured, exact) in [
            ("smooth flat punch", k, 2.0 * modulus * RADIUS),
            ("sphere", force, 4.0 / 3.0 * modulus * a.powi(3)),
        ] {
            findings.study.push(StudyPoint {
                case: CASE,
                series: format!("{series}, nu 0.45"),
                h: size,
                nodes: measured.nodes,
                error: measured.value / exact - 1.0,
            });
        }
    }
    Ok(findings)
}

fn solved_for(nu: f64) -> &'static str {
    if nu > NEARLY_HALF {
        " (solved for 0.4999)"
    } else {
        ""
    }
}

fn flat(findings: &mut Findings, table: &Table, nu: f64, unit: [Measured; 2]) {
    for row in 0..table.len() {
        if (table.number(row, "nu") - nu).abs() > 1e-9 {
            continue;
        }
        let [young, a] = ["E_Pa", "a_m"].map(|column| table.number(row, column));
        let columns = ["k_frictionless_N_per_m", "k_bonded_N_per_m"];
        for ((name, column), unit) in ["smooth", "bonded"].iter().zip(columns).zip(unit) {
            findings.rows.push(Row::ratio(
                CASE,
                format!(
                    "nu {nu}{}: {name} flat punch, a {} mm, E {} kPa: stiffness, N/m",
                    solved_for(nu),
                    a * 1e3,
                    young / 1e3
                ),
                table.number(row, column),
                unit.value / RADIUS * young * a,
                SMALL_STRAIN,
                unit.nodes,
            ));
        }
    }
}

fn hertz(findings: &mut Findings, table: &Table, nu: f64, factors: &[Measured]) {
    let rows = (0..table.len()).filter(|&row| (table.number(row, "nu") - nu).abs() < 1e-9);
    for (row, factor) in rows.zip(factors.iter().cycle()) {
        let [young, radius, depth, force] =
            ["E_Pa", "R_m", "delta_m", "F_N"].map(|column| table.number(row, column));
        findings.rows.push(Row::ratio(
            CASE,
            format!(
                "nu {nu}{}: sphere, R {} mm, E {} kPa: force at {} mm, N",
                solved_for(nu),
                radius * 1e3,
                young / 1e3,
                depth * 1e3
            ),
            force,
            factor.value * young * radius.sqrt() * depth.powf(1.5),
            SMALL_STRAIN,
            factor.nodes,
        ));
    }
}

/// Displacement of the skin at some distance from a small disc under pressure.
fn point_force(options: &Options, findings: &mut Findings) -> Result<(), VerifyError> {
    let columns = ["E_Pa", "nu", "P_N", "r_m", "uz_down_m", "ur_outward_m"];
    let table = Table::read(options, "A1_boussinesq_surface.csv", &columns)?;
    let nu = table.number(0, "nu");
    let stack = unit(nu, 1.0, Finest::Around);
    let (pressed, _) = stack.under_pressure()?;
    for (row, distance) in (0..table.len()).zip(DISTANCES.into_iter().cycle()) {
        let [young, _, force, r, down, outward] = columns.map(|column| table.number(row, column));
        // The factors are u E r/P at the ring of vertices nearest to the distance.
        let (at, factors) = stack.ring_displacement(&pressed, distance * RADIUS);
        let [u_r, u_z] = factors.map(|u| u * at * force / (young * r));
        for (direction, reference, u) in [("down", down, u_z), ("outward", outward, u_r)] {
            findings.rows.push(Row::ratio(
                CASE,
                format!(
                    "nu {nu}: displacement {} mm from a point force, {direction}, m",
                    r * 1e3
                ),
                reference,
                u,
                SMALL_STRAIN,
                pressed.nodes(),
            ));
        }
    }
    Ok(())
}
