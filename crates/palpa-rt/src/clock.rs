//! Clocks: seconds since the engine's start, and waiting for a moment.

use std::{
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

/// A clock that never goes back, s.
pub trait Clock: Clone + Send + 'static {
    /// Seconds since the clock was made.
    fn now(&self) -> f64;
    /// Waits until a moment, s; returns at once if it has passed. Never returns early.
    fn wait_until(&self, moment: f64);
    /// Stands still at this moment, s, until it is allowed to go on to a later one. Clocks that cannot stand
    /// still ignore it.
    fn stop_at(&self, _moment: f64) {}
    /// Time for which it has stood still since the last call, s; from now on it goes on from there.
    fn take_standstill(&self) -> f64 {
        0.0
    }
}

/// The machine's monotonic clock.
///
/// A wait sleeps until `spin` seconds before the moment and spins for the rest. With 0 it never
/// spins and leaves the core to other threads.
///
/// The clock can stand still ([`Clock::stop_at`]): then a loop without hardware does not miss the time for
/// which the machine had no core for it.
#[derive(Debug, Clone)]
pub struct RealClock {
    origin: origin::Origin,
    spin: f64,
    still: Arc<Standstill>,
}

/// What makes the clock stand still, as the bits of numbers.
#[derive(Debug)]
struct Standstill {
    /// Moment at which it stands still, s.
    at: AtomicU64,
    /// Time for which it has stood still in all, s.
    total: AtomicU64,
}

/// Between two looks at a clock that stands still, s.
const STILL_LOOK: f64 = 5e-4;

impl RealClock {
    /// A clock that starts now and spins for the last `spin` seconds of each wait.
    pub fn new(spin: f64) -> Self {
        Self {
            origin: origin::Origin::now(),
            spin: spin.max(0.0),
            still: Arc::new(Standstill {
                at: AtomicU64::new(f64::INFINITY.to_bits()),
                total: AtomicU64::new(0),
            }),
        }
    }

    fn total_standstill(&self) -> f64 {
        f64::from_bits(self.still.total.load(Ordering::Acquire))
    }
}

impl Clock for RealClock {
    #[inline]
    fn now(&self) -> f64 {
        // In this order: the moment is moved after the total, so that the clock never goes back.
        let stops_at = f64::from_bits(self.still.at.load(Ordering::Acquire));
        let total = self.total_standstill();
        (self.origin.elapsed() - total).min(stops_at)
    }

    fn wait_until(&self, moment: f64) {
        // Nothing can wait for a moment that is not finite.
        if !moment.is_finite() {
            return;
        }
        let asleep_until = moment - self.spin;
        while self.now() < asleep_until {
            let total = self.total_standstill();
            let stops_at = f64::from_bits(self.still.at.load(Ordering::Acquire));
            // A clock that stands still is looked at again.
            let is_still = self.origin.elapsed() - total >= stops_at;
            let look = if is_still {
                self.origin.elapsed() + STILL_LOOK
            } else {
                0.0
            };
            self.origin.sleep_until((asleep_until + total).max(look));
        }
        while self.now() < moment {
            std::hint::spin_loop();
        }
    }

    fn stop_at(&self, moment: f64) {
        self.still.at.store(moment.to_bits(), Ordering::Release);
    }

    fn take_standstill(&self) -> f64 {
        let stops_at = f64::from_bits(self.still.at.load(Ordering::Acquire));
        let total = self.total_standstill();
        let stood = (self.origin.elapsed() - total - stops_at).max(0.0);
        self.still
            .total
            .store((total + stood).to_bits(), Ordering::Release);
        stood
    }
}

/// A clock that moves only when the program moves it: for tests, and for loops that other code
/// drives.
#[derive(Debug, Clone, Default)]
pub struct ManualClock(Arc<AtomicU64>);

impl ManualClock {
    /// A clock at zero.
    pub fn new() -> Self {
        Self::default()
    }

    /// Advances by `seconds`; negative values do not turn the clock back.
    pub fn advance(&self, seconds: f64) {
        let later = self.now() + seconds.max(0.0);
        self.0.store(later.to_bits(), Ordering::Release);
    }
}

impl Clock for ManualClock {
    fn now(&self) -> f64 {
        f64::from_bits(self.0.load(Ordering::Acquire))
    }

    /// Jumps to the moment, since nothing else moves this clock during a wait.
    fn wait_until(&self, moment: f64) {
        self.advance(moment - self.now());
    }
}

