//! The line search: the share of a Newton step that is taken.

use palpa_mesh::Vec3;

use super::constraints::Imbalance;
use super::contacts::{Slot, move_multipliers};
use super::newton::Newton;
use super::workspace::Workspace;
use crate::assembly::{Inverted, energy};
use crate::contact::Touch;
use crate::state::State;

/// Number of halvings after which a Newton step has failed.
const MOST_HALVINGS: usize = 8;
/// Growth of the imbalance that is let pass.
const GROWTH: f64 = 1.000_1;

impl Newton<'_> {
    /// Moves along the step as far as no prism inverts and the imbalance does not grow, or without
    /// contact the energy falls. If it grows anyhow, takes the share with the least. Displacements that
    /// are still prescribed must be reached, whatever the forces.
    pub(super) fn search(
        &mut self,
        state: &mut State,
        ws: &mut Workspace,
        imbalance: Imbalance,
        is_led: bool,
    ) -> Result<f64, Inverted> {
        let start = state.displacements.clone();
        let multipliers = std::mem::take(&mut ws.multipliers);
        let slots: Vec<_> = ws.contacts.slots.clone();
        let touches = state.touches.clone();
        let mut best: Option<(f64, f64)> = None;
        let mut last = None;
        let mut share = 1.0;
        for _ in 0..=MOST_HALVINGS {
            match self.try_share(state, ws, (&start, &touches), (&slots, &multipliers), share) {
                Ok(whole) => {
                    let is_good = whole <= imbalance.whole() * GROWTH
                        || (slots.is_empty() && {
                            let energy = |u: &[Vec3]| energy(self.model, &ws.memory, u);
                            energy(&state.displacements) < energy(&start)
                        });
                    if is_led || is_good {
                        return Ok(share);
                    }
                    if best.is_none_or(|best| whole < best.1) {
                        best = Some((share, whole));
                    }
                }
                Err(inverted) => last = Some(inverted),
            }
            share *= 0.5;
        }
        let Some((share, _)) = best else {
            return Err(last.unwrap_or(Inverted { at: Vec3::zeros() }));
        };
        self.try_share(state, ws, (&start, &touches), (&slots, &multipliers), share)?;
        Ok(share)
    }

    /// Goes a share of the step from the start. Returns the imbalance there, N.
    fn try_share(
        &mut self,
        state: &mut State,
        ws: &mut Workspace,
        (start, touches): (&[Vec3], &[Touch]),
        (slots, multipliers): (&[Slot], &[Vec3]),
        share: f64,
    ) -> Result<f64, Inverted> {
        for ((u, start), delta) in state.displacements.iter_mut().zip(start).zip(&ws.delta) {
            *u = start + delta * share;
        }
        state.touches.copy_from_slice(touches);
        move_multipliers(slots, multipliers, share, &mut state.touches);
        (ws.assembler).forces(self.model, &ws.memory, &state.displacements, &mut ws.forces)?;
        self.add_loads(state, ws, false);
        self.touch(state, ws);
        Ok(self.balance(ws).whole())
    }
}
