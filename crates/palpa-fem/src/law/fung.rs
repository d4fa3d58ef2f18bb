//! Isotropic exponential law after Fung and Demiray.
//!
//! ```text
//! W_d(F) = μ/(2b) (exp(b x) − 1),   x = Ī1 − 3                [J/m³]
//! P(F)   = μ/2 exp(b x) ∂Ī1/∂F                                [Pa]
//! ```
//! Soft at first, then stiffening without bound, as skin does; `b → 0` is neo-Hookean. Demiray, J.
//! Biomech. 5 (1972).

use super::error::{check_positive, moduli};
use super::invariants::FirstInvariant;
use super::{Described, Hardening, LawError, Volumetric};

const NAME: &str = "Fung";

/// An exponential in the first isochoric invariant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fung {
    shear: f64,
    b: f64,
    volumetric: Volumetric,
}

impl Fung {
    /// From the shear modulus at rest (Pa) and the exponent `b > 0`, a pure number.
    ///
    /// # Errors
    /// A parameter that is not positive and finite.
    pub fn new(shear: f64, b: f64, volumetric: Volumetric) -> Result<Self, LawError> {
        check_positive(NAME, "the shear modulus", shear, "Pa")?;
        check_positive(NAME, "the exponent b", b, "")?;
        Ok(Self {
            shear,
            b,
            volumetric: volumetric.checked(NAME)?,
        })
    }

    /// From Young's modulus (Pa) and Poisson's ratio at rest and the exponent `b > 0`, with the
    /// quadratic volumetric energy.
    ///
    /// # Errors
    /// A modulus or exponent that is not positive, or a ratio outside (−1, ½).
    pub fn from_young(young: f64, poisson: f64, b: f64) -> Result<Self, LawError> {
        let (shear, bulk) = moduli(NAME, young, poisson)?;
        Self::new(shear, b, Volumetric::Quadratic { bulk })
    }

    /// How fast it stiffens.
    pub fn b(&self) -> f64 {
        self.b
    }
}

impl Described for Fung {
    const NAME: &'static str = NAME;

    fn shear(&self) -> f64 {
        self.shear
    }

    fn volumetric(&self) -> &Volumetric {
        &self.volumetric
    }

    fn hardening(&self) -> Option<Hardening> {
        Some(Hardening::Exponential { b: self.b })
    }
}

impl FirstInvariant for Fung {
    #[inline]
    fn slopes(&self, x: f64) -> [f64; 3] {
        let growth = (self.b * x).exp_m1();
        let w1 = 0.5 * self.shear * (growth + 1.0);
        [0.5 * self.shear / self.b * growth, w1, self.b * w1]
    }
}
