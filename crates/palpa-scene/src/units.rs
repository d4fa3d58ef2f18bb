//! Quantities: texts with a unit in a scene file, SI values in the program.
//!
//! The crate `uom` defines the units. This module splits a text into number and unit, accepts
//! several spellings of a unit, and writes values back.

use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;
use std::str::FromStr;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, Deserialize, Deserializer, Visitor};
use serde::{Serialize, Serializer};
use uom::si::f64 as si;

/// Longest text of a quantity. Splitting tries every position, so this limits its work.
const MAX_TEXT: usize = 64;

/// A kind of quantity: its name, its units, and the conversion of a number with a unit to SI.
pub trait Kind: Copy + fmt::Debug + PartialOrd {
    /// Name in messages, with its article: `a length`.
    const NAME: &'static str;
    /// An example of the notation.
    const EXAMPLE: &'static str;
    /// Unit of the value in SI.
    const BASE: &'static str;
    /// Units for writing a value: symbol, value in SI, and least number for which it is used; from
    /// large to small.
    const SCALE: &'static [(&'static str, f64, f64)];

    /// The SI value of `number` in `unit`, or `None` if `unit` does not measure this kind.
    fn to_si(number: f64, unit: &str) -> Option<f64>;
}

macro_rules! kind {
    ($(#[$doc:meta])* $alias:ident, $kind:ident, $name:literal, $example:literal, $base:literal, $scale:expr, $to_si:expr) => {
        #[doc = concat!("Marks ", $name, ".")]
        #[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
        pub enum $kind {}

        impl Kind for $kind {
            const NAME: &'static str = $name;
            const EXAMPLE: &'static str = $example;
            const BASE: &'static str = $base;
            const SCALE: &'static [(&'static str, f64, f64)] = $scale;

            fn to_si(number: f64, unit: &str) -> Option<f64> {
                let to_si: fn(f64, &str) -> Option<f64> = $to_si;
                to_si(number, unit)
            }
        }

        $(#[$doc])*
        pub type $alias = Quantity<$kind>;
    };
}

kind!(
    /// A length, in metres.
    Length, LengthKind, "a length", "1.5 mm", "m",
    &[("m", 1.0, 1.0), ("mm", 1e-3, 0.1), ("µm", 1e-6, 1.0)],
    |number, unit| Some(parse::<si::Length>(number, unit)?.value)
);
kind!(
    /// A pressure or an elastic modulus, in pascals.
    Pressure, PressureKind, "a pressure", "12 kPa", "Pa",
    &[("GPa", 1e9, 1.0), ("MPa", 1e6, 1.0), ("kPa", 1e3, 1.0), ("Pa", 1.0, 1.0)],
    |number, unit| Some(parse::<si::Pressure>(number, unit)?.value)
);
kind!(
    /// A velocity, in metres per second.
    Velocity, VelocityKind, "a velocity", "10 mm/s", "m/s",
    &[("m/s", 1.0, 1.0), ("mm/s", 1e-3, 1.0)],
    |number, unit| Some(parse::<si::Velocity>(number, unit)?.value)
);
kind!(
    /// A time, in seconds.
    Time, TimeKind, "a time", "0.5 s", "s",
    &[("s", 1.0, 0.1), ("ms", 1e-3, 1.0)],
    |number, unit| Some(parse::<si::Time>(number, unit)?.value)
);
kind!(
    /// A rate, per second: one divided by any time, such as `5 1/s`, or a frequency, such as
    /// `5 Hz`.
    Rate, RateKind, "a rate", "5 1/s", "1/s",
    &[("1/s", 1.0, 1.0)],
    |number, unit| match unit.split_once('/') {
        Some(("1", time)) => Some(number / parse::<si::Time>(1.0, time)?.value),
        _ => Some(parse::<si::Frequency>(number, unit)?.value),
    }
);
kind!(
    /// An angle, in radians.
    Angle, AngleKind, "an angle", "30 deg", "rad",
    &[("deg", std::f64::consts::PI / 180.0, 0.0)],
    |number, unit| Some(parse::<si::Angle>(number, unit)?.value)
);
kind!(
    /// A force, in newtons.
    Force, ForceKind, "a force", "2 N", "N",
    &[("N", 1.0, 0.1), ("mN", 1e-3, 1.0)],
    |number, unit| Some(parse::<si::Force>(number, unit)?.value)
);
kind!(
    /// The stiffness of a spring, in newtons per metre: any force divided by any length, such as
    /// `dyn/cm` or `N/mm`.
    SpringConstant, SpringConstantKind, "a stiffness", "90 dyn/cm", "N/m",
    &[("MN/m", 1e6, 1.0), ("kN/m", 1e3, 1.0), ("N/m", 1.0, 1.0), ("mN/m", 1e-3, 1.0), ("µN/m", 1e-6, 1.0)],
    |number, unit| {
        let (force, length) = unit.split_once('/')?;
        Some(parse::<si::Force>(number, force)?.value / parse::<si::Length>(1.0, length)?.value)
    }
);
kind!(
    /// A density, in kilograms per cubic metre.
    Density, DensityKind, "a density", "1060 kg/m³", "kg/m³",
    &[("kg/m³", 1.0, 1.0)],
    |number, unit| Some(parse::<si::MassDensity>(number, unit)?.value)
);
kind!(
    /// A share of a whole, as a number.
    Share, ShareKind, "a share", "3 %", "%",
    &[("%", 0.01, 0.0)],
    |number, unit| (unit == "%").then_some(number / 100.0)
);

