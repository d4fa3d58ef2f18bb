//! Tests on measured and awkward data, which are not part of this repository, and with CalculiX:
//! `make test-data`.
//!
//! `PALPA_SHARED` names the folder that holds them as `data/…` and `reference/…`. A test whose data
//! or program is not there fails.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod awkward;
mod bars;
mod bench;
mod ccx;
mod manifest;
mod real;
mod thickness;
mod verify;

use std::path::PathBuf;

/// A folder of shared data that must be there.
fn shared(name: &str) -> PathBuf {
    let Some(shared) = std::env::var_os("PALPA_SHARED") else {
        panic!(
            "PALPA_SHARED is not set: run `make test-data SHARED=FOLDER`, whose FOLDER has {name}/"
        );
    };
    let folder = PathBuf::from(shared).join(name);
    assert!(folder.is_dir(), "{} is not there", folder.display());
    folder
}

/// Meshes.
fn data() -> PathBuf {
    shared("data")
}

/// Tables of other codes.
fn reference() -> PathBuf {
    shared("reference")
}
