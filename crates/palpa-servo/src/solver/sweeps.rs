//! The iteration: sweeps of block Gauss–Seidel, and a conjugate gradient step on top of each.

use super::{ContactSolver, add_columns, vec3};
use crate::{ContactPatch, MAX_TOOLS, Vec3};

/// Change of the forces that does not matter, N: the sweeps end below it.
const CHANGE_DUST: f64 = 1e-7;
/// Weight of the changes of single contacts, relative to the changes of the tools' forces. A hand
/// feels the tools' forces only; single contacts settle last where vertices are dense.
const CONTACT_SHARE: f64 = 0.1;

/// Effort and quality of a solution.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Solution {
    pub(crate) sweeps: u32,
    /// Change of the forces in the last sweep, as a share of their sum.
    pub(crate) residual: f64,
    /// Contacts with a force.
    pub(crate) n_active: u32,
    /// Contacts with a force that slide.
    pub(crate) n_sliding: u32,
}

/// The effect of one sweep.
struct Sweep {
    /// Change of the tools' forces, plus a share of the change of the contacts' forces, N.
    change: f64,
    /// Sum of the squares of the contacts' changes, N².
    change_sq: f64,
    /// Sum of the sizes of the contacts' forces, N.
    sum: f64,
}

impl ContactSolver {
    /// Sweeps until the forces settle, `allowed` times at most.
    pub(super) fn sweep_until_done(
        &mut self,
        patch: &ContactPatch,
        couplings: &[f64; MAX_TOOLS],
        tolerance: f64,
        allowed: u32,
        solution: &mut Solution,
    ) {
        let mut last_sq = 0.0;
        for k in 0..allowed {
            self.last_force = self.force;
            self.last_position = self.position;
            let Sweep {
                change,
                change_sq,
                sum,
            } = self.sweep(patch, couplings);
            solution.sweeps += 1;
            solution.residual = change / sum.max(CHANGE_DUST);
            // A NaN ends the sweeps too.
            if change.is_nan() || change <= tolerance * sum + CHANGE_DUST || k + 1 == allowed {
                break;
            }
            let beta = if k > 0 && last_sq > 0.0 {
                change_sq / last_sq
            } else {
                0.0
            };
            last_sq = change_sq;
            // If the change grows again, the set of active contacts has changed, so the directions
            // are reset.
            let beta = if beta > 1.0 { 0.0 } else { beta };
            self.go_on(beta);
            self.update_stretch(patch, couplings);
        }
    }

    /// Steps along the conjugate direction; `beta` is the share of the previous direction in it.
    #[inline]
    fn go_on(&mut self, beta: f64) {
        let used = 3 * self.n;
        for (((force, last), direction), _) in self
            .force
            .iter_mut()
            .zip(&self.last_force)
            .zip(&mut self.direction)
            .zip(0..self.n)
        {
            let step = *force - last;
            let kept = if beta > 0.0 {
                *direction * beta
            } else {
                Vec3::zeros()
            };
            *force += kept;
            *direction = kept + step;
        }
        for (((x, last), drift), _) in self
            .position
            .iter_mut()
            .zip(&self.last_position)
            .zip(&mut self.drift)
            .zip(0..used)
        {
            let step = *x - last;
            let kept = if beta > 0.0 { *drift * beta } else { 0.0 };
            *x += kept;
            *drift = kept + step;
        }
    }

    /// Solves all contacts once, one after the other.
    #[inline]
    fn sweep(&mut self, patch: &ContactPatch, couplings: &[f64; MAX_TOOLS]) -> Sweep {
        let used = 3 * self.n;
        let (mut change, mut change_sq, mut sum) = (0.0, 0.0, 0.0);
        let mut tool_change = [Vec3::zeros(); MAX_TOOLS];
        for (i, (((contact, candidate), force), is_sliding)) in self
            .contact
            .iter()
            .zip(&patch.contacts)
            .zip(&mut self.force)
            .zip(&mut self.is_sliding)
            .enumerate()
            .take(self.n)
        {
            let t = candidate.tool as usize;
            let (Some(x), Some(stretch), Some(coupling)) = (
                self.position.get(3 * i..3 * i + 3),
                self.stretch.get_mut(t),
                couplings.get(t),
            ) else {
                continue;
            };
            let relaxed = contact.relax(&(vec3(x) - *stretch), force);
            *is_sliding = relaxed.is_sliding;
            let by_sq = relaxed.force.norm_squared();
            if by_sq != 0.0 {
                *force += relaxed.force;
                if force.norm_squared() < 1e-24 {
                    *force = Vec3::zeros();
                }
                *stretch -= relaxed.force * *coupling;
                add_columns(
                    &patch.compliance,
                    i,
                    used,
                    &relaxed.force,
                    &mut self.position,
                );
                change += libm::sqrt(by_sq);
                change_sq += by_sq;
                if let Some(tool_change) = tool_change.get_mut(t) {
                    *tool_change += relaxed.force;
                }
            }
            sum += force.norm();
        }
        let tools = tool_change.iter().map(Vec3::norm).sum::<f64>();
        Sweep {
            change: tools + CONTACT_SHARE * change,
            change_sq,
            sum,
        }
    }
}
