//! One tick of the law.

use crate::energy::Energy;
use crate::hand::HandPiece;
use crate::solver::{ContactPatchKey, ContactSolver, Solution, ToolLoad};
use crate::{
    ContactPatch, DeviceSpec, DeviceState, Faults, ForceCommand, Limits, MAX_CONTACTS, MAX_TOOLS,
    PatchSource, Pose, ServoParams, TickReport, ToolContact, ToolReport, Vec3,
};

/// Forces below this are cut to zero where they decay, N: far below what any device resolves.
const FORCE_DUST: f64 = 1e-6;
/// Time without a fault before the force comes back, s.
const QUIET: f64 = 0.05;
/// Of the stiffness against a tool: a sphere's is 1.2 times what the work of its contact forces says (Hertz).
const SHAPE: f64 = 1.2;
/// Below this force nothing is said of the stiffness, N.
const MIN_LOAD: f64 = 1e-3;
/// Time in which the coupling softens, s, and in which it stiffens, which gives energy out.
const SOFTEN: f64 = 5e-3;
const STIFFEN: f64 = 0.1;
/// A patch with larger values than these is no contact, m and m/N and N.
const MAX_LENGTH: f64 = 1e3;
const MAX_COMPLIANCE: f64 = 1e2;
const MAX_LOAD: f64 = 1e4;

/// The law with all that it remembers from tick to tick, in its own fixed memory.
#[derive(Debug, Clone)]
pub struct Servo {
    params: ServoParams,
    solver: ContactSolver,
    key: ContactPatchKey,
    patch: PatchState,
    ramp: Ramp,
    last_now: f64,
    tools: [Tool; MAX_TOOLS],
}

/// What is known of the patch in use.
#[derive(Debug, Clone, Copy)]
struct PatchState {
    is_good: bool,
    arrived_at: f64,
    period: f64,
}

/// The share of the force that is let through.
#[derive(Debug, Clone, Copy)]
struct Ramp {
    gain: f64,
    is_down: bool,
    /// Whether the tissue's force is the last good one rather than this tick's.
    is_frozen: bool,
    quiet_for: f64,
}

/// All that belongs to one tool.
#[derive(Debug, Clone, Copy)]
struct Tool {
    spec: Option<DeviceSpec>,
    hand: HandPiece,
    energy: Energy,
    command: ForceCommand,
    /// The tissue's force and moment in the last good tick, with what was bridged.
    held: ForceCommand,
    transfer: ForceCommand,
    transfer_left: f64,
    stored: f64,
    /// Compliance of the coupling, m/N, and stiffness of the tissue, N/m.
    coupling: f64,
    stiffness: f64,
    shape: f64,
    /// Compliance that the coupling is made ready for before anything is touched, m/N.
    ahead: Option<f64>,
}

impl Tool {
    const NONE: Self = Self {
        spec: None,
        hand: HandPiece::new(ToolContact::NONE.pose),
        energy: Energy::new(),
        command: ForceCommand::ZERO,
        held: ForceCommand::ZERO,
        transfer: ForceCommand::ZERO,
        transfer_left: 0.0,
        stored: 0.0,
        coupling: 0.0,
        stiffness: 0.0,
        shape: SHAPE,
        ahead: None,
    };
}

impl Servo {
    /// For these devices, tool t in the hand of device t; those beyond [`MAX_TOOLS`] are left without force.
    pub fn new(params: &ServoParams, specs: &[DeviceSpec]) -> Self {
        let mut tools = [Tool::NONE; MAX_TOOLS];
        for (tool, spec) in tools.iter_mut().zip(specs) {
            tool.spec = Some(checked_spec(spec));
        }
        Self {
            params: *params,
            solver: ContactSolver::new(),
            key: ContactPatchKey::new(),
            patch: PatchState {
                is_good: false,
                arrived_at: 0.0,
                period: 0.0,
            },
            ramp: Ramp {
                gain: 0.0,
                is_down: true,
                is_frozen: true,
                quiet_for: 0.0,
            },
            last_now: f64::NAN,
            tools,
        }
    }

