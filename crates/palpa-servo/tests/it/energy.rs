//! What the energy observer sees and what it leaves alone.

use crate::support::{HalfSpace, Loop, RADIUS, SPEC};
use palpa_servo::{ContactPatch, DeviceSpec, Limits, ServoParams, TickReport, Vec3};

/// Depth of the tool in the middle of its motion, m.
const DEPTH: f64 = 3e-3;
/// Patches per second.
const RATE: f64 = 600.0;

fn bed(friction: f64) -> HalfSpace {
    HalfSpace {
        spacing: 2e-3,
        compliance: 3e-3,
        friction,
        n: 49,
    }
}

fn params(has_observer: bool) -> ServoParams {
    ServoParams {
        energy_budget: if has_observer { 2e-3 } else { 1e9 },
        ..ServoParams::default()
    }
}

/// Ticks and patches at their own rates, with the work on the hand counted beside the law.
struct Run {
    servo: Loop,
    patch: Box<ContactPatch>,
    /// Compliance of the bed alone.
    compliance: Vec<f64>,
    n_patches: u64,
    last: Option<(Vec3, Vec3)>,
    /// Energy given to the hand less energy taken from it, J.
    given: f64,
    reports: Vec<TickReport>,
}

impl Run {
    fn new(friction: f64, has_observer: bool, spec: DeviceSpec) -> Self {
        let mut patch = Box::new(ContactPatch::EMPTY);
        bed(friction).fill(Vec3::new(0.0, 0.0, RADIUS + 1e-3), 1, &mut patch);
        let mut run = Self {
            servo: Loop::new(&params(has_observer), spec),
            compliance: patch.compliance.to_vec(),
            patch,
            n_patches: 0,
            last: None,
            given: 0.0,
            reports: Vec::new(),
        };
        // The ramp at the start passes in the air.
        for _ in 0..700 {
            run.tick(Vec3::new(0.0, 0.0, RADIUS + 1e-3), 1.0);
        }
        run
    }

    /// Ticks at a place; a patch that arrives has the bed's compliance times `softness`.
    fn tick(&mut self, at: Vec3, softness: f64) {
        if self.servo.now * RATE >= self.n_patches as f64 {
            self.n_patches += 1;
            self.patch.id = self.n_patches;
            for (w, bed) in self.patch.compliance.iter_mut().zip(&self.compliance) {
                *w = bed * softness;
            }
            self.servo.send(self.patch.clone());
        }
        let report = self.servo.tick(Some(at));
        if let Some((place, force)) = self.last {
            self.given += force.dot(&(at - place));
        }
        self.last = Some((at, report.tools[0].force));
        self.reports.push(report);
    }

    fn most_damping(&self) -> f64 {
        self.reports
            .iter()
            .map(|r| r.tools[0].damping)
            .fold(0.0, f64::max)
    }

    fn largest_step(&self) -> f64 {
        (self.reports.windows(2))
            .map(|p| (p[1].tools[0].force - p[0].tools[0].force).norm())
            .fold(0.0, f64::max)
    }
}

/// Presses, then moves up and down by 1 mm at 20 Hz for two seconds, and across at `speed`. The
/// patches are those of softer tissue on the way in and of stiffer tissue on the way out: the law
/// gives out energy in every cycle.
fn pumped(friction: f64, speed: f64, has_observer: bool) -> Run {
    let mut run = Run::new(friction, has_observer, SPEC);
    let start = run.servo.now;
    let place = |time: f64| {
        let pressed = (time / 0.1).min(1.0);
        let across = (time - 0.1).clamp(0.0, f64::INFINITY) * speed;
        // To and fro over 4 mm.
        let across = 2e-3 * ((across / 2e-3).rem_euclid(4.0) - 2.0).abs() - 2e-3;
        let wave = 1e-3 * (std::f64::consts::TAU * 20.0 * (time - 0.1).max(0.0)).sin();
        Vec3::new(
            if speed > 0.0 { across } else { 0.0 },
            0.0,
            RADIUS + 1e-3 - (1e-3 + DEPTH) * pressed + wave,
        )
    };
    for _ in 0..2100 {
        let time = run.servo.now + 1e-3 - start;
        let (at, next) = (place(time), place(time + 2e-3));
        let is_out = next.z > at.z;
        run.tick(at, if is_out { 0.7 } else { 1.0 });
    }
    run
}

