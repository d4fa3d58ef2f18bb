//! Neo-Hookean law.
//!
//! ```text
//! W_d(F) = C10 (Ī1 − 3),   μ = 2 C10                     [J/m³]
//! P(F)   = μ J^(−2/3) (F − I1/3 F⁻ᵀ)                     [Pa]
//! ```
//! The tangent is in `invariants.rs`.

use super::error::{check_positive, moduli};
use super::invariants::FirstInvariant;
use super::{Described, Hardening, LawError, Volumetric};

const NAME: &str = "neo-Hookean";

/// The simplest law for large strain: one shear modulus.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NeoHookean {
    c10: f64,
    volumetric: Volumetric,
}

impl NeoHookean {
    /// From the shear modulus `μ = 2 C10` (Pa).
    ///
    /// # Errors
    /// A modulus that is not positive and finite.
    pub fn new(shear: f64, volumetric: Volumetric) -> Result<Self, LawError> {
        check_positive(NAME, "the shear modulus", shear, "Pa")?;
        Ok(Self {
            c10: 0.5 * shear,
            volumetric: volumetric.checked(NAME)?,
        })
    }

    /// From Young's modulus (Pa) and Poisson's ratio, with the quadratic volumetric energy.
    ///
    /// # Errors
    /// A modulus that is not positive, or a ratio outside (−1, ½).
    pub fn from_young(young: f64, poisson: f64) -> Result<Self, LawError> {
        let (shear, bulk) = moduli(NAME, young, poisson)?;
        Self::new(shear, Volumetric::Quadratic { bulk })
    }
}

impl Described for NeoHookean {
    const NAME: &'static str = NAME;

    fn shear(&self) -> f64 {
        2.0 * self.c10
    }

    fn volumetric(&self) -> &Volumetric {
        &self.volumetric
    }

    fn hardening(&self) -> Option<Hardening> {
        Some(Hardening::None)
    }
}

impl FirstInvariant for NeoHookean {
    #[inline]
    fn slopes(&self, excess: f64) -> [f64; 3] {
        [self.c10 * excess, self.c10, 0.0]
    }
}
