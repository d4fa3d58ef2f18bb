//! The messages between the viewer's page and the engine, and the web server that carries them.
//!
//! ```text
//!  session (palpa) ── snapshots (bytes, latest wins), messages (JSON) ──► Server ──► pages (WebSocket)
//!                  ◄── requests (JSON), of the page that controls ──────┘
//! ```
//! A slow page misses snapshots. It never delays the session, and the session never waits for a
//! page.
//!
//! ```
//! use palpa_scene::LengthUnit;
//! use palpa_viewer::{Answer, Clients, Host, HostFile, Server, ServerParams};
//! use palpa_viewer::{control::{Request, Uploaded}, wire::FrameSnapshot};
//! use std::{net::Ipv4Addr, sync::Arc};
//!
//! /// A session that says yes to all, and shows nothing.
//! struct Yes;
//! impl Host for Yes {
//!     fn request(&self, _: Request, answer: Answer) {
//!         answer(Ok(()));
//!     }
//!     fn clients(&self, _: Clients) {}
//!     fn file(&self, _: HostFile) -> Result<Option<Vec<u8>>, String> {
//!         Ok(None)
//!     }
//!     fn upload(&self, _: &str, _: Vec<u8>) -> Result<Uploaded, String> {
//!         Err("no files are taken here".to_owned())
//!     }
//!     fn check_uploaded(&self, _: u32, _: LengthUnit) -> Option<Uploaded> {
//!         None
//!     }
//!     fn uploaded_mesh(&self, _: u32) -> Option<Vec<u8>> {
//!         None
//!     }
//!     fn problem(&self) -> Option<String> {
//!         None
//!     }
//! }
//!
//! let params = ServerParams { bind: Ipv4Addr::LOCALHOST.into(), port: 0, token: None };
//! let server = Server::start(&params, Arc::new(Yes))?;
//! assert!(server.url().starts_with("http://127.0.0.1:"));
//! server.publisher().frame(1, FrameSnapshot::default().encode());
//! # Ok::<(), palpa_viewer::ServerError>(())
//! ```

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
mod upload;
pub mod wire;

pub use board::Publisher;
pub use host::{Answer, Clients, Host, HostFile};
pub use server::{Server, ServerError, ServerParams};
