//! The trait of a haptic device. To add a device:
//!
//! 1. Write a file in `src/` with its type and its `impl` of [`HapticDevice`] (`scripted.rs` is the
//!    shortest one), with its `mod` and `pub use` in `lib.rs`.
//! 2. Add a variant to [`Driver`](crate::Driver) in `open.rs`; the compiler then points to the
//!    place that must open it.
//! 3. Add a test in `tests/it/`, named like the file, with its `mod` in `tests/it/main.rs`:
//!    readings, limits, and the [`DeviceFault`] when the device is gone.
//! 4. If scene files must be able to name the device, add a variant of the scene's `DeviceKind`
//!    (`palpa-scene/src/motion.rs`); `open_device` in `palpa/src/live/hand.rs` gives it its
//!    `Driver`. Then bless and generate; `CONTRIBUTING.md` has the commands.
//! 5. Its figures, such as the limits of its force, are a [`DeviceModel`](crate::DeviceModel):
//!    `model.rs` says how to add one.
//!
//! Nothing else changes: the loop, the recorder and the replay know the trait only.

use palpa_servo::{DeviceSpec, DeviceState, ForceCommand};

/// Why a device did not deliver a reading or accept a force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DeviceFault {
    /// The device is not connected, or no longer connected.
    #[error("the device is not connected; connect it and switch on its power")]
    Unplugged,
    /// The device did not answer in time; the next call may succeed.
    #[error("the device did not answer in time")]
    TimedOut,
    /// The answer of the device makes no sense.
    #[error("the device sent a reply that Palpa does not understand")]
    Garbled,
}

/// A hand-piece that reports its pose and exerts a force. No call may allocate, lock, log, or wait
/// longer than a tick.
///
/// `now` is the loop's clock, s. A real device does not need it; a simulated device moves by it.
pub trait HapticDevice: Send {
    /// Limits of force and stability.
    fn spec(&self) -> DeviceSpec;

    /// Step of the position sensor, m; 0 if it has none or it is unknown. The loop takes no
    /// velocity from differences below it (`ServoParams::resolution`).
    fn resolution(&self) -> f64 {
        0.0
    }

    /// Pose of the hand-piece.
    ///
    /// # Errors
    /// If the device gives no reading.
    fn read(&mut self, now: f64) -> Result<DeviceState, DeviceFault>;

    /// Exerts this force until the next one is written.
    ///
    /// # Errors
    /// If the device does not accept the force.
    fn write(&mut self, now: f64, command: &ForceCommand) -> Result<(), DeviceFault>;
}

/// Lets a device behind a pointer, as [`DeviceSetup::open`](crate::DeviceSetup::open) returns it,
/// be wrapped in [`Faulty`](crate::Faulty).
impl<D: HapticDevice + ?Sized> HapticDevice for Box<D> {
    fn spec(&self) -> DeviceSpec {
        (**self).spec()
    }

    fn resolution(&self) -> f64 {
        (**self).resolution()
    }

    fn read(&mut self, now: f64) -> Result<DeviceState, DeviceFault> {
        (**self).read(now)
    }

    fn write(&mut self, now: f64, command: &ForceCommand) -> Result<(), DeviceFault> {
        (**self).write(now, command)
    }
}
