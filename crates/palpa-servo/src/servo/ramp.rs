//! The ramp: after a fault the force falls to zero, and some time after the last fault it returns.

use crate::{Faults, ServoParams};

/// Time at zero force without a fault before the force comes back, s.
const QUIET: f64 = 0.05;

/// The share of the force that passes, and whether it rises or falls.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ramp {
    gain: f64,
    way: Way,
}

/// State of a ramp. `quiet_for` is the time at zero force without a fault, s.
#[derive(Debug, Clone, Copy)]
enum Way {
    /// The share rises to one or is one. The force is this tick's.
    Up,
    /// The only fault is a stale patch. The share falls to zero, but the force is this tick's, so
    /// it still falls when the hand draws back, and rises again at once with a new patch.
    DownLive { quiet_for: f64 },
    /// There was another fault. The share of the last good force falls to zero.
    DownHeld { quiet_for: f64 },
}

impl Ramp {
    pub(super) const fn new() -> Self {
        Self {
            gain: 0.0,
            way: Way::DownHeld { quiet_for: 0.0 },
        }
    }

    /// The share, 0 to 1; linear in time.
    pub(super) fn gain(&self) -> f64 {
        self.gain
    }

    /// The share with a smooth beginning and end.
    pub(super) fn smoothed(&self) -> f64 {
        self.gain * self.gain * (3.0 - 2.0 * self.gain)
    }

    /// Whether the last good force passes instead of this tick's.
    pub(super) fn is_held(&self) -> bool {
        matches!(self.way, Way::DownHeld { .. })
    }

    /// Advances by `dt`, s. Returns whether the force begins to return in this tick.
    pub(super) fn update(&mut self, faults: Faults, dt: f64, params: &ServoParams) -> bool {
        if !faults.is_empty() {
            self.way = if self.is_held() || faults != Faults::STALE_PATCH {
                Way::DownHeld { quiet_for: 0.0 }
            } else {
                Way::DownLive { quiet_for: 0.0 }
            };
        }
        if matches!(self.way, Way::DownLive { .. }) && faults.is_empty() && self.gain > 0.0 {
            self.way = Way::Up;
        }
        let (quiet_for, time) = match &mut self.way {
            Way::Up => {
                self.gain = (self.gain + dt / params.ramp_up.max(1e-3)).min(1.0);
                return false;
            }
            Way::DownLive { quiet_for } => (quiet_for, params.fade),
            Way::DownHeld { quiet_for } => (quiet_for, params.ramp_down),
        };
        self.gain = (self.gain - dt / time.max(1e-3)).max(0.0);
        if self.gain > 0.0 || !faults.is_empty() {
            return false;
        }
        *quiet_for += dt;
        let comes_back = *quiet_for > QUIET;
        if comes_back {
            self.way = Way::Up;
        }
        comes_back
    }
}
