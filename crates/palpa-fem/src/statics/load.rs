//! The input of a static step: loads and tolerances.

use palpa_mesh::Vec3;

use crate::dynamics::Dynamics;
use crate::posed_tool::PosedTool;

/// Tools, displacements and forces that act on a body at the end of a step.
#[derive(Debug, Clone, Default)]
pub struct Load<'a> {
    /// Tools with their poses at the end.
    pub tools: &'a [PosedTool],
    /// The same tools at the start, if they have friction: a vertex is held where it first touches on
    /// their way. Empty if they have not moved.
    pub tools_before: &'a [PosedTool],
    /// Nodes held in all directions, with their displacements at the end, m.
    pub held: &'a [(usize, Vec3)],
    /// Guided nodes: node, unit direction, and displacement along it at the end, m. They are free
    /// across it.
    pub guided: &'a [(usize, Vec3, f64)],
    /// Dead forces on all nodes, N; empty for none. `[n_nodes]` or `[0]`
    pub forces: &'a [Vec3],
    /// Duration of the step, s; 0 is instantaneous, ∞ relaxes fully.
    pub duration: f64,
    /// Inertia and damping; `None` for quasi-static.
    pub dynamics: Option<Dynamics>,
}

/// Tolerances and limits of a solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolveParams {
    /// Tolerance of the norm of the unbalanced forces, relative to the forces that hold the body.
    pub tolerance: f64,
    /// Tolerance of what pressure and friction differ from the law of contact, relative to the same
    /// forces.
    pub contact_tolerance: f64,
    /// Distance from a prescribed displacement, m.
    pub gap_tolerance: f64,
    /// Largest number of Newton iterations in one load step.
    pub max_iterations: usize,
    /// Number of free nodes from which a factor is kept over iterations and steps, as the
    /// preconditioner of the next systems, as long as that pays. The cost of a factor grows faster
    /// with the body than the cost of using it.
    pub keep_factor_from: usize,
    /// Whether the state begins near equilibrium, so that the first factor serves all iterations.
    pub is_near: bool,
}

impl Default for SolveParams {
    fn default() -> Self {
        Self {
            tolerance: 1e-7,
            contact_tolerance: 1e-5,
            gap_tolerance: 1e-8,
            max_iterations: 40,
            keep_factor_from: 10_000,
            is_near: false,
        }
    }
}
