//! The poses of the tools, and the limits of their movement in a step.

use palpa_mesh::Vec3;

use super::Live;
use crate::posed_tool::PosedTool;

/// Distance of a pressed vertex from the zone's centre, as a share of the radius, at which tools
/// are not followed any farther in that direction.
const EDGE: f64 = 0.95;
/// Times over which the hands' velocity is smoothed, s. How it differs between them tells how it changes.
const SMOOTHED: [f64; 2] = [15e-3, 45e-3];
/// Hands soon stop to gain speed: the time after which they are taken to go on evenly, s.
const GAINING: f64 = 60e-3;
/// The largest way that is added for that, as a share of the way at the present speed.
const MOST_GAIN: f64 = 1.0;
/// Longest move of a tool that presses, m. After a step that took long the tools are far ahead; several
/// steps catch up with them sooner than one that goes so far that its iterations do not converge.
const LONGEST_PRESSED: f64 = 1.2e-3;

/// The tools on the way to their targets.
#[derive(Debug)]
pub(super) struct Course {
    /// The tools at the poses that the body has followed them to.
    pub(super) tools: Vec<PosedTool>,
    /// How fast the targets move.
    pub(super) pace: Pace,
    /// Least gap between tools and the zone's skin, m; 0 if unknown.
    pub(super) clearance: f64,
}

impl Course {
    pub(super) fn new(tools: &[PosedTool]) -> Self {
        Self {
            tools: tools.to_vec(),
            pace: Pace::default(),
            clearance: 0.0,
        }
    }

    /// Moves the tools towards their targets, each by at most `most`, m, and not in the direction
    /// `held`, in a step of `dt`, s. Returns whether any tool stays short of its target.
    fn advance(&mut self, targets: &[PosedTool], held: Option<Vec3>, most: f64, dt: f64) -> bool {
        debug_assert_eq!(self.tools.len(), targets.len());
        let mut is_short = false;
        self.pace.go_on(targets, dt);
        for (tool, target) in self.tools.iter_mut().zip(targets) {
            let mut target = *target;
            let way = target.pose.translation.vector - tool.pose.translation.vector;
            let outward = held.map_or(0.0, |outward| outward.dot(&way));
            if let (Some(direction), true) = (held, outward > 0.0) {
                is_short = true;
                target.pose.translation.vector -= direction * outward;
            }
            let way = (target.pose.translation.vector - tool.pose.translation.vector).norm();
            let pose = if way <= most {
                target.pose
            } else {
                is_short = true;
                tool.pose.lerp_slerp(&target.pose, most / way)
            };
            *tool = PosedTool {
                tool: target.tool,
                pose,
            };
        }
        is_short
    }
}

/// How fast the hands move the targets of the tools.
#[derive(Debug, Clone, Default)]
pub(super) struct Pace {
    /// Mean place of the targets, m; `None` before the first.
    place: Option<Vec3>,
    /// Time of the targets' poses, s, and that of the next ones, if they are known.
    at: Option<f64>,
    next: Option<f64>,
    /// Way of the targets, m, and the time that it took, s, each smoothed over these times.
    gone: [(Vec3, f64); 2],
}

impl Pace {
    pub(super) fn go_on(&mut self, targets: &[PosedTool], dt: f64) {
        let n = targets.len() as f64;
        let sum: Vec3 = targets.iter().map(|t| t.pose.translation.vector).sum();
        let place = (n > 0.0).then(|| sum / n);
        let (before, at) = (self.place, self.at);
        (self.place, self.at) = (place, self.next.take());
        let took = self.at.zip(at).map_or(dt, |(now, before)| now - before);
        if let (Some(before), Some(now), true) = (before, place, took.is_finite()) {
            // Way and time, and not their ratio: poses are taken at uneven times, and look ahead by uneven times.
            for ((way, time), smoothed) in self.gone.iter_mut().zip(SMOOTHED) {
                let kept = (-dt / smoothed).exp();
                *way = *way * kept + (now - before);
                *time = *time * kept + took;
            }
        }
    }

    /// Velocities over the shorter and the longer time, m/s.
    fn velocities(&self) -> [Vec3; 2] {
        [0, 1].map(|k| {
            let (way, time) = self.gone[k];
            way / time.max(0.5 * SMOOTHED[k])
        })
    }

    /// Velocity, m/s.
    pub(super) fn velocity(&self) -> Vec3 {
        self.velocities()[0]
    }

