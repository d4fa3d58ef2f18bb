//! What the viewer's page and the engine tell each other, and the web server between them.
//!
//! ```text
//!  session (palpa) ── snapshots (bytes, latest wins), messages (JSON) ──► Server ──► pages (WebSocket)
//!                  ◄── requests (JSON), of the page that controls ──────┘
//! ```
//! A page that is slow misses snapshots; it never holds the session, and the session never waits for a page.

mod api_page;
mod board;
mod client;
mod connections;
pub mod control;
mod guard;
mod host;
mod hub;
mod limits;
mod metrics;
pub mod openapi;
mod page;
mod routes;
mod server;
pub mod wire;

pub use board::Publisher;
pub use host::{Answer, Clients, Host, HostFile};
pub use server::{Server, ServerError, ServerParams};
