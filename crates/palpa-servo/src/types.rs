//! The types between a device and the law.

use crate::Vec3;

/// Largest number of tools on one body.
pub const MAX_TOOLS: usize = 2;

/// Position and orientation of a tool: maps points of its own frame to the world.
pub type Pose = nalgebra::Isometry3<f64>;

/// One reading of a device.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviceState {
    /// Time of the reading on the loop's clock, s.
    pub time: f64,
    /// Pose of the hand-piece. Devices without orientation give the identity.
    pub pose: Pose,
    /// Velocity of its position, m/s; zero if the device does not report it.
    pub velocity: Vec3,
    /// One bit per button.
    pub buttons: u32,
}

/// The force and moment that a device exerts on the hand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceCommand {
    /// Force, N, in the world's frame.
    pub force: Vec3,
    /// Moment about the hand-piece's position, N m; ignored by devices without moments.
    pub torque: Vec3,
}

impl ForceCommand {
    /// No force at all.
    pub const ZERO: Self = Self {
        force: Vec3::new(0.0, 0.0, 0.0),
        torque: Vec3::new(0.0, 0.0, 0.0),
    };
}

/// Limits of a device.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviceSpec {
    /// Largest force, N.
    pub max_force: f64,
    /// Largest moment, N m; 0 for devices without moments.
    pub max_torque: f64,
    /// Largest rate of change of the force, N/s.
    pub max_slew: f64,
    /// Stiffness up to which the device is stable in any hand, N/m.
    pub max_stiffness: f64,
    /// Largest damping that the device renders stably, N s/m.
    pub max_damping: f64,
}