/// A value in SI that is written as a text with a unit.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
pub struct Quantity<K> {
    si: f64,
    kind: PhantomData<K>,
}

impl<K> Quantity<K> {
    /// The quantity with this value in SI units.
    pub const fn from_si(si: f64) -> Self {
        Self {
            si,
            kind: PhantomData,
        }
    }

    /// The value in SI units.
    pub const fn si(self) -> f64 {
        self.si
    }
}

impl Pressure {
    /// Rounded to three digits by `round`, for messages.
    pub(crate) fn rounded(pascals: f64, round: fn(f64) -> f64) -> Self {
        let unit = 10f64.powf(pascals.abs().log10().floor() - 2.0);
        let scaled = round(pascals / unit) * unit;
        Self::from_si(if scaled.is_finite() { scaled } else { pascals })
    }
}

/// Zero.
impl<K> Default for Quantity<K> {
    fn default() -> Self {
        Self::from_si(0.0)
    }
}

/// The reason why a text is not a quantity of the wanted kind.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum QuantityError {
    /// The text does not begin with a number.
    #[error("{text:?} does not begin with a number; write {wanted}")]
    NoNumber {
        /// The text as found, shortened.
        text: String,
        /// The kind wanted, with an example.
        wanted: String,
    },
    /// The text is too long to be a quantity.
    #[error("{text:?} is longer than any quantity; write {wanted}")]
    TooLong {
        /// The text as found, shortened.
        text: String,
        /// The kind wanted, with an example.
        wanted: String,
    },
    /// The number is infinite or not a number.
    #[error("{text:?} is not a finite number; write {wanted}")]
    NotFinite {
        /// The text as found.
        text: String,
        /// The kind wanted, with an example.
        wanted: String,
    },
    /// The number has no unit.
    #[error("{text:?} has no unit; write {wanted}")]
    NoUnit {
        /// The text as found.
        text: String,
        /// The kind wanted, with an example.
        wanted: String,
    },
    /// The unit is not known, or measures something else.
    #[error("{unit:?} in {text:?} is not a unit of {kind}; write {wanted}")]
    WrongUnit {
        /// The text as found.
        text: String,
        /// The unit as found.
        unit: String,
        /// The kind wanted, without its article.
        kind: &'static str,
        /// The kind wanted, with an example.
        wanted: String,
    },
}

fn wanted<K: Kind>() -> String {
    format!("{} with its unit, such as \"{}\"", K::NAME, K::EXAMPLE)
}

impl<K: Kind> FromStr for Quantity<K> {
    type Err = QuantityError;

    fn from_str(text: &str) -> Result<Self, QuantityError> {
        let wanted = wanted::<K>();
        let trimmed = text.trim();
        let text = shortened(trimmed);
        if trimmed.len() > MAX_TEXT {
            return Err(QuantityError::TooLong { text, wanted });
        }
        let Some((number, unit)) = split(trimmed) else {
            return Err(QuantityError::NoNumber { text, wanted });
        };
        if !number.is_finite() {
            return Err(QuantityError::NotFinite { text, wanted });
        }
        if unit.is_empty() {
            return Err(QuantityError::NoUnit { text, wanted });
        }
        match K::to_si(number, &spelling(unit)) {
            Some(si) if si.is_finite() => Ok(Self::from_si(decimal(number, si))),
            Some(_) => Err(QuantityError::NotFinite { text, wanted }),
            None => Err(QuantityError::WrongUnit {
                text,
                unit: unit.to_owned(),
                kind: K::NAME.split_once(' ').map_or(K::NAME, |(_, name)| name),
                wanted,
            }),
        }
    }
}

