//! No allocation in a tick, and bounded work.

use crate::support::{HalfSpace, Loop, RADIUS, SPEC};
use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use palpa_servo::{ContactPatch, ServoParams, Vec3};

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

#[test]
fn no_tick_allocates() {
    let bed = HalfSpace {
        spacing: 1.2e-3,
        compliance: 4e-3,
        friction: 0.5,
        n: 60,
    };
    let mut patch = Box::new(ContactPatch::EMPTY);
    bed.fill(Vec3::new(0.0, 0.0, RADIUS), 1, &mut patch);
    let mut servo = Loop::new(&ServoParams::default(), SPEC);
    let mut most = 0;
    for k in 0..2000_u32 {
        servo.now += 1e-3;
        if k % 5 == 0 {
            patch.id = u64::from(k) + 1;
            patch.sampled_at = servo.now;
            servo.mail.next = Some(patch.clone());
        }
        let angle = f64::from(k) * 0.02;
        let at = Vec3::new(angle.cos() * 1e-3, angle.sin() * 1e-3, RADIUS - 1.5e-3);
        let states = [Some(crate::support::state(servo.now, at))];
        let report = assert_no_alloc(|| {
            servo
                .servo
                .tick(servo.now, &states, &mut servo.mail, &mut servo.command)
        });
        servo.mail.next = None;
        if k > 100 {
            most = most.max(report.sweeps);
        }
    }
    assert!(most > 0, "no tick solved a contact");
    // Twice the most of one solution: the tick in which a patch arrives solves with the old and the
    // new.
    assert!(most <= 2 * ServoParams::default().max_sweeps, "{most}");
}
