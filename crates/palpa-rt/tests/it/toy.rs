//! A bed of springs that harden and creep, pressed by a sphere: small, nonlinear, with history and
//! background jobs.

use palpa_rt::{StepStatus, Tissue, TissueInput, TissueStep};
use palpa_servo::{Candidate, ContactPatch, MAX_TOOLS, Mat3, ToolContact, Vec3};
use std::thread::Thread;

/// Radius of the tool, m.
pub(crate) const RADIUS: f64 = 0.01;
const SIDE: usize = 7;
const SPACING: f64 = 0.002;
/// Stiffness of a spring, N/m, its hardening, 1/m², and the share and time of its creep.
const K: f64 = 15.0;
const HARDENING: f64 = 4e4;
const CREEP: f64 = 0.5;
const CREEP_TIME: f64 = 0.1;
/// A vertex so close to the tool is a candidate, m.
const NEAR: f64 = 0.004;

/// Springs at the vertices of a grid round the origin, in the plane z = 0; the tool comes from
/// above.
#[derive(Debug, Clone)]
pub(crate) struct Bed {
    /// How much each spring has crept, m.
    crept: [f64; SIDE * SIDE],
    pressed: [f64; SIDE * SIDE],
    /// What a background job found; scales all springs by some per mille.
    scale: f64,
    factor: u64,
    steps: u64,
    /// From which step on 20 steps say that they failed.
    pub(crate) fails_at: Option<u64>,
    /// Of so many steps each, the last six fail and hand over the last patch again.
    pub(crate) falters_every: Option<u64>,
    last: Option<Box<ContactPatch>>,
    /// Which job panics.
    pub(crate) panics_in: Option<u64>,
    jobs: u64,
    /// A thread to wake at every step, for `until`.
    pub(crate) waiter: Option<Thread>,
    /// Whether its steps say that there was nothing to do.
    pub(crate) is_idle: bool,
}

impl Bed {
    pub(crate) fn new() -> Self {
        Self {
            crept: [0.0; SIDE * SIDE],
            pressed: [0.0; SIDE * SIDE],
            scale: 1.0,
            factor: 0,
            steps: 0,
            fails_at: None,
            falters_every: None,
            last: None,
            panics_in: None,
            jobs: 0,
            waiter: None,
            is_idle: false,
        }
    }
}

impl Tissue for Bed {
    type Job = (u64, [f64; SIDE * SIDE], bool);
    type Done = (u64, f64);

    fn step(&mut self, input: &TissueInput, patch: &mut ContactPatch) -> TissueStep {
        if let Some(waiter) = &self.waiter {
            waiter.unpark();
        }
        self.steps += 1;
        let falters = self.falters_every.is_some_and(|n| self.steps % n >= n - 6);
        if let (true, Some(last)) = (falters, &self.last) {
            patch.clone_from(last);
            return TissueStep {
                status: StepStatus::Failed,
                mesh: 1,
                kept_from: Some(last.sampled_at),
                ..TissueStep::default()
            };
        }
        patch.n_tools = input.n_tools;
        patch.n_contacts = 0;
        let mut energy = 0.0;
        // One tool: the second presses nothing.
        let pose = input.poses[0];
        let centre = pose.translation.vector;
        let (mut force, mut stiffness) = (Vec3::zeros(), Mat3::zeros());
        for v in 0..SIDE * SIDE {
            let along = |i: usize| (i as f64 - (SIDE as f64 - 1.0) / 2.0) * SPACING;
            let rest = Vec3::new(along(v % SIDE), along(v / SIDE), 0.0);
            let from_centre = rest - centre;
            let distance = from_centre.norm();
            let n = if distance > 0.0 {
                from_centre / distance
            } else {
                -Vec3::z()
            };
            let u = (RADIUS - distance).max(0.0);
            self.crept[v] += input.dt / (CREEP_TIME + input.dt) * (u - self.crept[v]);
            self.pressed[v] = u;
            let k = K * self.scale;
            let normal = k * (u * (1.0 + HARDENING * u * u) + CREEP * (u - self.crept[v])).max(0.0);
            let tangent = k * (1.0 + 3.0 * HARDENING * u * u + CREEP);
            energy += k * u * u * (0.5 + 0.25 * HARDENING * u * u);
            let r = if u > 0.0 { n * normal } else { Vec3::zeros() };
            force -= r;
            if u > 0.0 {
                stiffness += n * n.transpose() * tangent;
            }
            if distance - RADIUS > NEAR {
                continue;
            }
            let i = patch.n_contacts;
            patch.contacts[i] = Candidate {
                vertex: v as u32,
                tool: 0,
                position: rest + n * u,
                force: r,
                surface: n * RADIUS,
                normal: n,
                curvature: (Mat3::identity() - n * n.transpose()) / RADIUS,
                anchor: rest + n * u - centre,
            };
            patch.n_contacts += 1;
            for axis in 0..3 {
                let column = 3 * i + axis;
                for row in 0..3 * (SIDE * SIDE) {
                    patch.compliance[row + ContactPatch::STRIDE * column] = 0.0;
                }
                patch.compliance[column + ContactPatch::STRIDE * column] = 1.0 / tangent;
            }
        }
        for k in 0..MAX_TOOLS {
            patch.tools[k] = ToolContact {
                pose: input.poses[k],
                friction: 0.0,
                is_bonded: false,
                force: if k == 0 { force } else { Vec3::zeros() },
                stiffness: if k == 0 { stiffness } else { Mat3::zeros() },
            };
        }
        if self.falters_every.is_some() {
            let last = self.last.get_or_insert_with(palpa_rt::empty_patch);
            (**last).clone_from(patch);
            last.sampled_at = input.sampled_at;
        }
        TissueStep {
            status: match self.fails_at {
                Some(step) if (step..step + 20).contains(&self.steps) => StepStatus::Failed,
                _ => StepStatus::Converged,
            },
            iterations: u32::from(!self.is_idle),
            residual: 0.0,
            factor: self.factor,
            zone: 0,
            mesh: 1,
            energy,
            kept_from: None,
        }
    }

    fn take_job(&mut self) -> Option<Self::Job> {
        // Not after every step, so that which steps it was after matters.
        if self.steps % 7 != 3 {
            return None;
        }
        self.jobs += 1;
        Some((self.jobs, self.pressed, self.panics_in == Some(self.jobs)))
    }

    fn run((factor, pressed, panics): Self::Job) -> Self::Done {
        assert!(!panics, "a job that panics on purpose");
        // Some milliseconds of arithmetic whose every bit counts.
        let mut x = 0.3 + 10.0 * pressed.iter().sum::<f64>();
        for _ in 0..200_000 {
            x = (x + 0.7 * x.cos()) * 0.6;
        }
        (factor, 1.0 + 0.003 * x)
    }

    fn install(&mut self, (factor, scale): Self::Done) {
        self.factor = factor;
        self.scale = scale;
    }

    fn job_failed(&mut self) {}
}