#[test]
fn a_law_that_gives_out_energy_in_every_cycle_is_caught() {
    let without = pumped(0.0, 0.0, false);
    let with = pumped(0.0, 0.0, true);
    println!(
        "given out {:.2} mJ, with the observer {:.2} mJ; damping to {:.2} N s/m",
        1e3 * without.given,
        1e3 * with.given,
        with.most_damping()
    );
    assert!(without.given > 30e-3, "{} J", without.given);
    assert!(with.given < 0.2 * without.given, "{} J", with.given);
    assert!(
        with.reports
            .iter()
            .any(|r| r.limits.contains(Limits::ENERGY))
    );
    // No knock: the damping changes the force no faster than the patches do.
    assert!(
        with.largest_step() < 1.5 * without.largest_step(),
        "{} N, {} N",
        with.largest_step(),
        without.largest_step()
    );
}

#[test]
fn friction_beside_does_not_hide_what_the_law_gives_out() {
    let without = pumped(0.4, 0.1, false);
    let with = pumped(0.4, 0.1, true);
    let dissipated = -without.given;
    println!(
        "taken {:.1} mJ, with the observer {:.1} mJ; damping to {:.2} N s/m",
        1e3 * dissipated,
        -1e3 * with.given,
        with.most_damping()
    );
    // Friction takes more than the law gives out: the hand loses energy all in all.
    assert!(dissipated > 10e-3, "{dissipated} J");
    assert!(with.most_damping() > 0.5, "{}", with.most_damping());
    // It begins within half a second.
    let first = with.reports.iter().position(|r| r.tools[0].damping > 0.0);
    assert!(first.is_some_and(|k| k < 700 + 100 + 500), "{first:?}");
}

#[test]
fn patches_that_alternate_are_booked_and_caught() {
    let mut run = Run::new(0.0, true, SPEC);
    let stiff = 0.6;
    let softness = |n: u64| if n.is_multiple_of(2) { 1.0 } else { stiff };
    let deep = Vec3::new(0.0, 0.0, RADIUS - 4.5e-3);
    let up = Vec3::new(0.0, 0.0, RADIUS + 1e-3);
    for k in 0..400 {
        let share = (f64::from(k) / 200.0).min(1.0);
        let n = run.n_patches;
        run.tick(up + (deep - up) * share, softness(n));
    }
    // At rest: each patch changes the stored energy by the same amount, up and down.
    let at_rest = &run.reports[run.reports.len() - 150..];
    let jumps: Vec<f64> = (at_rest.iter())
        .filter(|r| r.is_new_patch)
        .map(|r| r.tools[0].jump)
        .collect();
    assert!(jumps.len() > 80);
    // The depth is given, so that force and energy are as the stiffness.
    let stored = at_rest
        .iter()
        .map(|r| r.tools[0].stored)
        .fold(0.0, f64::max);
    for jump in &jumps {
        let wanted = (1.0 - stiff) * stored;
        assert!((jump.abs() / wanted - 1.0).abs() < 0.01, "{jump} {wanted}");
    }
    let up_jumps = jumps.iter().filter(|j| **j > 0.0).count();
    println!("{} jumps of {:.2} mJ", jumps.len(), 1e3 * jumps[0].abs());
    assert!(jumps.len().abs_diff(2 * up_jumps) <= 1);
    let owed = at_rest.iter().map(|r| -r.tools[0].bank).fold(0.0, f64::max);
    assert!(owed > 0.9 * jumps[0].abs() && owed > 2e-3, "{owed} J");
    // The bridged force changes slowly, and a hand at rest feels no damping.
    let still = at_rest.iter().map(|r| r.tools[0].velocity.norm());
    assert!(still.fold(0.0, f64::max) < 2e-3);
    // A hand that moves is damped.
    for k in 0..100 {
        let n = run.n_patches;
        run.tick(deep + Vec3::z() * (2e-5 * f64::from(k)), softness(n));
    }
    assert!(run.most_damping() > 0.1, "{}", run.most_damping());
}

