//! The table of a tissue in a scene file.

#![expect(
    clippy::doc_markdown,
    reason = "these comments become the descriptions of the schema, which are plain text"
)]

use std::fmt;
use std::sync::LazyLock;

use schemars::JsonSchema;
use serde::de::{self, Deserializer, MapAccess, Visitor};
use serde::{Deserialize, Serialize};

use crate::law::LawName;
use crate::parameters::{self, Numbers, PARAMETERS, ParameterSpec, Unit};
use crate::units::{Density, Pressure, SpringConstant, Time};
use crate::{Moduli, Volume};

/// A tissue given by its values: either a law with its parameters, or `spring`. The simplest form
/// is `young` with `poisson`.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields, transform = parameters::describe)]
pub(crate) struct TissueTable {
    /// Name of the tissue in reports. Default: "given in the scene".
    #[serde(default = "default_name")]
    pub(crate) name: String,
    /// The elastic law. It determines which parameters the tissue takes. All laws agree at small
    /// strain. Default: "neo-hookean".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) law: Option<LawName>,
    #[serde(flatten)]
    #[schemars(skip)]
    pub(crate) numbers: Numbers<f64>,
    /// Ogden only: 1 to 6 terms. The sum of their `mu` is the shear modulus.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) terms: Option<Vec<OgdenTable>>,
    /// The energy of a change of volume. The linear and the St. Venant-Kirchhoff law always use the
    /// quadratic one. Default: "quadratic".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) volume: Option<Volume>,
    /// Relaxation of the stress at constant strain. Default: not at all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) prony: Option<PronyTable>,
    /// Stiffness of every bar of the layer, 1 µN/m to 1 MN/m. For the reference method only, and
    /// without a law.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) spring: Option<SpringConstant>,
    /// Density, 100 kg/m³ to 20000 kg/m³. Default: not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) density: Option<Density>,
    /// Source of the values, in words. Default: nothing said.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub(crate) source: String,
}

impl Default for TissueTable {
    fn default() -> Self {
        Self {
            name: default_name(),
            law: None,
            numbers: Numbers::default(),
            terms: None,
            volume: None,
            prony: None,
            spring: None,
            density: None,
            source: String::new(),
        }
    }
}

/// serde's `flatten` would read the same keys, but would lose the position of an error inside the
/// table.
impl<'de> Deserialize<'de> for TissueTable {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Table;

        impl<'de> Visitor<'de> for Table {
            type Value = TissueTable;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("struct TissueTable")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<TissueTable, A::Error> {
                let mut table = TissueTable::default();
                while let Some(key) = map.next_key()? {
                    match key {
                        Key::Name => table.name = map.next_value()?,
                        Key::Law => table.law = Some(map.next_value()?),
                        Key::Terms => table.terms = Some(map.next_value()?),
                        Key::Volume => table.volume = Some(map.next_value()?),
                        Key::Prony => table.prony = Some(map.next_value()?),
                        Key::Spring => table.spring = Some(map.next_value()?),
                        Key::Density => table.density = Some(map.next_value()?),
                        Key::Source => table.source = map.next_value()?,
                        Key::Number(spec) => {
                            let value = match spec.unit {
                                Unit::Pascal => map.next_value::<Pressure>()?.si(),
                                Unit::One => map.next_value()?,
                            };
                            table.numbers.set(spec.key, value);
                        }
                    }
                }
                Ok(table)
            }
        }

        deserializer.deserialize_map(Table)
    }
}

/// A key of a tissue's table.
#[derive(Clone, Copy)]
enum Key {
    Name,
    Law,
    Terms,
    Volume,
    Prony,
    Spring,
    Density,
    Source,
    Number(&'static ParameterSpec),
}

/// The keys other than the parameters of laws.
const OTHERS: [(&str, Key); 8] = [
    ("name", Key::Name),
    ("law", Key::Law),
    ("terms", Key::Terms),
    ("volume", Key::Volume),
    ("prony", Key::Prony),
    ("spring", Key::Spring),
    ("density", Key::Density),
    ("source", Key::Source),
];

impl<'de> Deserialize<'de> for Key {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Name;

        impl Visitor<'_> for Name {
            type Value = Key;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a key of a tissue")
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<Key, E> {
                static ALL: LazyLock<Vec<&'static str>> = LazyLock::new(|| {
                    let (first, rest) = OTHERS.split_at(2);
                    let numbers = PARAMETERS.iter().map(|spec| spec.key);
                    let names =
                        |keys: &'static [(&'static str, Key)]| keys.iter().map(|(name, _)| *name);
                    names(first).chain(numbers).chain(names(rest)).collect()
                });
                let other = OTHERS.iter().find(|(name, _)| *name == text);
                other
                    .map(|(_, key)| *key)
                    .or_else(|| ParameterSpec::of(text).map(Key::Number))
                    .ok_or_else(|| E::unknown_field(text, ALL.as_slice()))
            }
        }

        deserializer.deserialize_identifier(Name)
    }
}

/// A term of Ogden's energy, 2 mu/alpha² (λ1^alpha + λ2^alpha + λ3^alpha − 3), in the isochoric
/// stretches, as in Abaqus and CalculiX. Other definitions use mu·alpha/2 where this one has `mu`.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct OgdenTable {
    /// Contribution of the term to the shear modulus, 1 Pa to 1 GPa.
    pub(crate) mu: Pressure,
    /// The exponent, positive or negative, with an absolute value of 0.001 to 100.
    pub(crate) alpha: f64,
}

/// Relaxation as a Prony series: at constant strain, each term reduces the stress by its share `g`
/// with its time constant.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct PronyTable {
    /// 1 to 12 terms. The sum of their `g` is 0.99 at most.
    pub(crate) terms: Vec<PronyTermTable>,
    /// Whether the law's moduli are the long-term ones, after all relaxation, or the instantaneous
    /// ones, before any. Default: "long-term".
    #[serde(default)]
    pub(crate) moduli: Moduli,
    /// Whether the resistance to a change of volume relaxes too. Default: false.
    #[serde(default)]
    pub(crate) volume: bool,
}

/// A term of a Prony series.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct PronyTermTable {
    /// Share of the instantaneous stiffness that relaxes, 0.001 to 0.99.
    pub(crate) g: f64,
    /// The time constant, 0.1 ms to 100000 s.
    pub(crate) tau: Time,
}

fn default_name() -> String {
    "given in the scene".to_owned()
}
