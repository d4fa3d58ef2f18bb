//! A scene as JSON, and edits of it. Keys, units and errors are those of a scene file.

use std::path::Path;

use anyhow::{Context as _, bail};
use palpa_scene::{Scene, SceneError};
use palpa_viewer::control::Edit;
use serde_json::{Map, Value};

/// Longest list that an edit may make.
const MOST_ITEMS: usize = 100;

/// The scene as JSON, with every default written out.
///
/// # Errors
/// Never for a scene that was read. A scene made by a program may hold values that TOML cannot
/// express.
pub(crate) fn to_json(scene: &Scene) -> anyhow::Result<Value> {
    as_json(&scene.to_toml_in_full())
}

fn as_json(text: &str) -> anyhow::Result<Value> {
    let table: toml::Value = toml::from_str(text)?;
    Ok(serde_json::to_value(table)?)
}

/// The scene after all edits, in order.
///
/// # Errors
/// When the path of an edit does not exist, or the edited scene is not valid.
pub(crate) fn edited(scene: &Scene, edits: &[Edit]) -> anyhow::Result<Scene> {
    let in_full = to_json(scene)?;
    let mut value = in_full.clone();
    for edit in edits {
        apply(&mut value, edit).with_context(|| format!("edit of \"{}\"", edit.path))?;
    }
    name_again(&mut value, &in_full, &as_json(&scene.to_toml())?);
    let text = toml::to_string(&without_nulls(value))
        .context("the edited scene cannot be written as a scene file")?;
    parsed_by_key(&text, &scene.base_dir)
}

/// The scene file for a scene given as JSON. Tissues that are the same as in `original` get their names
/// there back.
///
/// # Errors
/// When it has values that a scene file cannot have.
pub(crate) fn text_of(mut value: Value, original: Option<&Scene>) -> anyhow::Result<String> {
    if let Some(original) = original {
        name_again(
            &mut value,
            &to_json(original)?,
            &as_json(&original.to_toml())?,
        );
    }
    toml::to_string(&without_nulls(value)).context("the scene cannot be written as a scene file")
}

/// A scene from a text that no user has seen: errors name keys without lines.
///
/// # Errors
/// When the text is not a valid scene.
pub(crate) fn parsed_by_key(text: &str, base: &Path) -> anyhow::Result<Scene> {
    Ok(Scene::parse(text, base).map_err(SceneError::by_key)?)
}

/// Puts the catalogue's names back for tissues that no edit has changed, so that their sources are
/// known again.
fn name_again(value: &mut Value, in_full: &Value, named: &Value) {
    for list in ["layer", "lump"] {
        if !value[list].is_array() {
            continue;
        }
        let tissues = |scene: &Value| -> Vec<Value> {
            let items = scene[list].as_array().map_or(&[][..], Vec::as_slice);
            items.iter().map(|item| item["tissue"].clone()).collect()
        };
        let before: Vec<_> = tissues(in_full).into_iter().zip(tissues(named)).collect();
        for item in value[list].as_array_mut().into_iter().flatten() {
            let same = before.iter().find(|(full, _)| *full == item["tissue"]);
            if let (Some((_, name)), Some(item)) = (same, item.as_object_mut()) {
                item.insert("tissue".to_owned(), name.clone());
            }
        }
    }
}

/// A scene from the text of a scene file.
///
/// # Errors
/// When the text is not a valid scene.
pub(crate) fn parsed(text: &str, base: &Path) -> anyhow::Result<Scene> {
    Ok(Scene::parse(text, base)?)
}

