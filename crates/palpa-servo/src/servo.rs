//! One tick of the law, in order of execution.

mod coupling;
mod limits;
mod patches;
mod ramp;
mod tool;
mod transfer;

use self::patches::PatchUse;
use self::ramp::Ramp;
use self::tool::Tool;
use crate::solver::{ContactSolver, ToolLoad};
use crate::{
    ContactPatch, DeviceSpec, DeviceState, Faults, ForceCommand, Limits, MAX_TOOLS, PatchSource,
    Pose, ServoParams, TickReport, ToolContact,
};

/// A tick may be this late at any time without being counted as overdue, s.
const PUNCTUAL: f64 = 0.01;
/// Share of all time that may be overdue for as long as it likes: a loop that runs at some 80 Hz.
const OVERDUE_SHARE: f64 = 0.25;
/// Overdue time beyond that share at which the loop counts as late altogether, s.
const MAX_OVERDUE: f64 = 0.1;

/// The law and its state from tick to tick. Its size is fixed.
#[derive(Debug, Clone)]
pub struct Servo {
    params: ServoParams,
    solver: ContactSolver,
    patch: PatchUse,
    ramp: Ramp,
    /// Clock of the last tick, s; NaN before the first.
    last_now: f64,
    /// Time beyond [`PUNCTUAL`] of all late ticks, less the share that is allowed, s.
    overdue: f64,
    tools: [Tool; MAX_TOOLS],
}

impl Servo {
    /// A law for these devices; device `t` holds tool `t`. Devices beyond [`MAX_TOOLS`] get no
    /// force. If the period is not a positive number, the default is used.
    pub fn new(params: &ServoParams, specs: &[DeviceSpec]) -> Self {
        let mut tools = [Tool::NONE; MAX_TOOLS];
        for (tool, spec) in tools.iter_mut().zip(specs) {
            tool.spec = Some(limits::checked_spec(spec));
        }
        let is_time = params.period > 0.0 && params.period.is_finite();
        let period = if is_time {
            params.period
        } else {
            ServoParams::default().period
        };
        Self {
            params: ServoParams { period, ..*params },
            solver: ContactSolver::new(),
            patch: PatchUse::Unusable,
            ramp: Ramp::new(),
            last_now: f64::NAN,
            overdue: 0.0,
            tools,
        }
    }

    /// Computes a force for each device from the devices' states at `now`, s, and the newest patch.
    ///
    /// The state of a device that gave no reading is `None`. Every entry of `commands` is written,
    /// whatever the input.
    pub fn tick(
        &mut self,
        now: f64,
        states: &[Option<DeviceState>],
        patches: &mut impl PatchSource,
        commands: &mut [ForceCommand],
    ) -> TickReport {
        let mut report = TickReport {
            now,
            energy_budget: self.params.energy_budget,
            ..TickReport::ZERO
        };
        let dt = self.advance_clock(now, &mut report);
        self.read_hands(now, dt, states, &mut report);
        // From here on, a tick counts for at most two periods, even after a longer pause.
        let dt = dt.clamp(0.0, 2.0 * self.params.period);
        for tool in &mut self.tools {
            tool.transfer.fade(dt);
        }
        let mut loads = self.touch(now, dt, patches, &mut report);
        let patch = patches.current();
        self.check_age(now, patch, &mut report);
        self.check_loads(&mut loads, &mut report);
        for ((tool, load), contact) in self.tools.iter_mut().zip(&loads).zip(&patch.tools) {
            tool.stop_pulling(load, contact);
        }
        self.update_ramp(dt, patch, &mut report);
        self.render(&loads, dt, &mut report);
        if report.residual > 10.0 * self.params.tolerance {
            report.limits |= Limits::SWEEPS;
        }
        commands.fill(ForceCommand::ZERO);
        for (command, tool) in commands.iter_mut().zip(&self.tools) {
            *command = tool.command;
        }
        report
    }

    /// Time since the last tick, s, never negative.
    fn advance_clock(&mut self, now: f64, report: &mut TickReport) -> f64 {
        let dt = now - self.last_now;
        if !now.is_finite() {
            report.faults |= Faults::BAD_CLOCK;
            return 0.0;
        }
        let is_first = self.last_now.is_nan();
        self.last_now = now;
        if is_first {
            self.params.period
        } else if dt <= 0.0 {
            report.faults |= Faults::BAD_CLOCK;
            0.0
        } else {
            if dt > self.params.late_after || self.is_overdue(dt) {
                report.faults |= Faults::MISSED_DEADLINE;
            }
            dt
        }
    }

    /// Whether the loop is late in too many ticks. Each is survived for itself, but a loop that
    /// runs at 30 to 80 Hz for long makes firm tissue unstable.
    fn is_overdue(&mut self, dt: f64) -> bool {
        let by = (dt - PUNCTUAL).max(0.0) - OVERDUE_SHARE * dt;
        self.overdue = (self.overdue + by).clamp(0.0, 1.5 * MAX_OVERDUE);
        self.overdue > MAX_OVERDUE
    }

