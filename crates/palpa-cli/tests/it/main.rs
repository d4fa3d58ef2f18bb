//! Integration tests of the command and its files, and of force while the mesh moves.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod bench;
mod check;
mod cli;
mod error_bars;
mod export;
mod live;
mod mesh_moves;
mod press;
mod press_tissue;
mod scenes;
mod verify;
mod view;

use palpa_testkit::Bench;

/// The command in an empty folder of its own.
fn palpa() -> Bench {
    Bench::new(env!("CARGO_BIN_EXE_palpa"))
}
