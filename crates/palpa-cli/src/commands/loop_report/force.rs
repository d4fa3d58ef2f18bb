//! The figures of the force at one device.

use palpa_rt::{FeelParams, FeelReport, ForceReport, ForceStats, Log, TickEntry};
use palpa_servo::{Faults, Limits};
use serde::Serialize;

use super::Run;
use super::figures::ticks_until;
use super::verdicts::MOST_ARRIVAL;

/// Limits by which a device cuts the force.
const CUTS: [Limits; 3] = [Limits::FORCE, Limits::SLEW, Limits::TRANSFER];
/// Faults that have verdicts of their own, as stale patches and dips after late ticks have.
const JUDGED_APART: [Faults; 4] = [
    Faults::NO_PATCH,
    Faults::STALE_PATCH,
    Faults::BAD_PATCH,
    Faults::MISSED_DEADLINE,
];

/// The figures of one device. Shares are of the ticks in which the tissue pressed and no ramp held
/// the force back.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(Default))]
pub(super) struct ForceFigures {
    pub(super) max_force_n: f64,
    /// Number of ticks in which the tissue pressed and no ramp held the force back.
    pub(super) touching_ticks: u64,
    /// Number of those in which a patch arrived.
    pub(super) arrivals: u64,
    /// Largest RMS of the force between 20 and 400 Hz over a second in which the target of the hand
    /// was still and the tissue pressed; `None` if there was no such second.
    pub(super) rms_still_n: Option<f64>,
    /// The same between 2 and 20 Hz.
    pub(super) rms_slow_still_n: Option<f64>,
    /// Time that these two judge.
    still_s: f64,
    /// Largest RMS between 20 and 400 Hz over any two seconds.
    rms_worst_n: f64,
    pub(super) arrival_max_n: f64,
    arrival_p999_n: f64,
    /// Largest change of force where a patch arrives, beyond the change that the device's own
    /// displacement causes through the tissue's stiffness.
    pub(super) arrival_alone_max_n: f64,
    pub(super) other_p999_n: f64,
    other_max_n: f64,
    /// Change of the force at the same pose from one patch to the next: the error that the force had
    /// before the patch. 99th percentile and largest.
    pub(super) transfer_p99_n: f64,
    transfer_max_n: f64,
    /// Energy taken from the hand, as counted by the law.
    energy_in_mj: f64,
    /// Energy given to the hand, as counted by the law.
    energy_out_mj: f64,
    /// Largest energy given out beyond the energy taken in, since the last fault.
    pub(super) energy_deficit_mj: f64,
    /// Largest energy given out in a closed way of at most a second, without ramps.
    pub(super) energy_window_mj: Option<f64>,
    /// The same with ramps.
    energy_window_with_ramps_mj: Option<f64>,
    pub(super) energy_budget_mj: f64,
    /// Largest force of the damping that the energy observer injected.
    pub(super) damping_force_max_n: f64,
    /// Largest force that pulled the tool into the tissue.
    pub(super) pull_max_n: f64,
    /// Largest share of the tissue's stiffness that the coupling took away.
    pub(super) softening_max: f64,
    /// Share of the ticks whose contact problem was not solved to its tolerance.
    pub(super) unsolved_share: f64,
    /// Share of the ticks in which the device's largest force or rate of change, or the largest
    /// transfer, cut the force.
    pub(super) cut_share: f64,
    /// Ticks at full force in which the patch could not be used.
    pub(super) bad_patch_ticks: u64,
    /// Ticks with other faults, except stale patches and missed deadlines.
    pub(super) other_fault_ticks: u64,
    /// Largest dip of the force below that of the tissue, as a share of it; `None` if there was never
    /// enough force.
    pub(super) dip_max: Option<f64>,
    /// Time between the two ticks before that dip that were farthest apart.
    pub(super) dip_max_after_ms: f64,
    /// Largest dip without a gap of 30 ms or more between two ticks before it.
    pub(super) dip_after_short_max: f64,
    /// Number of dips of more than a tenth.
    pub(super) dips: u64,
    /// Number of ticks more than 10 ms after the last, and the longest such time.
    late_ticks: u64,
    pub(super) longest_gap_ms: f64,
}

