//! A simulated device in a simulated hand.
//!
//! ```text
//! (m_d + m_h) a = F − b_d v − c v/|v| + k (p(t) − x) + b (p'(t) − v)        |stiction| ≤ c
//! ```
//! The device has mass, viscous and dry friction, a position sensor with steps, a largest force, and delays; the hand is
//! a mass on spring and damper that follows a path. Integrated in steps of 0.1 ms by the implicit midpoint, so that the
//! integrator neither damps nor feeds an oscillation; dry friction is exact in the step. The force from the loop is
//! held between writes, as a real amplifier does: what is unstable at 1 kHz is unstable here.

use crate::{DeviceFault, HapticDevice, Path};
use nalgebra::UnitQuaternion;
use palpa_servo::{DeviceSpec, DeviceState, ForceCommand, Pose, Vec3};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Step of the integration, s.
const STEP: f64 = 1e-4;
/// Steps that delays may reach back.
const HISTORY: usize = 128;
/// A live target jumps from one event of a mouse to the next; the hand follows as a critically damped mass with this time, s,
/// and no faster than this, m/s.
const FOLLOW_TIME: f64 = 0.02;
const FOLLOW_SPEED: f64 = 1.0;
/// Longest time that one call makes up for, s: after a longer gap of the clock the rest is left out.
const MAX_GAP: f64 = 0.25;

/// The mechanics and the electronics of a device.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviceModel {
    /// Moving mass as felt at the hand-piece, kg.
    pub mass: f64,
    /// Viscous friction, N s/m.
    pub viscous: f64,
    /// Dry friction, N.
    pub dry: f64,
    /// Step of the position sensor, m; 0 for none.
    pub resolution: f64,
    /// From reading the sensor to having the reading, s.
    pub position_delay: f64,
    /// From writing a force to its action, s.
    pub force_delay: f64,
    /// Rate at which new readings are there, Hz.
    pub rate: f64,
    /// What the law may ask of it.
    pub spec: DeviceSpec,
}

impl DeviceModel {
    /// Novint Falcon.
    ///
    /// 8 N, 3000 N/m and 20 N s/m are CHAI3D's figures for it (`CDeltaDevices.cpp`, 3.3.0). The sensor's step, 0.045 mm,
    /// follows from libnifalcon's geometry and encoder scale (0.041 to 0.048 mm near the centre); one delay of 1 ms is
    /// the latency timer of its USB chip. The mass is what a public driver compensates (90 g); friction is assumed.
    pub const FALCON: Self = Self {
        mass: 0.09,
        viscous: 0.5,
        dry: 0.15,
        resolution: 4.5e-5,
        position_delay: 1e-3,
        force_delay: 2e-4,
        rate: 1000.0,
        spec: DeviceSpec {
            max_force: 8.0,
            max_torque: 0.0,
            max_slew: 1000.0,
            max_stiffness: 2000.0,
            max_damping: 8.0,
        },
    };

    /// 3D Systems Touch, formerly Phantom Omni.
    ///
    /// From its data sheet: 3.3 N, 0.055 mm, less than 0.26 N of friction, 45 g, and 1.26, 2.31 and 1.02 N/mm along its
    /// axes, of which the least is taken. Viscous friction, delays and damping are assumed.
    pub const TOUCH: Self = Self {
        mass: 0.045,
        viscous: 0.3,
        dry: 0.2,
        resolution: 5.5e-5,
        position_delay: 1e-3,
        force_delay: 2e-4,
        rate: 1000.0,
        spec: DeviceSpec {
            max_force: 3.3,
            max_torque: 0.0,
            max_slew: 500.0,
            max_stiffness: 1020.0,
            max_damping: 4.0,
        },
    };

    /// Haply Inverse3.
    ///
    /// 5 N is the limit in SOFA's plugin for it (`Haply_Inverse3Controller`), which also runs it at 3 kHz. No public
    /// figures were found for the rest; it is assumed from the device's kind (direct drive, low friction).
    pub const INVERSE3: Self = Self {
        mass: 0.15,
        viscous: 0.2,
        dry: 0.05,
        resolution: 1e-5,
        position_delay: 4e-4,
        force_delay: 2e-4,
        rate: 3000.0,
        spec: DeviceSpec {
            max_force: 5.0,
            max_torque: 0.0,
            max_slew: 1000.0,
            max_stiffness: 1500.0,
            max_damping: 6.0,
        },
    };

    /// Without friction, steps or delay, and strong.
    pub const IDEAL: Self = Self {
        mass: 0.05,
        viscous: 0.0,
        dry: 0.0,
        resolution: 0.0,
        position_delay: 0.0,
        force_delay: 0.0,
        rate: 10_000.0,
        spec: DeviceSpec {
            max_force: 20.0,
            max_torque: 1.0,
            max_slew: 5000.0,
            max_stiffness: 3000.0,
            max_damping: 20.0,
        },
    };

