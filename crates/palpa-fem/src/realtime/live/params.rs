//! How a moving step is set up.

/// How a moving step goes about its work.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiveParams {
    /// Radius of the zone round the tools, measured at rest over the skin, m; infinite for one
    /// stiffness of the whole body.
    pub zone_radius: f64,
    /// How the body outside the zone is followed.
    pub exterior: ExteriorMode,
    /// Most Newton iterations of a step.
    pub max_iterations: usize,
    /// Forces out of balance, as a share of the tools' force, above which a step takes another
    /// iteration.
    pub tolerance: f64,
    /// Gap up to which vertices are candidates for contact, m.
    pub reach: f64,
    /// How far the tool may go from the zone's centre before a new zone is asked for, as a share of
    /// the radius.
    pub leave: f64,
    /// Longest way of a tool near the skin in one step, m. A tool that is asked to go farther is
    /// followed over several steps, so that it cannot jump through the skin.
    pub longest_move: f64,
    /// Change of the indentation after which a new stiffness of the exterior is asked for, m.
    pub stale: f64,
}

impl Default for LiveParams {
    fn default() -> Self {
        Self {
            zone_radius: 15e-3,
            exterior: ExteriorMode::Followed,
            max_iterations: 2,
            tolerance: 0.01,
            reach: 1.5e-3,
            leave: 0.2,
            longest_move: 3e-3,
            stale: 1e-3,
        }
    }
}

impl LiveParams {
    /// How far a tool may go while a job is under way, m: out of the zone's middle, or as far as
    /// the stiffness of a followed exterior serves.
    pub fn longest_way(&self) -> f64 {
        let way = self.leave * self.zone_radius;
        match self.exterior {
            ExteriorMode::Followed => way.min(self.stale),
            ExteriorMode::Linear => way,
        }
    }
}

/// How a step treats the body outside the zone. The stiffness there is always an earlier one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExteriorMode {
    /// It is brought to equilibrium with its true forces in every step; the cost of a step grows
    /// with the body.
    Followed,
    /// It answers linearly until the background brings it up to date; the cost of a step is that of
    /// the zone.
    Linear,
}
