//! Settings of the law.

/// Settings of the law. The tests run with the defaults.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServoParams {
    /// Period of the loop, s.
    pub period: f64,
    /// Tolerance of the contact problem: the sweeps end when one changes the forces by less than
    /// this share of their sum.
    pub tolerance: f64,
    /// Largest number of sweeps over the contacts in one solution, 1 to 200.
    pub max_sweeps: u32,
    /// Number of linearisations of the gaps within a tick, 1 to 4.
    pub passes: u32,
    /// Time in which a new patch takes over from the old one, in patch periods.
    pub transfer_periods: f64,
    /// Largest difference in force between two patches that the transfer bridges, as a share of the
    /// device's largest force.
    pub max_transfer: f64,
    /// Age at which a patch is stale, in patch periods; never less than
    /// [`ServoParams::stale_after`].
    pub stale_periods: f64,
    /// Smallest age at which a patch can count as stale, s. Until then the force goes on by the local model, which
    /// is passive.
    pub stale_after: f64,
    /// Time in which the force falls to zero if a stale patch is the only fault, s. It goes on by the local model
    /// meanwhile.
    pub fade: f64,
    /// Time between two ticks beyond which the force ramps to zero, s. After a shorter time the
    /// force goes on by the local model, within the slew of two periods.
    pub late_after: f64,
    /// Time for which a device may repeat the same reading before it counts as stalled, s.
    pub stall_after: f64,
    /// Speed beyond which a change of position counts as a jump of the device, m/s.
    pub max_speed: f64,
    /// Time in which the force falls to zero after a fault, s.
    pub ramp_down: f64,
    /// Time in which the force returns after a fault, s.
    pub ramp_up: f64,
    /// Energy budget, J: energy that the loop may give out beyond the energy it took in. Beyond the
    /// budget, the observer injects strong damping.
    pub energy_budget: f64,
    /// Length of the energy observer's window, s. Energy that was lost in the tissue is no credit
    /// after it.
    pub bank_time: f64,
    /// Damping that is always rendered in contact, N s/m. It is 0 except in trials, because the
    /// tissue has its own damping.
    pub damping: f64,
    /// Step of the device's position sensor, m. Smaller differences give no velocity.
    pub resolution: f64,
}

impl Default for ServoParams {
    fn default() -> Self {
        Self {
            period: 1e-3,
            tolerance: 1e-3,
            max_sweeps: 60,
            passes: 3,
            transfer_periods: 2.0,
            max_transfer: 0.25,
            stale_periods: 4.0,
            stale_after: 0.1,
            fade: 0.4,
            late_after: 0.03,
            stall_after: 0.02,
            max_speed: 5.0,
            ramp_down: 0.05,
            ramp_up: 0.5,
            energy_budget: 2e-3,
            bank_time: 0.2,
            damping: 0.0,
            resolution: 5e-5,
        }
    }
}
