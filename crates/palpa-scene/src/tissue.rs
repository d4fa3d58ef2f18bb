//! What a tissue is: an elastic law, how it relaxes, its density; every number with its source.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Elastic;

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

impl Prony {
    /// Stiffness at once over stiffness at rest: `1/(1 − Σ g)`.
    pub fn stiffening(&self) -> f64 {
        1.0 / (1.0 - self.terms.iter().map(|term| term.g).sum::<f64>())
    }
}
