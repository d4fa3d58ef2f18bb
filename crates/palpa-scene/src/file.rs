//! The scene file. The doc comments become the descriptions in the JSON Schema.
//!
//! These types define the keys and the kinds of their values. Ranges and combinations are checked
//! when they become a [`Scene`](crate::Scene).

#![expect(
    clippy::doc_markdown,
    reason = "these comments become the descriptions of the schema, which are plain text"
)]

mod either;
mod motion;
mod tissue_table;
mod tool;

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub(crate) use self::either::{AxisName, AxisSpec, ThicknessSpec, TissueSpec};
pub(crate) use self::motion::{DeviceTable, MotionTable};
pub(crate) use self::tissue_table::{OgdenTable, PronyTable, PronyTermTable, TissueTable};
pub(crate) use self::tool::{LumpShapeName, LumpTable, ToolTable};
use crate::Status;
use crate::model::ModelKind;
use crate::scene::{CutFaces, InPlane, LengthUnit, Solver};
use crate::units::{Kind, Length, Pressure, Quantity, Rate, Share, Time, Velocity};

/// A scene of Palpa: the body, its layers, the tool and the press.
///
/// Every quantity is a text with a unit, such as "1.5 mm" or "12 kPa". Paths are relative to the
/// folder of this file.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "Palpa scene")]
pub(crate) struct SceneFile {
    /// The body: a surface mesh and its bones, or a body made by formula.
    pub(crate) body: BodyTable,
    /// The layers, from the skin inward: 1 to 32 of them, with 256 levels at most together.
    #[serde(default)]
    pub(crate) layer: Vec<LayerTable>,
    /// Lumps in the layers, 64 at most. Where two overlap, the later one counts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) lump: Vec<LumpTable>,
    /// The tool. Default: a disc of radius 8 mm, bonded to the skin.
    #[serde(default)]
    pub(crate) tool: ToolTable,
    /// Place, depth and speed of the press.
    #[serde(default)]
    pub(crate) press: PressTable,
    /// The haptic device used in real time, and the grip of the hand on it.
    #[serde(default)]
    pub(crate) device: DeviceTable,
    /// The motion of the simulated hand in real time.
    #[serde(default)]
    pub(crate) motion: MotionTable,
    /// The model of the body.
    #[serde(default)]
    pub(crate) model: ModelTable,
    /// Mesh size of the body near the tool and lumps.
    #[serde(default)]
    pub(crate) mesh: MeshTable,
    /// Parameters of the reference method (a network of bars).
    #[serde(default)]
    pub(crate) reference: ReferenceTable,
}

/// The body. Give exactly one of `surface` and `generator`.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct BodyTable {
    /// The skin: a triangle mesh (PLY, OBJ, STL, GLB, glTF or OFF).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) surface: Option<PathBuf>,
    /// A body made by formula, instead of one from a file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) generator: Option<GeneratorTable>,
    /// The bones: triangle meshes in the same frame as the skin; 64 at most. Only with `surface`.
    /// Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) bones: Vec<PathBuf>,
    /// The unit of the lengths in the files that this scene names (meshes and thickness tables).
    /// Default: "m".
    #[serde(default)]
    pub(crate) unit: LengthUnit,
    /// Keep only the part of the body within this distance of `cutout_at`, 5 mm to 1 m. Default:
    /// the whole body.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) cutout_radius: Option<Length>,
    /// Centre of the part that is kept, each coordinate within 10 m. Default: where the tool
    /// presses (`press.at` or `press.vertex`).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) cutout_at: Option<[Length; 3]>,
    /// Support of the cut faces, where the body was cut from the rest (the ends of a limb, the rim
    /// of a cut-out). Default: "free".
    #[serde(default)]
    pub(crate) cut_faces: CutFaces,
}

/// A body made by formula. The layers of the scene apply to it as to a surface from a file.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct GeneratorTable {
    /// Shape of the body: a flat block, a cylinder around one bone, or a forearm with ulna and
    /// radius.
    pub(crate) kind: GeneratorKind,
    /// Distance between neighbouring skin vertices, 0.5 mm to 100 mm. Default: "5 mm".
    #[serde(default = "default_spacing")]
    pub(crate) spacing: Length,
    /// Block only: width, length and depth, each 1 mm to 2 m. Default: ["100 mm", "100 mm", "40
    /// mm"].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) size: Option<[Length; 3]>,
    /// Cylinder only: the length, 1 mm to 2 m. Default: "200 mm".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) length: Option<Length>,
    /// Cylinder only: the radius of the skin, 1 mm to 1 m. Default: "40 mm".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) radius: Option<Length>,
    /// Cylinder only: the radius of the bone, 0.5 mm to 1 m and less than `radius`. Default: "10
    /// mm".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) bone_radius: Option<Length>,
    /// Forearm only: the size relative to an average adult's, 0.2 to 3. Default: 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) scale: Option<f64>,
}

