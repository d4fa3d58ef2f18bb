//! Yeoh law.
//!
//! ```text
//! W_d(F) = C10 x + C20 x² + C30 x³,   x = Ī1 − 3,   μ = 2 C10                [J/m³]
//! P(F)   = (C10 + 2 C20 x + 3 C30 x²) ∂Ī1/∂F                                 [Pa]
//! ```

use super::error::{check_positive, moduli};
use super::invariants::FirstInvariant;
use super::{Described, Hardening, LawError, Volumetric};

const NAME: &str = "Yeoh";

/// A cubic in the first isochoric invariant: stiffens with stretch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Yeoh {
    c: [f64; 3],
    volumetric: Volumetric,
}

impl Yeoh {
    /// From the constants `[C10, C20, C30]`, in Pa: the first positive, the others such that the
    /// energy grows with strain throughout.
    ///
    /// # Errors
    /// A constant that is not finite, `C10` not positive, or an energy that stops growing.
    pub fn new(c: [f64; 3], volumetric: Volumetric) -> Result<Self, LawError> {
        let [c10, c20, c30] = c;
        check_positive(NAME, "C10", c10, "Pa")?;
        // The slope C10 + 2 C20 x + 3 C30 x² has no root at x ≥ 0.
        let grows = c30 >= 0.0 && (c20 >= 0.0 || c20 * c20 < 3.0 * c10 * c30);
        if !(grows && c20.is_finite() && c30.is_finite()) {
            return Err(LawError::Softens { c10, c20, c30 });
        }
        Ok(Self {
            c,
            volumetric: volumetric.checked(NAME)?,
        })
    }

    /// From Young's modulus (Pa), Poisson's ratio and the ratios `[C20/C10, C30/C10]`, with the
    /// quadratic volumetric energy.
    ///
    /// # Errors
    /// A modulus that is not positive, a ratio outside (−1, ½), or an energy that stops growing.
    pub fn from_young(young: f64, poisson: f64, ratios: [f64; 2]) -> Result<Self, LawError> {
        let (shear, bulk) = moduli(NAME, young, poisson)?;
        let c10 = 0.5 * shear;
        Self::new(
            [c10, ratios[0] * c10, ratios[1] * c10],
            Volumetric::Quadratic { bulk },
        )
    }

    /// `[C10, C20, C30]`, Pa.
    pub fn constants(&self) -> [f64; 3] {
        self.c
    }
}

impl Described for Yeoh {
    const NAME: &'static str = NAME;

    fn shear(&self) -> f64 {
        2.0 * self.c[0]
    }

    fn volumetric(&self) -> &Volumetric {
        &self.volumetric
    }

    fn hardening(&self) -> Option<Hardening> {
        let [c10, c20, c30] = self.c;
        let (a, b) = (c20 / c10, c30 / c10);
        Some(Hardening::Cubic { a, b })
    }
}

impl FirstInvariant for Yeoh {
    #[inline]
    fn slopes(&self, x: f64) -> [f64; 3] {
        let [c10, c20, c30] = self.c;
        [
            x * (c10 + x * (c20 + x * c30)),
            c10 + x * (2.0 * c20 + x * 3.0 * c30),
            2.0 * c20 + 6.0 * c30 * x,
        ]
    }
}
