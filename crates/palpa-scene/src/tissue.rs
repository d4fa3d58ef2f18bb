//! What a tissue is: an elastic law, how it relaxes, its density; every number with its source.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A tissue: how it resists deformation, how it relaxes and, where known, how heavy it is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tissue {
    /// Its name.
    pub name: String,
    /// How it resists deformation.
    pub law: Law,
    /// How it relaxes; `None` for a tissue without memory.
    pub prony: Option<Prony>,
    /// Density in kg/m³, where known.
    pub density: Option<Sourced>,
}

/// How a tissue resists deformation.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Law {
    /// An isotropic elastic solid.
    Elastic(Elastic),
    /// Every bar is a spring of one stiffness: the reference method only.
    Spring {
        /// Stiffness of a bar in N/m.
        constant: Sourced,
    },
}

/// An isotropic elastic law: a strain energy whose deviatoric part and volumetric part are given apart.
///
/// ```text
/// W(F) = W_d(F) + U(v)        [J/m³],   U from `resistance` and `volume`
/// ```
/// The parameters are kept as they were given; [`shear`](Self::shear), [`c10`](Self::c10), [`bulk`](Self::bulk),
/// [`young`](Self::young) and [`poisson`](Self::poisson) are the moduli at small strain, whichever were given.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Elastic {
    /// The deviatoric part.
    pub energy: Energy,
    /// How the volume resists.
    pub resistance: Resistance,
    /// How the volumetric part grows.
    pub volume: Volume,
}

/// The deviatoric part of a strain energy. `Ī1`, `Ī2` are the isochoric invariants, `λ̄` the isochoric stretches.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Energy {
    /// `µ dev ε : dev ε` of the small strain `ε`; the stiffness never changes.
    Linear {
        /// Gives `µ`.
        stiffness: Stiffness,
    },
    /// `µ dev E : dev E` of the Green–Lagrange strain `E`; softens under compression, for comparison only.
    StVenantKirchhoff {
        /// Gives `µ`.
        stiffness: Stiffness,
    },
    /// `C10 (Ī1 − 3)`, `µ = 2 C10`.
    NeoHookean {
        /// Gives `C10`.
        stiffness: Stiffness,
    },
    /// `C10 (Ī1 − 3) + C01 (Ī2 − 3)`, `µ = 2 (C10 + C01)`.
    MooneyRivlin {
        /// Gives `C10`.
        stiffness: Stiffness,
        /// `C01` in pascals, 0 or more.
        c01: Sourced,
    },
    /// `C10 (Ī1 − 3) + C20 (Ī1 − 3)² + C30 (Ī1 − 3)³`, `µ = 2 C10`.
    Yeoh {
        /// Gives `C10`.
        stiffness: Stiffness,
        /// `C20` in pascals.
        c20: Sourced,
        /// `C30` in pascals, 0 or more.
        c30: Sourced,
    },
    /// `Σ 2µᵢ/αᵢ² (λ̄1^αᵢ + λ̄2^αᵢ + λ̄3^αᵢ − 3)`, `µ = Σ µᵢ`, as in Abaqus and CalculiX.
    Ogden {
        /// 1 to 6 terms.
        terms: Vec<OgdenTerm>,
    },
    /// `µ/(2b) (exp(b (Ī1 − 3)) − 1)`: skin, which stiffens as its fibres straighten.
    Fung {
        /// Gives `µ`.
        stiffness: Stiffness,
        /// How fast it stiffens, above 0.
        b: Sourced,
    },
}

/// A term of Ogden's energy.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OgdenTerm {
    /// Its share `µᵢ` of the shear modulus, in pascals.
    pub mu: Sourced,
    /// Its exponent `αᵢ`, not 0.
    pub alpha: f64,
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

/// How a change of volume is resisted, as it was given.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Resistance {
    /// Poisson's ratio at small strain, 0 to 0.4999.
    Poisson(Sourced),
    /// Bulk modulus `K` in pascals; `D1 = 2/K` in the notation of Abaqus.
    Bulk(Sourced),
}

/// How the volumetric part of an energy grows with the volume ratio `v`, which is `det F` but in the linear law (its
/// small-strain likeness `1 + tr ε`) and in St. Venant–Kirchhoff's (`1 + tr E`).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Volume {
    /// K/2 (v − 1)².
    #[default]
    Quadratic,
    /// K/2 (ln v)²: without end as the volume vanishes.
    Logarithmic,
}

