//! Faults of device, tissue and clock while the finite elements are pressed, through the real
//! threads, mailboxes and device. The force stays finite, limited in size and slew, and comes back.
//! The log is whole, says what happened, and replays bit for bit.

use palpa::live::{LiveScene, device_model, grip};
use palpa_device::{Fault, FaultSwitch, Faulty, HapticDevice, LiveTarget, SimulatedDevice, Vec3};
use palpa_rt::{
    Engine, EngineParams, FaultHooks, Happening, Injection, Log, RecorderParams, ReplayParams,
    Report, TickEntry, Verdict, replay,
};
use palpa_servo::{DeviceSpec, Faults, ServoParams};
use palpa_testkit::{Layer, Scene as SceneText, wait_for};

use crate::resolved;

/// A gel without dry friction, so that there is one place where hand and tissue are in balance.
fn gel() -> SceneText {
    SceneText::block([60.0, 60.0, 30.0], 8.0)
        .layer(Layer::elastic("gel", "10 kPa").levels(3))
        .sphere(8.0)
        .press(4.0)
        .near_tool(4.0)
        .set("device", "preset", "ideal")
        .motion("press", 4.0)
        .set("motion", "above", "3 mm")
}

/// Time without a fault after which the whole force is back, s: it is let in slowly, in half a
/// second.
const BACK: f64 = 1.0;
/// Relative difference within which the force is the same again.
const SAME: f64 = 0.01;

/// A run that is disturbed step by step: each fault comes when the force has settled after the one
/// before. A machine that stands still for some milliseconds (a virtual one does) is one more
/// fault, which the law answers as the others.
struct Run {
    engine: Engine,
}

impl Run {
    /// Polls the latest tick until it is as wanted, and returns its time, s.
    fn until(&mut self, what: &str, mut is_so: impl FnMut(&TickEntry) -> bool) -> f64 {
        wait_for(what, || {
            let tick = self.engine.snapshot().tick;
            is_so(&tick).then_some(tick.tick.now)
        })
    }

    /// Waits for so many more ticks.
    fn ticks(&mut self, n: u64) {
        let begin = self.engine.snapshot().tick.tick.tick;
        self.until("ticks go on", |tick| tick.tick.tick >= begin + n);
    }

    /// Waits until this fault was caused so many times more than before `act`.
    fn until_said(&mut self, fault: Injection, n: usize, act: impl FnOnce(&FaultHooks)) {
        let count = |engine: &Engine| {
            let events = engine.report().events;
            let said = (events.iter()).filter(|e| e.what == Happening::Injected(fault));
            said.count()
        };
        let before = count(&self.engine);
        act(self.engine.faults());
        wait_for(&fault.to_string(), || {
            (count(&self.engine) >= before + n).then_some(())
        });
    }

    /// Waits until the force was there, whole, steady and without a fault for a while, and returns
    /// that moment, s. How large it must be, the log is asked afterwards.
    fn settle(&mut self) -> f64 {
        let (mut since, mut last) = (self.engine.now(), f64::NAN);
        self.until("the force is steady", |tick| {
            let force = tick.devices[0].force[2];
            let is_whole =
                tick.tick.faults == 0 && tick.devices[0].faults == 0 && tick.tick.gain >= 1.0;
            let is_steady = is_whole && force > 0.1 && (force - last).abs() < 1e-3;
            last = force;
            if !is_steady {
                since = tick.tick.now;
            }
            tick.tick.now > since + BACK
        })
    }

    /// Waits until nothing presses on.
    fn let_go(&mut self) {
        self.until("the force is zero", |tick| {
            size(tick.devices[0].force) < 1e-9
        });
    }

