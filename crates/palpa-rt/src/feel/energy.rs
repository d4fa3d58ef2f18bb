//! Energy that the loop gives out in a sliding window.
//!
//! Elastic tissue gives back what it stored, and that is no error. So only *closed* ways of the
//! device count: those that end where they began. There the stored energy is the same again, and the
//! work that the force did on the hand is what the loop made:
//!
//! ```text
//! W = Σ F_i · (x_{i+1} − x_i)  +  ½ (F_s + F_t) · (x_s − x_t)      over the ticks s … t
//! ```
//! The last term closes a gap of at most [`GAP`]. The window is short, so that what tissue
//! dissipates at another time does not hide what the loop makes now.

use crate::{servo_loop::TickEntry, smoothness::norm};

/// Longest window, s.
const WINDOW: f64 = 1.0;
/// Largest distance between the ends of a way that counts as closed, m: a few steps of an encoder.
/// The force is nearly linear over it.
const GAP: f64 = 0.2e-3;
/// Ends of windows are taken every so many ticks.
const STRIDE: usize = 4;

/// An end of a window.
#[derive(Debug, Clone, Copy)]
struct End {
    time: f64,
    position: [f64; 3],
    force: [f64; 3],
    /// Work done on the hand until then, J.
    work: f64,
    /// Number of ticks in a ramp, and in contact, until then.
    n_ramping: usize,
    n_touching: usize,
}

/// Largest energy given out in a closed way at device `k`, J: without ramps, and with them. `None`
/// if there is no such way in contact.
pub(super) fn windows(ticks: &[TickEntry], k: usize) -> [Option<f64>; 2] {
    let mut found = [None, None];
    for ends in ways(ticks, k) {
        search(&ends, &mut found);
    }
    found
}

fn search(ends: &[End], found: &mut [Option<f64>; 2]) {
    let mut first = 0;
    for (t, end) in ends.iter().enumerate() {
        while end.time - ends[first].time > WINDOW {
            first += 1;
        }
        for begin in &ends[first..t] {
            let back: [f64; 3] = std::array::from_fn(|i| begin.position[i] - end.position[i]);
            if norm(back) > GAP || end.n_touching == begin.n_touching {
                continue;
            }
            let closing: f64 = (0..3)
                .map(|i| 0.5 * (begin.force[i] + end.force[i]) * back[i])
                .sum();
            let made = end.work - begin.work + closing;
            if !made.is_finite() {
                continue;
            }
            let most = |found: Option<f64>| Some(found.map_or(made, |most| most.max(made)));
            if end.n_ramping == begin.n_ramping {
                found[0] = most(found[0]);
            }
            found[1] = most(found[1]);
        }
    }
}

/// The ends of windows, for each part of the run in which the device could be read.
fn ways(ticks: &[TickEntry], k: usize) -> Vec<Vec<End>> {
    let mut ways = vec![Vec::new()];
    let mut now: Option<End> = None;
    for (i, entry) in ticks.iter().enumerate() {
        let device = &entry.devices[k];
        if !device.is_there {
            if now.take().is_some() {
                ways.push(Vec::new());
            }
            continue;
        }
        let mut next = now.unwrap_or(End {
            time: entry.tick.now,
            position: device.position,
            force: [0.0; 3],
            work: 0.0,
            n_ramping: 0,
            n_touching: 0,
        });
        // The force of the last tick acted while the hand moved to its present position.
        let work: f64 = (0..3)
            .map(|i| next.force[i] * (device.position[i] - next.position[i]))
            .sum();
        if work.is_finite() {
            next.work += work;
        }
        (next.time, next.position, next.force) = (entry.tick.now, device.position, device.force);
        next.n_ramping += usize::from(entry.tick.gain < 1.0);
        next.n_touching += usize::from(norm(device.tissue_force) > 0.0);
        now = Some(next);
        if i.is_multiple_of(STRIDE)
            && let Some(way) = ways.last_mut()
        {
            way.push(next);
        }
    }
    ways
}
