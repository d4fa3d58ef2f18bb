//! The numbers that elastic laws take: key, unit, range, default and description of each, declared
//! in one place.
//!
//! Reading, checking, writing, the schema and the reports all use [`PARAMETERS`]. `law.rs` says
//! which law takes which parameter.

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};
use serde_json::Value;

use crate::error::Site;
use crate::limits::{self, Limits};
use crate::units::Pressure;
use crate::{SceneError, Sourced, Status};

/// A number that elastic laws take.
#[derive(Debug)]
pub(crate) struct ParameterSpec {
    /// Its key in a scene file.
    pub(crate) key: &'static str,
    pub(crate) unit: Unit,
    pub(crate) range: Range,
    /// What happens if the scene does not give it.
    pub(crate) missing: Missing,
    /// Its description in the schema; `{range}` stands for the range.
    pub(crate) about: &'static str,
}

/// The unit of a parameter, in SI.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unit {
    /// Pa; a scene writes a text such as `"12 kPa"`.
    Pascal,
    /// A plain number.
    One,
}

/// The allowed values of a parameter, in SI units, both ends included.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Range {
    Within(f64, f64),
    /// Range of the absolute value; the number may have either sign.
    Size(f64, f64),
}

/// What happens if a law's parameter is missing.
#[derive(Debug)]
pub(crate) enum Missing {
    /// It is not needed, or another parameter takes its place.
    Optional,
    /// It has this default value, from this source.
    Default(f64, &'static str),
    /// The scene is refused with this reason: `a fung law needs …`.
    Refused(&'static str),
}

use Missing::{Default as Otherwise, Optional, Refused};
use Range::{Size, Within};
use Unit::{One, Pascal};

/// Number of [`PARAMETERS`].
const N_PARAMETERS: usize = 11;

/// All parameters, in the order in which a scene writes them.
pub(crate) static PARAMETERS: [ParameterSpec; N_PARAMETERS] = [
    ParameterSpec {
        key: "young",
        unit: Pascal,
        // From below the softest gel to nearly rigid compared with tissue.
        range: Within(limits::YOUNG.min.si(), limits::YOUNG.max.si()),
        missing: Optional,
        about: "Young's modulus at small strain, {range}. Stands in place of `c10`, `shear` or an Ogden term's `mu`.",
    },
    ParameterSpec {
        key: "shear",
        unit: Pascal,
        range: Within(limits::SHEAR.min.si(), limits::SHEAR.max.si()),
        missing: Optional,
        about: "The shear modulus at small strain, {range}.",
    },
    ParameterSpec {
        key: "c10",
        unit: Pascal,
        range: Within(limits::SHEAR.min.si(), limits::SHEAR.max.si()),
        missing: Optional,
        about: "Neo-Hooke, Mooney-Rivlin and Yeoh: the factor of I1 − 3, {range}. The shear modulus is 2 c10, with \
                Mooney-Rivlin 2 (c10 + c01).",
    },
    ParameterSpec {
        key: "c01",
        unit: Pascal,
        range: Within(0.0, 1e9),
        missing: Refused("`c01 = \"1 kPa\"`"),
        about: "Mooney-Rivlin: the factor of I2 − 3, {range}.",
    },
    ParameterSpec {
        key: "c20",
        unit: Pascal,
        range: Within(-1e9, 1e9),
        missing: Otherwise(0.0, "default"),
        about: "Yeoh: the factor of (I1 − 3)², {range}, such that the energy grows throughout. Default: 0.",
    },
    ParameterSpec {
        key: "c30",
        unit: Pascal,
        range: Within(0.0, 1e9),
        missing: Otherwise(0.0, "default"),
        about: "Yeoh: the factor of (I1 − 3)³, {range}. Default: 0.",
    },
    ParameterSpec {
        key: "alpha",
        unit: One,
        // Smaller exponents cancel and larger ones overflow; neither fits a tissue.
        range: Size(0.001, 100.0),
        missing: Optional,
        about: "Ogden with `young` or `shear`: the exponent of the one term, of either sign and a size of {range}.",
    },
    ParameterSpec {
        key: "b",
        unit: One,
        range: Within(0.001, 1000.0),
        missing: Refused("`b = 10`, which says how fast it stiffens"),
        about: "Fung: how fast the tissue stiffens, {range}. The shear stiffness is doubled where I1 − 3 = 0.7/b, at a \
                stretch of about 1 + 0.5/√b.",
    },
    ParameterSpec {
        key: "jm",
        unit: One,
        range: Within(0.01, 10_000.0),
        missing: Refused("`jm = 10`, the I1 − 3 beyond which it cannot be stretched"),
        about: "Gent: the I1 − 3 beyond which the tissue cannot be stretched, {range}. A pull to the stretch λ at constant \
                volume is I1 − 3 = λ² + 2/λ − 3.",
    },
    ParameterSpec {
        key: "poisson",
        unit: One,
        range: Within(limits::POISSON.min, limits::POISSON.max),
        missing: Otherwise(0.45, "default, customary in limb indentation"),
        about: "Poisson's ratio at small strain, {range}. Default: 0.45, customary in limb indentation.",
    },
    ParameterSpec {
        key: "bulk",
        unit: Pascal,
        // The upper limit is below a thousand times the bulk modulus of water.
        range: Within(1.0, 1e12),
        missing: Optional,
        about: "The bulk modulus K in place of `poisson`, {range} and such that Poisson's ratio is 0 to 0.4999. D1 of \
                Abaqus is 2/K.",
    },
];

impl ParameterSpec {
    /// The entry of [`PARAMETERS`] with this key.
    pub(crate) fn of(key: &str) -> Option<&'static Self> {
        PARAMETERS.iter().find(|spec| spec.key == key)
    }

    /// The default, if it has one.
    pub(crate) fn default(&self) -> Option<Sourced> {
        match self.missing {
            Otherwise(value, source) => Some(Sourced {
                value,
                status: Status::Assumed,
                source: source.to_owned(),
            }),
            Optional | Refused(_) => None,
        }
    }

    /// The value at `at`, or an error if it is out of range.
    pub(crate) fn checked(&self, at: &Site<'_>, value: f64) -> Result<f64, SceneError> {
        match (self.range, self.unit) {
            (Within(min, max), One) => at.within(value, &Limits { min, max }),
            (Within(min, max), Pascal) => {
                let [min, max] = [min, max].map(Pressure::from_si);
                Ok(at.within(Pressure::from_si(value), &Limits { min, max })?.si())
            }
            (Size(min, max), _) if Limits { min, max }.contains(&value.abs()) => Ok(value),
            (Size(..), _) => Err(at.invalid(format!(
                "an exponent of {value} is outside the allowed range {} of either sign; check the number",
                self.allowed()
            ))),
        }
    }

    /// The range in words.
    fn allowed(&self) -> String {
        let (Within(min, max) | Size(min, max)) = self.range;
        match self.unit {
            One => Limits { min, max }.to_string(),
            Pascal => {
                let [min, max] = [min, max].map(Pressure::from_si);
                Limits { min, max }.to_string()
            }
        }
    }

    /// The schema of its value, with its description.
    fn schema(&self) -> Value {
        let generator = &mut SchemaGenerator::default();
        let mut schema = match self.unit {
            One => f64::json_schema(generator),
            Pascal => Pressure::json_schema(generator),
        };
        let about = self.about.replace("{range}", &self.allowed());
        schema.insert("description".to_owned(), about.into());
        schema.to_value()
    }
}

impl Unit {
    /// Its symbol; empty for a plain number.
    pub(crate) fn symbol(self) -> &'static str {
        match self {
            Pascal => "Pa",
            One => "",
        }
    }
}

