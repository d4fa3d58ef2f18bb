//! The result of a real-time step.

/// The outcome of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepOutcome {
    /// The tools have reached their targets.
    Arrived,
    /// The tools are on the way to their targets, which were too far for one step, and the local model is that of
    /// the place reached; or the next zone is late, and they press the edge of the present one.
    Behind,
    /// The step was cut short because tissue would have turned inside out, or it ended far from
    /// equilibrium, or the contact did not settle. The next steps continue from here. The local model must not be rendered.
    BackedOff,
    /// The step was discarded. The state is the last good one, and the tools are followed more slowly from
    /// there. The local model that was made of that state is still right; a new one is empty.
    Held,
    /// Many steps in a row were discarded, and the body has begun again at rest with the tools off it.
    Failed,
}

/// Figures of one real-time step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiveReport {
    /// The outcome.
    pub outcome: StepOutcome,
    /// Newton iterations; 0 while nothing touches a body at rest, and while tools that press do not
    /// move and the body is in equilibrium with them.
    pub iterations: usize,
    /// Factors of the zone's stiffness that were computed, those that failed included. They are most of
    /// a step's cost.
    pub n_factors: usize,
    /// Residual of the zone: unbalanced forces relative to the tools' force.
    pub residual: f64,
    /// Residual of a followed exterior: unbalanced forces relative to the tools' force.
    pub outside: f64,
    /// Number of pressing vertices.
    pub n_active: usize,
    /// Number of contact candidates.
    pub n_candidates: usize,
    /// Number of triangles under a tool for which there was no room among the candidates: they bear
    /// nothing, so the force is too small.
    pub n_left_out: usize,
    /// Number of pressing vertices outside the zone, where the stiffness is that of an earlier moment
    /// and the body answers linearly.
    pub n_far: usize,
    /// Whether the contact forces satisfy the law of contact.
    pub is_contact_settled: bool,
    /// Number of unknowns at which the zone's stiffness had to be raised, because it was not positive
    /// definite.
    pub n_raised: usize,
    /// Whether the compliance of the local model is not the body's, because the stiffness at the end of the step
    /// was not positive definite either, and had to be altered. The forces are right.
    pub is_altered: bool,
    /// Whether the tools pressed outside the zone until a zone came there, and are still on their way back to the depth
    /// that they had. Until they have it, the local model of the last step before the zone came has the better force.
    pub is_catching_up: bool,
    /// Stiffness of the springs that held the vertices under the tools during the solve, relative
    /// to the skin's own stiffness. Their forces have been removed from the result.
    pub spring: f64,
    /// Number of the zone used, from 1.
    pub zone: u64,
    /// Number of the exterior's factor that was used.
    pub factor: u64,
}

impl LiveReport {
    /// Whether the force and the local model are the body's, apart from the residual: triangles left out bear
    /// nothing, and an altered compliance is not that of the state.
    pub fn is_whole(&self) -> bool {
        self.n_left_out == 0 && !self.is_altered
    }
}
