//! Faults on purpose, in front of any device.

use crate::{DeviceFault, HapticDevice};
use palpa_servo::{DeviceSpec, DeviceState, ForceCommand, Vec3};

/// What goes wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Fault {
    /// The position is off by this, m.
    Jump(Vec3),
    /// The position is not a number.
    NotANumber,
    /// The same reading again and again.
    Stall,
    /// Nothing there.
    Unplug,
    /// No answer in time.
    Late,
}

/// A device with faults, each from one moment of the loop's clock to another, s.
#[derive(Debug, Clone)]
pub struct Faulty<D> {
    inner: D,
    faults: Vec<(f64, f64, Fault)>,
    last: Option<DeviceState>,
}

impl<D> Faulty<D> {
    /// Without faults yet.
    pub fn new(inner: D) -> Self {
        Self {
            inner,
            faults: Vec::new(),
            last: None,
        }
    }

    /// With one more fault.
    #[must_use]
    pub fn with(mut self, from: f64, to: f64, fault: Fault) -> Self {
        self.faults.push((from, to, fault));
        self
    }

    /// The device behind.
    pub fn inner(&self) -> &D {
        &self.inner
    }

    fn fault_at(&self, now: f64) -> Option<Fault> {
        self.faults
            .iter()
            .find(|(from, to, _)| (*from..*to).contains(&now))
            .map(|(_, _, fault)| *fault)
    }
}

impl<D: HapticDevice> HapticDevice for Faulty<D> {
    fn spec(&self) -> DeviceSpec {
        self.inner.spec()
    }

    fn read(&mut self, now: f64) -> Result<DeviceState, DeviceFault> {
        let mut state = self.inner.read(now)?;
        match self.fault_at(now) {
            Some(Fault::Jump(by)) => state.pose.translation.vector += by,
            Some(Fault::NotANumber) => state.pose.translation.vector.x = f64::NAN,
            Some(Fault::Stall) => state = self.last.unwrap_or(state),
            Some(Fault::Unplug) => return Err(DeviceFault::Unplugged),
            Some(Fault::Late) => return Err(DeviceFault::TimedOut),
            None => {}
        }
        self.last = Some(state);
        Ok(state)
    }

    fn write(&mut self, now: f64, command: &ForceCommand) -> Result<(), DeviceFault> {
        match self.fault_at(now) {
            Some(Fault::Unplug) => {
                // A device without power exerts nothing.
                self.inner.write(now, &ForceCommand::ZERO)?;
                Err(DeviceFault::Unplugged)
            }
            _ => self.inner.write(now, command),
        }
    }
}
