//! What a page asks of the engine, and what it is told: JSON, one `type` each.
//!
//! Lengths are metres, forces newtons, places in the frame of the scene, except inside a scene's own keys, which are those
//! of a scene file ("12 kPa"). The JSON Schema of these types is the control API's document, and the page's types are made
//! from it.

use palpa_scene::ContactShape;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// A point or a vector.
pub type Vec3 = [f64; 3];

/// A request of a page, with a number of its own that the answer repeats.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Envelope {
    /// Repeated in the [`Reply`]; without it only a refusal is answered.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub id: Option<u32>,
    /// What is asked.
    #[serde(flatten)]
    pub request: Request,
}

/// What a page may ask. Only who controls may ask for more than control.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum Request {
    /// To be the one who controls.
    TakeControl,
    /// The hand goes there.
    Hand(Hand),
    /// The hand lifts the tool off the skin.
    Lift,
    /// A scene of the gallery.
    LoadScene {
        /// Its key.
        key: String,
    },
    /// A scene of one's own, as the text of a scene file.
    LoadText {
        /// The text (TOML).
        text: String,
    },
    /// Changes of the scene, all of them or none.
    Edit {
        /// In order.
        edits: Vec<Edit>,
    },
    /// The scene's motion, from a press to a palpation, by a simulated hand at the place of the scene.
    RunMotion,
    /// The hand is free again.
    StopMotion,
    /// A new recording begins, on a body at rest.
    StartRecording,
    /// The recording ends.
    StopRecording,
    /// The recording is shown instead of the body that is pressed.
    OpenReplay,
    /// The body that is pressed is shown again.
    CloseReplay,
    /// The moment of the recording that is shown.
    Seek {
        /// Since the recording's beginning, s.
        time: f64,
    },
    /// The recording goes on by itself, or stands.
    Play {
        /// Whether it goes on.
        on: bool,
    },
    /// The field that frames carry.
    ShowField {
        /// Which.
        field: Field,
    },
    /// Lumps are hidden at random places, to be found.
    StartGame {
        /// The same seed hides them at the same places; none is a new one.
        #[serde(default)]
        seed: Option<u64>,
        /// How many, 1 to 3.
        n_lumps: u32,
    },
    /// A lump is thought to be here.
    Mark {
        /// A point of the skin at rest.
        point: Vec3,
    },
    /// The last mark was a mistake.
    Unmark,
    /// The truth is shown.
    Reveal,
    /// The game is over, and the scene is what it was.
    EndGame,
    /// A fault on purpose. Refused unless the program was started for it.
    Inject {
        /// Which.
        fault: FaultKind,
    },
    /// The engine starts anew on the same scene.
    Restart,
}

/// Where the hand holds the tool. Its tip is to be `depth` under `point`, against `normal`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Hand {
    /// A point of the skin at rest, m.
    pub point: Vec3,
    /// The skin's outward normal there.
    pub normal: Vec3,
    /// How deep, m; negative is above the skin.
    pub depth: f64,
}

/// A change of one key of the scene file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Edit {
    /// JSON pointer into [`State::scene`], as "/layer/1/tissue/young"; "/lump/-" appends.
    pub path: String,
    /// The new value, as in a scene file; null takes the key away.
    #[serde(default)]
    pub value: Value,
}

/// A field over the nodes that is too costly for a page.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Field {
    /// None.
    #[default]
    None,
    /// Von Mises stress, Pa.
    VonMises,
    /// Pressure, Pa.
    Pressure,
    /// Largest principal stretch.
    Stretch,
}

/// A fault on purpose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// The tissue's thread panics.
    TissuePanic,
    /// A patch with NaN.
    SpoiltPatch,
    /// The tissue pauses for half a second.
    TissuePause,
}

/// What a page is told, beside snapshots.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum Message {
    /// First of all.
    Hello(Hello),
    /// All of the state, whenever any of it has changed.
    State(Box<State>),
    /// How the engine fares, twice a second.
    Engine(Box<EngineFigures>),
    /// Something that happened.
    Notice(Notice),
    /// The answer to a request.
    Reply(Reply),
}

