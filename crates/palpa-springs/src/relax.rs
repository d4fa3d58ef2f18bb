//! The corrections by explicit Euler, (3.21) and (3.22), as they are meant: restoring, and scaled to be stable.
//!
//! ```text
//!            1      1
//!     U_a =  ─ · ─────── ( α Σ_i k_i (l_i − L_i) e_i  −  β k̄_a (P_a − S_a) )
//!            2   Σ_i k_i
//! ```
//! over the bars `i` at node `a`: `l` and `L` their length now and at rest, `e` the unit direction away from `a`, `S_a` the
//! node's place at rest, `k̄_a` the mean of the bars' stiffnesses (the initial shape holds a node as one more bar would).
//! The ½ is the thesis's.
//!
//! **Stable**: with `D = diag(Σ_i k_i)`, a bar's tangent is at most `k I` (its axial part is `k ccᵀ`, its transverse part
//! `k (1 − L/l) < k`), and `Σ k |u_a − u_b|² ≤ 2 Σ k (|u_a|² + |u_b|²) = 2 uᵀDu`, so no eigenvalue of `½ D⁻¹K` exceeds 1,
//! and a step with `α = 1` cannot overshoot; the shape term adds at most `½ β`. Explicit Euler is unstable from 2 on.
//!
//! **Force**: a correction moves free nodes, so bars at operated nodes change; `K` times the correction is added to the
//! sums along the path, as for any other increment. Then nodal forces still add up to zero, the force keeps following the
//! bars, and what the correction leaves unbalanced is seen at the free nodes.

use palpa_mesh::Vec3;

use crate::constraints::Role;
use crate::model::SpringModel;
use crate::state::{SpringState, Workspace};
use crate::step::{Corrections, nodal_forces};

/// Fills `ws.increments` with one correction of all free nodes, and `ws.forces` with its nodal forces.
pub(crate) fn relax(
    model: &SpringModel,
    state: &SpringState,
    ws: &mut Workspace,
    corrections: &Corrections,
) {
    let spring_gain = held_to_range(corrections.spring_gain);
    let shape_gain = held_to_range(corrections.shape_gain);
    ws.system.update_directions(&model.bars, &state.positions);
    let pulls = &mut ws.increments;
    pulls.fill(Vec3::zeros());
    for (bar, c) in model.bars.iter().zip(&ws.system.directions) {
        let (a, b) = (bar.a as usize, bar.b as usize);
        let length = c.dot(&(state.positions[b] - state.positions[a]));
        let pull = c * (spring_gain * bar.stiffness * (length - bar.length));
        pulls[a] += pull;
        pulls[b] -= pull;
    }
    for (node, pull) in pulls.iter_mut().enumerate() {
        let freedom = &model.freedoms[node];
        let stiffness = model.stiffness_at[node];
        if freedom.role != Role::Free || stiffness <= 0.0 {
            *pull = Vec3::zeros();
            continue;
        }
        let away = state.positions[node] - model.rest[node];
        let mean = stiffness / f64::from(model.n_bars_at[node]);
        let correction = (*pull - away * (shape_gain * mean)) * (0.5 / stiffness);
        *pull = freedom.project(&correction);
    }
    nodal_forces(
        &model.bars,
        &ws.system.directions,
        &ws.increments,
        &mut ws.forces,
    );
}

/// A gain from 0 to 1; what is not a number is 0.
fn held_to_range(gain: f64) -> f64 {
    if gain > 0.0 { gain.min(1.0) } else { 0.0 }
}
