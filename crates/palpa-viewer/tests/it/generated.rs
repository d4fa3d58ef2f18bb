//! What the page is made from is what the types say.

use palpa_viewer::{openapi, wire};
use std::{fs, path::PathBuf};

/// Compares a file of `web/src/generated` with what it shall be, or writes it with `PALPA_BLESS=1`.
fn is_up_to_date(name: &str, text: &str) {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../../web/src/generated")
        .join(name);
    if std::env::var_os("PALPA_BLESS").is_some() {
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, text).unwrap();
    }
    let there = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        there == text,
        "{name} is out of date; make it anew: PALPA_BLESS=1 cargo test -p palpa-viewer, then npm run generate in web/"
    );
}

#[test]
fn the_reader_of_snapshots() {
    is_up_to_date("wire.ts", &wire::typescript());
}

#[test]
fn the_document_of_the_control_api() {
    let text = serde_json::to_string_pretty(&openapi::document()).unwrap();
    is_up_to_date("openapi.json", &(text + "\n"));
}
