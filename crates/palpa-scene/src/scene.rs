//! The scene for the rest of the program: plain data in SI units, complete.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::built_in::{BuiltIn, PRESSED};
use crate::{
    Device, Lump, LumpShape, MaterialStatus, Mesh, Model, Motion, SceneError, Status, Thickness,
    Tissue, Tool, resolve,
    write::{self, Names},
};

/// The body, its layers, and the way it is pressed. Lengths in metres, everything in SI units.
///
/// A scene from [`Scene::parse`] or [`Scene::load`] respects all ranges of the scene file. The
/// fields are public, so a program can set its own values; [`Press::check`] checks those of a
/// press.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// The folder that the paths of the scene are relative to. All paths in here include it
    /// already.
    pub base_dir: PathBuf,
    /// The body.
    pub body: Body,
    /// The layers, from the skin inward, at least one.
    pub layers: Vec<Layer>,
    /// The lumps in the layers. Where two overlap, the later one counts.
    pub lumps: Vec<Lump>,
    /// The tool.
    pub tool: Tool,
    /// Place, depth and speed of the press.
    pub press: Press,
    /// The device used in real time.
    pub device: Device,
    /// The motion of the hand that holds the device.
    pub motion: Motion,
    /// The model of the body.
    pub model: Model,
    /// Mesh size near the tool and lumps.
    pub mesh: Mesh,
    /// Parameters of the reference method.
    pub reference: Reference,
}

/// The body before it is divided into layers.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Source of its skin.
    pub skin: Skin,
    /// Files of its bones; empty with a generator, which makes its own.
    pub bones: Vec<PathBuf>,
    /// Unit of the lengths in the scene's files.
    pub unit: LengthUnit,
    /// The part that is kept; `None` for the whole body.
    pub cutout: Option<Cutout>,
    /// Support of the cut faces.
    pub cut_faces: CutFaces,
}

/// Source of the skin.
#[derive(Debug, Clone, PartialEq)]
pub enum Skin {
    /// A triangle mesh in a file.
    File(PathBuf),
    /// A body made by formula.
    Generated(Generator),
}

/// A body made by formula. All lengths in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Generator {
    /// A flat block on a rigid base.
    Block {
        /// Width, length and depth.
        size: [f64; 3],
        /// Distance between neighbouring skin vertices.
        spacing: f64,
    },
    /// A cylinder around one straight bone.
    Cylinder {
        /// Its length.
        length: f64,
        /// Radius of its skin.
        radius: f64,
        /// Radius of its bone, less than `radius`.
        bone_radius: f64,
        /// Distance between neighbouring skin vertices.
        spacing: f64,
    },
    /// A forearm with ulna and radius.
    Forearm {
        /// Distance between neighbouring skin vertices.
        spacing: f64,
        /// Size relative to an average adult's.
        scale: f64,
    },
}

/// The part of a large body that is kept.
#[derive(Debug, Clone, PartialEq)]
pub struct Cutout {
    /// The body is kept within this distance of `at`, in metres.
    pub radius: f64,
    /// Centre of the part; never [`Target::Middle`].
    pub at: Target,
}

/// A place on the skin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Target {
    /// The skin vertex nearest to the centroid of the skin's area.
    Middle,
    /// The point of the skin nearest to this one, in metres.
    Point([f64; 3]),
    /// The skin vertex with this number, as counted in the skin surface.
    Vertex(u32),
}

/// Unit of the lengths in a file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LengthUnit {
    /// Metre.
    #[default]
    M,
    /// Centimetre.
    Cm,
    /// Millimetre.
    Mm,
    /// Inch of 25.4 mm.
    In,
}

impl LengthUnit {
    /// The unit's length in metres.
    pub fn metres(self) -> f64 {
        match self {
            Self::M => 1.0,
            Self::Cm => 1e-2,
            Self::Mm => 1e-3,
            Self::In => 25.4e-3,
        }
    }
}

/// Support of the cut faces.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CutFaces {
    /// The faces are free.
    #[default]
    Free,
    /// Every node is fixed.
    Fixed,
    /// Nodes move only in the plane of the face.
    Symmetric,
}

