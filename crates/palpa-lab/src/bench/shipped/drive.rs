//! The loop in virtual time: ticks of 1 ms, and steps that take as long as they need on this core.
//!
//! ```text
//! tick     0     1     2     3     4     5     6
//! step     |--- CPU time ---|--- CPU time ---|         begun with the newest pose
//! patch                     ↑ taken by the next tick
//! job                       |----- CPU time -----|     installed by the next step
//! ```
//! The order is that of the engine's threads: the 1 kHz law, the tissue, the background. Other load of
//! the machine does not count, since CPU time is measured; nor do waits.

use palpa::live::{LiveScene, LiveTissue, once_from, open_device, servo_params};
use palpa::rt::{StepStatus, Tissue, TissueInput, ahead, empty_patch, stamp, thread_cpu};
use palpa_device::{Latest, Path, Scripted};
use palpa_fem::PosedTool;
use palpa_mesh::Vec3;
use palpa_scene::Scene;
use palpa_servo::{DeviceState, ForceCommand, MAX_TOOLS, Pose, Servo};

/// Period of the loop, s.
const PERIOD: f64 = 1e-3;
/// Smallest time between two steps, and largest time by which one moves the tissue on, s: those of the
/// engine.
const SHORTEST: f64 = 1e-3;
const LONGEST: f64 = 0.02;
/// A job that is no longer wanted ends after this share of its time: no part of it takes longer.
const GIVES_UP: f64 = 0.15;
/// Time before the hand begins, s, in which the force ramps up.
const BEGIN: f64 = 0.7;

/// The time that steps and jobs of the background take in virtual time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StepTime {
    /// Their own CPU time on this core.
    Own,
    /// By what they do, so that the forces are the same on every machine, s.
    Counted {
        /// A factor of the zone.
        factor: f64,
        /// An iteration.
        iteration: f64,
        /// A job of the background.
        job: f64,
    },
    /// None: what the loop would do on a machine without limits.
    Zero,
}

/// Part of the way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// Down.
    Press,
    /// Across the skin.
    Stroke,
    /// Up.
    Lift,
}

/// The force in a tick.
#[derive(Debug, Clone, Copy)]
pub struct Felt {
    /// Time, s.
    pub time: f64,
    /// The tool with its pose in the scene's frame.
    pub tool: PosedTool,
    /// Commanded force, in the scene's frame, N.
    pub force: Vec3,
    /// Whether the law gives the whole force; otherwise it lets go, or comes back from that.
    pub is_whole: bool,
    /// Depth of the device below the first touch at the place, m.
    pub depth: f64,
    /// Part of the way.
    pub part: Part,
}

/// Results of a way.
#[derive(Debug, Default)]
pub struct Driven {
    /// CPU time of each step with a vertex near the tool, s: with its patch, and with the result of
    /// a background job if one was installed.
    pub times: Vec<f64>,
    /// CPU time of the background's jobs during the way, s.
    pub background: f64,
    /// Duration of the way, s.
    pub duration: f64,
    /// Steps with contact that were behind the tool.
    pub n_behind: usize,
    /// Steps with contact that did not converge.
    pub n_unfinished: usize,
    /// Steps without a new patch.
    pub n_failed: usize,
    /// The force in each tick from the beginning of the motion.
    pub felt: Vec<Felt>,
}

