//! Whole runs: threads, forces, log, replay, tables.

use crate::{
    devices::{Hand, Ill, SPEC, Scripted, announced, until},
    toy::{Bed, RADIUS},
};
use palpa_device::{DeviceModel, Grip, Path as Path3, SimulatedDevice};
use palpa_rt::{
    Ending, Engine, EngineParams, Log, Machine, REST_STEPS, RecorderParams, ReplayParams, Report,
    StartError, StepRecord, TissueParams, Verdict, replay,
};
use palpa_servo::Vec3;
use std::path::Path;

/// As the tests run everywhere: without privileges that a machine may or may not give.
pub(crate) fn params() -> EngineParams {
    EngineParams {
        lock_memory: false,
        ..EngineParams::default()
    }
}

pub(crate) fn recorder(path: &Path) -> RecorderParams {
    RecorderParams {
        path: Some(path.to_owned()),
        scene: "[tool]\nshape = \"sphere\"\n".to_owned(),
        notes: [("made by".to_owned(), "a test".to_owned())].into(),
        ..RecorderParams::default()
    }
}

/// Waits until the loop has done so many ticks more, the tissue so many steps, and the background
/// so many jobs.
pub(crate) fn go_on(engine: &mut Engine, ticks: u64, steps: u64, jobs: u64) {
    let begin = engine.snapshot();
    until("ticks, steps and jobs are done", || {
        let now = engine.snapshot();
        now.tick.tick.tick >= begin.tick.tick.tick + ticks
            && now.step.step >= begin.step.step + steps
            && now.step.factor >= begin.step.factor + jobs
    });
}

/// Runs the bed under a scripted hand; `act` does what it likes meanwhile.
pub(crate) fn run(path: &Path, bed: Bed, act: impl FnOnce(&mut Engine, &Hand)) -> (Report, Log) {
    let hand = Hand::default();
    let device = announced(Scripted::new(&hand));
    let mut engine = Engine::start(bed, vec![device], &params(), &recorder(path)).unwrap();
    act(&mut engine, &hand);
    let report = engine.stop();
    assert!(hand.force() == 0.0, "the device was let go under force");
    (report, Log::open(path).unwrap())
}

/// What holds in every run: nothing is lost or out of order, and each force is finite and within
/// limits.
pub(crate) fn check_records(report: &Report, log: &Log) {
    assert_eq!(log.ending, Ending::Whole);
    assert_eq!(report.lost_records, [0, 0]);
    assert!(!report.has_log_failed);
    assert_eq!(log.ticks.len() as u64, report.ticks);
    for (k, entry) in log.ticks.iter().enumerate() {
        assert_eq!(entry.tick.tick, k as u64 + 1);
        let force = entry.devices[0].force;
        let size = force.iter().map(|f| f * f).sum::<f64>().sqrt();
        assert!(
            size <= SPEC.max_force * (1.0 + 1e-12),
            "{size} N at tick {}",
            k + 1
        );
    }
    for pair in log.ticks.windows(2) {
        let (a, b) = (&pair[0], &pair[1]);
        let change = (0..3)
            .map(|i| (b.devices[0].force[i] - a.devices[0].force[i]).powi(2))
            .sum::<f64>()
            .sqrt();
        let longest = (b.tick.now - a.tick.now).max(1e-3);
        assert!(
            change <= SPEC.max_slew * longest + 1e-9,
            "{change} N at tick {}",
            b.tick.tick
        );
        assert!(b.tick.now > a.tick.now);
        assert!(b.tick.patch >= a.tick.patch);
    }
    for (k, step) in log.steps.iter().enumerate() {
        assert_eq!(step.step, k as u64 + 1);
        assert!(step.dt > 0.0 && step.dt <= 0.02);
    }
    let said = (report.events.iter()).map(|e| (e.time, e.what.level(), e.what.to_string()));
    let written = (log.events.iter()).map(|e| (e.time, e.level, e.text.clone()));
    assert!(said.eq(written), "{:#?}", log.events);
}

#[test]
fn two_thousand_ticks_are_recorded_whole_and_replayed_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let (report, log) = run(&path, Bed::new(), |engine, _| {
        go_on(engine, 1000, 100, 0);
        let snapshot = engine.snapshot();
        assert!(snapshot.tick.devices[0].position[2] < crate::toy::RADIUS);
        go_on(engine, 1000, 101, 6);
    });
    check_records(&report, &log);
    assert!(report.ticks >= 2000, "{} ticks", report.ticks);
    assert!(report.steps as usize == log.steps.len() && report.steps > 200);
    assert_eq!(report.tick_cpu.count, report.ticks);
    assert!(report.jobs.count > 5 && report.background_cpu_share > 0.0);
    assert!(report.forces[0].max_force > 0.5, "{:?}", report.forces);
    let names: Vec<_> = report.granted.iter().map(|g| g.thread).collect();
    assert_eq!(
        names,
        [
            "palpa-recorder",
            "palpa-background",
            "palpa-tissue",
            "palpa-servo"
        ]
    );
    assert!(report.panicked.is_empty());
    assert_eq!(log.header.scene, "[tool]\nshape = \"sphere\"\n");
    assert_eq!(log.header.notes["made by"], "a test");
    assert_eq!(log.specs, [SPEC]);

    let again = replay(&log, Bed::new(), &ReplayParams::default());
    assert_eq!(again.verdict, Verdict::Same, "{again:?}");
    assert_eq!((again.ticks, again.steps), (report.ticks, report.steps));
    assert!(again.jobs > 5 && again.differences.is_empty());
}

