//! Integration tests of charts, sections and files.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod output;
mod plot;
mod section;
mod vtu;

use std::path::PathBuf;

use palpa_plot::output::OutDir;

/// A folder under the target folder for results that people and the Python checks look at after the
/// tests.
fn results(name: &str) -> OutDir {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("results");
    OutDir::create(path.join(name)).unwrap()
}
