//! The movement of the tool over time.

use palpa_scene::Press;
use serde::Serialize;

/// The phases of an indentation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// The tool goes down.
    Load,
    /// The tool rests at its depth.
    Hold,
    /// The tool comes back.
    Retract,
}

/// The tool's depth at one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Waypoint {
    /// Phase of the indentation.
    pub phase: Phase,
    /// Number of cycles completed before.
    pub cycle: u32,
    /// Time since the start, s.
    pub time: f64,
    /// Depth of the tool, m.
    pub depth: f64,
}

/// Number of equal steps down; none is larger than the scene asks for.
pub fn n_steps(press: &Press) -> usize {
    (press.depth / press.step - 1e-9).ceil().max(1.0) as usize
}

/// The waypoints of a press: equal steps down at `speed` (m/s), a rest sampled at these shares of
/// its duration, and back; repeated for each cycle.
pub fn waypoints(press: &Press, speed: f64, rests: &[f64]) -> Vec<Waypoint> {
    let n = n_steps(press);
    let depth_at = |i: usize| press.depth * i as f64 / n as f64;
    let down = press.depth / speed;
    let mut path = Vec::new();
    for cycle in 0..press.cycles {
        let start = f64::from(cycle) * (2.0 * down + press.hold);
        let mut push = |phase, time, depth| {
            path.push(Waypoint {
                phase,
                cycle,
                time: start + time,
                depth,
            });
        };
        // The last waypoint of a cycle is the first of the next.
        for i in usize::from(cycle > 0)..=n {
            push(Phase::Load, depth_at(i) / speed, depth_at(i));
        }
        if press.hold > 0.0 {
            for share in rests {
                push(Phase::Hold, down + press.hold * share, press.depth);
            }
        }
        if press.retract {
            for i in (0..n).rev() {
                let back = (press.depth - depth_at(i)) / speed;
                push(Phase::Retract, down + press.hold + back, depth_at(i));
            }
        }
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cycles_join_and_time_goes_on() {
        let mut press = palpa_scene::Scene::embedded().press;
        (press.depth, press.step, press.hold) = (3e-3, 0.7e-3, 0.5);
        press.cycles = 2;
        let path = waypoints(&press, 0.01, &[0.1, 1.0]);
        // Five steps, none larger than asked for: 6 + 2 + 5 samples, then one less.
        assert_eq!(path.len(), 13 + 12);
        assert!(path.windows(2).all(|w| w[1].time > w[0].time));
        assert!(
            path.windows(2)
                .all(|w| (w[1].depth - w[0].depth).abs() < 0.7e-3)
        );
        let last = path.last().unwrap();
        assert_eq!(
            (last.phase, last.cycle, last.depth),
            (Phase::Retract, 1, 0.0)
        );
        assert!((last.time - 2.0 * (0.6 + 0.5)).abs() < 1e-12);
    }
}