#[test]
fn two_devices_are_recorded_and_replayed_side_by_side() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let hands = [Hand::default(), Hand::default()];
    let devices = hands.iter().map(|hand| announced(Scripted::new(hand)));
    let mut engine =
        Engine::start(Bed::new(), devices.collect(), &params(), &recorder(&path)).unwrap();
    go_on(&mut engine, 300, 20, 0);
    hands[1].make(Ill::Unplugged);
    go_on(&mut engine, 300, 20, 0);
    let report = engine.stop();
    let log = Log::open(&path).unwrap();
    check_records(&report, &log);
    assert_eq!((log.specs.len(), report.forces.len()), (2, 2));
    assert!(
        log.ticks
            .iter()
            .all(|e| e.tick.n_devices == 2 && e.devices[1].tick == e.tick.tick)
    );
    assert!(
        log.ticks
            .iter()
            .any(|e| e.devices[0].is_there && !e.devices[1].is_there)
    );
    assert!(log.steps.iter().skip(1).all(|s| s.n_tools == 2));
    assert_eq!(log.forces(), report.forces);
    let again = replay(&log, Bed::new(), &ReplayParams::default());
    assert_eq!(again.verdict, Verdict::Same, "{again:?}");
}

#[test]
fn a_simulated_device_in_a_simulated_hand_is_replayed_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let above = Vec3::new(0.0, 0.0, RADIUS + 0.005);
    let press = Path3::press(above, -Vec3::z(), 0.009, 0.03, 5.0);
    let device = SimulatedDevice::new(DeviceModel::FALCON, Grip::MEDIUM, press);
    let devices = vec![announced(device)];
    let mut engine = Engine::start(Bed::new(), devices, &params(), &recorder(&path)).unwrap();
    // The hand is held up by the bed.
    until("the hand presses", || {
        let tick = engine.snapshot().tick;
        let force = tick.devices[0].force;
        force.iter().map(|f| f * f).sum::<f64>() > 0.3 * 0.3
    });
    let report = engine.stop();
    let log = Log::open(&path).unwrap();
    assert!(log.ending == Ending::Whole && log.ticks.len() as u64 == report.ticks);
    // With a force that the device can exert.
    let force = report.forces[0];
    assert!(
        force.max_force > 0.3 && force.max_force <= DeviceModel::FALCON.spec.max_force,
        "{force:?}"
    );
    let again = replay(&log, Bed::new(), &ReplayParams::default());
    assert_eq!(again.verdict, Verdict::Same, "{again:?}");
}

