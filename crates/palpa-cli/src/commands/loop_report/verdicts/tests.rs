use palpa_rt::{
    DeviceRecord, Ending, Header, Log, Quantiles, Report, StepRecord, StepStatus, TickEntry,
    TickRecord,
};
use palpa_servo::{DeviceSpec, Faults, Limits};

use super::*;
use crate::commands::loop_report::Run;
use crate::commands::loop_report::audit::Audit;
use crate::commands::loop_report::figures::Setup;

/// Length of the synthetic run, s; the target of the hand is still from the second value on.
const SECONDS: f64 = 8.0;
const STILL_FROM: f64 = 4.0;

/// Stiffness of the synthetic tissue, N/m, and the depth at rest, m.
const STIFFNESS: f64 = 400.0;
const DEPTH: f64 = 5e-3;

/// A run in which a hand presses softly in two seconds, goes to and fro, and stands still; the
/// tissue is a spring, and a patch comes every other tick.
fn quiet() -> (Run, Log) {
    let depth = |t: f64| {
        let share = (t / 2.0).min(1.0);
        let press = share * share * (3.0 - 2.0 * share);
        let sway = if (2.0..STILL_FROM).contains(&t) {
            0.2 * (std::f64::consts::TAU * 0.5 * (t - 2.0)).sin()
        } else {
            0.0
        };
        DEPTH * (press + sway)
    };
    let n = (SECONDS / 1e-3) as u64;
    let ticks = (1..=n).map(|n| {
        let now = n as f64 * 1e-3;
        let force = [0.0, 0.0, STIFFNESS * depth(now)];
        let device = DeviceRecord {
            tick: n,
            is_there: true,
            position: [0.0, 0.0, -depth(now)],
            force,
            tissue_force: force,
            stiffness: STIFFNESS,
            ..DeviceRecord::default()
        };
        TickEntry {
            tick: TickRecord {
                tick: n,
                now,
                gain: 1.0,
                taken: n % 2 == 0,
                energy_budget: 2e-3,
                n_devices: 1,
                ..TickRecord::default()
            },
            devices: [device, DeviceRecord::default()],
        }
    });
    let steps = (1..=n / 2).map(|n| StepRecord {
        step: n,
        now: n as f64 * 2e-3,
        published: true,
        n_contacts: 20,
        status: StepStatus::Converged as u8,
        iterations: 1,
        zone: 1,
        mesh: 1,
        ..StepRecord::default()
    });
    let log = Log {
        header: Header {
            period: 1e-3,
            ..Header::default()
        },
        specs: vec![DeviceSpec {
            max_force: 8.0,
            max_torque: 0.0,
            max_slew: 1e3,
            max_stiffness: 2e3,
            max_damping: 5.0,
        }],
        ticks: ticks.collect(),
        steps: steps.collect(),
        ending: Ending::Whole,
        ..Log::default()
    };
    let run = Run {
        report: report(n),
        until: SECONDS,
        still: vec![[STILL_FROM, SECONDS]],
        bars: None,
        audit: None,
        threads: Vec::new(),
    };
    (run, log)
}

/// The report of the engine for that run.
fn report(n: u64) -> Report {
    let typical = |seconds: f64| Quantiles {
        count: n,
        mean: seconds,
        p50: seconds,
        p99: seconds,
        p999: seconds,
        max: seconds,
    };
    Report {
        duration: SECONDS,
        ticks: n,
        skipped: 0,
        tick_cpu: typical(1e-5),
        lateness: typical(1e-5),
        tick_cpu_histogram: Vec::new(),
        lateness_histogram: Vec::new(),
        forces: Vec::new(),
        steps: n / 2,
        step_rate: 500.0,
        step_cpu: typical(1.6e-3),
        step_wall: typical(1.6e-3),
        held_back: 0,
        jobs: typical(1e-2),
        jobs_panicked: 0,
        background_cpu_share: 0.1,
        lost_records: [0; 2],
        has_log_failed: false,
        panicked: Vec::new(),
        events: Vec::new(),
        granted: Vec::new(),
        memory_locked: Ok(()),
        log: None,
    }
}

