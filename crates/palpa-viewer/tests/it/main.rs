//! The viewer's wire and server.

mod generated;