/// Values of [`PARAMETERS`], as far as they are given.
#[derive(Debug, Clone)]
pub(crate) struct Numbers<T>([Option<T>; N_PARAMETERS]);

impl<T> Default for Numbers<T> {
    fn default() -> Self {
        Self(std::array::from_fn(|_| None))
    }
}

impl<T> Numbers<T> {
    pub(crate) fn get(&self, key: &str) -> Option<&T> {
        self.0[place(key)].as_ref()
    }

    pub(crate) fn set(&mut self, key: &str, value: T) {
        self.0[place(key)] = Some(value);
    }

    /// The given values, in the order of [`PARAMETERS`].
    pub(crate) fn given(&self) -> impl Iterator<Item = (&'static ParameterSpec, &T)> {
        let all = PARAMETERS.iter().zip(&self.0);
        all.filter_map(|(spec, value)| Some((spec, value.as_ref()?)))
    }
}

fn place(key: &str) -> usize {
    let place = PARAMETERS.iter().position(|spec| spec.key == key);
    place.unwrap_or_else(|| panic!("`{key}` is no parameter of a law"))
}

/// Serialized as keys of a tissue's table.
impl Serialize for Numbers<f64> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        for (spec, &value) in self.given() {
            match spec.unit {
                One => map.serialize_entry(spec.key, &value)?,
                Pascal => map.serialize_entry(spec.key, &Pressure::from_si(value))?,
            }
        }
        map.end()
    }
}

/// Adds the parameters to the schema of a tissue's table.
pub(crate) fn describe(table: &mut Schema) {
    let Some(Value::Object(properties)) = table.get_mut("properties") else {
        return;
    };
    for spec in &PARAMETERS {
        properties.insert(spec.key.to_owned(), spec.schema());
    }
}
