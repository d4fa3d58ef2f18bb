//! The latest published state and the connected clients: the exchange between the session's threads
//! and the server's.
//!
//! Nothing here blocks. New data replaces old data, and each client takes the newest when it has
//! room.

use crate::{
    control::{EngineFigures, Message, Notice, State},
    host::Clients,
    metrics::Counts,
};
use axum::{body::Bytes, extract::ws::Utf8Bytes};
use std::{
    fmt,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};
use tokio::sync::{broadcast, watch};

/// Largest number of notices that a client may lag behind.
const NOTICES: usize = 64;

/// Sends data to pages. Never waits for them; callable from any thread.
#[derive(Clone)]
pub struct Publisher {
    board: Arc<Board>,
}

impl Publisher {
    pub(crate) fn new(board: Arc<Board>) -> Self {
        Self { board }
    }

    /// Publishes a new mesh, a [`MeshSnapshot`](crate::wire::MeshSnapshot) with its number. Every
    /// client gets it before any frame of it, and so does each client that connects later.
    pub fn mesh(&self, mesh: u32, snapshot: Vec<u8>) {
        self.board.picture.send_modify(|picture| {
            let serial = picture.mesh.as_ref().map_or(0, |m| m.serial) + 1;
            picture.mesh = Some(Shot::new(mesh, serial, snapshot));
        });
    }

    /// Publishes a new frame of a mesh, a [`FrameSnapshot`](crate::wire::FrameSnapshot). The latest
    /// wins; slow clients miss frames. A frame that does not belong to the latest mesh is not sent.
    pub fn frame(&self, mesh: u32, snapshot: Vec<u8>) {
        self.board.picture.send_modify(|picture| {
            let serial = picture.frame.as_ref().map_or(0, |f| f.serial) + 1;
            picture.frame = Some(Shot::new(mesh, serial, snapshot));
        });
    }

    /// Publishes the palpation map, a [`MapSnapshot`](crate::wire::MapSnapshot). The latest wins, and each client
    /// that connects later gets it too.
    pub fn map(&self, snapshot: Vec<u8>) {
        self.board.picture.send_modify(|picture| {
            let serial = picture.map.as_ref().map_or(0, |m| m.serial) + 1;
            picture.map = Some(Shot::new(0, serial, snapshot));
        });
    }

    /// Publishes a changed state. The controller, the number of clients and a new revision are
    /// filled in here.
    pub fn state(&self, state: State) {
        let mut seats = self.board.seats();
        seats.state = Some(Message::State(Box::new(state)));
        seats.tell(&self.board.state);
    }

    /// Publishes the engine's figures; the latest wins.
    pub fn engine(&self, figures: EngineFigures) {
        let message = Message::Engine(Box::new(figures));
        let text = json(&message);
        if let Message::Engine(figures) = message {
            let figures = Some((Arc::from(figures), text));
            self.board.engine.send_replace(figures);
        }
    }

    /// Publishes a notice to all connected clients. A client that lags far behind misses the
    /// oldest.
    pub fn notice(&self, notice: Notice) {
        // An error means that no client is connected.
        let _ = self.board.notices.send(json(&Message::Notice(notice)));
    }

    /// Number of connected clients.
    pub fn n_clients(&self) -> usize {
        self.board.clients().n
    }
}

impl fmt::Debug for Publisher {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Publisher")
            .field("clients", &self.board.clients())
            .finish_non_exhaustive()
    }
}

/// The latest published data.
#[derive(Debug)]
pub(crate) struct Board {
    /// The mesh and the frame.
    pub(crate) picture: watch::Sender<Picture>,
    /// The state, as the text of its message.
    pub(crate) state: watch::Sender<Option<Utf8Bytes>>,
    /// The engine's figures, and the text of their message.
    pub(crate) engine: watch::Sender<Option<(Arc<EngineFigures>, Utf8Bytes)>>,
    /// Notices, as texts of their messages.
    pub(crate) notices: broadcast::Sender<Utf8Bytes>,
    /// The server's counters.
    pub(crate) counts: Counts,
    seats: Mutex<Seats>,
}

/// A mesh, a frame and a map. They share one watch, so that no client sees a frame without its mesh.
#[derive(Debug, Clone, Default)]
pub(crate) struct Picture {
    pub(crate) mesh: Option<Shot>,
    pub(crate) frame: Option<Shot>,
    /// The palpation map; it belongs to the body, whatever its mesh.
    pub(crate) map: Option<Shot>,
}

