//! The energy observer, and the damping that it injects.
//!
//! ```text
//! in each tick   w = −F·Δx − T·Δθ    work of the hand against the held force and moment
//!                law  = ΔE + d − w   E: stored energy of the local model, d: loss in its friction
//!                port = ΔE − w
//! at a patch     jump = E(new patch) − E(old patch), at the same pose
//! ```
//! All three are positive where energy comes from nowhere: a force held over a tick gives out up to
//! `½ K Δx²`, a transfer or a slew limit delays the force, and a patch that arrives can raise the
//! stored energy that no hand paid for. They are summed over a sliding window.
//!
//! - *law*: friction is no credit, so dissipation beside does not hide what the law gives out. A
//!   debt that leaves the window stays; it fades by [`ALLOWED`], which is the leak of holding the
//!   force over each tick and less than a device's own friction takes.
//! - *port*: what the hand got for nothing, friction included. A debt stays until it is paid. Off
//!   the tissue it is corrected by the work alone, which needs no model.
//! - *jumps*: the largest rise of their sum in the window. Falls, by which viscous tissue shows its
//!   loss, pay only for rises before them in the window, and never for *law* or *port*.
//!
//! After Hannaford & Ryu (2002), "Time-domain passivity control of haptic interfaces", with the
//! stored energy as a reference as in Ryu et al. (2005), "Time domain passivity control with
//! reference energy following", so that energy once lost in the tissue is no credit for later.

use crate::{DeviceSpec, ServoParams, Vec3};

/// Number of bins of the sliding window.
const BINS: usize = 40;
/// Power that the law may give out for ever, W.
const ALLOWED: f64 = 2e-3;
/// Share of the energy budget at which paying back a debt begins.
const PAY_FROM: f64 = 0.6;
/// Times in which a debt is paid back, s: gently while it is within the budget, and beyond the
/// budget as fast as is possible without a noticeable knock.
const PAY_BACK: [f64; 2] = [0.2, 0.02];
/// Largest gentle damping, N s/m. More would be felt, because the velocity from a coarse encoder
/// has steps.
const GENTLE: f64 = 0.1;
/// Largest force of the damping, as a share of the device's largest force.
const MAX_SHARE: f64 = 0.25;
/// Times in which the damping grows, and fades when it is no longer needed, s.
const RISE: f64 = 5e-3;
const FADE: f64 = 0.05;
/// Time in which it fades off the tissue, s.
const FADE_FREE: f64 = 5e-3;
/// Smallest speed for damping, m/s; below it, damping would only render the sensor's steps.
const MIN_SPEED: f64 = 2e-3;
/// Damping below this is cut to zero, N s/m.
const DAMPING_DUST: f64 = 1e-4;

/// Energies of a tick, or sums of them, J.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Entry {
    law: f64,
    port: f64,
    jump: f64,
}

impl Entry {
    const ZERO: Self = Self {
        law: 0.0,
        port: 0.0,
        jump: 0.0,
    };

    fn add(&mut self, other: &Self) {
        self.law += other.law;
        self.port += other.port;
        self.jump += other.jump;
    }
}

/// Sums over a sliding window.
#[derive(Debug, Clone, Copy)]
struct Window {
    /// The newest bin comes first.
    bins: [Entry; BINS],
    /// Time in the newest bin, s.
    filled: f64,
}

impl Window {
    const EMPTY: Self = Self {
        bins: [Entry::ZERO; BINS],
        filled: 0.0,
    };

    fn add(&mut self, entry: &Entry) {
        if let Some(newest) = self.bins.first_mut() {
            newest.add(entry);
        }
    }

    /// Advances by `dt`, s, in a window of `length`, s. Returns what left the window.
    fn advance(&mut self, dt: f64, length: f64) -> Entry {
        let mut left = Entry::ZERO;
        let bin = length.clamp(1e-2, 10.0) / BINS as f64;
        self.filled += dt;
        for _ in 0..BINS {
            if self.filled < bin {
                return left;
            }
            self.filled -= bin;
            self.bins.rotate_right(1);
            if let Some(oldest) = self.bins.first_mut() {
                left.add(oldest);
                *oldest = Entry::ZERO;
            }
        }
        self.filled = 0.0;
        left
    }