/// Splits off the longest beginning that is a number, and returns it with the rest: `1.5 mm`, and
/// `1.5mm` too.
fn split(text: &str) -> Option<(f64, &str)> {
    (1..=text.len())
        .rev()
        .filter(|&end| text.is_char_boundary(end))
        .find_map(|end| Some((text[..end].parse().ok()?, text[end..].trim_start())))
}

/// The decimal number that `si` stands for. A factor such as 1e-6 is rounded, which turns 10 µm
/// into 9.999999999999999e-6.
fn decimal(number: f64, si: f64) -> f64 {
    if si.to_bits() == number.to_bits() {
        return si;
    }
    let rounded = format!("{si:.14e}").parse().unwrap_or(si);
    if (rounded - si).abs() <= 4.0 * f64::EPSILON * si.abs() {
        rounded
    } else {
        si
    }
}

/// The spelling of a unit that `uom` knows: one micro sign, raised powers, meters for metres.
fn spelling(unit: &str) -> Cow<'_, str> {
    let mut unit = unit
        .replace('\u{3bc}', "µ")
        .replace("metre", "meter")
        .replace("^2", "²")
        .replace("^3", "³")
        .replace("m2", "m²")
        .replace("m3", "m³");
    if unit == "deg" {
        "degree".clone_into(&mut unit);
    }
    if let Some(rest) = unit.strip_prefix('u') {
        unit = format!("µ{rest}");
    }
    Cow::Owned(unit)
}

fn parse<Q: FromStr>(number: f64, unit: &str) -> Option<Q> {
    format!("{number:e} {unit}").parse().ok()
}

/// The text, or its beginning, on one line, so that an error message stays readable whatever the
/// text is.
pub(crate) fn shortened(text: &str) -> String {
    const MOST: usize = 40;
    let mut chars = text.chars();
    let visible = |c: char| if c.is_control() { '\u{fffd}' } else { c };
    let mut start: String = chars.by_ref().take(MOST).map(visible).collect();
    if chars.next().is_some() {
        start.push('…');
    }
    start
}

/// Written in the unit that reads best. Reading the text back gives the same value bit for bit.
impl<K: Kind> fmt::Display for Quantity<K> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let magnitude = self.si.abs();
        let readable = K::SCALE
            .iter()
            .find(|&&(_, size, from)| magnitude >= size * from * (1.0 - 1e-12))
            .or(K::SCALE.last())
            .filter(|_| magnitude > 0.0);
        if let Some(&(unit, size, _)) = readable {
            let number = self.si / size;
            // Twelve digits hide the last bit of the division (70.00000000000001 mm); they are used
            // where nothing is lost.
            let rounded: f64 = format!("{number:.11e}").parse().unwrap_or(number);
            for number in [rounded, number] {
                let text = format!("{number} {unit}");
                if text.parse() == Ok(*self) {
                    return f.write_str(&text);
                }
            }
        }
        let base = K::BASE;
        if magnitude == 0.0 || (1e-6..1e15).contains(&magnitude) {
            write!(f, "{} {base}", self.si)
        } else {
            write!(f, "{:e} {base}", self.si)
        }
    }
}

impl<K: Kind> fmt::Debug for Quantity<K> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self}")
    }
}

impl<K: Kind> Serialize for Quantity<K> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de, K: Kind> Deserialize<'de> for Quantity<K> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Text<K>(PhantomData<K>);

        impl<K: Kind> Visitor<'_> for Text<K> {
            type Value = Quantity<K>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(&wanted::<K>())
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<Self::Value, E> {
                text.parse().map_err(E::custom)
            }

            fn visit_i64<E: de::Error>(self, number: i64) -> Result<Self::Value, E> {
                Err(E::custom(bare_number::<K>(&number)))
            }

            fn visit_f64<E: de::Error>(self, number: f64) -> Result<Self::Value, E> {
                Err(E::custom(bare_number::<K>(&number)))
            }
        }

        deserializer.deserialize_str(Text(PhantomData))
    }
}

fn bare_number<K: Kind>(number: &dyn fmt::Display) -> String {
    format!("{number} is a bare number; write {}", wanted::<K>())
}

impl<K: Kind> JsonSchema for Quantity<K> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        K::NAME.into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "type": "string",
            "pattern": r"^\s*[+-]?[0-9.]+([eE][+-]?[0-9]+)?\s*[^\s0-9]",
            "examples": [K::EXAMPLE],
        })
    }
}
