//! The ticks of the last two seconds, for readers outside the loop.

use crate::servo_loop::TickEntry;
use std::collections::VecDeque;

/// Number of ticks that are kept: two seconds at 1 kHz.
const KEPT: usize = 2048;

/// Force and energy of the first device in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LateTick {
    /// Time of the tick, s.
    pub now: f64,
    /// Commanded force, device's frame, N.
    pub force: [f64; 3],
    /// Bank of the energy observer, J; negative if energy was generated.
    pub bank: f64,
    /// Damping that the energy observer injected, N s/m.
    pub damping: f64,
}

impl From<&TickEntry> for LateTick {
    fn from(entry: &TickEntry) -> Self {
        let [device, ..] = &entry.devices;
        Self {
            now: entry.tick.now,
            force: device.force,
            bank: device.bank,
            damping: device.damping,
        }
    }
}

/// The newest ticks, oldest first. Its memory does not grow.
#[derive(Debug)]
pub(crate) struct LateTicks(VecDeque<LateTick>);

impl Default for LateTicks {
    fn default() -> Self {
        Self(VecDeque::with_capacity(KEPT))
    }
}

impl LateTicks {
    /// Adds ticks that came after those before. Empties `new`.
    pub(crate) fn append(&mut self, new: &mut Vec<LateTick>) {
        for tick in new.drain(..) {
            if self.0.len() == KEPT {
                self.0.pop_front();
            }
            self.0.push_back(tick);
        }
    }

    /// The ticks, oldest first.
    pub(crate) fn to_vec(&self) -> Vec<LateTick> {
        self.0.iter().copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_ticks_stay_in_order() {
        let mut late = LateTicks::default();
        for begin in [0, 1500, 3000] {
            let mut new = (begin..begin + 1500)
                .map(|k| LateTick {
                    now: f64::from(k),
                    ..LateTick::default()
                })
                .collect();
            late.append(&mut new);
            assert!(new.is_empty());
        }
        let times: Vec<f64> = late.to_vec().iter().map(|t| t.now).collect();
        let wanted: Vec<f64> = (4500 - KEPT..4500).map(|k| k as f64).collect();
        assert_eq!(times, wanted);
    }
}
