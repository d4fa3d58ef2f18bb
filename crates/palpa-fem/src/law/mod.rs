//! Material laws.
//!
//! To add a law:
//!
//! 1. A file here with its energy (`fung.rs` is a short example), and its name in `mod`, `pub use`
//!    and [`Law`]. Without `Described::hardening` all works, but slower while the mesh moves: the
//!    step then evaluates the law one pair at a time.
//! 2. Tests: the lists `every_law` of `tests/it/law.rs`, `laws` of `element/tests.rs` and `cases` of
//!    `batch/tests.rs`, which run all tests of laws over it; its closed forms in
//!    `tests/it/law/closed_forms.rs`. Now it can be used from Rust.
//! 3. For scenes: `palpa-scene/src/law.rs` (the compiler asks for the rest there), and a parameter
//!    that no law has yet in `PARAMETERS`, with its count, of `parameters.rs`; then an arm in
//!    `palpa/src/continuum.rs` and one in `palpa-lab/src/export/material.rs`.
//! 4. For the page: bless and generate (`CONTRIBUTING.md` has the commands), then its entry in
//!    `web/src/ui/tissue.ts` and its name in `web/src/i18n`, for which the compiler asks.
//! 5. A row in `docs/theory/laws.md`, and the count of laws in `README.md`.
//!
//! A law is the sum of a *deviatoric* energy density, which the element evaluates at its points,
//! and a *volumetric* one, which it evaluates once at the mean volume change of a pair of prisms,
//! so that nearly incompressible tissue does not lock:
//!
//! ```text
//! W(F) = W_d(F) + U(v),   v = det F  (or its small-strain or Green-strain likeness, see `VolumeMeasure`)   [J/m³]
//! ```

mod error;
mod fung;
mod gent;
mod hardening;
mod invariants;
mod linear;
mod material;
mod mooney_rivlin;
mod neo_hookean;
mod ogden;
mod prony;
mod spectral;
mod st_venant_kirchhoff;
mod tangent;
mod volumetric;
mod yeoh;

pub use error::LawError;
pub use fung::Fung;
pub use gent::Gent;
pub use linear::Linear;
pub use material::Material;
pub use mooney_rivlin::MooneyRivlin;
pub use neo_hookean::NeoHookean;
pub use ogden::{Ogden, OgdenTerm};
pub use prony::{Moduli, Prony, PronyStep, PronyTerm, six_of, symmetric_of};
pub use st_venant_kirchhoff::StVenantKirchhoff;
pub use volumetric::Volumetric;
pub use yeoh::Yeoh;

use crate::{Mat3, Mat9};
pub(crate) use hardening::{Hardening, Powers};
use invariants::FirstInvariant;

/// Energy density, J/m³, above which the energy counts as infinite: no tissue reaches it, and its
/// derivatives may overflow.
const HIGHEST_ENERGY: f64 = 1e60;

/// How a law measures the change of volume; 1 at rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VolumeMeasure {
    /// `det F`.
    Jacobian,
    /// `1 + tr E` of the Green–Lagrange strain `E = (FᵀF − I)/2`.
    GreenTrace,
    /// `1 + tr(F − I)`, the small-strain measure.
    SmallTrace,
}

/// Whether geometry is linearised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kinematics {
    /// Large rotations and strains.
    Finite,
    /// Small strain: energy quadratic in the displacements.
    Small,
}

/// Name, moduli and kinematics of a law. Its energy, stress and tangent come from `energy_at`,
/// `stress_at` and `response_at`, which the law defines itself or gets as a [`FirstInvariant`].
trait Described {
    /// Name of the law, as in messages and reports.
    const NAME: &'static str;

    fn name(&self) -> &'static str {
        Self::NAME
    }

    /// Shear modulus at rest, Pa.
    fn shear(&self) -> f64;

    /// The energy of a change of volume, with its parameters.
    fn volumetric(&self) -> &Volumetric;

    /// How it measures the change of volume.
    #[inline]
    fn volume_measure(&self) -> VolumeMeasure {
        VolumeMeasure::Jacobian
    }

    /// Whether geometry is linearised.
    #[inline]
    fn kinematics(&self) -> Kinematics {
        Kinematics::Finite
    }

    /// How it hardens, if the moving step's kernel knows it; the general element evaluates all
    /// others.
    fn hardening(&self) -> Option<Hardening> {
        None
    }
}

