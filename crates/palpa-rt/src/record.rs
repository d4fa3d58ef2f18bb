//! The rows of a log: a tick, a device in a tick, a step of the tissue, and the settings at the
//! start.

use palpa_servo::ServoParams;

record! {
    /// One tick of the 1 kHz loop.
    TickRecord as "palpa/Tick" {
        /// Counts ticks from 1.
        tick: u64,
        /// Time at which the tick began, s, on the law's clock.
        now: f64,
        /// Lateness, s: time from the due moment to the start; more than a period if ticks were
        /// skipped.
        lateness: f64,
        /// CPU time of the tick, s.
        cpu: f64,
        /// Ticks skipped because of that lateness: those due after this tick was due and before it
        /// began.
        skipped: u32,
        /// Whether a newer patch was available when the tick began.
        offered: bool,
        /// Whether the law took the newer patch.
        taken: bool,
        /// The patch that the law used, by the number of the tissue's step; 0 if none.
        patch: u64,
        /// Time since that patch's poses were taken, s.
        patch_age: f64,
        /// Vertices that touch.
        n_active: u32,
        /// Touching vertices that slide.
        n_sliding: u32,
        /// Sweeps over the contacts.
        sweeps: u32,
        /// Change of the contact forces in the last sweep, relative.
        residual: f64,
        /// Share of the force that the ramp lets through; below 1 after a fault.
        gain: f64,
        /// Energy budget, J: energy that the loop may give out beyond the energy it took in.
        energy_budget: f64,
        /// Faults: bits of `palpa_servo::Faults`.
        faults: u32,
        /// Limits that were met: bits of `palpa_servo::Limits`.
        limits: u32,
        /// Number of devices.
        n_devices: u32,
    }
}

record! {
    /// One device in one tick.
    DeviceRecord as "palpa/Device" {
        /// Number of the tick.
        tick: u64,
        /// Whether the device could be read; if not, its state is not valid.
        is_there: bool,
        /// Time at which the state of the device was read, s.
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
        /// Whether the device accepted the command.
        is_written: bool,
        /// Force of the tissue by the local model, before transfer, ramp, damping and limits, N.
        tissue_force: [f64; 3],
        /// Transfer from the previous patch, N; part of the force.
        transfer: [f64; 3],
        /// Stiffness of the tissue against the tool, N/m.
        stiffness: f64,
        /// Distance between tool and device caused by the coupling, m.
        stretch: f64,
        /// Share of the tissue's stiffness that the coupling takes away.
        softening: f64,
        /// Damping that the energy observer injected, N s/m.
        damping: f64,
        /// Energy taken from the hand since the start, J.
        energy_in: f64,
        /// Energy given to the hand since the start, J.
        energy_out: f64,
        /// Bank of the energy observer, J; negative if energy was generated.
        bank: f64,
        /// Energy that the local model stores, J.
        stored: f64,
        /// Energy by which the patch that arrived in this tick changed the stored energy at the same
        /// pose, J.
        jump: f64,
        /// Faults of this device: bits of `palpa_servo::Faults`.
        faults: u32,
        /// Limits that its force met: bits of `palpa_servo::Limits`.
        limits: u32,
    }
}

