//! What the viewer's page and the engine tell each other, and the web server between them.
//!
//! ```text
//!  session (palpa) ── snapshots (bytes, latest wins), messages (JSON) ──► Server ──► pages (WebSocket)
//!                  ◄── requests (JSON), of the page that controls ──────┘
//! ```
//! A page that is slow misses snapshots; it never holds the session, and the session never waits for a page.

pub mod control;
pub mod openapi;
pub mod wire;
