//! Patches change, devices fail, clocks jump: what the force does.

use crate::support::{HalfSpace, Loop, RADIUS, SPEC};
use palpa_servo::{ContactPatch, DeviceSpec, Faults, Limits, ServoParams, Vec3};

const BED: HalfSpace = HalfSpace {
    spacing: 2e-3,
    compliance: 8e-3,
    friction: 0.3,
    n: 25,
};
const DEEP: Vec3 = Vec3::new(0.0, 0.0, RADIUS - 3e-3);

fn patch() -> Box<ContactPatch> {
    let mut patch = Box::new(ContactPatch::EMPTY);
    BED.fill(Vec3::new(0.0, 0.0, RADIUS + 1e-3), 1, &mut patch);
    patch
}

fn settled() -> (Loop, Box<ContactPatch>) {
    let spec = DeviceSpec {
        max_slew: 500.0,
        ..SPEC
    };
    let mut servo = Loop::new(&ServoParams::default(), spec);
    let patch = patch();
    let report = servo.settle(&patch, DEEP, 1000);
    assert!(report.gain >= 1.0 && report.tools[0].force.z > 0.5);
    (servo, patch)
}

#[test]
fn a_new_patch_makes_no_bump_and_wins_in_two_periods() {
    let (mut servo, mut patch) = settled();
    let before = servo.command[0].force;
    // Softer by a fifth: the force has to fall by a sixth in the end.
    for w in &mut patch.compliance {
        *w *= 1.2;
    }
    patch.id = 5000;
    servo.send(patch.clone());
    let report = servo.tick(Some(DEEP));
    assert!(report.is_new_patch);
    let step = (servo.command[0].force - before).norm();
    assert!(step <= 0.11 * (before.norm() / 6.0), "{step} of {before}");
    let mut last = servo.command[0].force;
    for _ in 0..11 {
        let report = servo.tick(Some(DEEP));
        assert!((servo.command[0].force - last).norm() < 0.11 * before.norm() / 6.0);
        last = report.tools[0].force;
    }
    let report = servo.tick(Some(DEEP));
    assert_eq!(report.tools[0].transfer, Vec3::zeros());
    assert!(
        (last.z - before.z / 1.2).abs() < 0.01 * before.z,
        "{last} {before}"
    );
}

/// A patch that comes late may correct the force by much. Where the hand lifts the tool faster than that
/// fades, it is cut instead of pulling the tool back into the tissue, and so is the damping that pays for the
/// energy of the stiffer patch.
#[test]
fn what_a_late_patch_corrects_never_pulls() {
    let (mut servo, mut patch) = settled();
    // Four times as stiff: the old force is three quarters too small.
    for w in &mut patch.compliance {
        *w *= 0.25;
    }
    patch.id = 5000;
    patch.period = 50e-3;
    servo.send(patch.clone());
    let (mut least, mut most, mut damping) = (f64::INFINITY, 0.0_f64, 0.0_f64);
    for k in 0..80 {
        let report = servo.tick(Some(DEEP + Vec3::z() * (80e-6 * f64::from(k))));
        let tool = &report.tools[0];
        let wanted = tool.tissue_force + tool.transfer;
        least = least.min(wanted.z).min(servo.command[0].force.z);
        damping = damping.max(tool.damping);
        most = most.max(-tool.transfer.z);
    }
    assert!(most > 0.5 && damping > 1.0, "{most} {damping}");
    assert!(least > -1e-5, "{least}");
}

#[test]
fn a_stale_patch_ramps_to_zero_and_a_fresh_one_back() {
    let (mut servo, patch) = settled();
    let mut last = servo.command[0].force;
    let mut stale = false;
    for _ in 0..550 {
        let report = servo.tick(Some(DEEP));
        stale |= report.faults.contains(Faults::STALE_PATCH);
        assert!((report.tools[0].force - last).norm() <= 0.5 + 1e-12);
        last = report.tools[0].force;
    }
    assert!(stale);
    assert_eq!(last, Vec3::zeros());
    // Recovery, deep inside: slowly.
    for _ in 0..1000 {
        let report = servo.settle(&patch, DEEP, 1);
        assert!((report.tools[0].force - last).norm() < 0.02, "a kick");
        last = report.tools[0].force;
    }
    assert!(last.z > 0.5);
}

