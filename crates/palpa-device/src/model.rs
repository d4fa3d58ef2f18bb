//! Figures of haptic devices: mass, friction, sensor, delays and limits.
//!
//! To add a device:
//!
//! 1. A constant of [`DeviceModel`] with the source of each figure in its doc comment, and a line in
//!    [`DeviceModel::ALL`]. Now it can be used from Rust, and `palpa z-width` tests it.
//! 2. For scenes: a variant of `DevicePreset` in `palpa-scene/src/motion.rs`, and its arm of
//!    `device_model` in `palpa/src/live/hand.rs`.
//! 3. For the page: bless and generate (`CONTRIBUTING.md` has the commands), then its name,
//!    `preset.…`, in `web/src/i18n/en.ts` and `ja.ts`.
//! 4. Its name and its wall in `docs/realtime.md`.

use palpa_servo::DeviceSpec;

/// The mechanics and the electronics of a device.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviceModel {
    /// Its name for people.
    pub title: &'static str,
    /// Moving mass at the hand-piece, kg.
    pub mass: f64,
    /// Viscous friction, N s/m.
    pub viscous: f64,
    /// Dry friction, N.
    pub dry: f64,
    /// Step of the position sensor, m; 0 for a continuous reading.
    pub resolution: f64,
    /// Time from the sensor to the reading, s.
    pub position_delay: f64,
    /// Time from writing a force until it acts, s.
    pub force_delay: f64,
    /// Rate of new readings, Hz.
    pub rate: f64,
    /// Limits that the loop keeps.
    pub spec: DeviceSpec,
}

impl DeviceModel {
    /// Novint Falcon.
    ///
    /// 8 N, 3000 N/m and 20 N s/m are CHAI3D's figures for it (`CDeltaDevices.cpp`, 3.3.0). The
    /// sensor's step of 0.045 mm follows from libnifalcon's geometry and encoder scale (0.041 to
    /// 0.048 mm near the centre). The delay of 1 ms is the latency timer of its USB chip. The mass,
    /// 90 g, is the value that a public driver compensates. Friction is assumed.
    pub const FALCON: Self = Self {
        title: "Novint Falcon",
        mass: 0.09,
        viscous: 0.5,
        dry: 0.15,
        resolution: 4.5e-5,
        position_delay: 1e-3,
        force_delay: 2e-4,
        rate: 1000.0,
        spec: DeviceSpec {
            max_force: 8.0,
            max_torque: 0.0,
            max_slew: 1000.0,
            max_stiffness: 2000.0,
            max_damping: 8.0,
        },
    };

    /// 3D Systems Touch, formerly Phantom Omni.
    ///
    /// From its data sheet: 3.3 N, 0.055 mm, less than 0.26 N of friction, 45 g, and 1.26, 2.31 and
    /// 1.02 N/mm along its axes; the smallest is used. Viscous friction, delays and damping are
    /// assumed.
    pub const TOUCH: Self = Self {
        title: "3D Systems Touch",
        mass: 0.045,
        viscous: 0.3,
        dry: 0.2,
        resolution: 5.5e-5,
        position_delay: 1e-3,
        force_delay: 2e-4,
        rate: 1000.0,
        spec: DeviceSpec {
            max_force: 3.3,
            max_torque: 0.0,
            max_slew: 500.0,
            max_stiffness: 1020.0,
            max_damping: 4.0,
        },
    };

    /// Haply Inverse3.
    ///
    /// 5 N is the limit in SOFA's plugin for it (`Haply_Inverse3Controller`), which also runs it at
    /// 3 kHz. No public figures were found for the rest; it is assumed from the device's kind
    /// (direct drive, low friction).
    pub const INVERSE3: Self = Self {
        title: "Haply Inverse3",
        mass: 0.15,
        viscous: 0.2,
        dry: 0.05,
        resolution: 1e-5,
        position_delay: 4e-4,
        force_delay: 2e-4,
        rate: 3000.0,
        spec: DeviceSpec {
            max_force: 5.0,
            max_torque: 0.0,
            max_slew: 1000.0,
            max_stiffness: 1500.0,
            max_damping: 6.0,
        },
    };

    /// A strong device without friction, sensor steps or delay.
    pub const IDEAL: Self = Self {
        title: "ideal device",
        mass: 0.05,
        viscous: 0.0,
        dry: 0.0,
        resolution: 0.0,
        position_delay: 0.0,
        force_delay: 0.0,
        rate: 10_000.0,
        spec: DeviceSpec {
            max_force: 20.0,
            max_torque: 1.0,
            max_slew: 5000.0,
            max_stiffness: 3000.0,
            max_damping: 20.0,
        },
    };

    /// All models with their names in lower case.
    pub const ALL: [(&'static str, Self); 4] = [
        ("falcon", Self::FALCON),
        ("touch", Self::TOUCH),
        ("inverse3", Self::INVERSE3),
        ("ideal", Self::IDEAL),
    ];
}
