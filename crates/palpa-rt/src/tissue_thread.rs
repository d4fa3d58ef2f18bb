//! The tissue thread and the background thread beside it.

use crate::{
    clock::{Clock, rest, thread_cpu},
    event::{Happening, Injection, Speaker},
    fault::FaultHooks,
    histogram::Histogram,
    mailbox::{Reader, Writer},
    record::StepRecord,
    tissue::{StepStatus, Tissue, TissueInput, TissueStep, ahead, patch_hash, stamp},
};
use palpa_servo::{ContactPatch, MAX_TOOLS, Pose, Vec3};
use rtrb::{Consumer, Producer};
use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    thread::Thread,
    time::Duration,
};

/// Steps in which no job is handed out after one that panicked, and their largest number. The number
/// doubles with each job that panics, and halves with each that does not.
const FIRST_PAUSE: u64 = 16;
const LONGEST_PAUSE: u64 = 4096;
/// Least time between the beginnings of two steps, s.
const LEAST_DT: f64 = 1e-6;
/// Number of steps without an iteration after which the tissue is at rest.
pub const REST_STEPS: u32 = 50;

/// Settings of the tissue thread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TissueParams {
    /// Smallest time between the starts of two steps, s. More steps could not be felt, and other
    /// threads can use the core meanwhile.
    pub min_period: f64,
    /// The same, if it is longer, once [`REST_STEPS`] steps in a row have found nothing to do: a body at rest, or under
    /// a tool that does not move.
    pub rest_period: f64,
    /// Largest time by which one step moves the tissue on, s. Without the cap, a stall would cause
    /// a jump.
    pub max_dt: f64,
}

impl Default for TissueParams {
    fn default() -> Self {
        Self {
            min_period: 1e-3,
            rest_period: 0.0,
            max_dt: 0.02,
        }
    }
}

/// Poses of the tools at a tick.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PoseSample {
    pub(crate) tick: u64,
    pub(crate) time: f64,
    pub(crate) poses: [Pose; MAX_TOOLS],
    /// Velocities of the tools, m/s.
    pub(crate) velocities: [Vec3; MAX_TOOLS],
    pub(crate) n_tools: usize,
}

impl PoseSample {
    pub(crate) fn none() -> Self {
        Self {
            tick: 0,
            time: 0.0,
            poses: [Pose::identity(); MAX_TOOLS],
            velocities: [Vec3::zeros(); MAX_TOOLS],
            n_tools: 0,
        }
    }
}

/// Statistics of the tissue thread; any thread may read them at any time.
#[derive(Debug, Default)]
pub struct TissueStats {
    /// CPU time of steps, s.
    pub cpu: Histogram,
    /// Wall time of steps, s.
    pub wall: Histogram,
    /// CPU time of background jobs, s.
    pub background: Histogram,
    /// Background jobs that panicked.
    pub jobs_panicked: AtomicU64,
    /// Steps without a new patch.
    pub held_back: AtomicU64,
    /// Steps not recorded because the ring was full.
    pub lost_records: AtomicU64,
}

/// The state of the tissue thread.
pub(crate) struct TissueThread<T: Tissue, C: Clock> {
    pub(crate) tissue: T,
    pub(crate) clock: C,
    pub(crate) params: TissueParams,
    pub(crate) poses: Reader<PoseSample>,
    pub(crate) aims: Reader<Option<Vec3>>,
    pub(crate) patches: Writer<ContactPatch>,
    pub(crate) view: Writer<StepRecord>,
    pub(crate) ring: Producer<StepRecord>,
    pub(crate) speaker: Speaker,
    pub(crate) background: Background<T>,
    pub(crate) faults: Arc<FaultHooks>,
    pub(crate) stats: Arc<TissueStats>,
}

/// The tissue thread's side of the background.
pub(crate) struct Background<T: Tissue> {
    pub(crate) jobs: Producer<Errand<T::Job>>,
    /// Result of a job; `None` if it panicked.
    pub(crate) done: Consumer<Option<T::Done>>,
    pub(crate) thread: Thread,
    pub(crate) is_busy: bool,
    pub(crate) pause: Pause,
}

/// The pause after jobs that panicked, so that one that always panics is not run in every step.
#[derive(Debug, Default)]
pub(crate) struct Pause {
    /// Length of the last pause, steps; 0 if there was none.
    length: u64,
    /// The step from which on jobs are handed out again.
    until: u64,
}

impl Pause {
    fn after_panic(&mut self, step: u64) {
        self.length = (2 * self.length).clamp(FIRST_PAUSE, LONGEST_PAUSE);
        self.until = step + self.length;
    }

    fn after_success(&mut self) {
        self.length /= 2;
    }
}

/// A job on its way to the background thread.
pub(crate) struct Errand<J> {
    job: J,
    /// Whether it panics on purpose.
    panics: bool,
}

