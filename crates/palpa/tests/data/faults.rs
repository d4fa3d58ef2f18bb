//! Faults of device, tissue and clock while the finite elements are pressed, through the real threads, mailboxes and device: the
//! force stays finite and limited in size and slew and comes back, the log is whole, says what happened, and runs again to the bit.

use std::path::Path;

use palpa::device::{Fault, Faulty, HapticDevice, Path as Way, SimulatedDevice, Vec3};
use palpa::engine::{LiveScene, device_model, grip};
use palpa::rt::{
    Engine, EngineParams, Log, RecorderParams, ReplayParams, TickEntry, Verdict, replay,
};
use palpa::servo::{DeviceSpec, ServoParams};
use palpa::tissue::Scene;

const GEL: &str = r#"
[body]
generator = { kind = "block", size = ["60 mm", "60 mm", "30 mm"], spacing = "8 mm" }
[[layer]]
tissue = { name = "gel", young = "10 kPa", poisson = 0.45 }
levels = 3
[tool]
shape = "sphere"
radius = "8 mm"
[press]
at = ["0 mm", "0 mm", "0 mm"]
depth = "4 mm"
[mesh]
near_tool = "4 mm"
# Without dry friction, so that there is one place where hand and tissue are in balance.
[device]
preset = "ideal"
[motion]
kind = "press"
depth = "4 mm"
above = "3 mm"
"#;
/// Moments between which a fault has come and gone, s; before each the force is as it was.
const FIRST: f64 = 3.0;
const EVERY: f64 = 3.0;
const N_FAULTS: usize = 9;
/// Time without a fault after which the force is all back, s: it is let in slowly, in half a second.
const BACK: f64 = 1.0;

fn at(fault: usize) -> f64 {
    FIRST + EVERY * fault as f64
}

/// Pressing forces between two moments, N, where nothing held the force back lately: a machine that stands still for some
/// milliseconds (a virtual one does) is a fault that this test did not order, and the law answers it as any other.
fn settled_forces(log: &Log, from: f64, to: f64) -> Vec<f64> {
    let faults: Vec<f64> = (log.events.iter())
        .filter(|e| e.text.starts_with("law: "))
        .map(|e| e.time)
        .collect();
    let is_quiet = |now: f64| !faults.iter().any(|at| (now - BACK..=now).contains(at));
    (log.ticks.iter())
        .filter(|t| (from..to).contains(&t.tick.now) && is_quiet(t.tick.now))
        .map(|t| t.devices[0].force[2])
        .collect()
}

/// Pressing force at a moment, N.
fn force_at(log: &Log, moment: f64) -> f64 {
    let k = log.ticks.partition_point(|t| t.tick.now < moment);
    log.ticks[k].devices[0].force[2]
}

fn size(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Every force is within the device's own limits.
fn check_limits(log: &Log, spec: &DeviceSpec) {
    for pair in log.ticks.windows(2) {
        let [a, b]: [&TickEntry; 2] = [&pair[0], &pair[1]];
        let (now, force) = (b.tick.now, b.devices[0].force);
        assert!(
            size(force) <= spec.max_force * (1.0 + 1e-9),
            "{now} s: {force:?}"
        );
        let change = size(std::array::from_fn(|i| force[i] - a.devices[0].force[i]));
        let longest = (now - a.tick.now).max(1e-3);
        assert!(
            change <= spec.max_slew * longest + 1e-9,
            "{now} s: {change} N"
        );
    }
}

fn check_said(log: &Log) {
    let said: Vec<&str> = log.events.iter().map(|e| e.text.as_str()).collect();
    for text in [
        "the tissue pauses",
        "stale patch",
        "patch is late",
        "a patch with NaN",
        "no fault any more",
    ] {
        assert!(
            said.iter().any(|s| s.contains(text)),
            "{text:?} is not said: {said:#?}"
        );
    }
}

#[test]
fn faults_while_real_tissue_is_pressed() {
    if super::data().is_none() {
        return;
    }
    let scene = Scene::parse(GEL, Path::new("")).unwrap();
    let live = LiveScene::build(&scene).unwrap();
    let model = device_model(scene.device.preset);
    let deep = Vec3::z() * -7e-3;
    let end = at(N_FAULTS);
    // The last one is the hand's: out and in at 1 m/s.
    let way = Way::from(Vec3::zeros())
        .hold(1.0)
        .to(deep, 0.02)
        .hold(at(8) - 1.35)
        .to(Vec3::z() * 30e-3, 1.0)
        .to(deep, 1.0)
        .hold(EVERY);
    let device = SimulatedDevice::new(model, grip(scene.device.grip), way);
    let spec = device.spec();
    let device = Faulty::new(device)
        .with(at(0), at(0) + 0.1, Fault::Jump(Vec3::z() * -20e-3))
        .with(at(1), at(1) + 0.1, Fault::NotANumber)
        .with(at(2), at(2) + 0.2, Fault::Stall)
        .with(at(3), at(3) + 0.3, Fault::Unplug);
    let params = EngineParams {
        servo: ServoParams {
            resolution: model.resolution.max(1e-6),
            ..ServoParams::default()
        },
        ..EngineParams::default()
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let recorder = RecorderParams {
        path: Some(path.clone()),
        scene: scene.to_toml(),
        notes: palpa::engine::notes_of(&scene).unwrap(),
    };
    let engine = Engine::start(
        live.tissue().unwrap(),
        vec![Box::new(device)],
        &params,
        &recorder,
    )
    .unwrap();
    let until = |moment: f64| {
        while engine.now() < moment {
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
    };
    until(at(4));
    engine.faults().pause_tissue(true);
    until(at(4) + 0.3);
    engine.faults().pause_tissue(false);
    until(at(5));
    engine.faults().delay_tissue(0.1);
    until(at(6));
    engine.faults().spoil_patches(20);
    until(at(7));
    engine.faults().delay_loop(0.05);
    until(end);
    let report = engine.stop();
    let log = Log::open(&path).unwrap();

    assert!(log.ending == palpa_rt::Ending::Whole && !report.has_log_failed);
    assert_eq!(report.lost_records, [0, 0]);
    assert_eq!(log.ticks.len() as u64, report.ticks);
    check_limits(&log, &spec);
    let before = settled_forces(&log, FIRST - 0.5, FIRST);
    assert!(before.len() > 50, "the force never settled");
    let usual = before.iter().sum::<f64>() / before.len() as f64;
    assert!(usual > 0.1, "{usual}");
    for fault in 1..=N_FAULTS {
        let back = settled_forces(&log, at(fault - 1) + BACK + 0.4, at(fault));
        let [least, most] = [f64::min as fn(_, _) -> _, f64::max]
            .map(|of| back.iter().copied().reduce(of).unwrap_or(f64::NAN));
        println!(
            "before fault {fault}: {least:.4} to {most:.4} N of {usual:.4} in {} ticks",
            back.len()
        );
        assert!(
            back.len() > 50 && least > 0.9 * usual && most < 1.1 * usual,
            "before fault {fault}: {least} to {most} N in {} ticks, {usual} N",
            back.len()
        );
    }
    // Without a tissue, or a device, nothing presses on; the hand that was out felt nothing.
    for (fault, after) in [(1, 0.09), (3, 0.25), (4, 0.28)] {
        let there = force_at(&log, at(fault) + after);
        assert!(there.abs() < 0.7 * usual, "fault {fault}: {there} N");
    }
    check_said(&log);
    let again = replay(&log, live.tissue().unwrap(), &ReplayParams::default());
    assert_eq!(again.verdict, Verdict::Same, "{again:?}");
}