#[test]
fn a_patch_that_is_a_little_late_costs_little_force() {
    let (mut servo, mut patch) = settled();
    let before = servo.command[0].force.z;
    let (mut least, mut n_stale) = (before, 0);
    // Silent for 150 ms, and then patches come again.
    while n_stale < 50 {
        let report = servo.tick(Some(DEEP));
        n_stale += usize::from(report.faults.contains(Faults::STALE_PATCH));
        least = least.min(servo.command[0].force.z);
    }
    for _ in 0..200 {
        patch.id += 10_000;
        servo.send(patch.clone());
        servo.tick(Some(DEEP));
        least = least.min(servo.command[0].force.z);
    }
    let after = servo.command[0].force.z;
    assert!(
        least < 0.999 * before && least > 0.94 * before,
        "{least} {before}"
    );
    assert!((after / before - 1.0).abs() < 1e-3, "{after} {before}");
}

#[test]
fn faults_of_device_and_clock_ramp_down_and_recover() {
    let nan = Vec3::new(f64::NAN, 0.0, 0.0);
    let jump = DEEP + Vec3::new(0.0, 0.0, -20e-3);
    for (at, fault, gap) in [
        (None, Faults::DEVICE_LOST, 0.0),
        (Some(nan), Faults::BAD_READING, 0.0),
        (Some(jump), Faults::DEVICE_JUMPED, 0.0),
        (Some(DEEP), Faults::MISSED_DEADLINE, 0.05),
        (Some(DEEP), Faults::BAD_CLOCK, -1.0),
        (Some(DEEP), Faults::BAD_CLOCK, f64::NAN),
    ] {
        let (mut servo, patch) = settled();
        let mut last = servo.command[0].force;
        let held = last.norm();
        if gap.is_nan() {
            let now = servo.now;
            servo.now = f64::NAN;
            let report = servo.tick(at);
            assert!(report.faults.contains(fault));
            servo.now = now;
        } else {
            servo.now += gap;
            let report = servo.settle(&patch, at.unwrap_or(nan), 0);
            assert_eq!(report.sweeps, 0);
        }
        let mut seen = gap.is_nan();
        for _ in 0..120 {
            let report = match at {
                Some(at) => servo.settle(&patch, at, 1),
                None => servo.tick(None),
            };
            seen |= report.faults.contains(fault);
            let force = report.tools[0].force;
            assert!(force.iter().all(|f| f.is_finite()));
            assert!((force - last).norm() <= 0.5 + 1e-12, "{fault:?}");
            assert!(force.norm() <= held + 1e-9, "{fault:?}: {force}");
            last = force;
        }
        assert!(seen, "{fault:?}");
        for _ in 0..1000 {
            let report = servo.settle(&patch, DEEP, 1);
            assert!((report.tools[0].force - last).norm() <= 0.05, "{fault:?}");
            last = report.tools[0].force;
        }
        assert!(last.z > 0.5, "{fault:?} {last}");
    }
}

/// The share of the force that is left at the worst tick of the half second after a tick that
/// begins `gap` seconds after the one before it, and the faults in that time. The hand moves across
/// at `speed`, m/s, until then. If `is_stuck`, the device's first reading is an old one.
fn least_share(gap: f64, speed: f64, is_stuck: bool) -> (f64, Faults) {
    let (mut servo, patch) = settled();
    let mut at = DEEP;
    let mut before = f64::INFINITY;
    for k in 0..60 {
        at += Vec3::x() * (1e-3 * speed);
        let mut fresh = patch.clone();
        fresh.id += 2000 + k;
        servo.send(fresh);
        before = servo.tick(Some(at)).tools[0].force.norm();
    }
    let read_at = servo.now;
    // The system gives the time to another program: the tissue rests too.
    servo.now += gap;
    at += Vec3::x() * (gap * speed);
    let (mut least, mut faults) = (f64::INFINITY, Faults::NONE);
    for k in 0..500 {
        if k % 5 == 4 {
            let mut fresh = patch.clone();
            fresh.id += 3000 + k;
            servo.send(fresh);
        }
        // The driver of the device may have rested too: then its first reading is that of before.
        let time = if is_stuck && k == 0 {
            read_at
        } else {
            servo.now
        };
        let states = [Some(crate::support::state(time, at))];
        let report = servo
            .servo
            .tick(servo.now, &states, &mut servo.mail, &mut servo.command);
        servo.mail.next = None;
        servo.now += 1e-3;
        faults |= report.faults;
        least = least.min(report.tools[0].force.norm() / before);
    }
    (least, faults)
}

