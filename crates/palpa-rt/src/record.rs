//! The rows of a log: a tick, a device in a tick, a step of the tissue, and the settings at the
//! start.

use palpa_servo::ServoParams;

record! {
    /// One tick of the 1 kHz loop.
    TickRecord as "palpa/Tick" {
        /// Counts ticks from 1.
        tick: u64,
        /// Time at which it began, s; the law's clock.
        now: f64,
        /// Lateness, s: time from when it was due; more than a period if ticks were left out.
        lateness: f64,
        /// CPU time that it took, s.
        cpu: f64,
        /// Ticks left out for that lateness: they were due after it was, and before it began.
        skipped: u32,
        /// Whether a newer patch was there when it began.
        offered: bool,
        /// Whether the law took it.
        taken: bool,
        /// The patch that it used, counted as the tissue's steps; 0 is none.
        patch: u64,
        /// Time since that patch's poses were taken, s.
        patch_age: f64,
        /// Vertices that touch.
        n_active: u32,
        /// Of these, those that slide.
        n_sliding: u32,
        /// Sweeps over the contacts.
        sweeps: u32,
        /// Change of the contact forces in the last sweep, relative.
        residual: f64,
        /// Share of the force that is let through: below 1 after a fault.
        gain: f64,
        /// Energy that may be given out beyond what was taken in, J.
        energy_budget: f64,
        /// Faults: bits of `palpa_servo::Faults`.
        faults: u32,
        /// Limits that were met: bits of `palpa_servo::Limits`.
        limits: u32,
        /// How many devices there were.
        n_devices: u32,
    }
}

record! {
    /// One device in one tick.
    DeviceRecord as "palpa/Device" {
        /// Which tick.
        tick: u64,
        /// Whether it could be read; if not, the state means nothing.
        is_there: bool,
        /// When its state was read, s.
        time: f64,
        /// Position, m.
        position: [f64; 3],
        /// Orientation: quaternion i, j, k, w.
        orientation: [f64; 4],
        /// Velocity, m/s.
        velocity: [f64; 3],
        /// A bit per button.
        buttons: u32,
        /// Commanded force, N.
        force: [f64; 3],
        /// Commanded moment, N m.
        torque: [f64; 3],
        /// Whether it took the command.
        is_written: bool,
        /// Force of the tissue by the local model, before anything is done to it, N.
        tissue_force: [f64; 3],
        /// Transfer from the patch before, N; part of the force.
        transfer: [f64; 3],
        /// Stiffness of the tissue against the tool, N/m.
        stiffness: f64,
        /// Distance of the tool from the device by the coupling, m.
        stretch: f64,
        /// Share of the tissue's stiffness that the coupling takes away.
        softening: f64,
        /// Damping that the energy observer injected, N s/m.
        damping: f64,
        /// Energy taken from the hand since the start, J.
        energy_in: f64,
        /// Energy given to the hand since the start, J.
        energy_out: f64,
        /// Bank of the energy observer, J; negative is energy generated.
        bank: f64,
        /// Faults of this device: bits of `palpa_servo::Faults`.
        faults: u32,
        /// Limits that its force met: bits of `palpa_servo::Limits`.
        limits: u32,
    }
}

record! {
    /// One step of the tissue.
    StepRecord as "palpa/Step" {
        /// Counts steps from 1; also the number of the patch that it made.
        step: u64,
        /// The tick at which the poses were taken.
        tick: u64,
        /// When they were taken, s.
        sampled_at: f64,
        /// When the step began, s.
        now: f64,
        /// Time that the tissue was moved on, s: capped.
        dt: f64,
        /// Time beyond that cap, s: lost.
        lost: f64,
        /// Time from patch to patch that was expected, s.
        period: f64,
        /// How many tools there were.
        n_tools: u32,
        /// Their positions, m, one after the other.
        positions: [f64; 3 * palpa_servo::MAX_TOOLS],
        /// Their orientations, i, j, k, w, one after the other.
        orientations: [f64; 4 * palpa_servo::MAX_TOOLS],
        /// Whether the result of a background job was installed before it.
        installed: bool,
        /// Whether a background job was taken after it.
        job_taken: bool,
        /// How it went, as a number; the order is that of `StepStatus`.
        status: u8,
        /// Whether its patch was published.
        published: bool,
        /// Whether its patch was spoilt on purpose: 1 with NaN.
        spoilt: u8,
        /// Iterations.
        iterations: u32,
        /// Residual at its end, relative.
        residual: f64,
        /// Which factor of the exterior it used.
        factor: u64,
        /// Which zone.
        zone: u64,
        /// Which mesh, counted from 1.
        mesh: u64,
        /// Stored energy of the tissue, J.
        energy: f64,
        /// Candidates in its patch.
        n_contacts: u32,
        /// Hash of the patch.
        hash: u64,
        /// CPU time it took, s.
        cpu: f64,
        /// Wall time it took, s.
        wall: f64,
    }
}