/// A snapshot, shared by all clients.
#[derive(Debug, Clone)]
pub(crate) struct Shot {
    /// Number of the mesh that it is or belongs to.
    pub(crate) mesh: u32,
    /// Number of the snapshot among all that were published.
    pub(crate) serial: u64,
    pub(crate) bytes: Bytes,
}

impl Shot {
    fn new(mesh: u32, serial: u64, snapshot: Vec<u8>) -> Self {
        Self {
            mesh,
            serial,
            bytes: snapshot.into(),
        }
    }
}

impl Board {
    pub(crate) fn new() -> Self {
        Self {
            picture: watch::Sender::new(Picture::default()),
            state: watch::Sender::new(None),
            engine: watch::Sender::new(None),
            notices: broadcast::Sender::new(NOTICES),
            counts: Counts::default(),
            seats: Mutex::default(),
        }
    }

    /// The connected clients.
    pub(crate) fn clients(&self) -> Clients {
        self.seats().clients()
    }

    /// Adds a client and returns its number. The client takes control if nobody has it.
    pub(crate) fn enter(&self) -> u64 {
        let mut seats = self.seats();
        seats.last += 1;
        let client = seats.last;
        seats.taken.push(client);
        if seats.controller == Controller::Nobody {
            seats.controller = Controller::Page(client);
        }
        seats.tell(&self.state);
        client
    }

    /// Removes a client and returns whether it was in control. If it was, nobody is in control
    /// until [`inherit`](Self::inherit) or until a client connects: a page that reloads gets its
    /// control back.
    pub(crate) fn leave(&self, client: u64) -> bool {
        let mut seats = self.seats();
        seats.taken.retain(|&c| c != client);
        let has_controlled = seats.controller == Controller::Page(client);
        if has_controlled {
            seats.controller = Controller::Nobody;
        }
        seats.tell(&self.state);
        has_controlled
    }

    /// Gives control to the only client that is left, if nobody has it.
    pub(crate) fn inherit(&self) {
        let mut seats = self.seats();
        if let ([only], Controller::Nobody) = (&seats.taken[..], seats.controller) {
            seats.controller = Controller::Page(*only);
            seats.tell(&self.state);
        }
    }

    /// Gives control to `by`.
    pub(crate) fn take_control(&self, by: Controller) {
        let mut seats = self.seats();
        if seats.controller != by {
            seats.controller = by;
            seats.tell(&self.state);
        }
    }

    /// The client in control.
    pub(crate) fn controller(&self) -> Controller {
        self.seats().controller
    }

    /// The state as JSON, without the message around it.
    pub(crate) fn state_alone(&self) -> Option<String> {
        match &self.seats().state {
            Some(Message::State(state)) => serde_json::to_string(state).ok(),
            _ => None,
        }
    }

    fn seats(&self) -> MutexGuard<'_, Seats> {
        self.seats.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The client in control.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) enum Controller {
    /// Nobody; the first client that connects takes control.
    #[default]
    Nobody,
    /// The page of this connection.
    Page(u64),
    /// A program, by `/api/control`, until a page takes control.
    Program,
}

/// The connected clients, and the state that reports them.
#[derive(Debug, Default)]
struct Seats {
    last: u64,
    taken: Vec<u64>,
    controller: Controller,
    /// A [`Message::State`].
    state: Option<Message>,
    revision: u64,
}

impl Seats {
    fn clients(&self) -> Clients {
        Clients {
            n: self.taken.len(),
            controller: match self.controller {
                Controller::Page(client) => Some(client),
                Controller::Nobody | Controller::Program => None,
            },
        }
    }

    /// Fills in the controller and the number of clients, and publishes the state.
    fn tell(&mut self, to: &watch::Sender<Option<Utf8Bytes>>) {
        let Clients { n, controller } = self.clients();
        let Some(message) = &mut self.state else {
            return;
        };
        if let Message::State(state) = message {
            self.revision = state.revision.max(self.revision + 1);
            state.revision = self.revision;
            state.controller = controller;
            state.n_clients = n as u32;
        }
        to.send_replace(Some(json(message)));
    }
}

/// A message as text.
pub(crate) fn json(message: &Message) -> Utf8Bytes {
    // Serializing these types cannot fail: keys are strings, and NaN and infinity become null.
    serde_json::to_string(message).unwrap_or_default().into()
}
