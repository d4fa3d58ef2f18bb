use super::*;
use crate::record::TickRecord;

const PERIOD: f64 = 1e-3;

/// A tick in contact: height of the device, m, and force along z, N.
fn tick(n: u64, z: f64, force: f64) -> TickEntry {
    let mut entry = TickEntry {
        tick: TickRecord {
            tick: n,
            now: n as f64 * PERIOD,
            gain: 1.0,
            ..TickRecord::default()
        },
        ..TickEntry::default()
    };
    let device = &mut entry.devices[0];
    device.is_there = true;
    device.position[2] = z;
    (device.force[2], device.tissue_force[2]) = (force, force);
    entry
}

fn ticks(n: u64, at: impl Fn(f64) -> (f64, f64)) -> Vec<TickEntry> {
    (1..=n)
        .map(|n| {
            let (z, force) = at(n as f64 * PERIOD);
            tick(n, z, force)
        })
        .collect()
}

fn report(ticks: &[TickEntry], still: Vec<[f64; 2]>) -> FeelReport {
    let period = PERIOD;
    FeelReport::new(ticks, 0, &FeelParams { period, still })
}

#[test]
fn a_limit_cycle_of_the_device_is_judged_where_the_target_is_still() {
    use std::f64::consts::TAU;
    // The device swings by 1 mm, so it is never still; the target is, from 1 s on.
    for (frequency, is_slow) in [(30.0, false), (8.0, true)] {
        let swing = |t: f64| (TAU * frequency * t).sin();
        let cycle = ticks(4000, |t| (1e-3 * swing(t), 1.0 + 0.3 * swing(t)));
        let still = report(&cycle, vec![[1.0, 4.0]]).still.unwrap();
        let rms = if is_slow {
            still.rms_slow.unwrap()
        } else {
            still.rms_band
        };
        assert!(
            (rms / (0.3 / 2.0_f64.sqrt()) - 1.0).abs() < 0.1,
            "{still:?}"
        );
    }
    let quiet = ticks(4000, |_| (0.0, 1.0));
    let still = report(&quiet, vec![[1.0, 4.0]]).still.unwrap();
    assert!(
        still.rms_band < 1e-9 && still.rms_slow.unwrap() < 1e-3,
        "{still:?}"
    );
    assert!((still.seconds - 2.7).abs() < 0.01, "{still:?}");
}

#[test]
fn damping_counts_by_the_way_of_the_device_and_pulling_off_the_tissue_too() {
    // Up at 50 mm/s, damped by 2 N s/m, while the tissue's force falls from 1 N to nothing within 0.1 s.
    let mut lift = ticks(200, |t| (0.05 * t, (1.0 - 10.0 * t).max(0.0)));
    for entry in &mut lift {
        entry.devices[0].damping = 2.0;
        entry.devices[0].force[2] -= 0.1;
    }
    let found = report(&lift, Vec::new());
    assert!((found.damping_force_max - 0.1).abs() < 1e-3, "{found:?}");
    assert!((found.pull_max - 0.1).abs() < 1e-9, "{found:?}");
    let pressed = report(&ticks(200, |t| (-0.05 * t, 1.0)), Vec::new());
    assert!(pressed.pull_max == 0.0 && pressed.damping_force_max == 0.0);
}

#[test]
fn without_contact_a_pause_or_time_there_is_no_stillness() {
    let quiet = ticks(4000, |_| (0.0, 1.0));
    assert_eq!(report(&quiet, Vec::new()).still, None);
    assert_eq!(report(&quiet, vec![[1.0, 2.2]]).still, None);
    let in_air = ticks(4000, |_| (0.0, 0.0));
    assert_eq!(report(&in_air, vec![[1.0, 4.0]]).still, None);
    let mut ramping = ticks(4000, |_| (0.0, 1.0));
    for entry in ramping.iter_mut().step_by(900) {
        entry.tick.gain = 0.5;
    }
    assert_eq!(report(&ramping, vec![[1.0, 4.0]]).still, None);
}

