//! A material: its elastic law, relaxation, density and pre-stress.

use super::error::{check_not_negative, check_positive};
use super::{Law, LawError, Prony};

/// The material of a layer or a lump.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Its name in messages and reports, such as `fat`.
    pub name: String,
    /// The elastic law.
    pub law: Law,
    /// How stress relaxes; `None` for a purely elastic material.
    pub prony: Option<Prony>,
    /// Mass density at rest, kg/m³.
    pub density: f64,
    /// Tension that the layer has at rest in every direction of its plane, Pa.
    pub prestress: f64,
}

impl Material {
    /// Density of [`Material::new`]: that of water, kg/m³.
    pub const WATER: f64 = 1000.0;

    /// An elastic material of the density of water, without prestress.
    pub fn new(name: impl Into<String>, law: impl Into<Law>) -> Self {
        Self {
            name: name.into(),
            law: law.into(),
            prony: None,
            density: Self::WATER,
            prestress: 0.0,
        }
    }

    /// Checks density and pre-stress. The constructors have already checked the law and the series.
    ///
    /// # Errors
    /// A density that is not positive and finite, or a prestress that is negative or not finite.
    pub fn check(&self) -> Result<(), LawError> {
        check_positive("material", "the density", self.density, "kg/m³")?;
        check_not_negative("material", "the prestress", self.prestress, "Pa")?;
        Ok(())
    }
}
