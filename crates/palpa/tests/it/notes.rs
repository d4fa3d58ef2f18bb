//! The committed JSON Schema of notes, from which the page's types are made, is the one that the
//! types give.

use palpa::note_schema;

/// `PALPA_BLESS=1 cargo test -p palpa notes` writes the file anew; then `npm run generate` in web/.
#[test]
fn the_committed_schema_is_up_to_date() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/schema/note.schema.json");
    let made = serde_json::to_string_pretty(&note_schema()).unwrap() + "\n";
    if std::env::var_os("PALPA_BLESS").is_some() {
        std::fs::write(path, &made).unwrap();
    }
    let committed = std::fs::read_to_string(path).unwrap();
    assert!(
        committed == made,
        "schema/note.schema.json is out of date; run `PALPA_BLESS=1 cargo test -p palpa notes`"
    );
}
