//! A simulated device in a simulated hand.
//!
//! ```text
//! (m_d + m_h) a = F − b_d v − c v/|v| + k (p(t) − x) + b (p'(t) − v)        |stiction| ≤ c
//! ```
//! The device has mass, viscous and dry friction, a position sensor with steps, a largest force,
//! and delays. The hand is a mass on a spring and a damper that follows a path. The equation is
//! integrated in steps of 0.1 ms with the implicit midpoint rule, so the integrator neither damps
//! an oscillation nor feeds it. Dry friction is exact within a step. The force from the loop is
//! held between two writes, as by a real amplifier; therefore a loop that is unstable at 1 kHz is
//! unstable here too.

use crate::hand::Hand;
use crate::{DeviceFault, DeviceModel, Grip, HandTarget, HapticDevice, LiveTarget, Path};
use palpa_servo::{DeviceSpec, DeviceState, ForceCommand, Pose, Vec3};

/// Integration step, s.
const STEP: f64 = 1e-4;
/// Length of the position history, in steps; no delay may be longer.
const HISTORY: usize = 128;
/// Longest time that one call integrates, s. After a longer gap of the clock, the rest is skipped.
const MAX_GAP: f64 = 0.25;

/// A device of a model, in a hand with a grip.
#[derive(Debug, Clone)]
pub struct SimulatedDevice {
    model: DeviceModel,
    hand: Hand,
    time: f64,
    began: Option<f64>,
    position: Vec3,
    velocity: Vec3,
    /// Positions, m, one for each step, newest first.
    history: [Vec3; HISTORY],
    /// Forces that do not act yet: the moment at which each begins to act, s, and the force, N;
    /// oldest first.
    pending: [(f64, Vec3); 16],
    n_pending: usize,
    acting: Vec3,
    reading: Option<DeviceState>,
}

impl SimulatedDevice {
    /// A device in a hand that follows a path, starting at the first reading.
    pub fn new(model: DeviceModel, grip: Grip, path: Path) -> Self {
        Self::following(model, grip, path.into())
    }

    /// A device in a hand that follows a live target.
    pub fn live(model: DeviceModel, grip: Grip, target: LiveTarget) -> Self {
        Self::following(model, grip, target.into())
    }

    /// A device in a hand that follows a path or a live target.
    pub fn following(model: DeviceModel, grip: Grip, target: HandTarget) -> Self {
        let hand = Hand::new(grip, target);
        let at = hand.wanted;
        Self {
            model,
            hand,
            time: 0.0,
            began: None,
            position: at,
            velocity: Vec3::zeros(),
            history: [at; HISTORY],
            pending: [(0.0, Vec3::zeros()); 16],
            n_pending: 0,
            acting: Vec3::zeros(),
            reading: None,
        }
    }

    /// True position of the hand-piece, m, without delay or sensor steps.
    pub fn position(&self) -> Vec3 {
        self.position
    }

    /// Force that acts on the hand-piece now, N.
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
        let since_start = self.time + STEP - self.began.unwrap_or(0.0);
        let pull = self.hand.advance(since_start, STEP);
        let mass = self.model.mass + self.hand.grip.mass;
        let Grip {
            damping, stiffness, ..
        } = self.hand.grip;
        // Solve for the mean velocity of the step, with all forces except dry friction.
        let inertia = 2.0 * mass / STEP + damping + self.model.viscous + 0.5 * STEP * stiffness;
        let push = self.velocity * (2.0 * mass / STEP)
            + self.acting
            + (pull.middle - self.position) * stiffness
            + pull.velocity * damping;
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

    fn resolution(&self) -> f64 {
        self.model.resolution
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
            pose: Pose::from_parts(seen.into(), self.hand.turned),
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