    /// From the devices' states at `now`, s, and the newest patch to a force for each device.
    ///
    /// A state that a device did not give is `None`. All of `commands` is written, whatever comes in.
    pub fn tick(
        &mut self,
        now: f64,
        states: &[Option<DeviceState>],
        patches: &mut impl PatchSource,
        commands: &mut [ForceCommand],
    ) -> TickReport {
        let params = self.params;
        let mut report = TickReport {
            now,
            energy_budget: params.energy_budget,
            ..TickReport::ZERO
        };
        let dt = self.advance_clock(now, &mut report);
        for (t, tool) in self.tools.iter_mut().enumerate() {
            if tool.spec.is_some() {
                let state = states.get(t).and_then(Option::as_ref);
                let faults = tool.hand.update(now, dt, state, &params);
                if let Some(tool_report) = report.tools.get_mut(t) {
                    tool_report.faults = faults;
                }
                report.faults |= faults;
            }
        }
        // From here on a tick counts for at most two, whatever the clock says.
        let dt = dt.clamp(0.0, 2.0 * params.period);

        for tool in &mut self.tools {
            tool.fade_transfer(dt);
        }
        let mut loads = [ToolLoad::ZERO; MAX_TOOLS];
        // Asked once: one that comes while the old one is evaluated waits for the next tick.
        let is_newer = patches.is_newer();
        if self.patch.is_good {
            let solutions = if is_newer { 2 } else { 1 };
            loads = self.evaluate(patches.current(), solutions, &mut report);
        }
        self.count_energy(&loads, dt);
        if is_newer {
            patches.take();
            loads = self.change_patch(now, patches.current(), &loads, &mut report);
        }
        let patch = patches.current();
        self.check_age(now, patch, &mut report);
        if !loads.iter().all(is_finite) {
            report.faults |= Faults::NO_SOLUTION;
            self.patch.is_good = false;
            self.solver.clear();
            loads = [ToolLoad::ZERO; MAX_TOOLS];
        }

        let came_back = self.ramp.update(report.faults, dt, &params);
        if came_back && self.patch.is_good {
            let poses = self.poses();
            self.solver.release_anchors(patch, &poses);
            for tool in &mut self.tools {
                tool.transfer = ForceCommand::ZERO;
                tool.energy.forget();
            }
        }
        report.gain = self.ramp.gain;
        let (gain, is_frozen) = (self.ramp.smoothed(), self.ramp.is_frozen);
        for (t, tool) in self.tools.iter_mut().enumerate() {
            let (Some(load), Some(tool_report)) = (loads.get(t), report.tools.get_mut(t)) else {
                continue;
            };
            tool.update_coupling(load, dt);
            tool_report.tissue_force = load.force;
            tool_report.tissue_torque = load.torque;
            tool_report.stretch = self.solver.stretch(t);
            tool.render(load, gain, is_frozen, dt, &params, tool_report);
            report.limits |= tool_report.limits;
        }
        if report.residual > 10.0 * params.tolerance {
            report.limits |= Limits::SWEEPS;
        }
        commands.fill(ForceCommand::ZERO);
        for (command, tool) in commands.iter_mut().zip(&self.tools) {
            *command = tool.command;
        }
        report
    }

