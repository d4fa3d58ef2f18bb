//! A body under the hand of whoever looks at it: engine, hand, recording and game behind the viewer's server.
//!
//! ```text
//!  server ── requests ──► Remote ── orders ──► session thread, 60 Hz ──► hand ──► device of the engine
//!         ◄── snapshots, state, figures ──────┘    ▲ looks at the body, ticks ◄── engine
//! ```
//! The thread of the session waits for nobody: scenes are built on threads of their own while the body before is still there,
//! fields over the body are computed beside it, files are put together by who asks for them.

pub mod edit;
mod fields;
mod figures;
mod frame;
pub mod gallery;
mod game;
pub mod hand;
mod notes;
mod recording;
mod remote;
mod run;
pub mod world;

pub use remote::Remote;
pub use run::{Handle, Session, SessionParams};
