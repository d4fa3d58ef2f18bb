//! Checks the readings of a device, so that NaN, jumps and silence go no further.

use crate::velocity::VelocityEstimate;
use crate::{DeviceState, Faults, Pose, ServoParams, Vec3};

/// A hand-piece after the check; all its values are finite.
#[derive(Debug, Clone, Copy)]
pub(crate) struct HandPiece {
    pub(crate) pose: Pose,
    /// Estimated velocity, m/s.
    pub(crate) velocity: Vec3,
    /// Motion since the previous tick, m; zero after a jump or a loss, because the hand did not
    /// make that motion.
    pub(crate) travel: Vec3,
    /// Rotation since the previous tick, rad; zero where `travel` is.
    pub(crate) turn: Vec3,
    /// Loop's clock when the reading last changed, and the device's time of that reading, s.
    changed_at: f64,
    read_at: f64,
    is_known: bool,
    estimate: VelocityEstimate,
}

impl HandPiece {
    pub(crate) const fn new(at: Pose) -> Self {
        Self {
            pose: at,
            velocity: Vec3::new(0.0, 0.0, 0.0),
            travel: Vec3::new(0.0, 0.0, 0.0),
            turn: Vec3::new(0.0, 0.0, 0.0),
            changed_at: 0.0,
            read_at: f64::NAN,
            is_known: false,
            estimate: VelocityEstimate::new(),
        }
    }

    pub(crate) fn update(
        &mut self,
        now: f64,
        dt: f64,
        state: Option<&DeviceState>,
        params: &ServoParams,
    ) -> Faults {
        self.travel = Vec3::zeros();
        self.turn = Vec3::zeros();
        // While the loop itself was away, no reading could be new.
        self.changed_at += (dt - 2.0 * params.period).max(0.0);
        let Some(state) = state else {
            return self.lost(Faults::DEVICE_LOST);
        };
        let at = state.pose.translation.vector;
        let turn = state.pose.rotation.coords;
        let is_pose =
            at.iter().all(|x| x.abs() < MAX_POSITION) && (turn.norm_squared() - 1.0).abs() < 1e-3;
        if !is_pose || !state.time.is_finite() {
            return self.lost(Faults::BAD_READING);
        }
        let mut faults = Faults::NONE;
        let rotation = nalgebra::UnitQuaternion::new_normalize(*state.pose.rotation);
        if self.is_known {
            self.travel = at - self.pose.translation.vector;
            // Scaled with `dt`, so that a fast hand does not count as a jump when a tick or two
            // were missed.
            if self.travel.norm() > params.max_speed * dt.max(params.period) {
                faults |= Faults::DEVICE_JUMPED;
                self.travel = Vec3::zeros();
                self.estimate.clear();
            } else {
                // Twice the imaginary part: the rotation is small.
                let by = rotation * self.pose.rotation.inverse();
                self.turn = by.imag() * libm::copysign(2.0, by.w);
            }
        }
        if !self.is_known || state.time.to_bits() != self.read_at.to_bits() {
            self.read_at = state.time;
            self.changed_at = now;
        } else if now - self.changed_at > params.stall_after {
            faults |= Faults::DEVICE_STALLED;
        }
        self.pose = state.pose;
        self.pose.rotation = rotation;
        self.is_known = true;
        self.velocity = self.estimate.update(now, &at, params.resolution);
        if !self.velocity.iter().all(|v| v.abs() < MAX_POSITION) {
            self.velocity = Vec3::zeros();
        }
        faults
    }

    fn lost(&mut self, fault: Faults) -> Faults {
        // The distance to the place where the device returns is neither a jump nor work of the
        // hand.
        self.is_known = false;
        self.velocity = Vec3::zeros();
        self.estimate.clear();
        fault
    }
}

/// Largest plausible distance of a hand from the origin, m; larger readings are not positions.
const MAX_POSITION: f64 = 1e3;