/// Relaxation as a Prony series: `G(t) = G₀ (1 − Σ gᵢ (1 − exp(−t/τᵢ)))`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Prony {
    /// 1 to 12 terms, whose `g` together are less than 1.
    pub terms: Vec<PronyTerm>,
    /// At which end of the relaxation the law's moduli hold.
    pub moduli: Moduli,
    /// Whether the volumetric part relaxes, too.
    pub relaxes_volume: bool,
    /// How far the terms are to be trusted.
    pub status: Status,
    /// Where the terms are from; may be empty when the scene gives them.
    pub source: String,
}

/// A term of a Prony series.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PronyTerm {
    /// Share of the instantaneous modulus that relaxes, above 0.
    pub g: f64,
    /// Its time constant in seconds.
    pub tau: f64,
}

/// At which end of its relaxation a tissue has the moduli of its law.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Moduli {
    /// At rest, after all relaxation: at once it is stiffer, by 1/(1 − Σ g).
    #[default]
    LongTerm,
    /// At once, before any relaxation: at rest it is softer, by 1 − Σ g.
    Instantaneous,
}

/// A number with its source.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sourced {
    /// The value in SI.
    pub value: f64,
    /// How far it is to be trusted.
    pub status: Status,
    /// Where it is from, in words; may be empty when the scene gives it.
    pub source: String,
}

/// How far a number is to be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Read in the work that measured it, or measured on the body at hand.
    Measured,
    /// From an abstract or a secondary source.
    Literature,
    /// From memory, an order of magnitude or a choice.
    Assumed,
    /// Given by the scene, which answers for it.
    Given,
}

impl Tissue {
    /// The elastic law, unless the tissue is given by a spring stiffness.
    pub fn elastic(&self) -> Option<&Elastic> {
        match &self.law {
            Law::Elastic(elastic) => Some(elastic),
            Law::Spring { .. } => None,
        }
    }

    /// Young's modulus at small strain in pascals, unless the tissue is given by a spring stiffness.
    pub fn young(&self) -> Option<f64> {
        self.elastic().map(Elastic::young)
    }

    /// Poisson's ratio at small strain, unless the tissue is given by a spring stiffness.
    pub fn poisson(&self) -> Option<f64> {
        self.elastic().map(Elastic::poisson)
    }

    /// Stiffness of every bar in N/m, if the tissue is given by it.
    pub fn spring(&self) -> Option<f64> {
        match &self.law {
            Law::Spring { constant } => Some(constant.value),
            Law::Elastic(_) => None,
        }
    }

    /// How far the stiffness is to be trusted.
    pub fn status(&self) -> Status {
        self.law.stiffness().status
    }
}

impl Law {
    /// Its name as a scene writes it: `neo-hookean`, `ogden`, `spring`, ….
    pub fn name(&self) -> &'static str {
        match self {
            Self::Elastic(elastic) => elastic.energy.name(),
            Self::Spring { .. } => "spring",
        }
    }

    /// The number that says how stiff it is, as it was given.
    pub(crate) fn stiffness(&self) -> &Sourced {
        match self {
            Self::Elastic(elastic) => elastic.energy.given(),
            Self::Spring { constant } => constant,
        }
    }
}

impl Energy {
    /// Its name as a scene writes it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Linear { .. } => "linear",
            Self::StVenantKirchhoff { .. } => "st-venant-kirchhoff",
            Self::NeoHookean { .. } => "neo-hookean",
            Self::MooneyRivlin { .. } => "mooney-rivlin",
            Self::Yeoh { .. } => "yeoh",
            Self::Ogden { .. } => "ogden",
            Self::Fung { .. } => "fung",
        }
    }

    /// The stiffness as it was given; `None` for Ogden's, whose terms give it.
    pub fn stiffness(&self) -> Option<&Stiffness> {
        match self {
            Self::Linear { stiffness }
            | Self::StVenantKirchhoff { stiffness }
            | Self::NeoHookean { stiffness }
            | Self::MooneyRivlin { stiffness, .. }
            | Self::Yeoh { stiffness, .. }
            | Self::Fung { stiffness, .. } => Some(stiffness),
            Self::Ogden { .. } => None,
        }
    }

    /// The terms of Ogden's energy; none of any other.
    pub fn terms(&self) -> &[OgdenTerm] {
        match self {
            Self::Ogden { terms } => terms,
            _ => &[],
        }
    }

    /// The number that says how stiff it is: of Ogden's energy, that of its first term.
    pub(crate) fn given(&self) -> &Sourced {
        match self.stiffness() {
            Some(stiffness) => stiffness.sourced(),
            None => &self.terms().first().expect("Ogden's energy has a term").mu,
        }
    }

    fn given_modulus(&self) -> Given {
        match self.stiffness() {
            Some(Stiffness::Young(e)) => Given::Young(e.value),
            Some(Stiffness::Shear(mu)) => Given::Shear(mu.value),
            Some(Stiffness::C10(c10)) => Given::C10(c10.value),
            None => Given::Shear(self.terms().iter().map(|term| term.mu.value).sum()),
        }
    }
}

