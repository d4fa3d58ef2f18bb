//! The faults of a haptic session, made on purpose through the real mailboxes, threads and devices.
//! In each the force is finite and limited in size and slew, goes to zero, comes back; nothing
//! recorded is lost, the log says what happened, and a replay goes through the same faults to the
//! bit.

use crate::{
    devices::{Hand, Ill, Scripted, announced, until},
    engine::{check_records, go_on, params, recorder, run},
    toy::Bed,
};
use palpa_device::DeviceFault;
use palpa_rt::{
    Engine, EngineParams, Happening, Injection, Level, Log, ReplayParams, Report, StepStatus,
    Verdict, replay,
};
use palpa_servo::Faults;

use std::{sync::atomic::Ordering, thread};

/// A force that a hand feels, N; the script never presses with less.
const FELT: f64 = 0.3;

fn until_felt(hand: &Hand) {
    until("a force is felt", || hand.force() > FELT);
}

fn until_zero(hand: &Hand) {
    until("the force is zero", || hand.force() < 1e-9);
}

/// Runs, checks all that holds in every run, and replays.
fn faulty(bed: &Bed, act: impl FnOnce(&mut Engine, &Hand)) -> (Report, Log) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let (report, log) = run(&path, bed.clone(), |engine, hand| {
        until_felt(hand);
        act(engine, hand);
    });
    check_records(&report, &log);
    let again = replay(&log, bed.clone(), &ReplayParams::default());
    assert_eq!(again.verdict, Verdict::Same, "{again:?}");
    assert_eq!(
        (again.ticks, again.steps),
        (report.ticks, log.steps.len() as u64)
    );
    (report, log)
}

/// Whether an event is the wanted one.
type Is = fn(&Happening) -> bool;

/// The report has all these events, in this order.
fn check_said(report: &Report, wanted: &[Is]) {
    let mut events = report.events.iter();
    for (k, is) in wanted.iter().enumerate() {
        assert!(
            events.any(|e| is(&e.what)),
            "number {k} is not said, or not there:\n{:#?}",
            report.events
        );
    }
}

/// Whether the law says that it has this fault.
fn has(what: &Happening, fault: Faults) -> bool {
    matches!(what, Happening::LawFaults(faults) if faults.contains(fault))
}

const IS_STALE: Is = |e| has(e, Faults::STALE_PATCH);
const IS_WELL: Is = |e| *e == Happening::LawFaults(Faults::NONE);
const IS_LATE: Is = |e| *e == Happening::Injected(Injection::PatchLate);

#[test]
fn a_tissue_that_stops_lets_the_force_go_and_brings_it_back() {
    let (report, log) = faulty(&Bed::new(), |engine, hand| {
        engine.faults().pause_tissue(true);
        until_zero(hand);
        engine.faults().pause_tissue(false);
        until_felt(hand);
    });
    check_said(
        &report,
        &[
            |e| *e == Happening::Injected(Injection::TissuePauses),
            IS_STALE,
            |e| *e == Happening::Injected(Injection::TissueGoesOn),
            IS_WELL,
        ],
    );
    // The pause is not made up for: its time is lost, and said to be.
    let lost: f64 = log.steps.iter().map(|s| s.lost).sum();
    assert!(lost > 0.02, "{lost} s");
    check_said(
        &report,
        &[|e| matches!(e, Happening::TimeLost(s) if *s > 0.0)],
    );
}

#[test]
fn a_patch_that_comes_late_is_a_stall_and_no_jump() {
    let (report, _) = faulty(&Bed::new(), |engine, hand| {
        engine.faults().delay_tissue(0.2);
        until("the late patch came", || {
            engine.tissue_stats().wall.max() > 0.2
        });
        // The loop has taken the late patch up before the next one begins to be late: a force that fades is felt
        // for a while.
        go_on(engine, 5, 2, 0);
        until_felt(hand);
        // One that is so late that it must not be felt at all.
        engine.faults().delay_tissue(0.9);
        until_zero(hand);
        until_felt(hand);
    });
    check_said(&report, &[IS_LATE, IS_STALE, IS_WELL, IS_LATE, IS_STALE]);
}

#[test]
fn patches_with_nan_never_reach_the_hand() {
    let (report, log) = faulty(&Bed::new(), |engine, hand| {
        engine.faults().spoil_patches(400);
        until_zero(hand);
        engine.faults().spoil_patches(0);
        until_felt(hand);
        // A single one among good ones.
        engine.faults().spoil_patches(1);
        // The step under way may have been made before it; the one after it is spoilt, and a third
        // one is whole.
        go_on(engine, 1, 4, 0);
        until_felt(hand);
    });
    check_said(
        &report,
        &[
            |e| *e == Happening::Injected(Injection::PatchWithNan),
            |e| has(e, Faults::BAD_PATCH),
            IS_WELL,
        ],
    );
    assert!(log.steps.iter().filter(|s| s.spoilt == 1).count() > 1);
    let all = log.ticks.iter().flat_map(|e| e.devices[0].force);
    assert!(all.into_iter().all(f64::is_finite));
}

