//! The first touch of stiff tissue by a tool without friction, with a loop that the test drives.

use crate::{devices::until, engine::params};
use palpa_device::{DeviceFault, HapticDevice};
use palpa_rt::{Engine, RecorderParams, Tissue, TissueInput, TissueStep};
use palpa_servo::{
    Candidate, ContactPatch, DeviceSpec, DeviceState, ForceCommand, Mat3, Pose, ToolContact, Vec3,
};
use std::thread::{self, Thread};

/// Radius of the tool, m, its speed, m/s, and its height at the start, m.
const RADIUS: f64 = 0.01;
const SPEED: f64 = 0.02;
const START: f64 = 0.02;
/// Largest stiffness of the device, N/m.
const MOST: f64 = 2000.0;

/// One vertex on a spring, N/m, under a tool without friction: its compliance is that along the
/// normal only.
struct Spring {
    stiffness: f64,
    waiter: Thread,
}

impl Tissue for Spring {
    type Job = ();
    type Done = ();

    fn step(&mut self, input: &TissueInput, patch: &mut ContactPatch) -> TissueStep {
        self.waiter.unpark();
        let pose = input.poses[0];
        let depth = (RADIUS - pose.translation.z).max(0.0);
        let force = self.stiffness * depth;
        let down = -Vec3::z();
        let along = down * down.transpose();
        patch.n_tools = input.n_tools;
        patch.n_contacts = 1;
        patch.contacts[0] = Candidate {
            vertex: 7,
            position: down * depth,
            force: down * force,
            surface: down * RADIUS,
            normal: down,
            curvature: (Mat3::identity() - along) / RADIUS,
            anchor: down * RADIUS,
            ..Candidate::NONE
        };
        patch.set_block(0, 0, &(along / self.stiffness));
        patch.tools[0] = ToolContact {
            pose,
            force: -down * force,
            stiffness: if depth > 0.0 {
                along * self.stiffness
            } else {
                Mat3::zeros()
            },
            ..ToolContact::NONE
        };
        TissueStep::default()
    }

    fn take_job(&mut self) -> Option<()> {
        None
    }

    fn run((): ()) {}

    fn install(&mut self, (): ()) {}

    fn job_failed(&mut self) {}
}

/// Comes straight down.
struct Falling;

fn height(now: f64) -> f64 {
    START - SPEED * now
}

impl HapticDevice for Falling {
    fn spec(&self) -> DeviceSpec {
        DeviceSpec {
            max_force: 8.0,
            max_torque: 0.0,
            max_slew: 2000.0,
            max_stiffness: MOST,
            max_damping: 10.0,
        }
    }

    fn read(&mut self, now: f64) -> Result<DeviceState, DeviceFault> {
        Ok(DeviceState {
            time: now,
            pose: Pose::translation(0.0, 0.0, height(now)),
            velocity: Vec3::zeros(),
            buttons: 0,
        })
    }

    fn write(&mut self, _: f64, _: &ForceCommand) -> Result<(), DeviceFault> {
        Ok(())
    }
}

#[test]
fn stiff_tissue_is_as_stiff_at_its_first_touch_as_the_device_renders() {
    for stiffness in [1000.0, 2500.0, 10_000.0] {
        let spring = Spring {
            stiffness,
            waiter: thread::current(),
        };
        let (mut engine, mut servo_loop) = Engine::start_driven(
            spring,
            vec![Box::new(Falling)],
            &params(),
            &RecorderParams::default(),
        )
        .unwrap();
        let wanted = stiffness.min(MOST);
        let mut felt = Vec::new();
        for k in 0..520_u64 {
            let now = (k + 1) as f64 * 1e-3;
            servo_loop.tick_once(now, 0.0, 0);
            until("the tissue answers", || engine.snapshot().step.tick > k);
            let depth = RADIUS - height(now);
            // The ramp of the start is over long before.
            if depth > 1e-5 && felt.len() < 3 {
                let force = engine.snapshot().tick.devices[0].tissue_force[2];
                felt.push(force / depth);
            }
        }
        drop(servo_loop);
        engine.stop();
        // Later the coupling follows the stiffness that the forces show; this is the touch alone.
        assert!((felt[0] / wanted - 1.0).abs() < 0.01, "{wanted}: {felt:?}");
    }
}
