//! The committed JSON Schema is the one that the types give.

use palpa_scene::scene_schema;
use serde_json::Value;

/// `PALPA_BLESS=1 cargo test -p palpa-scene schema` writes the file anew.
#[test]
fn the_committed_schema_is_up_to_date() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/schema/scene.schema.json");
    let made = serde_json::to_string_pretty(&scene_schema()).unwrap() + "\n";
    if std::env::var_os("PALPA_BLESS").is_some() {
        std::fs::write(path, &made).unwrap();
    }
    let committed = std::fs::read_to_string(path).unwrap();
    assert!(
        committed == made,
        "schema/scene.schema.json is out of date; run `PALPA_BLESS=1 cargo test -p palpa-scene schema`"
    );
}

/// Every key is described, no table takes unknown keys, and nothing may be null (TOML has none).
#[test]
fn every_key_is_described() {
    let schema = scene_schema();
    let mut n_keys = 0;
    let mut tables = vec![&schema];
    tables.extend(schema["$defs"].as_object().unwrap().values());
    for table in tables {
        let Some(keys) = table["properties"].as_object() else {
            continue;
        };
        assert_eq!(
            table["additionalProperties"],
            Value::Bool(false),
            "{}",
            table["title"]
        );
        for (key, value) in keys {
            assert!(value["description"].is_string(), "{key} is not described");
            n_keys += 1;
        }
    }
    assert!(n_keys > 40, "{n_keys} keys");
    assert!(!schema.to_string().contains("\"null\""));
}
