//! The line search: the share of a Newton step that is taken.

use palpa_mesh::Vec3;

use super::newton::{Imbalance, Newton};
use super::workspace::Workspace;
use crate::assembly::{Inverted, energy};
use crate::state::State;

/// Number of halvings after which a Newton step has failed.
const MOST_HALVINGS: usize = 8;
/// Distance by which a sliding vertex may leave the tool's surface in an iteration, as a share of
/// the surface's radius of curvature.
const NEAR_SURFACE: f64 = 0.05;

impl Newton<'_> {
    /// Moves along `δ` as far as no prism inverts and the forces do not grow. Returns the share of
    /// `δ`.
    pub(super) fn search(
        &self,
        state: &mut State,
        ws: &mut Workspace,
        imbalance: Imbalance,
    ) -> Result<f64, Inverted> {
        let mut share = 1.0;
        let mut last = None;
        // While the skin still has to be moved to the tool, forces must grow.
        let must_fall = imbalance.demand <= self.params.gap_tolerance.max(1e-6)
            && ws.contacts.active.iter().all(|c| c.friction == 0.0);
        for _ in 0..=MOST_HALVINGS {
            for ((trial, u), delta) in ws.trial.iter_mut().zip(&state.displacements).zip(&ws.delta)
            {
                *trial = u + delta * share;
            }
            let result =
                ws.assembler
                    .forces(self.model, &ws.memory, &ws.trial, &mut ws.trial_forces);
            last = result.err();
            let is_good = last.is_none()
                && self.keeps_touch(ws, share)
                && (!must_fall || self.is_better(state, ws, imbalance.free));
            if is_good {
                std::mem::swap(&mut state.displacements, &mut ws.trial);
                return Ok(share);
            }
            share *= 0.5;
        }
        if let Some(inverted) = last {
            return Err(inverted);
        }
        // Due to rounding or a poor linear model: take the shortest move, and let the next
        // iterations decide.
        std::mem::swap(&mut state.displacements, &mut ws.trial);
        Ok(2.0 * share)
    }

    /// Whether sliding vertices stay near the tool's surface. The linear step ignores its
    /// curvature.
    fn keeps_touch(&self, ws: &Workspace, share: f64) -> bool {
        ws.contacts.active.iter().all(|contact| {
            let x = self.model.body.positions[contact.node] + ws.trial[contact.node];
            let gap = contact.moved(self.load.tools, &x).gap.abs();
            let radius = 1.0 / contact.sharpness().max(1.0);
            gap <= ((1.0 - 0.5 * share) * contact.gap.abs()).max(NEAR_SURFACE * radius)
        })
    }

    /// Whether the trial has less energy, or smaller free forces.
    fn is_better(&self, state: &State, ws: &mut Workspace, free_before: f64) -> bool {
        let mut forces = std::mem::take(&mut ws.trial_forces);
        for (force, load) in forces.iter_mut().zip(self.load.forces) {
            *force -= load;
        }
        if let Some(inertia) = &self.inertia {
            inertia.add(self.model, &ws.trial, &mut forces, None);
        }
        let free_sq: f64 = forces
            .iter()
            .zip(&ws.holds)
            .map(|(force, hold)| hold.free_part(force).norm_squared())
            .sum();
        ws.trial_forces = forces;
        free_sq.sqrt() <= free_before * 1.000_1
            || (ws.contacts.active.is_empty() && {
                let energy = |u: &[Vec3]| energy(self.model, &ws.memory, u);
                energy(&ws.trial) < energy(&state.displacements)
            })
    }
}
