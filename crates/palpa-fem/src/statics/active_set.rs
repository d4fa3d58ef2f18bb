//! The skin vertices in contact with tools, and their anchors.
//!
//! Contact is a complementarity problem: a vertex has either a gap and no traction, or no gap and a
//! pressing traction, `0 ≤ g ⟂ λ ≥ 0`. With friction its tangential traction lies in Coulomb's
//! cone, `|t| ≤ μ λ`, and opposes the slip if it reaches the cone's border. Newton's method and the
//! choice of the active vertices go together (a primal–dual active set): vertices with a negative
//! gap are held on the tool's surface, vertices under tension are released, until nothing changes.

use palpa_mesh::Vec3;

use crate::Mat3;
use crate::model::Model;
use crate::posed_tool::PosedTool;
use crate::state::{State, Touch};
use crate::system::Hold;

/// A slip below this (m) has no defined direction.
const LEAST_SLIP: f64 = 1e-10;

/// A vertex that touches a tool, at the current positions.
#[derive(Debug, Clone, Copy)]
pub(super) struct ActiveVertex {
    pub(super) node: usize,
    /// Index of the skin vertex.
    pub(super) vertex: usize,
    /// Coefficient of friction of its tool.
    pub(super) friction: f64,
    pub(super) touch: Touch,
    /// Gap, m; negative inside the tool.
    pub(super) gap: f64,
    /// Unit normal of the tool's surface, from the tool to the tissue.
    normal: Vec3,
    /// Curvature of the tool's surface, 1/m.
    curvature: Mat3,
    /// Vector from the vertex to its anchor, m.
    to_anchor: Vec3,
    /// See [`ActiveSet::smoothing`].
    smoothing: f64,
}

/// The vertices that touch any tool, at the current positions.
#[derive(Debug, Default)]
pub(super) struct ActiveSet {
    pub(super) active: Vec<ActiveVertex>,
    /// Slip (m) over which the direction of friction changes gradually, with all vertices sliding.
    /// It gives a good first guess where the exact law does not converge. 0 is the exact law.
    pub(super) smoothing: f64,
}

/// Violation of the laws of contact.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct ContactResiduals {
    /// Deepest penetration or largest gap of an active vertex, m.
    pub gap: f64,
    /// Deepest penetration of a vertex that should be open, m.
    pub penetration: f64,
    /// Largest tensile force at an active vertex, N.
    pub tension: f64,
    /// Largest tangential force in excess of the friction cone, N.
    pub cone: f64,
    /// Largest part of a friction force at the cone's border that does not oppose the slip,
    /// relative to the force.
    pub slip: f64,
}

impl ActiveSet {
    /// Finds gaps, normals and anchors of the vertices in contact, and adds vertices that have come
    /// into contact.
    ///
    /// `touches` is the state. Vertices that are `held` in all directions cannot be in contact.
    /// Returns the number of new vertices.
    pub(super) fn update(
        &mut self,
        model: &Model,
        displacements: &[Vec3],
        tools: &[PosedTool],
        held: &[Hold],
        touches: &mut [Touch],
        tolerance: f64,
    ) -> usize {
        self.active.clear();
        let mut n_new = 0;
        for (vertex, touch) in touches.iter_mut().enumerate() {
            let node = model.body.node(vertex, 0);
            if tools.is_empty() || held[node].n == 3 {
                continue;
            }
            let x = model.body.positions[node] + displacements[node];
            let inside = || nearest_tool(tools, &x).filter(|nearest| nearest.1 < -tolerance);
            let Some(k) = touch.tool().or_else(|| inside().map(|nearest| nearest.0)) else {
                continue;
            };
            if *touch == Touch::Open {
                n_new += 1;
                *touch = first_touch(tools, k, &x, self.smoothing == 0.0);
            }
            let contact = ActiveVertex::new(node, vertex, *touch, &tools[k], &x);
            self.active.push(ActiveVertex {
                smoothing: self.smoothing,
                ..contact
            });
        }
        n_new
    }

    /// Vertices that slide under pressure with friction: node, friction per pressure `μ d`, and
    /// normal.
    pub(super) fn sliding(&self, body_forces: &[Vec3]) -> Vec<(usize, Vec3, Vec3)> {
        self.active
            .iter()
            .filter_map(|contact| {
                let Touch::Slip { .. } = contact.touch else {
                    return None;
                };
                let force = &body_forces[contact.node];
                let pressure = contact.pressure(force);
                if contact.friction == 0.0 || pressure <= 0.0 || contact.is_just_released() {
                    return None;
                }
                let (friction, _) = contact.friction(force);
                Some((contact.node, friction / pressure, contact.normal))
            })
            .collect()
    }
}