/// The stiffness that was given, in pascals.
enum Given {
    Young(f64),
    Shear(f64),
    C10(f64),
}

impl Stiffness {
    /// The number that was given.
    pub fn sourced(&self) -> &Sourced {
        match self {
            Self::Young(number) | Self::Shear(number) | Self::C10(number) => number,
        }
    }
}

impl Resistance {
    /// The number that was given.
    pub fn sourced(&self) -> &Sourced {
        match self {
            Self::Poisson(number) | Self::Bulk(number) => number,
        }
    }
}

impl Elastic {
    /// Shear modulus `µ` at small strain, in pascals.
    pub fn shear(&self) -> f64 {
        let second = match &self.energy {
            Energy::MooneyRivlin { c01, .. } => c01.value,
            _ => 0.0,
        };
        match self.energy.given_modulus() {
            Given::Young(e) => match &self.resistance {
                Resistance::Poisson(nu) => e / (2.0 * (1.0 + nu.value)),
                Resistance::Bulk(k) => 3.0 * k.value * e / (9.0 * k.value - e),
            },
            Given::Shear(mu) => mu,
            Given::C10(c10) => 2.0 * (c10 + second),
        }
    }

    /// `C10` in pascals: half the shear modulus, less what a second invariant takes of it.
    pub fn c10(&self) -> f64 {
        match (&self.energy, self.energy.given_modulus()) {
            (_, Given::C10(c10)) => c10,
            (Energy::MooneyRivlin { c01, .. }, _) => self.shear() / 2.0 - c01.value,
            _ => self.shear() / 2.0,
        }
    }

    /// Bulk modulus `K` at small strain, in pascals.
    pub fn bulk(&self) -> f64 {
        match (&self.resistance, self.energy.given_modulus()) {
            (Resistance::Bulk(k), _) => k.value,
            (Resistance::Poisson(nu), Given::Young(e)) => e / (3.0 * (1.0 - 2.0 * nu.value)),
            (Resistance::Poisson(nu), _) => {
                2.0 * self.shear() * (1.0 + nu.value) / (3.0 * (1.0 - 2.0 * nu.value))
            }
        }
    }

    /// Young's modulus `E` at small strain, in pascals.
    pub fn young(&self) -> f64 {
        match (&self.resistance, self.energy.given_modulus()) {
            (_, Given::Young(e)) => e,
            (Resistance::Poisson(nu), _) => 2.0 * self.shear() * (1.0 + nu.value),
            (Resistance::Bulk(k), _) => {
                let mu = self.shear();
                9.0 * k.value * mu / (3.0 * k.value + mu)
            }
        }
    }

    /// Poisson's ratio at small strain.
    pub fn poisson(&self) -> f64 {
        match (&self.resistance, self.energy.given_modulus()) {
            (Resistance::Poisson(nu), _) => nu.value,
            (Resistance::Bulk(k), Given::Young(e)) => (3.0 * k.value - e) / (6.0 * k.value),
            (Resistance::Bulk(k), _) => {
                let mu = self.shear();
                (3.0 * k.value - 2.0 * mu) / (6.0 * k.value + 2.0 * mu)
            }
        }
    }
}

impl Prony {
    /// Stiffness at once over stiffness at rest: `1/(1 − Σ g)`.
    pub fn stiffening(&self) -> f64 {
        1.0 / (1.0 - self.terms.iter().map(|term| term.g).sum::<f64>())
    }
}