fn figures(run: &Run, log: &Log) -> Figures {
    let setup = Setup {
        nodes: 3000,
        mesh_size: 3e-3,
        zone_radius: 20e-3,
        longest_way: 5e-3,
        motion_speed: 50e-3,
    };
    Figures::new(run, log, &setup)
}

/// The guarantees that a changed run breaks.
fn broken(change: impl FnOnce(&mut Run, &mut Log)) -> Vec<Guarantee> {
    let (mut run, mut log) = quiet();
    change(&mut run, &mut log);
    let figures = figures(&run, &log);
    let broken: Vec<Guarantee> = (figures.verdicts.iter())
        .filter(|verdict| !verdict.is_kept)
        .map(|verdict| verdict.guarantee)
        .collect();
    assert_eq!(figures.is_good, broken.is_empty());
    assert_eq!(problems(&figures.verdicts).is_empty(), broken.is_empty());
    broken
}

fn device(log: &mut Log, from: f64, change: impl Fn(f64, &mut DeviceRecord)) {
    for entry in log.ticks.iter_mut().filter(|entry| entry.tick.now >= from) {
        change(entry.tick.now, &mut entry.devices[0]);
    }
}

#[test]
fn a_quiet_run_is_good() {
    assert_eq!(broken(|_, _| {}), []);
}

#[test]
fn a_limit_cycle_under_a_still_hand_is_not_good() {
    // The device swings by 0.4 mm at 40 Hz while the target of the hand stands still. The force
    // follows its position a little late, as that of a loop with a delay does. The swing grows within
    // a tenth of a second.
    let found = broken(|_, log| {
        let from = SECONDS - 2.2;
        device(log, from, |now, device| {
            let phase = std::f64::consts::TAU * 40.0 * now;
            let size = 0.4e-3 * (10.0 * (now - from)).min(1.0);
            device.position[2] = -DEPTH - size * phase.sin();
            let force = STIFFNESS * (DEPTH + size * (phase - 0.15).sin());
            (device.force[2], device.tissue_force[2]) = (force, force);
        });
    });
    let expected = [
        Guarantee::Vibration,
        Guarantee::SlowVibration,
        Guarantee::EnergyWindow,
    ];
    assert_eq!(found, expected);
}

#[test]
fn lost_records_and_a_log_that_is_cut_off_are_not_good() {
    assert_eq!(
        broken(|run, _| run.report.lost_records = [3, 0]),
        [Guarantee::LostRecords]
    );
    assert_eq!(
        broken(|run, _| run.report.lost_records = [0, 1]),
        [Guarantee::LostRecords]
    );
    assert_eq!(
        broken(|run, _| run.report.has_log_failed = true),
        [Guarantee::LostRecords]
    );
    assert_eq!(
        broken(|_, log| log.ending = Ending::CutOff),
        [Guarantee::LostRecords]
    );
}

#[test]
fn bad_patches_and_other_faults_are_not_good() {
    let with = |fault: Faults| broken(|_, log| log.ticks[3000].tick.faults = fault.bits().into());
    assert_eq!(with(Faults::BAD_PATCH), [Guarantee::BadPatches]);
    assert_eq!(with(Faults::NO_SOLUTION), [Guarantee::OtherFaults]);
    assert_eq!(with(Faults::DEVICE_JUMPED), [Guarantee::OtherFaults]);
    // A late tick by itself is not judged, nor is a single stale patch.
    assert_eq!(with(Faults::MISSED_DEADLINE), []);
    assert_eq!(with(Faults::STALE_PATCH), []);
}

