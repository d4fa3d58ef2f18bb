//! A viewer's session: the body that users press and see through the viewer's server.
//!
//! ```text
//!  server ── requests ──► remote ── orders ──► session (thread, 60 Hz) ──► desk
//!
//!   desk ┬─► history   the scenes that were wanted, for undo and redo
//!        ├─► own       users' files: check, template, ZIP, temporary folders
//!        ├─► builder   the body of the wanted scene, built on a thread of its own
//!        ├─► stage     the body under the hand and its engine:  world ──► engine ──► device
//!        │     └ hand  who leads the tool, and its way:         hand ───► device
//!        ├─► replay    the recording, and what is shown of it
//!        ├─► game      find the lump;  veil: what pages may not see meanwhile
//!        ├─► bars      error bars of the force, computed on a thread of their own
//!        ├─► drill     faults on purpose
//!        └─► publish   frames, meshes, fields, state, figures, notices ──► server
//! ```
//! The session's thread never waits. Bodies, fields and error bars are computed on threads of their own, and a
//! file is written on the server's thread that requested it.

mod bars;
mod builder;
mod desk;
mod drill;
mod edit;
mod gallery;
mod game;
mod hand;
mod history;
mod own;
mod palpation;
mod publish;
mod remote;
mod replay;
mod session;
mod spectrum;
mod stage;
mod veil;
mod world;

pub use remote::Remote;
pub use session::{Handle, Session, SessionParams};
