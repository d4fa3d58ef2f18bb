//! Background jobs of real tissue that panic, through the engine's threads.

use std::path::Path;
use std::sync::atomic::Ordering;

use palpa::live::{LiveScene, device_model, grip, notes_of};
use palpa::scene::Scene;
use palpa_device::{LiveTarget, SimulatedDevice};
use palpa_rt::{
    Engine, EngineParams, Happening, Log, RecorderParams, ReplayParams, Report, StepRecord,
    Verdict, replay,
};
use palpa_servo::Vec3;
use palpa_testkit::{Layer, Scene as SceneText, Value, wait_for};

/// A gel that creeps, under a mesh that moves.
fn gel() -> Scene {
    let prony = r#"poisson = 0.45, prony = { terms = [{ g = 0.3, tau = "0.1 s" }] }"#;
    let gel = Layer::of(&format!(r#"name = "gel", young = "10 kPa", {prony}"#)).levels(3);
    let scene = SceneText::block([160.0, 60.0, 20.0], 10.0)
        .layer(gel)
        .sphere(8.0)
        .press(3.0)
        .near_tool(4.0)
        .set("press", "at", Value::lengths([-40.0, 0.0, 0.0]))
        .set("mesh", "moves", true)
        .set("device", "preset", "ideal")
        .motion("press", 3.0);
    Scene::parse(&scene.to_string(), Path::new(".")).unwrap()
}

/// A hand that presses the gel.
struct Hand {
    engine: Engine,
    target: LiveTarget,
}

impl Hand {
    fn step(&mut self) -> StepRecord {
        self.engine.snapshot().step
    }

    /// Goes to a place along the skin, step by step, at a depth below the origin, m.
    fn go(&mut self, from: f64, to: f64, z: f64) {
        for k in 1..=60 {
            let x = from + (to - from) * f64::from(k) / 60.0;
            self.target.set(Vec3::new(x, 0.0, z));
            let step = self.step().step;
            wait_for("steps go on", || {
                (self.step().step >= step + 3).then_some(())
            });
        }
    }

    /// Waits until the force is steady for so many ticks, and returns it, N.
    fn settled(&mut self) -> f64 {
        let (mut since, mut last) = (0, f64::NAN);
        wait_for("the force is steady", || {
            let tick = self.engine.snapshot().tick;
            let force = tick.devices[0].force[2];
            let is_steady = tick.tick.gain >= 1.0 && (force - last).abs() < 2e-4;
            last = force;
            if !is_steady {
                since = tick.tick.tick;
            }
            (tick.tick.tick > since + 700).then_some(force)
        })
    }
}

/// Presses at one place and goes 40 mm across while so many jobs panic. Returns the last force, and
/// how far zone and mesh have come since the last panic.
fn stroke(live: &LiveScene, path: &Path, panics: u32) -> (f64, [u64; 2], Report) {
    let scene = &live.prepared.scene;
    let above = Vec3::z() * 10e-3;
    let target = LiveTarget::new(above);
    let model = device_model(scene.device.preset);
    let device = SimulatedDevice::live(model, grip(scene.device.grip), target.clone());
    let recorder = RecorderParams {
        path: Some(path.to_owned()),
        scene: scene.to_toml(),
        notes: notes_of(scene).unwrap(),
        ..RecorderParams::default()
    };
    let params = EngineParams {
        lock_memory: false,
        ..EngineParams::default()
    };
    let tissue = live.tissue_at(above).unwrap();
    let engine = Engine::start(tissue, vec![Box::new(device)], &params, &recorder).unwrap();
    let mut hand = Hand { engine, target };
    let z = -(scene.motion.above + 3e-3);
    hand.go(0.0, 0.0, z);
    hand.settled();
    hand.engine.faults().panic_jobs(panics);
    hand.go(0.0, 20e-3, z);
    wait_for("the jobs panicked", || {
        let panicked = &hand.engine.tissue_stats().jobs_panicked;
        (panicked.load(Ordering::Relaxed) == u64::from(panics)).then_some(())
    });
    let before = hand.step();
    hand.go(20e-3, 40e-3, z);
    let force = hand.settled();
    let after = hand.step();
    let report = hand.engine.stop();
    let come = [after.zone - before.zone, after.mesh - before.mesh];
    (force, come, report)
}

#[test]
fn a_job_that_panics_does_not_stop_zone_and_mesh() {
    let live = LiveScene::build(&gel()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let paths = [0, 3].map(|n| folder.path().join(format!("{n}.mcap")));
    let (expected, ..) = stroke(&live, &paths[0], 0);
    let (force, come, report) = stroke(&live, &paths[1], 3);
    println!("{force} N, {expected} N without a panic, {come:?}");
    assert_eq!(report.jobs_panicked, 3);
    let said = (report.events.iter()).filter(|e| e.what == Happening::JobPanicked);
    assert_eq!(said.count(), 3);
    assert!(come.iter().all(|&n| n > 0), "zones and meshes: {come:?}");
    assert!(expected > 0.05, "{expected} N");
    assert!((force / expected - 1.0).abs() < 0.02, "{force} {expected}");
    let log = Log::open(&paths[1]).unwrap();
    assert_eq!(log.steps.iter().filter(|s| s.job_failed).count(), 3);
    let tissue = live.tissue_at(Vec3::z() * 10e-3).unwrap();
    let again = replay(&log, tissue, &ReplayParams::default());
    assert_eq!(again.verdict, Verdict::Same, "{again:?}");
}