#[test]
fn a_passive_press_and_stroke_is_left_alone() {
    for friction in [0.0, 0.4] {
        let motion = |has_observer: bool| {
            let mut run = Run::new(friction, has_observer, SPEC);
            let up = Vec3::new(-2e-3, 0.0, RADIUS + 1e-3);
            let down = up - Vec3::z() * (1e-3 + DEPTH);
            let across = down + Vec3::x() * 4e-3;
            // Three times down, across, back, and up, at 50 mm/s.
            for _ in 0..3 {
                for way in [[up, down], [down, across], [across, down], [down, up]] {
                    let ticks = ((way[1] - way[0]).norm() / 0.05e-3) as u32;
                    for k in 0..ticks {
                        let share = f64::from(k) / f64::from(ticks);
                        run.tick(way[0] + (way[1] - way[0]) * share, 1.0);
                    }
                    for _ in 0..100 {
                        run.tick(way[1], 1.0);
                    }
                }
            }
            run
        };
        let (with, without) = (motion(true), motion(false));
        let largest = (without.reports.iter())
            .map(|r| r.tools[0].force.norm())
            .fold(0.0, f64::max);
        let difference = (with.reports.iter().zip(&without.reports))
            .map(|(a, b)| (a.tools[0].force - b.tools[0].force).norm())
            .fold(0.0, f64::max);
        let owed = with.reports.iter().map(|r| -r.tools[0].bank);
        println!(
            "friction {friction}: {difference:.1e} of {largest:.2} N, owed {:.3} mJ at most",
            1e3 * owed.fold(0.0, f64::max)
        );
        assert!(largest > 1.0, "{largest} N");
        assert!(difference < 1e-3 * largest, "{difference} of {largest} N");
        assert!(with.most_damping() == 0.0, "{}", with.most_damping());
    }
}

#[test]
fn a_ramp_does_not_forget_what_was_given_out() {
    let up = Vec3::new(0.0, 0.0, RADIUS + 1e-3);
    let down = up - Vec3::z() * (1e-3 + DEPTH);
    // What is owed after the lift, and 0.9 s later.
    let owed = |is_gone: bool| -> [f64; 2] {
        let mut run = Run::new(0.0, true, SPEC);
        for k in 0..100 {
            run.tick(up + (down - up) * (f64::from(k) / 99.0), 1.0);
        }
        // A single patch of stiffer tissue, and out: the hand gets what it did not pay.
        for _ in 0..10 {
            run.tick(down, 0.5);
        }
        for k in 0..100 {
            run.tick(down + (up - down) * (f64::from(k) / 99.0), 0.5);
        }
        for _ in 0..20 {
            run.tick(up, 1.0);
        }
        let owed = |run: &Run| -run.reports.last().map_or(0.0, |r| r.tools[0].bank);
        let before = owed(&run);
        if is_gone {
            // The device is gone for a moment; the force ramps down and comes back.
            run.servo.tick(None);
            run.last = None;
        }
        for _ in 0..900 {
            run.tick(up, 1.0);
        }
        assert!(run.reports[run.reports.len() - 1].gain >= 1.0);
        [before, owed(&run)]
    };
    let ([before, with], [_, without]) = (owed(true), owed(false));
    println!("{before} J owed, {with} after a ramp, {without} without one");
    assert!(before > 0.5e-3 && without > 0.5e-3, "{before} {without} J");
    assert!((with / without - 1.0).abs() < 0.01, "{with} {without}");
}