/// CPU time that the calling thread has used, s.
#[inline]
pub fn thread_cpu() -> f64 {
    // On Linux, read the clock directly: the same system call as on other systems, but it cannot
    // panic.
    #[cfg(target_os = "linux")]
    {
        let t = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
        t.tv_sec as f64 + t.tv_nsec as f64 * 1e-9
    }
    #[cfg(not(target_os = "linux"))]
    {
        cpu_time::ThreadTime::now().as_duration().as_secs_f64()
    }
}

/// Puts a thread outside the 1 kHz path to sleep.
pub(crate) fn rest(duration: Duration) {
    std::thread::park_timeout(duration);
}

#[cfg(target_os = "linux")]
mod origin {
    use rustix::{
        thread::clock_nanosleep_absolute,
        time::{ClockId, Timespec, clock_gettime},
    };

    #[derive(Debug, Clone, Copy)]
    pub(super) struct Origin(Timespec);

    impl Origin {
        pub(super) fn now() -> Self {
            Self(clock_gettime(ClockId::Monotonic))
        }

        pub(super) fn elapsed(self) -> f64 {
            let t = clock_gettime(ClockId::Monotonic);
            (t.tv_sec - self.0.tv_sec) as f64 + (t.tv_nsec - self.0.tv_nsec) as f64 * 1e-9
        }

        /// An absolute moment, so a delay between reading the clock and falling asleep adds no
        /// lateness.
        pub(super) fn sleep_until(self, moment: f64) {
            let ns = self.0.tv_nsec + (moment * 1e9) as i64;
            let at = Timespec {
                tv_sec: self.0.tv_sec + ns.div_euclid(1_000_000_000),
                tv_nsec: ns.rem_euclid(1_000_000_000),
            };
            // After an interruption by a signal, the caller reads the clock again.
            let _ = clock_nanosleep_absolute(ClockId::Monotonic, &at);
        }
    }
}

#[cfg(not(target_os = "linux"))]
mod origin {
    use std::time::{Duration, Instant};

    #[derive(Debug, Clone, Copy)]
    pub(super) struct Origin(Instant);

    impl Origin {
        pub(super) fn now() -> Self {
            Self(Instant::now())
        }

        pub(super) fn elapsed(self) -> f64 {
            self.0.elapsed().as_secs_f64()
        }

        #[expect(
            clippy::disallowed_methods,
            reason = "the one place that waits, on systems without an absolute sleep"
        )]
        pub(super) fn sleep_until(self, moment: f64) {
            let rest = moment - self.elapsed();
            if rest > 0.0 {
                std::thread::sleep(Duration::from_secs_f64(rest));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wait_is_never_early_and_a_past_moment_is_no_wait() {
        let clock = RealClock::new(1e-4);
        for k in 1..=5 {
            let moment = clock.now() + f64::from(k) * 3e-4;
            clock.wait_until(moment);
            assert!(clock.now() >= moment);
        }
        clock.wait_until(-1.0);
        clock.wait_until(f64::NAN);
    }

    #[test]
    fn a_clock_that_stands_still_goes_on_from_there_and_never_back() {
        let clock = RealClock::new(0.0);
        let start = clock.now();
        clock.stop_at(start + 0.002);
        RealClock::new(0.0).wait_until(0.02);
        let still = clock.now();
        assert!((still - start - 0.002).abs() < 1e-12, "{still}");
        // Somebody who waits for later goes on waiting, and wakes once it goes on.
        let other = clock.clone();
        let waits = std::thread::spawn(move || {
            other.wait_until(start + 0.004);
            other.now()
        });
        let stood = clock.take_standstill();
        assert!(stood > 0.015, "{stood}");
        assert!(clock.now() >= still);
        clock.stop_at(f64::INFINITY);
        assert!(waits.join().unwrap() >= start + 0.004);
        assert!((clock.total_standstill() - stood).abs() < 1e-12);
        assert!(clock.take_standstill() == 0.0);
    }

    #[test]
    fn work_costs_cpu_time_and_waiting_hardly_any() {
        let clock = RealClock::new(0.0);
        let t0 = thread_cpu();
        clock.wait_until(clock.now() + 0.05);
        let t1 = thread_cpu();
        let mut x = 1.0_f64;
        for _ in 0..2_000_000 {
            x = std::hint::black_box(x * 1.000_000_1);
        }
        let t2 = thread_cpu();
        assert!(
            t1 - t0 < 0.5 * 0.05,
            "{} s of CPU while waiting 0.05 s",
            t1 - t0
        );
        assert!(t2 > t1 && x > 1.0);
    }

    #[test]
    fn a_manual_clock_moves_only_when_told() {
        let clock = ManualClock::new();
        let other = clock.clone();
        clock.advance(0.5);
        other.wait_until(0.75);
        clock.wait_until(0.1);
        assert!((clock.now() - 0.75).abs() < 1e-15);
    }
}
