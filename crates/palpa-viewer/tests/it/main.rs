//! The viewer's wire and server.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod generated;