    /// The time since the last tick, s, never negative.
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
            if dt > self.params.late_after {
                report.faults |= Faults::MISSED_DEADLINE;
            }
            dt
        }
    }

    fn poses(&self) -> [Pose; MAX_TOOLS] {
        let mut poses = [ToolContact::NONE.pose; MAX_TOOLS];
        for (pose, tool) in poses.iter_mut().zip(&self.tools) {
            *pose = tool.hand.pose;
        }
        poses
    }

    /// What the local model says at the present poses; friction follows.
    fn evaluate(
        &mut self,
        patch: &ContactPatch,
        solutions: u32,
        report: &mut TickReport,
    ) -> [ToolLoad; MAX_TOOLS] {
        let poses = self.poses();
        let mut couplings = [0.0; MAX_TOOLS];
        for (coupling, tool) in couplings.iter_mut().zip(&self.tools) {
            *coupling = tool.coupling;
        }
        let solution: Solution =
            (self.solver).solve(patch, &poses, &couplings, &self.params, solutions);
        self.solver.move_anchors(patch, &poses);
        report.sweeps += solution.sweeps;
        report.residual = solution.residual;
        report.n_active = solution.n_active;
        report.n_sliding = solution.n_sliding;
        let mut loads = [ToolLoad::ZERO; MAX_TOOLS];
        for (t, (load, pose)) in loads.iter_mut().zip(&poses).enumerate() {
            *load = self.solver.load(patch, t, pose);
        }
        loads
    }

    fn count_energy(&mut self, loads: &[ToolLoad; MAX_TOOLS], dt: f64) {
        for (tool, load) in self.tools.iter_mut().zip(loads) {
            let stored = tool.stored_by(load);
            let grown = if self.ramp.gain < 1.0 {
                0.0
            } else {
                stored - tool.stored
            };
            let travel = tool.hand.travel;
            tool.energy
                .count(&tool.command.force, &travel, grown, dt, &self.params);
            if self.ramp.gain < 1.0 {
                tool.energy.forget();
            }
            if stored.is_finite() {
                tool.stored = stored;
            }
        }
    }

    /// Takes a new patch over without a bump: what it says differently at the same poses is bridged.
    fn change_patch(
        &mut self,
        now: f64,
        patch: &ContactPatch,
        before: &[ToolLoad; MAX_TOOLS],
        report: &mut TickReport,
    ) -> [ToolLoad; MAX_TOOLS] {
        report.is_new_patch = true;
        let was_good = self.patch.is_good;
        let measured = now - self.patch.arrived_at;
        self.patch.arrived_at = now;
        self.patch.is_good = is_usable(patch);
        if !self.patch.is_good {
            self.solver.clear();
            return [ToolLoad::ZERO; MAX_TOOLS];
        }
        let declared = if patch.period.is_finite() {
            patch.period
        } else {
            0.0
        };
        self.patch.period = if was_good {
            measured.max(declared)
        } else {
            declared
        }
        .clamp(2.0 * self.params.period, 0.1);
        self.solver.adopt(patch, &self.key);
        self.key.set(patch);
        if !was_good {
            let poses = self.poses();
            self.solver.release_anchors(patch, &poses);
        }
        let loads = self.evaluate(patch, 2, report);
        for (t, ((tool, old), new)) in (self.tools.iter_mut()).zip(before).zip(&loads).enumerate() {
            tool.stored = tool.stored_by(new);
            tool.calibrate(patch.tools.get(t), new);
            tool.ahead = self.solver.nearest_compliance(patch, t, &tool.hand.pose);
            if !was_good {
                continue;
            }
            let spec = tool.spec.unwrap_or(NO_DEVICE);
            let max_force = self.params.max_transfer * spec.max_force;
            let max_torque = self.params.max_transfer * spec.max_torque;
            let force = tool.transfer.force + old.force - new.force;
            tool.transfer = ForceCommand {
                force: shortened(&force, max_force),
                torque: shortened(
                    &(tool.transfer.torque + old.torque - new.torque),
                    max_torque,
                ),
            };
            if force.norm() > max_force
                && let Some(tool_report) = report.tools.get_mut(t)
            {
                tool_report.limits |= Limits::TRANSFER;
            }
            tool.transfer_left = self.params.transfer_periods * self.patch.period;
        }
        loads
    }

    fn check_age(&mut self, now: f64, patch: &ContactPatch, report: &mut TickReport) {
        report.patch_id = patch.id;
        if patch.id == 0 {
            report.faults |= Faults::NO_PATCH;
            return;
        }
        if !self.patch.is_good {
            report.faults |= Faults::BAD_PATCH;
            return;
        }
        let sampled = if patch.sampled_at <= now {
            patch.sampled_at
        } else {
            self.patch.arrived_at
        };
        report.patch_age = now - sampled;
        let limit = (self.params.stale_periods * self.patch.period).max(self.params.stale_after);
        // By its arrival too: a patch that is late on arrival is no use, but one that came says that the tissue lives.
        if now - self.patch.arrived_at > limit || report.patch_age > 4.0 * limit {
            report.faults |= Faults::STALE_PATCH;
        }
    }
}

impl Tool {
    /// Energy in the tissue and the coupling, J, by the local model.
    fn stored_by(&self, load: &ToolLoad) -> f64 {
        0.5 * (load.work + self.coupling * load.force.norm_squared())
    }

    /// What the tissue said of its stiffness, against what its forces say: the shape of the contact.
    fn calibrate(&mut self, contact: Option<&ToolContact>, load: &ToolLoad) {
        let force_sq = load.force.norm_squared();
        let (Some(contact), true) = (contact, force_sq > MIN_LOAD * MIN_LOAD && load.work > 0.0)
        else {
            return;
        };
        let said = stiffest(&contact.stiffness);
        let shape = if said > 0.0 && said.is_finite() {
            (said * load.work / force_sq).clamp(1.0, 2.0)
        } else {
            SHAPE
        };
        self.shape += 0.2 * (shape - self.shape);
    }

