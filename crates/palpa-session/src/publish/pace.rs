//! When a frame is due: each time while something moves, and seldom at rest, because pages and server would
//! work for pictures that all look the same.

use palpa_viewer::wire::FrameSnapshot;

/// Changes too small to be seen: m, N, and of the components of a unit quaternion.
const UNSEEN_LENGTH: f64 = 5e-6;
const UNSEEN_FORCE: f64 = 4e-3;
const UNSEEN_TURN: f64 = 3e-4;
/// Time without a visible change after which all is at rest, s: tissue that was released takes a while to come
/// back.
const STILL_AFTER: f64 = 1.0;
/// Time between two frames at rest, s.
const REST_PERIOD: f64 = 0.5;
/// Share of a core that frames of a moving body may take, and the longest time between two, s: the displacements of a
/// body of 10,000 nodes cost some milliseconds, which the tissue needs more.
const MOST_LOAD: f64 = 0.12;
const LONGEST_PERIOD: f64 = 0.05;
/// Weight of the last frame in the mean cost.
const NEWEST: f64 = 0.2;

/// The part of a frame that shows whether something moves, without the nodes.
#[derive(Debug, Clone, Copy, Default)]
struct Sight {
    /// Kind and mesh of the frame, and the flags of its tick.
    flags: [u32; 5],
    /// Time of a replay, s.
    time: f64,
    gain: f64,
    device: [f64; 3],
    tool: [f64; 3],
    orientation: [f64; 4],
    force: [f64; 3],
}

impl Sight {
    fn of(frame: &FrameSnapshot) -> Self {
        let is_replay = frame.is_replay;
        Self {
            flags: [
                is_replay,
                frame.mesh,
                frame.step_status,
                frame.faults,
                frame.limits,
            ],
            time: if is_replay == 0 { 0.0 } else { frame.time },
            gain: frame.gain,
            device: frame.device,
            tool: frame.tool,
            orientation: frame.orientation,
            force: frame.force,
        }
    }

    fn looks_as(&self, other: &Self) -> bool {
        self.flags == other.flags
            && self.time.to_bits() == other.time.to_bits()
            && (self.gain - other.gain).abs() < UNSEEN_FORCE
            && near(&self.device, &other.device, UNSEEN_LENGTH)
            && near(&self.tool, &other.tool, UNSEEN_LENGTH)
            && near(&self.orientation, &other.orientation, UNSEEN_TURN)
            && near(&self.force, &other.force, UNSEEN_FORCE)
    }
}

fn near<const N: usize>(a: &[f64; N], b: &[f64; N], tolerance: f64) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance)
}

/// The pace of frames.
#[derive(Debug, Default)]
pub(super) struct Pace {
    /// At the last visible change.
    changed: Sight,
    /// Time since then, s.
    still_for: f64,
    /// Time since the last frame that was due, s.
    undue_for: f64,
    /// Mean CPU time of a frame, s.
    cost: f64,
}

impl Pace {
    /// A frame has cost this CPU time, s.
    pub(super) fn spend(&mut self, cost: f64) {
        self.cost += NEWEST * (cost - self.cost);
    }

    /// Something has changed that a tick does not show.
    pub(super) fn wake(&mut self) {
        self.still_for = 0.0;
    }

    /// Whether this frame is due, `dt` seconds after the last one that was asked about.
    pub(super) fn is_due(&mut self, frame: &FrameSnapshot, dt: f64) -> bool {
        let sight = Sight::of(frame);
        if sight.looks_as(&self.changed) {
            self.still_for += dt;
        } else {
            self.still_for = 0.0;
            self.changed = sight;
        }
        self.undue_for += dt;
        let period = (self.cost / MOST_LOAD).min(LONGEST_PERIOD);
        // To the nearest call.
        let is_affordable = self.undue_for + 0.5 * dt >= period;
        let is_due = if self.still_for < STILL_AFTER {
            is_affordable
        } else {
            self.undue_for >= REST_PERIOD
        };
        if is_due {
            self.undue_for = 0.0;
        }
        is_due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 1.0 / 60.0;

    fn due_in(pace: &mut Pace, frame: &FrameSnapshot, seconds: f64) -> usize {
        let n = (seconds / DT).round() as usize;
        (0..n).filter(|_| pace.is_due(frame, DT)).count()
    }

    #[test]
    fn frames_come_twice_a_second_at_rest_and_each_time_while_something_moves() {
        let mut pace = Pace::default();
        let mut frame = FrameSnapshot::default();
        frame.force[2] = 1.0;
        assert_eq!(due_in(&mut pace, &frame, 1.0), 60);
        assert!((19..=22).contains(&due_in(&mut pace, &frame, 10.0)));
        // Creep that no step of which is visible is seen as a whole.
        for k in 0..600 {
            frame.force[2] += 1e-4;
            assert!(k < 60 || pace.is_due(&frame, DT), "{k}");
        }
        due_in(&mut pace, &frame, 3.0);
        pace.wake();
        assert_eq!(due_in(&mut pace, &frame, 0.5), 30);
    }

    #[test]
    fn frames_that_cost_much_come_less_often_but_at_once_after_rest() {
        let mut pace = Pace::default();
        let mut frame = FrameSnapshot::default();
        for (cost, least, most) in [(1e-3, 60, 60), (4e-3, 28, 32), (0.1, 20, 20)] {
            for _ in 0..50 {
                pace.spend(cost);
            }
            pace.wake();
            let n = due_in(&mut pace, &frame, 0.9);
            assert!(
                (least * 9 / 10..=most * 9 / 10 + 1).contains(&n),
                "{cost}: {n}"
            );
        }
        due_in(&mut pace, &frame, 1.2);
        while pace.is_due(&frame, DT) {}
        for _ in 0..4 {
            pace.is_due(&frame, DT);
        }
        frame.force[2] = 1.0;
        assert!(pace.is_due(&frame, DT));
    }

    #[test]
    fn a_replay_that_plays_is_not_at_rest_and_one_that_stands_still_is() {
        let mut pace = Pace::default();
        let mut frame = FrameSnapshot {
            is_replay: 1,
            ..FrameSnapshot::default()
        };
        for _ in 0..180 {
            frame.time += DT;
            assert!(pace.is_due(&frame, DT));
        }
        due_in(&mut pace, &frame, 1.0);
        assert!(due_in(&mut pace, &frame, 2.0) <= 5);
    }
}
