//! The JSON Schema of the scene file, generated from the types that read it.

use serde_json::Value;

use crate::catalogue;
use crate::file::SceneFile;

/// The JSON Schema (2020-12) of a scene file: keys, kinds, descriptions with ranges and defaults.
///
/// Editors use it for completion and checks. [`Scene::load`](crate::Scene::load) checks more.
pub fn scene_schema() -> Value {
    let mut schema = schemars::schema_for!(SceneFile).to_value();
    tidy(&mut schema);
    for table in ["LayerTable", "LumpTable"] {
        let tissues = catalogue().iter().map(|tissue| tissue.name.as_str());
        schema["$defs"][table]["properties"]["tissue"]["examples"] = tissues.collect();
    }
    schema
}

/// Removes `null` from every choice (TOML has no null; an optional key is left out), and the line
/// breaks of the source from the descriptions.
fn tidy(schema: &mut Value) {
    match schema {
        Value::Object(object) => {
            if let Some(Value::Array(types)) = object.get_mut("type") {
                types.retain(|kind| kind != "null");
                if let [one] = types.as_slice() {
                    object["type"] = one.clone();
                }
            }
            if let Some(Value::Array(choices)) = object.get_mut("anyOf") {
                choices.retain(|choice| choice["type"] != "null");
                if let [one] = choices.as_slice() {
                    let one = one.clone();
                    object.remove("anyOf");
                    if let Value::Object(one) = one {
                        object.extend(one);
                    }
                }
            }
            if let Some(Value::String(text)) = object.get_mut("description") {
                let paragraphs: Vec<_> = text.split("\n\n").map(|p| p.replace('\n', " ")).collect();
                *text = paragraphs.join("\n\n");
            }
            object.values_mut().for_each(tidy);
        }
        Value::Array(items) => items.iter_mut().for_each(tidy),
        _ => {}
    }
}