/// The bodies that can be made by formula.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum GeneratorKind {
    /// A flat block on a rigid base.
    Block,
    /// A cylinder around one straight bone.
    Cylinder,
    /// A forearm with ulna and radius, from anthropometry.
    Forearm,
}

/// One layer of tissue.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct LayerTable {
    /// Name of a tissue in the catalogue, or a table with its values.
    pub(crate) tissue: TissueSpec,
    /// Thickness of the layer, 10 µm to 500 mm: one value, a table along an axis, or a file. Only
    /// the last layer may have none: it then reaches down to the bone (or to the base of a
    /// generated body).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) thickness: Option<ThicknessSpec>,
    /// How reliable the thickness is. Default: "given" (by this scene).
    #[serde(default = "default_thickness_status", skip_serializing_if = "is_given")]
    pub(crate) thickness_status: Status,
    /// Source of the thickness, in words. Default: nothing said.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub(crate) thickness_source: String,
    /// Number of element levels through the thickness of the layer, 1 to 64. Default: 1.
    #[serde(default = "default_levels")]
    pub(crate) levels: u32,
    /// Least thickness of the layer where the body has no room for more, 1 µm to 100 mm and no more
    /// than the thickness. Default: a fifth of the (smallest) thickness, or "0.5 mm" when that is
    /// not known beforehand.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) min_thickness: Option<Length>,
    /// Tension in every direction of the layer's plane before anything presses, 0 Pa to 1 MPa. Skin
    /// on a living forearm has 28-92 kPa or 6.2-11.4 N/m (Flynn et al., abstracts). Default: "0
    /// Pa".
    #[serde(default, skip_serializing_if = "is_none")]
    pub(crate) prestress: Pressure,
}

/// A thickness that varies: either `axis` with `table`, or `file`.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ThicknessTable {
    /// The direction along which the table's positions are measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) axis: Option<AxisSpec>,
    /// Pairs of a position along the axis (within 10 m, ascending) and the thickness there (10 µm
    /// to 500 mm), 1000 pairs at most. Linear between them, constant before the first and after the
    /// last.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) table: Option<Vec<[Length; 2]>>,
    /// A CSV file with the columns x, y, z and thickness, in the unit of the body.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) file: Option<PathBuf>,
}

/// Place, depth and speed of the press. Give `at` or `vertex`, or neither.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct PressTable {
    /// The tool presses the point of the skin nearest to this point, each coordinate within 10 m.
    /// Default: the skin vertex nearest to the skin's centroid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) at: Option<[Length; 3]>,
    /// Number of the skin vertex that the tool presses, as counted in the skin surface, from 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) vertex: Option<u32>,
    /// Direction of the tool's movement; its length does not matter. Default: the inward normal of
    /// the skin.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) direction: Option<[f64; 3]>,
    /// Depth of the press, 1 µm to 500 mm. Default: "8 mm".
    pub(crate) depth: Length,
    /// Speed of the tool down and up, 0.01 mm/s to 1 m/s. Default: "10 mm/s".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) speed: Option<Velocity>,
    /// Speeds to compare, instead of `speed`: the whole press is run at each; 16 at most, each 0.01
    /// mm/s to 1 m/s. Default: none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) speeds: Vec<Velocity>,
    /// Time that the tool rests at its depth, 0 s to 600 s. Default: "0.5 s".
    pub(crate) hold: Time,
    /// Whether the tool comes back up. Default: true.
    pub(crate) retract: bool,
    /// Number of cycles of going down, resting and coming back, 1 to 100; more than one only with
    /// `retract`. Default: 1.
    pub(crate) cycles: u32,
    /// Increase of the depth from one result to the next: no more than the depth and no less than a
    /// 5000th of it. Default: a 16th of the depth.
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
            speed: None,
            speeds: Vec::new(),
            hold: Time::from_si(0.5),
            retract: true,
            cycles: 1,
            step: None,
        }
    }
}

/// The model of the body.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct ModelTable {
    /// Kind of model. Default: "tissue".
    pub(crate) kind: ModelKind,
    /// Share of the strain that two paired prisms average, 0 to 0.95. A larger share is softer and
    /// more accurate on a coarse mesh, but a node that is pressed alone can then move against its
    /// neighbours. Default: 0.8; in real time, where triangles are wide, 0.65.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) alpha: Option<f64>,
    /// Whether inertia and damping are included. Default: "quasi-static".
    pub(crate) dynamics: DynamicsName,
    /// Damping in addition to relaxation; only with dynamics = "implicit". Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) damping: Option<DampingTable>,
    /// Tolerance of the force balance: the largest unbalanced force at a free node, relative to the
    /// forces in the body, 0.000000000001 to 0.001. The force on the tool is usually closer than that.
    /// Default: 0.00001.
    pub(crate) tolerance: f64,
}