/// Goes the scene's motion once over the live scene with an ideal hand, at the motion's speed.
///
/// # Errors
/// If the body cannot be factored.
pub fn drive(scene: &Scene, live: &LiveScene, takes: StepTime) -> anyhow::Result<Driven> {
    let path = once_from(live.start, scene, &live.scene_from_device);
    let shipped = open_device(&scene.device, Path::from(live.start))?;
    let mut device = Scripted::new(path.clone(), shipped.spec());
    let params = servo_params(&*shipped);
    let mut servo = Box::new(Servo::new(&params, &[shipped.spec()]));
    let mut run = Loop::new(live.tissue()?, takes);
    let mut driven = Driven {
        duration: path.duration(),
        ..Driven::default()
    };
    let (mut stretch, mut velocity) = (Vec3::zeros(), Vec3::zeros());
    let mut command = [ForceCommand::ZERO];
    let n = ((BEGIN + path.duration()) / PERIOD).ceil() as u64;
    for tick in 0..n {
        let now = tick as f64 * PERIOD;
        run.publish(now);
        let state = read(&mut device, now);
        let position = state.pose.translation.vector;
        let tool = position + stretch;
        run.steps(tick, now, (tool, velocity), &mut driven);
        let report = servo.tick(now, &[Some(state)], &mut run.patches, &mut command);
        (stretch, velocity) = (report.tools[0].stretch, report.tools[0].velocity);
        if now >= BEGIN {
            let frame = &live.scene_from_device.rotation;
            driven.felt.push(Felt {
                time: now,
                tool: live.posed(position + stretch),
                force: frame.transform_vector(&command[0].force),
                is_whole: report.gain >= 1.0,
                depth: -position.z - scene.motion.above,
                part: part(&path, now - BEGIN),
            });
        }
    }
    Ok(driven)
}

/// The device, which waits at the start of its path until the force has ramped up.
fn read(device: &mut Scripted, now: f64) -> DeviceState {
    use palpa_device::HapticDevice as _;
    let mut state = device.read((now - BEGIN).max(0.0)).unwrap_or(DeviceState {
        time: now,
        pose: Pose::identity(),
        velocity: Vec3::zeros(),
        buttons: 0,
    });
    state.time = now;
    state
}

fn part(path: &Path, time: f64) -> Part {
    let velocity = path.at(time + PERIOD) - path.at(time);
    let aside = velocity.x.hypot(velocity.y);
    if aside > velocity.z.abs() {
        Part::Stroke
    } else if velocity.z > 0.0 {
        Part::Lift
    } else {
        Part::Press
    }
}

/// The tissue and its background in virtual time.
struct Loop {
    tissue: LiveTissue,
    takes: StepTime,
    patches: Latest,
    /// The patch that is made, and the time at which it is ready, s.
    working: Box<palpa_servo::ContactPatch>,
    ready_at: Option<f64>,
    /// Time at which the next step may begin, s.
    free_at: f64,
    last_start: f64,
    period: f64,
    step: u64,
    job: Option<Under>,
}

/// A job that is under way.
struct Under {
    /// Time at which it ends, and the whole time that it takes, s.
    due: f64,
    takes: f64,
    done: <LiveTissue as Tissue>::Done,
}

impl Loop {
    fn new(mut tissue: LiveTissue, takes: StepTime) -> Self {
        tissue.prepare();
        Self {
            tissue,
            takes,
            patches: Latest::new(),
            working: empty_patch(),
            ready_at: None,
            free_at: 0.0,
            last_start: -SHORTEST,
            period: SHORTEST,
            step: 0,
            job: None,
        }
    }

    /// Hands the patch to the law if it is ready.
    fn publish(&mut self, now: f64) {
        if self.ready_at.take_if(|at| *at <= now).is_some() {
            self.patches.slot().clone_from(&self.working);
            self.patches.publish();
        }
    }

    /// The steps that begin before the next tick, with the tool of this one: its place and velocity.
    fn steps(&mut self, tick: u64, now: f64, tool: (Vec3, Vec3), driven: &mut Driven) {
        while self.free_at < now + PERIOD {
            let start = self.free_at.max(now);
            // Its memory is the working patch's: an earlier one is handed over before.
            self.publish(start);
            self.one_step(tick, now, start, tool, driven);
        }
    }

    /// Time that a step takes which began at this reading of the thread's CPU clock, s.
    fn time_of_step(&self, clock: f64) -> f64 {
        match self.takes {
            StepTime::Own => thread_cpu() - clock,
            StepTime::Counted {
                factor, iteration, ..
            } => self.tissue.last().map_or(0.0, |last| {
                last.n_factors as f64 * factor + last.iterations as f64 * iteration
            }),
            StepTime::Zero => 0.0,
        }
    }

