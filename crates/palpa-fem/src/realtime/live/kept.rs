//! What is kept from step to step: the zone's factor, and the candidates with their compliance.
//!
//! Forces out of balance are exact in every iteration, so an older stiffness delays a step but does not
//! change its limit. A factor costs several times as much as an iteration with it. It is therefore kept
//! while the first iteration of a step comes near equilibrium, and so are the candidates while the tools
//! have not come to triangles without candidates.

use palpa_mesh::Vec3;

use super::Live;
use super::iteration::Pass;
use super::step::ROUGH;
use crate::posed_tool::PosedTool;

/// Iterations beyond the first of each step after which a new factor is cheaper: about the cost of a
/// factor over that of an iteration.
const MOST_EXTRA: usize = 8;
/// Share of the least gap of the triangles without candidates that the tools may go until the next
/// search: the skin may come to meet them.
const USABLE: f64 = 0.7;

/// The factor of a zone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Factor {
    None,
    /// That of the body's stiffness.
    Own,
    /// That of a stiffness made positive definite, which the body's was not.
    Altered,
}

/// What is kept, and for how long.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kept {
    /// The factor of the present zone.
    factor: Factor,
    /// Iterations beyond the first of each step since the factor was computed.
    n_extra: usize,
    /// Whether candidates and compliance belong to the factor.
    has_contact: bool,
    /// Whether the compliance is that of a contact with friction.
    has_friction: bool,
    /// Distance that the tools may still go with these candidates, m.
    horizon: f64,
}

impl Kept {
    /// Nothing.
    pub(super) const NONE: Self = Self {
        factor: Factor::None,
        n_extra: 0,
        has_contact: false,
        has_friction: false,
        horizon: 0.0,
    };

    /// Whether candidates and compliance belong together.
    pub(super) fn has_contact(&self) -> bool {
        self.has_contact
    }

    fn is_worn(&self) -> bool {
        self.n_extra >= MOST_EXTRA
    }

    /// Called with new candidates, of which triangles nearer than `gap` (m) to a tool have some.
    pub(super) fn renew_contact(&mut self, gap: f64, has_friction: bool) {
        self.has_contact = true;
        self.has_friction = has_friction;
        self.horizon = USABLE * gap.max(0.0);
    }

    /// Whether the factor, and so the compliance, is not that of the body's stiffness.
    pub(super) fn is_altered(&self) -> bool {
        self.factor == Factor::Altered
    }

    /// Called with a new factor. Candidates need a new compliance then.
    pub(super) fn renew_factor(&mut self, is_altered: bool) {
        self.factor = if is_altered {
            Factor::Altered
        } else {
            Factor::Own
        };
        self.n_extra = 0;
    }
}

impl Live {
    /// The kind of the first iteration of a step, after the tools have moved.
    pub(super) fn first_pass(&mut self) -> Pass {
        self.kept.horizon -= self.way_of_tools();
        let kept = &self.kept;
        let all_press = (0..self.course.tools.len()).all(|tool| {
            let mut pressing = self.problem.pressing();
            pressing.any(|c| c.tool as usize == tool && !c.is_far)
        });
        let may_follow = kept.has_contact
            && kept.factor != Factor::None
            && !kept.is_worn()
            && kept.has_friction == self.problem.has_friction
            && kept.horizon > 0.0
            && all_press
            && self.beyond.triangles.is_empty();
        if may_follow {
            Pass::Follow
        } else {
            Pass::First
        }
    }

    /// Whether the present factor does for new candidates. Springs in it belong to the old ones.
    pub(super) fn keeps_factor(&self) -> bool {
        self.kept.factor != Factor::None && !self.kept.is_worn() && !self.springs.are_on()
    }

    /// The kind of the next iteration of a step, whose last left `residual` after one with `before`; infinite
    /// for the first. `left` more are allowed.
    pub(super) fn next_pass(&mut self, residual: f64, before: f64, left: usize) -> Pass {
        self.kept.n_extra += 1;
        let rate = residual / before;
        let will_do = residual * rate.powf(left as f64) <= self.params.tolerance;
        if residual < ROUGH && will_do {
            Pass::Near
        } else {
            self.kept.n_extra = MOST_EXTRA;
            Pass::Anew
        }
    }

    /// Largest distance that a tool has gone in this step where it presses, m; infinite if it is
    /// another tool.
    fn way_of_tools(&self) -> f64 {
        let before = &self.problem.tools_before;
        let ways = self.course.tools.iter().enumerate().map(|(t, now)| {
            let Some(before) = before.get(t).filter(|before| before.tool == now.tool) else {
                return f64::INFINITY;
            };
            let pressed = self.problem.pressing().filter(|c| c.tool as usize == t);
            let ways = pressed.map(|c| way_of(before, now, &c.start));
            ways.fold(way_of(before, now, &now.pose.translation.vector), f64::max)
        });
        ways.fold(0.0, f64::max)
    }
}

/// Distance that the point of a tool goes which is at `place` at its end, m.
fn way_of(before: &PosedTool, now: &PosedTool, place: &Vec3) -> f64 {
    let own = now.pose.inverse_transform_point(&(*place).into());
    (before.pose * own - now.pose * own).norm()
}