    /// A fault of the device that lets the force go.
    fn lose(&mut self, fault: &FaultSwitch) {
        fault.set(true);
        self.let_go();
        fault.set(false);
    }
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

/// Times in which the law lets most of a force go, s, on the clock of the ticks: without a device, and while the
/// force fades because there is no new patch.
const LET_GO: f64 = 0.09;
const FADED: f64 = 0.25;

/// Without a device, or once the patch of a paused tissue is stale, nothing presses on.
fn check_let_go(log: &Log, report: &Report, usual: f64) {
    let said = |is: &dyn Fn(&Happening) -> bool, from: f64| {
        let mut events = report.events.iter();
        events.find(|e| e.time >= from && is(&e.what)).unwrap().time
    };
    let paused = said(&|e| *e == Happening::Injected(Injection::TissuePauses), 0.0);
    for (fault, from, time) in [
        (Faults::BAD_READING, 0.0, LET_GO),
        (Faults::DEVICE_LOST, 0.0, LET_GO),
        (Faults::STALE_PATCH, paused, FADED),
    ] {
        let end = said(&|e| has(e, fault), from) + time;
        let k = (log.ticks).partition_point(|t| t.tick.now < end);
        let there = log.ticks[k].devices[0].force[2];
        assert!(there.abs() < 0.7 * usual, "{fault:?}: {there} N");
    }
}

/// Whether the law says that it has this fault.
fn has(what: &Happening, fault: Faults) -> bool {
    matches!(what, Happening::LawFaults(faults) if faults.contains(fault))
}

fn check_said(report: &Report) {
    let is_said: [fn(&Happening) -> bool; 5] = [
        |e| *e == Happening::Injected(Injection::TissuePauses),
        |e| has(e, Faults::STALE_PATCH),
        |e| *e == Happening::Injected(Injection::PatchLate),
        |e| *e == Happening::Injected(Injection::PatchWithNan),
        |e| *e == Happening::LawFaults(Faults::NONE),
    ];
    for (k, is) in is_said.iter().enumerate() {
        assert!(
            report.events.iter().any(|e| is(&e.what)),
            "number {k} is not said: {:#?}",
            report.events
        );
    }
}

#[test]
fn faults_while_real_tissue_is_pressed() {
    let scene = resolved(&gel());
    let live = LiveScene::build(&scene).unwrap();
    let model = device_model(scene.device.preset);
    let [above, deep] = [30e-3, -7e-3].map(|z| Vec3::z() * z);
    let hand = LiveTarget::new(above);
    let device = SimulatedDevice::live(model, grip(scene.device.grip), hand.clone());
    let spec = device.spec();
    let [jumped, not_a_number, stalled, unplugged]: [FaultSwitch; 4] = Default::default();
    let device = Faulty::new(device)
        .with_switch(&jumped, Fault::Jump(Vec3::z() * -20e-3))
        .with_switch(&not_a_number, Fault::NotANumber)
        .with_switch(&stalled, Fault::Stall)
        .with_switch(&unplugged, Fault::Unplug);
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
        notes: palpa::live::notes_of(&scene).unwrap(),
        ..RecorderParams::default()
    };
    let engine = Engine::start(
        live.tissue().unwrap(),
        vec![Box::new(device)],
        &params,
        &recorder,
    )
    .unwrap();

    let mut run = Run { engine };
    hand.set(deep);
    run.until("the gel is felt", |tick| tick.devices[0].force[2] > 0.1);
    let mut settled = vec![("the first press", run.settle())];
    // 20 mm deeper for a hundred ticks, as it seems: the tissue is pressed there, and must find
    // back.
    jumped.set(true);
    run.ticks(100);
    jumped.set(false);
    settled.push(("a jump", run.settle()));
    run.lose(&not_a_number);
    settled.push(("no number", run.settle()));
    run.lose(&stalled);
    settled.push(("a stall", run.settle()));
    run.lose(&unplugged);
    settled.push(("an unplugged device", run.settle()));
    run.engine.faults().pause_tissue(true);
    run.let_go();
    run.ticks(200);
    run.engine.faults().pause_tissue(false);
    settled.push(("a tissue that paused", run.settle()));
    run.until_said(Injection::PatchLate, 1, |faults| faults.delay_tissue(0.1));
    settled.push(("a late patch", run.settle()));
    run.until_said(Injection::PatchWithNan, 20, |faults| {
        faults.spoil_patches(20);
    });
    settled.push(("spoilt patches", run.settle()));
    run.until_said(Injection::LoopLate, 1, |faults| faults.delay_loop(0.05));
    settled.push(("a loop that slept", run.settle()));
    // The hand's own: out and in at 1 m/s.
    hand.set(above);
    run.let_go();
    hand.set(deep);
    run.until("the gel is felt", |tick| tick.devices[0].force[2] > 0.1);
    settled.push(("a hand out and in", run.settle()));
    let report = run.engine.stop();
    let log = Log::open(&path).unwrap();

    assert!(log.ending == palpa_rt::Ending::Whole && !report.has_log_failed);
    assert_eq!(report.lost_records, [0, 0]);
    assert_eq!(log.ticks.len() as u64, report.ticks);
    check_limits(&log, &spec);
    assert_eq!(settled.len(), 10);
    let mut usual = None;
    for (after, moment) in settled {
        let last = moment - 0.2..=moment;
        let forces = (log.ticks.iter()).filter(|t| last.contains(&t.tick.now));
        let forces: Vec<f64> = forces.map(|t| t.devices[0].force[2]).collect();
        let mean = forces.iter().sum::<f64>() / forces.len() as f64;
        let usual = *usual.get_or_insert(mean);
        println!("{moment:6.3} s, after {after}: {mean:.4} N");
        assert!(
            !forces.is_empty()
                && mean > 0.1
                && forces.iter().all(|f| (f / usual - 1.0).abs() < SAME),
            "after {after}: {mean} N, {usual} N before"
        );
    }
    check_let_go(&log, &report, usual.unwrap());
    check_said(&report);
    let again = replay(&log, live.tissue().unwrap(), &ReplayParams::default());
    assert_eq!(again.verdict, Verdict::Same, "{again:?}");
}