record! {
    /// One step of the tissue.
    StepRecord as "palpa/Step" {
        /// Counts steps from 1; also the number of the patch that the step made.
        step: u64,
        /// The tick at which the poses were taken.
        tick: u64,
        /// Time at which the poses were taken, s.
        sampled_at: f64,
        /// When the step began, s.
        now: f64,
        /// Time by which the tissue was moved on, s; capped.
        dt: f64,
        /// Time beyond that cap, s; it is lost.
        lost: f64,
        /// Expected time from patch to patch, s.
        period: f64,
        /// Number of tools.
        n_tools: u32,
        /// Positions of the tools, m, one after the other: ahead of those that were taken, where the
        /// patch will serve.
        positions: [f64; 3 * palpa_servo::MAX_TOOLS],
        /// Orientations of the tools, quaternions i, j, k, w, one after the other.
        orientations: [f64; 4 * palpa_servo::MAX_TOOLS],
        /// Whether it was known where the hand of the first tool meant to touch the tissue.
        is_aimed: bool,
        /// That place, in the device's frame, m.
        aim: [f64; 3],
        /// Whether the result of a background job was installed before the step.
        installed: bool,
        /// Whether it became known before the step that a background job had panicked.
        job_failed: bool,
        /// Whether a background job was taken after the step.
        job_taken: bool,
        /// Status of the step as a number, in the order of `StepStatus`.
        status: u8,
        /// Whether it handed over a patch: a new one, or the last one again.
        published: bool,
        /// Whether its patch was spoilt on purpose: 1 if NaN was written into it.
        spoilt: u8,
        /// Solver iterations of the step.
        iterations: u32,
        /// Relative residual at the end of the step.
        residual: f64,
        /// Number of the factor of the exterior that the step used.
        factor: u64,
        /// Number of the zone.
        zone: u64,
        /// Number of the mesh, from 1.
        mesh: u64,
        /// Stored energy of the tissue, J.
        energy: f64,
        /// Candidates in its patch.
        n_contacts: u32,
        /// Hash of the patch.
        hash: u64,
        /// CPU time of the step, s.
        cpu: f64,
        /// Wall time of the step, s.
        wall: f64,
    }
}

record! {
    /// Limits of a device, at the start of the log.
    SpecRecord as "palpa/DeviceSpec" {
        /// Number of the device, from 0.
        device: u32,
        /// Largest force, N.
        max_force: f64,
        /// Largest moment, N m.
        max_torque: f64,
        /// Largest rate of change of the force, N/s.
        max_slew: f64,
        /// Stiffness up to which the device is stable in any hand, N/m.
        max_stiffness: f64,
        /// Largest damping that the device renders stably, N s/m.
        max_damping: f64,
    }
}

record! {
    /// Settings of the law, as in `palpa_servo::ServoParams`.
    ServoRecord as "palpa/ServoParams" {
        /// Period that the loop aims at, s.
        period: f64,
        /// Relative change of the forces in a sweep below which the contact problem counts as
        /// solved.
        tolerance: f64,
        /// Largest number of sweeps.
        max_sweeps: u32,
        /// Linearisations of the gaps in a tick.
        passes: u32,
        /// Time in which a new patch takes over, in patch periods.
        transfer_periods: f64,
        /// Largest difference in force that the transfer bridges, as a share of the device's
        /// largest force.
        max_transfer: f64,
        /// Age at which a patch is stale, in patch periods.
        stale_periods: f64,
        /// Smallest age at which a patch can count as stale, s.
        stale_after: f64,
        /// Time in which the force falls to zero if a stale patch is the only fault, s.
        fade: f64,
        /// Time between two ticks beyond which the force ramps to zero, s.
        late_after: f64,
        /// Time of equal readings beyond which a device counts as stalled, s.
        stall_after: f64,
        /// Speed beyond which a change of position counts as a jump, m/s.
        max_speed: f64,
        /// Time in which the force falls to zero after a fault, s.
        ramp_down: f64,
        /// Time in which the force returns after a fault, s.
        ramp_up: f64,
        /// Energy budget, J.
        energy_budget: f64,
        /// Length of the energy observer's window, s.
        bank_time: f64,
        /// Step of the position sensor, m.
        resolution: f64,
        /// Damping that is always rendered in contact, N s/m.
        damping: f64,
    }
}

impl From<&ServoParams> for ServoRecord {
    fn from(p: &ServoParams) -> Self {
        // Destructured field by field, so that a new setting of the law cannot be left out of the
        // record.
        let ServoParams {
            period,
            tolerance,
            max_sweeps,
            passes,
            transfer_periods,
            max_transfer,
            stale_periods,
            stale_after,
            fade,
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
            fade,
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
            fade: r.fade,
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
