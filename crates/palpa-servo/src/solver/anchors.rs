//! The friction anchors.

use super::{ContactSolver, tool_of, vec3};
use crate::{ContactPatch, MAX_CONTACTS, MAX_TOOLS, Pose, Vec3};

impl ContactSolver {
    /// Moves the anchor of each vertex that slides or does not touch to where the vertex is now.
    pub(crate) fn move_anchors(&mut self, patch: &ContactPatch, poses: &[Pose; MAX_TOOLS]) {
        for ((((candidate, anchor), force), is_sliding), x) in patch
            .contacts
            .iter()
            .zip(&mut self.anchor)
            .zip(&self.force)
            .zip(&self.is_sliding)
            .zip(self.position.chunks_exact(3))
            .take(self.n)
        {
            let t = candidate.tool as usize;
            let (Some(tool), Some(pose), Some(stretch)) = (
                tool_of(patch, candidate.tool),
                poses.get(t),
                self.stretch.get(t),
            ) else {
                continue;
            };
            if !tool.is_bonded && (*is_sliding || *force == Vec3::zeros()) {
                let y = vec3(x) - stretch;
                *anchor = pose.inverse_transform_point(&y.into()).coords;
            }
        }
    }

    /// Moves all anchors to where their vertices are now, so that friction starts from zero.
    pub(crate) fn release_anchors(&mut self, patch: &ContactPatch, poses: &[Pose; MAX_TOOLS]) {
        self.is_sliding = [true; MAX_CONTACTS];
        self.move_anchors(patch, poses);
    }
}