impl Default for ModelTable {
    fn default() -> Self {
        Self {
            kind: ModelKind::default(),
            alpha: None,
            dynamics: DynamicsName::default(),
            damping: None,
            tolerance: 1e-5,
        }
    }
}

/// Whether inertia and damping are included.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum DynamicsName {
    /// Equilibrium at every moment; time matters only through relaxation.
    #[default]
    QuasiStatic,
    /// Inertia and damping, with implicit time steps. Tissues of unknown density count as 1000
    /// kg/m³.
    Implicit,
}

/// Rayleigh damping: the damping matrix is `mass` times the mass matrix and `stiffness` times the
/// stiffness matrix.
#[derive(Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct DampingTable {
    /// Factor of the mass matrix, 0 1/s to 100000 1/s: damps slow motion. Default: "0 1/s".
    #[serde(default)]
    pub(crate) mass: Rate,
    /// Factor of the stiffness matrix, 0 s to 10 s: damps fast motion. Default: "0 s".
    #[serde(default)]
    pub(crate) stiffness: Time,
}

/// Mesh size near the tool and lumps.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct MeshTable {
    /// Whether the mesh is refined near the tool and lumps; if false, it stays as it was grown.
    /// Default: true.
    pub(crate) refine: bool,
    /// Whether triangles of the skin that are smaller than wanted are merged before the body is
    /// grown, within a stated distance from the given skin. Default: true in real time if the skin
    /// comes from a file and `refine` is true; else false.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) coarsen: Option<bool>,
    /// Wanted length of edges and height of levels under the tool (at the rim of a disc), 0.1 mm to
    /// 100 mm. Default: a quarter of the contact radius (0.3 times it under a box, 0.45 times in
    /// real time), at most 0.8 times the edge radius, limited to 0.5 mm to 10 mm. A node has no default.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) near_tool: Option<Length>,
    /// Wanted length of edges and height of levels in and around lumps, 0.1 mm to 100 mm. Default:
    /// half of a lump's smallest radius, 0.5 mm to 10 mm; as near the tool for a mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) near_lumps: Option<Length>,
    /// Increase of the wanted length of edges with the distance from the tool or lump, as a share of
    /// that distance, 0.02 to 5. Default: 0.5; 1.2 in real time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) growth: Option<f64>,
    /// Increase of the wanted height of levels with the depth below the skin or the distance from a
    /// lump, as a share of it, 0.02 to 5. Default: that of `growth`; 0.5 in real time if `growth` is
    /// not given either.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) level_growth: Option<f64>,
    /// Largest number of skin vertices after refinement, 100 to 500000. At this limit refinement
    /// stops. Default: 20000.
    pub(crate) max_vertices: u32,
    /// Error bar that `palpa press` may leave: half its width at the deepest, as a share of the
    /// force there, 0.2 % to 50 %. Sizes near the tool are then chosen by measured errors, so
    /// `near_tool` cannot be given too. Default: sizes as given here. In real time nothing is measured
    /// before: default sizes are those for 3 %, times (accuracy / 3 %) to the power 2/3; near the tool they
    /// are only 4 % smaller for 2 %, since steps on finer meshes come late.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) accuracy: Option<Share>,
    /// Longest time for the choice of a mesh by `accuracy`, 1 s to 86400 s. Default: no limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) max_time: Option<Time>,
    /// Whether the fine part near the tool moves with it in real time, so that the hand may go
    /// anywhere. If false, the body is fine along the whole way of the scene's motion. Default:
    /// false.
    pub(crate) moves: bool,
}

impl Default for MeshTable {
    fn default() -> Self {
        Self {
            refine: true,
            coarsen: None,
            near_tool: None,
            near_lumps: None,
            growth: None,
            level_growth: None,
            max_vertices: 20_000,
            accuracy: None,
            max_time: None,
            moves: false,
        }
    }
}

/// Parameters of the reference method.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct ReferenceTable {
    /// Number of equal parts into which each step of the tool is divided, 1 to 1024. Default: 4.
    pub(crate) substeps: u32,
    /// Solver of a sub-step. Default: "sparse".
    pub(crate) solver: Solver,
    /// Layer whose stiffness the bars in the level between two layers have. Default: "below".
    pub(crate) in_plane: InPlane,
    /// Share of a spring's change of length that the restoring correction (3.21) takes back after
    /// each step, 0 to 1; 0 switches it off. It acts once per step, so with it the force depends on
    /// the step size: at 4 mm on a real forearm 0.56 N in steps of 1 mm and 0.48 N in steps of 0.1
    /// mm, without it 0.55 N in both. Default: 0.
    pub(crate) spring_gain: f64,
    /// Share of the way back to its place at rest by which the restoring correction (3.22) moves a
    /// node after each step, 0 to 1; 0 switches it off. With any other value a held body creeps
    /// back under the tool. Default: 0.
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

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde hands over a reference"
)]
fn is_none<K: Kind>(quantity: &Quantity<K>) -> bool {
    quantity.si() == 0.0
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
