//! Messages between a page and the engine: JSON, each with a `type`.
//!
//! Lengths are in metres and forces in newtons. Positions are in the frame of the scene. The keys
//! of a scene are those of a scene file, with units ("12 kPa"). The JSON Schema of these types is
//! the control API's document, and the page's TypeScript types are generated from it.

mod engine;
mod game;
mod upload;

use std::fmt;

use palpa_scene::{ContactShape, LengthUnit};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

pub use self::engine::{
    BarProblem, DeviceTrouble, EngineFigures, ErrorBar, EventInfo, EventKind, ForceLimit,
    GrantedInfo, InjectedFault, LawFault, LostRecords, PriorityInfo, Spectrum, StepResult,
};

pub use self::game::{
    FoundLump, GameInfo, GameResult, Level, LevelInfo, MapSight, RoundInfo, Score, SeriesInfo,
};

pub use self::upload::{
    FindingInfo, FindingSeverity, SurfaceInfo, SurfaceVerdict, Template, TemplateInfo,
    TemplateLayer, UPLOAD_LIMITS, UploadLimits, Uploaded, UploadedContent,
};

/// A point or a vector.
pub type Vec3 = [f64; 3];

/// A request, with a number that the answer repeats.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Envelope {
    /// Number of the request, repeated in the [`Reply`]. Without it, only a refusal gets a reply.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub id: Option<u32>,
    /// The request.
    #[serde(flatten)]
    pub request: Request,
}

/// The requests of a client. Only the client in control may send requests other than
/// `take_control`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum Request {
    /// Take control.
    TakeControl,
    /// Move the hand to a pose.
    Hand(Hand),
    /// Lift the tool off the skin.
    Lift,
    /// Load a scene of the gallery.
    LoadScene {
        /// Key of the scene.
        key: String,
    },
    /// Load a scene from the text of a scene file.
    LoadText {
        /// The scene file (TOML).
        text: String,
        /// Numbers of uploaded files that the scene refers to by their names. If there are any, the
        /// scene may refer to no other files.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        files: Vec<u32>,
    },
    /// Load a scene given as JSON with the keys of a scene file, as in [`State::scene`]. It may
    /// refer only to uploaded files, and to those of the scene that the program was started with.
    LoadTable {
        /// The scene.
        scene: Value,
        /// Key of the gallery scene that it is a changed version of.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        key: Option<String>,
        /// Numbers of uploaded files that the scene refers to by their names.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        files: Vec<u32>,
    },
    /// Load a scene that was uploaded as a ZIP.
    LoadUploaded {
        /// Number of the uploaded file.
        file: u32,
    },
    /// Grow a body from an uploaded surface, with the layers of a template.
    Grow {
        /// Number of the skin's file.
        skin: u32,
        /// Numbers of the bones' files, in the same frame and unit.
        #[serde(default)]
        bones: Vec<u32>,
        /// Unit of the coordinates in these files.
        unit: LengthUnit,
        /// The layers.
        template: Template,
    },
    /// Undo the last change of the scene.
    Undo,
    /// Redo the change of the scene that was undone last.
    Redo,
    /// Restore the scene as it was loaded.
    ResetScene,
    /// Keep the present body instead of the one that is being built.
    CancelBuild,
    /// Change the scene. Either all edits apply or none.
    Edit {
        /// The edits, applied in order.
        edits: Vec<Edit>,
    },
    /// Start the scene's motion, for example a press or a palpation. A simulated hand performs it
    /// at the scene's place.
    RunMotion,
    /// Stop the scene's motion and free the hand.
    StopMotion,
    /// Start a new recording. The body starts at rest.
    StartRecording,
    /// End the recording.
    StopRecording,
    /// Show the recording instead of the live body.
    OpenReplay,
    /// Show the live body again.
    CloseReplay,
    /// Go to a moment of the recording.
    Seek {
        /// Time since the start of the recording, s.
        time: f64,
    },
    /// Play or pause the recording.
    Play {
        /// True to play, false to pause.
        on: bool,
    },
    /// Choose the field that frames carry.
    ShowField {
        /// The field.
        field: Field,
    },
    /// Forget what was felt: the palpation map becomes empty.
    ClearMap,
    /// Start "find the lump": hide lumps at random places.
    StartGame {
        /// The same seed, level and numbers give the same rounds. Without it, a new seed is chosen.
        #[serde(default)]
        seed: Option<u64>,
        /// Number of lumps in each round, 1 to 3.
        n_lumps: u32,
        /// Level of all rounds. Without it, each round draws one from the seed.
        #[serde(default)]
        level: Option<Level>,
        /// Number of rounds, 1 to 20.
        #[serde(default = "one")]
        n_rounds: u32,
    },
    /// Hide the lumps of the next round of a series.
    NextRound,
    /// Mark a place where the user suspects a lump.
    Mark {
        /// A point of the skin at rest, m.
        point: Vec3,
    },
    /// Take the last mark back.
    Unmark,
    /// Show where the lumps are.
    Reveal,
    /// End the game and restore the scene.
    EndGame,
    /// Cause a fault on purpose. Refused unless the program was started with faults allowed.
    Inject {
        /// The fault.
        fault: FaultKind,
    },
    /// Start the engine again on the same scene.
    Restart,
}

