//! Elastic laws and their moduli.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::parameters::Numbers;
use crate::{Energy, Sourced};

/// An isotropic elastic law: a strain energy with separate deviatoric and volumetric parts.
///
/// ```text
/// W(F) = W_d(F) + U(v)        [J/m³],   U from `resistance` and `volume`
/// ```
/// The parameters are kept as they were given. [`shear`](Self::shear), [`c10`](Self::c10),
/// [`bulk`](Self::bulk), [`young`](Self::young) and [`poisson`](Self::poisson) compute the moduli
/// at small strain from them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Elastic {
    /// The deviatoric part.
    pub energy: Energy,
    /// Resistance to a change of volume.
    pub resistance: Resistance,
    /// Form of the volumetric part.
    pub volume: Volume,
}

/// The stiffness at small strain, as it was given.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Stiffness {
    /// Young's modulus in pascals.
    Young(Sourced),
    /// Shear modulus `µ` in pascals.
    Shear(Sourced),
    /// `C10` in pascals, for the energies that have it.
    C10(Sourced),
}

/// Resistance to a change of volume, as it was given.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Resistance {
    /// Poisson's ratio at small strain, 0 to 0.4999.
    Poisson(Sourced),
    /// Bulk modulus `K` in pascals; `D1 = 2/K` in the notation of Abaqus.
    Bulk(Sourced),
}

/// Form of the volumetric energy as a function of the volume ratio `v`. `v` is `det F`, except in
/// the linear law (`1 + tr ε`) and in St. Venant–Kirchhoff's (`1 + tr E`).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Volume {
    /// K/2 (v − 1)².
    #[default]
    Quadratic,
    /// K/2 (ln v)²: grows without limit as the volume vanishes.
    Logarithmic,
}

/// The stiffness modulus that was given, in pascals.
enum GivenModulus {
    Young(f64),
    Shear(f64),
    C10(f64),
}

impl Stiffness {
    /// The key of the number that was given.
    pub(crate) fn key(&self) -> &'static str {
        match self {
            Self::Young(_) => "young",
            Self::Shear(_) => "shear",
            Self::C10(_) => "c10",
        }
    }

    /// The number that was given.
    pub fn sourced(&self) -> &Sourced {
        match self {
            Self::Young(number) | Self::Shear(number) | Self::C10(number) => number,
        }
    }
}

impl Resistance {
    /// The key of the number that was given.
    pub(crate) fn key(&self) -> &'static str {
        match self {
            Self::Poisson(_) => "poisson",
            Self::Bulk(_) => "bulk",
        }
    }

    /// The number that was given.
    pub fn sourced(&self) -> &Sourced {
        match self {
            Self::Poisson(number) | Self::Bulk(number) => number,
        }
    }
}

impl Energy {
    /// The number that determines the stiffness; for Ogden's energy, that of the first term.
    pub(crate) fn given(&self) -> &Sourced {
        match self.stiffness() {
            Some(stiffness) => stiffness.sourced(),
            None => &self.terms().first().expect("Ogden's energy has a term").mu,
        }
    }
}

impl Elastic {
    /// The parameters by their keys, without Ogden's terms.
    pub(crate) fn numbers(&self) -> Numbers<&Sourced> {
        let mut numbers = self.energy.own();
        if let Some(stiffness) = self.energy.stiffness() {
            numbers.set(stiffness.key(), stiffness.sourced());
        }
        numbers.set(self.resistance.key(), self.resistance.sourced());
        numbers
    }

    fn given(&self) -> GivenModulus {
        match self.energy.stiffness() {
            Some(Stiffness::Young(e)) => GivenModulus::Young(e.value),
            Some(Stiffness::Shear(mu)) => GivenModulus::Shear(mu.value),
            Some(Stiffness::C10(c10)) => GivenModulus::C10(c10.value),
            None => GivenModulus::Shear(self.energy.terms().iter().map(|term| term.mu.value).sum()),
        }
    }

    /// Shear modulus `µ` at small strain, in pascals.
    pub fn shear(&self) -> f64 {
        match self.given() {
            GivenModulus::Young(e) => match &self.resistance {
                Resistance::Poisson(nu) => e / (2.0 * (1.0 + nu.value)),
                Resistance::Bulk(k) => 3.0 * k.value * e / (9.0 * k.value - e),
            },
            GivenModulus::Shear(mu) => mu,
            GivenModulus::C10(c10) => 2.0 * (c10 + self.energy.c01()),
        }
    }

    /// `C10` in pascals: half the shear modulus minus the part of the second invariant.
    pub fn c10(&self) -> f64 {
        match self.given() {
            GivenModulus::C10(c10) => c10,
            _ => self.shear() / 2.0 - self.energy.c01(),
        }
    }

    /// Bulk modulus `K` at small strain, in pascals.
    pub fn bulk(&self) -> f64 {
        match (&self.resistance, self.given()) {
            (Resistance::Bulk(k), _) => k.value,
            (Resistance::Poisson(nu), GivenModulus::Young(e)) => e / (3.0 * (1.0 - 2.0 * nu.value)),
            (Resistance::Poisson(nu), _) => {
                2.0 * self.shear() * (1.0 + nu.value) / (3.0 * (1.0 - 2.0 * nu.value))
            }
        }
    }

    /// Young's modulus `E` at small strain, in pascals.
    pub fn young(&self) -> f64 {
        match (&self.resistance, self.given()) {
            (_, GivenModulus::Young(e)) => e,
            (Resistance::Poisson(nu), _) => 2.0 * self.shear() * (1.0 + nu.value),
            (Resistance::Bulk(k), _) => {
                let mu = self.shear();
                9.0 * k.value * mu / (3.0 * k.value + mu)
            }
        }
    }

    /// Poisson's ratio at small strain.
    pub fn poisson(&self) -> f64 {
        match (&self.resistance, self.given()) {
            (Resistance::Poisson(nu), _) => nu.value,
            (Resistance::Bulk(k), GivenModulus::Young(e)) => (3.0 * k.value - e) / (6.0 * k.value),
            (Resistance::Bulk(k), _) => {
                let mu = self.shear();
                (3.0 * k.value - 2.0 * mu) / (6.0 * k.value + 2.0 * mu)
            }
        }
    }
}
