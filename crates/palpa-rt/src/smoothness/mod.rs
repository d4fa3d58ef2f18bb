//! Smoothness and energy of the forces, computed from ticks, live or from a log.

mod filter;

pub(crate) use self::filter::{BandPass, VIBRATION};

use crate::{histogram::Histogram, record::DeviceRecord, servo_loop::TickEntry};
use std::collections::VecDeque;

/// Window of the RMS, s.
const WINDOW: f64 = 2.0;

/// Computes the smoothness and energy of one device's force. Changes of force are counted in
/// [`Histogram`]s, with newtons in place of seconds.
#[derive(Debug)]
pub struct ForceStats {
    period: f64,
    filter: BandPass,
    last: Option<DeviceRecord>,
    /// Squares of the filtered force in the window, N².
    squares: VecDeque<f64>,
    worst_sum: f64,
    arrivals: Histogram,
    arrivals_alone: Histogram,
    others: Histogram,
    max_force: f64,
    work: f64,
    /// Work done on the hand since the last ramp, J.
    ledger: f64,
    max_work: f64,
}

/// Results of [`ForceStats`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ForceReport {
    /// RMS of the force between 20 and 400 Hz over the last 2 s, N.
    pub rms_band: f64,
    /// The largest such RMS over any 2 s, N.
    pub rms_band_worst: f64,
    /// Largest change of force between two ticks where a patch arrived, N. No figure for changes of
    /// force includes ramps.
    pub arrival_max: f64,
    /// 99.9th percentile of the change at such ticks, N.
    pub arrival_p999: f64,
    /// Largest change at such a tick beyond the change that the device's own displacement causes
    /// through the tissue's stiffness, N.
    pub arrival_alone_max: f64,
    /// 99.9th percentile of the change at other ticks, N.
    pub other_p999: f64,
    /// Largest change at other ticks, N.
    pub other_max: f64,
    /// Largest force, N.
    pub max_force: f64,
    /// Total work done on the hand, J: positive if the device gave out more energy than it took in.
    pub work: f64,
    /// Largest value of this work since the last fault, J. It restarts at a fault because a ramp
    /// takes and gives energy on purpose.
    pub max_work: f64,
}

impl ForceStats {
    /// Statistics for a loop of this period, s.
    pub fn new(period: f64) -> Self {
        Self {
            period,
            filter: BandPass::new(VIBRATION, period),
            last: None,
            squares: VecDeque::new(),
            worst_sum: 0.0,
            arrivals: Histogram::new(),
            arrivals_alone: Histogram::new(),
            others: Histogram::new(),
            max_force: 0.0,
            work: 0.0,
            ledger: 0.0,
            max_work: 0.0,
        }
    }

    /// Adds a tick of device `k`.
    pub fn add(&mut self, entry: &TickEntry, k: usize) {
        let Some(device) = entry.devices.get(k) else {
            return;
        };
        let force = device.force;
        self.squares.push_back(self.filter.square(force));
        let window = (WINDOW / self.period) as usize;
        if self.squares.len() > window {
            self.squares.pop_front();
        }
        if self.squares.len() == window && entry.tick.tick.is_multiple_of(100) {
            self.worst_sum = self.worst_sum.max(self.squares.iter().sum());
        }
        self.max_force = self.max_force.max(norm(force));
        // A ramp changes the force on purpose, within its own limits.
        let is_ramping = entry.tick.gain < 1.0;
        if let Some(last) = self.last {
            let step = std::array::from_fn(|i| force[i] - last.force[i]);
            let changes = if entry.tick.taken {
                &self.arrivals
            } else {
                &self.others
            };
            if !is_ramping {
                changes.add(norm(step));
            }
            if entry.tick.taken && !is_ramping {
                let way = norm(std::array::from_fn(|i| {
                    device.position[i] - last.position[i]
                }));
                let own = device.stiffness.max(last.stiffness) * way;
                self.arrivals_alone.add((norm(step) - own).max(0.0));
            }
            if device.is_there && last.is_there {
                // The force of the last tick acted while the hand moved to its present position.
                let work: f64 = (0..3)
                    .map(|i| last.force[i] * (device.position[i] - last.position[i]))
                    .sum();
                if work.is_finite() {
                    self.work += work;
                    self.ledger = if is_ramping { 0.0 } else { self.ledger + work };
                    self.max_work = self.max_work.max(self.ledger);
                }
            }
        }
        self.last = Some(*device);
    }

