//! One tool: from the tissue's force on it to the command of its device.

use super::coupling::Coupling;
use super::limits::{NO_DEVICE, limited, pull_of};
use super::ramp::Ramp;
use super::transfer::Transfer;
use crate::energy::{Energy, TickEnergy};
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
    /// Direction of the tissue's force in the last tick with one, which the skin only pushes in; zero if the
    /// skin is bonded to the tool.
    outward: Vec3,
    /// Energy stored in the local model at the end of the last tick, J.
    stored: f64,
    /// Share of the local model's force in the last command; none while the last good force is
    /// held.
    share: f64,
    /// Whether the last command came from the last good force instead of the local model.
    is_held: bool,
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
        outward: Vec3::new(0.0, 0.0, 0.0),
        stored: 0.0,
        share: 0.0,
        is_held: true,
        coupling: Coupling::NONE,
    };

    pub(super) fn spec(&self) -> DeviceSpec {
        self.spec.unwrap_or(NO_DEVICE)
    }

    /// Counts the energy of the tick that ended, in which the last command acted. The ramp lets
    /// through a share of the force, and so of the energy.
    pub(super) fn count_energy(&mut self, load: &ToolLoad, dt: f64, params: &ServoParams) {
        let work =
            -self.command.force.dot(&self.hand.travel) - self.command.torque.dot(&self.hand.turn);
        let (grown, rubbed) = if self.is_held {
            // A force that is held does not come from the model; it gives back on the way back what
            // it took.
            (work, 0.0)
        } else {
            (
                self.share * (load.stored - self.stored),
                self.share * load.rubbed,
            )
        };
        let tick = TickEnergy {
            work,
            grown,
            rubbed,
            is_free: self.command == ForceCommand::ZERO,
        };
        self.energy.count(&tick, dt, params);
        self.stored = if load.stored.is_finite() {
            load.stored
        } else {
            0.0
        };
    }

    /// Books the energy by which a new patch changes the stored energy at the same pose, as far as
    /// the ramp lets it through, and returns it, J.
    pub(super) fn book_patch(&mut self, old: &ToolLoad, new: &ToolLoad, was_used: bool) -> f64 {
        self.stored = if new.stored.is_finite() {
            new.stored
        } else {
            0.0
        };
        let jump = self.share * (new.stored - old.stored);
        if !was_used || self.is_held || !jump.is_finite() {
            return 0.0;
        }
        self.energy.jump(jump);
        jump
    }

    /// Cuts what the last patches corrected where the skin would pull.
    pub(super) fn stop_pulling(&mut self, load: &ToolLoad, contact: &ToolContact) {
        self.outward = if contact.is_bonded {
            Vec3::zeros()
        } else {
            load.force.try_normalize(0.0).unwrap_or(self.outward)
        };
        self.transfer.stop_pulling(&load.force, &self.outward);
    }

    /// Turns the tissue's force into the command, through ramp, damping and limits. Damping takes away no more
    /// than the whole push: a force of none gives out no energy either.
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
        let damped = self.held.force - velocity * whole_damping;
        let wanted = ForceCommand {
            force: (damped - pull_of(&damped, &self.outward)) * gain,
            torque: self.held.torque * gain,
        };
        let (command, limits) = limited(&wanted, &self.command, &spec, dt);
        self.command = command;
        self.energy.ramp((gain - self.share) * self.stored);
        self.share = gain;
        self.is_held = ramp.is_held();
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
        report.stored = self.stored;
    }
}
