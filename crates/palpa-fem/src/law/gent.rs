//! Gent law: chains that can be stretched only so far.
//!
//! ```text
//! W_d(F) = −μ J_m/2 ln(1 − x/J_m),   x = Ī1 − 3 < J_m            [J/m³]
//! P(F)   = μ/2 J_m/(J_m − x) ∂Ī1/∂F                              [Pa]
//! ```
//! For `x ≥ J_m` the energy is `+∞`, so that a line search backs off. `J_m → ∞` is neo-Hookean.
//! `ln_1p` keeps the digits at small strain. Gent, Rubber Chem. Technol. 69 (1996), 59–61.

use super::error::{check_positive, moduli};
use super::invariants::FirstInvariant;
use super::{Described, LawError, Volumetric};

const NAME: &str = "Gent";

/// A logarithm in the first isochoric invariant, with a limit of stretch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gent {
    shear: f64,
    limit: f64,
    volumetric: Volumetric,
}

impl Gent {
    /// From the shear modulus at rest (Pa) and the limit `J_m > 0` of `Ī1 − 3`, a pure number.
    ///
    /// # Errors
    /// A parameter that is not positive and finite.
    pub fn new(shear: f64, limit: f64, volumetric: Volumetric) -> Result<Self, LawError> {
        check_positive(NAME, "the shear modulus", shear, "Pa")?;
        check_positive(NAME, "the limit Jm", limit, "")?;
        Ok(Self {
            shear,
            limit,
            volumetric: volumetric.checked(NAME)?,
        })
    }

    /// From Young's modulus (Pa) and Poisson's ratio at rest and the limit `J_m > 0`, with the
    /// quadratic volumetric energy.
    ///
    /// # Errors
    /// A modulus or limit that is not positive, or a ratio outside (−1, ½).
    pub fn from_young(young: f64, poisson: f64, limit: f64) -> Result<Self, LawError> {
        let (shear, bulk) = moduli(NAME, young, poisson)?;
        Self::new(shear, limit, Volumetric::Quadratic { bulk })
    }

    /// The limit `J_m` of `Ī1 − 3`.
    pub fn limit(&self) -> f64 {
        self.limit
    }
}

impl Described for Gent {
    const NAME: &'static str = NAME;

    fn shear(&self) -> f64 {
        self.shear
    }

    fn volumetric(&self) -> &Volumetric {
        &self.volumetric
    }
}

impl FirstInvariant for Gent {
    #[inline]
    fn slopes(&self, x: f64) -> [f64; 3] {
        let room = self.limit - x;
        if room <= 0.0 {
            return [f64::INFINITY, 0.0, 0.0];
        }
        let w1 = 0.5 * self.shear * (self.limit / room);
        let energy = -0.5 * self.shear * self.limit * (-x / self.limit).ln_1p();
        [energy, w1, w1 / room]
    }
}
