//! The scene as it is written. The doc comments are the descriptions in the JSON Schema.
//!
//! These types say which keys there are and of which kind their values are; ranges and combinations are checked where
//! they become a [`Scene`](crate::Scene).

#![expect(
    clippy::doc_markdown,
    clippy::doc_link_with_quotes,
    reason = "these comments become the descriptions of the schema, which are plain text"
)]

use std::fmt;
use std::path::PathBuf;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{self, DeserializeOwned, Deserializer, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Serialize, Serializer};

use crate::Status;
use crate::scene::{CutFaces, InPlane, LengthUnit, Solver};
use crate::units::{Density, Length, Pressure, Stiffness, Time, Velocity};

/// A scene of Palpa: the body that is pressed, its layers, the tool and the press.
///
/// Every quantity is a text with a unit, such as "1.5 mm" or "12 kPa". Paths are relative to the folder of this file.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "Palpa scene")]
pub(crate) struct SceneFile {
    /// The body: a surface mesh and its bones, or a body made by formula.
    pub(crate) body: BodyTable,
    /// The layers, from the skin inward: 1 to 32 of them, with 256 levels at most together.
    #[serde(default)]
    pub(crate) layer: Vec<LayerTable>,
    /// What presses. Default: a disc of radius 8 mm.
    #[serde(default)]
    pub(crate) tool: ToolTable,
    /// Where, how deep and how fast it presses.
    #[serde(default)]
    pub(crate) press: PressTable,
    /// Parameters of the reference method (a network of bars).
    #[serde(default)]
    pub(crate) reference: ReferenceTable,
}

/// The body. Exactly one of `surface` and `generator` is given.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct BodyTable {
    /// The skin: a triangle mesh (PLY, OBJ, STL, GLB, glTF or OFF).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) surface: Option<PathBuf>,
    /// A body made by formula instead of read from a file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) generator: Option<GeneratorTable>,
    /// The bones, triangle meshes in the same frame as the skin; 64 at most. Only with `surface`. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) bones: Vec<PathBuf>,
    /// The unit of the lengths in the files that this scene names (meshes and thickness tables). Default: "m".
    #[serde(default)]
    pub(crate) unit: LengthUnit,
    /// Keep only the part of the body within this distance of `cutout_at`, 5 mm to 1 m. Default: the whole body.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) cutout_radius: Option<Length>,
    /// The middle of the part that is kept, each coordinate within 10 m. Default: where the tool presses (`press.at`
    /// or `press.vertex`).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) cutout_at: Option<[Length; 3]>,
    /// How the faces are held at which the body was cut from the rest (the ends of a limb, the rim of a cut-out).
    /// Default: "free".
    #[serde(default)]
    pub(crate) cut_faces: CutFaces,
}

/// A body made by formula. The layers of the scene apply to it as to a surface.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct GeneratorTable {
    /// Its shape: a flat block, a cylinder round one bone, or a forearm with ulna and radius.
    pub(crate) kind: GeneratorKind,
    /// Distance of neighbouring skin vertices, 0.5 mm to 100 mm. Default: "5 mm".
    #[serde(default = "default_spacing")]
    pub(crate) spacing: Length,
    /// Block only: width, length and depth, each 1 mm to 2 m. Default: ["100 mm", "100 mm", "40 mm"].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) size: Option<[Length; 3]>,
    /// Cylinder only: its length, 1 mm to 2 m. Default: "200 mm".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) length: Option<Length>,
    /// Cylinder only: the radius of its skin, 1 mm to 1 m. Default: "40 mm".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) radius: Option<Length>,
    /// Cylinder only: the radius of its bone, 0.5 mm to 1 m and less than `radius`. Default: "10 mm".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) bone_radius: Option<Length>,
    /// Forearm only: its size relative to an average adult's, 0.2 to 3. Default: 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) scale: Option<f64>,
}

/// The shapes that are made by formula.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum GeneratorKind {
    /// A flat block on a rigid base.
    Block,
    /// A cylinder round one straight bone.
    Cylinder,
    /// A forearm with ulna and radius, from anthropometry.
    Forearm,
}

/// One layer of tissue.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct LayerTable {
    /// The name of a tissue in the catalogue, or a table with its elasticity.
    pub(crate) tissue: TissueSpec,
    /// How thick the layer is, 10 µm to 500 mm: one value, a table along an axis, or a file. Only the last layer may go
    /// without: it reaches down to the bone (or to the base of a generated body).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) thickness: Option<ThicknessSpec>,
    /// How far the thickness is to be trusted. Default: "given" (by this scene).
    #[serde(default = "default_thickness_status", skip_serializing_if = "is_given")]
    pub(crate) thickness_status: Status,
    /// Where the thickness is from, in words. Default: nothing said.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub(crate) thickness_source: String,
    /// Into how many element levels the layer is divided over its thickness, 1 to 64. Default: 1.
    #[serde(default = "default_levels")]
    pub(crate) levels: u32,
    /// How thin the layer may become where the body has no room for it, 1 µm to 100 mm and no more than the thickness.
    /// Default: a fifth of the (smallest) thickness, or "0.5 mm" when that is not known beforehand.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) min_thickness: Option<Length>,
}

/// The tissue of a layer: a name of the catalogue, or values given here.
#[derive(Debug, Serialize)]
#[serde(untagged)]
pub(crate) enum TissueSpec {
    Name(String),
    Inline(TissueTable),
}