impl ForceFigures {
    /// The figures of all devices until the ramp down at the end.
    pub(super) fn of_all(run: &Run, log: &Log) -> Vec<Self> {
        let ticks: Vec<TickEntry> = ticks_until(log, run.until).copied().collect();
        // The path of the hand begins with the first tick.
        let began = ticks.first().map_or(0.0, |first| first.tick.now);
        let params = FeelParams {
            period: log.header.period,
            still: (run.still.iter())
                .map(|span| span.map(|t| t + began))
                .collect(),
        };
        (0..log.specs.len())
            .map(|k| {
                let mut stats = ForceStats::new(params.period);
                for entry in &ticks {
                    stats.add(entry, k);
                }
                let feel = FeelReport::new(&ticks, k, &params);
                Self::new(&ticks, k, &stats.report(), &feel)
            })
            .collect()
    }

    fn new(ticks: &[TickEntry], k: usize, force: &ForceReport, feel: &FeelReport) -> Self {
        let last = ticks.last();
        let milli = |joules: f64| joules * 1e3;
        let is_other = |fault: &Faults| !JUDGED_APART.contains(fault);
        let others = feel.faults.iter().filter(|(fault, _)| is_other(fault));
        Self {
            max_force_n: force.max_force,
            touching_ticks: feel.n_touching,
            arrivals: feel.n_arrivals,
            rms_still_n: feel.still.map(|still| still.rms_band),
            rms_slow_still_n: feel.still.and_then(|still| still.rms_slow),
            still_s: feel.still.map_or(0.0, |still| still.seconds),
            rms_worst_n: force.rms_band_worst,
            arrival_max_n: force.arrival_max,
            arrival_p999_n: force.arrival_p999,
            arrival_alone_max_n: force.arrival_alone_max,
            other_p999_n: force.other_p999,
            other_max_n: force.other_max,
            transfer_p99_n: feel.transfer_p99,
            transfer_max_n: feel.transfer_max,
            energy_in_mj: last.map_or(0.0, |t| milli(t.devices[k].energy_in)),
            energy_out_mj: last.map_or(0.0, |t| milli(t.devices[k].energy_out)),
            energy_deficit_mj: milli(force.max_work.max(0.0)),
            energy_window_mj: feel.energy_window.map(milli),
            energy_window_with_ramps_mj: feel.energy_window_with_ramps.map(milli),
            energy_budget_mj: last.map_or(0.0, |t| milli(t.tick.energy_budget)),
            damping_force_max_n: feel.damping_force_max,
            pull_max_n: feel.pull_max,
            softening_max: feel.softening_max,
            unsolved_share: feel.share_at(Limits::SWEEPS),
            cut_share: CUTS.into_iter().map(|cut| feel.share_at(cut)).sum(),
            bad_patch_ticks: feel.n_faulty(Faults::BAD_PATCH),
            other_fault_ticks: others.map(|(_, n)| n).sum(),
            dip_max: (feel.dips.n_judged > 0).then_some(feel.dips.worst),
            dip_max_after_ms: feel.dips.worst_after_gap * 1e3,
            dip_after_short_max: feel.dips.worst_after_short,
            dips: feel.dips.n_dips,
            late_ticks: feel.dips.n_late,
            longest_gap_ms: feel.dips.longest_gap * 1e3,
        }
    }

    /// Largest change of force that a tick in which a patch arrives may have, N: other ticks may change it nearly as
    /// fast, but a loop that trembles must not allow itself more. Never less than a patch alone may change it by.
    pub(super) fn most_arrival_n(&self) -> f64 {
        let least = (2.0 * self.other_p999_n).min(0.1 * self.max_force_n);
        least.max(MOST_ARRIVAL)
    }

    /// The figures that no guarantee judges.
    pub(super) fn line(&self) -> String {
        format!(
            "largest force {:.3} N; energy taken in {:.2} mJ, given out {:.2} mJ; {} ticks came more than 10 ms after the last, the longest gap is {:.1} ms; \
             {} dips of more than a tenth of the force",
            self.max_force_n,
            self.energy_in_mj,
            self.energy_out_mj,
            self.late_ticks,
            self.longest_gap_ms,
            self.dips
        )
    }
}
