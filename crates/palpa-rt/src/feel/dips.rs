//! Dips of the force below the force of the tissue, and the late ticks before them.
//!
//! ```text
//! dip = 1 − F·b/|b|²,      b = force of the tissue at this tick + transfer, N
//! ```
//! `F` is the commanded force. It is smaller than `b` while a ramp holds it back. A ramp follows a
//! fault, such as a tick that came late.

use crate::{servo_loop::TickEntry, smoothness::norm};
use palpa_servo::Limits;

/// A gap between two ticks is late from this many periods on.
const LATE: f64 = 1.5;
/// Longest gap that the loop should survive without a dip, s.
const SHORT: f64 = 0.03;
/// A late tick is named as the cause of a dip for this long, s: a ramp down, a pause and a ramp up.
const CAUSE: f64 = 0.8;

/// How far the force dipped, and late ticks. Counted from the first tick at full force.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Dips {
    /// Number of gaps between two ticks of more than 10 ms.
    pub n_late: u64,
    /// Longest time between two ticks, s.
    pub longest_gap: f64,
    /// Number of dips of more than a tenth, one after the other.
    pub n_dips: u64,
    /// Largest dip, as a share of the tissue's force.
    pub worst: f64,
    /// Longest gap between two ticks within 0.8 s before the largest dip, s; 0 if none was late.
    pub worst_after_gap: f64,
    /// Largest dip without a gap of 30 ms or more before it.
    pub worst_after_short: f64,
    /// Number of ticks with enough force for a dip to count.
    pub n_judged: u64,
}

impl Dips {
    /// Smallest force of the tissue at which a dip counts, N: less is not felt.
    pub const LEAST_FORCE: f64 = 0.2;
}

/// The dips at device `k`.
pub(super) fn dips(ticks: &[TickEntry], k: usize, period: f64) -> Dips {
    /// Gaps that are counted, s, and dips that are counted.
    const COUNTED: (f64, f64) = (0.01, 0.1);
    let mut dips = Dips::default();
    let (mut is_armed, mut is_down) = (false, false);
    // Late ticks that may still be a cause: time and gap, s.
    let mut late: Vec<[f64; 2]> = Vec::new();
    let mut last: Option<f64> = None;
    for entry in ticks {
        let now = entry.tick.now;
        let gap = last.map_or(0.0, |last| now - last);
        last = Some(now);
        is_armed |= entry.tick.gain >= 1.0;
        if !is_armed {
            continue;
        }
        dips.longest_gap = dips.longest_gap.max(gap);
        dips.n_late += u64::from(gap > COUNTED.0);
        late.retain(|[at, _]| now - at <= CAUSE);
        if gap > LATE * period {
            late.push([now, gap]);
        }
        let Some(dip) = dip(entry, k) else {
            continue;
        };
        dips.n_judged += 1;
        let cause = late.iter().map(|[_, gap]| *gap).fold(0.0, f64::max);
        if dip > dips.worst {
            (dips.worst, dips.worst_after_gap) = (dip, cause);
        }
        if cause < SHORT {
            dips.worst_after_short = dips.worst_after_short.max(dip);
        }
        dips.n_dips += u64::from(dip > COUNTED.1 && !is_down);
        is_down = dip > COUNTED.1;
    }
    dips
}

/// The dip in a tick; `None` if there is too little force, or if the device's own limits, which are
/// judged apart, cut it.
fn dip(entry: &TickEntry, k: usize) -> Option<f64> {
    let device = &entry.devices[k];
    let cut = u32::from(Limits::FORCE.bits() | Limits::SLEW.bits());
    if !device.is_there || (entry.tick.gain >= 1.0 && device.limits & cut != 0) {
        return None;
    }
    let wanted: [f64; 3] = std::array::from_fn(|i| device.tissue_force[i] + device.transfer[i]);
    let size = norm(wanted);
    if size.is_nan() || size < Dips::LEAST_FORCE {
        return None;
    }
    let along: f64 = (0..3).map(|i| device.force[i] * wanted[i]).sum();
    Some(1.0 - along / (size * size))
}