/// The end of a background job, as the tissue learns of it between two steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum JobEnd {
    /// No job has ended.
    None,
    Installed,
    Panicked,
}

impl<T: Tissue, C: Clock> TissueThread<T, C> {
    /// Makes steps until `stop` is set or the tissue panics.
    pub(crate) fn run(mut self, stop: &AtomicBool) {
        if catch_unwind(AssertUnwindSafe(|| self.tissue.prepare())).is_err() {
            self.speaker
                .say(self.clock.now(), Happening::TissuePanicked(0));
            return;
        }
        self.speaker.say(self.clock.now(), Happening::TissueStarted);
        // There is nothing to press before the first pose.
        while !self.poses.take() && !stop.load(Ordering::Relaxed) {
            rest(Duration::from_micros(200));
        }
        let mut step = 0;
        let mut due = self.clock.now();
        let mut last_start = due - self.params.min_period;
        let mut period = self.params.min_period;
        let mut status = StepStatus::Converged;
        let mut lost = Lost::default();
        let mut idle_steps = 0;
        while !stop.load(Ordering::Relaxed) {
            if self.faults.is_tissue_paused() {
                self.wait_out_pause(stop);
                continue;
            }
            self.clock.wait_until(due);
            let now = self.clock.now();
            // Steps keep a fixed grid while they are short enough; the thread does not catch up
            // after a late step.
            let is_at_rest = idle_steps >= REST_STEPS;
            let spacing = if is_at_rest {
                self.params.min_period.max(self.params.rest_period)
            } else {
                self.params.min_period
            };
            // Later in any case: a clock that stands still would give a step of no time.
            due = (due + spacing).max(now + LEAST_DT);
            let elapsed = now - last_start;
            last_start = now;
            // Smoothed, so that one late step does not make the loop expect the next ones late.
            // Nor does rest, after which steps are as short as before.
            if !is_at_rest {
                period += 0.1 * (elapsed.min(self.params.max_dt) - period);
            }
            lost.add(elapsed - self.params.max_dt, now, &mut self.speaker);
            step += 1;
            // After a panic the state of the tissue may be half changed, so the thread ends. The
            // loop ramps down when the patch is stale.
            let result = catch_unwind(AssertUnwindSafe(|| self.step(step, now, elapsed, period)));
            let Ok((new_status, record)) = result else {
                self.speaker
                    .say(self.clock.now(), Happening::TissuePanicked(step));
                return;
            };
            let is_idle = new_status == StepStatus::Converged && record.iterations == 0;
            idle_steps = if is_idle {
                idle_steps.saturating_add(1)
            } else {
                0
            };
            if new_status != status {
                status = new_status;
                self.speaker
                    .say(self.clock.now(), Happening::StepStatus(step, status));
            }
            if self.ring.push(record).is_err() {
                self.stats.lost_records.fetch_add(1, Ordering::Relaxed);
            }
        }
        self.speaker
            .say(self.clock.now(), Happening::TissueStopped(step));
    }

    /// One step with its hand-over, hash and record.
    fn step(&mut self, step: u64, now: f64, elapsed: f64, period: f64) -> (StepStatus, StepRecord) {
        let cpu_t0 = thread_cpu();
        let job_end = self.take_in_job(step);
        self.poses.take();
        self.aims.take();
        let sample = *self.poses.current();
        let input = TissueInput {
            step,
            tick: sample.tick,
            sampled_at: sample.time,
            now,
            dt: elapsed.min(self.params.max_dt),
            period,
            poses: std::array::from_fn(|k| ahead(sample.poses[k], &sample.velocities[k], period)),
            n_tools: sample.n_tools,
            aim: *self.aims.current(),
        };
        if self.faults.take_panic() {
            self.speaker
                .say(now, Happening::Injected(Injection::TissuePanics));
            panic!("a panic on purpose");
        }
        let patch = self.patches.slot();
        let result = self.tissue.step(&input, patch);
        stamp(patch, &input, &result);
        let is_spoilt = self.faults.take_spoil();
        if is_spoilt {
            spoil(patch);
            self.speaker
                .say(now, Happening::Injected(Injection::PatchWithNan));
        }
        let mut record = step_record(&input, &result, patch);
        if let Some(delay) = self.faults.take_tissue_delay() {
            self.speaker
                .say(now, Happening::Injected(Injection::PatchLate));
            self.clock.wait_until(self.clock.now() + delay);
        }
        if record.published {
            self.patches.publish();
        }
        if !result.status.has_patch() {
            self.stats.held_back.fetch_add(1, Ordering::Relaxed);
        }
        record.installed = job_end == JobEnd::Installed;
        record.job_failed = job_end == JobEnd::Panicked;
        record.spoilt = u8::from(is_spoilt);
        record.lost = elapsed - input.dt;
        record.job_taken = self.hand_out_job(step);
        record.cpu = thread_cpu() - cpu_t0;
        record.wall = self.clock.now() - now;
        self.stats.cpu.add(record.cpu);
        self.stats.wall.add(record.wall);
        *self.view.slot() = record;
        self.view.publish();
        (result.status, record)
    }

