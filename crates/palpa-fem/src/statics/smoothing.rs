//! Smoothed friction, for steps where the exact law does not converge at once.

use super::newton::Newton;
use super::report::Outcome;
use super::workspace::Workspace;
use crate::state::{State, Touch};

/// Slips over which friction is smoothed, in this order, m.
const SMOOTHING: [f64; 4] = [1e-3, 2e-4, 4e-5, 1e-5];
/// Largest smoothing that is accepted as a result if the exact law does not converge, m.
const FINE_SMOOTHING: f64 = 5e-5;

impl Newton<'_> {
    /// Solves with smoothed friction, then with the exact law from there. If the exact law does not
    /// converge, a fine smoothing gives the result.
    pub(super) fn run_smoothed(&mut self, state: &mut State, ws: &mut Workspace) -> Outcome {
        for touch in &mut state.touches {
            if let Touch::Stick { tool, anchor } = *touch {
                *touch = Touch::Slip { tool, anchor };
            }
        }
        let mut spent = self.iterations;
        let mut good = None;
        for smoothing in SMOOTHING {
            ws.contacts.smoothing = smoothing;
            self.iterations = 0;
            let outcome = self.run(state, ws);
            spent += self.iterations;
            if outcome != Outcome::Converged {
                if good.is_none() {
                    self.iterations = spent;
                    return outcome;
                }
                break;
            }
            good = Some((
                smoothing,
                state.displacements.clone(),
                state.touches.clone(),
            ));
        }
        for contact in &ws.contacts.active {
            state.touches[contact.vertex] = contact.sharpened();
        }
        ws.contacts.smoothing = 0.0;
        self.iterations = 0;
        let mut outcome = self.run(state, ws);
        spent += self.iterations;
        if let Some((smoothing, displacements, touches)) = good
            && outcome != Outcome::Converged
            && smoothing <= FINE_SMOOTHING
        {
            state.displacements = displacements;
            state.touches = touches;
            ws.contacts.smoothing = smoothing;
            self.iterations = 0;
            outcome = self.run(state, ws);
            spent += self.iterations;
        }
        self.iterations = spent;
        outcome
    }
}