    /// The sums of `law` and `port` over the window, and the largest rise of `jump` from any time in
    /// the window to now.
    fn sums(&self) -> Entry {
        let (mut sum, mut rise) = (Entry::ZERO, 0.0_f64);
        for bin in &self.bins {
            sum.add(bin);
            rise = rise.max(sum.jump);
        }
        Entry { jump: rise, ..sum }
    }
}

/// The energy account of one tool, J.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Energy {
    /// Energy taken from the hand since the start.
    pub(crate) taken: f64,
    /// Energy given to the hand since the start.
    pub(crate) given: f64,
    window: Window,
    /// Debts that left the window unpaid.
    law_debt: f64,
    port_debt: f64,
    /// Work of the hand since the tool was last off the tissue, less the debt at that time.
    ledger: f64,
    /// Damping that is injected, N s/m.
    damping: f64,
}

/// What happened in a tick, J.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TickEnergy {
    /// Work of the hand against the command.
    pub(crate) work: f64,
    /// Growth of the stored energy.
    pub(crate) grown: f64,
    /// Loss in the friction of the local model.
    pub(crate) rubbed: f64,
    /// Whether the command was zero.
    pub(crate) is_free: bool,
}

impl Energy {
    pub(crate) const fn new() -> Self {
        Self {
            taken: 0.0,
            given: 0.0,
            window: Window::EMPTY,
            law_debt: 0.0,
            port_debt: 0.0,
            ledger: 0.0,
            damping: 0.0,
        }
    }

    /// The bank, J; negative if energy was generated.
    pub(crate) fn bank(&self) -> f64 {
        let sums = self.window.sums();
        -((self.law_debt + sums.law).max(self.port_debt + sums.port) + sums.jump)
    }

    /// Counts the tick that ended.
    pub(crate) fn count(&mut self, tick: &TickEnergy, dt: f64, params: &ServoParams) {
        let left = self.window.advance(dt, params.bank_time);
        self.law_debt = (self.law_debt + left.law - ALLOWED * dt).max(0.0);
        self.port_debt = (self.port_debt + left.port).max(0.0);
        let given = tick.grown - tick.work;
        if !(given.is_finite() && tick.rubbed.is_finite()) {
            return;
        }
        self.taken += tick.work.max(0.0);
        self.given += (-tick.work).max(0.0);
        self.window.add(&Entry {
            law: given + tick.rubbed,
            port: given,
            jump: 0.0,
        });
        self.ledger += tick.work;
        if tick.is_free {
            let port = self.port_debt + self.window.sums().port;
            let owed = port.max(-self.ledger);
            self.port_debt += owed - port;
            self.ledger = -owed.max(0.0);
        }
    }

    /// Books the energy by which a new patch changes the stored energy at the same pose, J.
    pub(crate) fn jump(&mut self, by: f64) {
        if by.is_finite() {
            self.window.add(&Entry {
                jump: by,
                ..Entry::ZERO
            });
        }
    }

    /// The ramp lets through more or less of the force, and so of the stored energy, by `by`, J. It
    /// is no work, and no debt: the time of the ramp limits it.
    pub(crate) fn ramp(&mut self, by: f64) {
        if by.is_finite() {
            self.ledger += by;
        }
    }

