//! The interface between the server and the session behind it.

use crate::control::{Request, Uploaded};
use palpa_scene::LengthUnit;

/// The session, as the server calls it. No call may block, because the server has one thread for
/// them. [`Host::file`] may: it has its own thread.
pub trait Host: Send + Sync + 'static {
    /// Handles a request of the client in control. `answer` must be called once, on any thread.
    /// [`Request::TakeControl`] never arrives here: the server itself knows which client is in
    /// control.
    fn request(&self, request: Request, answer: Answer);

    /// Called when the number of clients or the client in control has changed. Calls come in order,
    /// and before the first request of a new client.
    fn clients(&self, clients: Clients);

    /// Makes a file. This may take long; it runs on a thread of its own. `None` if there is no such
    /// file yet.
    ///
    /// # Errors
    /// A text that says why the file cannot be made.
    fn file(&self, file: HostFile) -> Result<Option<Vec<u8>>, String>;

    /// Takes a user's file: reads and checks it. This may take long; it runs on a thread of its own.
    ///
    /// # Errors
    /// A text that says what is wrong with the file, where, and what to do.
    fn upload(&self, name: &str, bytes: Vec<u8>) -> Result<Uploaded, String>;

    /// Checks an uploaded surface again, with coordinates in `unit`. This may take long; it runs on
    /// a thread of its own. `None` if there is no such surface.
    fn check_uploaded(&self, id: u32, unit: LengthUnit) -> Option<Uploaded>;

    /// An uploaded surface for the picture: a [`MeshSnapshot`](crate::wire::MeshSnapshot) of one
    /// level in the unit of the file, with its middle at the origin. `None` if there is no such
    /// surface.
    fn uploaded_mesh(&self, id: u32) -> Option<Vec<u8>>;

    /// The reason why the session does not work, if it does not.
    fn problem(&self) -> Option<String>;
}

/// Takes the result of a request: `Ok` if it is done or under way, or the reason for a refusal. If
/// it is dropped without a call, the client gets the message that there was no answer.
pub type Answer = Box<dyn FnOnce(Result<(), String>) + Send>;

/// The clients that are connected.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Clients {
    /// Number of clients.
    pub n: usize,
    /// Number of the connection that is in control; `None` if no page is.
    pub controller: Option<u64>,
}

/// A file that is made on request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HostFile {
    /// The scene, as a scene file with every default written out.
    Scene,
    /// The scene file with the files that it refers to (ZIP).
    SceneArchive,
    /// The body in its present deformed state (VTU).
    Body,
    /// The palpation map on the skin (VTU).
    Map,
    /// The places of the palpation map (CSV).
    MapCsv,
    /// Results of the last game, one row for each lump of each round.
    GameCsv,
    /// The recording (MCAP).
    RecordingLog,
    /// The recording's ticks (CSV).
    RecordingCsv,
    /// The course of the recording ([`RecordingCurve`](crate::control::RecordingCurve), JSON).
    RecordingCurve,
    /// Spectrum of the force in the last second ([`Spectrum`](crate::control::Spectrum), JSON).
    Spectrum,
}