    fn take_in_job(&mut self, step: u64) -> JobEnd {
        let Ok(done) = self.background.done.pop() else {
            return JobEnd::None;
        };
        self.background.is_busy = false;
        if let Some(done) = done {
            self.tissue.install(done);
            self.background.pause.after_success();
            return JobEnd::Installed;
        }
        self.tissue.job_failed();
        self.background.pause.after_panic(step);
        self.stats.jobs_panicked.fetch_add(1, Ordering::Relaxed);
        self.speaker.say(self.clock.now(), Happening::JobPanicked);
        JobEnd::Panicked
    }

    fn hand_out_job(&mut self, step: u64) -> bool {
        if self.background.is_busy || step < self.background.pause.until {
            return false;
        }
        let Some(job) = self.tissue.take_job() else {
            return false;
        };
        let panics = self.faults.take_job_panic();
        if panics {
            self.speaker
                .say(self.clock.now(), Happening::Injected(Injection::JobPanics));
        }
        // The ring is never full, because there is one job at a time.
        let errand = Errand { job, panics };
        self.background.is_busy = self.background.jobs.push(errand).is_ok();
        self.background.thread.unpark();
        self.background.is_busy
    }

    fn wait_out_pause(&mut self, stop: &AtomicBool) {
        self.speaker.say(
            self.clock.now(),
            Happening::Injected(Injection::TissuePauses),
        );
        while self.faults.is_tissue_paused() && !stop.load(Ordering::Relaxed) {
            rest(Duration::from_micros(500));
        }
        self.speaker.say(
            self.clock.now(),
            Happening::Injected(Injection::TissueGoesOn),
        );
    }
}

/// Runs jobs until `stop` is set and no job is left.
pub(crate) fn run_background<T: Tissue>(
    jobs: &mut Consumer<Errand<T::Job>>,
    done: &mut Producer<Option<T::Done>>,
    stop: &AtomicBool,
    stats: &TissueStats,
) {
    loop {
        if let Ok(Errand { job, panics }) = jobs.pop() {
            let t0 = thread_cpu();
            let run = || {
                assert!(!panics, "a panic on purpose");
                T::run(job)
            };
            let result = catch_unwind(AssertUnwindSafe(run)).ok();
            stats.background.add(thread_cpu() - t0);
            // The ring has room for every job that can be running. If the tissue thread is gone,
            // the result is not needed.
            let _ = done.push(result);
        } else if stop.load(Ordering::Relaxed) {
            return;
        } else {
            // The sender of a job wakes this thread; the time only bounds how long stopping takes.
            rest(Duration::from_millis(20));
        }
    }
}

/// Causes the fault of [`FaultHooks::spoil_patches`].
pub(crate) fn spoil(patch: &mut ContactPatch) {
    for tool in &mut patch.tools {
        tool.force.x = f64::NAN;
    }
    patch.contacts[0].position.z = f64::NAN;
    patch.compliance[0] = f64::NAN;
}

/// The part of the record that is known once the patch is made; the caller fills in the rest.
pub(crate) fn step_record(
    input: &TissueInput,
    result: &TissueStep,
    patch: &ContactPatch,
) -> StepRecord {
    let mut record = StepRecord {
        step: input.step,
        tick: input.tick,
        sampled_at: input.sampled_at,
        now: input.now,
        dt: input.dt,
        period: input.period,
        n_tools: input.n_tools as u32,
        is_aimed: input.aim.is_some(),
        aim: input.aim.unwrap_or_default().into(),
        status: result.status as u8,
        published: result.is_published(),
        iterations: result.iterations,
        residual: result.residual,
        factor: result.factor,
        zone: result.zone,
        mesh: result.mesh,
        energy: result.energy,
        n_contacts: patch.n_contacts as u32,
        hash: patch_hash(patch),
        ..StepRecord::default()
    };
    for (k, pose) in input.poses.iter().enumerate() {
        record.positions[3 * k..][..3].copy_from_slice(pose.translation.vector.as_slice());
        record.orientations[4 * k..][..4].copy_from_slice(pose.rotation.coords.as_slice());
    }
    record
}

/// Time lost to the cap on steps; reported at most ten times a second.
#[derive(Default)]
struct Lost {
    sum: f64,
    said_at: f64,
}

impl Lost {
    fn add(&mut self, lost: f64, now: f64, speaker: &mut Speaker) {
        self.sum += lost.max(0.0);
        if self.sum > 0.0 && now - self.said_at > 0.1 {
            speaker.say(now, Happening::TimeLost(self.sum));
            *self = Self {
                sum: 0.0,
                said_at: now,
            };
        }
    }
}
