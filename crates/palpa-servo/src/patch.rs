//! The contact patch: the tissue's local model of its contact, valid near the pose at which it was
//! made.
//!
//! ```text
//! x_i = x0_i + Σ_j W_ij (r_j − r0_j)          where candidate vertices go under forces r of the tool on them
//! g_i = n · d + ½ dᵀ C d,  d = T⁻¹ x_i − c    their gap to the tool at pose T, with c, n, C in the tool's frame
//! ```
//! Candidates that do not touch have `r0 = 0`. They are included because the tool may reach them
//! before the next patch.

use crate::{MAX_TOOLS, Mat3, Pose, Vec3};

/// Largest number of candidates in a patch, touching or not.
pub const MAX_CONTACTS: usize = 60;
const N: usize = 3 * MAX_CONTACTS;

/// A vertex of the skin that touches a tool or is near one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// Number of the vertex in the body; the same in every patch.
    pub vertex: u32,
    /// Nearest tool, an index into the patch's tools.
    pub tool: u32,
    /// Position, m, `x0`.
    pub position: Vec3,
    /// Force of the tool on the vertex at that position, N, `r0`.
    pub force: Vec3,
    /// Nearest point of the tool's surface, in the tool's frame, m, `c`.
    pub surface: Vec3,
    /// The tool's outward normal there, in the tool's frame, `n`.
    pub normal: Vec3,
    /// The tool's curvature there, in the tool's frame, 1/m, `C`.
    pub curvature: Mat3,
    /// Anchor of friction, in the tool's frame, m. If the vertex slides or does not touch, the
    /// anchor is the position of the vertex.
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
    /// Whether the vertices are bonded to the tool. Bonded vertices may pull; others are only
    /// pressed.
    pub is_bonded: bool,
    /// Force of the tissue on the tool at that pose, N.
    pub force: Vec3,
    /// Stiffness against the tool, N/m: the negative derivative of that force with respect to the
    /// tool's position.
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
    /// Number of the tissue's step, from 1; 0 if the patch was never written.
    pub id: u64,
    /// Time on the loop's clock at which the poses for this patch were taken, s.
    pub sampled_at: f64,
    /// Expected time to the next patch, s, as the tissue declares it.
    pub period: f64,
    /// Number of tools.
    pub n_tools: usize,
    /// The tools; entries from `n_tools` on are not used.
    pub tools: [ToolContact; MAX_TOOLS],
    /// Number of candidates.
    pub n_contacts: usize,
    /// The candidates; entries from `n_contacts` on are not used.
    pub contacts: [Candidate; MAX_CONTACTS],
    /// Compliance `W`, m/N. Entry (i, j) is at `i + 3 MAX_CONTACTS j`; symmetric, both triangles
    /// are stored.
    pub compliance: [f64; N * N],
}

impl ContactPatch {
    /// Distance between columns of the compliance, in entries.
    pub const STRIDE: usize = N;

    #[expect(
        clippy::large_stack_arrays,
        reason = "a constant, of which the user chooses the place"
    )]
    /// A patch that was never written. It takes 270 KB: keep it in a `static` or a box, not on the
    /// stack.
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

    /// Displacement of candidate `i` per unit force on candidate `j`, m/N; zero beyond
    /// [`MAX_CONTACTS`].
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

    /// Sets [`ContactPatch::block`] (i, j), but not the block (j, i). Does nothing beyond
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

/// The source of patches: the reader's end of a mailbox that keeps the latest patch only. No call
/// may wait.
pub trait PatchSource {
    /// The patch that the last [`PatchSource::take`] made current.
    fn current(&self) -> &ContactPatch;
    /// Whether there is a newer one.
    fn is_newer(&self) -> bool;
    /// Makes the newer one current.
    fn take(&mut self);
}