    /// The way of the targets in a time, s, if the hands go on as they do, m.
    pub(super) fn way_in(&self, time: f64) -> Vec3 {
        let [fast, slow] = self.velocities();
        let change = (fast - slow) / (SMOOTHED[1] - SMOOTHED[0]);
        let velocity = fast + change * SMOOTHED[0];
        let along = change.dot(&velocity);
        if along < 0.0 {
            // They slow down, and come to a stop at most.
            let slows = -along / velocity.norm_squared();
            let time = time.min(1.0 / slows);
            return velocity * (time - 0.5 * slows * time * time);
        }
        let gaining = time.min(GAINING);
        let (even, more) = (
            fast * time,
            change * (gaining * (time - 0.5 * gaining) + SMOOTHED[0] * time),
        );
        let most = MOST_GAIN * even.norm();
        even + more * (most / more.norm().max(f64::MIN_POSITIVE)).min(1.0)
    }
}

impl Live {
    /// The time of the poses of the next step, s, by any clock. Without it, they are as much later than
    /// those of the last step as the step itself.
    pub fn set_time_of_poses(&mut self, time: f64) {
        self.course.pace.next = Some(time);
    }

    /// Moves the tools within the limits of one step of `dt`, s. Returns whether any tool stays short
    /// of its target.
    pub(super) fn move_tools(&mut self, targets: &[PosedTool], dt: f64) -> bool {
        let held = self.held_direction();
        let is_pressed = self.problem.pressing().next().is_some();
        let longest = if is_pressed {
            self.params.longest_move.min(LONGEST_PRESSED)
        } else {
            self.params.longest_move
        };
        let most = (longest * self.recovery.pace).max(self.course.clearance);
        self.course.advance(targets, held, most, dt)
    }

    /// The direction along the skin in which tools are not followed, because pressed vertices have
    /// reached the edge of the zone, beyond which there are no candidates. `None` if there is room.
    fn held_direction(&self) -> Option<Vec3> {
        if self.plan.exterior.is_empty() || self.radius_inside() < EDGE * self.plan.radius {
            return None;
        }
        // The tool that has gone farthest out.
        let outs = (0..self.course.tools.len()).filter_map(|tool| {
            let pressed = self.pressed_by(tool)?;
            let out = pressed.middle - self.plan.centres.of(tool);
            Some(out - pressed.along * pressed.along.dot(&out))
        });
        let out = outs.max_by(|a, b| a.norm().total_cmp(&b.norm()))?;
        out.try_normalize(1e-9)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::{Pose, Sphere, Tool};

    /// The pace after steps at these times, s, each with poses that are so much later, s, of a hand that goes along x
    /// as told.
    fn pace(steps: &[[f64; 2]], x: impl Fn(f64) -> f64) -> Pace {
        let tool = Tool::new(Sphere::new(8e-3).unwrap(), 0.0).unwrap();
        let (mut pace, mut last) = (Pace::default(), 0.0);
        for &[time, lead] in steps {
            let pose = Pose::translation(x(time + lead), 0.0, 0.0);
            pace.next = Some(time + lead);
            pace.go_on(&[PosedTool { tool, pose }], time - last);
            last = time;
        }
        pace
    }

    fn even(n: u32, dt: f64) -> Vec<[f64; 2]> {
        (0..n).map(|k| [f64::from(k) * dt, 0.0]).collect()
    }

    #[test]
    fn a_look_ahead_that_becomes_shorter_is_no_hand_that_stands_still() {
        const SPEED: f64 = 50e-3;
        // Long steps that look 24 ms ahead, then short ones that look ahead ever less.
        let long = (0..10).map(|k| [12e-3 * f64::from(k), 24e-3]);
        let short = (1..=12).map(|k| [0.108 + 2e-3 * f64::from(k), 24e-3 - 1e-3 * f64::from(k)]);
        let steps: Vec<[f64; 2]> = long.chain(short).collect();
        let pace = pace(&steps, |time| SPEED * time);
        assert!((pace.velocity().x / SPEED - 1.0).abs() < 1e-9);
        assert!((pace.way_in(0.1).x / (0.1 * SPEED) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn hands_that_gain_speed_are_met_farther_ahead_and_those_that_slow_down_where_they_stop() {
        const GAIN: f64 = 0.5;
        const TIME: f64 = 0.1;
        let gaining = pace(&even(35, 2e-3), |time| {
            0.5 * GAIN * (time - 0.02).max(0.0).powi(2)
        });
        let speed = GAIN * 0.048;
        let far = gaining.way_in(TIME).x;
        assert!(
            far > 1.05 * speed * TIME && far < speed * TIME + 0.5 * GAIN * TIME * TIME,
            "{far}"
        );
        // It stops 0.1 s after the last step, having gone 2.5 mm more.
        let whole = 0.4;
        let slowing = pace(&even(151, 2e-3), |time| GAIN * time * (whole - 0.5 * time));
        let far = slowing.way_in(1.0).x;
        assert!(far > 1.8e-3 && far < 3.2e-3, "{far}");
        let stands = pace(&even(400, 2e-3), |time| {
            GAIN * time.min(whole) * (whole - 0.5 * time.min(whole))
        });
        assert!(stands.way_in(1.0).norm() < 1e-6);
    }
}
