//! The tissues that a scene can name, with the source of every number.

use std::sync::LazyLock;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::units::{Density, Pressure};

/// A tissue: its elasticity and, where known, its density.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tissue {
    /// Its name.
    pub name: String,
    /// How it resists deformation.
    pub law: Law,
    /// Density in kg/m³, where known.
    pub density: Option<Sourced>,
}

/// How a tissue resists deformation.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Law {
    /// Isotropic elasticity.
    Elastic {
        /// Young's modulus in pascals.
        young: Sourced,
        /// Poisson's ratio.
        poisson: Sourced,
    },
    /// Every bar is a spring of one stiffness, as in the reference method.
    Spring {
        /// Stiffness of a bar in N/m.
        constant: Sourced,
    },
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
    /// Young's modulus in pascals, unless the tissue is given by a spring stiffness.
    pub fn young(&self) -> Option<f64> {
        match &self.law {
            Law::Elastic { young, .. } => Some(young.value),
            Law::Spring { .. } => None,
        }
    }

    /// Poisson's ratio, unless the tissue is given by a spring stiffness.
    pub fn poisson(&self) -> Option<f64> {
        match &self.law {
            Law::Elastic { poisson, .. } => Some(poisson.value),
            Law::Spring { .. } => None,
        }
    }

    /// Stiffness of every bar in N/m, if the tissue is given by it.
    pub fn spring(&self) -> Option<f64> {
        match &self.law {
            Law::Spring { constant } => Some(constant.value),
            Law::Elastic { .. } => None,
        }
    }

    /// How far the stiffness (Young's modulus or spring constant) is to be trusted.
    pub fn status(&self) -> Status {
        match &self.law {
            Law::Elastic {
                young: stiffness, ..
            }
            | Law::Spring {
                constant: stiffness,
            } => stiffness.status,
        }
    }
}

/// Every tissue that a scene can name.
pub fn catalogue() -> &'static [Tissue] {
    static CATALOGUE: LazyLock<Vec<Tissue>> = LazyLock::new(|| {
        read(include_str!("../data/tissues.toml"))
            .expect("the catalogue inside the program is valid, a test reads it")
    });
    &CATALOGUE
}

fn read(text: &str) -> Result<Vec<Tissue>, toml::de::Error> {
    #[derive(Deserialize)]
    #[serde(deny_unknown_fields)]
    struct File {
        tissue: Vec<Entry>,
    }

    #[derive(Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Entry {
        name: String,
        young: Written<Pressure>,
        poisson: Written<f64>,
        density: Option<Written<Density>>,
    }

    #[derive(Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Written<T> {
        value: T,
        status: Status,
        source: String,
    }

    impl<T> Written<T> {
        fn sourced(self, to_si: fn(T) -> f64) -> Sourced {
            Sourced {
                value: to_si(self.value),
                status: self.status,
                source: self.source,
            }
        }
    }

    let file: File = toml::from_str(text)?;
    Ok(file
        .tissue
        .into_iter()
        .map(|entry| Tissue {
            name: entry.name,
            law: Law::Elastic {
                young: entry.young.sourced(Pressure::si),
                poisson: entry.poisson.sourced(|ratio| ratio),
            },
            density: entry.density.map(|density| density.sourced(Density::si)),
        })
        .collect())
}
