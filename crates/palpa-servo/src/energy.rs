//! The energy observer, and the damping that it injects.
//!
//! A force that is held over a tick gives out up to `½ K Δx²` that no tissue ever held, and a patch
//! that comes late gives more. The observer banks what the hand put in, `−F·Δx`, less what the
//! local model stores; friction and viscosity leave a surplus, which is forgotten, since it would
//! hide what is generated later. A deficit is not forgotten. What the model says it stores is not
//! exact from patch to patch; off the tissue it stores nothing, and the bank is put right by work
//! alone.

use crate::{DeviceSpec, ServoParams, Vec3};

/// Surplus beyond this is not banked, J: as much as a hard push stores.
const MAX_BANK: f64 = 0.05;
/// Share of the budget beyond which a deficit is paid back, and times in which it is to be, s:
/// gently while it is within the budget, and beyond that as quickly as is not felt as a knock.
const PAY_FROM: f64 = 0.6;
const PAY_BACK: [f64; 2] = [0.2, 0.02];
/// The gentle damping is at most this, N s/m: with the steps of a coarse encoder in the velocity,
/// more would be felt.
const GENTLE: f64 = 0.1;
/// Time in which damping fades once it is no longer asked for, s.
const FADE: f64 = 0.05;
/// Below this speed damping would only render the sensor's steps, m/s.
const MIN_SPEED: f64 = 2e-3;
/// Damping below this is cut to zero, N s/m.
const DAMPING_DUST: f64 = 1e-4;

/// The energy account of one tool, J.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Energy {
    /// Taken from the hand since the start.
    pub(crate) taken: f64,
    /// Given to the hand since the start.
    pub(crate) given: f64,
    /// Surplus; negative is energy generated.
    bank: f64,
    /// Damping that is injected, N s/m.
    pub(crate) damping: f64,
    /// Work of the hand since the tool was last off the tissue, and the bank then.
    ledger: f64,
}

impl Energy {
    pub(crate) const fn new() -> Self {
        Self {
            taken: 0.0,
            given: 0.0,
            bank: 0.0,
            damping: 0.0,
            ledger: 0.0,
        }
    }

    /// The bank, J; negative is energy generated.
    pub(crate) fn bank(&self) -> f64 {
        self.bank
    }

    /// Begins anew with an empty bank: while the force ramps, work says nothing of the tissue.
    pub(crate) fn forget(&mut self) {
        self.bank = 0.0;
        self.ledger = 0.0;
    }

    /// Counts the tick that ended: the force `held`, N, over `travel`, m, and the growth of the
    /// model's store, J.
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
        self.ledger += work;
        if *held == Vec3::zeros() {
            self.bank = self.bank.min(self.ledger);
            self.ledger = self.bank;
        }
        if self.bank > 0.0 {
            self.bank *= (1.0 - dt / params.bank_time.max(1e-3)).clamp(0.0, 1.0);
        }
    }

    /// Damping to inject now, N s/m, at most what the device renders stably; none off the tissue.
    pub(crate) fn ask_damping(
        &mut self,
        velocity: &Vec3,
        touches: bool,
        dt: f64,
        spec: &DeviceSpec,
        params: &ServoParams,
    ) -> f64 {
        let budget = params.energy_budget;
        let within = -self.bank - PAY_FROM * budget;
        let beyond = (-self.bank - budget).max(0.0);
        let speed = velocity.norm();
        self.damping *= (1.0 - dt / FADE).clamp(0.0, 1.0);
        if !touches {
            self.damping = 0.0;
        } else if within > 0.0 && speed > MIN_SPEED {
            let square = speed * speed;
            let gentle = (within / (PAY_BACK[0] * square)).min(GENTLE);
            let wanted = gentle + beyond / (PAY_BACK[1] * square);
            self.damping = self.damping.max(wanted.min(spec.max_damping));
        }
        if self.damping < DAMPING_DUST {
            self.damping = 0.0;
        }
        self.damping
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_model_does_not_store_does_not_hide_a_deficit() {
        let (params, mut energy) = (ServoParams::default(), Energy::new());
        let held = Vec3::z();
        for cycle in 1..=50 {
            // In by 1 mm under 1 N and out under 1.1 N, of which the model thinks it was its own.
            energy.count(&held, &(Vec3::z() * -1e-3), 1e-3, 1e-3, &params);
            energy.count(&(held * 1.1), &(Vec3::z() * 1e-3), -1.1e-3, 1e-3, &params);
            energy.count(&Vec3::zeros(), &Vec3::zeros(), 0.0, 1e-3, &params);
            let given = 0.1e-3 * f64::from(cycle);
            assert!(
                (energy.bank + given).abs() < 1e-9,
                "{cycle}: {}",
                energy.bank
            );
        }
    }

    #[test]
    fn what_is_forgotten_does_not_come_back_off_the_tissue() {
        let (params, mut energy) = (ServoParams::default(), Energy::new());
        energy.count(&Vec3::z(), &(Vec3::z() * 1e-3), 0.0, 1e-3, &params);
        assert!(energy.bank() < -9e-4);
        energy.forget();
        energy.count(&Vec3::zeros(), &Vec3::zeros(), 0.0, 1e-3, &params);
        assert!(energy.bank().abs() < 1e-12, "{}", energy.bank());
    }
}