    fn read_hands(
        &mut self,
        now: f64,
        dt: f64,
        states: &[Option<DeviceState>],
        report: &mut TickReport,
    ) {
        for (t, tool) in self.tools.iter_mut().enumerate() {
            if tool.spec.is_some() {
                let state = states.get(t).and_then(Option::as_ref);
                let faults = tool.hand.update(now, dt, state, &self.params);
                if let Some(tool_report) = report.tools.get_mut(t) {
                    tool_report.faults = faults;
                }
                report.faults |= faults;
            }
        }
    }

    /// Solves contact at the present poses, with the old patch and then with a newer one if there
    /// is one.
    fn touch(
        &mut self,
        now: f64,
        dt: f64,
        patches: &mut impl PatchSource,
        report: &mut TickReport,
    ) -> [ToolLoad; MAX_TOOLS] {
        // Checked once: a patch that arrives while the old one is evaluated waits for the next
        // tick.
        let is_newer = patches.is_newer();
        let mut loads = [ToolLoad::ZERO; MAX_TOOLS];
        if self.patch.is_used() {
            let solutions = if is_newer { 2 } else { 1 };
            loads = self.evaluate(patches.current(), solutions, report);
        }
        for (tool, load) in self.tools.iter_mut().zip(&loads) {
            tool.count_energy(load, dt, &self.params);
        }
        if is_newer {
            patches.take();
            loads = self.change_patch(now, patches.current(), &loads, report);
        }
        loads
    }

    /// Computes the forces of the local model at the present poses and moves the friction anchors.
    fn evaluate(
        &mut self,
        patch: &ContactPatch,
        solutions: u32,
        report: &mut TickReport,
    ) -> [ToolLoad; MAX_TOOLS] {
        let poses = self.poses();
        let mut couplings = [0.0; MAX_TOOLS];
        for (coupling, tool) in couplings.iter_mut().zip(&self.tools) {
            *coupling = tool.coupling.compliance;
        }
        let solution = (self.solver).solve(patch, &poses, &couplings, &self.params, solutions);
        let mut loads = [ToolLoad::ZERO; MAX_TOOLS];
        for (t, (load, pose)) in loads.iter_mut().zip(&poses).enumerate() {
            let coupling = couplings.get(t).copied().unwrap_or_default();
            *load = ToolLoad {
                stored: self.solver.stored(patch, t, coupling),
                rubbed: self.solver.rubbed(patch, t, pose),
                ..self.solver.load(patch, t, pose)
            };
        }
        self.solver.move_anchors(patch, &poses);
        report.sweeps += solution.sweeps;
        report.residual = solution.residual;
        report.n_active = solution.n_active;
        report.n_sliding = solution.n_sliding;
        loads
    }

    fn poses(&self) -> [Pose; MAX_TOOLS] {
        let mut poses = [ToolContact::NONE.pose; MAX_TOOLS];
        for (pose, tool) in poses.iter_mut().zip(&self.tools) {
            *pose = tool.hand.pose;
        }
        poses
    }

    /// Discards a solution that is not finite, and its patch.
    fn check_loads(&mut self, loads: &mut [ToolLoad; MAX_TOOLS], report: &mut TickReport) {
        if !loads.iter().all(ToolLoad::is_finite) {
            report.faults |= Faults::NO_SOLUTION;
            self.patch = PatchUse::Unusable;
            self.solver.clear();
            *loads = [ToolLoad::ZERO; MAX_TOOLS];
        }
    }

    /// Updates the share of the force that the ramp lets through. When the force begins to return,
    /// the friction anchors and the transfer are reset, so that no force from before the fault
    /// returns. What the energy observer counted stays.
    fn update_ramp(&mut self, dt: f64, patch: &ContactPatch, report: &mut TickReport) {
        let comes_back = self.ramp.update(report.faults, dt, &self.params);
        if comes_back && self.patch.is_used() {
            let poses = self.poses();
            self.solver.release_anchors(patch, &poses);
            for tool in &mut self.tools {
                tool.transfer.drop_force();
            }
        }
        report.gain = self.ramp.gain();
    }

    fn render(&mut self, loads: &[ToolLoad; MAX_TOOLS], dt: f64, report: &mut TickReport) {
        for (t, tool) in self.tools.iter_mut().enumerate() {
            let (Some(load), Some(tool_report)) = (loads.get(t), report.tools.get_mut(t)) else {
                continue;
            };
            tool.coupling.update(load, tool.spec.as_ref(), dt);
            tool_report.tissue_force = load.force;
            tool_report.tissue_torque = load.torque;
            tool_report.stretch = self.solver.stretch(t);
            tool.render(load, &self.ramp, dt, &self.params, tool_report);
            report.limits |= tool_report.limits;
        }
    }
}