/// A layer of tissue.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Its tissue.
    pub tissue: Tissue,
    /// Its thickness; `None` only in the last layer, which then reaches to the bone or base.
    pub thickness: Option<Thickness>,
    /// How reliable the thickness is.
    pub thickness_status: Status,
    /// Source of the thickness; may be empty.
    pub thickness_source: String,
    /// Number of element levels (prism intervals) through its thickness, at least 1.
    pub levels: usize,
    /// Least thickness where there is no room for more, in metres; no more than the thickness.
    pub min_thickness: f64,
    /// Tension in every direction of the layer's plane before anything presses, in pascals.
    pub prestress: f64,
}

/// Place, depth and speed of a press.
#[derive(Debug, Clone, PartialEq)]
pub struct Press {
    /// The place on the skin.
    pub target: Target,
    /// Unit vector along which the tool moves; `None` is the inward normal of the skin.
    pub direction: Option<[f64; 3]>,
    /// Depth in metres.
    pub depth: f64,
    /// Speed down and up, in m/s.
    pub speed: f64,
    /// Speeds of a sweep, in m/s: the whole press is run at each, and `speed` is the first. Empty
    /// without a sweep.
    pub speeds: Vec<f64>,
    /// Rest at the depth, in seconds.
    pub hold: f64,
    /// Whether the tool comes back up.
    pub retract: bool,
    /// Number of cycles, at least 1; more than one only with `retract`.
    pub cycles: u32,
    /// Increase of the depth from one result to the next, in metres; no more than `depth`.
    pub step: f64,
}

/// Parameters of the reference method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reference {
    /// Number of parts into which each step is divided, at least 1.
    pub substeps: u32,
    /// Solver of a sub-step.
    pub solver: Solver,
    /// Layer whose stiffness the bars in the level between two layers have.
    pub in_plane: InPlane,
    /// Share of a spring's change of length that correction (3.21) takes back, 0 (off) to 1.
    pub spring_gain: f64,
    /// Share of the way back to its place at rest by which correction (3.22) moves a node, 0 (off)
    /// to 1.
    pub shape_gain: f64,
}

/// The solvers of a sub-step of the reference method.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Solver {
    /// Finite elements, sparse Cholesky factorisation.
    #[default]
    Sparse,
    /// Finite elements, dense inverse by Gauss–Jordan elimination, as in 2009.
    DenseInverse,
    /// Explicit Euler alone.
    Euler,
}

/// Stiffness of the bars in the level between two layers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum InPlane {
    /// The stiffness of the layer above the level.
    Above,
    /// The stiffness of the layer below the level.
    #[default]
    Below,
    /// The mean of both.
    Mean,
}

