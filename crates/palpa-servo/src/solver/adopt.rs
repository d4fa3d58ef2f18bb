//! Taking over a new patch: vertices of the previous patch keep their forces. The tissue decides what
//! sticks and where, so the anchors are those of the patch.

use super::{ContactSolver, add_columns};
use crate::{Candidate, ContactPatch, MAX_CONTACTS, Vec3};

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
    pub(crate) fn adopt(&mut self, patch: &ContactPatch) {
        self.carry_over(patch);
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