impl ActiveVertex {
    /// A vertex in contact at the position `x`.
    fn new(node: usize, vertex: usize, touch: Touch, tool: &PosedTool, x: &Vec3) -> Self {
        let PosedTool { tool, pose } = tool;
        let distance = tool.distance_at(pose, x);
        let to_anchor = match touch {
            Touch::Stick { anchor, .. } | Touch::Slip { anchor, .. } => {
                pose.transform_point(&anchor.into()).coords - x
            }
            Touch::Open => Vec3::zeros(),
        };
        Self {
            node,
            vertex,
            friction: tool.friction(),
            touch,
            gap: distance.distance,
            normal: distance.normal,
            curvature: distance.curvature,
            to_anchor,
            smoothing: 0.0,
        }
    }

    /// The same vertex at the position `x`.
    pub(super) fn moved(&self, tools: &[PosedTool], x: &Vec3) -> Self {
        match self.touch.tool() {
            Some(tool) => Self::new(self.node, self.vertex, self.touch, &tools[tool], x),
            None => *self,
        }
    }

    /// The tool's constraint: held directions, and the displacement along them. `body_force` is the
    /// force that friction has balanced.
    ///
    /// A vertex that has just been released can move only against the friction that held it. For a
    /// slip that short, friction would turn at once with any movement, which is infinitely stiff
    /// across.
    pub(super) fn demand(&self, hold: Hold, body_force: &Vec3) -> (Hold, Vec3) {
        match self.touch {
            Touch::Stick { .. } => return (Hold::all(), self.to_anchor),
            Touch::Slip { .. } if self.is_just_released() => {
                let across = self.normal.cross(&self.tangential(body_force));
                let hold = hold.and(&self.normal);
                let hold = across.try_normalize(0.0).map_or(hold, |a| hold.and(&a));
                return (hold, -self.normal * self.gap);
            }
            _ => {}
        }
        (hold.and(&self.normal), -self.normal * self.gap)
    }

    /// Normal part of the tool's force on the vertex, which balances the body's force on it, N.
    pub(super) fn pressure(&self, body_force: &Vec3) -> f64 {
        body_force.dot(&self.normal)
    }

    /// Whether friction has held the vertex until now. The vertex then leaves in the direction in
    /// which it was held back. Terms that would soften it (the tool's curvature, and friction that
    /// falls with slip) are left out until it slides.
    fn is_just_released(&self) -> bool {
        self.friction > 0.0
            && self.smoothing == 0.0
            && self.tangential(&self.to_anchor).norm() <= LEAST_SLIP
    }

    /// Largest curvature of the tool's surface at the vertex, 1/m.
    pub(super) fn sharpness(&self) -> f64 {
        self.curvature.norm()
    }

    fn tangential(&self, v: &Vec3) -> Vec3 {
        v - self.normal * self.normal.dot(v)
    }

    /// Friction on a sliding vertex, N, and its stiffness (`−∂t/∂u`, positive semidefinite).
    /// `body_force` is that of the last iteration. It gives the pressure and, before there is any
    /// slip, the direction.
    pub(super) fn friction(&self, body_force: &Vec3) -> (Vec3, Mat3) {
        let limit = self.friction * self.pressure(body_force).max(0.0);
        if limit == 0.0 {
            return (Vec3::zeros(), Mat3::zeros());
        }
        // From the vertex back to its anchor, opposite to the slip.
        let back = self.tangential(&self.to_anchor);
        let slip = back.norm().hypot(self.smoothing);
        if slip <= LEAST_SLIP {
            // The vertex is about to slide: friction keeps the direction in which it has held.
            let tangential = self.tangential(body_force);
            let size = tangential.norm();
            let force = if size > 0.0 {
                tangential * (limit / size)
            } else {
                Vec3::zeros()
            };
            return (force, Mat3::zeros());
        }
        // Length below 1 while friction is smoothed.
        let direction = back / slip;
        let across = Mat3::identity()
            - self.normal * self.normal.transpose()
            - direction * direction.transpose();
        (direction * limit, across * (limit / slip))
    }

    /// Stiffness due to the curvature of the tool's surface at an active vertex: `−λ ∂n/∂x`.
    pub(super) fn geometric(&self, body_force: &Vec3) -> Mat3 {
        match self.touch {
            Touch::Stick { .. } => Mat3::zeros(),
            Touch::Slip { .. } if self.is_just_released() => Mat3::zeros(),
            _ => self.curvature * -self.pressure(body_force).max(0.0),
        }
    }

