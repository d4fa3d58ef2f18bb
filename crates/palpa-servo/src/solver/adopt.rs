//! Taking over a new patch: vertices of the previous patch keep their forces. The tissue decides what
//! sticks and where, so the anchors are those of the patch.

use super::{ContactSolver, add_columns, tool_of};
use crate::{Candidate, ContactPatch, MAX_CONTACTS, MAX_TOOLS, Pose, ToolContact, Vec3};

/// A contact slides if its friction is at least this share of the largest possible.
const SLIDES: f64 = 0.9;

/// Identity of a contact from patch to patch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Key {
    vertex: u32,
    tool: u32,
}

impl Key {
    pub(super) const NONE: Self = Self {
        vertex: u32::MAX,
        tool: 0,
    };

    fn of(candidate: &Candidate) -> Self {
        Self {
            vertex: candidate.vertex,
            tool: candidate.tool,
        }
    }
}

/// A contact of the previous patch.
#[derive(Debug, Clone, Copy)]
struct Known {
    key: Key,
    force: Vec3,
}

impl ContactSolver {
    /// Takes over a patch. Vertices of the previous patch keep their forces; the others start with
    /// those of the new patch.
    pub(crate) fn adopt(&mut self, patch: &ContactPatch, poses: &[Pose; MAX_TOOLS]) {
        self.carry_over(patch);
        self.slide_on(patch, poses);
        for (i, own) in self.own.iter_mut().enumerate().take(self.n) {
            *own = patch.block(i, i);
        }
        self.place_vertices(patch);
    }

    fn carry_over(&mut self, patch: &ContactPatch) {
        let mut known = [Known {
            key: Key::NONE,
            force: Vec3::zeros(),
        }; MAX_CONTACTS];
        let n_known = self.n;
        for ((known, key), force) in known.iter_mut().zip(&self.key).zip(&self.force) {
            *known = Known {
                key: *key,
                force: *force,
            };
        }
        let known = known.get(..n_known).unwrap_or_default();
        self.n = patch.n_contacts.min(MAX_CONTACTS);
        for (i, ((candidate, force), anchor)) in patch
            .contacts
            .iter()
            .zip(&mut self.force)
            .zip(&mut self.anchor)
            .take(self.n)
            .enumerate()
        {
            // The order mostly stays the same from patch to patch, so the search starts at the same
            // index.
            let (before, after) = known.split_at(i.min(known.len()));
            let found = after
                .iter()
                .chain(before)
                .find(|k| k.key == Key::of(candidate));
            *force = found.map_or(candidate.force, |found| found.force);
            *anchor = candidate.anchor;
        }
        for (key, candidate) in self.key.iter_mut().zip(&patch.contacts) {
            *key = Key::of(candidate);
        }
    }

    /// Takes the anchors of contacts that slide along, where a tool has not come yet to the pose of its patch. Else
    /// friction would seem to be let go of on the way from there back to the tool.
    fn slide_on(&mut self, patch: &ContactPatch, poses: &[Pose; MAX_TOOLS]) {
        for (candidate, anchor) in patch.contacts.iter().zip(&mut self.anchor).take(self.n) {
            let (Some(tool), Some(pose)) = (
                tool_of(patch, candidate.tool),
                poses.get(candidate.tool as usize),
            ) else {
                continue;
            };
            let Some(friction) = sliding_friction(candidate, tool) else {
                continue;
            };
            let place = tool.pose * nalgebra::Point3::from(*anchor);
            let ahead = place - pose * nalgebra::Point3::from(*anchor);
            if friction.dot(&ahead) > 0.0 {
                *anchor = pose.inverse_transform_point(&place).coords;
            }
        }
    }

    /// Computes the positions without forces, and those with the forces that were carried over.
    fn place_vertices(&mut self, patch: &ContactPatch) {
        for (free, candidate) in self.free.chunks_exact_mut(3).zip(&patch.contacts) {
            free.copy_from_slice(candidate.position.as_slice());
        }
        let used = 3 * self.n;
        for (j, candidate) in patch.contacts.iter().enumerate().take(self.n) {
            add_columns(
                &patch.compliance,
                j,
                used,
                &-candidate.force,
                &mut self.free,
            );
        }
        self.position = self.free;
        for (j, force) in self.force.iter().enumerate().take(self.n) {
            add_columns(&patch.compliance, j, used, force, &mut self.position);
        }
    }
}

/// The friction on a contact, N, if it slides: the force across the tool's normal.
fn sliding_friction(candidate: &Candidate, tool: &ToolContact) -> Option<Vec3> {
    let normal = tool.pose.rotation * candidate.normal;
    let push = normal.dot(&candidate.force);
    let friction = candidate.force - normal * push;
    let most = tool.friction * push;
    let slides = !tool.is_bonded && most > 0.0 && friction.norm() >= SLIDES * most;
    slides.then_some(friction)
}