#[test]
fn a_tissue_that_panics_is_gone_and_the_loop_is_not() {
    let (report, _) = faulty(&Bed::new(), |engine, hand| {
        engine.faults().panic_tissue();
        until_zero(hand);
        // Unwinding takes far longer than a patch to go stale; nothing orders the two.
        until("the panic is told", || {
            let report = engine.report();
            (report.warnings()).any(|e| matches!(e.what, Happening::TissuePanicked(_)))
        });
        assert!(hand.force() < 1e-9);
    });
    let is_gone: Is = |e| matches!(e, Happening::TissuePanicked(_));
    for said in [is_gone, IS_STALE] {
        let events: [Is; 3] = [
            |e| *e == Happening::Injected(Injection::TissuePanics),
            said,
            |e| matches!(e, Happening::LoopStopped(_)),
        ];
        check_said(&report, &events);
    }
    assert!(report.warnings().any(|e| e.what.level() == Level::Error));
    // Caught: the thread ended by itself.
    assert!(report.panicked.is_empty());
}

#[test]
fn steps_that_fail_are_held_back_and_said() {
    let mut bed = Bed::new();
    bed.fails_at = Some(300);
    let (report, log) = faulty(&bed, |engine, hand| {
        until("the steps failed", || engine.snapshot().step.step > 330);
        until_felt(hand);
    });
    assert_eq!(report.held_back, 20);
    assert!(
        log.steps
            .iter()
            .all(|s| s.published != (300..320).contains(&s.step))
    );
    assert!(
        log.ticks
            .iter()
            .all(|e| !(300..320).contains(&e.tick.patch))
    );
    check_said(
        &report,
        &[
            |e| *e == Happening::StepStatus(300, StepStatus::Failed),
            |e| *e == Happening::StepStatus(320, StepStatus::Converged),
        ],
    );
}

#[test]
fn a_tissue_whose_steps_fail_goes_on_with_its_last_patch() {
    let mut bed = Bed::new();
    bed.falters_every = Some(9);
    let (report, log) = faulty(&bed, |engine, hand| {
        until_felt(hand);
        until("steps failed", || engine.snapshot().step.step > 900);
        until_felt(hand);
    });
    assert!(report.held_back > 500, "{}", report.held_back);
    assert!(log.steps.iter().all(|s| s.published));
    // The age of a patch is that of the step that made it.
    let mut n_old = 0;
    for e in log.ticks.iter().filter(|e| e.tick.patch > 9) {
        let made = |s: &&palpa_rt::StepRecord| s.step <= e.tick.patch && s.step % 9 < 3;
        let made = log.steps.iter().rev().find(made).unwrap();
        let age = e.tick.now - made.sampled_at;
        assert_eq!(e.tick.patch_age.to_bits(), age.to_bits(), "{}", e.tick.tick);
        n_old += u32::from(made.step < e.tick.patch);
    }
    assert!(n_old > 100, "{n_old}");
}

#[test]
fn a_job_that_panics_is_said_and_the_next_one_runs() {
    let mut bed = Bed::new();
    bed.panics_in = Some(3);
    let (report, log) = faulty(&bed, |engine, _| {
        until("jobs ran after it", || engine.snapshot().step.factor > 5);
    });
    check_said(
        &report,
        &[
            |e| *e == Happening::JobPanicked,
            |e| matches!(e, Happening::TissueStopped(_)),
        ],
    );
    assert!(log.steps.iter().all(|s| s.factor != 3));
    assert!(report.panicked.is_empty());
}

#[test]
fn jobs_that_always_panic_are_run_ever_more_rarely() {
    let (report, log) = faulty(&Bed::new(), |engine, _| {
        engine.faults().panic_jobs(5);
        until("jobs panicked", || {
            let panicked = &engine.tissue_stats().jobs_panicked;
            panicked.load(Ordering::Relaxed) == 5
        });
        go_on(engine, 0, 0, 3);
    });
    assert_eq!(report.jobs_panicked, 5);
    let is_said = |e: &&palpa_rt::Event| e.what == Happening::JobPanicked;
    assert_eq!(report.events.iter().filter(is_said).count(), 5);
    check_said(
        &report,
        &[
            |e| *e == Happening::Injected(Injection::JobPanics),
            |e| *e == Happening::JobPanicked,
        ],
    );
    let failed = (log.steps.iter()).filter(|s| s.job_failed).map(|s| s.step);
    let pauses: Vec<u64> = failed
        .map(|at| {
            let mut after = log.steps.iter().filter(|s| s.step >= at && s.job_taken);
            after.next().unwrap().step - at
        })
        .collect();
    // The bed requests a job in every seventh step.
    for (pause, least) in pauses.iter().zip([16, 32, 64, 128, 256]) {
        assert!((least..least + 7).contains(pause), "{pauses:?}");
    }
    assert_eq!(pauses.len(), 5);
}

