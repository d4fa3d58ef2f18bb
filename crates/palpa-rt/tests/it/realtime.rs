//! The loop's body neither allocates nor waits: under an allocator that aborts, and under the
//! real-time sanitizer.

use crate::{
    devices::{Hand, Ill, Scripted, until},
    engine::params,
    toy::Bed,
};
use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use palpa_rt::{Engine, EngineParams, Happening, RecordKind, RecorderParams, TissueParams};
use std::thread;

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

#[test]
fn a_tick_never_allocates() {
    let hand = Hand::default();
    let device = Box::new(Scripted::new(&hand));
    let params = EngineParams {
        tissue: TissueParams {
            min_period: 1e-4,
            ..TissueParams::default()
        },
        ..params()
    };
    let mut bed = Bed::new();
    bed.waiter = Some(thread::current());
    let (mut engine, mut servo_loop) =
        Engine::start_driven(bed, vec![device], &params, &RecorderParams::default()).unwrap();
    // The test owns the moments of the ticks, as a vendor's callback would. Every path is walked:
    // devices that fail, patches that are spoilt or missing, ticks left out, and a ring that is
    // full because nobody waits for the recorder.
    let mut most = 0.0_f64;
    for k in 0..30_000_u32 {
        let now = 1e-3 * f64::from(k + 1);
        match k % 3000 {
            0 | 1600 => hand.make(Ill::No),
            1000 => hand.make(Ill::Unplugged),
            1200 => hand.make(Ill::NaN),
            1400 => hand.make(Ill::Jumped),
            1700 => engine.faults().spoil_patches(3),
            _ => {}
        }
        let skipped = u32::from(k % 500 == 0);
        assert_no_alloc(|| servo_loop.tick_once(now, 1e-5, skipped));
        most = most.max(hand.force());
        // At first the tissue answers every tick; later ticks do not wait for it.
        if k < 3000 {
            until("the tissue answers", || {
                engine.snapshot().step.tick > u64::from(k)
            });
        }
    }
    assert!(most > 0.1, "no force was made: {most} N");
    let snapshot = engine.snapshot();
    assert_eq!(snapshot.tick.tick.tick, 30_000);
    drop(servo_loop);
    assert!(hand.force() == 0.0, "a loop that is dropped writes zero");
    let report = engine.stop();
    assert_eq!(report.ticks, 30_000);
    // 27 000 ticks came faster than any recorder drains them: what was lost is counted and said.
    let said: u64 = (report.events.iter())
        .filter_map(|e| match e.what {
            Happening::RecordsLost(RecordKind::Ticks, n) => Some(n),
            _ => None,
        })
        .sum();
    assert_eq!(said, report.lost_records[0]);
}
