//! Who presses in real time, and how the hand moves.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The haptic device that presses in real time, and how it is held.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Device {
    /// How it is driven.
    pub kind: DeviceKind,
    /// Which device.
    pub preset: DevicePreset,
    /// How a simulated hand holds it.
    pub grip: Grip,
}

/// How a device is driven.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DeviceKind {
    /// Computed: mass, friction, sensor steps and delays of the real one, in a simulated hand.
    #[default]
    Simulated,
}

/// The devices whose figures are known.
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
    /// Without friction, sensor steps and delay, and strong.
    Ideal,
}

impl DevicePreset {
    /// Its word in a scene.
    pub fn name(self) -> &'static str {
        match self {
            Self::Falcon => "falcon",
            Self::Touch => "touch",
            Self::Inverse3 => "inverse3",
            Self::Ideal => "ideal",
        }
    }
}

/// How fast a hand holds a device.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Grip {
    /// Barely held.
    Soft,
    /// As a pen.
    #[default]
    Medium,
    /// Held fast.
    Stiff,
}

impl Grip {
    /// Its word in a scene.
    pub fn name(self) -> &'static str {
        match self {
            Self::Soft => "soft",
            Self::Medium => "medium",
            Self::Stiff => "stiff",
        }
    }
}

/// How the hand moves in real time, over and over. Lengths in metres, times in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// What it does.
    pub kind: MotionKind,
    /// How far down the hand goes, from where the tool first touches.
    pub depth: f64,
    /// Its largest speed, in m/s.
    pub speed: f64,
    /// How long it rests at the depth.
    pub hold: f64,
    /// How far it strokes, drags or palpates across the skin.
    pub length: f64,
    /// Unit vector along which it does; its part along the skin counts. `None` is the tool's first axis.
    pub along: Option<[f64; 3]>,
    /// How often it taps or drags there and back, or at how many places it palpates, at least 1.
    pub times: u32,
    /// How much the hand trembles: root of the mean square.
    pub tremor: f64,
    /// How high over the skin it begins and ends.
    pub above: f64,
}

/// The motions of a hand.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MotionKind {
    /// Down, rest, up.
    #[default]
    Press,
    /// Down, across, up.
    Stroke,
    /// Down, there and back across, up.
    Drag,
    /// Quick short presses.
    Tap,
    /// Pressed at places along a line, with small circles at each, as a physician feels for a lump.
    Palpate,
}

impl MotionKind {
    /// Its word in a scene.
    pub fn name(self) -> &'static str {
        match self {
            Self::Press => "press",
            Self::Stroke => "stroke",
            Self::Drag => "drag",
            Self::Tap => "tap",
            Self::Palpate => "palpate",
        }
    }

    /// Whether it goes across the skin.
    pub fn goes_across(self) -> bool {
        matches!(self, Self::Stroke | Self::Drag | Self::Palpate)
    }
}
