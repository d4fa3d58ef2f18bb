//! The isochoric invariants of a deformation gradient, their gradients and Hessians.
//!
//! ```text
//! Ī1 = J^(−2/3) I1,   Ī2 = J^(−4/3) I2,   C = FᵀF,   I1 = tr C,   I2 = (I1² − tr C²)/2,   T = F⁻ᵀ
//! ∂Ī1/∂F = 2 J^(−2/3) (F − I1/3 T)
//! ∂Ī2/∂F = J^(−4/3) (M − 4/3 I2 T),   M = ∂I2/∂F = 2 (I1 F − F C)
//! ```
//! Both are 3 at rest and never less, and what a law needs is their excess over 3, which is of
//! second order in strain. Subtracting 3 would lose it at strains below 1e-5. Instead, with
//! `t = I1/3` and `C = t (I + D)`, `tr D = 0`:
//!
//! ```text
//! J²/t³ = det(I + D) = 1 − n,   n = ½ D:D − det D ≥ 0,   r = (J²/t³)^(1/3) = J^(2/3)/t ≤ 1
//! 1 − r = n/(1 + r + r²)
//! Ī1 − 3 = 3 (1 − r)/r,   Ī2 − 3 = [3 (1 − r)(1 + r) − ½ D:D]/r²
//! ```
//! where nothing cancels. Derivation of the Hessians: `docs/theory/laws.md`.

use super::Response;
use super::tangent::{add_exchange, add_identity, add_left, add_outer, add_right};
use super::volumetric::cofactor;
use crate::{Mat3, Mat9};

/// Below this `r` (a stretch of 17 000 at constant volume) rounding leaves no digit of `det F`.
const LEAST_RATIO: f64 = 1e-8;

/// A law in the first isochoric invariant alone, `W_d = w(Ī1 − 3)`.
pub(super) trait FirstInvariant {
    /// `[w, w', w'']` at `Ī1 − 3 = excess`, in J/m³.
    fn slopes(&self, excess: f64) -> [f64; 3];

    #[inline]
    fn energy_at(&self, f: &Mat3) -> f64 {
        Isochoric::new(f).map_or(f64::INFINITY, |iso| self.slopes(iso.excess1())[0])
    }

    #[inline]
    fn stress_at(&self, f: &Mat3) -> (f64, Mat3) {
        let Some(iso) = Isochoric::new(f) else {
            return (f64::INFINITY, Mat3::zeros());
        };
        let [w, w1, _] = self.slopes(iso.excess1());
        (w, w1 * iso.gradient1())
    }

    #[inline]
    fn response_at(&self, f: &Mat3) -> Response {
        let Some(iso) = Isochoric::new(f) else {
            return Response::REFUSED;
        };
        let [energy, w1, w11] = self.slopes(iso.excess1());
        let gradient = iso.gradient1();
        let mut tangent = iso.hessian1(w1);
        if w11 != 0.0 {
            add_outer(&mut tangent, w11, &gradient, &gradient);
        }
        Response {
            energy,
            stress: w1 * gradient,
            tangent,
        }
    }
}

/// Quantities that both isochoric invariants of a deformation gradient share.
pub(super) struct Isochoric {
    f: Mat3,
    /// `F⁻ᵀ`.
    inv_t: Mat3,
    /// `t = I1/3`.
    mean: f64,
    /// `I2 = |cof F|²`.
    second: f64,
    /// `r = J^(2/3)/t`.
    ratio: f64,
    /// `1 − r`.
    shortfall: f64,
    /// `½ D:D`.
    half_dd: f64,
    /// `D`: `xx, yy, zz, xy, yz, zx`.
    deviator: [f64; 6],
}

impl Isochoric {
    /// `None` if `det F ≤ 0`, or if `det F` is so small that rounding leaves no digit of it.
    #[inline]
    pub(super) fn new(f: &Mat3) -> Option<Self> {
        let cof = cofactor(f);
        let jacobian = f.column(0).dot(&cof.column(0));
        let mean = f.norm_squared() / 3.0;
        // Near rest through H = F − I, whose entries are exact there: dev C = dev(H + Hᵀ + HᵀH).
        let is_near_rest = (mean - 1.0).abs() < 0.5;
        let g = if is_near_rest {
            f - Mat3::identity()
        } else {
            *f
        };
        let first_order = if is_near_rest { 1.0 } else { 0.0 };
        let c = |i: usize, j: usize| {
            first_order * (g[(i, j)] + g[(j, i)]) + g.column(i).dot(&g.column(j))
        };
        let (xx, yy, zz, xy, yz, zx) = (c(0, 0), c(1, 1), c(2, 2), c(0, 1), c(1, 2), c(2, 0));
        let third = (xx + yy + zz) / 3.0;
        let ratio = (jacobian * jacobian).cbrt() / mean;
        if !(jacobian > 0.0 && ratio > LEAST_RATIO && ratio.is_finite()) {
            return None;
        }
        let (dx, dy, dz) = (
            (xx - third) / mean,
            (yy - third) / mean,
            (zz - third) / mean,
        );
        let (sx, sy, sz) = (yz / mean, zx / mean, xy / mean);
        let half_dd = 0.5 * (dx * dx + dy * dy + dz * dz) + (sx * sx + sy * sy + sz * sz);
        let det = dx * (dy * dz - sx * sx) - sz * (sz * dz - sx * sy) + sy * (sz * sx - dy * sy);
        Some(Self {
            f: *f,
            inv_t: cof / jacobian,
            mean,
            second: cof.norm_squared(),
            ratio,
            shortfall: (half_dd - det) / (1.0 + ratio + ratio * ratio),
            half_dd,
            deviator: [dx, dy, dz, sz, sx, sy],
        })
    }