/// Deviatoric energy, stress and tangent of a law at a deformation gradient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    /// Energy density `W_d`, in J/m³; infinite where the law does not exist (`det F ≤ 0`).
    pub energy: f64,
    /// First Piola–Kirchhoff stress `∂W_d/∂F`, in Pa.
    pub stress: Mat3,
    /// `∂²W_d/∂F∂F`, in Pa, symmetric.
    pub tangent: Mat9,
}

impl Response {
    /// Where a law does not exist: infinite energy, so that a line search backs off.
    pub(crate) const REFUSED: Self = Self {
        energy: f64::INFINITY,
        stress: Mat3::from_array_storage(ZERO3),
        tangent: Mat9::from_array_storage(ZERO9),
    };
}

const ZERO3: nalgebra::ArrayStorage<f64, 3, 3> = nalgebra::ArrayStorage([[0.0; 3]; 3]);
const ZERO9: nalgebra::ArrayStorage<f64, 9, 9> = nalgebra::ArrayStorage([[0.0; 9]; 9]);

one_of! {
    ($) of_each!
    /// An elastic law with its parameters.
    ///
    /// Every method is pure and allocates nothing. No deformation gradient, however bad, gives a NaN:
    /// where a law does not exist the energy is infinite and its derivatives are zero.
    ///
    /// ```
    /// use palpa_fem::Mat3;
    /// use palpa_fem::law::{Law, NeoHookean};
    ///
    /// let law = Law::from(NeoHookean::from_young(30e3, 0.45)?);
    /// let stretched = Mat3::new(1.1, 0.0, 0.0, 0.0, 0.95, 0.0, 0.0, 0.0, 0.95);
    /// assert!(law.cauchy_stress(&stretched)[(0, 0)] > 0.0);
    /// assert_eq!(law.energy(&Mat3::identity()), 0.0);
    /// # Ok::<(), palpa_fem::law::LawError>(())
    /// ```
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub enum Law {
        /// Hooke's law at small strain.
        Linear,
        /// Hooke's law in the Green–Lagrange strain.
        StVenantKirchhoff,
        /// One shear modulus.
        NeoHookean,
        /// Both isochoric invariants.
        MooneyRivlin,
        /// A cubic in the first isochoric invariant.
        Yeoh,
        /// Powers of the isochoric stretches.
        Ogden,
        /// An exponential in the first isochoric invariant.
        Fung,
        /// A logarithm in the first isochoric invariant, with a limit of stretch.
        Gent,
    }
}

impl Law {
    /// Half the shear modulus at rest (Pa), how the law hardens, and the bulk modulus (Pa), of an
    /// isotropic law at large strain whose volumetric energy is quadratic; none of others.
    pub(crate) fn hardening(&self) -> Option<(f64, Hardening, f64)> {
        let hardening = of_each!(self, law => law.hardening())?;
        match *self.volumetric_energy() {
            Volumetric::Quadratic { bulk } => Some((0.5 * self.shear_modulus(), hardening, bulk)),
            Volumetric::Logarithmic { .. } => None,
        }
    }

    /// `W_d(F)`, in J/m³; infinite for `det F ≤ 0` (but not of the linear law, which knows no
    /// inversion).
    #[inline]
    pub fn deviatoric_energy(&self, f: &Mat3) -> f64 {
        let energy = of_each!(self, law => law.energy_at(f));
        if energy < HIGHEST_ENERGY {
            energy
        } else {
            f64::INFINITY
        }
    }