    /// Time that a job takes which began at this reading of the thread's CPU clock, s.
    fn time_of_job(&self, clock: f64) -> f64 {
        match self.takes {
            StepTime::Own => thread_cpu() - clock,
            StepTime::Counted { job, .. } => job,
            StepTime::Zero => 0.0,
        }
    }

    fn one_step(
        &mut self,
        tick: u64,
        now: f64,
        start: f64,
        (tool, velocity): (Vec3, Vec3),
        driven: &mut Driven,
    ) {
        let elapsed = start - self.last_start;
        self.last_start = start;
        self.period += 0.1 * (elapsed.min(LONGEST) - self.period);
        self.step += 1;
        let input = TissueInput {
            step: self.step,
            tick,
            sampled_at: now,
            now: start,
            dt: elapsed.min(LONGEST),
            period: self.period,
            poses: [ahead(
                Pose::translation(tool.x, tool.y, tool.z),
                &velocity,
                self.period,
            ); MAX_TOOLS],
            n_tools: 1,
            aim: None,
        };
        let clock = thread_cpu();
        if let Some(Under { done, .. }) = self.job.take_if(|job| job.due <= start) {
            self.tissue.install(done);
        }
        let result = self.tissue.step(&input, &mut self.working);
        let has_given_up = self.tissue.has_given_up_job();
        let work = self.job.is_none().then(|| self.tissue.take_job()).flatten();
        let time = self.time_of_step(clock);
        stamp(&mut self.working, &input, &result);
        let end = start + time;
        self.ready_at = result.is_published().then_some(end);
        self.free_at = end.max(start + SHORTEST);
        if let Some(job) = (self.job.as_mut()).filter(|_| has_given_up) {
            let due = job.due.min(end + GIVES_UP * job.takes);
            if now > BEGIN {
                driven.background -= job.due - due;
            }
            job.due = due;
        }
        if let Some(work) = work {
            let clock = thread_cpu();
            let done = LiveTissue::run(work);
            let takes = self.time_of_job(clock);
            if now > BEGIN {
                driven.background += takes;
            }
            let due = end + takes;
            self.job = Some(Under { due, takes, done });
        }
        // A step in which nothing moves costs nothing, and counts for nothing.
        if self.working.n_contacts > 0 && result.iterations > 0 {
            driven.times.push(time);
            driven.n_behind += usize::from(result.status == StepStatus::Behind);
            driven.n_unfinished += usize::from(result.status == StepStatus::Unfinished);
        }
        driven.n_failed += usize::from(!result.status.has_patch());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = r#"
        [body]
        generator = { kind = "block", size = ["60 mm", "60 mm", "20 mm"], spacing = "10 mm" }
        [[layer]]
        tissue = { name = "gel", young = "10 kPa", poisson = 0.45 }
        [tool]
        shape = "sphere"
        radius = "8 mm"
        [device]
        preset = "falcon"
        [motion]
        kind = "stroke"
        depth = "3 mm"
        speed = "50 mm/s"
        length = "6 mm"
    "#;

    #[test]
    fn a_way_with_steps_that_take_no_time_is_the_same_each_time_and_has_every_tick() {
        let scene = Scene::parse(SCENE, std::path::Path::new(".")).unwrap();
        let live = LiveScene::build(&scene).unwrap();
        let drive = || drive(&scene, &live, StepTime::Zero).unwrap();
        let (first, second) = (drive(), drive());
        let forces = |driven: &Driven| -> Vec<[u64; 3]> {
            let bits = |f: &Felt| [f.force.x, f.force.y, f.force.z].map(f64::to_bits);
            driven.felt.iter().map(bits).collect()
        };
        assert_eq!(forces(&first), forces(&second));
        let n_ticks = (first.duration / PERIOD).ceil() as usize;
        assert!(first.felt.len().abs_diff(n_ticks) <= 1, "{n_ticks}");
        assert!(first.felt.iter().all(|felt| felt.is_whole));
        for part in [Part::Press, Part::Stroke, Part::Lift] {
            let of_part = first.felt.iter().filter(|felt| felt.part == part);
            let largest = of_part.map(|felt| felt.force.norm()).fold(0.0, f64::max);
            assert!(largest > 0.1, "{part:?}: {largest} N");
        }
    }
}
