//! A sphere with friction on a half-space: pressed (case `spence`), and pressed and then moved
//! sideways (case `mindlin`); in statics, and in motion through the moving step at 1 kHz.
//!
//! The cases drive the model through what every user of it has: tools along paths, and their
//! forces. They know nothing of how contact is solved.

mod mindlin;
mod rings;
mod spence;

use std::f64::consts::PI;
use std::sync::Arc;

use palpa_fem::law::Linear;
use palpa_fem::realtime::{ExteriorMode, Live, LiveParams, StepOutcome};
use palpa_fem::shape::{Pose, Sphere, Tool};
use palpa_fem::{Load, Material, Materials, PosedTool};
use palpa_mesh::Vec3;

use crate::verify::VerifyError;
use crate::verify::press::Pressed;
use crate::verify::sector::{Finest, Outline, Sector};
use crate::verify::small_strain::TOUCHED;

pub(crate) use mindlin::run as mindlin;
pub(crate) use spence::run as spence;

/// Radius of the disc of fine edges, m.
const RING: f64 = 0.01;
/// Radius of the half-space, relative to that of the disc.
const WIDTH: f64 = 500.0;
/// Contact radius without friction, m.
const CONTACT: f64 = TOUCHED * RING;
/// Depth of the sphere, relative to the contact radius: small, as the references assume.
const SHALLOW: f64 = 0.01;
/// Depth of the sphere, m.
const DEPTH: f64 = SHALLOW * CONTACT;
/// Young's modulus, Pa.
const YOUNG: f64 = 10e3;
/// Tolerance of the force balance, as in the other cases on half-spaces.
const TOLERANCE: f64 = 1e-4;
/// Period of the moving step, s.
const TICK: f64 = 1e-3;

/// What a sphere feels at a place.
#[derive(Debug, Clone, Copy)]
struct Felt {
    /// Force on the whole sphere, N.
    force: Vec3,
    /// Radius of a disc with the area that sticks, as a share of the contact radius.
    sticks: f64,
}

/// A half-space on which a sphere moves.
struct HalfSpace {
    outline: Outline,
    sector: Sector,
    nu: f64,
}

impl HalfSpace {
    /// Edges under the sphere are 1/`n` of the disc's radius long.
    fn new(outline: Outline, n: usize, nu: f64) -> Self {
        let width = WIDTH * RING;
        Self {
            outline,
            sector: Sector::new(outline, RING, n, Finest::Inside, width, &[width]),
            nu,
        }
    }

    fn body(&self) -> Result<Pressed, VerifyError> {
        let law = Linear::from_young(YOUNG, self.nu).expect("valid constants");
        let materials = Materials::of_layers(vec![Material::new("half-space", law)]);
        let mut body = Pressed::new(&self.sector.body, &materials, &self.sector.supports)?;
        body.params.tolerance = TOLERANCE;
        body.params.gap_tolerance = 1e-6 * DEPTH;
        Ok(body)
    }

    /// What the sphere feels at each of the places: each place is one load step. Also the number of
    /// nodes that can move.
    fn statically(
        &self,
        friction: f64,
        places: &[[f64; 2]],
    ) -> Result<(Vec<Felt>, usize), VerifyError> {
        let n_sectors = self.outline.n_sectors();
        let mut body = self.body()?;
        let mut felt = Vec::new();
        for &place in places {
            let tools = [sphere(friction, place)];
            let load = Load {
                tools: &tools,
                ..Load::default()
            };
            let report = body.step(&load, &format!("sphere at {place:?} m"))?;
            let touches = body.state.touches.iter().zip(body.model.skin_areas());
            let sticking = touches.filter(|(touch, _)| touch.pressure > 0.0 && !touch.is_sliding);
            let area: f64 = sticking.map(|(_, area)| area * n_sectors).sum();
            felt.push(Felt {
                force: report.tool_forces[0] * n_sectors,
                sticks: (area / PI).sqrt() / CONTACT,
            });
        }
        Ok((felt, body.nodes()))
    }

    /// Force on the whole sphere at each of the places, N, with the moving step as the shipped loop
    /// runs it: a zone with a linear exterior. `n` steps of 1 ms lead from one place to the next.
    fn in_motion(
        &self,
        friction: f64,
        places: &[[f64; 2]],
        n: usize,
    ) -> Result<Vec<Vec3>, VerifyError> {
        let params = LiveParams {
            zone_radius: 2.0 * CONTACT,
            exterior: ExteriorMode::Linear,
            ..LiveParams::default()
        };
        let mut from = [0.0, -0.1 * DEPTH];
        let start = [sphere(friction, from)];
        let mut live = Live::new(Arc::new(self.body()?.model), &start, params)?;
        let mut forces = Vec::new();
        for &place in places {
            for k in 1..=n {
                let share = k as f64 / n as f64;
                let at = [0, 1].map(|i| from[i] + share * (place[i] - from[i]));
                let report = live.step(&[sphere(friction, at)], TICK);
                if report.outcome != StepOutcome::Arrived {
                    return Err(VerifyError::NotConverged {
                        what: format!("sphere in motion at {at:?} m"),
                        outcome: format!("{:?}", report.outcome),
                    });
                }
                if let Some(job) = live.take_job() {
                    live.install(job.run());
                }
            }
            forces.push(live.tool_force(0) * self.outline.n_sectors());
            from = place;
        }
        Ok(forces)
    }
}

/// The sphere, moved along x and pressed down, m.
fn sphere(friction: f64, [along, depth]: [f64; 2]) -> PosedTool {
    let radius = CONTACT * CONTACT / DEPTH;
    let sphere = Sphere::new(radius).expect("valid size");
    PosedTool {
        tool: Tool::new(sphere, friction).expect("valid friction"),
        pose: Pose::translation(along, 0.0, -depth),
    }
}

/// Force of the sphere without friction, N (Hertz).
fn hertz(nu: f64) -> f64 {
    4.0 / 3.0 * YOUNG / (1.0 - nu * nu) * CONTACT * DEPTH
}