#[test]
fn devices_fail_in_all_ways_and_come_back() {
    let (report, log) = faulty(&Bed::new(), |_, hand| {
        for ill in [Ill::Unplugged, Ill::NaN, Ill::Stalled, Ill::Jumped] {
            hand.make(ill);
            until_zero(hand);
            hand.make(Ill::No);
            until_felt(hand);
        }
    });
    check_said(
        &report,
        &[
            |e| *e == Happening::DeviceLost(0, DeviceFault::Unplugged),
            |e| has(e, Faults::DEVICE_LOST),
            |e| matches!(e, Happening::DeviceBack(0, _)),
            |e| has(e, Faults::BAD_READING),
            |e| has(e, Faults::DEVICE_STALLED),
            |e| has(e, Faults::DEVICE_JUMPED),
            IS_WELL,
        ],
    );
    // What could not be read is recorded as such, and the tissue never sees a pose that is no
    // number.
    assert!(
        log.ticks
            .iter()
            .any(|e| !e.devices[0].is_there && !e.devices[0].is_written)
    );
    assert!(
        log.steps
            .iter()
            .flat_map(|s| s.positions)
            .all(f64::is_finite)
    );
    assert!(
        log.ticks
            .iter()
            .flat_map(|e| e.devices[0].position)
            .any(f64::is_nan)
    );
}

#[test]
fn what_takes_too_long_leaves_ticks_out_and_never_bunches_them() {
    let (report, log) = faulty(&Bed::new(), |engine, hand| {
        engine.faults().delay_loop(0.05);
        until("the hiccup is over", || {
            engine.loop_stats().lateness.max() > 0.05
        });
        until_felt(hand);
        hand.make(Ill::Slow);
        until("slow readings left ticks out", || {
            engine.loop_stats().skipped.load(Ordering::Relaxed) >= 49 + 50
        });
        hand.make(Ill::No);
        until_felt(hand);
    });
    let is_late: Is = |e| *e == Happening::Injected(Injection::LoopLate);
    check_said(
        &report,
        &[is_late, |e| has(e, Faults::MISSED_DEADLINE), IS_WELL],
    );
    // The loop says at most ten times a second that it missed ticks. If it missed some just before, it tells of
    // these only after the law has.
    check_said(
        &report,
        &[is_late, |e| matches!(e, Happening::DeadlineMissed { .. })],
    );
    assert!(report.skipped >= 49 + 50, "{}", report.skipped);
    let skipped: u64 = log.ticks.iter().map(|e| u64::from(e.tick.skipped)).sum();
    assert_eq!(skipped, report.skipped);
    // All ticks lie on the grid that began with the first, one to a place: after a gap they do not
    // come in a burst.
    let due = |e: &palpa_rt::TickEntry| e.tick.now - e.tick.lateness;
    let past = |e: &palpa_rt::TickEntry| e.tick.lateness - 1e-3 * f64::from(e.tick.skipped);
    for pair in log.ticks.windows(2) {
        let places = f64::from(pair[0].tick.skipped) + 1.0;
        assert!((due(&pair[1]) - due(&pair[0]) - 1e-3 * places).abs() < 1e-9);
        assert!((-1e-9..1e-3 + 1e-9).contains(&past(&pair[1])));
    }
    let longest = log
        .ticks
        .windows(2)
        .map(|p| p[1].tick.now - p[0].tick.now)
        .fold(0.0, f64::max);
    assert!(longest > 0.049);
}