#[test]
fn a_tick_that_the_system_steals_for_30_ms_is_not_felt() {
    for gap in [0.005, 0.011, 0.02, 0.0299] {
        for (speed, is_stuck) in [(0.0, false), (0.0, true), (0.04, false)] {
            let (least, faults) = least_share(gap, speed, is_stuck);
            let case = format!("{gap} s at {speed} m/s, stuck: {is_stuck}");
            println!("{case}: {least:.4} of the force");
            assert_eq!(faults, Faults::NONE, "{case}");
            // Nothing at rest. In a stroke the tool leaves the middle of the grid; that is felt
            // without a late tick too.
            let most = if speed > 0.0 { 0.9 } else { 0.999 };
            assert!(least > most, "{case}: {least} of the force");
        }
    }
    let (least, faults) = least_share(0.032, 0.0, false);
    assert!(least < 1e-3 && faults.contains(Faults::MISSED_DEADLINE));
}

#[test]
fn the_step_of_the_force_after_a_late_tick_is_limited() {
    let (mut servo, patch) = settled();
    let before = servo.command[0].force;
    servo.now += 0.024;
    // 12 mm deeper in 25 ms, and out of the tissue in the next 25 ms: more than the slew of two
    // periods.
    for at in [DEEP - Vec3::z() * 12e-3, DEEP + Vec3::z() * 12e-3] {
        let last = servo.command[0].force;
        servo.send(patch.clone());
        let report = servo.tick(Some(at));
        assert_eq!(report.faults, Faults::NONE);
        assert!(report.limits.contains(Limits::SLEW));
        let step = (report.tools[0].force - last).norm();
        assert!((step - 1.0).abs() < 1e-9, "{step} N");
        servo.now += 0.024;
    }
    assert!(before.norm() > 0.5);
}

#[test]
fn a_loop_that_is_always_late_lets_the_force_go() {
    for (gap, is_let_go) in [(0.009, false), (0.02, true), (0.025, true)] {
        let (mut servo, patch) = settled();
        let (mut faults, mut ticks) = (Faults::NONE, 0);
        while ticks < 200 && !faults.contains(Faults::MISSED_DEADLINE) {
            let mut fresh = patch.clone();
            fresh.id += 2000 + ticks;
            servo.send(fresh);
            servo.now += gap - 1e-3;
            faults |= servo.tick(Some(DEEP)).faults;
            ticks += 1;
        }
        let lasted = gap * ticks as f64;
        assert_eq!(is_let_go, !faults.is_empty(), "{gap}: {faults:?}");
        assert!(
            !is_let_go || (0.1..0.5).contains(&lasted),
            "{gap}: {lasted}"
        );
    }
}

#[test]
fn a_stalled_device_is_noticed() {
    let (mut servo, patch) = settled();
    let stuck = servo.now;
    let mut seen = false;
    for k in 0..150 {
        servo.now += 1e-3;
        if k % 5 == 0 {
            let mut patch = patch.clone();
            patch.sampled_at = servo.now;
            servo.mail.next = Some(patch);
        }
        let states = [Some(crate::support::state(stuck, DEEP))];
        let report = servo
            .servo
            .tick(servo.now, &states, &mut servo.mail, &mut servo.command);
        servo.mail.next = None;
        seen |= report.faults.contains(Faults::DEVICE_STALLED);
    }
    assert!(seen);
    assert_eq!(servo.command[0].force, Vec3::zeros());
}

