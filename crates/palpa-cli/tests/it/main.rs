//! Integration tests of the command and of what it writes.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod bench;
mod check;
mod cli;
mod export;
mod live;
mod press;
mod press_tissue;
mod verify;
mod view;