/// A tissue by its values: either `young` (with `poisson`) or `spring`.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct TissueTable {
    /// What the tissue is called in reports. Default: "given in the scene".
    #[serde(default = "default_tissue_name")]
    pub(crate) name: String,
    /// Young's modulus, 10 Pa to 1 GPa.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) young: Option<Pressure>,
    /// Poisson's ratio, 0 to 0.4999. Default: 0.45, customary in limb indentation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) poisson: Option<f64>,
    /// The stiffness of every bar of the layer, as the reference method has it, 1 µN/m to 1 MN/m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) spring: Option<Stiffness>,
    /// Density, 100 kg/m³ to 20000 kg/m³. Default: not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) density: Option<Density>,
    /// Where the values are from, in words. Default: nothing said.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub(crate) source: String,
}

/// The thickness of a layer.
#[derive(Debug, Serialize)]
#[serde(untagged)]
pub(crate) enum ThicknessSpec {
    Uniform(Length),
    Varying(ThicknessTable),
}

/// A thickness that varies: either `axis` with `table`, or `file`.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ThicknessTable {
    /// The direction along which the table's positions are measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) axis: Option<AxisSpec>,
    /// Pairs of a position along the axis (within 10 m, ascending) and the thickness there (10 µm to 500 mm), 1000 pairs
    /// at most; linear between them, constant before the first and after the last.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) table: Option<Vec<[Length; 2]>>,
    /// A CSV file with the columns x, y, z and thickness, in the unit of the body.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) file: Option<PathBuf>,
}

/// A direction: a name of an axis or three numbers.
#[derive(Debug)]
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

/// What presses.
#[derive(Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ToolTable {
    /// Its shape. Default: "disc".
    #[serde(default)]
    pub(crate) shape: ToolShape,
    /// Disc only: its radius, 0.1 mm to 200 mm. Default: "8 mm".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) radius: Option<Length>,
}

/// The shapes of tools.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum ToolShape {
    /// A patch of skin bonded to a rigid disc.
    #[default]
    Disc,
    /// The single operated node of the reference method.
    Node,
}

/// Where, how deep and how fast the tool presses. Either `at` or `vertex` is given, or none of them.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct PressTable {
    /// The point whose nearest point of the skin is pressed, each coordinate within 10 m. Default: the skin vertex
    /// nearest to the skin's centroid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) at: Option<[Length; 3]>,
    /// The skin vertex that is pressed, by its number in the skin surface, from 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) vertex: Option<u32>,
    /// The direction in which the tool moves; its length does not matter. Default: the inward normal of the skin.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) direction: Option<[f64; 3]>,
    /// How deep the tool goes, 1 µm to 500 mm. Default: "8 mm".
    pub(crate) depth: Length,
    /// How fast the tool goes down and up, 0.01 mm/s to 1 m/s. Default: "10 mm/s".
    pub(crate) speed: Velocity,
    /// How long the tool rests at its depth, 0 s to 600 s. Default: "0.5 s".
    pub(crate) hold: Time,
    /// Whether the tool comes back up. Default: true.
    pub(crate) retract: bool,
    /// By how much the depth grows from one result to the next: no more than the depth and no less than a 5000th of it.
    /// Default: a 32nd of the depth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) step: Option<Length>,
}

impl Default for PressTable {
    fn default() -> Self {
        Self {
            at: None,
            vertex: None,
            direction: None,
            depth: Length::from_si(8e-3),
            speed: Velocity::from_si(10e-3),
            hold: Time::from_si(0.5),
            retract: true,
            step: None,
        }
    }
}

/// Parameters of the reference method.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct ReferenceTable {
    /// Into how many equal parts each step of the tool is divided, 1 to 1024. Default: 4.
    pub(crate) substeps: u32,
    /// How a sub-step is solved. Default: "sparse".
    pub(crate) solver: Solver,
    /// Whose stiffness the bars in a level between two layers have. Default: "below".
    pub(crate) in_plane: InPlane,
    /// The share of a spring's change of length that the restoring correction (3.21) takes back after each step, 0 to
    /// 1; 0 switches it off. It acts once per step, so with it the force depends on the step: at 4 mm on a real forearm
    /// 0.56 N in steps of 1 mm and 0.48 N in steps of 0.1 mm, without it 0.55 N in both. Default: 0.
    pub(crate) spring_gain: f64,
    /// The share of the way to its place at rest by which the restoring correction (3.22) moves a node after each step, 0
    /// to 1; 0 switches it off. Any other makes a held body creep back under the tool. Default: 0.
    pub(crate) shape_gain: f64,
}

impl Default for ReferenceTable {
    fn default() -> Self {
        Self {
            substeps: 4,
            solver: Solver::default(),
            in_plane: InPlane::default(),
            spring_gain: 0.0,
            shape_gain: 0.0,
        }
    }
}

fn default_spacing() -> Length {
    Length::from_si(5e-3)
}

fn default_levels() -> u32 {
    1
}

fn default_thickness_status() -> Status {
    Status::Given
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde hands over a reference"
)]
fn is_given(status: &Status) -> bool {
    *status == Status::Given
}

fn default_tissue_name() -> String {
    "given in the scene".to_owned()
}

/// A value that is written as a text or as a table.
///
/// serde's untagged enums would do the same, but lose the place and the reason of an error inside the table.
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
        Self::Inline(table)
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
