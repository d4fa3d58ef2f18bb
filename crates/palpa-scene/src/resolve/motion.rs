//! The device and the hand's motion.

use super::{Reader, direction};
use crate::SceneError;
use crate::file::{DeviceTable, MotionTable};
use crate::limits;
use crate::motion::{Device, Motion};
use crate::scene::Press;

impl Reader<'_> {
    pub(super) fn motion(&self, motion: &MotionTable, press: &Press) -> Result<Motion, SceneError> {
        let at = self.site("motion");
        let along = match motion.along {
            None => None,
            Some(axis) => Some(direction(&at.key("along"), axis)?),
        };
        let depth = match motion.depth {
            None => press.depth,
            Some(depth) => at.key("depth").within(depth, &limits::DEPTH)?.si(),
        };
        Ok(Motion {
            kind: motion.kind,
            depth,
            speed: at.key("speed").within(motion.speed, &limits::SPEED)?.si(),
            hold: at.key("hold").within(motion.hold, &limits::HOLD)?.si(),
            length: (at.key("length").within(motion.length, &limits::ACROSS)?).si(),
            along,
            times: at.key("times").within(motion.times, &limits::CYCLES)?,
            tremor: (at.key("tremor").within(motion.tremor, &limits::TREMOR)?).si(),
            above: at.key("above").within(motion.above, &limits::ABOVE)?.si(),
        })
    }
}

/// The device's keys have no ranges to check.
pub(super) fn device(device: &DeviceTable) -> Device {
    Device {
        kind: device.kind,
        preset: device.preset,
        grip: device.grip,
    }
}
