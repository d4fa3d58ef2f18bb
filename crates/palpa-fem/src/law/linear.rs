//! Linear elasticity at small strain.
//!
//! ```text
//! ε = sym(F − I)
//! W_d(F) = μ dev ε : dev ε           [J/m³]
//! P(F)   = 2 μ dev ε                 [Pa]
//! A_ijkl = μ (δ_ik δ_jl + δ_il δ_jk) − 2/3 μ δ_ij δ_kl
//! ```
//! With `U(v) = K/2 (tr ε)²` the whole is Hooke's law. It exists for every `F`, and is blind to
//! rotation only to first order.

use super::error::{check_positive, moduli};
use super::{Described, Kinematics, LawError, Response, VolumeMeasure, Volumetric};
use crate::{Mat3, Mat9};

const NAME: &str = "linear";

/// Hooke's law in the small strain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linear {
    shear: f64,
    volumetric: Volumetric,
}

impl Linear {
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
        self.shear * deviatoric_strain(f).norm_squared()
    }

    #[inline]
    pub(super) fn stress_at(&self, f: &Mat3) -> (f64, Mat3) {
        let strain = deviatoric_strain(f);
        (
            self.shear * strain.norm_squared(),
            2.0 * self.shear * strain,
        )
    }

    #[inline]
    pub(super) fn response_at(&self, f: &Mat3) -> Response {
        let (energy, stress) = self.stress_at(f);
        let mut tangent = Mat9::zeros();
        for i in 0..3 {
            for j in 0..3 {
                tangent[(i + 3 * j, i + 3 * j)] += self.shear;
                tangent[(i + 3 * j, j + 3 * i)] += self.shear;
                tangent[(4 * i, 4 * j)] -= 2.0 / 3.0 * self.shear;
            }
        }
        Response {
            energy,
            stress,
            tangent,
        }
    }
}

impl Described for Linear {
    const NAME: &'static str = NAME;

    fn shear(&self) -> f64 {
        self.shear
    }

    fn volumetric(&self) -> &Volumetric {
        &self.volumetric
    }

    fn volume_measure(&self) -> VolumeMeasure {
        VolumeMeasure::SmallTrace
    }

    fn kinematics(&self) -> Kinematics {
        Kinematics::Small
    }
}

#[inline]
fn deviatoric_strain(f: &Mat3) -> Mat3 {
    let h = f - Mat3::identity();
    let third = h.trace() / 3.0;
    0.5 * (h + h.transpose()) - Mat3::from_diagonal_element(third)
}
