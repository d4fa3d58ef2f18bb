//! The contact patch: the tissue's local model of its contact, valid near the pose at which it was
//! made.
//!
//! ```text
//! x_i = x0_i + Σ_j W_ij (r_j − r0_j)          where candidate vertices go under forces r of the tool on them
//! g_i = n · d + ½ dᵀ C d,  d = T⁻¹ x_i − c    their gap to the tool at pose T, with c, n, C in the tool's frame
//! ```
//! Candidates that do not touch have `r0 = 0`; they are there because the tool may reach them
//! before the next patch.

use crate::{MAX_TOOLS, Mat3, Pose, Vec3};

/// Largest number of candidates in a patch, touching or not.
pub const MAX_CONTACTS: usize = 60;
const N: usize = 3 * MAX_CONTACTS;

/// A vertex of the skin that touches a tool or is near one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// Vertex of the body; the same number in every patch that has it.
    pub vertex: u32,
    /// Tool that it is near, index into the patch's tools.
    pub tool: u32,
    /// Position, m, `x0`.
    pub position: Vec3,
    /// Force of the tool on it there, N, `r0`.
    pub force: Vec3,
    /// Nearest point of the tool's surface, in the tool's frame, m, `c`.
    pub surface: Vec3,
    /// The tool's outward normal there, in the tool's frame, `n`.
    pub normal: Vec3,
    /// The tool's curvature there, in the tool's frame, 1/m, `C`.
    pub curvature: Mat3,
    /// Anchor of friction, in the tool's frame, m; for a vertex that slides or does not touch, its
    /// position there.
    pub anchor: Vec3,
}

impl Candidate {
    /// An unused entry.
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

/// One tool in a patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToolContact {
    /// Pose of the tool.
    pub pose: Pose,
    /// Coefficient of friction.
    pub friction: f64,
    /// Whether its vertices are bonded to it, and may pull, rather than be pressed.
    pub is_bonded: bool,
    /// Force of the tissue on the tool there, N.
    pub force: Vec3,
    /// Stiffness against the tool, N/m: the derivative of that force by the tool's position,
    /// negated.
    pub stiffness: Mat3,
}

impl ToolContact {
    /// A tool that touches nothing.
    pub const NONE: Self = Self {
        pose: Pose {
            rotation: nalgebra::Unit::new_unchecked(nalgebra::Quaternion::from_vector(
                nalgebra::Vector4::new(0.0, 0.0, 0.0, 1.0),
            )),
            translation: nalgebra::Translation3 {
                vector: Vec3::new(0.0, 0.0, 0.0),
            },
        },
        friction: 0.0,
        is_bonded: false,
        force: Vec3::new(0.0, 0.0, 0.0),
        stiffness: Mat3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    };
}

/// A local model of the tissue under the tools.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactPatch {
    /// Number of the tissue's step, from 1; 0 is a patch that was never written.
    pub id: u64,
    /// Loop's clock when the poses were taken for which this patch was made, s.
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

    #[expect(
        clippy::large_stack_arrays,
        reason = "a constant, of which the user chooses the place"
    )]
    /// A patch that was never written. 270 KB: keep it in a `static` or a box, not on a stack.
    pub const EMPTY: Self = Self {
        id: 0,
        sampled_at: 0.0,
        period: 0.0,
        n_tools: 0,
        tools: [ToolContact::NONE; MAX_TOOLS],
        n_contacts: 0,
        contacts: [Candidate::NONE; MAX_CONTACTS],
        compliance: [0.0; N * N],
    };

    /// Displacement of candidate `i` per force on candidate `j`, m/N; zero beyond [`MAX_CONTACTS`].
    pub fn block(&self, i: usize, j: usize) -> Mat3 {
        let column = |c: usize| {
            let at = 3 * i + N * (3 * j + c);
            let entry = |k: usize| self.compliance.get(at + k).copied().unwrap_or(0.0);
            Vec3::new(entry(0), entry(1), entry(2))
        };
        if i < MAX_CONTACTS && j < MAX_CONTACTS {
            Mat3::from_columns(&[column(0), column(1), column(2)])
        } else {
            Mat3::zeros()
        }
    }

    /// Sets [`ContactPatch::block`] (i, j), and not its mirror image; does nothing beyond
    /// [`MAX_CONTACTS`].
    pub fn set_block(&mut self, i: usize, j: usize, block: &Mat3) {
        if i < MAX_CONTACTS && j < MAX_CONTACTS {
            for (c, column) in block.column_iter().enumerate() {
                for (k, value) in column.iter().enumerate() {
                    let at = 3 * i + k + N * (3 * j + c);
                    if let Some(entry) = self.compliance.get_mut(at) {
                        *entry = *value;
                    }
                }
            }
        }
    }
}

/// The source of patches: the reader's end of a mailbox in which the latest wins. No call may wait.
pub trait PatchSource {
    /// The patch that the last [`PatchSource::take`] made current.
    fn current(&self) -> &ContactPatch;
    /// Whether there is a newer one.
    fn is_newer(&self) -> bool;
    /// Makes the newer one current.
    fn take(&mut self);
}
