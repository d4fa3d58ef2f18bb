//! A wrapper that makes any device show faults on purpose.

use crate::{DeviceFault, HapticDevice};
use palpa_servo::{DeviceSpec, DeviceState, ForceCommand, Vec3};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A fault of a device.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Fault {
    /// The position is wrong by this vector, m.
    Jump(Vec3),
    /// The position is not a number.
    NotANumber,
    /// Every reading is the same.
    Stall,
    /// The device is not connected.
    Unplug,
    /// No answer in time.
    Late,
}

/// Turns a fault on and off, from any thread, without waiting.
#[derive(Debug, Clone, Default)]
pub struct FaultSwitch(Arc<AtomicBool>);

impl FaultSwitch {
    /// Turns the fault on or off.
    pub fn set(&self, is_on: bool) {
        self.0.store(is_on, Ordering::Relaxed);
    }
}

/// When a fault is active.
#[derive(Debug, Clone)]
enum When {
    /// From the first to the second moment of the loop's clock, s.
    Between(f64, f64),
    Switched(FaultSwitch),
}

impl When {
    fn is_now(&self, now: f64) -> bool {
        match self {
            Self::Between(from, to) => (*from..*to).contains(&now),
            Self::Switched(switch) => switch.0.load(Ordering::Relaxed),
        }
    }
}

/// A device with faults: between given moments, or while a switch is on.
#[derive(Debug, Clone)]
pub struct Faulty<D> {
    inner: D,
    faults: Vec<(When, Fault)>,
    last: Option<DeviceState>,
}

impl<D> Faulty<D> {
    /// Wraps a device, without faults yet.
    pub fn new(inner: D) -> Self {
        Self {
            inner,
            faults: Vec::new(),
            last: None,
        }
    }

    /// Adds a fault that is active from one moment of the loop's clock to another, s.
    #[must_use]
    pub fn with(mut self, from: f64, to: f64, fault: Fault) -> Self {
        self.faults.push((When::Between(from, to), fault));
        self
    }

    /// Adds a fault that is active while the switch is on.
    #[must_use]
    pub fn with_switch(mut self, switch: &FaultSwitch, fault: Fault) -> Self {
        self.faults.push((When::Switched(switch.clone()), fault));
        self
    }

    /// The wrapped device.
    pub fn inner(&self) -> &D {
        &self.inner
    }

    fn fault_at(&self, now: f64) -> Option<Fault> {
        self.faults
            .iter()
            .find(|(when, _)| when.is_now(now))
            .map(|(_, fault)| *fault)
    }
}

impl<D: HapticDevice> HapticDevice for Faulty<D> {
    fn spec(&self) -> DeviceSpec {
        self.inner.spec()
    }

    fn resolution(&self) -> f64 {
        self.inner.resolution()
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