#[test]
fn what_tissue_dissipates_does_not_hide_what_the_loop_gives_out() {
    use std::f64::consts::TAU;
    // Rubbing: 20 mJ are lost in the first two seconds. Then a swing of 10 Hz, whose force is ahead
    // of the position by 0.1 rad: it gives out π K X² sin 0.1 per cycle.
    let (stiffness, size) = (500.0, 1e-3);
    let at = |t: f64| {
        if t <= 2.0 {
            let swing = (TAU * 0.5 * t).cos();
            return (
                5e-3 * swing,
                if (TAU * 0.5 * t).sin() > 0.0 {
                    1.0
                } else {
                    -1.0
                },
            );
        }
        let phase = TAU * 10.0 * t;
        (
            5e-3 + size * phase.sin(),
            -stiffness * size * (phase - 0.1).sin(),
        )
    };
    let all = ticks(4000, at);
    let mut stats = crate::ForceStats::new(PERIOD);
    for entry in &all {
        stats.add(entry, 0);
    }
    assert!(
        stats.report().max_work < 1e-3,
        "the sum over the run hides it: {:?}",
        stats.report()
    );
    // Holding the force over a tick adds π² K X² f T per cycle.
    let pi = std::f64::consts::PI;
    let per_cycle = pi * stiffness * size * size * (0.1_f64.sin() + pi * 10.0 * PERIOD);
    let found = report(&all, Vec::new()).energy_window.unwrap();
    assert!(
        (found / (10.0 * per_cycle) - 1.0).abs() < 0.05,
        "{found} for {per_cycle} a cycle"
    );
}

#[test]
fn a_spring_that_is_let_go_gives_out_nothing() {
    // Pressed 5 mm in a second, and let go in half a second.
    let depth = |t: f64| {
        if t < 1.0 {
            5e-3 * t
        } else {
            (5e-3 - 10e-3 * (t - 1.0)).max(0.0)
        }
    };
    let spring = ticks(2000, |t| (-depth(t), 3e5 * depth(t).powi(2)));
    let found = report(&spring, Vec::new()).energy_window.unwrap();
    assert!(found < 1e-3, "{found}");
    // The same with a force that is 5 % larger on the way out.
    let active = ticks(2000, |t| {
        let more = if t > 1.0 { 1.1 } else { 1.0 };
        (-depth(t), more * 3e5 * depth(t).powi(2))
    });
    let more = report(&active, Vec::new()).energy_window.unwrap();
    let want = 0.1 * 1e5 * 5e-3_f64.powi(3);
    assert!((more / want - 1.0).abs() < 0.15, "{more} for {want}");
}

#[test]
fn a_dip_is_named_with_the_late_tick_before_it() {
    let mut all = ticks(3000, |_| (0.0, 2.0));
    for entry in &mut all[1000..] {
        entry.tick.now += 12e-3;
    }
    for entry in &mut all[1005..1300] {
        entry.tick.gain = 0.5;
        entry.devices[0].force[2] = 0.6;
    }
    let found = report(&all, Vec::new()).dips;
    assert_eq!((found.n_late, found.n_dips), (1, 1));
    assert!((found.worst - 0.7).abs() < 1e-12, "{found:?}");
    assert!((found.worst_after_gap - 13e-3).abs() < 1e-9, "{found:?}");
    assert!((found.worst_after_short - 0.7).abs() < 1e-12, "{found:?}");
    // After a long pause the machine is the cause.
    for entry in &mut all[1000..] {
        entry.tick.now += 30e-3;
    }
    let found = report(&all, Vec::new()).dips;
    assert!(
        found.worst_after_short.abs() < 1e-12 && found.worst > 0.6,
        "{found:?}"
    );
}

#[test]
fn ramps_of_the_start_are_no_dips_and_limits_of_the_device_are_counted_apart() {
    let mut all = ticks(1000, |_| (0.0, 2.0));
    for entry in &mut all[..300] {
        entry.tick.gain = 0.0;
        entry.devices[0].force[2] = 0.0;
    }
    for entry in &mut all[500..600] {
        entry.devices[0].force[2] = 1.0;
        entry.devices[0].limits = Limits::FORCE.bits().into();
    }
    all[700].tick.limits = Limits::SWEEPS.bits().into();
    all[800].tick.faults = Faults::BAD_PATCH.bits().into();
    let found = report(&all, Vec::new());
    assert!(found.dips.worst.abs() < 1e-12, "{found:?}");
    assert_eq!(found.limits, [(Limits::FORCE, 100), (Limits::SWEEPS, 1)]);
    assert!((found.share_at(Limits::FORCE) - 100.0 / 700.0).abs() < 1e-12);
    assert_eq!(found.n_faulty(Faults::BAD_PATCH), 1);
}

#[test]
fn a_transfer_is_what_a_patch_changes_at_the_same_pose() {
    let mut all = ticks(1000, |_| (0.0, 2.0));
    for (i, entry) in all.iter_mut().enumerate() {
        entry.tick.taken = i % 2 == 0;
    }
    all[500].devices[0].transfer[2] = 0.3;
    all[501].devices[0].transfer[2] = 0.1;
    let found = report(&all, Vec::new());
    assert!(
        (found.transfer_max - 0.3).abs() < 1e-12 && found.transfer_p99 < 1e-12,
        "{found:?}"
    );
    assert_eq!(found.n_arrivals, 499);
}
