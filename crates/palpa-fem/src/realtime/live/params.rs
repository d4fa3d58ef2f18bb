//! Parameters of the real-time step.

/// The longest way of the tools for which a zone is made ahead of them, as a share of its radius: hands may turn.
const LONGEST_AHEAD: f64 = 0.5;

/// Parameters of the real-time step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiveParams {
    /// Radius of the zone around the tools, measured at rest over the skin, m; infinite to make the
    /// whole body the zone.
    pub zone_radius: f64,
    /// How the body outside the zone is followed.
    pub exterior: ExteriorMode,
    /// Largest number of Newton iterations in a step.
    pub max_iterations: usize,
    /// Residual above which a step takes another iteration: unbalanced forces relative to the
    /// tools' force.
    pub tolerance: f64,
    /// Gap up to which vertices are candidates for contact, m.
    pub reach: f64,
    /// Distance of the tool from the zone's centre at which a new zone is requested, as a share of
    /// the radius.
    pub leave: f64,
    /// Longest move of a tool near the skin in one step, m; where it presses, it goes less. A
    /// longer move is divided over several steps, so that a tool cannot jump through the skin.
    pub longest_move: f64,
    /// Change of the indentation after which a new stiffness of the exterior is requested, m.
    pub stale: f64,
}

impl Default for LiveParams {
    fn default() -> Self {
        Self {
            zone_radius: 15e-3,
            exterior: ExteriorMode::Followed,
            max_iterations: 4,
            tolerance: 0.003,
            reach: 1.5e-3,
            leave: 0.2,
            longest_move: 3e-3,
            stale: 1e-3,
        }
    }
}

impl LiveParams {
    /// The longest way of the tools for which a zone is made ahead of them, m.
    pub(super) fn longest_ahead(&self) -> f64 {
        LONGEST_AHEAD * self.zone_radius
    }

    /// Distance that a tool may go while a job is under way, m: so far zones are made ahead of it. No farther
    /// than the stiffness of a followed exterior is valid.
    pub fn longest_way(&self) -> f64 {
        let way = self.longest_ahead();
        match self.exterior {
            ExteriorMode::Followed => way.min(self.stale),
            ExteriorMode::Linear => way,
        }
    }
}

/// The treatment of the body outside the zone. Its stiffness is always an earlier one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExteriorMode {
    /// The exterior is brought to equilibrium with its true forces in every step; the cost of a
    /// step grows with the body.
    Followed,
    /// The exterior responds linearly until the background updates it; the cost of a step is that
    /// of the zone.
    Linear,
}
