//! The energy of a change of volume.
//!
//! ```text
//! quadratic     U(v) = K/2 (v − 1)²      U' = K (v − 1)     U'' = K                    [J/m³]
//! logarithmic   U(v) = K/2 (ln v)²       U' = K ln v / v    U'' = K (1 − ln v) / v²
//! ```
//! `v` is 1 at rest and `U'` the mean stress (for `v = det F`; tension is positive). The quadratic
//! form is the one usually written with `D1 = 2/K`; it does not resist collapse (`U` stays finite
//! at `v = 0`). The logarithmic form does, but is not convex beyond `v = e`.

use super::error::check_positive;
use super::{LawError, VolumeMeasure};
use crate::Mat3;

/// Volumetric energy density of the volume ratio `v`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Volumetric {
    /// `K/2 (v − 1)²`.
    Quadratic {
        /// Bulk modulus `K` at rest, Pa.
        bulk: f64,
    },
    /// `K/2 (ln v)²`, infinite for `v ≤ 0`.
    Logarithmic {
        /// Bulk modulus `K` at rest, Pa.
        bulk: f64,
    },
}

impl Volumetric {
    /// Bulk modulus at rest, Pa.
    pub fn bulk(&self) -> f64 {
        match *self {
            Self::Quadratic { bulk } | Self::Logarithmic { bulk } => bulk,
        }
    }

    /// `[U, U', U'']` at the volume ratio `v`, in J/m³ = Pa. Where the law does not exist:
    /// `[∞, 0, 0]`.
    #[inline]
    pub fn evaluate(&self, v: f64) -> [f64; 3] {
        match *self {
            Self::Quadratic { bulk } if v.is_finite() => {
                let excess = v - 1.0;
                [0.5 * bulk * excess * excess, bulk * excess, bulk]
            }
            Self::Logarithmic { bulk } if v > 0.0 && v.is_finite() => {
                let ln_v = v.ln();
                [
                    0.5 * bulk * ln_v * ln_v,
                    bulk * ln_v / v,
                    bulk * (1.0 - ln_v) / (v * v),
                ]
            }
            _ => [f64::INFINITY, 0.0, 0.0],
        }
    }

    pub(super) fn checked(self, owner: &'static str) -> Result<Self, LawError> {
        check_positive(owner, "the bulk modulus", self.bulk(), "Pa")?;
        Ok(self)
    }
}

impl VolumeMeasure {
    /// Volume ratio `v` of a deformation gradient; 1 at rest.
    pub fn value(self, f: &Mat3) -> f64 {
        match self {
            Self::Jacobian => f.determinant(),
            // With H = F − I, so that small strains are not lost: tr E = tr H + |H|²/2.
            Self::GreenTrace => {
                let h = f - Mat3::identity();
                1.0 + (h.trace() + 0.5 * h.norm_squared())
            }
            Self::SmallTrace => f.trace() - 2.0,
        }
    }

    /// `∂v/∂F`: the cofactor of `F`, `F` itself, or the identity.
    pub fn gradient(self, f: &Mat3) -> Mat3 {
        match self {
            Self::Jacobian => cofactor(f),
            Self::GreenTrace => *f,
            Self::SmallTrace => Mat3::identity(),
        }
    }
}

/// `cof F = ∂ det F/∂F`, for every `F`: its columns are cross products of the columns of `F`.
#[inline]
pub(super) fn cofactor(f: &Mat3) -> Mat3 {
    let (a, b, c) = (f.column(0), f.column(1), f.column(2));
    Mat3::from_columns(&[b.cross(&c), c.cross(&a), a.cross(&b)])
}
