//! What the hand felt, from the recorded ticks of a whole run.
//!
//! ```text
//! ticks ─┬─► arrivals of patches, limits, faults      this file
//!        ├─► force while the hand's target is still   still.rs
//!        ├─► energy in a sliding window               energy.rs
//!        └─► dips of the force after late ticks       dips.rs
//! ```
//! [`ForceStats`](crate::ForceStats) has figures that are known while the loop runs. These need the
//! whole run, and the times at which the *target* of the hand was still: a device that trembles is
//! not still, and that must not hide the trembling.

mod dips;
mod energy;
mod still;

pub use self::dips::Dips;
pub use self::still::Still;

use crate::{servo_loop::TickEntry, smoothness::norm};
use palpa_servo::{Faults, Limits};

/// What is known of a run beside its ticks.
#[derive(Debug, Clone, Default)]
pub struct FeelParams {
    /// Period of the loop, s.
    pub period: f64,
    /// Spans of the loop's clock in which the target of the hand did not move, s, ascending.
    pub still: Vec<[f64; 2]>,
}

/// What the hand felt at one device. Counts and largest values are over the ticks in which the
/// tissue pressed on the tool and no ramp held the force back, unless they say otherwise.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FeelReport {
    /// Number of these ticks.
    pub n_touching: u64,
    /// Number of these ticks in which a patch arrived.
    pub n_arrivals: u64,
    /// Change of the force at the same pose from one patch to the next, N: the error that the force
    /// had before the patch arrived. The law lets it fade in. Largest value.
    pub transfer_max: f64,
    /// 99th percentile of that change, N.
    pub transfer_p99: f64,
    /// Ticks that met each limit: bit and count, in the order of the bits.
    pub limits: Vec<(Limits, u64)>,
    /// Largest share of the tissue's stiffness that the coupling took away.
    pub softening_max: f64,
    /// Largest force of the damping that the energy observer injected, N, by the way of the device within
    /// the last 10 ms.
    pub damping_force_max: f64,
    /// Largest force that pulled the tool into the tissue, against the last force of the tissue, N: whether or not
    /// that pressed still.
    pub pull_max: f64,
    /// Number of ticks with each fault after the first tick at full force, whether or not the tool
    /// touched.
    pub faults: Vec<(Faults, u64)>,
    /// Vibration while the hand's target was still and the tissue pressed; `None` if that never
    /// was so for long enough.
    pub still: Option<Still>,
    /// Largest energy that the loop gave out in a closed way of the device of at most one second, J;
    /// `None` if there was none with contact.
    pub energy_window: Option<f64>,
    /// The same with ramps, which take and give energy on purpose, J.
    pub energy_window_with_ramps: Option<f64>,
    /// How far the force dipped, and late ticks.
    pub dips: Dips,
}

impl FeelReport {
    /// What was felt at device `k` in these ticks.
    pub fn new(ticks: &[TickEntry], k: usize, params: &FeelParams) -> Self {
        let mut report = Self {
            still: still::still(ticks, k, params),
            dips: dips::dips(ticks, k, params.period),
            ..Self::default()
        };
        [report.energy_window, report.energy_window_with_ramps] = energy::windows(ticks, k);
        let (mut limits, mut faults) = ([0; 16], [0; 16]);
        let mut transfers = Vec::new();
        let mut last: Option<&TickEntry> = None;
        let mut is_armed = false;
        let mut outward = [0.0; 3];
        for (i, entry) in ticks.iter().enumerate() {
            let device = &entry.devices[k];
            is_armed |= entry.tick.gain >= 1.0;
            let pressed = norm(device.tissue_force);
            if pressed > 0.0 {
                outward = device.tissue_force.map(|f| f / pressed);
            }
            if device.is_there {
                let along: f64 = device
                    .force
                    .iter()
                    .zip(outward)
                    .map(|(f, out)| f * out)
                    .sum();
                report.pull_max = report.pull_max.max(-along);
            }
            if is_armed {
                count(&mut faults, entry.tick.faults | device.faults);
            }
            if is_felt(entry, k) {
                report.n_touching += 1;
                // What belongs to the whole contact problem is entered at the tick.
                let whole = Limits::SWEEPS.bits();
                count(
                    &mut limits,
                    device.limits | (entry.tick.limits & u32::from(whole)),
                );
                report.softening_max = report.softening_max.max(device.softening);
                let damping = device.damping * speed(&ticks[..=i], k);
                report.damping_force_max = report.damping_force_max.max(damping);
                if entry.tick.taken
                    && let Some(last) = last.filter(|last| is_felt(last, k))
                {
                    let before = last.devices[k].transfer;
                    transfers.push(norm(std::array::from_fn(|i| {
                        device.transfer[i] - before[i]
                    })));
                }
            }
            last = Some(entry);
        }
        transfers.sort_by(f64::total_cmp);
        report.n_arrivals = transfers.len() as u64;
        report.transfer_max = transfers.last().copied().unwrap_or(0.0);
        let p99 = (transfers.len() * 99 / 100).min(transfers.len().saturating_sub(1));
        report.transfer_p99 = transfers.get(p99).copied().unwrap_or(0.0);
        report.limits = counted(limits, Limits::from_bits, Limits::is_empty);
        report.faults = counted(faults, Faults::from_bits, Faults::is_empty);
        report
    }

    /// Ticks that met a limit, as a share of those in which the tissue pressed.
    pub fn share_at(&self, limit: Limits) -> f64 {
        let n = (self.limits.iter().filter(|(of, _)| *of == limit)).map(|(_, n)| n);
        n.sum::<u64>() as f64 / self.n_touching.max(1) as f64
    }

    /// Number of ticks with a fault.
    pub fn n_faulty(&self, fault: Faults) -> u64 {
        (self.faults.iter().filter(|(of, _)| *of == fault))
            .map(|(_, n)| n)
            .sum()
    }
}

/// Whether the tissue presses on the tool in a tick, and no ramp holds the force back.
fn is_felt(entry: &TickEntry, k: usize) -> bool {
    let device = &entry.devices[k];
    entry.tick.gain >= 1.0 && device.is_there && norm(device.tissue_force) > 0.0
}

/// Speed of device `k` at the last of these ticks, m/s: by its way within 10 ms. Few devices tell one.
fn speed(ticks: &[TickEntry], k: usize) -> f64 {
    const OVER: f64 = 10e-3;
    let Some((now, before)) = ticks.split_last() else {
        return 0.0;
    };
    let time = |entry: &TickEntry| now.tick.now - entry.tick.now;
    let is_near = |entry: &&TickEntry| time(entry) <= OVER && entry.devices[k].is_there;
    let Some(from) = before.iter().rev().take_while(is_near).last() else {
        return 0.0;
    };
    let way: [f64; 3] =
        std::array::from_fn(|i| now.devices[k].position[i] - from.devices[k].position[i]);
    norm(way) / time(from).max(f64::MIN_POSITIVE)
}

fn count(counts: &mut [u64; 16], bits: u32) {
    for (bit, n) in counts.iter_mut().enumerate() {
        *n += u64::from(bits >> bit & 1);
    }
}

fn counted<F: Copy>(
    counts: [u64; 16],
    flag: impl Fn(u16) -> F,
    is_empty: impl Fn(F) -> bool,
) -> Vec<(F, u64)> {
    (counts.into_iter().enumerate())
        .map(|(bit, n)| (flag(1 << bit), n))
        .filter(|(flag, n)| *n > 0 && !is_empty(*flag))
        .collect()
}

#[cfg(test)]
mod tests;
