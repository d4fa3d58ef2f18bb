//! The transfer: a new patch gives another force at the same pose, and the difference fades out
//! instead of jumping.

use super::limits::{pull_of, shortened, without_dust};
use crate::solver::ToolLoad;
use crate::{DeviceSpec, ForceCommand, Vec3};

/// The remaining difference of one tool.
#[derive(Debug, Clone, Copy)]
pub(super) struct Transfer {
    /// The difference that is added to the force of the new patch, N and N m.
    pub(super) force: ForceCommand,
    /// Time left to fade, s.
    left: f64,
}

impl Transfer {
    pub(super) const NONE: Self = Self {
        force: ForceCommand::ZERO,
        left: 0.0,
    };

    /// Adds the difference between the old and the new patch; it fades within `time`, s. The sum is
    /// cut to the share `most` of the device's limits. Returns whether the force was cut.
    pub(super) fn bridge(
        &mut self,
        old: &ToolLoad,
        new: &ToolLoad,
        spec: &DeviceSpec,
        most: f64,
        time: f64,
    ) -> bool {
        let max_force = most * spec.max_force;
        let max_torque = most * spec.max_torque;
        let force = self.force.force + old.force - new.force;
        self.force = ForceCommand {
            force: shortened(&force, max_force),
            torque: shortened(&(self.force.torque + old.torque - new.torque), max_torque),
        };
        self.left = time;
        force.norm() > max_force
    }

    /// Advances by `dt`, s: the difference falls linearly to zero in the time that is left.
    pub(super) fn fade(&mut self, dt: f64) {
        let share = if self.left > dt {
            1.0 - dt / self.left
        } else {
            0.0
        };
        self.left = (self.left - dt).max(0.0);
        self.force = ForceCommand {
            force: without_dust(self.force.force * share),
            torque: without_dust(self.force.torque * share),
        };
    }

    /// Cuts the difference where its sum with the tissue's force would pull the tool into the tissue, as it would
    /// in a lift, when that force falls faster than the difference fades.
    pub(super) fn stop_pulling(&mut self, tissue: &Vec3, outward: &Vec3) {
        self.force.force -= pull_of(&(tissue + self.force.force), outward);
    }

    /// Forgets the difference.
    pub(super) fn drop_force(&mut self) {
        self.force = ForceCommand::ZERO;
    }
}
