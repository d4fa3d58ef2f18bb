//! The energy observer, and the damping that it asks for.
//!
//! A force that is held over a tick gives out up to `½ K Δx²` that no tissue ever held, and a patch that comes late gives
//! more. The observer banks what the hand put in, `−F·Δx`, less what the local model stores; friction and viscosity
//! leave a surplus, which is forgotten, since it would hide what is generated later. A deficit is not forgotten.

use crate::{DeviceSpec, ServoParams, Vec3};

/// Surplus beyond this is not banked, J: as much as a hard push stores.
const MAX_BANK: f64 = 0.05;
/// Time in which a deficit is to be paid back, s: quicker would be felt as a knock.
const PAY_BACK: f64 = 0.02;
/// Time in which damping fades once it is no longer asked for, s.
const FADE: f64 = 0.05;
/// Below this speed damping would only render the sensor's steps, m/s.
const MIN_SPEED: f64 = 2e-3;
/// Damping below this is cut to zero, N s/m.
const DAMPING_DUST: f64 = 1e-4;

/// Of one tool.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Energy {
    pub(crate) taken: f64,
    pub(crate) given: f64,
    pub(crate) bank: f64,
    pub(crate) damping: f64,
}

impl Energy {
    pub(crate) const fn new() -> Self {
        Self {
            taken: 0.0,
            given: 0.0,
            bank: 0.0,
            damping: 0.0,
        }
    }

    /// Counts the tick that ended: force `held` over `travel`, and what the model's store grew by.
    pub(crate) fn count(
        &mut self,
        held: &Vec3,
        travel: &Vec3,
        stored: f64,
        dt: f64,
        params: &ServoParams,
    ) {
        let work = -held.dot(travel);
        if !work.is_finite() || !stored.is_finite() {
            return;
        }
        if work > 0.0 {
            self.taken += work;
        } else {
            self.given -= work;
        }
        self.bank = (self.bank + work - stored).clamp(-1.0, MAX_BANK);
        if self.bank > 0.0 {
            self.bank *= (1.0 - dt / params.bank_time.max(1e-3)).clamp(0.0, 1.0);
        }
    }

    /// Damping to inject now, N s/m, at most what the device renders stably.
    pub(crate) fn ask_damping(
        &mut self,
        velocity: &Vec3,
        dt: f64,
        spec: &DeviceSpec,
        params: &ServoParams,
    ) -> f64 {
        let deficit = -self.bank - params.energy_budget;
        let speed = velocity.norm();
        self.damping *= (1.0 - dt / FADE).clamp(0.0, 1.0);
        if deficit > 0.0 && speed > MIN_SPEED {
            let wanted = deficit / (PAY_BACK * speed * speed);
            self.damping = self.damping.max(wanted.min(spec.max_damping));
        }
        if self.damping < DAMPING_DUST {
            self.damping = 0.0;
        }
        self.damping
    }
}