    /// `t = I1/3`.
    pub(super) fn mean(&self) -> f64 {
        self.mean
    }

    /// `D`, in `C = t (I + D)`.
    pub(super) fn deviator(&self) -> Mat3 {
        let [xx, yy, zz, xy, yz, zx] = self.deviator;
        Mat3::new(xx, xy, zx, xy, yy, yz, zx, yz, zz)
    }

    /// `Ī1 − 3`.
    #[inline]
    pub(super) fn excess1(&self) -> f64 {
        3.0 * self.shortfall / self.ratio
    }

    /// `Ī2 − 3`.
    #[inline]
    pub(super) fn excess2(&self) -> f64 {
        if self.half_dd < 0.5 {
            (3.0 * self.shortfall * (1.0 + self.ratio) - self.half_dd) / self.ratio.powi(2)
        } else {
            // Far from rest it is the other way round: `3 − ½ D:D` would cancel.
            self.second * self.scale().powi(2) - 3.0
        }
    }

    /// `J^(−2/3)`.
    #[inline]
    fn scale(&self) -> f64 {
        1.0 / (self.ratio * self.mean)
    }

    /// `∂Ī1/∂F`.
    #[inline]
    pub(super) fn gradient1(&self) -> Mat3 {
        (self.f - self.mean * self.inv_t) * (2.0 * self.scale())
    }

    /// `w ∂²Ī1/∂F∂F`. This is the inner loop of assembly, so all is done in one pass:
    ///
    /// ```text
    /// 2 J^(−2/3) [ δ_ik δ_jl − 2/3 (F_ij T_kl + T_ij F_kl) + 2/3 t T_ij T_kl + t T_il T_kj ]
    /// ```
    #[inline]
    pub(super) fn hessian1(&self, w: f64) -> Mat9 {
        let (f, t) = (&self.f.data.0, &self.inv_t.data.0);
        let c = 2.0 * self.scale() * w;
        let exchange = c * self.mean;
        let mut tangent = Mat9::zeros();
        for (kl, column) in tangent.data.0.iter_mut().enumerate() {
            let (k, l) = (kl % 3, kl / 3);
            let on_f = -2.0 / 3.0 * c * t[l][k];
            let on_t = 2.0 / 3.0 * c * (self.mean * t[l][k] - f[l][k]);
            for j in 0..3 {
                let on_l = exchange * t[j][k];
                for i in 0..3 {
                    column[i + 3 * j] = on_f * f[j][i] + on_t * t[j][i] + on_l * t[l][i];
                }
            }
            column[kl] += c;
        }
        tangent
    }

    /// `M = ∂I2/∂F`, and `C`.
    #[inline]
    fn second_gradient(&self) -> (Mat3, Mat3) {
        let c = self.f.tr_mul(&self.f);
        (2.0 * (3.0 * self.mean * self.f - self.f * c), c)
    }

    /// `∂Ī2/∂F`.
    #[inline]
    pub(super) fn gradient2(&self) -> Mat3 {
        let (m, _) = self.second_gradient();
        (m - 4.0 / 3.0 * self.second * self.inv_t) * self.scale().powi(2)
    }

    /// Adds `w ∂²Ī2/∂F∂F`:
    ///
    /// ```text
    /// J^(−4/3) [ ∂M/∂F − 4/3 (M⊗T + T⊗M) + 16/9 I2 T⊗T + 4/3 I2 T_il T_kj ]
    /// ∂M_ij/∂F_kl = 2 [ 2 F_ij F_kl + I1 δ_ik δ_jl − δ_ik C_lj − (F Fᵀ)_ik δ_jl − F_il F_kj ]
    /// ```
    pub(super) fn add_hessian2(&self, w: f64, tangent: &mut Mat9) {
        let (f, t) = (&self.f, &self.inv_t);
        let (m, c) = self.second_gradient();
        let w = w * self.scale().powi(2);
        add_outer(tangent, 4.0 * w, f, f);
        add_identity(tangent, 6.0 * w * self.mean);
        add_right(tangent, -2.0 * w, &c);
        add_left(tangent, -2.0 * w, &(f * f.transpose()));
        add_exchange(tangent, -2.0 * w, f);
        add_outer(tangent, -4.0 / 3.0 * w, &m, t);
        add_outer(tangent, -4.0 / 3.0 * w, t, &m);
        add_outer(tangent, 16.0 / 9.0 * w * self.second, t, t);
        add_exchange(tangent, 4.0 / 3.0 * w * self.second, t);
    }
}
