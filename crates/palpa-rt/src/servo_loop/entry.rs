//! The record of one tick, with the records of its devices.

use crate::record::{DeviceRecord, TickRecord};
use palpa_servo::{DeviceState, MAX_TOOLS, TickReport, ToolReport};

/// A tick with its devices.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TickEntry {
    /// The tick.
    pub tick: TickRecord,
    /// Its devices; entries from `tick.n_devices` on are not used.
    pub devices: [DeviceRecord; MAX_TOOLS],
}

impl TickRecord {
    pub(super) fn of(report: &TickReport) -> Self {
        Self {
            patch_age: report.patch_age,
            n_active: report.n_active,
            n_sliding: report.n_sliding,
            sweeps: report.sweeps,
            residual: report.residual,
            gain: report.gain,
            energy_budget: report.energy_budget,
            faults: report.faults.bits().into(),
            limits: report.limits.bits().into(),
            ..Self::default()
        }
    }
}

impl DeviceRecord {
    pub(super) fn of(tool: &ToolReport) -> Self {
        Self {
            tissue_force: tool.tissue_force.into(),
            transfer: tool.transfer.into(),
            stiffness: tool.stiffness,
            stretch: tool.stretch.norm(),
            softening: tool.softening,
            damping: tool.damping,
            energy_in: tool.energy_in,
            energy_out: tool.energy_out,
            bank: tool.bank,
            stored: tool.stored,
            jump: tool.jump,
            faults: tool.faults.bits().into(),
            limits: tool.limits.bits().into(),
            ..Self::default()
        }
    }

    pub(super) fn set_state(&mut self, state: Option<&DeviceState>) {
        self.is_there = state.is_some();
        if let Some(s) = state {
            self.time = s.time;
            self.position = s.pose.translation.vector.into();
            self.orientation = s.pose.rotation.coords.into();
            self.velocity = s.velocity.into();
            self.buttons = s.buttons;
        }
    }
}