fn one() -> u32 {
    1
}

/// A pose of the hand: the tool's tip goes `depth` below `point`, against `normal`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Hand {
    /// A point of the skin at rest, m.
    pub point: Vec3,
    /// Outward normal of the skin at `point`.
    pub normal: Vec3,
    /// Depth below the skin at rest, m; negative is above the skin. With a force, the greatest depth.
    pub depth: f64,
    /// Force to hold, N, in place of a depth: the hand presses until the tissue pushes back with it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force: Option<f64>,
}

/// A change to one key of the scene file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Edit {
    /// JSON pointer into [`State::scene`], such as "/layer/1/tissue/young"; "/lump/-" appends a
    /// lump.
    pub path: String,
    /// The new value, as in a scene file; null removes the key.
    #[serde(default)]
    pub value: Value,
}

/// A field over the nodes, computed by the engine because it is too costly for a page.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Field {
    /// No field.
    #[default]
    None,
    /// Von Mises stress, Pa.
    VonMises,
    /// Pressure, Pa.
    Pressure,
    /// Largest principal stretch.
    Stretch,
}

/// A fault that is caused on purpose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// The tissue's thread panics.
    TissuePanic,
    /// A contact patch contains NaN.
    SpoiltPatch,
    /// The tissue pauses for half a second.
    TissuePause,
}

/// The messages of the server to a client, besides snapshots.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum Message {
    /// The first message on a connection.
    Hello(Hello),
    /// The whole state, sent after every change.
    State(Box<State>),
    /// Figures of the engine, twice a second.
    Engine(Box<EngineFigures>),
    /// An event that a user should know of.
    Notice(Notice),
    /// The answer to a request.
    Reply(Reply),
}

/// The first message on a connection.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Hello {
    /// Version of the program.
    pub palpa: String,
    /// Version of the snapshot format. A page with another version must be reloaded.
    pub snapshot_version: u32,
    /// The number of this connection.
    pub client: u64,
    /// Name of this run of the program: another one after a restart.
    pub run: String,
    /// Limits on a user's files.
    pub upload_limits: UploadLimits,
}

/// The answer to a request.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Reply {
    /// Number of the request.
    pub id: Option<u32>,
    /// The reason for a refusal; none if the request is done or under way.
    pub error: Option<String>,
}

/// An event that a user should know of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Notice {
    /// Severity.
    pub level: NoticeLevel,
    /// What happened.
    pub what: NoticeKind,
}

/// What a notice is about: its kind, with the names and numbers in it. Pages have words for each
/// kind in each of their languages.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum NoticeKind {
    /// A scene could not be built, or the engine stopped.
    Problem {
        /// The reason.
        problem: Problem,
    },
    /// The scene's motion ended, because the scene was changed.
    MotionEnded,
    /// The recording ended, because it is as long as a recording may be.
    RecordingFull,
    /// A thread of the engine ended by a fault. The force went to zero, and the engine is restarted.
    ThreadLost {
        /// Name of the thread.
        thread: String,
    },
    /// The client sent too many requests, and some were left out.
    TooManyRequests,
    /// An error of the engine.
    Engine {
        /// The event.
        event: EventKind,
    },
}

/// Why there is no body, or not the wanted one. `Display` has the English words, for the command
/// and for `/healthz`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Problem {
    /// The scene cannot be built, or the engine cannot start.
    Refused {
        /// The reason with key, range and advice, in English, as for a scene file.
        text: String,
    },
    /// The system gave no thread to build the body on.
    NoThread {
        /// The system's reason.
        reason: String,
    },
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Refused { text } => f.write_str(text),
            Self::NoThread { reason } => write!(f, "no thread to build the body: {reason}"),
        }
    }
}

/// Severity of a notice.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum NoticeLevel {
    /// For information.
    Info,
    /// Something is not as it should be.
    Warning,
    /// Something failed.
    Error,
}

/// A remark on the scene: its kind, and the names and numbers in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Note {
    /// Kind of note. Pages have a text for each kind in each of their languages.
    pub kind: String,
    /// Names and numbers, in SI units.
    pub values: serde_json::Map<String, Value>,
    /// The note in English, for clients without texts of their own.
    pub text: String,
}

