//! The energy observer, and the damping that it injects.
//!
//! Two effects give energy to the hand that no tissue ever stored: a force held over a tick gives
//! out up to `½ K Δx²`, and a patch that arrives late gives more. The observer therefore keeps a
//! bank: the work of the hand, `−F·Δx`, minus the growth of the energy that the local model stores.
//! Friction and viscosity leave a surplus. The surplus is forgotten with time, since it would hide
//! energy that is generated later. A deficit is not forgotten.
//!
//! The stored energy of the model is not exact from patch to patch. Off the tissue the stored
//! energy is zero, so there the bank is corrected by the work alone.

use crate::{DeviceSpec, ServoParams, Vec3};

/// Largest surplus in the bank, J: the energy that a hard push stores.
const MAX_BANK: f64 = 0.05;
/// Share of the energy budget at which paying back a deficit begins.
const PAY_FROM: f64 = 0.6;
/// Times in which a deficit is paid back, s: gently while it is within the budget, and beyond the
/// budget as fast as is possible without a noticeable knock.
const PAY_BACK: [f64; 2] = [0.2, 0.02];
/// Largest gentle damping, N s/m. More would be felt, because the velocity from a coarse encoder
/// has steps.
const GENTLE: f64 = 0.1;
/// Time in which the damping fades when it is no longer needed, s.
const FADE: f64 = 0.05;
/// Smallest speed for damping, m/s; below it, damping would only render the sensor's steps.
const MIN_SPEED: f64 = 2e-3;
/// Damping below this is cut to zero, N s/m.
const DAMPING_DUST: f64 = 1e-4;

/// The energy account of one tool, J.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Energy {
    /// Energy taken from the hand since the start.
    pub(crate) taken: f64,
    /// Energy given to the hand since the start.
    pub(crate) given: f64,
    /// Surplus; negative if energy was generated.
    bank: f64,
    /// Damping that is injected, N s/m.
    pub(crate) damping: f64,
    /// Work of the hand since the tool was last off the tissue, plus the bank at that time.
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

    /// The bank, J; negative if energy was generated.
    pub(crate) fn bank(&self) -> f64 {
        self.bank
    }

    /// Empties the bank. Used while the force ramps, when the work says nothing about the tissue.
    pub(crate) fn forget(&mut self) {
        self.bank = 0.0;
        self.ledger = 0.0;
    }

    /// Counts the tick that ended: the force `held`, N, acted over `travel`, m, and the energy that
    /// the model stores grew by `stored`, J.
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

    /// Damping to inject now, N s/m: at most the damping that the device renders stably, and zero
    /// off the tissue.
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
            // The hand goes in 1 mm against 1 N and out under 1.1 N; the model claims that it
            // stored and returned this energy.
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
