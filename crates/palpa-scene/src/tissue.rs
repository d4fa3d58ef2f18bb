//! A tissue: an elastic law, relaxation and density. Every number has its source.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Elastic;

/// A tissue: its resistance to deformation, its relaxation and, where known, its density.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tissue {
    /// Its name.
    pub name: String,
    /// Resistance to deformation.
    pub law: Law,
    /// Relaxation; `None` for a tissue without it.
    pub prony: Option<Prony>,
    /// Density in kg/m³, where known.
    pub density: Option<Sourced>,
}

/// The resistance of a tissue to deformation.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Law {
    /// An isotropic elastic solid.
    Elastic(Elastic),
    /// Every bar is a spring of the same stiffness; for the reference method only.
    Spring {
        /// Stiffness of a bar in N/m.
        constant: Sourced,
    },
}

/// Relaxation as a Prony series: `G(t) = G₀ (1 − Σ gᵢ (1 − exp(−t/τᵢ)))`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Prony {
    /// 1 to 12 terms; the sum of their `g` is less than 1.
    pub terms: Vec<PronyTerm>,
    /// State of relaxation at which the law's moduli hold.
    pub moduli: Moduli,
    /// Whether the volumetric part relaxes too.
    pub relaxes_volume: bool,
    /// How reliable the terms are.
    pub status: Status,
    /// Source of the terms; may be empty when the scene gives them.
    pub source: String,
}

/// A term of a Prony series.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PronyTerm {
    /// Share of the instantaneous modulus that relaxes, above 0.
    pub g: f64,
    /// Time constant in seconds.
    pub tau: f64,
}

/// State of relaxation at which the moduli of a tissue's law hold.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Moduli {
    /// After all relaxation. The instantaneous stiffness is higher, by the factor 1/(1 − Σ g).
    #[default]
    LongTerm,
    /// Before any relaxation. The long-term stiffness is lower, by the factor 1 − Σ g.
    Instantaneous,
}

/// A number with its source.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sourced {
    /// The value in SI units.
    pub value: f64,
    /// How reliable the value is.
    pub status: Status,
    /// Source in words; may be empty when the scene gives the value.
    pub source: String,
}

/// How reliable a number is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Taken from the publication that measured it, or measured on the body itself.
    Measured,
    /// From an abstract or a secondary source.
    Literature,
    /// From memory, an order of magnitude, or a choice.
    Assumed,
    /// Given by the scene, whose author answers for it.
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

    /// Young's modulus at small strain in pascals, unless the tissue is given by a spring
    /// stiffness.
    pub fn young(&self) -> Option<f64> {
        self.elastic().map(Elastic::young)
    }

    /// Poisson's ratio at small strain, unless the tissue is given by a spring stiffness.
    pub fn poisson(&self) -> Option<f64> {
        self.elastic().map(Elastic::poisson)
    }

    /// Stiffness of every bar in N/m, if the tissue is given by a spring stiffness.
    pub fn spring(&self) -> Option<f64> {
        match &self.law {
            Law::Spring { constant } => Some(constant.value),
            Law::Elastic(_) => None,
        }
    }

    /// How reliable the stiffness is.
    pub fn status(&self) -> Status {
        self.law.stiffness().status
    }
}

impl Law {
    /// Name of the law as a scene writes it: `neo-hookean`, `ogden`, `spring`, ….
    pub fn name(&self) -> &'static str {
        match self {
            Self::Elastic(elastic) => elastic.energy.name(),
            Self::Spring { .. } => "spring",
        }
    }

    /// The number that determines the stiffness, as it was given.
    pub(crate) fn stiffness(&self) -> &Sourced {
        match self {
            Self::Elastic(elastic) => elastic.energy.given(),
            Self::Spring { constant } => constant,
        }
    }
}

impl Prony {
    /// Instantaneous stiffness divided by long-term stiffness: `1/(1 − Σ g)`.
    pub fn stiffening(&self) -> f64 {
        1.0 / (1.0 - self.terms.iter().map(|term| term.g).sum::<f64>())
    }
}
