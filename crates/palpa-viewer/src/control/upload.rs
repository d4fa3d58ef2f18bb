//! A user's own files: what is sent about them before a body is grown.

use palpa_scene::LengthUnit;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Note, Vec3};

/// Limits on a user's files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct UploadLimits {
    /// Largest file, bytes.
    pub bytes: u64,
    /// Largest number of triangles of a surface.
    pub triangles: u32,
    /// Largest number of files that a scene can have.
    pub files: u32,
}

/// The limits that the server and the session keep.
pub const UPLOAD_LIMITS: UploadLimits = UploadLimits {
    bytes: 64 << 20,
    triangles: 500_000,
    files: 66,
};

/// A file that was uploaded. It is kept until the session ends or newer files take its place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Uploaded {
    /// Number of the file, for requests.
    pub id: u32,
    /// Its name.
    pub name: String,
    /// Its content.
    pub content: UploadedContent,
}

/// The content of a file that was uploaded.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum UploadedContent {
    /// A surface.
    Surface(Box<SurfaceInfo>),
    /// A scene with its files, from a ZIP.
    Scene {
        /// Names of the files that the scene refers to.
        files: Vec<String>,
    },
    /// Another file that a scene may refer to, such as a table of thicknesses.
    Other,
}

/// A surface and the findings of its check.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SurfaceInfo {
    /// Format of the content, such as "STL".
    pub format: String,
    /// Number of vertices, after those at the same place are merged.
    pub n_vertices: u32,
    /// Number of triangles.
    pub n_triangles: u32,
    /// Number of parts that are not connected.
    pub n_parts: u32,
    /// Whether the largest part is closed.
    pub is_closed: bool,
    /// The unit of the coordinates that this check assumes.
    pub unit: LengthUnit,
    /// The unit that is probable for a body of this size.
    pub probable_unit: LengthUnit,
    /// Size along x, y and z in the unit of the file.
    pub size: Vec3,
    /// Middle of the bounding box in the unit of the file. The mesh for the picture is moved by it.
    pub middle: Vec3,
    /// Whether the surface can be used.
    pub verdict: SurfaceVerdict,
    /// The reader's remarks.
    pub notes: Vec<Note>,
    /// The findings, the most severe first.
    pub findings: Vec<FindingInfo>,
    /// Layers of each template for a body of this size.
    pub templates: Vec<TemplateInfo>,
}

/// Whether a surface can be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SurfaceVerdict {
    /// It can be used as it is.
    Good,
    /// It can be used after a repair, which happens by itself.
    Repairable,
    /// It has defects that no safe repair removes. It may not grow.
    Bad,
}

/// One kind of finding in a surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FindingInfo {
    /// Kind of finding. Pages have a text for each kind in each of their languages.
    pub kind: String,
    /// How severe it is.
    pub severity: FindingSeverity,
    /// How often it occurs.
    pub count: u32,
    /// Whether counting stopped at `count`.
    pub is_at_least: bool,
    /// The first places where it occurs, m, in the frame of the file.
    pub places: Vec<Vec3>,
    /// The finding in English.
    pub text: String,
    /// Advice in English.
    pub advice: String,
}

/// How severe a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FindingSeverity {
    /// Worth knowing.
    Note,
    /// A defect that a repair removes.
    Repairable,
    /// A defect that has no safe repair.
    Unrepairable,
}

/// Layers for a body of one's own.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Template {
    /// Skin, fat and muscle, as of the forearm of the gallery.
    #[default]
    Limb,
    /// Thin skin and little fat over muscle, as of a hand or a face.
    Thin,
    /// Skin, much fat and muscle, as of a belly or a thigh.
    Fat,
    /// One layer of soft silicone, as of a phantom.
    Phantom,
}

/// The layers of a template.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TemplateInfo {
    /// The template.
    pub template: Template,
    /// The layers, from the skin down. With bones, the last one reaches down to them.
    pub layers: Vec<TemplateLayer>,
}

/// A layer of a template.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TemplateLayer {
    /// Name of its tissue.
    pub tissue: String,
    /// Its thickness in a body without bones, m.
    pub thickness: f64,
}
