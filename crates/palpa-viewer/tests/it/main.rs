//! The viewer's wire and server.
#![expect(
    clippy::unwrap_used,
    clippy::float_cmp,
    reason = "a test that cannot go on has failed; numbers are repeated here, not computed"
)]

mod control;
mod fuzz;
mod generated;
mod guard;
mod http;
mod layout;
mod limits;
mod page;
mod session;
mod snapshots;
mod start;
mod upload;
