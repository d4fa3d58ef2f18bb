//! Parts that fourth-order tangents are made of.
//!
//! A tangent `A` has the entry `∂P_ij/∂F_kl` at row `i + 3 j` and column `k + 3 l`.

use crate::{Mat3, Mat9};

/// Adds `w (a⊗b)`, that is `w a_ij b_kl`.
#[inline]
pub(super) fn add_outer(tangent: &mut Mat9, w: f64, a: &Mat3, b: &Mat3) {
    for (column, b_kl) in tangent.data.0.iter_mut().zip(b.data.0.as_flattened()) {
        let factor = w * b_kl;
        for (entry, a_ij) in column.iter_mut().zip(a.data.0.as_flattened()) {
            *entry += factor * a_ij;
        }
    }
}

/// Adds `w a_il a_kj`, which takes `dF` to `w a dFᵀ a`.
#[inline]
pub(super) fn add_exchange(tangent: &mut Mat9, w: f64, a: &Mat3) {
    let a = &a.data.0;
    for (kl, column) in tangent.data.0.iter_mut().enumerate() {
        let (k, l) = (kl % 3, kl / 3);
        for j in 0..3 {
            let factor = w * a[j][k];
            for i in 0..3 {
                column[i + 3 * j] += factor * a[l][i];
            }
        }
    }
}

/// Adds `w b_ik δ_jl`, which takes `dF` to `w b dF`.
#[inline]
pub(super) fn add_left(tangent: &mut Mat9, w: f64, b: &Mat3) {
    for j in 0..3 {
        for k in 0..3 {
            for i in 0..3 {
                tangent[(i + 3 * j, k + 3 * j)] += w * b[(i, k)];
            }
        }
    }
}

/// Adds `w δ_ik c_lj`, which takes `dF` to `w dF c`.
#[inline]
pub(super) fn add_right(tangent: &mut Mat9, w: f64, c: &Mat3) {
    for l in 0..3 {
        for j in 0..3 {
            for i in 0..3 {
                tangent[(i + 3 * j, i + 3 * l)] += w * c[(l, j)];
            }
        }
    }
}

/// Adds `w δ_ik δ_jl`, which takes `dF` to `w dF`.
#[inline]
pub(super) fn add_identity(tangent: &mut Mat9, w: f64) {
    for ij in 0..9 {
        tangent[(ij, ij)] += w;
    }
}