#[test]
fn a_replay_finds_what_was_changed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let (_, log) = run(&path, Bed::new(), |engine, _| go_on(engine, 700, 100, 5));
    let params = ReplayParams::default();

    // One bit of one reading in the middle: forces from there on, but no patch made of it.
    let mut other = log.clone();
    let at = other.ticks.len() / 2;
    let z = &mut other.ticks[at].devices[0].position[2];
    *z = f64::from_bits(z.to_bits() ^ (1 << 20));
    let report = replay(&other, Bed::new(), &params);
    assert_eq!(report.verdict, Verdict::Different);
    // Later only if a machine too busy had the force at zero just then.
    assert!(report.first_force.unwrap().tick > at as u64);
    assert_eq!(report.first_patch, None);
    assert!(report.max_force_difference > 0.0 && report.max_force_difference < 1e-6);

    // The same log from another machine or program: within the tolerance where that can change a
    // bit, and still different where it cannot.
    let mut again_on = |change: &dyn Fn(&mut Machine)| {
        other.header.machine = log.header.machine.clone();
        change(&mut other.header.machine);
        let report = replay(&other, Bed::new(), &params);
        let said: Vec<_> = report.differences.iter().map(ToString::to_string).collect();
        (report.verdict, said.join("\n"))
    };
    let (verdict, said) = again_on(&|m| m.cpu = "another".to_owned());
    assert_eq!(verdict, Verdict::WithinTolerance);
    assert!(
        said.starts_with("features of the processor: another in the log, "),
        "{said}"
    );
    let (verdict, said) = again_on(&|m| m.palpa = "0.0.9".to_owned());
    assert_eq!(verdict, Verdict::WithinTolerance);
    assert!(
        said.contains("version of Palpa: 0.0.9 in the log, "),
        "{said}"
    );
    let (verdict, said) = again_on(&|m| m.threads = "64".to_owned());
    assert_eq!(verdict, Verdict::Different);
    assert!(
        said.contains("64 in the log") && said.contains("changes no force"),
        "{said}"
    );
    let (verdict, said) = again_on(&|m| *m = Machine::default());
    assert_eq!(verdict, Verdict::WithinTolerance);
    assert!(
        said.contains("version of Palpa: not recorded in the log"),
        "{said}"
    );

    // A job that was installed one step later or earlier: its patches differ. No other job may be
    // taken or installed between.
    let alone = |p: &[StepRecord]| p[0].installed != p[1].installed && !p[0].job_taken;
    let swapped = |k: usize| {
        let mut other = log.clone();
        let [a, b] = [k, k + 1].map(|k| log.steps[k].installed);
        (other.steps[k].installed, other.steps[k + 1].installed) = (b, a);
        replay(&other, Bed::new(), &params)
    };
    let pairs = log.steps.windows(2).enumerate();
    let mut moved = (pairs.filter(|(_, pair)| alone(pair))).map(|(k, _)| (k, swapped(k)));
    // In the air, and where the hand rests, a job gives what the one before gave.
    let found = moved.find(|(_, report)| report.verdict != Verdict::Same);
    let (k, report) = found.expect("a job that changes a patch");
    assert_eq!(report.verdict, Verdict::Different);
    assert_eq!(report.first_patch, Some(k as u64 + 1));

    // A step that is not there: said, not guessed.
    let mut other = log;
    other.steps.remove(20);
    let report = replay(&other, Bed::new(), &params);
    assert_eq!(report.verdict, Verdict::Incomplete);
    assert!(
        report
            .stopped
            .as_ref()
            .unwrap()
            .contains("21 is not in the log"),
        "{report:?}"
    );
}

#[test]
fn what_cannot_start_says_why() {
    let start = |devices, params: &EngineParams, recorder: &RecorderParams| {
        Engine::start(Bed::new(), devices, params, recorder).unwrap_err()
    };
    let device = || announced(Scripted::new(&Hand::default()));
    let none = RecorderParams::default();
    assert!(matches!(
        start(vec![], &params(), &none),
        StartError::Devices { found: 0 }
    ));
    let slow = EngineParams {
        period: f64::NAN,
        ..params()
    };
    assert!(matches!(
        start(vec![device()], &slow, &none),
        StartError::Period { .. }
    ));
    let nowhere = recorder(Path::new("/nowhere/run.mcap"));
    let error = start(vec![device()], &params(), &nowhere);
    assert!(
        error
            .to_string()
            .starts_with("/nowhere/run.mcap: the log cannot be created"),
        "{error}"
    );
}

#[test]
fn an_engine_that_is_dropped_lets_go_of_its_devices() {
    let hand = Hand::default();
    let engine = Engine::start(
        Bed::new(),
        vec![announced(Scripted::new(&hand))],
        &params(),
        &RecorderParams::default(),
    )
    .unwrap();
    until("a force is felt", || hand.force() > 0.1);
    drop(engine);
    assert!(hand.force() == 0.0);
}

#[test]
fn a_tissue_at_rest_steps_seldom() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let devices = vec![announced(Scripted::new(&Hand::default()))];
    let seldom = EngineParams {
        tissue: TissueParams {
            rest_period: 15e-3,
            ..TissueParams::default()
        },
        ..params()
    };
    let idle = || {
        let mut bed = Bed::new();
        bed.is_idle = true;
        bed
    };
    let mut engine = Engine::start(idle(), devices, &seldom, &recorder(&path)).unwrap();
    go_on(&mut engine, 0, u64::from(REST_STEPS) + 10, 0);
    engine.stop();
    let log = Log::open(&path).unwrap();
    let (busy, rest) = log.steps.split_at(REST_STEPS as usize + 2);
    assert!(rest.len() > 5);
    // On a fixed grid: one that begins late is nearer to the next.
    let time = rest[rest.len() - 1].now - rest[0].now;
    assert!(time > 15e-3 * (rest.len() - 2) as f64, "{time} s");
    assert!(busy[busy.len() / 2].period < 15e-3);
    // Rest is not taken for slow steps: patches are not expected late after it.
    let last = rest.last().unwrap();
    assert!((last.period - rest[0].period).abs() < 1e-12);
    let again = replay(&log, idle(), &ReplayParams::default());
    assert_eq!(again.verdict, Verdict::Same, "{again:?}");
}
