//! Limits on a client's requests and response times.

use std::time::{Duration, Instant};

/// Largest number of clients at once. Each has its own queue of unsent data.
pub(crate) const MAX_CLIENTS: usize = 32;
/// Largest number of connections at once: pages, downloads and programs.
pub(crate) const MAX_CONNECTIONS: usize = 256;
/// A connection without traffic is closed after this time. Pages are pinged more often, and making
/// a file takes less.
pub(crate) const IDLE: Duration = Duration::from_mins(2);
/// Largest number of files that are made at once.
pub(crate) const MAX_FILES: usize = 4;
/// Longest message of a client, bytes. A scene with all tissues written out is many times shorter.
pub(crate) const MAX_MESSAGE: usize = 1 << 20;
/// Longest message that is not a scene, bytes.
pub(crate) const MAX_SMALL_MESSAGE: usize = 64 << 10;
/// Time that a client may take to send a file.
pub(crate) const UPLOAD_WAIT: Duration = Duration::from_mins(2);
/// Largest number of files that are received and checked at once. Each may need some hundred
/// megabytes of memory while it is read.
pub(crate) const MAX_UPLOADS: usize = 1;
/// Longest name of a file that a client sends, bytes.
pub(crate) const MAX_NAME: usize = 255;
/// Malformed messages in a row after which the connection is closed: the client uses another
/// protocol.
pub(crate) const MAX_MALFORMED: u32 = 20;
/// Answers that may wait for a client to read them. A client that reads nothing exceeds this at the
/// allowed rate and is dropped.
pub(crate) const MAX_ANSWERS: usize = 4096;
/// Time that a client may take to accept one message.
pub(crate) const SEND_WAIT: Duration = Duration::from_secs(10);
/// Time between two pings to a client.
pub(crate) const PING_EVERY: Duration = Duration::from_secs(4);
/// If the session sent nothing for this long, the server sends the state. Together with the time
/// between pings this is less than the 6 s after which a page gives up.
pub(crate) const QUIET: Duration = Duration::from_secs(1);
/// A client that sends nothing for this long is gone: it has not answered three pings.
pub(crate) const SILENCE: Duration = Duration::from_secs(14);
/// Time without a controller after the controlling client has gone. A page that reloads is back by
/// then.
pub(crate) const HEIR_WAIT: Duration = Duration::from_secs(3);
/// Time to wait for a client's answer to a close frame.
pub(crate) const CLOSE_WAIT: Duration = Duration::from_millis(500);
/// How long a program may wait for the answer to its request.
pub(crate) const ANSWER_WAIT: Duration = Duration::from_secs(30);
/// Size of the system's send buffer per connection, bytes. More would only add latency.
pub(crate) const SEND_BUFFER: u32 = 256 << 10;

/// Requests per second, and in one burst. A moving hand sends 60 a second.
const RATE: (f64, f64) = (200.0, 400.0);
/// Refused requests per second, and in one burst, before the connection is closed.
const REFUSED_RATE: (f64, f64) = (20.0, 400.0);
/// A message costs one request, plus one for each this many bytes.
const BYTES_PER_REQUEST: usize = 4096;

/// The decision on a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// It is accepted.
    Taken,
    /// It is refused. The client gets a warning, at most once a second.
    Refused {
        /// Whether to send the warning now.
        tell: bool,
    },
    /// The client exceeds the limit for too long.
    TooMuch,
}

/// Rate limit of one client.
#[derive(Debug)]
pub(crate) struct Gate {
    requests: Bucket,
    refused: Bucket,
    told: Option<Instant>,
}

impl Gate {
    pub(crate) fn new(now: Instant) -> Self {
        Self {
            requests: Bucket::new(RATE, now),
            refused: Bucket::new(REFUSED_RATE, now),
            told: None,
        }
    }

    /// Decides on a message of `bytes` bytes.
    pub(crate) fn ask(&mut self, bytes: usize, now: Instant) -> Verdict {
        let cost = 1.0 + (bytes / BYTES_PER_REQUEST) as f64;
        if self.requests.take(cost, now) {
            return Verdict::Taken;
        }
        if !self.refused.take(1.0, now) {
            return Verdict::TooMuch;
        }
        let tell = self
            .told
            .is_none_or(|told| now.saturating_duration_since(told) >= Duration::from_secs(1));
        if tell {
            self.told = Some(now);
        }
        Verdict::Refused { tell }
    }
}

/// A token bucket: tokens flow in at `rate` per second, up to `capacity`.
#[derive(Debug)]
struct Bucket {
    rate: f64,
    capacity: f64,
    level: f64,
    at: Instant,
}

impl Bucket {
    fn new((rate, capacity): (f64, f64), at: Instant) -> Self {
        Self {
            rate,
            capacity,
            level: capacity,
            at,
        }
    }

    fn take(&mut self, cost: f64, now: Instant) -> bool {
        let passed = now.saturating_duration_since(self.at).as_secs_f64();
        self.level = (self.level + passed * self.rate).min(self.capacity);
        self.at = now;
        let is_there = self.level >= cost;
        if is_there {
            self.level -= cost;
        }
        is_there
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_burst_is_taken_and_then_the_rate() {
        let start = Instant::now();
        let mut gate = Gate::new(start);
        assert!((0..400).all(|_| gate.ask(10, start) == Verdict::Taken));
        assert_eq!(gate.ask(10, start), Verdict::Refused { tell: true });
        assert_eq!(gate.ask(10, start), Verdict::Refused { tell: false });
        let later = start + Duration::from_millis(101);
        let taken = (0..100)
            .filter(|_| gate.ask(10, later) == Verdict::Taken)
            .count();
        assert_eq!(taken, 20);
    }

    #[test]
    fn who_goes_on_is_closed_and_who_rests_is_not() {
        let start = Instant::now();
        let mut gate = Gate::new(start);
        let n = (0..2000)
            .position(|_| gate.ask(0, start) == Verdict::TooMuch)
            .unwrap();
        assert_eq!(n, 800);
        let rested = start + Duration::from_secs(20);
        assert_eq!(gate.ask(0, rested), Verdict::Taken);
    }

    #[test]
    fn who_waits_is_heard_again() {
        let start = Instant::now();
        let mut gate = Gate::new(start);
        assert!((0..500).any(|_| gate.ask(10, start) != Verdict::Taken));
        let later = start + Duration::from_millis(200);
        assert_eq!(gate.ask(10, later), Verdict::Taken);
    }

    #[test]
    fn a_hand_that_moves_is_never_too_much() {
        let start = Instant::now();
        let mut gate = Gate::new(start);
        // Ten minutes at 125 Hz.
        for tick in 0..75_000 {
            let now = start + tick * Duration::from_millis(8);
            assert_eq!(gate.ask(200, now), Verdict::Taken, "tick {tick}");
        }
    }

    /// A page takes 6 s of silence for a lost connection, and the server sends three pings before
    /// it drops a client.
    #[test]
    fn patience_fits_the_pings() {
        assert!(PING_EVERY + QUIET < Duration::from_secs(6));
        assert!(3 * PING_EVERY < SILENCE);
    }

    #[test]
    fn long_messages_cost_more() {
        let start = Instant::now();
        let mut gate = Gate::new(start);
        assert_eq!(gate.ask(MAX_MESSAGE, start), Verdict::Taken);
        assert_ne!(gate.ask(MAX_MESSAGE, start), Verdict::Taken);
    }
}
