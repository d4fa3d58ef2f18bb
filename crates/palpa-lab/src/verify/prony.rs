//! Relaxation (A5): the force of a pressed body over time, relative to the same body without
//! viscosity.

use palpa_fem::law::{Linear, Moduli, NeoHookean, Prony, PronyTerm};
use palpa_fem::{Law, Load, Material};
use palpa_mesh::generate::{GradedBlock, GradedLayer, LevelStack, Outline, graded_block};
use palpa_mesh::{LayeredBody, Vec3};

use crate::verify::press::Pressed;
use crate::verify::tolerance::PRONY;
use crate::verify::{Findings, Options, Row, VerifyError};

const CASE: &str = "prony";
/// Depth of the press, m: small, so that the force is proportional to the depth at finite strain
/// too.
const DEPTH: f64 = 2e-5;

pub(crate) fn run(_: &Options) -> Result<Findings, VerifyError> {
    let block = GradedBlock {
        outline: Outline::Disc,
        half_width: 0.03,
        centre: [0.0; 2],
        ring_radius: Some(5e-3),
        spacing: 2.5e-3,
        inner_growth: 0.0,
        growth: 0.6,
        jitter: None,
    };
    let levels = LevelStack::graded(&[GradedLayer {
        thickness: 0.02,
        first_height: 3e-3,
        growth: 0.4,
    }]);
    let body = graded_block(&block, &levels);
    let patch = block.patch_vertices(&body);
    let mut findings = Findings::default();
    let linear = Law::from(Linear::from_young(30e3, 0.45).expect("valid constants"));
    let finite = Law::from(NeoHookean::from_young(30e3, 0.45).expect("valid constants"));
    for (name, law) in [("linear", linear), ("neo-Hookean", finite)] {
        step(&mut findings, &body, &patch, name, law)?;
        ramp(&mut findings, &body, &patch, name, law)?;
    }
    Ok(findings)
}

fn viscous(law: Law, g: f64, tau: f64) -> Material {
    let term = PronyTerm { g, tau };
    // The bulk modulus relaxes too, so that Poisson's ratio is constant, as in the formula.
    let prony = Prony::new(vec![term], Moduli::Instantaneous, true).expect("valid series");
    Material {
        prony: Some(prony),
        ..Material::new("viscous", law)
    }
}

/// Force on the disc at the end of a step of a given duration, N.
fn hold(
    pressed: &mut Pressed,
    patch: &[u32],
    depth: f64,
    duration: f64,
) -> Result<f64, VerifyError> {
    let held: Vec<(usize, Vec3)> = patch
        .iter()
        .map(|&v| (pressed.model.body().node(v as usize, 0), -Vec3::z() * depth))
        .collect();
    let load = Load {
        held: &held,
        duration,
        ..Load::default()
    };
    Ok(pressed.step(&load, "relaxation")?.held_force.z)
}

fn elastic(body: &LayeredBody, patch: &[u32], law: Law) -> Result<f64, VerifyError> {
    let mut pressed = Pressed::layered(body, vec![Material::new("elastic", law)])?;
    hold(&mut pressed, patch, DEPTH, 0.0)
}

fn step(
    findings: &mut Findings,
    body: &LayeredBody,
    patch: &[u32],
    name: &str,
    law: Law,
) -> Result<(), VerifyError> {
    let elastic = elastic(body, patch, law)?;
    for (g, tau) in [(0.3, 0.5), (0.5, 0.1)] {
        let mut pressed = Pressed::layered(body, vec![viscous(law, g, tau)])?;
        let mut time = 0.0;
        for next in [0.0, 0.02, 0.1, 0.5, 2.0] {
            let force = hold(&mut pressed, patch, DEPTH, next - time)?;
            time = next;
            findings.rows.push(Row::ratio(
                CASE,
                format!("step, {name}, g {g}, tau {tau} s: F/F_elastic at {time} s"),
                1.0 - g * (1.0 - (-time / tau).exp()),
                force / elastic,
                PRONY,
                pressed.nodes(),
            ));
        }
    }
    Ok(())
}

fn ramp(
    findings: &mut Findings,
    body: &LayeredBody,
    patch: &[u32],
    name: &str,
    law: Law,
) -> Result<(), VerifyError> {
    let elastic = elastic(body, patch, law)?;
    let (g, tau) = (0.5, 0.1_f64);
    for ramp in [0.05, 0.2] {
        let mut pressed = Pressed::layered(body, vec![viscous(law, g, tau)])?;
        let mut time: f64 = 0.0;
        for share in [0.25, 0.5, 1.0, 1.5, 4.0_f64] {
            let next = share * ramp;
            let depth = DEPTH * share.min(1.0);
            let force = hold(&mut pressed, patch, depth, next - time)?;
            time = next;
            let loaded = time.min(ramp);
            let decay = ((loaded - time) / tau).exp() - (-time / tau).exp();
            let exact = ((1.0 - g) * loaded + g * tau * decay) / ramp;
            findings.rows.push(Row::ratio(
                CASE,
                format!("ramp of {ramp} s, {name}: F/F_elastic at {time:.3} s"),
                exact,
                force / elastic,
                PRONY,
                pressed.nodes(),
            ));
        }
    }
    Ok(())
}