    /// The named devices.
    pub const ALL: [(&'static str, Self); 4] = [
        ("falcon", Self::FALCON),
        ("touch", Self::TOUCH),
        ("inverse3", Self::INVERSE3),
        ("ideal", Self::IDEAL),
    ];
}

/// How a hand holds the device.
///
/// Stiffness from 200 to 800 N/m is what Hajian & Howe (1997, J. Biomech. Eng. 119:109) measured at the tip of a finger
/// from slight to strong activation, with damping ratios that fall from well damped to about a half. The masses, of the part of
/// the hand that moves with the device, are assumed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grip {
    /// Mass that moves with the device, kg.
    pub mass: f64,
    /// Damping towards the path, N s/m.
    pub damping: f64,
    /// Stiffness towards the path, N/m.
    pub stiffness: f64,
}

impl Grip {
    /// Barely held.
    pub const SOFT: Self = Self {
        mass: 0.03,
        damping: 3.0,
        stiffness: 200.0,
    };
    /// As a pen.
    pub const MEDIUM: Self = Self {
        mass: 0.06,
        damping: 5.0,
        stiffness: 400.0,
    };
    /// Held fast.
    pub const STIFF: Self = Self {
        mass: 0.1,
        damping: 9.0,
        stiffness: 800.0,
    };
}

/// Sets where a live hand wants to be and how it is turned, from any thread, without waiting.
///
/// The numbers are stored one after the other: a reader may see some old and some new, which for a hand that goes there
/// smoothly is no matter.
#[derive(Debug, Clone)]
pub struct LiveTarget(Arc<[AtomicU64; 7]>);

impl LiveTarget {
    /// At that point, m, not turned.
    pub fn new(at: Vec3) -> Self {
        let target = Self(Arc::new([0.0_f64; 7].map(|x| AtomicU64::new(x.to_bits()))));
        target.set_pose(&Pose::translation(at.x, at.y, at.z));
        target
    }

    /// Moves it, turned as it is; what is not finite is ignored.
    pub fn set(&self, at: Vec3) {
        if at.iter().all(|x| x.is_finite()) {
            self.store(0, at.as_slice());
        }
    }

    /// Moves and turns it; what is not finite is ignored.
    pub fn set_pose(&self, pose: &Pose) {
        let turn = pose.rotation.coords;
        if turn.iter().all(|x| x.is_finite()) {
            self.store(3, turn.as_slice());
        }
        self.set(pose.translation.vector);
    }

    /// Where it is, m.
    pub fn get(&self) -> Vec3 {
        Vec3::from_fn(|i, _| self.load(i))
    }

    /// How it is turned.
    pub fn turn(&self) -> UnitQuaternion<f64> {
        let coords = nalgebra::Vector4::from_fn(|i, _| self.load(3 + i));
        UnitQuaternion::try_new(coords.into(), 0.1).unwrap_or_default()
    }

    fn store(&self, first: usize, values: &[f64]) {
        for (cell, x) in self.0[first..].iter().zip(values) {
            cell.store(x.to_bits(), Ordering::Relaxed);
        }
    }

    fn load(&self, i: usize) -> f64 {
        f64::from_bits(self.0[i].load(Ordering::Relaxed))
    }
}

/// What the hand follows.
#[derive(Debug, Clone)]
enum Target {
    Path(Path),
    Live(LiveTarget),
}

/// A device of a model in a hand with a grip.
#[derive(Debug, Clone)]
pub struct SimulatedDevice {
    model: DeviceModel,
    grip: Grip,
    target: Target,
    time: f64,
    began: Option<f64>,
    position: Vec3,
    velocity: Vec3,
    wanted: Vec3,
    /// Of what a live target is followed with.
    wanted_velocity: Vec3,
    turned: UnitQuaternion<f64>,
    /// Newest first, one for each step.
    history: [Vec3; HISTORY],
    /// Commands that do not act yet, oldest first, and the one that acts.
    pending: [(f64, Vec3); 16],
    n_pending: usize,
    acting: Vec3,
    reading: Option<DeviceState>,
}

impl SimulatedDevice {
    /// In a hand that follows the path from the first reading on.
    pub fn new(model: DeviceModel, grip: Grip, path: Path) -> Self {
        let at = path.at(0.0);
        Self::starting(model, grip, Target::Path(path), at)
    }

    /// In a hand that goes where the target is set.
    pub fn live(model: DeviceModel, grip: Grip, target: LiveTarget) -> Self {
        let at = target.get();
        Self::starting(model, grip, Target::Live(target), at)
    }

    fn starting(model: DeviceModel, grip: Grip, target: Target, at: Vec3) -> Self {
        Self {
            model,
            grip,
            time: 0.0,
            began: None,
            position: at,
            velocity: Vec3::zeros(),
            wanted: at,
            wanted_velocity: Vec3::zeros(),
            turned: match &target {
                Target::Path(_) => UnitQuaternion::identity(),
                Target::Live(target) => target.turn(),
            },
            target,
            history: [at; HISTORY],
            pending: [(0.0, Vec3::zeros()); 16],
            n_pending: 0,
            acting: Vec3::zeros(),
            reading: None,
        }
    }

    /// Where the hand-piece truly is, m.
    pub fn position(&self) -> Vec3 {
        self.position
    }

