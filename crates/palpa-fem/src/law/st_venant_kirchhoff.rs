//! St. Venant–Kirchhoff: Hooke's law in the Green–Lagrange strain.
//!
//! ```text
//! E = (FᵀF − I)/2,   S = 2 μ dev E
//! W_d(F) = μ dev E : dev E                                                                [J/m³]
//! P(F)   = F S                                                                            [Pa]
//! A_ijkl = δ_ik S_lj + μ ((F Fᵀ)_ik δ_jl + F_il F_kj) − 2/3 μ F_ij F_kl
//! ```
//! With `U(v) = K/2 (tr E)²` the whole is the textbook law. Right at large rotation and small
//! strain; under compression beyond about a third it softens and gives way, so it is for
//! comparison, not for pressed tissue.

use super::error::{check_positive, moduli};
use super::tangent::{add_exchange, add_left, add_outer, add_right};
use super::volumetric::cofactor;
use super::{Described, LawError, Response, VolumeMeasure, Volumetric};
use crate::{Mat3, Mat9};

const NAME: &str = "St. Venant-Kirchhoff";

/// Hooke's law in the Green–Lagrange strain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StVenantKirchhoff {
    shear: f64,
    volumetric: Volumetric,
}

impl StVenantKirchhoff {
    /// From the shear and the bulk modulus, both in Pa.
    ///
    /// # Errors
    /// A modulus that is not positive and finite.
    pub fn new(shear: f64, bulk: f64) -> Result<Self, LawError> {
        check_positive(NAME, "the shear modulus", shear, "Pa")?;
        Ok(Self {
            shear,
            volumetric: Volumetric::Quadratic { bulk }.checked(NAME)?,
        })
    }

    /// From Young's modulus (Pa) and Poisson's ratio.
    ///
    /// # Errors
    /// A modulus that is not positive, or a ratio outside (−1, ½).
    pub fn from_young(young: f64, poisson: f64) -> Result<Self, LawError> {
        let (shear, bulk) = moduli(NAME, young, poisson)?;
        Self::new(shear, bulk)
    }

    #[inline]
    pub(super) fn energy_at(&self, f: &Mat3) -> f64 {
        deviatoric_strain(f).map_or(f64::INFINITY, |strain| self.shear * strain.norm_squared())
    }

    #[inline]
    pub(super) fn stress_at(&self, f: &Mat3) -> (f64, Mat3) {
        let Some(strain) = deviatoric_strain(f) else {
            return (f64::INFINITY, Mat3::zeros());
        };
        (
            self.shear * strain.norm_squared(),
            2.0 * self.shear * (f * strain),
        )
    }

    #[inline]
    pub(super) fn response_at(&self, f: &Mat3) -> Response {
        let Some(strain) = deviatoric_strain(f) else {
            return Response::REFUSED;
        };
        let second = 2.0 * self.shear * strain;
        let mut tangent = Mat9::zeros();
        add_right(&mut tangent, 1.0, &second);
        add_left(&mut tangent, self.shear, &(f * f.transpose()));
        add_exchange(&mut tangent, self.shear, f);
        add_outer(&mut tangent, -2.0 / 3.0 * self.shear, f, f);
        Response {
            energy: self.shear * strain.norm_squared(),
            stress: f * second,
            tangent,
        }
    }
}

impl Described for StVenantKirchhoff {
    const NAME: &'static str = NAME;

    fn shear(&self) -> f64 {
        self.shear
    }

    fn volumetric(&self) -> &Volumetric {
        &self.volumetric
    }

    fn volume_measure(&self) -> VolumeMeasure {
        VolumeMeasure::GreenTrace
    }
}

/// `dev E`; `None` for `det F ≤ 0`, where the formula would go on, but no tissue does.
#[inline]
fn deviatoric_strain(f: &Mat3) -> Option<Mat3> {
    let jacobian = f.column(0).dot(&cofactor(f).column(0));
    if !(jacobian > 0.0 && jacobian.is_finite()) {
        return None;
    }
    let h = f - Mat3::identity();
    let strain = 0.5 * (h + h.transpose() + h.tr_mul(&h));
    let third = strain.trace() / 3.0;
    Some(strain - Mat3::from_diagonal_element(third))
}
