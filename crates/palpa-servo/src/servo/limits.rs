//! The limits of the device: size and slew rate of the commanded force and moment.

use crate::{DeviceSpec, ForceCommand, Limits, Vec3};

/// Decaying forces below this are set to zero, N; far below the resolution of any device.
const FORCE_DUST: f64 = 1e-6;

/// Limits used where there is no device.
pub(super) const NO_DEVICE: DeviceSpec = DeviceSpec {
    max_force: 0.0,
    max_torque: 0.0,
    max_slew: 0.0,
    max_stiffness: 0.0,
    max_damping: 0.0,
};

/// The limits, with every value that is not a positive number set to zero.
pub(super) fn checked_spec(spec: &DeviceSpec) -> DeviceSpec {
    let positive = |x: f64| if x > 0.0 && x < 1e9 { x } else { 0.0 };
    DeviceSpec {
        max_force: positive(spec.max_force),
        max_torque: positive(spec.max_torque),
        max_slew: positive(spec.max_slew),
        max_stiffness: positive(spec.max_stiffness),
        max_damping: positive(spec.max_damping),
    }
}

/// The command nearest to `wanted` that the device allows `dt` seconds after `last`, and the limits
/// that were met.
pub(super) fn limited(
    wanted: &ForceCommand,
    last: &ForceCommand,
    spec: &DeviceSpec,
    dt: f64,
) -> (ForceCommand, Limits) {
    let mut limits = Limits::NONE;
    let force = shortened(&wanted.force, spec.max_force);
    let torque = shortened(&wanted.torque, spec.max_torque);
    if force != wanted.force {
        limits |= Limits::FORCE;
    }
    // A device without moments drops the moment; this does not count as a limit.
    if torque != wanted.torque && spec.max_torque > 0.0 {
        limits |= Limits::TORQUE;
    }
    let slew = spec.max_slew * dt;
    let turn = if spec.max_force > 0.0 {
        slew * spec.max_torque / spec.max_force
    } else {
        0.0
    };
    let by = force - last.force;
    let by_slewed = shortened(&by, slew);
    if by != by_slewed {
        limits |= Limits::SLEW;
    }
    let by_torque = shortened(&(torque - last.torque), turn);
    let next = ForceCommand {
        force: without_dust(last.force + by_slewed),
        torque: without_dust(last.torque + by_torque),
    };
    // The step between two forces within the limits stays within them. This second check catches
    // rounding and programming errors.
    let command = ForceCommand {
        force: shortened(&next.force, spec.max_force),
        torque: shortened(&next.torque, spec.max_torque),
    };
    (command, limits)
}

/// The part of a force that pulls against the direction in which skin pushes; zero if it pushes.
pub(super) fn pull_of(force: &Vec3, outward: &Vec3) -> Vec3 {
    outward * force.dot(outward).min(0.0)
}

/// The vector, shortened to `length` if it is longer; zero if it is not finite.
pub(super) fn shortened(v: &Vec3, length: f64) -> Vec3 {
    let norm = v.norm();
    if norm <= length {
        *v
    } else if norm.is_finite() {
        v * (length / norm)
    } else {
        Vec3::zeros()
    }
}

/// The vector, or zero if all its entries are below [`FORCE_DUST`].
pub(super) fn without_dust(v: Vec3) -> Vec3 {
    if v.amax() < FORCE_DUST {
        Vec3::zeros()
    } else {
        v
    }
}
