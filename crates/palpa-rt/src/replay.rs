//! Replay of a log: runs both layers in one thread from the logged inputs and compares the results
//! bit for bit.

use crate::{
    log::Log,
    machine::{Difference, Effect, Machine},
    record::{DeviceRecord, StepRecord},
    servo_loop::TickEntry,
    tissue::{Tissue, TissueInput, empty_patch, stamp},
    tissue_thread::{spoil, step_record},
};
use nalgebra::{Quaternion, Translation3, UnitQuaternion};
use palpa_servo::{ContactPatch, DeviceState, ForceCommand, MAX_TOOLS, PatchSource, Pose, Servo};

/// Settings of the comparison in a replay.
#[derive(Debug, Clone, PartialEq)]
pub struct ReplayParams {
    /// Largest accepted difference of a force where machine or program differ in a part that can
    /// change it, N. Otherwise no difference is accepted.
    pub tolerance: f64,
    /// This machine and program, to be compared with those of the log.
    pub machine: Machine,
}

impl Default for ReplayParams {
    fn default() -> Self {
        // A thousandth of the smallest force that a hand can feel. Other instructions round
        // differently, and contact amplifies the difference.
        Self {
            tolerance: 1e-4,
            machine: Machine::here(),
        }
    }
}

/// Result of a replay.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Every force and every patch is equal bit for bit.
    Same,
    /// The log was made on another machine or by another program; forces agree within the
    /// tolerance.
    WithinTolerance,
    /// Forces or patches differ.
    Different,
    /// The log lacks data that a replay needs; everything that could be compared agrees.
    Incomplete,
}

/// Report of a replay.
#[derive(Debug, Clone, PartialEq)]
pub struct ReplayReport {
    /// The outcome.
    pub verdict: Verdict,
    /// The differences between the machine and program of the log and these.
    pub differences: Vec<Difference>,
    /// Ticks run and compared.
    pub ticks: u64,
    /// Steps of the tissue run and compared.
    pub steps: u64,
    /// Background jobs run.
    pub jobs: u64,
    /// The first force that differs.
    pub first_force: Option<ForceDifference>,
    /// Largest difference of a force, N.
    pub max_force_difference: f64,
    /// The first step whose patch differs.
    pub first_patch: Option<u64>,
    /// Number of patches that differ.
    pub patches_differing: u64,
    /// Where and why the replay had to stop before the log's end.
    pub stopped: Option<String>,
}

impl ReplayReport {
    /// Whether every bit must be the same: nothing differs that can change one.
    fn must_be_same(&self) -> bool {
        self.differences.iter().all(|d| d.effect == Effect::None)
    }
}

/// A force that differs from the logged one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceDifference {
    /// Number of the tick.
    pub tick: u64,
    /// Number of the device.
    pub device: usize,
    /// Logged force, N.
    pub logged: [f64; 3],
    /// Force of the replay, N.
    pub replayed: [f64; 3],
}

/// Runs a log again. `tissue` must be in its state at the start of the log; the law is built from
/// the settings in the log.
pub fn replay<T: Tissue>(log: &Log, tissue: T, params: &ReplayParams) -> ReplayReport {
    replay_watched(log, tissue, params, |_| true)
}

/// Like [`replay`], but calls `goes_on` before each tick with the number of ticks run so far, and
/// stops when it returns false.
pub fn replay_watched<T: Tissue>(
    log: &Log,
    tissue: T,
    params: &ReplayParams,
    goes_on: impl FnMut(usize) -> bool,
) -> ReplayReport {
    let mut run = Run {
        tissue,
        servo: Box::new(Servo::new(&log.servo, &log.specs)),
        patches: Patches {
            current: empty_patch(),
            next: empty_patch(),
            is_offered: false,
        },
        job: None,
        steps: log.steps.iter().peekable(),
        commands: [ForceCommand::ZERO; MAX_TOOLS],
        report: ReplayReport {
            verdict: Verdict::Same,
            differences: log.header.machine.differences(&params.machine),
            ticks: 0,
            steps: 0,
            jobs: 0,
            first_force: None,
            max_force_difference: 0.0,
            first_patch: None,
            patches_differing: 0,
            stopped: None,
        },
    };
    run.tissue.prepare();
    let result = run.all(&log.ticks, goes_on);
    let mut report = run.report;
    report.stopped = result.err();
    let differs = report.first_force.is_some() || report.first_patch.is_some();
    let is_within = report.max_force_difference <= params.tolerance;
    report.verdict = if differs && (report.must_be_same() || !is_within) {
        Verdict::Different
    } else if report.stopped.is_some() {
        Verdict::Incomplete
    } else if differs {
        Verdict::WithinTolerance
    } else {
        Verdict::Same
    };
    report
}

struct Run<'a, T: Tissue> {
    tissue: T,
    servo: Box<Servo>,
    patches: Patches,
    job: Option<T::Job>,
    steps: std::iter::Peekable<std::slice::Iter<'a, StepRecord>>,
    commands: [ForceCommand; MAX_TOOLS],
    report: ReplayReport,
}