    /// Stiffness beyond what the device renders goes into a spring in series.
    fn update_coupling(&mut self, load: &ToolLoad, dt: f64) {
        let force_sq = load.force.norm_squared();
        let wanted = match self.spec {
            Some(spec) if spec.max_stiffness > 0.0 => {
                if force_sq > MIN_LOAD * MIN_LOAD && load.work > 0.0 {
                    self.stiffness = (self.shape * force_sq / load.work).min(1e9);
                    (1.0 / spec.max_stiffness - 1.0 / self.stiffness).max(0.0)
                } else {
                    // Else the first touch of something hard would be felt at its full stiffness.
                    self.stiffness = 0.0;
                    let ahead = self.ahead.unwrap_or(f64::INFINITY).max(0.0);
                    (1.0 / spec.max_stiffness - ahead).max(0.0)
                }
            }
            _ => 0.0,
        };
        let time = if wanted > self.coupling {
            SOFTEN
        } else {
            STIFFEN
        };
        self.coupling += (wanted - self.coupling) * (dt / time).clamp(0.0, 1.0);
        if self.coupling < 1e-9 || !self.coupling.is_finite() {
            self.coupling = 0.0;
        }
    }

    /// From the tissue's force to the one that is commanded, through ramp, damping and limits.
    fn render(
        &mut self,
        load: &ToolLoad,
        gain: f64,
        is_frozen: bool,
        dt: f64,
        params: &ServoParams,
        report: &mut ToolReport,
    ) {
        let spec = self.spec.unwrap_or(NO_DEVICE);
        if !is_frozen {
            self.held = ForceCommand {
                force: load.force + self.transfer.force,
                torque: load.torque + self.transfer.torque,
            };
        }
        let velocity = self.hand.velocity;
        let touches = self.held.force != Vec3::zeros();
        let damping = (self.energy).ask_damping(&velocity, touches, dt, &spec, params);
        let base = if touches { params.damping } else { 0.0 };
        let whole_damping = (damping + base).clamp(0.0, spec.max_damping);
        let force = (self.held.force - velocity * whole_damping) * gain;
        let torque = self.held.torque * gain;

        let limited = shortened(&force, spec.max_force);
        let limited_torque = shortened(&torque, spec.max_torque);
        let limits = &mut report.limits;
        if limited != force {
            *limits |= Limits::FORCE;
        }
        // Devices without moments leave theirs out; that is no limit met.
        if limited_torque != torque && spec.max_torque > 0.0 {
            *limits |= Limits::TORQUE;
        }
        let slew = spec.max_slew * dt;
        let turn = if spec.max_force > 0.0 {
            slew * spec.max_torque / spec.max_force
        } else {
            0.0
        };
        let by = limited - self.command.force;
        let by_slewed = shortened(&by, slew);
        if by != by_slewed {
            *limits |= Limits::SLEW;
        }
        let by_torque = shortened(&(limited_torque - self.command.torque), turn);
        let next = ForceCommand {
            force: without_dust(self.command.force + by_slewed),
            torque: without_dust(self.command.torque + by_torque),
        };
        // Two finite forces within the limits make one within them; this is for rounding and for what was overlooked.
        self.command = ForceCommand {
            force: shortened(&next.force, spec.max_force),
            torque: shortened(&next.torque, spec.max_torque),
        };
        if gain < 1.0 {
            *limits |= Limits::RAMP;
        }
        if damping > 0.0 {
            *limits |= Limits::ENERGY;
        }
        let softening = self.coupling * self.stiffness / (1.0 + self.coupling * self.stiffness);
        if softening > 0.0 {
            *limits |= Limits::STIFFNESS;
        }
        report.force = self.command.force;
        report.transfer = self.transfer.force;
        report.velocity = velocity;
        report.stiffness = self.stiffness;
        report.softening = softening;
        report.damping = damping;
        report.energy_in = self.energy.taken;
        report.energy_out = self.energy.given;
        report.bank = self.energy.bank();
    }

    /// Along a straight line to zero in the time that is left.
    fn fade_transfer(&mut self, dt: f64) {
        let share = if self.transfer_left > dt {
            1.0 - dt / self.transfer_left
        } else {
            0.0
        };
        self.transfer_left = (self.transfer_left - dt).max(0.0);
        self.transfer = ForceCommand {
            force: without_dust(self.transfer.force * share),
            torque: without_dust(self.transfer.torque * share),
        };
    }
}

