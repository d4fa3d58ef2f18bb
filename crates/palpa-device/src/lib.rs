//! Haptic devices behind one trait, and a simulated device in a simulated hand.
//!
//! ```
//! use palpa_device::{DeviceModel, Grip, HapticDevice, Path, SimulatedDevice, Vec3};
//! use palpa_servo::ForceCommand;
//!
//! let path = Path::press(Vec3::zeros(), -Vec3::z(), 0.01, 0.05, 1.0);
//! let mut device = SimulatedDevice::new(DeviceModel::FALCON, Grip::MEDIUM, path);
//! for tick in 0..2000 {
//!     let now = f64::from(tick) * 1e-3;
//!     let state = device.read(now)?;
//!     let up = (-200.0 * state.pose.translation.vector.z).max(0.0);
//!     device.write(now, &ForceCommand { force: Vec3::new(0.0, 0.0, up), ..ForceCommand::ZERO })?;
//! }
//! // Two springs, the hand's and the wall's, but for the dry friction.
//! assert!((device.position().z + 0.01 * 400.0 / 600.0).abs() < 0.15 / 600.0);
//! # Ok::<(), palpa_device::DeviceFault>(())
//! ```

mod device;
mod faulty;
mod hand;
mod model;
mod open;
mod path;
mod scripted;
mod simulated;

mod bed;
mod trial;

pub use bed::{Bed, BedParams};
pub use device::{DeviceFault, HapticDevice};
pub use faulty::{Fault, FaultSwitch, Faulty};
pub use hand::{Grip, HandTarget, LiveTarget};
pub use model::DeviceModel;
pub use open::{DeviceSetup, Driver};
pub use palpa_servo::Vec3;
pub use path::Path;
pub use scripted::Scripted;
pub use simulated::SimulatedDevice;
pub use trial::{Latest, Sample, Trial, TrialReport, ZWidthPoint, band_rms, z_width};