    /// Damping to inject now, N s/m: at most the damping that the device renders stably.
    pub(crate) fn ask_damping(
        &mut self,
        velocity: &Vec3,
        touches: bool,
        dt: f64,
        spec: &DeviceSpec,
        params: &ServoParams,
    ) -> f64 {
        let debt = -self.bank();
        let within = debt - PAY_FROM * params.energy_budget;
        let beyond = (debt - params.energy_budget).max(0.0);
        let speed = velocity.norm();
        let fade = if touches { FADE } else { FADE_FREE };
        self.damping *= (1.0 - dt / fade).clamp(0.0, 1.0);
        if touches && within > 0.0 && speed > MIN_SPEED {
            let square = speed * speed;
            let gentle = (within / (PAY_BACK[0] * square)).min(GENTLE);
            let wanted = (gentle + beyond / (PAY_BACK[1] * square)).min(spec.max_damping);
            let short = (wanted - self.damping).max(0.0);
            self.damping += short * (dt / RISE).clamp(0.0, 1.0);
        }
        let most = MAX_SHARE * spec.max_force / speed.max(MIN_SPEED);
        self.damping = self.damping.min(most);
        if self.damping < DAMPING_DUST || !self.damping.is_finite() {
            self.damping = 0.0;
        }
        self.damping
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 1e-3;
    const SPEC: DeviceSpec = DeviceSpec {
        max_force: 8.0,
        max_torque: 0.0,
        max_slew: 1000.0,
        max_stiffness: 2000.0,
        max_damping: 10.0,
    };

    fn tick(work: f64, grown: f64, rubbed: f64) -> TickEnergy {
        TickEnergy {
            work,
            grown,
            rubbed,
            is_free: false,
        }
    }

    /// The energy after `n` such ticks.
    fn after(n: usize, each: &TickEnergy) -> Energy {
        let (params, mut energy) = (ServoParams::default(), Energy::new());
        for _ in 0..n {
            energy.count(each, DT, &params);
        }
        energy
    }

    #[test]
    fn what_friction_takes_does_not_hide_what_the_law_gives_out() {
        // 20 mW are given out, friction takes 200 mW beside.
        let energy = after(1000, &tick(180e-6, 0.0, 200e-6));
        let owed = 20e-6 * 1000.0 - 0.8 * ALLOWED;
        assert!(
            (energy.bank() + owed).abs() < 0.02 * owed,
            "{}",
            energy.bank()
        );
        // Without the 20 mW there is nothing to pay.
        let energy = after(1000, &tick(200e-6, 0.0, 200e-6));
        assert!(energy.bank().abs() < 1e-12, "{}", energy.bank());
        // The leak of holding the force is allowed for ever.
        let energy = after(60_000, &tick(100e-6, 0.0, 101e-6));
        assert!(energy.bank() > -0.25e-3, "{}", energy.bank());
    }

    #[test]
    fn loss_is_no_credit_after_the_window() {
        let params = ServoParams::default();
        let mut energy = after(1000, &tick(100e-6, 0.0, 0.0));
        for _ in 0..205 {
            energy.count(&tick(0.0, 0.0, 0.0), DT, &params);
        }
        assert!(energy.bank().abs() < 1e-12, "{}", energy.bank());
        energy.count(&tick(-1e-3, 0.0, 0.0), DT, &params);
        assert!((energy.bank() + 1e-3).abs() < 1e-12, "{}", energy.bank());
        // A debt that nothing pays stays, and what pays it counts at once.
        for _ in 0..10_000 {
            energy.count(&tick(0.0, 0.0, 0.0), DT, &params);
        }
        assert!((energy.bank() + 1e-3).abs() < 1e-12, "{}", energy.bank());
        energy.count(&tick(0.6e-3, 0.0, 0.0), DT, &params);
        assert!((energy.bank() + 0.4e-3).abs() < 1e-12, "{}", energy.bank());
    }

    #[test]
    fn jumps_that_rise_are_owed_and_falls_pay_for_rises_only() {
        let params = ServoParams::default();
        let mut energy = Energy::new();
        // Falls first: viscous tissue relaxes.
        energy.jump(-5e-3);
        energy.count(&tick(0.0, 0.0, 0.0), 10.0 * DT, &params);
        assert!(energy.bank().abs() < 1e-12);
        energy.jump(1e-3);
        assert!((energy.bank() + 1e-3).abs() < 1e-12, "{}", energy.bank());
        energy.count(&tick(0.0, 0.0, 0.0), 10.0 * DT, &params);
        energy.jump(-0.7e-3);
        energy.count(&tick(0.0, 0.0, 0.0), 10.0 * DT, &params);
        assert!((energy.bank() + 0.3e-3).abs() < 1e-12, "{}", energy.bank());
        for _ in 0..210 {
            energy.count(&tick(0.0, 0.0, 0.0), DT, &params);
        }
        assert!(energy.bank().abs() < 1e-12, "{}", energy.bank());
    }

    #[test]
    fn off_the_tissue_the_work_alone_counts() {
        let params = ServoParams::default();
        let mut energy = Energy::new();
        for cycle in 1..=50 {
            // The hand goes in 1 mm against 1 N and out under 1.1 N; the model claims that it
            // stored and returned this energy, and half a second goes by.
            energy.count(&tick(1e-3, 1e-3, 0.0), DT, &params);
            energy.count(&tick(-1.1e-3, -1.1e-3, 0.0), DT, &params);
            for _ in 0..500 {
                energy.count(
                    &TickEnergy {
                        is_free: true,
                        ..tick(0.0, 0.0, 0.0)
                    },
                    DT,
                    &params,
                );
            }
            let given = 0.1e-3 * f64::from(cycle);
            assert!((energy.bank() + given).abs() < 1e-9, "{}", energy.bank());
        }
    }

    #[test]
    fn a_ramp_neither_owes_nor_pays() {
        let params = ServoParams::default();
        let free = TickEnergy {
            is_free: true,
            ..tick(0.0, 0.0, 0.0)
        };
        let mut energy = after(1, &tick(-1e-3, 0.0, 0.0));
        energy.count(&free, DT, &params);
        assert!((energy.bank() + 1e-3).abs() < 1e-12, "{}", energy.bank());
        // The force comes back over 5 mJ of stored energy, and the hand takes them.
        energy.ramp(5e-3);
        energy.count(&tick(-5e-3, -5e-3, 0.0), DT, &params);
        energy.count(&free, DT, &params);
        assert!((energy.bank() + 1e-3).abs() < 1e-12, "{}", energy.bank());
        // It falls over them: they are lost, and pay nothing.
        energy.count(&tick(5e-3, 5e-3, 0.0), DT, &params);
        energy.ramp(-5e-3);
        energy.count(&free, DT, &params);
        assert!((energy.bank() + 1e-3).abs() < 1e-12, "{}", energy.bank());
    }

    #[test]
    fn damping_grows_and_fades_smoothly_and_is_limited() {
        let (params, spec) = (ServoParams::default(), SPEC);
        let mut energy = after(1, &tick(-20e-3, 0.0, 0.0));
        let velocity = Vec3::x() * 0.05;
        let mut last = 0.0;
        for _ in 0..100 {
            let damping = energy.ask_damping(&velocity, true, DT, &spec, &params);
            let step = damping - last;
            assert!((0.0..=0.21 * spec.max_damping).contains(&step), "{step}");
            assert!(damping * velocity.norm() <= MAX_SHARE * spec.max_force + 1e-12);
            last = damping;
        }
        assert!(last > 0.9 * spec.max_damping, "{last}");
        // A faster hand meets the limit of the force.
        let fast = Vec3::x() * 2.0;
        let damping = energy.ask_damping(&fast, true, DT, &spec, &params);
        assert!(damping * fast.norm() <= MAX_SHARE * spec.max_force + 1e-12);
        // At rest, and off the tissue, it fades.
        let mut last = energy.damping;
        for _ in 0..200 {
            let damping = energy.ask_damping(&Vec3::zeros(), false, DT, &spec, &params);
            assert!(damping <= last);
            last = damping;
        }
        assert!(last == 0.0);
    }
}
