//! The loop in simulated time: law, tissue and device as in the engine, with steps that take a
//! fixed time.
//!
//! ```text
//! tick   0 1 2 3 4 5 6 7 8 …           1 kHz
//! step   |--- 1 --|--- 2 --|           begun with the pose of its first tick, its patch offered where the next begins
//! ```
//! No wall-clock time enters: the same input gives the same forces bit for bit, even on a busy
//! machine.

use palpa_device::{HapticDevice, Latest};
use palpa_rt::{Tissue, TissueInput, ahead, stamp};
use palpa_servo::{
    DeviceState, ForceCommand, MAX_TOOLS, Pose, Servo, ServoParams, TickReport, Vec3,
};

/// Parameters of a rehearsal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RehearsalParams {
    /// Duration of a step of the tissue, s; rounded to ticks.
    pub step_time: f64,
    /// Number of steps that a background job takes.
    pub job_steps: u32,
    /// Simulated time, s.
    pub duration: f64,
    /// Settings of the control law.
    pub servo: ServoParams,
}

impl Default for RehearsalParams {
    fn default() -> Self {
        Self {
            step_time: 4e-3,
            job_steps: 8,
            duration: 1.0,
            servo: ServoParams::default(),
        }
    }
}

/// The results of one tick.
#[derive(Debug, Clone, Copy)]
pub struct RehearsalTick {
    /// Simulated time, s.
    pub time: f64,
    /// Position last reported by the device, in its own frame, m.
    pub position: Vec3,
    /// Commanded force, N.
    pub force: Vec3,
    /// The law's report.
    pub report: TickReport,
}

/// Runs law and tissue with a device. `each_step` is called with the tissue after every step.
pub fn rehearse<T: Tissue>(
    tissue: &mut T,
    device: &mut dyn HapticDevice,
    params: &RehearsalParams,
    mut each_step: impl FnMut(&T, &TissueInput, &palpa_rt::TissueStep),
) -> Vec<RehearsalTick> {
    let period = params.servo.period;
    let n_ticks = (params.duration / period).round() as u64;
    let every = (params.step_time / period).round().max(1.0) as u64;
    let mut servo = Box::new(Servo::new(&params.servo, &[device.spec()]));
    let mut patches = Latest::new();
    let mut working = palpa_rt::empty_patch();
    let mut is_made = false;
    let mut job: Option<(u64, T::Done)> = None;
    let mut position = Vec3::zeros();
    let (mut stretch, mut velocity) = (Vec3::zeros(), Vec3::zeros());
    let mut step = 0;
    let mut ticks = Vec::with_capacity(n_ticks as usize);
    tissue.prepare();
    for tick in 0..n_ticks {
        let now = tick as f64 * period;
        // If the device is away, the tissue keeps its last pose and the law gets no reading.
        let state: Option<DeviceState> = device.read(now).ok();
        if let Some(state) = state {
            position = state.pose.translation.vector;
        }
        if tick % every == 0 {
            if is_made {
                patches.slot().clone_from(&working);
                patches.publish();
            }
            step += 1;
            if let Some((_, done)) = job.take_if(|(due, _)| *due <= step) {
                tissue.install(done);
            }
            let tool = position + stretch;
            let patch_period = every as f64 * period;
            let pose = Pose::translation(tool.x, tool.y, tool.z);
            let input = TissueInput {
                step,
                tick,
                sampled_at: now,
                now,
                dt: patch_period,
                period: patch_period,
                poses: [ahead(pose, &velocity, patch_period); MAX_TOOLS],
                n_tools: 1,
                aim: None,
            };
            let done = tissue.step(&input, &mut working);
            stamp(&mut working, &input, &done);
            is_made = done.status.has_patch();
            each_step(tissue, &input, &done);
            if job.is_none()
                && let Some(work) = tissue.take_job()
            {
                job = Some((step + u64::from(params.job_steps), T::run(work)));
            }
        }
        let mut command = [ForceCommand::ZERO];
        let report = servo.tick(now, &[state], &mut patches, &mut command);
        (stretch, velocity) = (report.tools[0].stretch, report.tools[0].velocity);
        // A device that is away cannot receive the command.
        let _ = device.write(now, &command[0]);
        ticks.push(RehearsalTick {
            time: now,
            position,
            force: command[0].force,
            report,
        });
    }
    ticks
}
