//! Which skin vertices touch which tool, and what the tool demands of them.
//!
//! Contact is a complementarity problem, solved as one: a vertex either has a gap and no traction, or no gap and a
//! traction that presses, `0 ≤ g ⟂ λ ≥ 0`; with friction its tangential traction lies in Coulomb's cone, `|t| ≤ μ λ`, and
//! opposes its slip where it reaches the border. Newton's method and the choice of the active vertices go together
//! (a primal–dual active set): those with a gap below zero are held on the tool's surface, those that would be pulled are
//! let go, and so on until nothing changes.

use palpa_mesh::Vec3;

use crate::Mat3;
use crate::model::Model;
use crate::shape::{Pose, Tool};
use crate::state::Touch;
use crate::system::Hold;

/// A tool and where it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PosedTool {
    /// Its shape and friction.
    pub tool: Tool,
    /// From the tool's frame to the body's.
    pub pose: Pose,
}

/// A slip below this (m) has no direction of its own.
const LEAST_SLIP: f64 = 1e-10;

/// A vertex at the current positions.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contact {
    pub(crate) node: usize,
    pub(crate) vertex: usize,
    pub(crate) friction: f64,
    pub(crate) touch: Touch,
    /// m, negative inside the tool.
    pub(crate) gap: f64,
    /// From the tool to the tissue.
    pub(crate) normal: Vec3,
    curvature: Mat3,
    /// Where the anchor is now, from the vertex, m.
    to_anchor: Vec3,
}

/// Contacts of all tools at the current positions.
#[derive(Debug, Default)]
pub(crate) struct Contacts {
    pub(crate) active: Vec<Contact>,
}

/// How far a state is from obeying the laws of contact.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct ContactResiduals {
    /// Deepest penetration or largest gap of an active vertex, m.
    pub gap: f64,
    /// Deepest penetration of a vertex that should be open, m.
    pub penetration: f64,
    /// Largest pull at an active vertex, N.
    pub tension: f64,
    /// Largest tangential force beyond the friction cone, N.
    pub cone: f64,
    /// Largest part of a friction force at the cone's border that does not oppose the slip, as a share of it.
    pub slip: f64,
}

impl Contacts {
    /// Finds gaps, normals and anchors of the vertices that touch now, and takes up those that have come to touch.
    ///
    /// `touches` is the state; vertices that are held otherwise (`supports` in all directions) cannot touch.
    /// `take_up` is off once the active set has to settle.
    pub(crate) fn update(
        &mut self,
        model: &Model,
        displacements: &[Vec3],
        tools: &[PosedTool],
        held: &[Hold],
        touches: &mut [Touch],
        tolerance: f64,
    ) -> (usize, f64) {
        self.active.clear();
        let (mut n_new, mut deepest) = (0, 0.0_f64);
        for (vertex, touch) in touches.iter_mut().enumerate() {
            let node = model.body.node(vertex, 0);
            if tools.is_empty() || held[node].n == 3 {
                continue;
            }
            let x = model.body.positions[node] + displacements[node];
            let k = touch.tool().or_else(|| {
                let depth = |k: usize| tools[k].tool.distance_at(&tools[k].pose, &x).distance;
                (0..tools.len())
                    .filter(|&k| depth(k) < -tolerance)
                    .min_by(|&a, &b| depth(a).total_cmp(&depth(b)))
            });
            let Some(k) = k else { continue };
            let PosedTool { tool, pose } = &tools[k];
            let distance = tool.distance_at(pose, &x);
            let surface = x - distance.normal * distance.distance;
            if *touch == Touch::Open {
                n_new += 1;
                deepest = deepest.max(-distance.distance);
                let anchor = pose.inverse_transform_point(&surface.into()).coords;
                let tool = k as u32;
                *touch = if tools[k].tool.friction() > 0.0 {
                    Touch::Stick { tool, anchor }
                } else {
                    Touch::Slip { tool, anchor }
                };
            }
            let to_anchor = match *touch {
                Touch::Stick { anchor, .. } | Touch::Slip { anchor, .. } => {
                    pose.transform_point(&anchor.into()).coords - x
                }
                Touch::Open => Vec3::zeros(),
            };
            self.active.push(Contact {
                node,
                vertex,
                friction: tool.friction(),
                touch: *touch,
                gap: distance.distance,
                normal: distance.normal,
                curvature: distance.curvature,
                to_anchor,
            });
        }
        (n_new, deepest)
    }
}

impl Contact {
    /// What the tool demands: directions held, and the move along them.
    pub(crate) fn demand(&self, hold: Hold) -> (Hold, Vec3) {
        match self.touch {
            Touch::Stick { .. } => (Hold::all(), self.to_anchor),
            _ => (hold.and(&self.normal), -self.normal * self.gap),
        }
    }

