//! Puts supports, loads and contact on the linear system.

use palpa_mesh::Vec3;

use super::newton::Newton;
use super::workspace::Workspace;
use crate::state::State;

/// How far a state is from equilibrium.
#[derive(Debug, Clone, Copy)]
pub(super) struct Imbalance {
    /// Norm of the forces in free directions, N.
    pub(super) free: f64,
    /// Norm of what the multipliers of contact lack, N.
    pub(super) mismatch: f64,
    /// Forces that hold the body, N.
    pub(super) held: f64,
}

impl Imbalance {
    /// Norm of all that is to vanish, N.
    pub(super) fn whole(&self) -> f64 {
        self.free.hypot(self.mismatch)
    }
}

impl Newton<'_> {
    /// Force below which the body counts as free of forces, N. The tolerance is relative to at
    /// least this force, which keeps it above rounding.
    pub(super) fn floor(&self) -> f64 {
        let stiffest = self
            .model
            .materials
            .iter()
            .map(|m| m.law.shear_modulus())
            .fold(0.0, f64::max);
        let area: f64 = self.model.skin_areas.iter().sum();
        1e-6 * stiffest * area / self.model.skin_areas.len() as f64
    }

    /// Finds the contacts at the present displacements.
    pub(super) fn touch(&self, state: &State, ws: &mut Workspace) {
        ws.contacts.update(
            self.model,
            &state.displacements,
            self.load.tools,
            &ws.given,
            (&state.touches, &ws.origin),
        );
    }

    /// Forces that are not in balance, in `right_side`; and how far the state is from equilibrium.
    pub(super) fn balance(&mut self, ws: &mut Workspace) -> Imbalance {
        for (right, force) in ws.right_side.iter_mut().zip(&ws.forces) {
            *right = -force;
        }
        for slot in &ws.contacts.slots {
            ws.right_side[slot.node] += slot.force();
        }
        let imbalance = self.imbalance(ws);
        self.residual = imbalance.free / imbalance.held;
        self.mismatch = imbalance.mismatch / imbalance.held;
        imbalance
    }

    /// How far `right_side` and the multipliers are from equilibrium.
    pub(super) fn imbalance(&self, ws: &Workspace) -> Imbalance {
        let (mut free_sq, mut held_sq) = (0.0, 0.0);
        for (force, hold) in ws.right_side.iter().zip(&ws.given) {
            let free = hold.free_part(force);
            free_sq += free.norm_squared();
            held_sq += (force - free).norm_squared();
        }
        let contact: f64 = (ws.contacts.slots.iter())
            .map(|slot| slot.force().norm_squared())
            .sum();
        let loads: f64 = self.load.forces.iter().map(Vec3::norm_squared).sum();
        let mismatch: f64 = ws.contacts.mismatches().map(|m| m.norm_squared()).sum();
        Imbalance {
            free: free_sq.sqrt(),
            mismatch: mismatch.sqrt(),
            held: (held_sq + contact).max(loads).sqrt().max(self.floor()),
        }
    }

    /// Collects the held directions and the prescribed displacements along them. Returns the largest
    /// of these, m.
    pub(super) fn demand(&self, state: &State, ws: &mut Workspace) -> f64 {
        ws.demand.fill(Vec3::zeros());
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

    /// Adds the stiffness of contact to the blocks of the system.
    pub(super) fn stiffen(&self, ws: &mut Workspace) {
        ws.take_off();
        let model = self.model;
        let Workspace {
            system,
            contacts,
            added,
            ..
        } = ws;
        contacts.stiffness(|v, w, block| {
            if let Some(place) = model.structure.skin_block(v, w) {
                system.blocks[place] += block;
                let nodes = [model.body.node(v, 0), model.body.node(w, 0)];
                added.push((place, nodes, block));
            }
        });
        self.spring(ws, ws.spring);
    }

    /// Sets the stiffness of the springs that hold the pressed vertices in the factor, as a share of
    /// the skin's own.
    pub(super) fn spring(&self, ws: &mut Workspace, share: f64) {
        for (place, _, spring) in ws.springs.drain(..) {
            ws.system.blocks[place] -= spring;
        }
        ws.spring = share;
        if share == 0.0 {
            return;
        }
        for (vertex, spring) in ws.contacts.springs(self.model, share) {
            let node = self.model.body.node(vertex, 0);
            if let Some(place) = self.model.structure.skin_block(vertex, vertex) {
                ws.system.blocks[place] += spring;
                ws.springs.push((place, [node; 2], spring));
            }
        }
    }
}

impl Workspace {
    /// Forgets the stiffness that contact has added, which is no longer in the blocks.
    pub(super) fn forget_added(&mut self) {
        self.added.clear();
        self.springs.clear();
    }

    /// Takes the stiffness that contact has added out of the blocks.
    fn take_off(&mut self) {
        for (place, _, block) in self.added.drain(..).chain(self.springs.drain(..)) {
            self.system.blocks[place] -= block;
        }
    }
}