impl Scene {
    /// Reads and checks a scene file; its paths are relative to the file's folder.
    ///
    /// # Errors
    /// When the file cannot be read or is not a valid scene; see [`SceneError`].
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        resolve::load(path)
    }

    /// Checks a scene given as text; its paths are relative to `base_dir`. Reads no file.
    ///
    /// # Errors
    /// When the text is not a valid scene; see [`SceneError`].
    pub fn parse(text: &str, base_dir: &Path) -> Result<Self, SceneError> {
        resolve::parse(text, base_dir, None)
    }

    /// The built-in scene [`PRESSED`](crate::built_in::PRESSED): a forearm of skin, fat and muscle,
    /// pressed with a ball on its dorsal side.
    ///
    /// # Panics
    /// Never: the file is valid, which a test checks.
    pub fn embedded() -> Self {
        (BuiltIn::find(PRESSED).and_then(|built_in| built_in.scene().ok()))
            .expect("the built-in scene is valid")
    }

    /// The scene as a scene file, with every default written out and paths relative to `base_dir`.
    ///
    /// Parsing it again gives an equal scene.
    pub fn to_toml(&self) -> String {
        write::to_toml(self, Names::OfCatalogue)
    }

    /// As [`Self::to_toml`], but with all values of the catalogue's tissues written out, so that
    /// they can be edited.
    pub fn to_toml_in_full(&self) -> String {
        write::to_toml(self, Names::None)
    }

    /// All files that the scene refers to, with the folder of the scene: the skin, bones, thicknesses
    /// and lumps, in this order. A file that is used twice is listed twice.
    pub fn files(&self) -> Vec<&Path> {
        let mut files = Vec::new();
        if let Skin::File(path) = &self.body.skin {
            files.push(path.as_path());
        }
        files.extend(self.body.bones.iter().map(PathBuf::as_path));
        for layer in &self.layers {
            if let Some(Thickness::File(path)) = &layer.thickness {
                files.push(path);
            }
        }
        for lump in &self.lumps {
            if let LumpShape::Mesh(path) = &lump.shape {
                files.push(path);
            }
        }
        files
    }

    /// The same scene with its files elsewhere: `place` gives the new path of each of
    /// [`Self::files`], and paths are written relative to `base_dir`.
    #[must_use]
    pub fn with_files_at(&self, base_dir: &Path, mut place: impl FnMut(&Path) -> PathBuf) -> Self {
        let mut scene = self.clone();
        base_dir.clone_into(&mut scene.base_dir);
        if let Skin::File(path) = &mut scene.body.skin {
            *path = place(path);
        }
        for path in &mut scene.body.bones {
            *path = place(path);
        }
        for layer in &mut scene.layers {
            if let Some(Thickness::File(path)) = &mut layer.thickness {
                *path = place(path);
            }
        }
        for lump in &mut scene.lumps {
            if let LumpShape::Mesh(path) = &mut lump.shape {
                *path = place(path);
            }
        }
        scene
    }

    /// Number of prisms under each skin triangle: one less than the nodes in a column.
    pub fn n_intervals(&self) -> usize {
        self.layers.iter().map(|layer| layer.levels).sum()
    }

    /// Material of each layer, and how reliable its data is. `[n_layers]`
    pub fn material_status(&self) -> Vec<MaterialStatus> {
        self.layers.iter().map(Layer::material_status).collect()
    }

    /// Material of each lump, and how reliable its data is. `[n_lumps]`
    pub fn lump_status(&self) -> Vec<MaterialStatus> {
        self.lumps.iter().map(Lump::material_status).collect()
    }
}

impl Press {
    /// Checks the numbers against the ranges of the scene file, for a program that has set its own
    /// values.
    ///
    /// # Errors
    /// The value that is out of range, and the range.
    pub fn check(&self) -> Result<(), String> {
        use crate::limits::{CYCLES, DEPTH, HOLD, SPEED};
        use crate::units::{Length, Time, Velocity};
        let [depth, step] = [self.depth, self.step].map(Length::from_si);
        let hold = Time::from_si(self.hold);
        if !DEPTH.contains(&depth) {
            return Err(format!(
                "a depth of {depth} is outside the allowed range {DEPTH}"
            ));
        }
        let mut speeds = self.speeds.iter().chain([&self.speed]).copied();
        if let Some(speed) = speeds.find(|&speed| !SPEED.contains(&Velocity::from_si(speed))) {
            let speed = Velocity::from_si(speed);
            return Err(format!(
                "a speed of {speed} is outside the allowed range {SPEED}"
            ));
        }
        if !HOLD.contains(&hold) {
            return Err(format!(
                "a hold of {hold} is outside the allowed range {HOLD}"
            ));
        }
        if !CYCLES.contains(&self.cycles) {
            let cycles = self.cycles;
            return Err(format!(
                "{cycles} cycles are outside the allowed range {CYCLES}"
            ));
        }
        if self.cycles > 1 && !self.retract {
            return Err("cycles need the way back; let the tool come back up".to_owned());
        }
        let least = self.depth / crate::limits::MAX_STEPS;
        if !(least..=self.depth).contains(&self.step) {
            return Err(format!(
                "a step of {step} does not fit a depth of {depth}; give {} to {depth}",
                Length::from_si(least)
            ));
        }
        Ok(())
    }
}

/// The embedded scene.
impl Default for Scene {
    fn default() -> Self {
        Self::embedded()
    }
}
