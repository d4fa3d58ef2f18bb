//! The device and the motion of the hand in real time.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The haptic device used in real time, and the grip of the hand on it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Device {
    /// How the device is driven.
    pub kind: DeviceKind,
    /// The model of the device.
    pub preset: DevicePreset,
    /// The grip of the simulated hand.
    pub grip: Grip,
}

/// How a device is driven.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DeviceKind {
    /// Simulated: with mass, friction, sensor resolution and delays of the real device, in a
    /// simulated hand.
    #[default]
    Simulated,
}

/// The devices with known data.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DevicePreset {
    /// Novint Falcon.
    #[default]
    Falcon,
    /// 3D Systems Touch, formerly Phantom Omni.
    Touch,
    /// Haply Inverse3.
    Inverse3,
    /// Strong, without friction, sensor steps and delay.
    Ideal,
}

impl DevicePreset {
    /// Its name in a scene.
    pub fn name(self) -> &'static str {
        match self {
            Self::Falcon => "falcon",
            Self::Touch => "touch",
            Self::Inverse3 => "inverse3",
            Self::Ideal => "ideal",
        }
    }
}

/// How firmly a hand holds a device.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Grip {
    /// Barely held.
    Soft,
    /// Held like a pen.
    #[default]
    Medium,
    /// Held firmly.
    Stiff,
}

impl Grip {
    /// Its name in a scene.
    pub fn name(self) -> &'static str {
        match self {
            Self::Soft => "soft",
            Self::Medium => "medium",
            Self::Stiff => "stiff",
        }
    }
}

/// The motion of the hand in real time, repeated. Lengths in metres, times in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Kind of motion.
    pub kind: MotionKind,
    /// Depth that the hand moves to, from the first touch of the tool.
    pub depth: f64,
    /// Largest speed of the hand, in m/s.
    pub speed: f64,
    /// Time that the hand rests at the depth.
    pub hold: f64,
    /// Length of a stroke, drag or palpation across the skin.
    pub length: f64,
    /// Unit vector of its direction; only the part along the skin counts. `None` is the tool's
    /// first axis.
    pub along: Option<[f64; 3]>,
    /// Number of taps, of drags there and back, or of palpated places, at least 1.
    pub times: u32,
    /// Tremor of the hand, as the root mean square.
    pub tremor: f64,
    /// Height above the skin at the start and end.
    pub above: f64,
}

/// The motions of a hand.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MotionKind {
    /// Down, rest, up.
    #[default]
    Press,
    /// Down, across the skin, up.
    Stroke,
    /// Down, across the skin and back, up.
    Drag,
    /// Quick short presses.
    Tap,
    /// Presses at places along a line, with small circles at each, as a physician feels for a lump.
    Palpate,
}

impl MotionKind {
    /// Its name in a scene.
    pub fn name(self) -> &'static str {
        match self {
            Self::Press => "press",
            Self::Stroke => "stroke",
            Self::Drag => "drag",
            Self::Tap => "tap",
            Self::Palpate => "palpate",
        }
    }

    /// Whether the motion goes across the skin.
    pub fn goes_across(self) -> bool {
        matches!(self, Self::Stroke | Self::Drag | Self::Palpate)
    }
}
