//! One tool: from the tissue's force on it to the command of its device.

use super::coupling::Coupling;
use super::limits::{NO_DEVICE, limited};
use super::ramp::Ramp;
use super::transfer::Transfer;
use crate::energy::Energy;
use crate::hand::HandPiece;
use crate::solver::ToolLoad;
use crate::{DeviceSpec, ForceCommand, Limits, ServoParams, ToolContact, ToolReport, Vec3};

/// The state of one tool.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tool {
    /// Limits of its device; `None` for a tool without a device.
    pub(super) spec: Option<DeviceSpec>,
    pub(super) hand: HandPiece,
    pub(super) energy: Energy,
    /// The last command.
    pub(super) command: ForceCommand,
    /// The tissue's force and moment in the last good tick, with the transfer.
    held: ForceCommand,
    pub(super) transfer: Transfer,
    /// Energy in the tissue and the coupling in the last tick, J.
    stored: f64,
    pub(super) coupling: Coupling,
}

impl Tool {
    pub(super) const NONE: Self = Self {
        spec: None,
        hand: HandPiece::new(ToolContact::NONE.pose),
        energy: Energy::new(),
        command: ForceCommand::ZERO,
        held: ForceCommand::ZERO,
        transfer: Transfer::NONE,
        stored: 0.0,
        coupling: Coupling::NONE,
    };

    pub(super) fn spec(&self) -> DeviceSpec {
        self.spec.unwrap_or(NO_DEVICE)
    }

    /// Energy in the tissue and the coupling by the local model, J.
    fn stored_by(&self, load: &ToolLoad) -> f64 {
        0.5 * (load.work + self.coupling.compliance * load.force.norm_squared())
    }

    /// Resets the stored energy after a new patch: it stores a different energy at the same pose,
    /// and this difference is not work.
    pub(super) fn restart_store(&mut self, load: &ToolLoad) {
        self.stored = self.stored_by(load);
    }

    /// Counts the energy of the tick that ended. While the force ramps, the work says nothing about
    /// the tissue.
    pub(super) fn count_energy(
        &mut self,
        load: &ToolLoad,
        is_ramping: bool,
        dt: f64,
        params: &ServoParams,
    ) {
        let stored = self.stored_by(load);
        let grown = if is_ramping {
            0.0
        } else {
            stored - self.stored
        };
        let travel = self.hand.travel;
        (self.energy).count(&self.command.force, &travel, grown, dt, params);
        if is_ramping {
            self.energy.forget();
        }
        if stored.is_finite() {
            self.stored = stored;
        }
    }

    /// Turns the tissue's force into the command, through ramp, damping and limits.
    pub(super) fn render(
        &mut self,
        load: &ToolLoad,
        ramp: &Ramp,
        dt: f64,
        params: &ServoParams,
        report: &mut ToolReport,
    ) {
        let spec = self.spec();
        if !ramp.is_held() {
            self.held = ForceCommand {
                force: load.force + self.transfer.force.force,
                torque: load.torque + self.transfer.force.torque,
            };
        }
        let velocity = self.hand.velocity;
        let touches = self.held.force != Vec3::zeros();
        let damping = (self.energy).ask_damping(&velocity, touches, dt, &spec, params);
        let base = if touches { params.damping } else { 0.0 };
        let whole_damping = (damping + base).clamp(0.0, spec.max_damping);
        let gain = ramp.smoothed();
        let wanted = ForceCommand {
            force: (self.held.force - velocity * whole_damping) * gain,
            torque: self.held.torque * gain,
        };
        let (command, limits) = limited(&wanted, &self.command, &spec, dt);
        self.command = command;
        report.limits |= limits;
        if gain < 1.0 {
            report.limits |= Limits::RAMP;
        }
        if damping > 0.0 {
            report.limits |= Limits::ENERGY;
        }
        self.fill(damping, report);
    }

    fn fill(&self, damping: f64, report: &mut ToolReport) {
        let softening = self.coupling.softening();
        if softening > 0.0 {
            report.limits |= Limits::STIFFNESS;
        }
        report.force = self.command.force;
        report.transfer = self.transfer.force.force;
        report.velocity = self.hand.velocity;
        report.stiffness = self.coupling.stiffness;
        report.softening = softening;
        report.damping = damping;
        report.energy_in = self.energy.taken;
        report.energy_out = self.energy.given;
        report.bank = self.energy.bank();
    }
}
