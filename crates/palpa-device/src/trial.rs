//! Trials of the closed loop in simulated time: servo, device, hand, and a bed of tissue whose
//! patches arrive late.

use crate::{Bed, BedParams, DeviceModel, Grip, HapticDevice, Path, SimulatedDevice};
use palpa_servo::{
    ContactPatch, DeviceState, ForceCommand, PatchSource, Pose, Servo, ServoParams, TickReport,
    Vec3,
};

/// A mailbox for a single thread; it keeps the latest patch only.
#[derive(Debug, Clone)]
pub struct Latest {
    current: Box<ContactPatch>,
    next: Box<ContactPatch>,
    is_newer: bool,
}

impl Latest {
    /// A mailbox that holds an unwritten patch.
    pub fn new() -> Self {
        Self {
            current: Box::new(ContactPatch::EMPTY),
            next: Box::new(ContactPatch::EMPTY),
            is_newer: false,
        }
    }

    /// Slot for the next patch; [`Latest::publish`] makes it visible.
    pub fn slot(&mut self) -> &mut ContactPatch {
        &mut self.next
    }

    /// Makes the written patch visible to the reader.
    pub fn publish(&mut self) {
        self.is_newer = true;
    }
}

impl Default for Latest {
    fn default() -> Self {
        Self::new()
    }
}

impl PatchSource for Latest {
    fn current(&self) -> &ContactPatch {
        &self.current
    }

    fn is_newer(&self) -> bool {
        self.is_newer
    }

    fn take(&mut self) {
        if self.is_newer {
            std::mem::swap(&mut self.current, &mut self.next);
            self.is_newer = false;
        }
    }
}

/// Settings of a trial.
#[derive(Debug, Clone)]
pub struct Trial {
    /// The device.
    pub device: DeviceModel,
    /// The grip of the hand.
    pub grip: Grip,
    /// The tissue.
    pub bed: BedParams,
    /// The path of the hand.
    pub path: Path,
    /// Patches per second; each arrives one period late.
    pub patch_rate: f64,
    /// Duration, s.
    pub duration: f64,
    /// The law's settings.
    pub servo: ServoParams,
}

/// One tick of a trial.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// Clock, s.
    pub time: f64,
    /// True position of the hand-piece, m.
    pub position: Vec3,
    /// Commanded force, N.
    pub force: Vec3,
    /// Report of the law.
    pub report: TickReport,
}

/// Result of a trial.
#[derive(Debug, Clone)]
pub struct TrialReport {
    /// All ticks.
    pub samples: Vec<Sample>,
    /// RMS of the force between 20 and 400 Hz over the last 2 s, N.
    pub rms: f64,
    /// Largest energy deficit at any time, J: energy given out beyond the energy taken in, computed
    /// from the true positions.
    pub deficit: f64,
    /// Largest change of force in a tick in which a patch arrived, N. Ticks during a ramp do not
    /// count.
    pub arrival_step: f64,
    /// 99.9th percentile of the change in the other ticks, N.
    pub other_step: f64,
}

impl Trial {
    /// Runs the trial.
    pub fn run(&self) -> TrialReport {
        let device = SimulatedDevice::new(self.device, self.grip, self.path.clone());
        self.run_with(device, SimulatedDevice::position, |_| 0.0)
    }

    /// Runs the trial with another device, such as a faulty one. `position` returns the true
    /// position of the device, m; `hiccup` returns how long the loop stands still before a tick, s.
    pub fn run_with<D: HapticDevice>(
        &self,
        mut device: D,
        position: impl Fn(&D) -> Vec3,
        mut hiccup: impl FnMut(f64) -> f64,
    ) -> TrialReport {
        let params = ServoParams {
            resolution: self.device.resolution.max(1e-6),
            ..self.servo
        };
        let mut servo = Box::new(Servo::new(&params, &[device.spec()]));
        let mut bed = Bed::new(&self.bed);
        let mut patches = Latest::new();
        let mut working = Box::new(ContactPatch::EMPTY);
        let period = 1.0 / self.patch_rate;
        let mut next_patch = 0.0;
        let mut samples = Vec::new();
        let mut clock = 1.0;
        let end = clock + self.duration;
        let mut pose = Pose::identity();
        let mut last_position = None;
        let (mut absorbed, mut deficit): (f64, f64) = (0.0, 0.0);
        let mut stretch = Vec3::zeros();
        let mut command = [ForceCommand::ZERO];
        while clock < end {
            clock += hiccup(clock);
            let state: Option<DeviceState> = device.read(clock).ok();
            if let Some(state) = &state
                && state.pose.translation.vector.iter().all(|x| x.is_finite())
            {
                pose = state.pose;
            }
            let at = position(&device);
            if let Some(last) = last_position {
                absorbed -= command[0].force.dot(&(at - last));
                deficit = deficit.max(-absorbed);
            }
            last_position = Some(at);
            if clock >= next_patch {
                // The patch that was started one period ago is ready now. The next one starts at
                // the present pose.
                if working.id > 0 {
                    patches.slot().clone_from(&working);
                    patches.publish();
                }
                let tool =
                    Pose::from_parts((pose.translation.vector + stretch).into(), pose.rotation);
                bed.step(&tool, clock, period, &mut working);
                next_patch = clock + period - 1e-9;
            }
            let report = servo.tick(clock, &[state], &mut patches, &mut command);
            stretch = report.tools[0].stretch;
            // A lost device accepts no force; the trial goes on.
            let _ = device.write(clock, &command[0]);
            samples.push(Sample {
                time: clock,
                position: at,
                force: command[0].force,
                report,
            });
            clock += 1e-3;
        }
        let forces: Vec<Vec3> = samples.iter().map(|s| s.force).collect();
        let tail = &forces[forces.len().saturating_sub(2000)..];
        let (arrival_step, other_step) = steps(&samples);
        TrialReport {
            rms: band_rms(tail, 1e-3, 20.0, 400.0),
            deficit,
            arrival_step,
            other_step,
            samples,
        }
    }
}

