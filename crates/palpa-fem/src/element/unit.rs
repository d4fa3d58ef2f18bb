//! Two points over the thickness of a layer, with the thickness correction.
//!
//! With one volume change for the whole thickness a layer would bend with a third of its stiffness.
//! So the part of the volume change that is linear over the depth is taken out along the thickness
//! alone:
//!
//! ```text
//! F^_q = F_q + (s_q − 1) (F_q M) ⊗ m,   s_q = Jb / J_q,   Jb = Σ v_q J_q,   J_q = det F_q,   v_q = V_q / Σ V
//! ```
//! `M = ∂X/∂ζ` and `m = grad ζ` are constant over the group, so that a uniform deformation stays
//! uniform (patch test), and `det F^_q = Jb`. The small-strain likeness has
//! `J_q = 1 + tr(F_q − I)`, `s_q = 1 + Jb − J_q` and `F_q M → M`.
//!
//! Derivatives, with `C_q = ∂J_q/∂F_q`, `P^_q` and `H^_q` the weighted stress and tangent at
//! `F^_q`:
//!
//! ```text
//! A_q = I + (s_q − 1) M ⊗ m,  a_q = (F_q M) ⊗ m,  k_q = P^_q : a_q,  δF^_q = δF_q A_q + a_q δs_q
//! δs_q = Σ_p S_qp : δF_p,     S_qp = (v_p / J_q) C_p − δ_qp (s_q / J_q) C_q
//! P_q  = P^_q A_qᵀ + g_q C_q, g_q = v_q Σ_p k_p / J_p − k_q s_q / J_q
//! H_pr = δ_pr [A_p H^_p A_p + g_p D(F_p)] + Σ_q [S_qp w_q δ_qr + δ_qp w_q S_qr + β_q S_qp S_qr]
//! w_q  = (H^_q a_q) A_qᵀ + (P^_q m) ⊗ M − (k_q / J_q) C_q,   β_q = a_q : H^_q a_q
//! ```

use palpa_mesh::Vec3;

use crate::{Kinematics, Mat3, Mat9};

type Vec9 = nalgebra::SVector<f64, 9>;

/// Response of a material at a point: energy, stress and tangent, all times the point's volume.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PointResponse {
    pub(crate) energy: f64,
    pub(crate) stress: Mat3,
    pub(crate) tangent: Mat9,
}

/// The response of the two points together to their uncorrected deformation gradients.
#[derive(Debug, Clone, Copy)]
pub(crate) struct UnitResponse {
    /// J; infinite when a point is inverted.
    pub(crate) energy: f64,
    /// `∂W/∂F_q`, in N m.
    pub(crate) stress: [Mat3; 2],
    /// `∂²W/∂F_p∂F_r`; zero unless asked for.
    pub(crate) tangent: [[Mat9; 2]; 2],
}

/// The corrected deformation gradients, `F^_q`, and what their derivatives need.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Corrected {
    pub(crate) f: [Mat3; 2],
    original: [Mat3; 2],
    cofactor: [Mat3; 2],
    jacobian: [f64; 2],
    s: [f64; 2],
    share: [f64; 2],
    /// `F_q M`.
    carried: [Vec3; 2],
    kinematics: Kinematics,
}

impl Corrected {
    /// `None` when a point is inverted (finite kinematics only).
    pub(crate) fn new(
        kinematics: Kinematics,
        f: &[Mat3; 2],
        volumes: [f64; 2],
        thickness: &Vec3,
        gradient: &Vec3,
    ) -> Option<Self> {
        let total = volumes[0] + volumes[1];
        let share = volumes.map(|v| v / total);
        let (cofactor, jacobian, carried) = match kinematics {
            Kinematics::Finite => {
                let c = f.map(|f| cofactor(&f));
                let j = [0, 1].map(|q| f[q].column(0).dot(&c[q].column(0)));
                (c, j, f.map(|f| f * thickness))
            }
            Kinematics::Small => (
                [Mat3::identity(); 2],
                f.map(|f| f.trace() - 2.0),
                [*thickness; 2],
            ),
        };
        let mean = share[0] * jacobian[0] + share[1] * jacobian[1];
        let s = match kinematics {
            Kinematics::Finite => {
                if !(jacobian[0] > 0.0 && jacobian[1] > 0.0) {
                    return None;
                }
                jacobian.map(|j| mean / j)
            }
            Kinematics::Small => jacobian.map(|j| 1.0 + mean - j),
        };
        let corrected = [0, 1].map(|q| f[q] + carried[q] * (gradient * (s[q] - 1.0)).transpose());
        Some(Self {
            f: corrected,
            original: *f,
            cofactor,
            jacobian,
            s,
            share,
            carried,
            kinematics,
        })
    }

