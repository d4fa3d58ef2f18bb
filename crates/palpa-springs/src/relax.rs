//! The corrections by explicit Euler, (3.21) and (3.22), as the thesis means them: restoring, and
//! scaled to be stable.
//!
//! ```text
//!            1      1
//!     U_a =  ─ · ─────── ( α Σ_i k_i (l_i − L_i) e_i  −  β k̄_a (P_a − S_a) )
//!            2   Σ_i k_i
//! ```
//! The sum is over the bars `i` at node `a`. `l` and `L` are a bar's present and natural length,
//! `e` the unit direction away from `a`, and `S_a` the rest position of the node. `k̄_a` is the
//! mean stiffness of the bars at the node: the initial shape pulls a node as one more bar would.
//! The ½ is from the thesis.
//!
//! **Stable**: let `D = diag(Σ_i k_i)`. A bar's tangent is at most `k I` (its axial part is
//! `k ccᵀ`, its transverse part `k (1 − L/l) < k`), and
//! `Σ k |u_a − u_b|² ≤ 2 Σ k (|u_a|² + |u_b|²) = 2 uᵀDu`. So no eigenvalue of `½ D⁻¹K` exceeds 1,
//! and a step with `α = 1` cannot overshoot. The shape term adds at most `½ β`. Explicit Euler is
//! unstable from 2 on.
//!
//! **Force**: a correction moves free nodes, so the forces of bars at operated nodes change. `K`
//! times the correction is added to the sums along the path, as for any other increment. Nodal
//! forces therefore still add up to zero, and the force keeps following the bars. An imbalance that
//! the correction leaves shows at the free nodes.

use palpa_mesh::Vec3;

use crate::constraints::Role;
use crate::model::SpringModel;
use crate::state::{SpringState, Workspace};
use crate::step::{Corrections, nodal_forces};

/// Fills `ws.increments` with one correction of all free nodes, and `ws.forces` with its nodal
/// forces.
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

/// Limits a gain to the range from 0 to 1; NaN becomes 0.
fn held_to_range(gain: f64) -> f64 {
    if gain > 0.0 { gain.min(1.0) } else { 0.0 }
}
