//! A device that follows a path and ignores the force.

use crate::{DeviceFault, HapticDevice, Path};
use palpa_servo::{DeviceSpec, DeviceState, ForceCommand, Pose, Vec3};

/// An ideal device whose pose *is* the path; forces do not move it. For tests of accuracy.
#[derive(Debug, Clone)]
pub struct Scripted {
    path: Path,
    spec: DeviceSpec,
    began: Option<f64>,
    last: ForceCommand,
}

impl Scripted {
    /// A device that starts along the path at the first reading.
    pub fn new(path: Path, spec: DeviceSpec) -> Self {
        Self {
            path,
            spec,
            began: None,
            last: ForceCommand::ZERO,
        }
    }

    /// The last command.
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
