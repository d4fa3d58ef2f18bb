//! Waiting for a state that a program reports.

use std::thread::sleep;
use std::time::{Duration, Instant};

/// Rest between two polls: a tenth of what a person notices, and no load on the program.
const REST: Duration = Duration::from_millis(20);
/// Time after which a state that has not come counts as a hang. It is far longer than any machine
/// needs, so that it decides nothing else.
const HANG: Duration = Duration::from_mins(3);

/// Polls until `poll` returns a value, and returns it.
///
/// # Panics
/// When nothing came within minutes; the message names `what` was waited for.
pub fn wait_for<T>(what: &str, mut poll: impl FnMut() -> Option<T>) -> T {
    let began = Instant::now();
    loop {
        if let Some(found) = poll() {
            return found;
        }
        assert!(began.elapsed() < HANG, "still not so: {what}");
        sleep(REST);
    }
}
