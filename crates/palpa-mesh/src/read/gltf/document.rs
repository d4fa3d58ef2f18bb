//! The part of a glTF document that holds geometry. All other fields are ignored.

use nalgebra::{Matrix4, Quaternion, UnitQuaternion, Vector3};
use serde::Deserialize;

use super::{Fault, Parsed, fault, missing};

/// Extensions that store the triangles in another form. Other extensions concern materials, lights
/// and the like, or need no more than the code here (such as `KHR_mesh_quantization` with its
/// integer positions).
const PACKED: [&str; 4] = [
    "KHR_draco_mesh_compression",
    "EXT_meshopt_compression",
    "KHR_meshopt_compression",
    "EXT_mesh_gpu_instancing",
];

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Document {
    asset: Asset,
    scene: Option<usize>,
    #[serde(default)]
    scenes: Vec<SceneNodes>,
    #[serde(default)]
    pub(super) nodes: Vec<Node>,
    #[serde(default)]
    pub(super) meshes: Vec<Mesh>,
    #[serde(default)]
    accessors: Vec<Accessor>,
    #[serde(default)]
    pub(super) buffer_views: Vec<BufferView>,
    #[serde(default)]
    pub(super) buffers: Vec<Buffer>,
    #[serde(default)]
    extensions_required: Vec<String>,
}

#[derive(Debug, Deserialize)]
struct Asset {
    version: String,
}

#[derive(Debug, Deserialize)]
struct SceneNodes {
    #[serde(default)]
    nodes: Vec<usize>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Node {
    #[serde(default)]
    pub(super) children: Vec<usize>,
    pub(super) mesh: Option<usize>,
    matrix: Option<[f64; 16]>,
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Mesh {
    #[serde(default)]
    pub(super) primitives: Vec<Primitive>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Primitive {
    #[serde(default)]
    pub(super) attributes: Attributes,
    pub(super) indices: Option<usize>,
    #[serde(default = "triangles")]
    pub(super) mode: u32,
}

/// The mode of a primitive without a given mode.
fn triangles() -> u32 {
    4
}

#[derive(Debug, Default, Deserialize)]
pub(super) struct Attributes {
    #[serde(rename = "POSITION")]
    pub(super) position: Option<usize>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub(super) buffer_view: Option<usize>,
    #[serde(default)]
    pub(super) byte_offset: usize,
    pub(super) component_type: u32,
    #[serde(default)]
    pub(super) normalized: bool,
    pub(super) count: usize,
    #[serde(rename = "type")]
    pub(super) kind: String,
    pub(super) sparse: Option<Sparse>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Sparse {
    pub(super) count: usize,
    pub(super) indices: SparseIndices,
    pub(super) values: SparseValues,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseIndices {
    pub(super) buffer_view: usize,
    #[serde(default)]
    pub(super) byte_offset: usize,
    pub(super) component_type: u32,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseValues {
    pub(super) buffer_view: usize,
    #[serde(default)]
    pub(super) byte_offset: usize,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub(super) buffer: usize,
    #[serde(default)]
    pub(super) byte_offset: usize,
    pub(super) byte_length: usize,
    pub(super) byte_stride: Option<usize>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub(super) uri: Option<String>,
    pub(super) byte_length: usize,
}

impl Document {
    /// Returns an error for other versions, and for extensions without which the triangles cannot
    /// be read.
    pub(super) fn check_supported(&self) -> Parsed<()> {
        if !self.asset.version.starts_with("2.") {
            let version = &self.asset.version;
            return Err(fault(format!(
                "glTF version {version:?} is not read; export version 2"
            )));
        }
        let is_packed = |name: &&String| PACKED.contains(&name.as_str());
        match self.extensions_required.iter().find(is_packed) {
            Some(name) => Err(fault(format!(
                "it needs the extension {name}; export without compression and instancing"
            ))),
            None => Ok(()),
        }
    }

    /// The root nodes: those of the default scene. If there are no scenes, all nodes without a
    /// parent.
    pub(super) fn roots(&self) -> Parsed<Vec<usize>> {
        if self.scenes.is_empty() {
            let mut is_child = vec![false; self.nodes.len()];
            for &child in self.nodes.iter().flat_map(|n| &n.children) {
                if let Some(is_child) = is_child.get_mut(child) {
                    *is_child = true;
                }
            }
            return Ok((0..self.nodes.len()).filter(|&n| !is_child[n]).collect());
        }
        let index = self.scene.unwrap_or(0);
        let scene = self
            .scenes
            .get(index)
            .ok_or_else(|| missing("scene", index))?;
        Ok(scene.nodes.clone())
    }

    pub(super) fn accessor(&self, index: usize) -> Result<&Accessor, Fault> {
        self.accessors
            .get(index)
            .ok_or_else(|| missing("accessor", index))
    }
}

impl Accessor {
    /// Number of values per element, for the two types used for geometry.
    pub(super) fn width(&self) -> Option<usize> {
        match self.kind.as_str() {
            "SCALAR" => Some(1),
            "VEC3" => Some(3),
            _ => None,
        }
    }
}

impl Node {
    /// The node's own transform: its matrix, or translation · rotation · scale.
    pub(super) fn parent_from_node(&self) -> Matrix4<f64> {
        if let Some(matrix) = self.matrix {
            return Matrix4::from_column_slice(&matrix);
        }
        let translation = Vector3::from(self.translation.unwrap_or([0.0; 3]));
        let [x, y, z, w] = self.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        let scale = Vector3::from(self.scale.unwrap_or([1.0; 3]));
        Matrix4::new_translation(&translation)
            * rotation.to_homogeneous()
            * Matrix4::new_nonuniform_scaling(&scale)
    }
}
