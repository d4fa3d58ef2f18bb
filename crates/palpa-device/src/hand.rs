//! The simulated hand: its grip, the point to which it pulls, and how it follows a target that
//! jumps.

use crate::Path;
use nalgebra::UnitQuaternion;
use palpa_servo::{Pose, Vec3};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Time in which the hand follows a live target, s. The hand moves like a critically damped mass,
/// because a live target jumps from one mouse event to the next.
const FOLLOW_TIME: f64 = 0.02;
/// Largest speed at which the hand follows a live target, m/s.
const FOLLOW_SPEED: f64 = 1.0;

/// How firmly a hand grips the device.
///
/// The stiffness, 200 to 800 N/m, was measured by Hajian & Howe (1997, J. Biomech. Eng. 119:109) at
/// the fingertip from slight to strong activation. Their damping ratio falls from well damped to
/// about one half. The masses are assumed: they stand for the part of the hand that moves with the
/// device.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grip {
    /// Mass that moves with the device, kg.
    pub mass: f64,
    /// Damping of the spring that pulls the device to the path, N s/m.
    pub damping: f64,
    /// Stiffness of the spring that pulls the device to the path, N/m.
    pub stiffness: f64,
}

impl Grip {
    /// A light grip.
    pub const SOFT: Self = Self {
        mass: 0.03,
        damping: 3.0,
        stiffness: 200.0,
    };
    /// The grip on a pen.
    pub const MEDIUM: Self = Self {
        mass: 0.06,
        damping: 5.0,
        stiffness: 400.0,
    };
    /// A firm grip.
    pub const STIFF: Self = Self {
        mass: 0.1,
        damping: 9.0,
        stiffness: 800.0,
    };
}

/// Target pose of a live hand. Any thread may set it without waiting. Clones share the pose.
///
/// The seven numbers are stored one after the other, so a reader may see some old and some new
/// ones. The hand goes to the pose smoothly, so this does not matter.
#[derive(Debug, Clone)]
pub struct LiveTarget(Arc<[AtomicU64; 7]>);

impl LiveTarget {
    /// A target at a point, m, with the identity orientation.
    pub fn new(at: Vec3) -> Self {
        let target = Self(Arc::new([0.0_f64; 7].map(|x| AtomicU64::new(x.to_bits()))));
        target.set_pose(&Pose::translation(at.x, at.y, at.z));
        target
    }

    /// Moves the target to a point, m, and keeps its orientation. A point that is not finite is
    /// ignored.
    pub fn set(&self, at: Vec3) {
        if at.iter().all(|x| x.is_finite()) {
            self.store(0, at.as_slice());
        }
    }

    /// Moves and turns the target. A position or orientation that is not finite is ignored.
    pub fn set_pose(&self, pose: &Pose) {
        let turn = pose.rotation.coords;
        if turn.iter().all(|x| x.is_finite()) {
            self.store(3, turn.as_slice());
        }
        self.set(pose.translation.vector);
    }

    /// Its position, m.
    pub fn get(&self) -> Vec3 {
        Vec3::from_fn(|i, _| self.load(i))
    }

    /// Its orientation.
    pub fn turn(&self) -> UnitQuaternion<f64> {
        let coords = nalgebra::Vector4::from_fn(|i, _| self.load(3 + i));
        UnitQuaternion::try_new(coords.into(), 0.1).unwrap_or_default()
    }

    fn store(&self, first: usize, values: &[f64]) {
        for (cell, x) in self.0[first..].iter().zip(values) {
            cell.store(x.to_bits(), Ordering::Relaxed);
        }
    }

    fn load(&self, i: usize) -> f64 {
        f64::from_bits(self.0[i].load(Ordering::Relaxed))
    }
}

/// The motion that a simulated hand follows.
#[derive(Debug, Clone)]
pub enum HandTarget {
    /// A path that starts at the first reading, with the identity orientation.
    Path(Path),
    /// A pose that the program sets while the hand moves.
    Live(LiveTarget),
}

impl From<Path> for HandTarget {
    fn from(path: Path) -> Self {
        Self::Path(path)
    }
}

impl From<LiveTarget> for HandTarget {
    fn from(target: LiveTarget) -> Self {
        Self::Live(target)
    }
}

/// A hand with its grip, and the point that it has reached on the way to its target.
#[derive(Debug, Clone)]
pub(crate) struct Hand {
    pub(crate) grip: Grip,
    target: HandTarget,
    /// Point to which the grip pulls the device, m.
    pub(crate) wanted: Vec3,
    /// Velocity of that point while it follows a live target, m/s; zero on a path.
    following: Vec3,
    pub(crate) turned: UnitQuaternion<f64>,
}

/// Motion over one step of the point to which the grip pulls.
pub(crate) struct Pull {
    /// Mean position, m.
    pub(crate) middle: Vec3,
    /// Velocity, m/s.
    pub(crate) velocity: Vec3,
}

impl Hand {
    pub(crate) fn new(grip: Grip, target: HandTarget) -> Self {
        let (wanted, turned) = match &target {
            HandTarget::Path(path) => (path.at(0.0), UnitQuaternion::identity()),
            HandTarget::Live(target) => (target.get(), target.turn()),
        };
        Self {
            grip,
            target,
            wanted,
            following: Vec3::zeros(),
            turned,
        }
    }

    /// Advances by a step of `dt`, s, to the moment `time`, in s since the first reading.
    pub(crate) fn advance(&mut self, time: f64, dt: f64) -> Pull {
        let next = match &self.target {
            HandTarget::Path(path) => path.at(time),
            HandTarget::Live(target) => {
                let pull = (target.get() - self.wanted) / FOLLOW_TIME - self.following * 2.0;
                let velocity = self.following + pull * (dt / FOLLOW_TIME);
                self.following = velocity.cap_magnitude(FOLLOW_SPEED);
                let share = dt / FOLLOW_TIME;
                self.turned = self
                    .turned
                    .try_slerp(&target.turn(), share, 1e-9)
                    .unwrap_or(self.turned);
                self.wanted + self.following * dt
            }
        };
        let pull = Pull {
            middle: (self.wanted + next) * 0.5,
            velocity: (next - self.wanted) / dt,
        };
        self.wanted = next;
        pull
    }
}