#[test]
fn limits_keep_the_direction() {
    let spec = DeviceSpec {
        max_force: 0.4,
        ..SPEC
    };
    let mut servo = Loop::new(&ServoParams::default(), spec);
    let report = servo.settle(&patch(), DEEP + Vec3::x() * 1e-3, 1000);
    let tool = &report.tools[0];
    assert!(report.limits.contains(Limits::FORCE));
    assert!((tool.force.norm() - 0.4).abs() < 1e-12);
    let (force, tissue) = (tool.force.normalize(), tool.tissue_force.normalize());
    assert!((force - tissue).norm() < 1e-9);
}

#[test]
fn without_devices_or_patches_nothing_happens() {
    let mut servo = Loop::new(&ServoParams::default(), SPEC);
    let report = servo.tick(Some(DEEP));
    assert!(report.faults.contains(Faults::NO_PATCH));
    assert_eq!(servo.command[0].force, Vec3::zeros());
    let report = servo.servo.tick(0.1, &[], &mut servo.mail, &mut []);
    assert!(report.faults.contains(Faults::DEVICE_LOST));
}

#[test]
fn two_tools_press_one_body() {
    // A second tool far away feels its own; one near feels that the first pushes the skin down
    // under it.
    let spec = [SPEC, SPEC];
    let mut forces = [[0.0; 2]; 2];
    for (case, apart) in [1.0, 0.0].into_iter().enumerate() {
        let mut servo = palpa_servo::Servo::new(&ServoParams::default(), &spec);
        let mut mail = crate::support::Mail::new();
        let mut commands = [palpa_servo::ForceCommand::ZERO; 2];
        let mut patch = Box::new(ContactPatch::EMPTY);
        let mut report = palpa_servo::TickReport::ZERO;
        for k in 0..900_u32 {
            let now = f64::from(k + 1) * 1e-3;
            if k % 5 == 0 {
                BED.fill(Vec3::new(0.0, 0.0, RADIUS), u64::from(k) + 1, &mut patch);
                patch.sampled_at = now;
                patch.n_tools = 2;
                patch.tools[1] = patch.tools[0];
                let n = patch.n_contacts;
                // The left half belongs to the one, the right half to the other.
                for c in &mut patch.contacts[..n] {
                    c.tool = u32::from(c.position.x > 1e-3);
                }
                for i in 0..n {
                    for j in 0..n {
                        if patch.contacts[i].tool != patch.contacts[j].tool && apart > 0.0 {
                            patch.set_block(i, j, &palpa_servo::Mat3::zeros());
                        }
                    }
                }
                mail.next = Some(patch.clone());
            }
            let states = [Some(crate::support::state(now, DEEP)); 2];
            report = servo.tick(now, &states, &mut mail, &mut commands);
            mail.next = None;
        }
        assert_eq!(report.faults, Faults::NONE);
        forces[case] = [commands[0].force.z, commands[1].force.z];
    }
    assert!(forces[0][0] > 0.3 && forces[0][1] > 0.05, "{forces:?}");
    assert!(
        forces[1][0] < 0.98 * forces[0][0] && forces[1][1] < 0.9 * forces[0][1],
        "{forces:?}"
    );
}

#[test]
fn no_period_makes_a_tick_panic() {
    let bed = HalfSpace {
        spacing: 2e-3,
        compliance: 4e-3,
        friction: 0.3,
        n: 9,
    };
    let at = Vec3::new(0.0, 0.0, RADIUS - 1e-3);
    let mut patch = Box::new(ContactPatch::EMPTY);
    bed.fill(at, 1, &mut patch);
    // 0.1 s is the longest that a loop may have; there twice the period is longer than any patch's.
    for period in [0.1, 1e3, 0.0, -1.0, f64::NAN, f64::INFINITY] {
        let params = ServoParams {
            period,
            ..ServoParams::default()
        };
        let mut servo = Loop::new(&params, SPEC);
        let report = servo.settle(&patch, at, 700);
        assert!(report.faults.is_empty(), "{period} s: {report:?}");
        assert!(servo.command[0].force.z > 0.1, "{period} s: {report:?}");
    }
}
