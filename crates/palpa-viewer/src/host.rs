//! What the server asks of the session behind it.

use crate::control::Request;

/// What the server asks of the session. No call may wait, as the server's one thread makes them; [`Host::file`] may.
pub trait Host: Send + Sync + 'static {
    /// A request of who controls; `answer` is called once, on any thread. [`Request::TakeControl`] is not among them: the
    /// server knows who controls.
    fn request(&self, request: Request, answer: Answer);

    /// Whether anyone is connected and who controls has changed. Told in order, before the first request of a new client.
    fn clients(&self, clients: Clients);

    /// A file; may take its time, on a thread of its own.
    ///
    /// # Errors
    /// Why it cannot be made, in words.
    fn file(&self, file: HostFile) -> Result<Option<Vec<u8>>, String>;

    /// Why it is not well, if it is not.
    fn problem(&self) -> Option<String>;
}

/// Takes the outcome of a request: done or under way, or why it is refused. Dropped unused, the client is told that there was
/// no answer.
pub type Answer = Box<dyn FnOnce(Result<(), String>) + Send>;

/// Who is connected.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Clients {
    /// How many.
    pub n: usize,
    /// The number of the connection that controls.
    pub controller: Option<u64>,
}

/// A file that is made when it is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HostFile {
    /// The scene, as a scene file with every default written out.
    Scene,
    /// The body as it is pressed now (VTU).
    Body,
    /// The recording (MCAP).
    RecordingLog,
    /// The recording's ticks (CSV).
    RecordingCsv,
}