impl<T: Tissue> Run<'_, T> {
    fn all(
        &mut self,
        ticks: &[TickEntry],
        mut goes_on: impl FnMut(usize) -> bool,
    ) -> Result<(), String> {
        for (k, entry) in ticks.iter().enumerate() {
            if !goes_on(k) {
                return Err("it was interrupted".to_owned());
            }
            let wanted = k as u64 + 1;
            if entry.tick.tick != wanted {
                return Err(format!("tick {wanted} is not in the log"));
            }
            if entry.tick.taken {
                self.run_until(entry.tick.patch)?;
            }
            self.tick(entry);
        }
        while let Some(step) = self.steps.next() {
            self.step(step)?;
        }
        Ok(())
    }

    /// Runs steps of the tissue until the patch of step `patch` is the next one.
    fn run_until(&mut self, patch: u64) -> Result<(), String> {
        while let Some(step) = self.steps.next_if(|s| s.step <= patch) {
            self.step(step)?;
        }
        if self.patches.next.id == patch {
            Ok(())
        } else {
            Err(format!(
                "the step that made patch {patch} is not in the log"
            ))
        }
    }

    fn step(&mut self, logged: &StepRecord) -> Result<(), String> {
        if logged.step != self.report.steps + 1 {
            return Err(format!("step {} is not in the log", self.report.steps + 1));
        }
        if logged.installed {
            let job = (self.job.take()).ok_or_else(|| {
                format!(
                    "step {}: a job is installed that was never taken",
                    logged.step
                )
            })?;
            self.tissue.install(T::run(job));
            self.report.jobs += 1;
        }
        if logged.job_failed {
            self.job.take().ok_or_else(|| {
                format!("step {}: a job panicked that was never taken", logged.step)
            })?;
            self.tissue.job_failed();
        }
        let input = logged.input();
        let patch = &mut *self.patches.next;
        let result = self.tissue.step(&input, patch);
        stamp(patch, &input, &result);
        if logged.spoilt == 1 {
            spoil(patch);
        }
        let again = step_record(&input, &result, patch);
        if again.hash != logged.hash || again.published != logged.published {
            self.report.patches_differing += 1;
            self.report.first_patch.get_or_insert(logged.step);
        }
        if logged.job_taken {
            let job = self.tissue.take_job();
            if job.is_none() {
                return Err(format!(
                    "step {}: the log has a background job here, but the tissue requests none now",
                    logged.step
                ));
            }
            self.job = job;
        }
        self.report.steps += 1;
        Ok(())
    }

    fn tick(&mut self, entry: &TickEntry) {
        let n = (entry.tick.n_devices as usize).min(MAX_TOOLS);
        let states: [_; MAX_TOOLS] = std::array::from_fn(|k| entry.devices[k].state());
        self.patches.is_offered = entry.tick.offered;
        self.servo.tick(
            entry.tick.now,
            &states[..n],
            &mut self.patches,
            &mut self.commands[..n],
        );
        for (k, (command, device)) in self.commands.iter().zip(&entry.devices).take(n).enumerate() {
            let again = [command.force, command.torque].map(<[f64; 3]>::from);
            let logged = [device.force, device.torque];
            if again.map(|v| v.map(f64::to_bits)) == logged.map(|v| v.map(f64::to_bits)) {
                continue;
            }
            let difference = (0..3)
                .map(|i| (again[0][i] - logged[0][i]).powi(2))
                .sum::<f64>()
                .sqrt();
            // A NaN is kept, so that it never counts as within the tolerance.
            if difference.is_nan() || difference > self.report.max_force_difference {
                self.report.max_force_difference = difference;
            }
            self.report.first_force.get_or_insert(ForceDifference {
                tick: entry.tick.tick,
                device: k,
                logged: logged[0],
                replayed: again[0],
            });
        }
        self.report.ticks += 1;
    }
}

/// The patches in their order of arrival in the log.
struct Patches {
    current: Box<ContactPatch>,
    next: Box<ContactPatch>,
    is_offered: bool,
}

impl PatchSource for Patches {
    fn current(&self) -> &ContactPatch {
        &self.current
    }

    fn is_newer(&self) -> bool {
        self.is_offered
    }

    fn take(&mut self) {
        if self.is_offered {
            std::mem::swap(&mut self.current, &mut self.next);
            self.is_offered = false;
        }
    }
}

impl StepRecord {
    /// Input of the step.
    pub fn input(&self) -> TissueInput {
        TissueInput {
            step: self.step,
            tick: self.tick,
            sampled_at: self.sampled_at,
            now: self.now,
            dt: self.dt,
            period: self.period,
            poses: std::array::from_fn(|k| {
                let at = |all: &[f64], i: usize| all.get(i).copied().unwrap_or_default();
                pose(
                    std::array::from_fn(|i| at(&self.positions, 3 * k + i)),
                    std::array::from_fn(|i| at(&self.orientations, 4 * k + i)),
                )
            }),
            n_tools: self.n_tools as usize,
            aim: self.is_aimed.then(|| self.aim.into()),
        }
    }
}

impl DeviceRecord {
    /// State of the device that the law got; `None` if the device could not be read.
    pub fn state(&self) -> Option<DeviceState> {
        self.is_there.then(|| DeviceState {
            time: self.time,
            pose: pose(self.position, self.orientation),
            velocity: self.velocity.into(),
            buttons: self.buttons,
        })
    }
}

/// A pose with exactly the logged bits, without normalisation.
fn pose(position: [f64; 3], orientation: [f64; 4]) -> Pose {
    Pose::from_parts(
        Translation3::from(position),
        UnitQuaternion::new_unchecked(Quaternion::from(orientation)),
    )
}