    /// `W_d(F)` in J/m³, and the first Piola–Kirchhoff stress `∂W_d/∂F` in Pa.
    #[inline]
    pub fn deviatoric_stress(&self, f: &Mat3) -> (f64, Mat3) {
        let (energy, stress) = of_each!(self, law => law.stress_at(f));
        if energy < HIGHEST_ENERGY {
            (energy, stress)
        } else {
            (f64::INFINITY, Mat3::zeros())
        }
    }

    /// `W_d(F)` with its first and second derivative.
    #[inline]
    pub fn deviatoric_response(&self, f: &Mat3) -> Response {
        let mut response = of_each!(self, law => law.response_at(f));
        let is_held = response.energy < HIGHEST_ENERGY;
        if !is_held {
            response = Response::REFUSED;
        }
        response
    }

    /// `[U, U', U'']` at the volume ratio `v` (see [`Law::volume_measure`]), in J/m³ = Pa;
    /// `[∞, 0, 0]` where the law does not exist.
    #[inline]
    pub fn volumetric(&self, v: f64) -> [f64; 3] {
        let slopes = of_each!(self, law => law.volumetric()).evaluate(v);
        if slopes[0] < HIGHEST_ENERGY {
            slopes
        } else {
            [f64::INFINITY, 0.0, 0.0]
        }
    }

    /// The energy of a change of volume, with its parameters.
    pub fn volumetric_energy(&self) -> &Volumetric {
        of_each!(self, law => law.volumetric())
    }

    /// How this law measures the change of volume.
    pub fn volume_measure(&self) -> VolumeMeasure {
        of_each!(self, law => law.volume_measure())
    }

    /// Whether geometry is linearised.
    pub fn kinematics(&self) -> Kinematics {
        of_each!(self, law => law.kinematics())
    }

    /// Shear modulus at rest, Pa.
    pub fn shear_modulus(&self) -> f64 {
        of_each!(self, law => law.shear())
    }

    /// Bulk modulus at rest, Pa.
    pub fn bulk_modulus(&self) -> f64 {
        of_each!(self, law => law.volumetric()).bulk()
    }

    /// Young's modulus at rest, Pa: `9 K μ/(3 K + μ)`.
    pub fn young(&self) -> f64 {
        let (mu, bulk) = (self.shear_modulus(), self.bulk_modulus());
        9.0 * bulk * mu / (3.0 * bulk + mu)
    }

    /// Poisson's ratio at rest: `(3 K − 2 μ)/(2 (3 K + μ))`.
    pub fn poisson(&self) -> f64 {
        let (mu, bulk) = (self.shear_modulus(), self.bulk_modulus());
        (3.0 * bulk - 2.0 * mu) / (2.0 * (3.0 * bulk + mu))
    }

    /// Name of the law, as in messages and reports.
    pub fn name(&self) -> &'static str {
        of_each!(self, law => law.name())
    }

    /// The whole energy density `W_d(F) + U(v(F))`, in J/m³.
    pub fn energy(&self, f: &Mat3) -> f64 {
        self.deviatoric_energy(f) + self.volumetric(self.volume_measure().value(f))[0]
    }

    /// The whole first Piola–Kirchhoff stress `∂W/∂F`, in Pa; zero where the law does not exist.
    pub fn stress(&self, f: &Mat3) -> Mat3 {
        let measure = self.volume_measure();
        let (energy, deviatoric) = self.deviatoric_stress(f);
        let [volumetric_energy, pressure, _] = self.volumetric(measure.value(f));
        if (energy + volumetric_energy).is_finite() {
            deviatoric + pressure * measure.gradient(f)
        } else {
            Mat3::zeros()
        }
    }

    /// The whole Cauchy stress `P Fᵀ/det F`, in Pa, symmetric; of a small-strain law its one
    /// stress.
    pub fn cauchy_stress(&self, f: &Mat3) -> Mat3 {
        let stress = self.stress(f);
        let jacobian = f.determinant();
        match self.kinematics() {
            Kinematics::Small => stress,
            Kinematics::Finite if jacobian > 0.0 && jacobian.is_finite() => {
                stress * f.transpose() / jacobian
            }
            Kinematics::Finite => Mat3::zeros(),
        }
    }
}