fn steps(samples: &[Sample]) -> (f64, f64) {
    let mut arrival: f64 = 0.0;
    let mut others = Vec::new();
    for pair in samples.windows(2) {
        if pair[0].report.gain < 1.0 {
            continue;
        }
        let step = (pair[1].force - pair[0].force).norm();
        if pair[1].report.is_new_patch {
            arrival = arrival.max(step);
        } else {
            others.push(step);
        }
    }
    others.sort_by(f64::total_cmp);
    let at = (others.len() as f64 * 0.999) as usize;
    (
        arrival,
        others
            .get(at.min(others.len().saturating_sub(1)))
            .copied()
            .unwrap_or(0.0),
    )
}

/// RMS of samples within a band of frequencies, Hz. The samples are `dt` apart, s; their linear
/// trend is removed first.
pub fn band_rms(samples: &[Vec3], dt: f64, from: f64, to: f64) -> f64 {
    let n = samples.len();
    if n < 2 {
        return 0.0;
    }
    let middle = 0.5 * (n - 1) as f64;
    let mean = samples.iter().sum::<Vec3>() / n as f64;
    let slope = (samples.iter().enumerate()).fold(Vec3::zeros(), |sum, (i, f)| {
        sum + (f - mean) * (i as f64 - middle)
    }) / (n as f64 * (n as f64 * n as f64 - 1.0) / 12.0);
    let rest: Vec<Vec3> = (samples.iter().enumerate())
        .map(|(i, f)| f - mean - slope * (i as f64 - middle))
        .collect();
    let resolution = 1.0 / (n as f64 * dt);
    let (first, last) = (
        (from / resolution).ceil() as usize,
        (to / resolution).floor() as usize,
    );
    let mut power = 0.0;
    for bin in first..=last.min(n / 2) {
        let turn = std::f64::consts::TAU * bin as f64 / n as f64;
        let (step_sin, step_cos) = turn.sin_cos();
        let (mut sin, mut cos) = (0.0, 1.0);
        let (mut real, mut imaginary) = (Vec3::zeros(), Vec3::zeros());
        for f in &rest {
            real += f * cos;
            imaginary += f * sin;
            (sin, cos) = (
                sin * step_cos + cos * step_sin,
                cos * step_cos - sin * step_sin,
            );
        }
        power += 2.0 * (real.norm_squared() + imaginary.norm_squared()) / (n as f64 * n as f64);
    }
    power.sqrt()
}

/// Result of one trial of the range in which a device in a hand is stable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZWidthPoint {
    /// Stiffness of the wall, N/m.
    pub stiffness: f64,
    /// Rendered damping of the wall, N s/m.
    pub damping: f64,
    /// RMS of the force between 20 and 400 Hz, N, while the hand's target is still.
    pub rms: f64,
    /// Whether `rms` is below 0.02 N.
    pub is_stable: bool,
}

/// Tests which pairs of stiffness and damping are stable. For each pair, the device presses a wall
/// of one vertex with the coupling off.
///
/// With `guard` the energy observer is on, as in normal use. Without it, nothing but the device and
/// the hand damps the motion.
pub fn z_width(
    device: &DeviceModel,
    grip: &Grip,
    stiffnesses: &[f64],
    dampings: &[f64],
    guard: bool,
) -> Vec<ZWidthPoint> {
    let mut points = Vec::new();
    for &damping in dampings {
        for &stiffness in stiffnesses {
            let mut device = *device;
            device.spec.max_stiffness = 1e9;
            device.spec.max_damping = device.spec.max_damping.max(damping);
            let bed = BedParams {
                compliance: 1.0 / stiffness,
                stiffening: 0.0,
                n_side: 1,
                ..BedParams::default()
            };
            let above = Vec3::new(0.0, 0.0, bed.radius + 2e-3);
            let deep = 2e-3 + 3e-3;
            let trial = Trial {
                device,
                grip: *grip,
                bed,
                path: Path::from(above)
                    .hold(0.8)
                    .to(above - Vec3::z() * deep, 0.1)
                    .hold(3.0),
                patch_rate: 200.0,
                duration: 3.5,
                servo: ServoParams {
                    damping,
                    energy_budget: if guard { 2e-3 } else { 1e9 },
                    ..ServoParams::default()
                },
            };
            let rms = trial.run().rms;
            points.push(ZWidthPoint {
                stiffness,
                damping,
                rms,
                is_stable: rms < 0.02,
            });
        }
    }
    points
}
