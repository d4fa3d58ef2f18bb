//! The contact conditions, for a sphere and a punch that are pressed into a block and dragged along
//! it.

use palpa_fem::law::NeoHookean;
use palpa_fem::shape::{FlatPunch, Pose, Shape, Sphere, Tool};
use palpa_fem::{Load, Material, PosedTool, StepReport};
use palpa_mesh::LayeredBody;
use palpa_mesh::generate::{GradedBlock, GradedLayer, LevelStack, Outline, graded_block};

use crate::verify::press::Pressed;
use crate::verify::tolerance::{FRICTION_STEPS, LOAD_STEPS, MISMATCH, PENETRATION};
use crate::verify::{Findings, Options, Row, VerifyError};

const CASE: &str = "contact";
const DEPTH: f64 = 4e-3;
/// Edges of the skin under the tool, m.
const SPACING: f64 = 1.5e-3;

fn body() -> LayeredBody {
    let block = GradedBlock {
        outline: Outline::Square,
        half_width: 0.05,
        centre: [0.0; 2],
        ring_radius: Some(9e-3),
        spacing: SPACING,
        inner_growth: 0.0,
        growth: 0.6,
        jitter: None,
    };
    let levels = LevelStack::graded(&[GradedLayer {
        thickness: 0.04,
        first_height: 2e-3,
        growth: 0.4,
    }]);
    graded_block(&block, &levels)
}

pub(crate) fn run(_: &Options) -> Result<Findings, VerifyError> {
    let body = body();
    let mut findings = Findings::default();
    let sphere = Shape::from(Sphere::new(0.01).expect("valid size"));
    let punch = Shape::from(FlatPunch::new(8e-3, 5e-3).expect("valid sizes"));
    for (name, shape) in [("sphere", sphere), ("rounded punch", punch)] {
        let mut forces = Vec::new();
        for n_steps in [1, 4, 16] {
            let (report, nodes) = pressed(&body, shape, 0.0, n_steps, 0.0)?;
            if n_steps == 4 {
                residuals(&mut findings, &format!("{name}, smooth"), &report, nodes);
            }
            forces.push((n_steps, report.tool_forces[0].z, nodes));
        }
        let (_, finest, _) = forces[2];
        for &(n_steps, force, nodes) in &forces[..2] {
            findings.rows.push(Row::ratio(
                CASE,
                format!("{name}, smooth: force in {n_steps} load steps against 16, N"),
                finest,
                force,
                LOAD_STEPS,
                nodes,
            ));
        }
        let (report, nodes) = pressed(&body, shape, 0.4, 4, 0.0)?;
        residuals(
            &mut findings,
            &format!("{name}, friction 0.4"),
            &report,
            nodes,
        );
        friction_by_steps(&mut findings, name, &body, shape)?;
    }
    // Drag: vertices slide, stick and lose contact.
    for (name, shape) in [("sphere", sphere), ("rounded punch", punch)] {
        let (report, nodes) = pressed(&body, shape, 0.4, 4, 3e-3)?;
        let what = format!("{name}, friction 0.4, dragged 3 mm");
        residuals(&mut findings, &what, &report, nodes);
    }
    Ok(findings)
}

/// Presses in equal steps, then drags along x. Returns the last report and the number of nodes that
/// can move.
fn pressed(
    body: &LayeredBody,
    shape: Shape,
    friction: f64,
    n_steps: u32,
    drag: f64,
) -> Result<(StepReport, usize), VerifyError> {
    let law = NeoHookean::from_young(30e3, 0.45).expect("valid constants");
    let mut pressed = Pressed::layered(body, vec![Material::new("tissue", law)])?;
    let tool = Tool::new(shape, friction).expect("valid friction");
    let mut report = None;
    for i in 1..=n_steps {
        let depth = DEPTH * f64::from(i) / f64::from(n_steps);
        report = Some(pressed.press(tool, [0.0; 2], depth)?);
    }
    for i in 1..=4 {
        if drag > 0.0 {
            let x = drag * f64::from(i) / 4.0;
            let tools = [PosedTool {
                tool,
                pose: Pose::translation(x, 0.0, -DEPTH),
            }];
            let load = Load {
                tools: &tools,
                ..Load::default()
            };
            report = Some(pressed.step(&load, "dragged tool")?);
        }
    }
    Ok((report.expect("at least one step"), pressed.nodes()))
}

fn residuals(findings: &mut Findings, what: &str, report: &StepReport, nodes: usize) {
    let contact = &report.contact;
    for (quantity, value, tolerance) in [
        (
            "law of contact, error relative to the force",
            contact.mismatch,
            MISMATCH,
        ),
        (
            "penetration, of an edge of the skin",
            contact.penetration / SPACING,
            PENETRATION,
        ),
    ] {
        findings.rows.push(Row::with_error(
            CASE,
            format!("{what}: {quantity}"),
            [0.0, value],
            value.max(0.0),
            tolerance,
            nodes,
        ));
    }
}

/// With friction, the force at the depth hardly depends on the steps that lead there.
fn friction_by_steps(
    findings: &mut Findings,
    name: &str,
    body: &LayeredBody,
    shape: Shape,
) -> Result<(), VerifyError> {
    let force = |n_steps| {
        let (report, nodes) = pressed(body, shape, 0.4, n_steps, 0.0)?;
        Ok::<_, VerifyError>((report.tool_forces[0].z, nodes))
    };
    let (fine, _) = force(40)?;
    for n_steps in [1, 4] {
        let (coarse, nodes) = force(n_steps)?;
        let step = DEPTH * 1e3 / f64::from(n_steps);
        findings.rows.push(Row::ratio(
            CASE,
            format!("{name}, friction 0.4: force in steps of {step} mm against 0.1 mm, N"),
            fine,
            coarse,
            FRICTION_STEPS,
            nodes,
        ));
    }
    Ok(())
}
