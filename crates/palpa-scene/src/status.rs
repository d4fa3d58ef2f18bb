//! The material of a layer or lump and how reliable its data is, for reports.

use std::fmt;

use serde::Serialize;

use crate::units::{Pressure, Time};
use crate::{Elastic, Law, Layer, Lump, Moduli, Prony, Sourced, Status, Tissue, Volume};

/// Material of a layer or lump, and how reliable its data is. Reports show it beside every force.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MaterialStatus {
    /// Name of the tissue.
    pub tissue: String,
    /// Name of the law: `neo-hookean`, `ogden`, `spring`, ….
    pub law: &'static str,
    /// The law with its parameters and relaxation, in words.
    pub summary: String,
    /// Every number that the scene or the catalogue gives for the material.
    pub parameters: Vec<Parameter>,
    /// Young's modulus at small strain in pascals; `None` for a layer given by a spring stiffness.
    pub young: Option<f64>,
    /// Poisson's ratio at small strain; `None` for a layer given by a spring stiffness.
    pub poisson: Option<f64>,
    /// Stiffness of every bar in N/m, for a layer given by a spring stiffness.
    pub spring: Option<f64>,
    /// In-plane tension at rest in pascals; 0 in a lump.
    pub prestress: f64,
    /// How reliable the stiffness is.
    pub status: Status,
    /// Source of the stiffness; may be empty when the scene gives it.
    pub source: String,
    /// How reliable Poisson's ratio (or the bulk modulus) is; `None` without one.
    pub poisson_status: Option<Status>,
    /// How reliable the thickness is; `None` for a layer that reaches to the bone, and for a lump.
    pub thickness_status: Option<Status>,
    /// Source of the thickness; may be empty.
    pub thickness_source: String,
}

/// A number of a material. Displayed as `c10 420 Pa`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Parameter {
    /// Its name as a scene writes it, such as `c10` or `terms[0].mu`.
    pub name: String,
    /// Its value in SI.
    pub value: f64,
    /// Its unit; empty for a plain number.
    pub unit: &'static str,
    /// How reliable the number is.
    pub status: Status,
    /// Source of the number; may be empty when the scene gives it.
    pub source: String,
}

impl Layer {
    /// Material of the layer, and how reliable its data is.
    pub fn material_status(&self) -> MaterialStatus {
        let summary = summary(&self.tissue);
        MaterialStatus {
            summary: if self.prestress > 0.0 {
                format!(
                    "{summary}, under {} in its plane",
                    Pressure::from_si(self.prestress)
                )
            } else {
                summary
            },
            prestress: self.prestress,
            thickness_status: self.thickness.as_ref().map(|_| self.thickness_status),
            thickness_source: self.thickness_source.clone(),
            ..status(&self.tissue)
        }
    }
}

impl Lump {
    /// Material of the lump, and how reliable its data is.
    pub fn material_status(&self) -> MaterialStatus {
        status(&self.tissue)
    }
}

fn status(tissue: &Tissue) -> MaterialStatus {
    let stiffness = tissue.law.stiffness();
    let elastic = tissue.elastic();
    MaterialStatus {
        tissue: tissue.name.clone(),
        law: tissue.law.name(),
        summary: summary(tissue),
        parameters: parameters(tissue),
        young: tissue.young(),
        poisson: tissue.poisson(),
        spring: tissue.spring(),
        prestress: 0.0,
        status: stiffness.status,
        source: stiffness.source.clone(),
        poisson_status: elastic.map(|elastic| elastic.resistance.sourced().status),
        thickness_status: None,
        thickness_source: String::new(),
    }
}

/// The law as a scene names it, and every parameter:
/// `neo-hookean: c10 420 Pa, bulk 36 kPa; relaxes by …`.
fn summary(tissue: &Tissue) -> String {
    let mut parts: Vec<String> = law_parameters(&tissue.law)
        .iter()
        .map(Parameter::to_string)
        .collect();
    if tissue
        .elastic()
        .is_some_and(|law| law.volume == Volume::Logarithmic)
    {
        parts.push("logarithmic volume".to_owned());
    }
    let relaxation = tissue.prony.as_ref().map_or(String::new(), relaxation);
    format!("{}: {}{relaxation}", tissue.law.name(), parts.join(", "))
}

fn relaxation(prony: &Prony) -> String {
    let terms = prony.terms.iter();
    let terms = terms.map(|term| format!("{} in {}", term.g, Time::from_si(term.tau)));
    let terms: Vec<String> = terms.collect();
    let moduli = match prony.moduli {
        Moduli::LongTerm => "at rest",
        Moduli::Instantaneous => "at once",
    };
    let volume = if prony.relaxes_volume {
        ", the volume too"
    } else {
        ""
    };
    format!(
        "; relaxes by {}{volume} (moduli {moduli})",
        terms.join(", ")
    )
}

fn parameters(tissue: &Tissue) -> Vec<Parameter> {
    let mut all = law_parameters(&tissue.law);
    if let Some(prony) = &tissue.prony {
        for (i, term) in prony.terms.iter().enumerate() {
            for (key, value, unit) in [("g", term.g, ""), ("tau", term.tau, "s")] {
                all.push(Parameter {
                    name: format!("prony.terms[{i}].{key}"),
                    value,
                    unit,
                    status: prony.status,
                    source: prony.source.clone(),
                });
            }
        }
    }
    let density = tissue.density.as_ref();
    all.extend(density.map(|density| Parameter::new("density", density, "kg/m³")));
    all
}

fn law_parameters(law: &Law) -> Vec<Parameter> {
    match law {
        Law::Spring { constant } => vec![Parameter::new("spring", constant, "N/m")],
        Law::Elastic(elastic) => elastic_parameters(elastic),
    }
}

/// The parameters of an elastic law. Those of Ogden's terms come before Poisson's ratio or the bulk
/// modulus, as in all other laws.
fn elastic_parameters(elastic: &Elastic) -> Vec<Parameter> {
    let numbers = elastic.numbers();
    let mut all: Vec<Parameter> = (numbers.given())
        .map(|(spec, number)| Parameter::new(spec.key, number, spec.unit.symbol()))
        .collect();
    let terms = elastic.energy.terms().iter().enumerate();
    let terms = terms.flat_map(|(i, term)| {
        let mu = Parameter::new(&format!("terms[{i}].mu"), &term.mu, "Pa");
        let alpha = Parameter {
            name: format!("terms[{i}].alpha"),
            value: term.alpha,
            unit: "",
            ..Parameter::new("", &term.mu, "")
        };
        [mu, alpha]
    });
    all.splice(all.len() - 1..all.len() - 1, terms);
    all
}

impl Parameter {
    fn new(name: &str, number: &Sourced, unit: &'static str) -> Self {
        Self {
            name: name.to_owned(),
            value: number.value,
            unit,
            status: number.status,
            source: number.source.clone(),
        }
    }
}

/// Shown with six digits: more digits of a derived number have no meaning.
impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = &self.name;
        let value: f64 = format!("{:.5e}", self.value).parse().unwrap_or(self.value);
        match self.unit {
            "" => write!(f, "{name} {value}"),
            "Pa" => write!(f, "{name} {}", Pressure::from_si(value)),
            unit => write!(f, "{name} {value} {unit}"),
        }
    }
}
