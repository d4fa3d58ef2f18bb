//! Chooses the vertices in contact, and puts supports, loads and tools on the linear system.

use palpa_mesh::Vec3;

use super::newton::{Imbalance, Newton};
use super::workspace::Workspace;
use crate::state::{State, Touch};

/// From this iteration on, the active set changes only when forces have settled, so that it cannot
/// oscillate.
const SETTLE_AFTER: usize = 12;
/// Share of the largest contact force below which a force counts as zero.
const NO_FORCE: f64 = 1e-9;

/// The forces that decide on contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ForcesBy {
    /// Forces at the present displacements: correct in equilibrium. After a large step they may be
    /// many times too large, or tensile.
    Present,
    /// Forces predicted by the linear system, as if they were unknowns of their own.
    Predicted,
}

impl Newton<'_> {
    /// Force below which the body counts as free of forces, N. The tolerance is relative to at
    /// least this force, which keeps it above rounding.
    fn floor(&self) -> f64 {
        let stiffest = self
            .model
            .materials
            .iter()
            .map(|m| m.law.shear_modulus())
            .fold(0.0, f64::max);
        let area: f64 = self.model.skin_areas.iter().sum();
        1e-6 * stiffest * area / self.model.skin_areas.len() as f64
    }

    /// Releases vertices under tension, and switches between sticking and sliding. Late in a solve
    /// only one vertex changes, the one that violates the laws of contact by the largest force, so
    /// that contact cannot oscillate. Returns the number of changes.
    pub(super) fn revise(&self, state: &mut State, ws: &mut Workspace, by: ForcesBy) -> usize {
        let forces = match by {
            ForcesBy::Present => &ws.forces,
            ForcesBy::Predicted => &ws.predicted,
        };
        let largest = ws
            .contacts
            .active
            .iter()
            .map(|c| forces[c.node].norm())
            .fold(0.0, f64::max);
        let least = NO_FORCE * largest.max(self.floor());
        let changes = ws
            .contacts
            .active
            .iter()
            .enumerate()
            .filter_map(|(i, contact)| {
                let force = &forces[contact.node];
                let (touch, doubt) = contact.revised(force, least)?;
                Some((i, touch, doubt))
            });
        let mut changes: Vec<(usize, Touch, f64)> = changes.collect();
        if self.iterations >= SETTLE_AFTER {
            changes.sort_by(|a, b| b.2.total_cmp(&a.2));
            changes.truncate(1);
        }
        for &(i, touch, _) in &changes {
            let contact = &mut ws.contacts.active[i];
            contact.touch = touch;
            state.touches[contact.vertex] = touch;
        }
        ws.contacts.active.retain(|c| c.touch != Touch::Open);
        changes.len()
    }

    /// Collects the held directions and the prescribed displacements along them; adds friction and
    /// the tools' curvature to the system.
    pub(super) fn put_constraints(
        &mut self,
        state: &State,
        ws: &mut Workspace,
        by: ForcesBy,
    ) -> Imbalance {
        // First remove the stiffness that contact has added since the last assembly.
        for (block, stiffness) in ws.added.drain(..) {
            ws.system.blocks[block] -= stiffness;
        }
        ws.holds.copy_from_slice(&ws.given);
        ws.demand.fill(Vec3::zeros());
        ws.right_side.copy_from_slice(&ws.forces);
        ws.contact_forces.copy_from_slice(match by {
            ForcesBy::Present => &ws.forces,
            ForcesBy::Predicted => &ws.predicted,
        });
        let of_loads = self.demand_of_loads(state, ws);
        let largest = self.constrain_contacts(ws, of_loads);
        let (free, held) = self.norms(ws);
        self.residual = free / held.max(self.floor());
        Imbalance {
            free,
            demand: largest,
        }
    }

    /// Displacements prescribed by holds and guides. Returns the largest, m.
    fn demand_of_loads(&self, state: &State, ws: &mut Workspace) -> f64 {
        let mut largest = 0.0_f64;
        for &(node, target) in self.load.held {
            let demand = target - state.displacements[node];
            ws.demand[node] = demand;
            largest = largest.max(demand.norm());
        }
        for &(node, direction, target) in self.load.guided {
            let demand = target - state.displacements[node].dot(&direction);
            ws.demand[node] += direction * demand;
            largest = largest.max(demand.abs());
        }
        largest
    }

    /// Holds, displacements, friction and stiffness of the vertices in contact. Returns the largest
    /// prescribed displacement, m, or `largest`.
    fn constrain_contacts(&self, ws: &mut Workspace, mut largest: f64) -> f64 {
        for contact in &ws.contacts.active {
            let node = contact.node;
            let force = ws.contact_forces[node];
            let (hold, demand) = contact.demand(ws.given[node], &force);
            ws.holds[node] = hold;
            ws.demand[node] = demand;
            largest = largest.max(demand.norm());
            let mut stiffness = contact.geometric(&force);
            if let Touch::Slip { .. } = contact.touch {
                let (friction, slope) = contact.friction(&force);
                ws.right_side[node] -= friction;
                stiffness += slope;
            }
            let block = self.model.structure.diagonal(node);
            ws.system.blocks[block] += stiffness;
            ws.added.push((block, stiffness));
        }
        largest
    }

    /// Norms of the forces in free and in held directions, N.
    fn norms(&self, ws: &Workspace) -> (f64, f64) {
        let (mut free_sq, mut held_sq) = (0.0, 0.0);
        for ((force, whole), hold) in ws.right_side.iter().zip(&ws.forces).zip(&ws.holds) {
            let free = hold.free_part(force);
            free_sq += free.norm_squared();
            held_sq += (whole - free).norm_squared();
        }
        let loads: f64 = self.load.forces.iter().map(Vec3::norm_squared).sum();
        (free_sq.sqrt(), held_sq.max(loads).sqrt())
    }
}
