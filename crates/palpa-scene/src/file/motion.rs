//! The device and the hand's motion in a scene file.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::AxisSpec;
use crate::motion::{DeviceKind, DevicePreset, Grip, MotionKind};
use crate::units::{Length, Time, Velocity};

/// The haptic device that presses in real time (`palpa loop-report`), and how it is held.
#[derive(Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct DeviceTable {
    /// How the device is driven. Default: "simulated".
    pub(crate) kind: DeviceKind,
    /// Which device. Default: "falcon".
    pub(crate) preset: DevicePreset,
    /// How a simulated hand holds it. Default: "medium".
    pub(crate) grip: Grip,
}

/// How the simulated hand moves in real time, over and over.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct MotionTable {
    /// What it does. Default: "press".
    pub(crate) kind: MotionKind,
    /// How far down the hand goes, from where the tool first touches, 1 µm to 500 mm. The tool stays higher, since the
    /// hand gives way. Default: as in [press].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) depth: Option<Length>,
    /// Its largest speed, 0.01 mm/s to 1 m/s. Default: "50 mm/s".
    pub(crate) speed: Velocity,
    /// How long it rests at the depth, 0 s to 600 s. Default: "0.5 s".
    pub(crate) hold: Time,
    /// How far it strokes, drags or palpates across the skin, 0.1 mm to 500 mm, half of it on each side of the place that
    /// is pressed. Default: "20 mm".
    pub(crate) length: Length,
    /// The direction in which it does: "x", "y", "z" or three numbers, of which the part along the skin counts. Default:
    /// the tool's `axis`, or any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) along: Option<AxisSpec>,
    /// How often it taps or drags there and back, or at how many places it palpates, 1 to 100. Default: 3.
    pub(crate) times: u32,
    /// How much the hand trembles, root of the mean square of 8 to 12 Hz, 0 m to 5 mm; a healthy hand 0.05 mm to 0.2 mm.
    /// Default: "0 mm".
    pub(crate) tremor: Length,
    /// How high over the skin it begins and ends, 0.1 mm to 100 mm. Default: "5 mm".
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
