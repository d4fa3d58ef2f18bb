//! The scene as the rest of the program sees it: plain data, SI, complete.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    Device, Lump, MaterialStatus, Mesh, Model, Motion, SceneError, Status, Thickness, Tissue, Tool,
    resolve,
    write::{self, Names},
};

/// The forearm that is pressed when no scene is named.
const EMBEDDED: &str = include_str!("../scenes/forearm.toml");

/// What is pressed, of which layers it is made, and how it is pressed. Lengths in metres, everything in SI.
///
/// A scene that [`Scene::parse`] or [`Scene::load`] returns keeps all the ranges of the scene file. Its fields are open
/// so that a program can set its own; it then answers for their ranges.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// The folder that the paths of the scene are relative to; it is already part of every path in here.
    pub base_dir: PathBuf,
    /// The body.
    pub body: Body,
    /// The layers, from the skin inward, at least one.
    pub layers: Vec<Layer>,
    /// The lumps in them; where two overlap, the later one counts.
    pub lumps: Vec<Lump>,
    /// What presses.
    pub tool: Tool,
    /// Where, how deep and how fast it presses.
    pub press: Press,
    /// What presses it in real time.
    pub device: Device,
    /// How the hand moves that holds the device.
    pub motion: Motion,
    /// How the body answers.
    pub model: Model,
    /// How fine the body is made where it matters.
    pub mesh: Mesh,
    /// Parameters of the reference method.
    pub reference: Reference,
}

/// The body before it is divided into layers.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Where its skin comes from.
    pub skin: Skin,
    /// Files of its bones; empty with a generator, which brings its own.
    pub bones: Vec<PathBuf>,
    /// Unit of the lengths in the files of the scene.
    pub unit: LengthUnit,
    /// The part that is kept, if not all.
    pub cutout: Option<Cutout>,
    /// How the cut faces are held.
    pub cut_faces: CutFaces,
}

/// Where the skin comes from.
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
        /// Distance of neighbouring skin vertices.
        spacing: f64,
    },
    /// A cylinder round one straight bone.
    Cylinder {
        /// Its length.
        length: f64,
        /// Radius of its skin.
        radius: f64,
        /// Radius of its bone, below `radius`.
        bone_radius: f64,
        /// Distance of neighbouring skin vertices.
        spacing: f64,
    },
    /// A forearm with ulna and radius.
    Forearm {
        /// Distance of neighbouring skin vertices.
        spacing: f64,
        /// Size relative to an average adult's.
        scale: f64,
    },
}

/// The part of a large body that is kept.
#[derive(Debug, Clone, PartialEq)]
pub struct Cutout {
    /// Distance from the middle up to which the body is kept, in metres.
    pub radius: f64,
    /// The middle of the part; never [`Target::Middle`].
    pub at: Target,
}

/// A place on the skin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Target {
    /// The skin vertex nearest to the centroid of the skin's area.
    Middle,
    /// The point of the skin nearest to this one, in metres.
    Point([f64; 3]),
    /// The skin vertex of this number, as counted in the skin surface.
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

/// How the cut faces are held.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CutFaces {
    /// Not at all.
    #[default]
    Free,
    /// Every node at its place.
    Fixed,
    /// Nodes move in the plane of the face only.
    Symmetric,
}

/// A layer of tissue.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Its tissue.
    pub tissue: Tissue,
    /// Its thickness; `None` only in the last layer, which then reaches to the bone or base.
    pub thickness: Option<Thickness>,
    /// How far the thickness is to be trusted.
    pub thickness_status: Status,
    /// Where the thickness is from; may be empty.
    pub thickness_source: String,
    /// Number of element levels (prism intervals) over its thickness, at least 1.
    pub levels: usize,
    /// How thin it may become where there is no room, in metres; no more than its thickness.
    pub min_thickness: f64,
    /// Tension in every direction of its plane before anything presses, in pascals.
    pub prestress: f64,
}

/// Where, how deep and how fast the tool presses.
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
    /// Speeds of a sweep, in m/s: the whole press is run at each. Empty without a sweep; else `speed` is the first.
    pub speeds: Vec<f64>,
    /// Rest at the depth, in seconds.
    pub hold: f64,
    /// Whether the tool comes back up.
    pub retract: bool,
    /// How often it goes down and comes back, at least 1; more than once only with `retract`.
    pub cycles: u32,
    /// Growth of the depth from one result to the next, in metres; no more than `depth`.
    pub step: f64,
}

/// Parameters of the reference method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reference {
    /// Parts into which each step is divided, at least 1.
    pub substeps: u32,
    /// How a sub-step is solved.
    pub solver: Solver,
    /// Material of the bars in a level between two layers.
    pub in_plane: InPlane,
    /// Share of a spring's change of length that correction (3.21) takes back, 0 (off) to 1.
    pub spring_gain: f64,
    /// Share of the way to its place at rest by which correction (3.22) moves a node, 0 (off) to 1.
    pub shape_gain: f64,
}

/// How a sub-step of the reference method is solved.
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

/// Material of the bars in a level between two layers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum InPlane {
    /// That of the layer above the level.
    Above,
    /// That of the layer below the level.
    #[default]
    Below,
    /// The mean of both.
    Mean,
}

impl Scene {
    /// Reads and checks a scene file; its paths are relative to the file's folder.
    ///
    /// # Errors
    /// When the file cannot be read or is no valid scene; see [`SceneError`].
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        resolve::load(path)
    }

    /// Checks a scene given as text; its paths are relative to `base_dir`. Reads no file.
    ///
    /// # Errors
    /// When the text is no valid scene; see [`SceneError`].
    pub fn parse(text: &str, base_dir: &Path) -> Result<Self, SceneError> {
        resolve::parse(text, base_dir, None)
    }

    /// The embedded scene: a forearm of skin, fat and muscle, pressed on its dorsal side.
    ///
    /// # Panics
    /// Never: the embedded text is valid, which a test checks.
    pub fn embedded() -> Self {
        Self::parse(EMBEDDED, Path::new("")).expect("the embedded scene is valid")
    }

    /// The embedded scene as text, with comments: a start for one's own.
    pub fn embedded_toml() -> &'static str {
        EMBEDDED
    }

    /// The scene as a scene file, with every default written out and paths relative to `base_dir`.
    ///
    /// Parsing it again gives an equal scene.
    pub fn to_toml(&self) -> String {
        write::to_toml(self, Names::OfCatalogue)
    }

    /// The same, with the tissues of the catalogue written out as well: every number stands in it, to be changed.
    pub fn to_toml_in_full(&self) -> String {
        write::to_toml(self, Names::None)
    }

    /// Number of prisms under each skin triangle, which is one less than the nodes in a column.
    pub fn n_intervals(&self) -> usize {
        self.layers.iter().map(|layer| layer.levels).sum()
    }

    /// For each layer, what its material is and how far it is to be trusted. `[n_layers]`
    pub fn material_status(&self) -> Vec<MaterialStatus> {
        self.layers.iter().map(Layer::material_status).collect()
    }

    /// For each lump, what its material is and how far it is to be trusted. `[n_lumps]`
    pub fn lump_status(&self) -> Vec<MaterialStatus> {
        self.lumps.iter().map(Lump::material_status).collect()
    }
}

impl Press {
    /// Checks the numbers against the ranges of the scene file, for a program that has set its own.
    ///
    /// # Errors
    /// What is out of range, and the range.
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
