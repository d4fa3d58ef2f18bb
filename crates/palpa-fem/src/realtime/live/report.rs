//! How a moving step ended.

/// How a step ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepOutcome {
    /// The tools are where they were asked to be.
    Arrived,
    /// The tools are on their way there, because it was too far for one step. The local model is
    /// that of the place reached.
    Behind,
    /// The step went only part of the way, because tissue would have turned inside out; or it
    /// ended far from equilibrium; or its matrix had to be changed before it could be factored. The
    /// next steps go on from here. The local model must not be rendered.
    BackedOff,
    /// The step went nowhere. The state is the last good one, or rest after several failures in a
    /// row, and the tools are followed more slowly from there.
    Failed,
}

/// Figures of one moving step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiveReport {
    /// How it ended.
    pub outcome: StepOutcome,
    /// Newton iterations; 0 while nothing touches a body that is at rest.
    pub iterations: usize,
    /// Forces out of balance in the zone, as a share of the tools' force.
    pub residual: f64,
    /// Forces out of balance in a followed exterior, as a share of the tools' force.
    pub outside: f64,
    /// Vertices that press.
    pub n_active: usize,
    /// Candidates for contact.
    pub n_candidates: usize,
    /// Shift of the diagonal that the zone's stiffness needed, as a share of the diagonal.
    pub shift: f32,
    /// Stiffness of the springs that held the vertices under the tools while the step was solved,
    /// as a share of the skin's own stiffness. Their forces are taken out again.
    pub spring: f64,
    /// Number of the zone that was used; counted from 1.
    pub zone: u64,
    /// Number of the exterior's factor that was used.
    pub factor: u64,
}
