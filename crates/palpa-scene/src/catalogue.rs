//! The catalogue of tissues that a scene can name, with the source of every number.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use serde::Deserialize;

use crate::law::LawName;
use crate::parameters::{Numbers, ParameterSpec, Unit};
use crate::resolve::law::Parts;
use crate::units::{Density, Pressure, Time};
use crate::{Moduli, Prony, PronyTerm, Sourced, Status, Tissue};

/// Every tissue of the catalogue.
pub fn catalogue() -> &'static [Tissue] {
    static CATALOGUE: LazyLock<Vec<Tissue>> = LazyLock::new(|| {
        read(include_str!("../data/tissues.toml"))
            .expect("the catalogue inside the program is valid, a test reads it")
    });
    &CATALOGUE
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    tissue: Vec<Entry>,
}

#[derive(Deserialize)]
struct Entry {
    name: String,
    law: LawName,
    prony: Option<WrittenProny>,
    density: Option<Written<Density>>,
    /// The parameters of the law, by their keys.
    #[serde(flatten)]
    numbers: BTreeMap<String, Written<WrittenNumber>>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum WrittenNumber {
    Plain(f64),
    WithUnit(String),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written<T> {
    value: T,
    status: Status,
    source: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenProny {
    terms: Vec<WrittenTerm>,
    status: Status,
    source: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenTerm {
    g: f64,
    tau: Time,
}

fn read(text: &str) -> Result<Vec<Tissue>, String> {
    let file: File = toml::from_str(text).map_err(|error| error.to_string())?;
    file.tissue.into_iter().map(Entry::tissue).collect()
}

impl Entry {
    fn tissue(self) -> Result<Tissue, String> {
        let mut numbers = Numbers::default();
        for (key, number) in self.numbers {
            let spec = ParameterSpec::of(&key).ok_or_else(|| format!("unknown key {key}"))?;
            let value = match (&number.value, spec.unit) {
                (WrittenNumber::Plain(value), Unit::One) => *value,
                (WrittenNumber::WithUnit(text), Unit::Pascal) => {
                    text.parse::<Pressure>().map_err(|e| e.to_string())?.si()
                }
                _ => return Err(format!("{}: {key} has the wrong unit", self.name)),
            };
            numbers.set(spec.key, number.sourced(|_| value));
        }
        let parts = Parts {
            law: self.law,
            numbers,
            ..Parts::default()
        };
        Ok(Tissue {
            law: parts
                .law()
                .map_err(|fault| format!("{}: {}", self.name, fault.message))?,
            name: self.name,
            prony: self.prony.map(WrittenProny::prony),
            density: self.density.map(|density| density.sourced(Density::si)),
        })
    }
}

impl<T> Written<T> {
    fn sourced(self, to_si: impl Fn(T) -> f64) -> Sourced {
        Sourced {
            value: to_si(self.value),
            status: self.status,
            source: self.source,
        }
    }
}

impl WrittenProny {
    /// The moduli in the catalogue are long-term moduli.
    fn prony(self) -> Prony {
        let term = |term: &WrittenTerm| PronyTerm {
            g: term.g,
            tau: term.tau.si(),
        };
        Prony {
            terms: self.terms.iter().map(term).collect(),
            moduli: Moduli::LongTerm,
            relaxes_volume: false,
            status: self.status,
            source: self.source,
        }
    }
}
