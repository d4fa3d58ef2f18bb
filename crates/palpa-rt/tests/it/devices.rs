//! Devices that follow a script and fail on command.

use crate::toy::RADIUS;
use palpa_device::{DeviceFault, HapticDevice};
use palpa_rt::{Clock, RealClock};
use palpa_servo::{DeviceSpec, DeviceState, ForceCommand, Pose, Vec3};
use std::{
    f64::consts::TAU,
    sync::{
        Arc,
        atomic::{AtomicU8, AtomicU64, Ordering},
    },
    thread::{self, Thread},
    time::{Duration, Instant},
};

/// A condition that does not come true in this time is a hang. No outcome depends on it otherwise.
const HANG: Duration = Duration::from_mins(2);

/// Waits until something is so. It is asked whenever the loop reads a device of [`announced`],
/// which wakes the thread that made the device.
pub(crate) fn until(what: &str, mut is_so: impl FnMut() -> bool) {
    let since = Instant::now();
    while !is_so() {
        thread::park_timeout(HANG);
        assert!(since.elapsed() < HANG, "still not so: {what}");
    }
}

/// A device that wakes the thread that made it, for [`until`], whenever the loop reads it.
#[derive(Debug)]
struct Announced<D> {
    inner: D,
    waiter: Thread,
}

pub(crate) fn announced(device: impl HapticDevice + 'static) -> Box<dyn HapticDevice> {
    Box::new(Announced {
        inner: device,
        waiter: thread::current(),
    })
}

impl<D: HapticDevice> HapticDevice for Announced<D> {
    fn spec(&self) -> DeviceSpec {
        self.inner.spec()
    }

    fn read(&mut self, now: f64) -> Result<DeviceState, DeviceFault> {
        self.waiter.unpark();
        self.inner.read(now)
    }

    fn write(&mut self, now: f64, command: &ForceCommand) -> Result<(), DeviceFault> {
        self.inner.write(now, command)
    }
}

pub(crate) const SPEC: DeviceSpec = DeviceSpec {
    max_force: 3.0,
    max_torque: 0.0,
    max_slew: 2000.0,
    max_stiffness: 3000.0,
    max_damping: 10.0,
};

/// A fault of a scripted device.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(u8)]
pub(crate) enum Ill {
    No,
    Unplugged,
    NaN,
    /// Its reading stands still.
    Stalled,
    /// It stands 20 mm off.
    Jumped,
    /// Each reading takes 5 ms.
    Slow,
}

/// The hand on a scripted device.
#[derive(Debug, Clone, Default)]
pub(crate) struct Hand {
    ill: Arc<AtomicU8>,
    last_force: Arc<AtomicU64>,
}

impl Hand {
    pub(crate) fn make(&self, ill: Ill) {
        self.ill.store(ill as u8, Ordering::Relaxed);
    }

    /// Size of the force written last, N.
    pub(crate) fn force(&self) -> f64 {
        f64::from_bits(self.last_force.load(Ordering::Relaxed))
    }
}

/// Moves up and down over the bed, always pressing: depth 1 to 4 mm, with a sway to the side.
#[derive(Debug)]
pub(crate) struct Scripted {
    pub(crate) hand: Hand,
    pub(crate) frozen: Option<(f64, Vec3)>,
    /// Hertz.
    pub(crate) rate: f64,
    pub(crate) amplitude: f64,
}

impl Scripted {
    pub(crate) fn new(hand: &Hand) -> Self {
        Self {
            hand: hand.clone(),
            frozen: None,
            rate: 1.3,
            amplitude: 0.0015,
        }
    }

    fn position(&self, now: f64) -> Vec3 {
        let depth = 0.0025 - self.amplitude * (TAU * self.rate * now).cos();
        Vec3::new(
            0.001 * (TAU * 0.7 * now).sin(),
            0.0003 * now.sin(),
            RADIUS - depth,
        )
    }
}

impl HapticDevice for Scripted {
    fn spec(&self) -> DeviceSpec {
        SPEC
    }

    fn read(&mut self, now: f64) -> Result<DeviceState, DeviceFault> {
        let ill = self.hand.ill.load(Ordering::Relaxed);
        let is = |what: Ill| ill == what as u8;
        let (mut time, mut position) = (now, self.position(now));
        if is(Ill::Unplugged) {
            return Err(DeviceFault::Unplugged);
        }
        if is(Ill::NaN) {
            position.y = f64::NAN;
        }
        if is(Ill::Stalled) {
            (time, position) = *self.frozen.get_or_insert((time, position));
        } else {
            self.frozen = None;
        }
        if is(Ill::Jumped) {
            position.x += 0.02;
        }
        if is(Ill::Slow) {
            // The fault itself is time that goes by: the loop's clock is the machine's.
            let clock = RealClock::new(0.0);
            clock.wait_until(clock.now() + 5e-3);
        }
        Ok(DeviceState {
            time,
            pose: Pose::translation(position.x, position.y, position.z),
            velocity: Vec3::zeros(),
            buttons: 0,
        })
    }

    fn write(&mut self, _now: f64, command: &ForceCommand) -> Result<(), DeviceFault> {
        self.hand
            .last_force
            .store(command.force.norm().to_bits(), Ordering::Relaxed);
        if self.hand.ill.load(Ordering::Relaxed) == Ill::Unplugged as u8 {
            return Err(DeviceFault::Unplugged);
        }
        Ok(())
    }
}
