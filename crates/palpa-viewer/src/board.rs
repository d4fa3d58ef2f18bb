//! What the session has published last, and who is connected: the place between the session's threads and the server's.
//!
//! Nothing here waits: what is published replaces what was there, and each client takes what is newest when it has room.

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

/// Notices that a client may be behind.
const NOTICES: usize = 64;

/// Gives pages what they show. Never waits for them, callable from any thread.
#[derive(Clone)]
pub struct Publisher {
    board: Arc<Board>,
}

impl Publisher {
    pub(crate) fn new(board: Arc<Board>) -> Self {
        Self { board }
    }

    /// A new mesh, a [`MeshSnapshot`](crate::wire::MeshSnapshot) with its number: sent to every client before any frame of it,
    /// and to each client that connects later.
    pub fn mesh(&self, mesh: u32, snapshot: Vec<u8>) {
        self.board.picture.send_modify(|picture| {
            let serial = picture.mesh.as_ref().map_or(0, |m| m.serial) + 1;
            picture.mesh = Some(Shot::new(mesh, serial, snapshot));
        });
    }

    /// A new frame of a mesh, a [`FrameSnapshot`](crate::wire::FrameSnapshot): the latest wins, slow clients miss frames. One
    /// that is not of the latest mesh is shown to nobody.
    pub fn frame(&self, mesh: u32, snapshot: Vec<u8>) {
        self.board.picture.send_modify(|picture| {
            let serial = picture.frame.as_ref().map_or(0, |f| f.serial) + 1;
            picture.frame = Some(Shot::new(mesh, serial, snapshot));
        });
    }

    /// The state has changed. Who controls and how many are connected is filled in here, and the revision made to grow.
    pub fn state(&self, state: State) {
        let mut seats = self.board.seats();
        seats.state = Some(Message::State(Box::new(state)));
        seats.tell(&self.board.state);
    }

    /// How the engine fares; the latest wins.
    pub fn engine(&self, figures: EngineFigures) {
        let message = Message::Engine(Box::new(figures));
        let text = json(&message);
        if let Message::Engine(figures) = message {
            let figures = Some((Arc::from(figures), text));
            self.board.engine.send_replace(figures);
        }
    }

    /// Something that happened, for all who are connected. A client that is far behind misses the oldest.
    pub fn notice(&self, notice: Notice) {
        // An error says that nobody is connected, and nobody hears it.
        let _ = self.board.notices.send(json(&Message::Notice(notice)));
    }

    /// How many are connected.
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

/// What was published last.
#[derive(Debug)]
pub(crate) struct Board {
    /// What is seen.
    pub(crate) picture: watch::Sender<Picture>,
    /// The state, as the text of its message.
    pub(crate) state: watch::Sender<Option<Utf8Bytes>>,
    /// The engine's figures, and the text of their message.
    pub(crate) engine: watch::Sender<Option<(Arc<EngineFigures>, Utf8Bytes)>>,
    /// Notices, as texts of their messages.
    pub(crate) notices: broadcast::Sender<Utf8Bytes>,
    /// What was counted.
    pub(crate) counts: Counts,
    seats: Mutex<Seats>,
}

/// A mesh and a frame, of the same watch so that no client can see a frame and not its mesh.
#[derive(Debug, Clone, Default)]
pub(crate) struct Picture {
    pub(crate) mesh: Option<Shot>,
    pub(crate) frame: Option<Shot>,
}

/// A snapshot, shared by all clients.
#[derive(Debug, Clone)]
pub(crate) struct Shot {
    /// The mesh that it is or belongs to.
    pub(crate) mesh: u32,
    /// Counts those that were published.
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

    /// Who is connected.
    pub(crate) fn clients(&self) -> Clients {
        self.seats().clients()
    }

    /// A client comes, and is told its number. It controls if nobody does.
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

    /// A client leaves. If it controlled, nobody does until [`inherit`](Self::inherit) or a client comes: a page that is loaded
    /// again is to have its control again. Says whether it controlled.
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

    /// If nobody controls, the only client that is left does.
    pub(crate) fn inherit(&self) {
        let mut seats = self.seats();
        if let ([only], Controller::Nobody) = (&seats.taken[..], seats.controller) {
            seats.controller = Controller::Page(*only);
            seats.tell(&self.state);
        }
    }

    /// It is this one who controls from now on.
    pub(crate) fn take_control(&self, by: Controller) {
        let mut seats = self.seats();
        if seats.controller != by {
            seats.controller = by;
            seats.tell(&self.state);
        }
    }

    /// Who controls.
    pub(crate) fn controller(&self) -> Controller {
        self.seats().controller
    }

    /// The state as it is told, alone.
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

/// Who controls.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) enum Controller {
    /// Whoever asks first.
    #[default]
    Nobody,
    /// The page of this connection.
    Page(u64),
    /// A program, by `/api/control`, until a page takes control.
    Program,
}

/// Who is connected, and the state that tells it.
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

    /// Fills in who is connected, and tells all.
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
    // Our own types: string keys, and numbers that JSON lacks become null.
    serde_json::to_string(message).unwrap_or_default().into()
}
