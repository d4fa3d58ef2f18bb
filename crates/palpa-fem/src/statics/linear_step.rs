//! The step of a Newton iteration: displacements and multipliers of contact, in one linear system.
//!
//! ```text
//! K δu − δf(δu, δm) = r,    δm − δl(δu, δm) = s
//! ```
//! with the force `f` of contact, the multipliers `m` and what the law gives for them, `l`. GMRES
//! solves it. The factor of `K` with the stiffness of contact, then one step in which the multipliers
//! follow the forces, are its preconditioner.

use palpa_mesh::Vec3;

use super::contacts::Changes;
use super::newton::Newton;
use super::workspace::Workspace;
use crate::gmres::gmres;
use crate::system::Hold;

/// Least tolerance of a linear system with contact, and its largest basis.
const TIGHTEST: f64 = 1e-5;
const MOST_VECTORS: usize = 60;
/// Least tolerance and largest basis with the factor of an earlier iteration. A smaller residual would
/// save no iteration, and with a larger basis a new factor is cheaper.
const STALE_TOLERANCE: f64 = 1e-3;
const STALE_VECTORS: usize = 24;
/// In the last iteration, a linear system need not be solved better than the forces are to balance:
/// the residual of the forces after it, as a share of their tolerance, and the largest tolerance of
/// the linear system.
const LAST: f64 = 0.3;
const LOOSEST: f64 = 0.1;
/// Near an equilibrium, the tolerance is [`LOOSEST`] until the last iteration, or the one before it, can
/// be reached with no less than this: what the system is solved better, the next iteration does not
/// keep. The first factor is kept as long as this works, since a factor is the dearest part of a solve
/// of few iterations.
const NEAR_TIGHTEST: f64 = 1e-2;
const NEAR_VECTORS: usize = 40;

impl Newton<'_> {
    /// Finds the step: the prescribed displacements in held directions, the balance of the
    /// linearised forces in free ones, and multipliers that follow the law. Returns whether that is
    /// solved, which an old factor may not achieve.
    pub(super) fn solve(&self, ws: &mut Workspace, is_stale: bool) -> bool {
        let structure = &self.model.structure;
        let n = ws.right_side.len();
        let mut right = vec![Vec3::zeros(); n];
        structure.multiply(&ws.system.blocks, &ws.demand, &mut right);
        ws.remove_added(&ws.demand, &mut right);
        for ((carried, force), hold) in right.iter_mut().zip(&ws.right_side).zip(&ws.given) {
            *carried = hold.free_part(&(force - *carried));
        }
        right.extend(ws.contacts.mismatches().map(|mismatch| -mismatch));
        let mut is_solved = true;
        let delta = if ws.contacts.slots.is_empty() && !is_stale && ws.system.is_exact() {
            let mut delta = vec![Vec3::zeros(); n];
            ws.system.solve(structure, &right, &mut delta);
            delta
        } else {
            let ([tolerance, accepted], most) = self.accuracy(is_stale);
            let mut changes = Changes::default();
            let solution = gmres(&right, tolerance, accepted, most, |residual, step, out| {
                self.precondition(ws, residual, step, &mut changes);
                self.apply(ws, step, out, &mut changes);
            });
            is_solved = solution.residual <= accepted;
            solution.vector
        };
        ws.multipliers.clear();
        ws.multipliers.extend_from_slice(&delta[n..]);
        ws.delta.copy_from_slice(&delta[..n]);
        for (delta, demand) in ws.delta.iter_mut().zip(&ws.demand) {
            *delta += demand;
        }
        is_solved
    }

    /// Tolerance of the linear system, the residual that is accepted, and the largest basis.
    fn accuracy(&self, is_stale: bool) -> ([f64; 2], usize) {
        let last = LAST * self.params.tolerance / self.residual.max(self.mismatch);
        if self.params.is_near {
            let tolerance = if last < NEAR_TIGHTEST {
                LOOSEST
            } else {
                last.min(LOOSEST)
            };
            ([tolerance, LOOSEST], NEAR_VECTORS)
        } else if is_stale {
            ([last.clamp(STALE_TOLERANCE, LOOSEST); 2], STALE_VECTORS)
        } else {
            ([last.clamp(TIGHTEST, LOOSEST); 2], MOST_VECTORS)
        }
    }

    /// An approximate solution `step` for `residual`.
    fn precondition(
        &self,
        ws: &mut Workspace,
        residual: &[Vec3],
        step: &mut [Vec3],
        changes: &mut Changes,
    ) {
        let n = ws.delta.len();
        let (forces, laws) = residual.split_at(n);
        let (moves, multipliers) = step.split_at_mut(n);
        // First the multipliers alone, then the displacements under them.
        ws.contacts.change(&|_| Vec3::zeros(), laws, changes);
        let mut pushed = forces.to_vec();
        for (slot, force) in ws.contacts.slots.iter().zip(&changes.forces) {
            pushed[slot.node] = ws.given[slot.node].free_part(&(pushed[slot.node] + force));
        }
        ws.system.solve(&self.model.structure, &pushed, moves);
        keep_free(&ws.given, moves);
        let slots = &ws.contacts.slots;
        (ws.contacts).change(&|i| moves[slots[i].node], laws, changes);
        multipliers.copy_from_slice(laws);
        for (multiplier, change) in multipliers.iter_mut().zip(&changes.laws) {
            *multiplier += change;
        }
        // Springs in the factor bear a part of the force.
        for (_, [node, _], spring) in &ws.springs {
            let vertex = node / self.model.body.n_levels;
            if let Some(i) = ws.contacts.slot_at(vertex) {
                multipliers[i] -= spring * moves[*node];
            }
        }
    }

    /// Applies the linear system: `out = A step`.
    fn apply(&self, ws: &Workspace, step: &[Vec3], out: &mut [Vec3], changes: &mut Changes) {
        let n = ws.delta.len();
        let (moves, multipliers) = step.split_at(n);
        let (forces, laws) = out.split_at_mut(n);
        (self.model.structure).multiply(&ws.system.blocks, moves, forces);
        ws.remove_added(moves, forces);
        let slots = &ws.contacts.slots;
        (ws.contacts).change(&|i| moves[slots[i].node], multipliers, changes);
        for (slot, change) in slots.iter().zip(&changes.forces) {
            forces[slot.node] -= change;
        }
        keep_free(&ws.given, forces);
        for ((law, multiplier), change) in laws.iter_mut().zip(multipliers).zip(&changes.laws) {
            *law = multiplier - change;
        }
    }
}

impl Workspace {
    /// Subtracts what contact has added to the blocks from `forces = K moves`.
    fn remove_added(&self, moves: &[Vec3], forces: &mut [Vec3]) {
        for (_, [row, column], block) in self.added.iter().chain(&self.springs) {
            forces[*row] -= block * moves[*column];
            if row != column {
                forces[*column] -= block.tr_mul(&moves[*row]);
            }
        }
    }
}

/// Removes from every vector its part in held directions.
fn keep_free(holds: &[Hold], vectors: &mut [Vec3]) {
    for (vector, hold) in vectors.iter_mut().zip(holds) {
        *vector = hold.free_part(vector);
    }
}
