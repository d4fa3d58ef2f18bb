//! What the tissue says of its contact: a local model that holds near the pose at which it was made.
//!
//! ```text
//! x_i = x0_i + Σ_j W_ij (r_j − r0_j)          where candidate vertices go under forces r of the tool on them
//! g_i = n · d + ½ dᵀ C d,  d = T⁻¹ x_i − c    their gap to the tool at pose T, with c, n, C in the tool's frame
//! ```
//! Candidates that do not touch have `r0 = 0`; they are there because the tool may reach them before the next patch.

use crate::{MAX_TOOLS, Mat3, Pose, Vec3};

/// How many vertices a patch may carry, active or not.
pub const MAX_CONTACTS: usize = 60;
const N: usize = 3 * MAX_CONTACTS;

/// A vertex of the skin that touches a tool or is near one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// Which vertex of the body; the same number in every patch that has it.
    pub vertex: u32,
    /// Which tool it is near.
    pub tool: u32,
    /// Where it was, m, `x0`.
    pub position: Vec3,
    /// Force of the tool on it there, N, `r0`.
    pub force: Vec3,
    /// Nearest point of the tool's surface, in the tool's frame, m, `c`.
    pub surface: Vec3,
    /// The tool's outward normal there, in the tool's frame, `n`.
    pub normal: Vec3,
    /// The tool's curvature there, in the tool's frame, 1/m, `C`.
    pub curvature: Mat3,
    /// Where friction holds it, in the tool's frame, m; of a vertex that slides or does not touch where it was.
    pub anchor: Vec3,
}

impl Candidate {
    /// A vertex that is nowhere.
    pub const NONE: Self = Self {
        vertex: u32::MAX,
        tool: 0,
        position: Vec3::new(0.0, 0.0, 0.0),
        force: Vec3::new(0.0, 0.0, 0.0),
        surface: Vec3::new(0.0, 0.0, 0.0),
        normal: Vec3::new(0.0, 0.0, 1.0),
        curvature: Mat3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        anchor: Vec3::new(0.0, 0.0, 0.0),
    };
}

/// What a patch says of one tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToolContact {
    /// Where the tool was.
    pub pose: Pose,
    /// Coefficient of friction.
    pub friction: f64,
    /// Whether its vertices are bonded to it, and may pull, rather than be pressed.
    pub is_bonded: bool,
    /// Force of the tissue on the tool there, N.
    pub force: Vec3,
    /// Derivative of that force by the tool's position, negated: what resists, N/m.
    pub stiffness: Mat3,
}

/// A local model of the tissue under the tools.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactPatch {
    /// Counts the tissue's steps from 1; 0 is a patch that was never written.
    pub id: u64,
    /// Clock at which the poses were taken that this patch was made for, s.
    pub sampled_at: f64,
    /// Time from one patch to the next that the tissue expects, s.
    pub period: f64,
    /// Number of tools.
    pub n_tools: usize,
    /// The tools; those past `n_tools` mean nothing.
    pub tools: [ToolContact; MAX_TOOLS],
    /// Number of candidates.
    pub n_contacts: usize,
    /// The candidates; those past `n_contacts` mean nothing.
    pub contacts: [Candidate; MAX_CONTACTS],
    /// Compliance `W`, m/N: entry (i, j) at `i + 3 MAX_CONTACTS j`, symmetric, both triangles.
    pub compliance: [f64; N * N],
}

impl ContactPatch {
    /// Distance between columns of the compliance.
    pub const STRIDE: usize = N;
}
