//! From the device and the hand's motion back to their tables.

use super::direction;
use crate::file::{DeviceTable, MotionTable};
use crate::motion::{Device, Motion};
use crate::units::{Length, Time, Velocity};

pub(super) fn device(device: Device) -> DeviceTable {
    DeviceTable {
        kind: device.kind,
        preset: device.preset,
        grip: device.grip,
    }
}

pub(super) fn motion(motion: &Motion) -> MotionTable {
    MotionTable {
        kind: motion.kind,
        depth: Some(Length::from_si(motion.depth)),
        speed: Velocity::from_si(motion.speed),
        hold: Time::from_si(motion.hold),
        length: Length::from_si(motion.length),
        along: motion.along.map(direction),
        times: motion.times,
        tremor: Length::from_si(motion.tremor),
        above: Length::from_si(motion.above),
    }
}
