//! Mooney–Rivlin law.
//!
//! ```text
//! W_d(F) = C10 (Ī1 − 3) + C01 (Ī2 − 3),   μ = 2 (C10 + C01)          [J/m³]
//! P(F)   = C10 ∂Ī1/∂F + C01 ∂Ī2/∂F                                   [Pa]
//! ```
//! Gradients and Hessians of the invariants are in `invariants.rs`. A negative constant, as fits to
//! one test often give, lets the energy fall without bound in another kind of strain, so it is
//! refused.

use super::error::{check_not_negative, check_positive, check_share, moduli};
use super::invariants::Isochoric;
use super::{Described, Hardening, LawError, Powers, Response, Volumetric};
use crate::Mat3;

const NAME: &str = "Mooney-Rivlin";

/// Both isochoric invariants, each with its constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MooneyRivlin {
    c10: f64,
    c01: f64,
    volumetric: Volumetric,
}

impl MooneyRivlin {
    /// From the constants `C10` and `C01`, both in Pa and not negative, one of them positive.
    ///
    /// # Errors
    /// A constant that is negative or not finite; both zero.
    pub fn new(c10: f64, c01: f64, volumetric: Volumetric) -> Result<Self, LawError> {
        check_not_negative(NAME, "C10", c10, "Pa")?;
        check_not_negative(NAME, "C01", c01, "Pa")?;
        check_positive(NAME, "C10 + C01", c10 + c01, "Pa")?;
        Ok(Self {
            c10,
            c01,
            volumetric: volumetric.checked(NAME)?,
        })
    }

    /// From Young's modulus (Pa), Poisson's ratio and the share of `C01` in `C10 + C01`, with the
    /// quadratic volumetric energy.
    ///
    /// # Errors
    /// A modulus that is not positive, a ratio outside (−1, ½), or a share outside 0 to 1.
    pub fn from_young(young: f64, poisson: f64, second_share: f64) -> Result<Self, LawError> {
        let (shear, bulk) = moduli(NAME, young, poisson)?;
        check_share(NAME, "the share of C01", second_share)?;
        let sum = 0.5 * shear;
        Self::new(
            (1.0 - second_share) * sum,
            second_share * sum,
            Volumetric::Quadratic { bulk },
        )
    }

    /// `[C10, C01]`, Pa.
    pub fn constants(&self) -> [f64; 2] {
        [self.c10, self.c01]
    }

    #[inline]
    pub(super) fn energy_at(&self, f: &Mat3) -> f64 {
        Isochoric::new(f).map_or(f64::INFINITY, |iso| self.energy_of(&iso))
    }

    #[inline]
    pub(super) fn stress_at(&self, f: &Mat3) -> (f64, Mat3) {
        Isochoric::new(f).map_or((f64::INFINITY, Mat3::zeros()), |iso| {
            (self.energy_of(&iso), self.stress_of(&iso))
        })
    }

    #[inline]
    pub(super) fn response_at(&self, f: &Mat3) -> Response {
        let Some(iso) = Isochoric::new(f) else {
            return Response::REFUSED;
        };
        let mut tangent = iso.hessian1(self.c10);
        iso.add_hessian2(self.c01, &mut tangent);
        Response {
            energy: self.energy_of(&iso),
            stress: self.stress_of(&iso),
            tangent,
        }
    }

    fn energy_of(&self, iso: &Isochoric) -> f64 {
        self.c10 * iso.excess1() + self.c01 * iso.excess2()
    }

    fn stress_of(&self, iso: &Isochoric) -> Mat3 {
        self.c10 * iso.gradient1() + self.c01 * iso.gradient2()
    }
}

impl Described for MooneyRivlin {
    const NAME: &'static str = NAME;

    fn shear(&self) -> f64 {
        2.0 * (self.c10 + self.c01)
    }

    fn volumetric(&self) -> &Volumetric {
        &self.volumetric
    }

    /// C10 (Ī1 − 3) is Ogden's term of the exponent 2, C01 (Ī2 − 3) that of −2.
    fn hardening(&self) -> Option<Hardening> {
        let terms = [(self.c10, 2.0), (self.c01, -2.0)];
        Some(Hardening::Powers(Powers::new(terms.into_iter())))
    }
}
