//! Prints the time of a tick over the number of contacts and the speed of the tool, with and
//! without a new patch.
//!
//! `cargo run --release -p palpa-servo --example tick_times`
#![expect(dead_code, reason = "the tests use more of their support")]

#[path = "../tests/it/support.rs"]
mod support;

use palpa_servo::{ContactPatch, ServoParams, Vec3};
use support::{HalfSpace, Loop, RADIUS, SPEC};

fn main() {
    for (n, spacing) in [(25, 2e-3), (60, 1.2e-3), (60, 0.5e-3)] {
        let bed = HalfSpace {
            spacing,
            compliance: 4e-3,
            friction: 0.4,
            n,
        };
        let from = Vec3::new(0.0, 0.0, RADIUS + 1e-5);
        let mut patch = Box::new(ContactPatch::EMPTY);
        bed.fill(from, 1, &mut patch);
        let mut servo = Loop::new(&ServoParams::default(), SPEC);
        servo.settle(&patch, from, 700);
        for speed in [1e-5, 5e-5, 1e-4] {
            let mut at = from;
            servo.settle(&patch, at, 1);
            let (mut plain, mut arrival, mut active) = (Vec::new(), Vec::new(), 0);
            for k in 0..(1.5e-3 / speed) as usize {
                at += Vec3::new(0.3, 0.0, -1.0) * speed;
                if k % 5 == 0 {
                    servo.send(patch.clone());
                }
                let begin = std::time::Instant::now();
                let report = servo.tick(Some(at));
                let time = begin.elapsed().as_secs_f64() * 1e6;
                if report.is_new_patch {
                    &mut arrival
                } else {
                    &mut plain
                }
                .push(time);
                active = report.n_active;
            }
            for times in [&mut plain, &mut arrival] {
                times.sort_by(f64::total_cmp);
            }
            let at = |times: &[f64], share: f64| times[(times.len() as f64 * share) as usize];
            println!(
                "n {n} at {:.0} mm/s, at most {active} active: median {:.1}, p95 {:.1} us; with a patch {:.1}, {:.1} us",
                speed * 1e6,
                at(&plain, 0.5),
                at(&plain, 0.95),
                at(&arrival, 0.5),
                at(&arrival, 0.95),
            );
        }
    }
}