/// Everything that pages show, except the moving body.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct State {
    /// Grows with every change of the state.
    pub revision: u64,
    /// Number of the connection in control; null if no page is in control.
    pub controller: Option<u64>,
    /// Number of pages that are connected.
    pub n_clients: u32,
    /// Scenes of the gallery.
    pub gallery: Vec<GalleryEntry>,
    /// Key of the loaded gallery scene; null for a scene from another source.
    pub gallery_key: Option<String>,
    /// The whole scene, with the keys of a scene file. During a game it has no lumps.
    pub scene: Value,
    /// Number of the scene as it was loaded: edits keep it, and undoing a load brings back the
    /// number before.
    pub origin: u64,
    /// Whether the scene was changed since it was loaded.
    pub is_changed: bool,
    /// Names of the files that the scene refers to.
    pub files: Vec<String>,
    /// Number of changes of the scene that can be undone.
    pub n_undo: u32,
    /// Number of changes of the scene that can be redone.
    pub n_redo: u32,
    /// The layers, from the skin down.
    pub layers: Vec<LayerInfo>,
    /// The lumps at their places at rest; empty during a game.
    pub lumps: Vec<LumpInfo>,
    /// The tool.
    pub tool: ToolInfo,
    /// Pose of the hand over the place that the scene presses.
    pub home: Hand,
    /// Depth of the scene's motion, m.
    pub usual_depth: f64,
    /// Largest depth that a page should offer, m.
    pub greatest_depth: f64,
    /// Largest force of the device, N.
    pub max_force: f64,
    /// The model of the body.
    pub method: Method,
    /// Phase of the engine.
    pub phase: Phase,
    /// Reason why the last scene could not be built, or why the engine stopped.
    pub problem: Option<Problem>,
    /// Remarks on the scene for the user.
    pub notes: Vec<Note>,
    /// Whether the scene's motion runs.
    pub is_motion_running: bool,
    /// The field that frames carry.
    pub field: Field,
    /// The recording.
    pub recording: RecordingInfo,
    /// The game, if one is under way.
    pub game: Option<GameInfo>,
    /// The levels of the game.
    pub levels: Vec<LevelInfo>,
    /// Number of rounds in `/api/game.csv`.
    pub n_game_results: u32,
    /// Number of nodes of the body.
    pub n_nodes: u32,
    /// Whether a page may cause faults on purpose.
    pub allows_faults: bool,
}

/// The model of the body.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Continuum finite elements; the tool presses by contact.
    #[default]
    Tissue,
    /// The network of bars of 2009; the tool holds a single node.
    Reference,
}

/// Phase of the engine.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// A body is being built. The previous body is still there.
    #[default]
    Building,
    /// The engine runs.
    Running,
    /// The engine does not run; see [`State::problem`].
    Stopped,
}

/// A scene of the gallery.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct GalleryEntry {
    /// Key for `load_scene`.
    pub key: String,
    /// Name in English. A page may have a translation for the key.
    pub name: String,
}

/// A layer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LayerInfo {
    /// Name of its tissue.
    pub name: String,
    /// Name of its elastic law.
    pub law: String,
    /// Young's modulus at small strain, Pa; in the reference method, stiffness of a bar, N/m.
    pub stiffness: f64,
    /// Mean thickness at rest, m.
    pub thickness: f64,
}

/// A lump at rest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LumpInfo {
    /// Its name.
    pub name: String,
    /// Its shape.
    pub shape: LumpForm,
    /// Its centre, m.
    pub centre: Vec3,
    /// Its axes: three unit vectors.
    pub axes: [Vec3; 3],
    /// Young's modulus at small strain, Pa.
    pub stiffness: f64,
}

/// The shape of a lump. Lengths in m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum LumpForm {
    /// An ellipsoid, or a ball.
    Ellipsoid {
        /// Radii along its axes.
        radii: Vec3,
    },
    /// A cylinder along its first axis, with round ends.
    Capsule {
        /// Radius of the cylinder and its ends.
        radius: f64,
        /// Length of the straight part.
        length: f64,
    },
    /// A surface mesh; only its bounding sphere is sent.
    Mesh {
        /// Radius of the bounding sphere.
        radius: f64,
    },
}

/// The tool. In its own frame the tip is the origin, and z points out of the tissue.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct ToolInfo {
    /// Its shape; null if the tool holds a single node.
    pub shape: Option<ContactShape>,
    /// Coulomb's coefficient of friction.
    pub friction: f64,
}

/// The recording.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RecordingInfo {
    /// Whether a recording is under way.
    pub is_recording: bool,
    /// Its duration, s; 0 without a recording.
    pub duration: f64,
    /// Whether pages show the recording instead of the live body.
    pub is_replaying: bool,
    /// Whether the recording plays by itself.
    pub is_playing: bool,
}

/// The course of a whole recording, from the ticks of the 1 kHz loop. Of each stretch of time the ticks
/// with the least and the largest force and depth are kept, so that peaks stay. All lists have the
/// same length, at most some 2000.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RecordingCurve {
    /// Time since the start of the recording, s, ascending.
    pub time: Vec<f64>,
    /// Depth of the tool's tip below the skin at rest, along the normal at `place`, m.
    pub depth: Vec<f64>,
    /// The nearest place of the skin at rest, m.
    pub place: Vec<Vec3>,
    /// Force on the hand, N.
    pub force: Vec<Vec3>,
    /// Its component along the tool's axis, N.
    pub axial: Vec<f64>,
    /// Size of the tissue's force by the local model, before the limits of the device, N.
    pub tissue_force: Vec<f64>,
    /// Indices of the points before which ticks are missing: curves are broken there.
    pub gaps: Vec<u32>,
}
