//! The trait of a haptic device. To add a device:
//!
//! 1. Write a file in `src/` with its type and its `impl` of [`HapticDevice`]; `scripted.rs` is the
//!    shortest one.
//! 2. Add a variant to [`Driver`](crate::Driver) in `open.rs`; the compiler then asks for the line
//!    that opens it.
//! 3. Add a test in `tests/it/`, named like the file: readings, limits, and the [`DeviceFault`]
//!    when it is gone.
//! 4. If scene files shall name it: a variant of the scene's `DeviceKind`, which callers match to a
//!    `Driver`.
//!
//! Nothing else changes: the loop, the recorder and the replay know the trait only.

use palpa_servo::{DeviceSpec, DeviceState, ForceCommand};

/// Why a device did not do what it was asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DeviceFault {
    /// It is not connected, or not any more.
    #[error("the device is not connected; plug it in and give it power")]
    Unplugged,
    /// It did not answer in time; the next call may succeed.
    #[error("the device did not answer in time")]
    TimedOut,
    /// Its answer makes no sense.
    #[error("the device answered what cannot be understood")]
    Garbled,
}

/// A hand-piece that tells its pose and exerts a force. No call may wait longer than a tick,
/// allocate, lock or log.
///
/// `now` is the loop's clock, s. A real device does not need it; a simulated one lives by it.
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

    /// Exerts a force from now on until the next is written.
    ///
    /// # Errors
    /// If the device does not take it.
    fn write(&mut self, now: f64, command: &ForceCommand) -> Result<(), DeviceFault>;
}

/// A device that was opened by name can stand behind [`Faulty`](crate::Faulty) too.
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