/// Who is spoken to.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Hello {
    /// Version of the program.
    pub palpa: String,
    /// Version of the snapshots; a page of another one must be loaded again.
    pub snapshot_version: u32,
    /// The number of this connection.
    pub client: u64,
}

/// The answer to a request.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Reply {
    /// That of the request.
    pub id: Option<u32>,
    /// Why it is refused; none when it is done or under way.
    pub error: Option<String>,
}

/// Something that happened.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Notice {
    /// How grave it is.
    pub level: NoticeLevel,
    /// In words.
    pub text: String,
}

/// How grave a notice is.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum NoticeLevel {
    /// Good to know.
    Info,
    /// Not as it should be.
    Warning,
    /// Something failed.
    Error,
}

/// Something to know about the scene: its kind, and the names and numbers in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Note {
    /// The kind of note. Pages have words for each kind in each of their languages.
    pub kind: String,
    /// Names and numbers, in SI units.
    pub values: serde_json::Map<String, Value>,
    /// The note in English, for clients without words of their own.
    pub text: String,
}

/// Everything that pages show, except the moving body.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct State {
    /// Grows with every change.
    pub revision: u64,
    /// Who controls: the number of a connection.
    pub controller: Option<u64>,
    /// How many pages are connected.
    pub n_clients: u32,
    /// The scenes that can be chosen.
    pub gallery: Vec<GalleryEntry>,
    /// The one that was chosen; none for one's own.
    pub gallery_key: Option<String>,
    /// The scene in full, as a scene file says it; while a game is on, without its lumps.
    pub scene: Value,
    /// The layers, from the skin down.
    pub layers: Vec<LayerInfo>,
    /// The lumps where they lie at rest; while a game is on, none.
    pub lumps: Vec<LumpInfo>,
    /// What presses.
    pub tool: ToolInfo,
    /// The place that the scene presses, and where the tool hangs over it.
    pub home: Hand,
    /// How deep the scene's hand presses, m.
    pub usual_depth: f64,
    /// The greatest depth that makes sense, m.
    pub greatest_depth: f64,
    /// Largest force of the device, N.
    pub max_force: f64,
    /// How the body answers.
    pub method: Method,
    /// What the engine does.
    pub phase: Phase,
    /// Why the last scene could not be built, or the engine stopped.
    pub problem: Option<String>,
    /// What a user should know of the scene.
    pub notes: Vec<Note>,
    /// Whether the scene's motion runs.
    pub is_motion_running: bool,
    /// The field that frames carry.
    pub field: Field,
    /// The recording.
    pub recording: RecordingInfo,
    /// The game, if one is on.
    pub game: Option<GameInfo>,
    /// Nodes of the body.
    pub n_nodes: u32,
    /// Whether faults on purpose are allowed.
    pub allows_faults: bool,
}

/// How the body answers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Continuum finite elements, contact.
    #[default]
    Tissue,
    /// The network of bars of 2009, a node held.
    Reference,
}

/// What the engine does.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// A body is being built; the one before is still there.
    #[default]
    Building,
    /// The engine runs.
    Running,
    /// It does not, see [`State::problem`].
    Stopped,
}

/// A scene of the gallery.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct GalleryEntry {
    /// To choose it by.
    pub key: String,
    /// In words (English; a page may know the key in other languages).
    pub name: String,
}

/// A layer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LayerInfo {
    /// Its tissue.
    pub name: String,
    /// Its law, in a word.
    pub law: String,
    /// Young's modulus at small strain, Pa; N/m of a bar in the reference method.
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
    /// Its axes, three unit vectors.
    pub axes: [Vec3; 3],
    /// Young's modulus at small strain, Pa.
    pub stiffness: f64,
}

/// The shape of a lump, m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum LumpForm {
    /// An ellipsoid, or a ball.
    Ellipsoid {
        /// Along its axes.
        radii: Vec3,
    },
    /// A cylinder along its first axis with round ends.
    Capsule {
        /// Of the cylinder and its ends.
        radius: f64,
        /// Of the straight part.
        length: f64,
    },
    /// A mesh, of which only this ball round it is told.
    Mesh {
        /// Radius of the ball.
        radius: f64,
    },
}