    /// Carries the responses at `F^_q` back to `F_q`.
    pub(crate) fn pull_back(
        &self,
        points: &[PointResponse; 2],
        thickness: &Vec3,
        gradient: &Vec3,
        with_tangent: bool,
    ) -> UnitResponse {
        // In small strain every division by J and every A is 1.
        let is_finite = self.kinematics == Kinematics::Finite;
        let j_inv = if is_finite {
            self.jacobian.map(f64::recip)
        } else {
            [1.0; 2]
        };
        let s = if is_finite { self.s } else { [1.0; 2] };
        let a_transposed =
            s.map(|s| Mat3::identity() + gradient * (thickness * (s - 1.0)).transpose());
        let pushed = [0, 1].map(|q| points[q].stress * gradient);
        let k = [0, 1].map(|q| pushed[q].dot(&self.carried[q]));
        let sum = k[0] * j_inv[0] + k[1] * j_inv[1];
        let g = [0, 1].map(|q| self.share[q] * sum - k[q] * s[q] * j_inv[q]);
        let stress = [0, 1].map(|q| points[q].stress * a_transposed[q] + self.cofactor[q] * g[q]);
        let mut response = UnitResponse {
            energy: points[0].energy + points[1].energy,
            stress,
            tangent: [[Mat9::zeros(); 2]; 2],
        };
        if !with_tangent {
            return response;
        }
        let c = self.cofactor.map(|c| vec9(&c));
        for q in 0..2 {
            let a = vec9(&(self.carried[q] * gradient.transpose()));
            let h_a = points[q].tangent * a;
            let beta = a.dot(&h_a);
            let mut w = vec9(&(mat3(&h_a) * a_transposed[q]));
            if is_finite {
                w += vec9(&(pushed[q] * thickness.transpose())) - c[q] * (k[q] * j_inv[q]);
            }
            let s_q = [0, 1].map(|p| {
                let own = if p == q { s[q] * j_inv[q] } else { 0.0 };
                c[p] * (self.share[p] * j_inv[q] - own)
            });
            for p in 0..2 {
                for r in 0..2 {
                    let mut left = s_q[p] * beta;
                    if p == q {
                        left += w;
                    }
                    response.tangent[p][r] += left * s_q[r].transpose();
                    if r == q {
                        response.tangent[p][r] += s_q[p] * w.transpose();
                    }
                }
            }
            let diagonal = &mut response.tangent[q][q];
            *diagonal += transformed(&points[q].tangent, &a_transposed[q]);
            if is_finite {
                add_second_derivative_of_det(diagonal, &self.original[q], g[q]);
            }
        }
        response
    }
}

/// `∂det F/∂F`.
pub(crate) fn cofactor(f: &Mat3) -> Mat3 {
    let [a, b, c] = [0, 1, 2].map(|i| Vec3::from(f.column(i)));
    Mat3::from_columns(&[b.cross(&c), c.cross(&a), a.cross(&b)])
}

/// Adds `scale · ∂²det F/∂F∂F`.
pub(crate) fn add_second_derivative_of_det(tangent: &mut Mat9, f: &Mat3, scale: f64) {
    // Columns j ≠ l of F: the derivative of a cross product of two columns is a skew matrix of the
    // third.
    for (j, l, n, sign) in [(0, 1, 2, 1.0), (1, 2, 0, 1.0), (2, 0, 1, 1.0)] {
        let x = f.column(n) * (scale * sign);
        // δ(F_l × F_n) by F_l is −[F_n]× ; det = F_j · (F_l × F_n).
        for (i, k, value) in [
            (0, 1, x[2]),
            (1, 2, x[0]),
            (2, 0, x[1]),
            (1, 0, -x[2]),
            (2, 1, -x[0]),
            (0, 2, -x[1]),
        ] {
            tangent[(i + 3 * j, k + 3 * l)] += value;
            tangent[(k + 3 * l, i + 3 * j)] += value;
        }
    }
}

pub(crate) fn vec9(m: &Mat3) -> Vec9 {
    Vec9::from_column_slice(m.as_slice())
}

fn mat3(v: &Vec9) -> Mat3 {
    Mat3::from_column_slice(v.as_slice())
}

/// `H` seen from `δF` where it acts on `δF A`: both of its index pairs are multiplied by `Aᵀ` from
/// the right.
fn transformed(tangent: &Mat9, a_transposed: &Mat3) -> Mat9 {
    let mut rows = Mat9::zeros();
    // Blocks of three rows or columns belong to one column of δF.
    for j in 0..3 {
        for l in 0..3 {
            let scale = a_transposed[(l, j)];
            if scale != 0.0 {
                let from = tangent.fixed_rows::<3>(3 * l) * scale;
                let mut into = rows.fixed_rows_mut::<3>(3 * j);
                into += from;
            }
        }
    }
    let mut both = Mat9::zeros();
    for j in 0..3 {
        for l in 0..3 {
            let scale = a_transposed[(l, j)];
            if scale != 0.0 {
                let from = rows.fixed_columns::<3>(3 * l) * scale;
                let mut into = both.fixed_columns_mut::<3>(3 * j);
                into += from;
            }
        }
    }
    both
}