#[test]
fn ticks_that_begin_up_to_30_ms_late_keep_the_force() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let hand = Hand::default();
    let device = Box::new(Scripted {
        amplitude: 0.0,
        ..Scripted::new(&hand)
    });
    let mut bed = Bed::new();
    bed.waiter = Some(thread::current());
    // The test owns the moments of the ticks: no wall time has any influence on them.
    let (mut engine, mut servo_loop) =
        Engine::start_driven(bed, vec![device], &params(), &recorder(&path)).unwrap();
    let mut now = 0.0;
    // The tick, its lateness, s, and the ticks that it leaves out.
    let late_ticks = [(1500, 0.0101, 10), (1900, 0.0191, 19), (2300, 0.0285, 28)];
    let mut forces = Vec::new();
    for k in 0..3000_u64 {
        let late = late_ticks.iter().find(|(at, ..)| *at == k);
        let (lateness, skipped) = late.map_or((0.0, 0), |(_, by, skipped)| (*by, *skipped));
        now += 1e-3 + lateness;
        servo_loop.tick_once(now, lateness, skipped);
        forces.push(hand.force());
        until("the tissue answers", || engine.snapshot().step.tick > k);
    }
    drop(servo_loop);
    let report = engine.stop();
    // The hand sways by 1 mm to the side at 0.7 Hz; apart from that the force is steady.
    let most = forces[1400..].iter().copied().fold(0.0, f64::max);
    let least = forces[1400..].iter().copied().fold(f64::INFINITY, f64::min);
    assert!(most > FELT && least > 0.9 * most, "{least} to {most} N");
    let faults = |e: &&palpa_rt::Event| has(&e.what, Faults::MISSED_DEADLINE);
    assert_eq!(report.events.iter().filter(faults).count(), 0);
    // They are counted and said nevertheless.
    assert_eq!(report.skipped, 10 + 19 + 28);
    check_said(
        &report,
        &[|e| matches!(e, Happening::DeadlineMissed { .. })],
    );
    let log = Log::open(&path).unwrap();
    let again = replay(&log, Bed::new(), &ReplayParams::default());
    assert_eq!(again.verdict, Verdict::Same, "{again:?}");
}

#[test]
fn a_loop_whose_time_waits_keeps_the_force_however_late_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let hand = Hand::default();
    let devices = vec![announced(Scripted::new(&hand))];
    let patient = EngineParams {
        time_waits: true,
        ..params()
    };
    let engine = Engine::start(Bed::new(), devices, &patient, &recorder(&path)).unwrap();
    until_felt(&hand);
    hand.make(Ill::Slow);
    until("slow readings left ticks out", || {
        engine.loop_stats().skipped.load(Ordering::Relaxed) >= 400
    });
    hand.make(Ill::No);
    let report = engine.stop();
    let faults = |e: &&palpa_rt::Event| has(&e.what, Faults::MISSED_DEADLINE);
    assert_eq!(report.events.iter().filter(faults).count(), 0);
    // Lateness is counted and said, and no tick comes more than three periods after the one before.
    assert!(report.skipped >= 400, "{}", report.skipped);
    assert!(report.lateness.max > 3e-3);
    check_said(
        &report,
        &[|e| matches!(e, Happening::DeadlineMissed { .. })],
    );
    let log = Log::open(&path).unwrap();
    for pair in log.ticks.windows(2) {
        let between = pair[1].tick.now - pair[0].tick.now;
        assert!(between > 0.0 && between < 3.5e-3, "{between} s");
    }
    let again = replay(&log, Bed::new(), &ReplayParams::default());
    assert_eq!(again.verdict, Verdict::Same, "{again:?}");
}

#[test]
fn a_hand_at_a_metre_per_second_is_served_within_limits() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let hand = Hand::default();
    // 20 mm at 8 Hz: 1 m/s through the surface, in and out of contact.
    let device = Scripted {
        rate: 8.0,
        amplitude: 0.02,
        ..Scripted::new(&hand)
    };
    let devices = vec![announced(device)];
    let mut engine = Engine::start(Bed::new(), devices, &params(), &recorder(&path)).unwrap();
    until_felt(&hand);
    go_on(&mut engine, 1000, 0, 0);
    // On a busy machine ticks are left out, and with them the fastest part of a stroke.
    let mut last = engine.snapshot().tick;
    until("the hand is seen at full speed", || {
        let tick = engine.snapshot().tick;
        let speed = (tick.devices[0].position[2] - last.devices[0].position[2])
            / (tick.tick.now - last.tick.now);
        last = tick;
        speed > 0.95
    });
    let report = engine.stop();
    let log = Log::open(&path).unwrap();
    check_records(&report, &log);
    let speed = (log.ticks.windows(2))
        .map(|p| {
            (p[1].devices[0].position[2] - p[0].devices[0].position[2])
                / (p[1].tick.now - p[0].tick.now)
        })
        .fold(0.0, f64::max);
    assert!(speed > 0.95, "{speed} m/s");
    let again = replay(&log, Bed::new(), &ReplayParams::default());
    assert_eq!(again.verdict, Verdict::Same, "{again:?}");
}

// /dev/full, a file that takes no byte, is there on Linux only.
#[cfg(target_os = "linux")]
#[test]
fn a_log_that_cannot_be_written_is_said_before_anything_moves() {
    let full = std::path::Path::new("/dev/full");
    let hand = Hand::default();
    let device = announced(Scripted::new(&hand));
    let result = Engine::start(Bed::new(), vec![device], &params(), &recorder(full));
    // The header is written at once: so it is known before anything moves.
    let error = result.unwrap_err().to_string();
    assert!(
        error.contains("/dev/full: the log cannot be created"),
        "{error}"
    );
}