/// What presses. In its own frame its tip is the origin, and z points out of the tissue.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct ToolInfo {
    /// Its shape; null for a single node that is held.
    pub shape: Option<ContactShape>,
    /// Coulomb's coefficient of friction.
    pub friction: f64,
}

/// The recording.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RecordingInfo {
    /// Whether one is under way.
    pub is_recording: bool,
    /// How long it is, s; 0 when there is none.
    pub duration: f64,
    /// Whether it is shown.
    pub is_replaying: bool,
    /// Whether it goes on by itself.
    pub is_playing: bool,
}

/// A round of finding lumps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GameInfo {
    /// The seed; with it the round can be had again.
    pub seed: u64,
    /// How many lumps are hidden.
    pub n_lumps: u32,
    /// Where they are thought to be, points of the skin.
    pub marks: Vec<Vec3>,
    /// Seconds since the beginning, until the truth was shown.
    pub seconds: f64,
    /// The truth, once it is asked for.
    pub result: Option<GameResult>,
}

/// The truth of a round.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GameResult {
    /// The lumps.
    pub lumps: Vec<FoundLump>,
    /// Marks that belong to no lump.
    pub n_stray_marks: u32,
    /// Largest force used, N.
    pub max_force: f64,
    /// Mean force while pressing, N.
    pub mean_force: f64,
    /// Time in contact, s.
    pub contact_seconds: f64,
    /// Share of the skin that could be pressed on and was, 0 to 1.
    pub covered: f64,
    /// Where it was pressed: place on the skin (x, y, z, m) and the largest force there, N.
    pub coverage: Vec<[f64; 4]>,
}

/// A lump and the mark that is nearest to it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FoundLump {
    /// The lump.
    pub lump: LumpInfo,
    /// The point of the skin over its centre.
    pub over: Vec3,
    /// Distance of the mark that was meant for it from that point, m; none without a mark.
    pub error: Option<f64>,
}

/// Figures of the engine.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct EngineFigures {
    /// Since its start, s.
    pub seconds: f64,
    /// Steps of the tissue in the last second.
    pub tissue_rate: f64,
    /// Ticks of the loop in the last second.
    pub tick_rate: f64,
    /// Ticks left out since the start: missed deadlines.
    pub missed: u64,
    /// CPU time of a tick, s: half of them took less, 999 of 1,000, the longest.
    pub tick_cpu: [f64; 3],
    /// The same of lateness of ticks, s.
    pub lateness: [f64; 3],
    /// The same of CPU time of the tissue's steps, s.
    pub step_cpu: [f64; 3],
    /// Histogram of the CPU time of ticks: lower end, upper end (s), count.
    pub tick_histogram: Vec<(f64, f64, u64)>,
    /// From taking the pose to the force that is made of it, s, now: age of the patch.
    pub latency: f64,
    /// Nodes of the body.
    pub n_nodes: u32,
    /// Meshes taken up so far.
    pub n_meshes: u64,
    /// Limits that the force met since the last figures, in words.
    pub limits: Vec<String>,
    /// What was wrong since the last figures, in words.
    pub faults: Vec<String>,
    /// Energy taken from the hand since the start, J.
    pub energy_in: f64,
    /// Energy given to it, J.
    pub energy_out: f64,
    /// What may be given out beyond what was taken in, J.
    pub energy_budget: f64,
    /// How the last step of the tissue went.
    pub step_status: String,
    /// What the threads were granted, in words.
    pub granted: Vec<String>,
    /// What happened last, newest last.
    pub events: Vec<EventInfo>,
    /// Snapshots made in the last second.
    pub snapshot_rate: f64,
}

/// Something of the engine's log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EventInfo {
    /// Since its start, s.
    pub time: f64,
    /// How grave it is.
    pub level: NoticeLevel,
    /// What.
    pub text: String,
}
