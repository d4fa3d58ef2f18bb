//! Integration tests of the command and of what it writes.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod bench;
mod check;
mod cli;
mod export;
mod live;
mod output;
mod plot;
mod press;
mod press_tissue;
mod section;
mod verify;
mod view;
mod vtu;

use std::path::PathBuf;

use palpa::output::OutDir;

/// A folder under the target folder for results that people and the Python checks look at after the tests.
fn results(name: &str) -> OutDir {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("results");
    OutDir::create(path.join(name)).unwrap()
}
