//! The input of a static step: loads and tolerances.

use palpa_mesh::Vec3;

use crate::dynamics::Dynamics;
use crate::posed_tool::PosedTool;

/// Tools, displacements and forces that act on a body at the end of a step.
#[derive(Debug, Clone, Default)]
pub struct Load<'a> {
    /// Tools, at their places at the end.
    pub tools: &'a [PosedTool],
    /// Nodes that are held in all directions, and their displacement at the end, m.
    pub held: &'a [(usize, Vec3)],
    /// Nodes that are guided: node, unit direction, and displacement along it at the end, m. Across
    /// it they are free.
    pub guided: &'a [(usize, Vec3, f64)],
    /// Dead forces on all nodes, N; none if empty. `[n_nodes]` or `[0]`
    pub forces: &'a [Vec3],
    /// Duration of the step, s; 0 is a sudden step, ∞ relaxes fully.
    pub duration: f64,
    /// Inertia and damping; quasi-static without.
    pub dynamics: Option<Dynamics>,
}

/// Tolerances of a solve, and when it gives up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolveParams {
    /// Norm of the forces that are out of balance, as a share of those that hold the body.
    pub tolerance: f64,
    /// Largest gap of an active vertex, m.
    pub gap_tolerance: f64,
    /// Newton iterations of one load step.
    pub max_iterations: usize,
    /// Number of free nodes from which on a factor is kept over iterations and steps, as the
    /// preconditioner of the next systems, until that no longer pays. The cost of a factor grows
    /// faster with the body than that of its use.
    pub keep_factor_from: usize,
}

impl Default for SolveParams {
    fn default() -> Self {
        Self {
            tolerance: 1e-7,
            gap_tolerance: 1e-8,
            max_iterations: 40,
            keep_factor_from: 10_000,
        }
    }
}
