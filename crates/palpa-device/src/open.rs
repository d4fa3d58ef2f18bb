//! Opens a device from its description, so that programs need not name its type.

use crate::{DeviceFault, DeviceModel, Grip, HandTarget, HapticDevice, SimulatedDevice};

/// The code that drives a device: one variant for each type of device that a program can open.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Driver {
    /// A simulated device in a simulated hand.
    #[default]
    Simulated,
}

/// Description of a device and of the hand that holds it.
///
/// ```
/// use palpa_device::{DeviceModel, DeviceSetup, Driver, Grip, LiveTarget, Vec3};
///
/// let target = LiveTarget::new(Vec3::zeros());
/// let mut device = DeviceSetup {
///     driver: Driver::Simulated,
///     model: DeviceModel::TOUCH,
///     grip: Grip::MEDIUM,
///     target: target.clone().into(),
/// }
/// .open()?;
/// assert_eq!(device.resolution(), DeviceModel::TOUCH.resolution);
/// device.read(0.0)?;
/// target.set(Vec3::new(0.0, 0.0, 0.01)); // and the hand goes there
/// # Ok::<(), palpa_device::DeviceFault>(())
/// ```
#[derive(Debug, Clone)]
pub struct DeviceSetup {
    /// The code that drives it.
    pub driver: Driver,
    /// Figures of the device. The driver of a real device takes the limits and the sensor's step
    /// from here.
    pub model: DeviceModel,
    /// Grip of the simulated hand; unused when a person holds the device.
    pub grip: Grip,
    /// Motion of the simulated hand; unused when a person holds the device.
    pub target: HandTarget,
}

impl DeviceSetup {
    /// Opens the device.
    ///
    /// # Errors
    /// If a real device is not connected or does not answer. A simulated device always opens.
    pub fn open(self) -> Result<Box<dyn HapticDevice>, DeviceFault> {
        match self.driver {
            Driver::Simulated => Ok(Box::new(SimulatedDevice::following(
                self.model,
                self.grip,
                self.target,
            ))),
        }
    }
}