    /// Pressing part of the tool's force on the vertex, which balances the body's force on it, N.
    pub(crate) fn pressure(&self, body_force: &Vec3) -> f64 {
        body_force.dot(&self.normal)
    }

    /// Largest curvature of the tool's surface here, 1/m.
    pub(crate) fn sharpness(&self) -> f64 {
        self.curvature.norm()
    }

    fn tangential(&self, v: &Vec3) -> Vec3 {
        v - self.normal * self.normal.dot(v)
    }

    /// Friction on a sliding vertex, N, and its stiffness (`−∂t/∂u`, positive semidefinite).
    pub(crate) fn friction(&self, body_force: &Vec3) -> (Vec3, Mat3) {
        let limit = self.friction * self.pressure(body_force).max(0.0);
        if limit == 0.0 {
            return (Vec3::zeros(), Mat3::zeros());
        }
        // From the vertex back to its anchor: against the slip.
        let back = self.tangential(&self.to_anchor);
        let slip = back.norm();
        if slip <= LEAST_SLIP {
            // It is about to slide: friction points where it has held until now.
            let tangential = self.tangential(body_force);
            let size = tangential.norm();
            let force = if size > 0.0 {
                tangential * (limit / size)
            } else {
                Vec3::zeros()
            };
            return (force, Mat3::zeros());
        }
        let direction = back / slip;
        let across = Mat3::identity()
            - self.normal * self.normal.transpose()
            - direction * direction.transpose();
        (direction * limit, across * (limit / slip))
    }

    /// Stiffness that the bending of the tool's surface adds at an active vertex: `−λ ∂n/∂x`.
    pub(crate) fn geometric(&self, body_force: &Vec3) -> Mat3 {
        match self.touch {
            Touch::Stick { .. } => Mat3::zeros(),
            _ => self.curvature * -self.pressure(body_force).max(0.0),
        }
    }

    /// The touch that the laws of contact ask for, given the body's force on the vertex. `least` is a force that counts
    /// as none.
    pub(crate) fn revised(&self, body_force: &Vec3, least: f64) -> Touch {
        let pressure = self.pressure(body_force);
        if pressure < -least {
            return Touch::Open;
        }
        let tangential = self.tangential(body_force);
        match self.touch {
            Touch::Stick { tool, anchor } => {
                // The cone's border belongs to sticking; a little beyond is rounding.
                if tangential.norm() > self.friction * pressure.max(0.0) * (1.0 + 1e-9) + least {
                    Touch::Slip { tool, anchor }
                } else {
                    self.touch
                }
            }
            Touch::Slip { tool, anchor } if self.friction > 0.0 => {
                // Friction that would push it on has turned it round: it sticks.
                let back = self.tangential(&self.to_anchor);
                if back.norm() > LEAST_SLIP && back.dot(&tangential) < 0.0 {
                    Touch::Stick { tool, anchor }
                } else {
                    self.touch
                }
            }
            touch => touch,
        }
    }

    /// Adds this vertex to the residuals.
    pub(crate) fn measure(&self, body_force: &Vec3, residuals: &mut ContactResiduals) {
        let pressure = self.pressure(body_force);
        let tangential = self.tangential(body_force);
        residuals.gap = residuals.gap.max(self.gap.abs());
        residuals.tension = residuals.tension.max(-pressure);
        let limit = self.friction * pressure.max(0.0);
        residuals.cone = residuals.cone.max(tangential.norm() - limit);
        if let Touch::Slip { .. } = self.touch {
            let back = self.tangential(&self.to_anchor);
            if limit > 0.0 && back.norm() > LEAST_SLIP {
                let share = (tangential / limit - back.normalize()).norm();
                residuals.slip = residuals.slip.max(share);
            }
        }
    }
}

/// Ends a step: what slides or has just come to stick is anchored where it is.
pub(crate) fn settle(
    model: &Model,
    displacements: &[Vec3],
    tools: &[PosedTool],
    touches: &mut [Touch],
) {
    for (vertex, touch) in touches.iter_mut().enumerate() {
        let Touch::Slip { tool, anchor } = touch else {
            continue;
        };
        let node = model.body.node(vertex, 0);
        let x = model.body.positions[node] + displacements[node];
        let PosedTool { tool, pose } = &tools[*tool as usize];
        let distance = tool.distance_at(pose, &x);
        let surface = x - distance.normal * distance.distance;
        *anchor = pose.inverse_transform_point(&surface.into()).coords;
    }
}