    /// The results so far.
    pub fn report(&self) -> ForceReport {
        let mean = |sum: f64| (sum / self.squares.len().max(1) as f64).sqrt();
        let now: f64 = self.squares.iter().sum();
        ForceReport {
            rms_band: mean(now),
            rms_band_worst: mean(self.worst_sum.max(now)),
            arrival_max: self.arrivals.max(),
            arrival_p999: self.arrivals.quantile(0.999),
            arrival_alone_max: self.arrivals_alone.max(),
            other_p999: self.others.quantile(0.999),
            other_max: self.others.max(),
            max_force: self.max_force,
            work: self.work,
            max_work: self.max_work,
        }
    }
}

pub(crate) fn norm(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::TickRecord;

    fn feed(
        stats: &mut ForceStats,
        n: u64,
        taken: impl Fn(u64) -> bool,
        at: impl Fn(f64) -> (f64, f64),
    ) {
        feed_ramping(stats, n, taken, at, |_| 1.0);
    }

    fn feed_ramping(
        stats: &mut ForceStats,
        n: u64,
        taken: impl Fn(u64) -> bool,
        at: impl Fn(f64) -> (f64, f64),
        gain: impl Fn(u64) -> f64,
    ) {
        for tick in 1..=n {
            let (position, force) = at(tick as f64 * 1e-3);
            let mut entry = TickEntry {
                tick: TickRecord {
                    tick,
                    taken: taken(tick),
                    gain: gain(tick),
                    ..TickRecord::default()
                },
                ..TickEntry::default()
            };
            entry.devices[0].is_there = true;
            entry.devices[0].position[0] = position;
            entry.devices[0].force[0] = force;
            stats.add(&entry, 0);
        }
    }

    #[test]
    fn the_band_lets_through_what_hands_feel_as_vibration() {
        // Gain of both filters in series by formula, with the frequency warping of the bilinear
        // transform.
        let warp = |f: f64| (std::f64::consts::PI * f * 1e-3).tan();
        let gain = |f: f64| {
            let low = 1.0 / (1.0 + (warp(f) / warp(400.0)).powi(4)).sqrt();
            let high = 1.0 / (1.0 + (warp(20.0) / warp(f)).powi(4)).sqrt();
            low * high
        };
        for f in [2.0, 20.0, 100.0, 300.0, 450.0] {
            let mut stats = ForceStats::new(1e-3);
            feed(
                &mut stats,
                4000,
                |_| false,
                |t| (0.0, (std::f64::consts::TAU * f * t).sin()),
            );
            let want = gain(f) / 2.0_f64.sqrt();
            let got = stats.report().rms_band;
            assert!((got - want).abs() < 0.005, "{f} Hz: {got} for {want}");
        }
    }

    #[test]
    fn jumps_are_told_apart_by_whether_a_patch_came() {
        let mut stats = ForceStats::new(1e-3);
        feed(
            &mut stats,
            500,
            |k| k == 300,
            |t| (0.0, if t > 0.2995 { 1.0 + t } else { t }),
        );
        let r = stats.report();
        assert!((r.arrival_max - 1.001).abs() < 1e-6);
        assert!((r.other_max - 0.001).abs() < 1e-6);
        assert!((r.max_force - 1.5).abs() < 1e-12);
    }

    #[test]
    fn what_a_ramp_does_is_no_jump_and_begins_the_count_of_energy_anew() {
        let mut stats = ForceStats::new(1e-3);
        // The device pushes the hand away by 1 mm with 1 N. Then the hand returns without force
        // during a ramp, and the push repeats.
        let place = |t: f64| if (0.1..0.3).contains(&t) { 1e-3 } else { 0.0 };
        let force = |t: f64| if (0.2..0.4).contains(&t) { 0.0 } else { 1.0 };
        let gain = |tick: u64| {
            if (150..=450).contains(&tick) {
                0.5
            } else {
                1.0
            }
        };
        feed_ramping(&mut stats, 500, |_| true, |t| (place(t), force(t)), gain);
        let r = stats.report();
        assert!((r.max_work - 1e-3).abs() < 1e-12, "{}", r.max_work);
        assert!(r.arrival_max < 1e-12, "{}", r.arrival_max);
    }

    #[test]
    fn work_of_a_spring_comes_back_and_that_of_a_lag_is_given() {
        let mut stats = ForceStats::new(1e-3);
        let x = |t: f64| 1e-3 * (std::f64::consts::TAU * 10.0 * t).sin();
        feed(&mut stats, 1000, |_| false, |t| (x(t), -100.0 * x(t)));
        let spring = stats.report();
        // With its force held from tick to tick, a spring gives out ½ K T v² per tick: π² K X² f T
        // per cycle of ten.
        let want = std::f64::consts::PI.powi(2) * 100.0 * 1e-6 * 2.0 * 10.0 * 10.0 * 1e-3 / 2.0;
        assert!(
            (spring.work / want - 1.0).abs() < 0.02,
            "{} for {want}",
            spring.work
        );
        assert!(spring.max_work >= spring.work);
    }
}