    /// The touch required by the laws of contact if it differs from the present one, and the force
    /// by which the present one violates them, N. `body_force` is the body's force on the vertex;
    /// forces below `least` count as zero.
    pub(super) fn revised(&self, body_force: &Vec3, least: f64) -> Option<(Touch, f64)> {
        let pressure = self.pressure(body_force);
        if pressure < -least {
            return Some((Touch::Open, -pressure));
        }
        let tangential = self.tangential(body_force);
        match self.touch {
            Touch::Stick { tool, anchor } => {
                // At the border of the cone the vertex still sticks; a small excess is rounding.
                let excess = tangential.norm() - self.friction * pressure.max(0.0) * (1.0 + 1e-9);
                (excess > least).then_some((Touch::Slip { tool, anchor }, excess))
            }
            Touch::Slip { tool, anchor } if self.friction > 0.0 && self.smoothing == 0.0 => {
                // Equilibrium would need friction in the direction of the slip: the vertex sticks.
                let back = self.tangential(&self.to_anchor);
                let is_turned = back.norm() > LEAST_SLIP && back.dot(&tangential) < 0.0;
                is_turned.then_some((Touch::Stick { tool, anchor }, tangential.norm()))
            }
            _ => None,
        }
    }

    /// The most likely touch by the exact law of a vertex that slides with smoothed friction.
    pub(super) fn sharpened(&self) -> Touch {
        match self.touch {
            Touch::Slip { tool, anchor }
                if self.friction > 0.0
                    && self.tangential(&self.to_anchor).norm() < self.smoothing =>
            {
                Touch::Stick { tool, anchor }
            }
            touch => touch,
        }
    }

    /// Adds this vertex to the residuals.
    pub(super) fn measure(&self, body_force: &Vec3, residuals: &mut ContactResiduals) {
        let pressure = self.pressure(body_force);
        let tangential = self.tangential(body_force);
        residuals.gap = residuals.gap.max(self.gap.abs());
        residuals.tension = residuals.tension.max(-pressure);
        let limit = self.friction * pressure.max(0.0);
        residuals.cone = residuals.cone.max(tangential.norm() - limit);
        if let Touch::Slip { .. } = self.touch {
            let back = self.tangential(&self.to_anchor);
            if limit > 0.0 && back.norm() > LEAST_SLIP {
                let share = (tangential / limit - back / back.norm().hypot(self.smoothing)).norm();
                residuals.slip = residuals.slip.max(share);
            }
        }
    }
}

/// The tool nearest to `x`, and its distance, m, negative inside; `None` if there is no tool.
fn nearest_tool(tools: &[PosedTool], x: &Vec3) -> Option<(usize, f64)> {
    let distance = |PosedTool { tool, pose }: &PosedTool| tool.distance_at(pose, x).distance;
    let all = tools.iter().map(distance).enumerate();
    all.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// The touch of a vertex at `x` that has come into contact with tool `k`.
fn first_touch(tools: &[PosedTool], k: usize, x: &Vec3, may_stick: bool) -> Touch {
    let anchor = anchor(&tools[k], x);
    let (tool, has_friction) = (k as u32, tools[k].tool.friction() > 0.0);
    if has_friction && may_stick {
        Touch::Stick { tool, anchor }
    } else {
        Touch::Slip { tool, anchor }
    }
}

/// The point of a tool's surface nearest to `x`, in the tool's frame, m.
fn anchor(tool: &PosedTool, x: &Vec3) -> Vec3 {
    let PosedTool { tool, pose } = tool;
    let distance = tool.distance_at(pose, x);
    let surface = x - distance.normal * distance.distance;
    pose.inverse_transform_point(&surface.into()).coords
}

/// Marks open vertices as touching the nearest tool where they are, for a state whose displacements
/// are near an equilibrium in which those vertices touch. `is_touching` as `[n_vertices]`.
///
/// A vertex that is not marked is found only once it is inside a tool. From displacements of another
/// mesh, half of the vertices under the tool are a little outside.
pub fn assume_touches(model: &Model, state: &mut State, tools: &[PosedTool], is_touching: &[bool]) {
    for (vertex, touch) in state.touches.iter_mut().enumerate() {
        if !is_touching[vertex] || *touch != Touch::Open {
            continue;
        }
        let node = model.body.node(vertex, 0);
        let x = model.body.positions[node] + state.displacements[node];
        if let Some((k, _)) = nearest_tool(tools, &x) {
            *touch = first_touch(tools, k, &x, true);
        }
    }
}

/// Ends a step: sets the anchors of sliding vertices to their present positions.
pub(super) fn anchor_slides(
    model: &Model,
    displacements: &[Vec3],
    tools: &[PosedTool],
    touches: &mut [Touch],
) {
    for (vertex, touch) in touches.iter_mut().enumerate() {
        let Touch::Slip { tool, anchor: at } = touch else {
            continue;
        };
        let node = model.body.node(vertex, 0);
        let x = model.body.positions[node] + displacements[node];
        *at = anchor(&tools[*tool as usize], &x);
    }
}
