//! The device and the hand's motion in a scene file.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::AxisSpec;
use crate::motion::{DeviceKind, DevicePreset, Grip, MotionKind};
use crate::units::{Length, Time, Velocity};

/// The haptic device used in real time (`palpa loop-report`), and the grip of the hand on it.
#[derive(Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct DeviceTable {
    /// How the device is driven. Default: "simulated".
    pub(crate) kind: DeviceKind,
    /// The model of the device. Default: "falcon".
    pub(crate) preset: DevicePreset,
    /// The grip of the simulated hand. Default: "medium".
    pub(crate) grip: Grip,
}

/// The motion of the simulated hand in real time. It is repeated.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct MotionTable {
    /// Kind of motion. Default: "press".
    pub(crate) kind: MotionKind,
    /// Depth that the hand moves to, from the first touch of the tool, 1 µm to 500 mm. The tool
    /// stays higher, because the hand gives way. Default: as in [press].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) depth: Option<Length>,
    /// Largest speed of the hand, 0.01 mm/s to 1 m/s. Default: "50 mm/s".
    pub(crate) speed: Velocity,
    /// Time that the hand rests at the depth, 0 s to 600 s. Default: "0.5 s".
    pub(crate) hold: Time,
    /// Length of a stroke, drag or palpation across the skin, 0.1 mm to 500 mm. Half of it lies on
    /// each side of the pressed place. Default: "20 mm".
    pub(crate) length: Length,
    /// Direction of a stroke, drag or palpation: "x", "y", "z" or three numbers. Only the part
    /// along the skin counts. Default: the tool's `axis`, or any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) along: Option<AxisSpec>,
    /// Number of taps, of drags there and back, or of palpated places, 1 to 100. Default: 3.
    pub(crate) times: u32,
    /// Tremor of the hand, as the root mean square of a motion at 8 to 12 Hz, 0 m to 5 mm. A
    /// healthy hand has 0.05 mm to 0.2 mm. Default: "0 mm".
    pub(crate) tremor: Length,
    /// Height of the tool above the skin at the start and end, 0.1 mm to 100 mm. Default: "5 mm".
    pub(crate) above: Length,
}

impl Default for MotionTable {
    fn default() -> Self {
        Self {
            kind: MotionKind::default(),
            depth: None,
            speed: Velocity::from_si(0.05),
            hold: Time::from_si(0.5),
            length: Length::from_si(0.02),
            along: None,
            times: 3,
            tremor: Length::from_si(0.0),
            above: Length::from_si(5e-3),
        }
    }
}