#[test]
fn steps_that_do_not_converge_or_reach_the_tool_are_not_good() {
    let with = |status: StepStatus, every: usize| {
        broken(|_, log| {
            for step in log.steps.iter_mut().step_by(every) {
                step.status = status as u8;
            }
        })
    };
    assert_eq!(with(StepStatus::Unfinished, 50), [Guarantee::Unfinished]);
    assert_eq!(with(StepStatus::Unfinished, 200), []);
    assert_eq!(with(StepStatus::Behind, 50), [Guarantee::Behind]);
    // Steps that found nothing before they were behind are of those with contact.
    let (run, mut log) = quiet();
    for step in &mut log.steps {
        (step.status, step.n_contacts) = (StepStatus::Behind as u8, 0);
    }
    let share = figures(&run, &log).tissue.behind_share;
    assert!((share - 1.0).abs() < 1e-12, "{share}");
    let failed = broken(|run, _| run.report.held_back = 100);
    assert_eq!(failed, [Guarantee::FailedSteps]);
    // A long hold, whose steps have nothing to do, hides none of them.
    let held = broken(|run, log| {
        let n = log.steps.len();
        for step in &mut log.steps[n / 4..] {
            step.iterations = 0;
        }
        for step in log.steps[..n / 4].iter_mut().step_by(50) {
            step.status = StepStatus::Behind as u8;
        }
        run.report.held_back = n as u64 / 200;
    });
    assert_eq!(held, [Guarantee::Behind, Guarantee::FailedSteps]);
}

#[test]
fn unsolved_contact_and_limits_are_not_good() {
    let with = |limits: Limits, every: usize| {
        broken(|_, log| {
            for entry in log.ticks.iter_mut().step_by(every) {
                entry.tick.limits = limits.bits().into();
                entry.devices[0].limits = limits.bits().into();
            }
        })
    };
    assert_eq!(with(Limits::SWEEPS, 50), [Guarantee::Unsolved]);
    for cut in [Limits::FORCE, Limits::SLEW, Limits::TRANSFER] {
        assert_eq!(with(cut, 500), [Guarantee::Cut]);
        assert_eq!(with(cut, 5000), []);
    }
    let softened = broken(|_, log| log.ticks[3000].devices[0].softening = 0.2);
    assert_eq!(softened, [Guarantee::Softened]);
}

#[test]
fn patches_that_change_the_force_are_not_good() {
    // Each patch is off by 7 % of the force, and fades in: no change from tick to tick shows it.
    let found = broken(|_, log| {
        for (n, entry) in log.ticks.iter_mut().enumerate() {
            let transfer = if entry.tick.taken { 0.2 } else { 0.05 };
            if n > 2500 {
                entry.devices[0].transfer[2] = transfer;
                entry.devices[0].tissue_force[2] -= transfer;
            }
        }
    });
    assert_eq!(found, [Guarantee::Transfer]);
    let jump = broken(|_, log| {
        let at = log
            .ticks
            .iter()
            .position(|entry| entry.tick.now > 3.0 && entry.tick.taken);
        device(log, log.ticks[at.unwrap()].tick.now, |_, device| {
            device.force[2] += 0.05;
            device.tissue_force[2] += 0.05;
        });
    });
    assert!(
        jump.starts_with(&[Guarantee::PatchJump, Guarantee::UnusualArrival]),
        "{jump:?}"
    );
}

#[test]
fn an_audit_that_found_few_static_forces_is_not_good() {
    let with = |n: usize, n_failed: usize, error: f64| {
        broken(|run, _| {
            let mut audit = Audit::default();
            (audit.n, audit.n_failed, audit.error_p95) = (n, n_failed, Some(error));
            run.audit = Some(audit);
        })
    };
    assert_eq!(with(9, 3, 0.02), []);
    assert_eq!(with(9, 3, 0.04), [Guarantee::Audit]);
    assert_eq!(with(3, 9, 0.02), [Guarantee::Audit]);
}

#[test]
fn a_small_force_may_change_by_what_no_hand_feels() {
    // A change of 0.015 N where a patch arrives, in a force of at most 0.1 N.
    let found = broken(|_, log| {
        let at = (log.ticks.iter()).position(|entry| entry.tick.now > 3.0 && entry.tick.taken);
        let at = log.ticks[at.unwrap()].tick.now;
        device(log, 0.0, |now, device| {
            let more = if now < at { 0.0 } else { 0.015 };
            device.force[2] = 0.04 * device.force[2] + more;
            device.tissue_force[2] = device.force[2];
        });
    });
    assert!(!found.contains(&Guarantee::UnusualArrival), "{found:?}");
}

