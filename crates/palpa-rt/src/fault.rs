//! Faults on purpose, through the real mailboxes and threads: for tests and drills.

use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};

/// Switches that the threads check. Each use is an event in the log.
#[derive(Debug, Default)]
pub struct FaultHooks {
    is_paused: AtomicBool,
    panics: AtomicBool,
    jobs_to_panic: AtomicU32,
    to_spoil: AtomicU32,
    /// Bits of a time, s; the affected thread takes it once.
    tissue_delay: AtomicU64,
    loop_delay: AtomicU64,
}

impl FaultHooks {
    /// While `pause` is true, the tissue thread makes no steps.
    pub fn pause_tissue(&self, pause: bool) {
        self.is_paused.store(pause, Ordering::Relaxed);
    }

    /// The tissue's next patch arrives `seconds` late.
    pub fn delay_tissue(&self, seconds: f64) {
        self.tissue_delay
            .store(seconds.to_bits(), Ordering::Relaxed);
    }

    /// The next `n` patches are published with NaN in a force and in the compliance.
    pub fn spoil_patches(&self, n: u32) {
        self.to_spoil.store(n, Ordering::Relaxed);
    }

    /// The tissue panics in its next step.
    pub fn panic_tissue(&self) {
        self.panics.store(true, Ordering::Relaxed);
    }

    /// The next `n` background jobs panic.
    pub fn panic_jobs(&self, n: u32) {
        self.jobs_to_panic.store(n, Ordering::Relaxed);
    }

    /// The 1 kHz loop wakes up `seconds` late, once.
    pub fn delay_loop(&self, seconds: f64) {
        self.loop_delay.store(seconds.to_bits(), Ordering::Relaxed);
    }

    pub(crate) fn is_tissue_paused(&self) -> bool {
        self.is_paused.load(Ordering::Relaxed)
    }

    pub(crate) fn take_panic(&self) -> bool {
        self.panics.load(Ordering::Relaxed) && self.panics.swap(false, Ordering::Relaxed)
    }

    pub(crate) fn take_spoil(&self) -> bool {
        take_one(&self.to_spoil)
    }

    pub(crate) fn take_job_panic(&self) -> bool {
        take_one(&self.jobs_to_panic)
    }

    pub(crate) fn take_tissue_delay(&self) -> Option<f64> {
        take_delay(&self.tissue_delay)
    }

    #[inline]
    pub(crate) fn take_loop_delay(&self) -> Option<f64> {
        take_delay(&self.loop_delay)
    }
}

/// Counts down. Only the tissue thread takes from these counters. A new value stored meanwhile either
/// wins or is counted down by one; both are harmless.
fn take_one(count: &AtomicU32) -> bool {
    let n = count.load(Ordering::Relaxed);
    if n > 0 {
        count.store(n - 1, Ordering::Relaxed);
    }
    n > 0
}

#[inline]
fn take_delay(cell: &AtomicU64) -> Option<f64> {
    if cell.load(Ordering::Relaxed) == 0 {
        return None;
    }
    Some(f64::from_bits(cell.swap(0, Ordering::Relaxed)))
}