    /// The force that acts on it, N.
    pub fn acting_force(&self) -> Vec3 {
        self.acting
    }

    fn advance(&mut self, now: f64) {
        if !now.is_finite() {
            return;
        }
        if self.began.is_none() {
            self.began = Some(now);
            self.time = now;
        }
        if now - self.time > MAX_GAP {
            self.time = now - MAX_GAP;
        }
        while self.time + STEP <= now + 1e-9 {
            self.step();
        }
    }

    fn step(&mut self) {
        while self.n_pending > 0 && self.pending[0].0 <= self.time + 1e-9 {
            self.acting = self.pending[0].1;
            self.pending.rotate_left(1);
            self.n_pending -= 1;
        }
        let next = match &self.target {
            Target::Path(path) => path.at(self.time + STEP - self.began.unwrap_or(0.0)),
            Target::Live(target) => {
                let pull = (target.get() - self.wanted) / FOLLOW_TIME - self.wanted_velocity * 2.0;
                let velocity = self.wanted_velocity + pull * (STEP / FOLLOW_TIME);
                self.wanted_velocity = velocity.cap_magnitude(FOLLOW_SPEED);
                let share = STEP / FOLLOW_TIME;
                self.turned = self
                    .turned
                    .try_slerp(&target.turn(), share, 1e-9)
                    .unwrap_or(self.turned);
                self.wanted + self.wanted_velocity * STEP
            }
        };
        let target_velocity = (next - self.wanted) / STEP;
        let middle = (self.wanted + next) * 0.5;
        self.wanted = next;
        let mass = self.model.mass + self.grip.mass;
        let Grip {
            damping, stiffness, ..
        } = self.grip;
        // For the mean velocity of the step, all forces but dry friction.
        let inertia = 2.0 * mass / STEP + damping + self.model.viscous + 0.5 * STEP * stiffness;
        let push = self.velocity * (2.0 * mass / STEP)
            + self.acting
            + (middle - self.position) * stiffness
            + target_velocity * damping;
        let push_size = push.norm();
        if push_size <= self.model.dry {
            self.velocity = Vec3::zeros();
        } else {
            let mean = push * ((1.0 - self.model.dry / push_size) / inertia);
            self.velocity = mean * 2.0 - self.velocity;
            self.position += mean * STEP;
        }
        self.time += STEP;
        self.history.rotate_right(1);
        self.history[0] = self.position;
    }
}

impl HapticDevice for SimulatedDevice {
    fn spec(&self) -> DeviceSpec {
        self.model.spec
    }

    fn read(&mut self, now: f64) -> Result<DeviceState, DeviceFault> {
        self.advance(now);
        if let Some(reading) = self.reading
            && now - reading.time < 1.0 / self.model.rate - 1e-6
        {
            return Ok(reading);
        }
        let back = (self.model.position_delay / STEP).round() as usize;
        let seen = self.history[back.min(HISTORY - 1)];
        let step = self.model.resolution;
        let seen = if step > 0.0 {
            seen.map(|x| (x / step).round() * step)
        } else {
            seen
        };
        let reading = DeviceState {
            time: now,
            pose: Pose::from_parts(seen.into(), self.turned),
            velocity: Vec3::zeros(),
            buttons: 0,
        };
        self.reading = Some(reading);
        Ok(reading)
    }

    fn write(&mut self, now: f64, command: &ForceCommand) -> Result<(), DeviceFault> {
        let size = command.force.norm();
        let force = if size.is_finite() && size > self.model.spec.max_force {
            command.force * (self.model.spec.max_force / size)
        } else if size.is_finite() {
            command.force
        } else {
            Vec3::zeros()
        };
        if self.n_pending == self.pending.len() {
            self.pending.rotate_left(1);
            self.n_pending -= 1;
        }
        self.pending[self.n_pending] = (now + self.model.force_delay, force);
        self.n_pending += 1;
        Ok(())
    }
}

/// An ideal device whose pose *is* the path, whatever the force: for accuracy.
#[derive(Debug, Clone)]
pub struct Scripted {
    path: Path,
    spec: DeviceSpec,
    began: Option<f64>,
    last: ForceCommand,
}

impl Scripted {
    /// Along the path from the first reading on.
    pub fn new(path: Path, spec: DeviceSpec) -> Self {
        Self {
            path,
            spec,
            began: None,
            last: ForceCommand::ZERO,
        }
    }

    /// What was commanded last.
    pub fn command(&self) -> ForceCommand {
        self.last
    }
}

impl HapticDevice for Scripted {
    fn spec(&self) -> DeviceSpec {
        self.spec
    }

    fn read(&mut self, now: f64) -> Result<DeviceState, DeviceFault> {
        let began = *self.began.get_or_insert(now);
        let at = self.path.at(now - began);
        Ok(DeviceState {
            time: now,
            pose: Pose::translation(at.x, at.y, at.z),
            velocity: Vec3::zeros(),
            buttons: 0,
        })
    }

    fn write(&mut self, _now: f64, command: &ForceCommand) -> Result<(), DeviceFault> {
        self.last = *command;
        Ok(())
    }
}
