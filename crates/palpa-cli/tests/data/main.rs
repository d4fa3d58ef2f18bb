//! Tests on measured and awkward data, which are not part of this repository, and with CalculiX.
//!
//! `PALPA_SHARED` names the folder that holds them as `data/…`; without it, these tests say that they are skipped.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod awkward;
mod bench;
mod ccx;
mod faults;
mod lump_stroke;
mod manifest;
mod mesh_moves;
mod moving;
mod real;
mod stable;
mod verify;

use std::path::PathBuf;

/// The folder of data, if there is one.
fn data() -> Option<PathBuf> {
    let folder = std::env::var_os("PALPA_SHARED").map(|shared| PathBuf::from(shared).join("data"));
    if folder.is_none() {
        println!("skipped: PALPA_SHARED is not set");
    }
    folder
}
