//! A sphere with friction is pressed on a half-space: self-similar, because the disc that sticks is
//! the same share of the contact at every depth. The reference is computed in `rings`.
//!
//! Friction makes the half-space stiffer by some per cent. The force is compared with that of the
//! same sphere without friction on the same mesh, so that errors of the mesh nearly cancel.

use crate::verify::sector::Outline;
use crate::verify::tolerance::{FRICTION_STIFFENS, SMALL_STRAIN};
use crate::verify::{Findings, Options, Row, VerifyError};

use super::rings::Punch;
use super::{DEPTH, HalfSpace, hertz};

const CASE: &str = "spence";
/// Poisson's ratio and friction coefficient: partial slip, and hardly any.
const CASES: [(f64, f64); 2] = [(0.0, 0.3), (0.0, 5.0)];
/// Edges per radius of the disc.
const EDGES: usize = 7;
/// Load steps of the press.
const LOAD_STEPS: [usize; 3] = [1, 4, 16];
/// Steps of the moving step.
const STEPS: usize = 32;

pub(crate) fn run(_: &Options) -> Result<Findings, VerifyError> {
    let mut findings = Findings::default();
    for (nu, friction) in CASES {
        let half_space = HalfSpace::new(Outline::Round, EDGES, nu);
        let known = Punch::new(nu, friction);
        let press = |n: usize| -> Vec<[f64; 2]> {
            (1..=n)
                .map(|i| [0.0, DEPTH * i as f64 / n as f64])
                .collect()
        };
        let (smooth, nodes) = half_space.statically(0.0, &press(1))?;
        let smooth = smooth[0].z;
        findings.rows.push(Row::ratio(
            CASE,
            format!("nu {nu}, smooth: force, N"),
            hertz(nu),
            smooth,
            SMALL_STRAIN,
            nodes,
        ));
        let mut compare = |how: String, force: f64, smooth: f64| {
            findings.rows.push(Row::ratio(
                CASE,
                format!(
                    "nu {nu}, friction {friction} (sticks to {:.2} of the contact), {how}: force over smooth",
                    known.stick
                ),
                known.sphere,
                force / smooth,
                FRICTION_STIFFENS,
                nodes,
            ));
        };
        for n in LOAD_STEPS {
            let (forces, _) = half_space.statically(friction, &press(n))?;
            compare(format!("{n} load steps"), forces[n - 1].z, smooth);
        }
        let in_motion = |friction| half_space.in_motion(friction, &press(1), STEPS);
        let (rough, smooth) = (in_motion(friction)?, in_motion(0.0)?);
        compare("in motion".to_owned(), rough[0].z, smooth[0].z);
    }
    Ok(findings)
}
