//! Values that can be written in one of two forms.

use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{self, DeserializeOwned, Deserializer, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Serialize, Serializer};

use super::{ThicknessTable, TissueTable};
use crate::units::Length;

/// The tissue of a layer or lump: a name from the catalogue, or values.
#[derive(Debug, Serialize)]
#[serde(untagged)]
pub(crate) enum TissueSpec {
    Name(String),
    Inline(Box<TissueTable>),
}

/// The thickness of a layer.
#[derive(Debug, Serialize)]
#[serde(untagged)]
pub(crate) enum ThicknessSpec {
    Uniform(Length),
    Varying(ThicknessTable),
}

/// A direction: the name of an axis, or three numbers.
#[derive(Debug, Clone, Copy)]
pub(crate) enum AxisSpec {
    Name(AxisName),
    Vector([f64; 3]),
}

/// An axis of the body's frame.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum AxisName {
    /// (1, 0, 0)
    X,
    /// (0, 1, 0)
    Y,
    /// (0, 0, 1)
    Z,
}

/// A value that is written either as a text or as a table.
///
/// serde's untagged enums would do the same, but would lose the position and the reason of an error
/// inside the table.
trait TextOrTable: Sized {
    const EXPECTING: &'static str;
    type Table: DeserializeOwned;

    fn from_text(text: &str) -> Result<Self, String>;
    fn from_table(table: Self::Table) -> Self;
}

fn text_or_table<'de, T: TextOrTable, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<T, D::Error> {
    struct Either<T>(std::marker::PhantomData<T>);

    impl<'de, T: TextOrTable> Visitor<'de> for Either<T> {
        type Value = T;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str(T::EXPECTING)
        }

        fn visit_str<E: de::Error>(self, text: &str) -> Result<T, E> {
            T::from_text(text).map_err(E::custom)
        }

        fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<T, A::Error> {
            T::Table::deserialize(MapAccessDeserializer::new(map)).map(T::from_table)
        }
    }

    deserializer.deserialize_any(Either(std::marker::PhantomData))
}

impl TextOrTable for TissueSpec {
    const EXPECTING: &'static str = "the name of a tissue such as \"skin\", or a table such as { young = \"12 kPa\", poisson = 0.45 }";
    type Table = TissueTable;

    fn from_text(text: &str) -> Result<Self, String> {
        Ok(Self::Name(text.to_owned()))
    }

    fn from_table(table: TissueTable) -> Self {
        Self::Inline(table.into())
    }
}

impl TextOrTable for ThicknessSpec {
    const EXPECTING: &'static str = "a length with its unit such as \"1.5 mm\", or a table such as { axis = \"x\", \
         table = [[\"50 mm\", \"1.2 mm\"], [\"200 mm\", \"1.5 mm\"]] } or { file = \"thickness.csv\" }";
    type Table = ThicknessTable;

    fn from_text(text: &str) -> Result<Self, String> {
        text.parse()
            .map(Self::Uniform)
            .map_err(|e: crate::units::QuantityError| e.to_string())
    }

    fn from_table(table: ThicknessTable) -> Self {
        Self::Varying(table)
    }
}

impl<'de> Deserialize<'de> for TissueSpec {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        text_or_table(deserializer)
    }
}

impl<'de> Deserialize<'de> for ThicknessSpec {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        text_or_table(deserializer)
    }
}

impl<'de> Deserialize<'de> for AxisSpec {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Axis;

        impl<'de> Visitor<'de> for Axis {
            type Value = AxisSpec;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("\"x\", \"y\", \"z\" or three numbers such as [0, 0, 1]")
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<AxisSpec, E> {
                match text {
                    "x" => Ok(AxisSpec::Name(AxisName::X)),
                    "y" => Ok(AxisSpec::Name(AxisName::Y)),
                    "z" => Ok(AxisSpec::Name(AxisName::Z)),
                    _ => Err(E::invalid_value(de::Unexpected::Str(text), &self)),
                }
            }

            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<AxisSpec, A::Error> {
                <[f64; 3]>::deserialize(SeqAccessDeserializer::new(seq)).map(AxisSpec::Vector)
            }
        }

        deserializer.deserialize_any(Axis)
    }
}

impl Serialize for AxisSpec {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Name(name) => name.serialize(serializer),
            Self::Vector(vector) => vector.serialize(serializer),
        }
    }
}

macro_rules! either_schema {
    ($spec:ty, $text:ty, $other:ty) => {
        impl JsonSchema for $spec {
            fn inline_schema() -> bool {
                true
            }

            fn schema_name() -> std::borrow::Cow<'static, str> {
                stringify!($spec).into()
            }

            fn json_schema(generator: &mut SchemaGenerator) -> Schema {
                json_schema!({
                    "anyOf": [generator.subschema_for::<$text>(), generator.subschema_for::<$other>()],
                })
            }
        }
    };
}

either_schema!(TissueSpec, String, TissueTable);
either_schema!(ThicknessSpec, Length, ThicknessTable);
either_schema!(AxisSpec, AxisName, [f64; 3]);
