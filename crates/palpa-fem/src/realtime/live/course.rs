//! The poses of the tools, and the limits of their movement in a step.

use palpa_mesh::Vec3;

use super::Live;
use crate::posed_tool::PosedTool;

/// Distance of a pressed vertex from the zone's centre, as a share of the radius, at which tools
/// are not followed any farther in that direction.
const EDGE: f64 = 0.95;
/// Time over which the tools' velocity is smoothed, s.
const SMOOTHED: f64 = 5e-3;
/// Longest move of a tool that presses, m. After a step that took long the tools are far ahead; several
/// steps catch up with them sooner than one that goes so far that its iterations do not converge.
const LONGEST_PRESSED: f64 = 1.2e-3;

/// The tools on the way to their targets.
#[derive(Debug)]
pub(super) struct Course {
    /// The tools at the poses that the body has followed them to.
    pub(super) tools: Vec<PosedTool>,
    /// Smoothed velocity of the tools, m/s.
    pub(super) velocity: Vec3,
    /// Least gap between tools and the zone's skin, m; 0 if unknown.
    pub(super) clearance: f64,
}

impl Course {
    pub(super) fn new(tools: &[PosedTool]) -> Self {
        Self {
            tools: tools.to_vec(),
            velocity: Vec3::zeros(),
            clearance: 0.0,
        }
    }

    /// Moves the tools towards their targets, each by at most `most`, m, and not in the direction
    /// `held`, in a step of `dt`, s. Returns whether any tool stays short of its target.
    fn advance(&mut self, targets: &[PosedTool], held: Option<Vec3>, most: f64, dt: f64) -> bool {
        debug_assert_eq!(self.tools.len(), targets.len());
        let mut is_short = false;
        let before: Vec3 = self.tools.iter().map(|t| t.pose.translation.vector).sum();
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
        let after: Vec3 = self.tools.iter().map(|t| t.pose.translation.vector).sum();
        let way = (after - before) / self.tools.len().max(1) as f64;
        if dt > 0.0 {
            self.velocity += (way / dt - self.velocity) * -(-dt / SMOOTHED).exp_m1();
        }
        is_short
    }
}

impl Live {
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
