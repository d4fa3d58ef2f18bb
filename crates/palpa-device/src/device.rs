//! The trait.

use palpa_servo::{DeviceSpec, DeviceState, ForceCommand};

/// Why a device did not do what it was asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DeviceFault {
    /// It is not there (any more).
    #[error("the device is not connected; plug it in and give it power")]
    Unplugged,
    /// It did not answer in time; the next call may succeed.
    #[error("the device did not answer in time")]
    TimedOut,
    /// It answered what cannot be understood.
    #[error("the device answered what cannot be understood")]
    Garbled,
}

/// A hand-piece that says where it is and exerts a force. No call may wait longer than a tick, allocate, lock or log.
///
/// `now` is the loop's clock, s: a real device does not need it, a simulated one lives by it.
pub trait HapticDevice: Send {
    /// What the device can do.
    fn spec(&self) -> DeviceSpec;

    /// Where the hand-piece is.
    ///
    /// # Errors
    /// If the device gives no reading.
    fn read(&mut self, now: f64) -> Result<DeviceState, DeviceFault>;

    /// Exerts the force from now on until the next is written.
    ///
    /// # Errors
    /// If the device does not take it.
    fn write(&mut self, now: f64, command: &ForceCommand) -> Result<(), DeviceFault>;
}
