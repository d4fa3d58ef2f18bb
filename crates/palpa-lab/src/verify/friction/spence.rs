//! A sphere with friction is pressed on a half-space: self-similar, because the disc that sticks is
//! the same share of the contact at every depth. The reference is computed in `rings`.
//!
//! Friction makes the half-space stiffer by some per cent. The force is compared with that of the
//! same sphere without friction on the same mesh, so that errors of the mesh nearly cancel. With so
//! much friction that nearly all sticks they do not: shear is unbounded at the edge of the contact,
//! where a vertex is held from its first touch on, and the error falls in proportion to the mesh
//! size.

use crate::verify::sector::Outline;
use crate::verify::tolerance::{ADHESION, FRICTION_STIFFENS, SMALL_STRAIN, STICKING};
use crate::verify::{Findings, Options, Row, VerifyError};

use super::rings::Punch;
use super::{DEPTH, HalfSpace, hertz};

const CASE: &str = "spence";
const NU: f64 = 0.0;
/// A sphere that slips in part: friction coefficient, and numbers of load steps.
const PARTIAL: (f64, &[usize]) = (0.3, &[1, 4, 16]);
/// One that hardly slips. The paths of vertices that stick are curved, so it takes several steps.
const ADHESIVE: (f64, &[usize]) = (5.0, &[16]);
/// Discs that stick are compared up to this share of the contact's radius.
const MOST_STICK: f64 = 0.9;
/// Edges per radius of the disc.
const EDGES: usize = 7;
/// Steps of the moving step.
const STEPS: usize = 32;

pub(crate) fn run(_: &Options) -> Result<Findings, VerifyError> {
    let mut findings = Findings::default();
    let half_space = HalfSpace::new(Outline::Round, EDGES, NU);
    let press = |n: usize| -> Vec<[f64; 2]> {
        (1..=n)
            .map(|i| [0.0, DEPTH * i as f64 / n as f64])
            .collect()
    };
    let (smooth, nodes) = half_space.statically(0.0, &press(1))?;
    let smooth = smooth[0].force.z;
    let smooth_in_motion = half_space.in_motion(0.0, &press(1), STEPS)?[0].z;
    for (how, force) in [("in statics", smooth), ("in motion", smooth_in_motion)] {
        findings.rows.push(Row::ratio(
            CASE,
            format!("smooth, {how}: force, N"),
            hertz(NU),
            force,
            SMALL_STRAIN,
            nodes,
        ));
    }
    for ((friction, load_steps), tolerance) in [(PARTIAL, FRICTION_STIFFENS), (ADHESIVE, ADHESION)]
    {
        let known = Punch::new(NU, friction);
        let mut compare = |how: String, share: f64| {
            findings.rows.push(Row::ratio(
                CASE,
                format!("friction {friction}, {how}: force over smooth"),
                known.sphere,
                share,
                tolerance,
                nodes,
            ));
        };
        let mut sticks = None;
        for &n in load_steps {
            let (felt, _) = half_space.statically(friction, &press(n))?;
            let last = felt[n - 1];
            compare(format!("in {n} load steps"), last.force.z / smooth);
            sticks = Some(last.sticks);
        }
        let moved = half_space.in_motion(friction, &press(1), STEPS)?;
        compare("in motion".to_owned(), moved[0].z / smooth_in_motion);
        // Where nearly all sticks, the disc ends with the contact, and says nothing of friction.
        let Some(sticks) = sticks.filter(|_| known.stick < MOST_STICK) else {
            continue;
        };
        findings.rows.push(Row::with_error(
            CASE,
            format!("friction {friction}: disc that sticks, of the contact's radius"),
            [known.stick, sticks],
            sticks - known.stick,
            STICKING,
            nodes,
        ));
    }
    Ok(findings)
}