#[test]
fn a_dip_after_a_late_tick_is_not_good() {
    let dip = |gap: f64| {
        let (run, mut log) = quiet();
        for entry in &mut log.ticks[5000..] {
            entry.tick.now += gap;
        }
        for entry in &mut log.ticks[5000..5100] {
            entry.tick.gain = 0.5;
            entry.devices[0].force[2] *= 0.5;
        }
        let figures = figures(&run, &log);
        let dip = figures
            .verdicts
            .iter()
            .find(|v| v.guarantee == Guarantee::Dip);
        dip.unwrap().problem.clone().unwrap_or_default()
    };
    let short = dip(11e-3);
    assert!(
        short.contains("50 %") && short.contains("12.0 ms after"),
        "{short}"
    );
    let long = dip(99e-3);
    assert!(
        long.contains("the machine stood still") && long.contains("up to 0 %"),
        "{long}"
    );
}

#[test]
fn a_run_with_nothing_to_judge_says_so_and_is_not_good() {
    let still = [Guarantee::Vibration, Guarantee::SlowVibration];
    assert_eq!(broken(|run, _| run.still.clear()), still);
    // A tool that never touches.
    let (run, mut log) = quiet();
    device(&mut log, 0.0, |_, device| {
        (device.force, device.tissue_force) = ([0.0; 3], [0.0; 3]);
    });
    for step in &mut log.steps {
        step.n_contacts = 0;
    }
    let figures = figures(&run, &log);
    assert!(!figures.is_good);
    let words = problems(&figures.verdicts);
    assert!(
        words
            .iter()
            .any(|line| line.starts_with("nothing was felt")),
        "{words:?}"
    );
    assert!(
        words
            .iter()
            .any(|line| line.contains("no step of the tissue")),
        "{words:?}"
    );
    let missing = figures
        .verdicts
        .iter()
        .filter(|v| v.found.is_none() && !v.is_kept);
    assert!(missing.count() >= 8);
}

#[test]
fn the_loop_itself_is_judged() {
    assert_eq!(
        broken(|run, _| run.report.tick_cpu.p999 = 201e-6),
        [Guarantee::TickTime]
    );
    assert_eq!(
        broken(|_, log| {
            for step in &mut log.steps {
                step.now *= 5.0;
            }
        }),
        [Guarantee::HandSpeed]
    );
    assert_eq!(
        broken(|run, _| run.report.jobs_panicked = 1),
        [Guarantee::Panics]
    );
    assert_eq!(
        broken(|run, _| run.report.panicked = vec!["palpa-tissue"]),
        [Guarantee::Panics]
    );
    let stale = broken(|_, log| {
        for entry in log.ticks.iter_mut().step_by(500) {
            entry.tick.faults = Faults::STALE_PATCH.bits().into();
        }
    });
    assert_eq!(stale, [Guarantee::Stale]);
}

#[test]
fn an_audit_is_judged_if_there_is_one() {
    let with = |error_p95: Option<f64>| {
        broken(|run, _| {
            let mut audit = crate::commands::loop_report::Audit::default();
            audit.error_p95 = error_p95;
            run.audit = Some(audit);
        })
    };
    assert_eq!(with(Some(0.031)), [Guarantee::Audit]);
    assert_eq!(with(Some(0.03)), []);
    assert_eq!(with(None), [Guarantee::Audit]);
}

#[test]
fn verdicts_are_a_table_and_json() {
    let (mut run, log) = quiet();
    run.still.clear();
    let figures = figures(&run, &log);
    let table = table(&figures.verdicts).to_string();
    assert!(
        table.contains("not judged") && table.contains("NOT GOOD"),
        "{table}"
    );
    let json = serde_json::to_value(&figures).unwrap();
    let verdict = &json["verdicts"][0];
    assert_eq!(verdict["guarantee"], "tick_time");
    assert_eq!(verdict["unit"], "us");
    assert_eq!(json["is_good"], false);
}