fn apply(scene: &mut Value, edit: &Edit) -> anyhow::Result<()> {
    let Some(path) = edit.path.strip_prefix('/') else {
        bail!("a path begins with \"/\", as \"/layer/1/tissue/young\"");
    };
    let keys: Vec<String> = path
        .split('/')
        .map(|key| key.replace("~1", "/").replace("~0", "~"))
        .collect();
    let (last, parents) = keys.split_last().context("the path is empty")?;
    let mut at = scene;
    for (key, child) in parents.iter().zip(&keys[1..]) {
        at = match at {
            Value::Object(table) => {
                let next = table.entry(key.as_str()).or_insert(Value::Null);
                if next.is_null() {
                    *next = if child == "-" {
                        Value::Array(Vec::new())
                    } else {
                        Value::Object(Map::new())
                    };
                }
                next
            }
            Value::Array(list) => {
                let n = list.len();
                let found = key.parse::<usize>().ok().and_then(|i| list.get_mut(i));
                found.with_context(|| format!("there is no item {key} among {n}"))?
            }
            _ => bail!("\"{key}\" is inside a value that has no keys"),
        };
    }
    put(at, last, edit.value.clone())
}

fn put(at: &mut Value, key: &str, value: Value) -> anyhow::Result<()> {
    match at {
        Value::Object(table) => {
            if value.is_null() {
                table.remove(key);
            } else {
                table.insert(key.to_owned(), value);
            }
        }
        Value::Array(list) if key == "-" => {
            if list.len() >= MOST_ITEMS {
                bail!("there are {MOST_ITEMS} already");
            }
            list.push(value);
        }
        Value::Array(list) => {
            let n = list.len();
            let i = key.parse::<usize>().ok().filter(|&i| i < n);
            let i = i.with_context(|| format!("there is no item {key} among {n}"))?;
            if value.is_null() {
                list.remove(i);
            } else {
                list[i] = value;
            }
        }
        _ => bail!("\"{key}\" is inside a value that has no keys"),
    }
    Ok(())
}

/// The value without its nulls, which TOML does not have.
fn without_nulls(value: Value) -> Value {
    match value {
        Value::Object(table) => Value::Object(
            table
                .into_iter()
                .filter(|(_, v)| !v.is_null())
                .map(|(k, v)| (k, without_nulls(v)))
                .collect(),
        ),
        Value::Array(list) => Value::Array(list.into_iter().map(without_nulls).collect()),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn edit(path: &str, value: Value) -> Edit {
        Edit {
            path: path.to_owned(),
            value,
        }
    }

    #[test]
    fn a_modulus_of_a_tissue_of_the_catalogue_can_be_changed() {
        let scene = Scene::embedded();
        let softer = edited(&scene, &[edit("/layer/0/tissue/young", json!("50 kPa"))]).unwrap();
        assert!((softer.layers[0].tissue.young().unwrap() - 50e3).abs() < 1e-9);
        assert_eq!(softer.layers[1..], scene.layers[1..]);
    }

    #[test]
    fn lumps_come_and_go() {
        let scene = Scene::embedded();
        let lump = json!({ "name": "a", "shape": "sphere", "radius": "5 mm", "below": ["120 mm", "0 mm", "40 mm"],
            "depth": "12 mm", "tissue": "fibrous lump" });
        let one = edited(&scene, &[edit("/lump/-", lump.clone())]).unwrap();
        let two = edited(
            &one,
            &[edit("/lump/-", lump), edit("/lump/1/name", json!("b"))],
        )
        .unwrap();
        assert_eq!(two.lumps.len(), 2);
        let left = edited(&two, &[edit("/lump/0", Value::Null)]).unwrap();
        assert_eq!(left.lumps[0].name, "b");
    }

    #[test]
    fn what_leads_nowhere_or_is_no_scene_is_refused_in_words() {
        let scene = Scene::embedded();
        let words = |path: &str, value: Value| {
            let error = edited(&scene, &[edit(path, value)]).unwrap_err();
            palpa::one_paragraph(&error)
        };
        assert!(words("layer", json!(1)).contains("begins with"));
        assert!(words("/layer/9/levels", json!(1)).contains("no item 9"));
        assert!(words("/layer/0/levels/x", json!(1)).contains("has no keys"));
        let apples = words("/layer/0/tissue/young", json!("12 apples"));
        assert!(
            apples.contains("apples") && apples.contains("scene: layer[0]"),
            "{apples}"
        );
        assert!(words("/nonsense", json!(1)).contains("nonsense"));
    }
}