record! {
    /// Limits of a device, at the start of the log.
    SpecRecord as "palpa/DeviceSpec" {
        /// Which device.
        device: u32,
        /// Largest force, N.
        max_force: f64,
        /// Largest moment, N m.
        max_torque: f64,
        /// Largest change of force in time, N/s.
        max_slew: f64,
        /// Stiffness up to which it is stable in any hand, N/m.
        max_stiffness: f64,
        /// Largest damping that it renders stably, N s/m.
        max_damping: f64,
    }
}

record! {
    /// Settings of the law, as in `palpa_servo::ServoParams`.
    ServoRecord as "palpa/ServoParams" {
        /// Period that the loop aims at, s.
        period: f64,
        /// Relative change of forces in a sweep below which contact is solved.
        tolerance: f64,
        /// Largest number of sweeps.
        max_sweeps: u32,
        /// Linearisations of the gaps in a tick.
        passes: u32,
        /// Time to take over to a new patch, patch periods.
        transfer_periods: f64,
        /// Largest difference bridged, of the largest force.
        max_transfer: f64,
        /// Age at which a patch is stale, patch periods.
        stale_periods: f64,
        /// Shortest such age, s.
        stale_after: f64,
        /// Time between ticks that is a missed deadline, s.
        late_after: f64,
        /// Time of equal readings that is a stall, s.
        stall_after: f64,
        /// Speed that counts as a jump, m/s.
        max_speed: f64,
        /// Time to fall to zero, s.
        ramp_down: f64,
        /// Time to come back, s.
        ramp_up: f64,
        /// Energy given out beyond what was taken in, J.
        energy_budget: f64,
        /// Time in which the observer forgets, s.
        bank_time: f64,
        /// Step of the position sensor, m.
        resolution: f64,
        /// Damping that is always rendered in contact, N s/m.
        damping: f64,
    }
}

impl From<&ServoParams> for ServoRecord {
    fn from(p: &ServoParams) -> Self {
        // Taken apart field by field: a setting that is new in the law must be recorded too.
        let ServoParams {
            period,
            tolerance,
            max_sweeps,
            passes,
            transfer_periods,
            max_transfer,
            stale_periods,
            stale_after,
            late_after,
            stall_after,
            max_speed,
            ramp_down,
            ramp_up,
            energy_budget,
            bank_time,
            resolution,
            damping,
        } = *p;
        Self {
            period,
            tolerance,
            max_sweeps,
            passes,
            transfer_periods,
            max_transfer,
            stale_periods,
            stale_after,
            late_after,
            stall_after,
            max_speed,
            ramp_down,
            ramp_up,
            energy_budget,
            bank_time,
            resolution,
            damping,
        }
    }
}

impl From<&ServoRecord> for ServoParams {
    fn from(r: &ServoRecord) -> Self {
        Self {
            period: r.period,
            tolerance: r.tolerance,
            max_sweeps: r.max_sweeps,
            passes: r.passes,
            transfer_periods: r.transfer_periods,
            max_transfer: r.max_transfer,
            stale_periods: r.stale_periods,
            stale_after: r.stale_after,
            late_after: r.late_after,
            stall_after: r.stall_after,
            max_speed: r.max_speed,
            ramp_down: r.ramp_down,
            ramp_up: r.ramp_up,
            energy_budget: r.energy_budget,
            bank_time: r.bank_time,
            resolution: r.resolution,
            damping: r.damping,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::Record;

    #[test]
    fn what_is_written_is_read_to_the_bit() {
        let step = StepRecord {
            step: u64::MAX,
            sampled_at: f64::from_bits(0x7ff8_0000_0000_1234), // a NaN with a payload
            positions: [1.0, -0.0, f64::MIN_POSITIVE, 4.0, f64::INFINITY, 6.0],
            job_taken: true,
            n_contacts: 60,
            hash: 0xdead_beef,
            ..StepRecord::default()
        };
        let mut bytes = Vec::new();
        step.encode(&mut bytes);
        let mut again = Vec::new();
        StepRecord::decode(&bytes).unwrap().encode(&mut again);
        assert_eq!(bytes, again);
        assert_eq!(StepRecord::decode(&bytes[..bytes.len() - 1]), None);
    }

    #[test]
    fn schema_and_columns_name_every_number() {
        assert!(
            DeviceRecord::schema()
                .starts_with("uint64 tick\nbool is_there\nfloat64 time\nfloat64[3] position\n")
        );
        let columns = DeviceRecord::columns();
        assert_eq!(
            &columns[3..7],
            ["position_x", "position_y", "position_z", "orientation_0"]
        );
        let mut values = Vec::new();
        DeviceRecord::default().values(&mut values);
        assert_eq!(values.len(), columns.len());
    }
}
