//! The step of a Newton iteration: solution of the linear system, with friction and with kept
//! factors.

use palpa_mesh::Vec3;

use super::newton::Newton;
use super::workspace::Workspace;
use crate::gmres::gmres;
use crate::system::Hold;

/// Residual of a linear system with friction, relative to its right side.
const GMRES_TOLERANCE: f64 = 1e-6;
/// Largest basis for such a system.
const GMRES_VECTORS: usize = 40;
/// Least tolerance and largest basis with the factor of an earlier iteration. A smaller residual would
/// save no iteration, and with a larger basis a new factor is cheaper.
const STALE_TOLERANCE: f64 = 1e-3;
const STALE_VECTORS: usize = 16;
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
const NEAR_VECTORS: usize = 30;

impl Newton<'_> {
    /// Finds the step `δ`: the prescribed displacements in held directions, and the balance of the
    /// linearised forces in free ones. Returns whether the forces are in balance, which an old
    /// factor may not achieve.
    ///
    /// Friction on a sliding vertex grows with its pressure, which makes the stiffness unsymmetric:
    /// `(I − μ d ⊗ n) K` in the rows of that vertex. The symmetric factor is then a good
    /// preconditioner for GMRES. So is the factor of an earlier stiffness that has changed little,
    /// under constraints of which few have changed.
    pub(super) fn solve(&self, ws: &mut Workspace, is_stale: bool) -> bool {
        let structure = &self.model.structure;
        let Workspace {
            system,
            contact_forces,
            right_side,
            demand,
            delta,
            predicted,
            holds,
            contacts,
            added,
            ..
        } = ws;
        predicted.fill(Vec3::zeros());
        let mut carried = vec![Vec3::zeros(); right_side.len()];
        structure.multiply(&system.blocks, demand, &mut carried);
        let sliding = contacts.sliding(contact_forces);
        couple(&sliding, &mut carried);
        for ((force, carried), hold) in right_side.iter().zip(&mut carried).zip(holds.iter()) {
            *carried = hold.free_part(&-(*force + *carried));
        }
        let mut is_solved = true;
        if sliding.is_empty() && !is_stale && system.is_exact() {
            system.solve(structure, &carried, delta);
        } else {
            let last = LAST * self.params.tolerance / self.residual;
            let ([tolerance, accepted], most) = if self.params.is_near {
                let tolerance = if last < NEAR_TIGHTEST {
                    LOOSEST
                } else {
                    last.min(LOOSEST)
                };
                ([tolerance, LOOSEST], NEAR_VECTORS)
            } else if is_stale || sliding.is_empty() {
                ([last.clamp(STALE_TOLERANCE, LOOSEST); 2], STALE_VECTORS)
            } else {
                ([GMRES_TOLERANCE; 2], GMRES_VECTORS)
            };
            let solution = gmres(&carried, tolerance, accepted, most, |force, step, out| {
                system.solve(structure, force, step);
                keep_free(holds, step);
                structure.multiply(&system.blocks, step, out);
                couple(&sliding, out);
                keep_free(holds, out);
            });
            is_solved = solution.residual <= accepted;
            *delta = solution.vector;
        }
        for (delta, demand) in delta.iter_mut().zip(demand.iter()) {
            *delta += demand;
        }
        structure.multiply(&system.blocks, delta, predicted);
        // The stiffness that contact has added does not belong to the body.
        for (contact, (_, stiffness)) in contacts.active.iter().zip(added.iter()) {
            predicted[contact.node] -= stiffness * delta[contact.node];
        }
        is_solved
    }
}

/// Adds to sliding vertices the friction due to the pressure in `forces`: `f −= μ d (n · f)`.
fn couple(sliding: &[(usize, Vec3, Vec3)], forces: &mut [Vec3]) {
    for (node, friction, normal) in sliding {
        let pressure = normal.dot(&forces[*node]);
        forces[*node] -= friction * pressure;
    }
}

/// Removes from every vector its part in held directions.
fn keep_free(holds: &[Hold], vectors: &mut [Vec3]) {
    for (vector, hold) in vectors.iter_mut().zip(holds) {
        *vector = hold.free_part(vector);
    }
}