impl Ramp {
    /// Whether the force begins to come back in this tick.
    fn update(&mut self, faults: Faults, dt: f64, params: &ServoParams) -> bool {
        if !faults.is_empty() {
            self.is_down = true;
            self.quiet_for = 0.0;
            // A stale patch still tells a hand that draws back that it may.
            self.is_frozen |= faults != Faults::STALE_PATCH;
        }
        if !self.is_down {
            self.gain = (self.gain + dt / params.ramp_up.max(1e-3)).min(1.0);
            return false;
        }
        self.gain = (self.gain - dt / params.ramp_down.max(1e-3)).max(0.0);
        if self.gain > 0.0 || !faults.is_empty() {
            return false;
        }
        self.quiet_for += dt;
        let comes_back = self.quiet_for > QUIET;
        if comes_back {
            self.is_down = false;
            self.is_frozen = false;
        }
        comes_back
    }

    /// The share with a smooth beginning and end.
    fn smoothed(&self) -> f64 {
        self.gain * self.gain * (3.0 - 2.0 * self.gain)
    }
}

const NO_DEVICE: DeviceSpec = DeviceSpec {
    max_force: 0.0,
    max_torque: 0.0,
    max_slew: 0.0,
    max_stiffness: 0.0,
    max_damping: 0.0,
};

fn checked_spec(spec: &DeviceSpec) -> DeviceSpec {
    let positive = |x: f64| if x > 0.0 && x < 1e9 { x } else { 0.0 };
    DeviceSpec {
        max_force: positive(spec.max_force),
        max_torque: positive(spec.max_torque),
        max_slew: positive(spec.max_slew),
        max_stiffness: positive(spec.max_stiffness),
        max_damping: positive(spec.max_damping),
    }
}

/// The vector, or the one of that length in its direction; zero for one that is no vector.
fn shortened(v: &Vec3, length: f64) -> Vec3 {
    let norm = v.norm();
    if norm <= length {
        *v
    } else if norm.is_finite() {
        v * (length / norm)
    } else {
        Vec3::zeros()
    }
}

fn without_dust(v: Vec3) -> Vec3 {
    if v.amax() < FORCE_DUST {
        Vec3::zeros()
    } else {
        v
    }
}

fn is_finite(load: &ToolLoad) -> bool {
    let small = |x: &f64| x.abs() < 1e12;
    load.force.iter().all(small) && load.torque.iter().all(small) && load.work.is_finite()
}

/// The largest stiffness in any direction, N/m, by power iteration.
fn stiffest(stiffness: &crate::Mat3) -> f64 {
    let symmetric = (stiffness + stiffness.transpose()) * 0.5;
    let mut direction = Vec3::new(0.6, 0.5, 0.62);
    let mut value = 0.0;
    for _ in 0..8 {
        let next = symmetric * direction;
        value = next.norm();
        if !value.is_finite() || value <= 0.0 {
            return 0.0;
        }
        direction = next / value;
    }
    value
}

/// Whether a patch holds numbers that can be a contact.
fn is_usable(patch: &ContactPatch) -> bool {
    if patch.id == 0 || patch.n_contacts > MAX_CONTACTS || patch.n_tools > MAX_TOOLS {
        return false;
    }
    if !patch.sampled_at.is_finite() {
        return false;
    }
    let short = |v: &Vec3| v.iter().all(|x| x.abs() < MAX_LENGTH);
    let tools_are =
        (patch.tools.iter().take(patch.n_tools)).all(|tool| (0.0..10.0).contains(&tool.friction));
    let candidates_are = patch.contacts.iter().take(patch.n_contacts).all(|c| {
        short(&c.position)
            && short(&c.surface)
            && short(&c.anchor)
            && (c.normal.norm_squared() - 1.0).abs() < 1e-3
            && c.curvature.iter().all(|x| x.abs() < 1e5)
            && c.force.iter().all(|x| x.abs() < MAX_LOAD)
    });
    let used = 3 * patch.n_contacts;
    // Not `all`, which would stop the vector unit at every entry.
    let compliance_is = (patch.compliance.chunks_exact(ContactPatch::STRIDE))
        .take(used)
        .map(|column| {
            (column.iter().take(used)).fold(true, |good, w| good & (w.abs() < MAX_COMPLIANCE))
        })
        .fold(true, |good, column| good & column);
    tools_are && candidates_are && compliance_is
}
