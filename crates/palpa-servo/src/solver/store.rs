//! The energy of the local model: what it stores, and what its friction takes.

use super::{ContactSolver, vec3};
use crate::{ContactPatch, Pose, Vec3};

impl ContactSolver {
    /// Energy stored in the local model under a tool, J: `½ rᵀ W r` of the tissue, and `½ c |Σ r|²`
    /// of the coupling `c`, m/N.
    ///
    /// A function of the patch and the present forces and positions only. Between two poses on one
    /// patch it grows by the work on the tool less what friction takes; every other energy that a
    /// local model can store must be added here. Each tool has half of what two tools store through
    /// each other.
    pub(crate) fn stored(&self, patch: &ContactPatch, tool: usize, coupling: f64) -> f64 {
        let (mut twice, mut sum) = (0.0, Vec3::zeros());
        for (((candidate, force), x), free) in patch
            .contacts
            .iter()
            .zip(&self.force)
            .zip(self.position.chunks_exact(3))
            .zip(self.free.chunks_exact(3))
            .take(self.n)
        {
            if candidate.tool as usize == tool {
                twice += force.dot(&(vec3(x) - vec3(free)));
                sum += force;
            }
        }
        0.5 * (twice + coupling * sum.norm_squared())
    }

    /// Energy that friction on a tool took since its anchors moved last, J. Call it before they move
    /// again.
    ///
    /// A vertex slides along the tool's surface, so the normal force does no work on this way.
    pub(crate) fn rubbed(&self, patch: &ContactPatch, tool: usize, pose: &Pose) -> f64 {
        let stretch = self.stretch(tool);
        (patch.contacts.iter())
            .zip(&self.force)
            .zip(&self.anchor)
            .zip(&self.is_sliding)
            .zip(self.position.chunks_exact(3))
            .take(self.n)
            .filter(|((((c, force), _), is_sliding), _)| {
                c.tool as usize == tool && **is_sliding && **force != Vec3::zeros()
            })
            .map(|((((_, force), anchor), _), x)| {
                let anchor = (pose * nalgebra::Point3::from(*anchor)).coords;
                -force.dot(&(vec3(x) - stretch - anchor))
            })
            .sum()
    }
}
