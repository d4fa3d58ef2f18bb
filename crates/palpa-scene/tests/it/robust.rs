//! Whatever is given for a scene is understood or refused, within bounds of time and memory.

use std::path::Path;

use palpa_scene::built_in::PRESSED;
use palpa_scene::{BuiltIn, Scene, SceneError};
use proptest::prelude::*;

fn parse(text: &str) -> Result<Scene, SceneError> {
    Scene::parse(text, Path::new(""))
}

/// A scene near a valid one: tokens of scenes in any order and place.
fn near_scenes() -> impl Strategy<Value = String> {
    let tokens = prop::sample::select(vec![
        "[body]\n",
        "[[layer]]\n",
        "[layer]\n",
        "[tool]\n",
        "[[lump]]\n",
        "[model]\n",
        "[mesh]\n",
        "[layer.tissue.prony]\n",
        "[press]\n",
        "[reference]\n",
        "surface = ",
        "generator = ",
        "bones = ",
        "unit = ",
        "thickness = ",
        "tissue = ",
        "levels = ",
        "at = ",
        "vertex = ",
        "direction = ",
        "axis = ",
        "table = ",
        "kind = ",
        "size = ",
        "shape = ",
        "radius = ",
        "young = ",
        "law = ",
        "terms = ",
        "prony = ",
        "bulk = ",
        "depth = ",
        "speeds = ",
        "dynamics = ",
        "spring = ",
        "solver = ",
        "\"block\"",
        "\"fat\"",
        "\"ogden\"",
        "{ mu = \"4 kPa\", alpha = 10 }",
        "{ g = 0.4, tau = \"1 s\" }",
        "\"implicit\"",
        "\"1 mm\"",
        "\"12 kPa\"",
        "\"x\"",
        "[",
        "]",
        "{",
        "}",
        ", ",
        "\n",
        "1",
        "-1e999",
        "nan",
        "inf",
        "9223372036854775808",
        "true",
        "[[\"1 mm\", \"2 mm\"]]",
        "[0, 0, 1]",
        "'''",
        "\"\\u0000\"",
        "ü",
        "\u{0}",
    ]);
    prop::collection::vec(tokens, 0..60).prop_map(|tokens| tokens.concat())
}

/// A valid scene with one piece of it replaced.
fn damaged_scenes() -> impl Strategy<Value = String> {
    let texts = prop::sample::select(vec![
        include_str!("scenes/limb.toml"),
        include_str!("scenes/thesis.toml"),
        include_str!("scenes/everything.toml"),
        BuiltIn::find(PRESSED).unwrap().toml,
    ]);
    (texts, any::<prop::sample::Index>(), 0usize..12, ".{0,8}").prop_map(|(text, at, n, new)| {
        let mut chars: Vec<char> = text.chars().collect();
        let start = at.index(chars.len());
        let end = (start + n).min(chars.len());
        chars.splice(start..end, new.chars());
        chars.into_iter().collect()
    })
}

proptest! {
    #[test]
    fn no_text_makes_it_panic(text in any::<String>()) {
        let _ = parse(&text);
    }

    #[test]
    fn no_heap_of_tokens_makes_it_panic(text in near_scenes()) {
        if let Err(error) = parse(&text) {
            prop_assert!(error.to_string().len() < 2000);
        }
    }

    #[test]
    fn a_damaged_scene_is_refused_in_a_paragraph_or_survives_a_round_trip(text in damaged_scenes()) {
        match parse(&text) {
            Err(error) => {
                let error = error.to_string();
                prop_assert!(error.starts_with("scene"), "{}", error);
                prop_assert!(error.len() < 2000 && !error.contains('\n'), "{}", error);
            }
            Ok(scene) => prop_assert_eq!(parse(&scene.to_toml()).unwrap(), scene),
        }
    }

    #[test]
    fn no_bytes_in_a_file_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.toml");
        std::fs::write(&path, bytes).unwrap();
        prop_assert!(Scene::load(&path).is_err());
    }
}

#[test]
fn deep_nesting_and_long_texts_are_refused_at_once() {
    let deep = format!("a = {}", "[".repeat(500_000));
    assert!(matches!(parse(&deep), Err(SceneError::Syntax { .. })));
    let long = "#".repeat((1 << 20) + 1);
    assert!(matches!(parse(&long), Err(SceneError::TooLarge { .. })));
    let path = format!("a{} = 1", ".a".repeat(400_000));
    assert!(parse(&path).is_err());
    let layers = "[[layer]]\ntissue = \"fat\"\nthickness = \"1 mm\"\n".repeat(20_000);
    let scene = format!("[body]\nsurface = \"s.ply\"\n{layers}");
    assert!(matches!(parse(&scene), Err(SceneError::Invalid { .. })));
    let key = format!("{} = 1", "k".repeat(900_000));
    assert!(parse(&key).unwrap_err().to_string().len() < 1000);
    let value = format!(
        "[body]\nsurface = \"s\"\nunit = \"{}\"",
        "k".repeat(900_000)
    );
    assert!(parse(&value).unwrap_err().to_string().len() < 1000);
    let value = format!(
        "[body]\nsurface = \"s\"\nunit = \"m\"\ncutout_radius = \"{}\"",
        "1".repeat(900_000)
    );
    assert!(parse(&value).unwrap_err().to_string().len() < 1000);
    let value = format!(
        "[body]\nsurface = \"s\"\n[press]\ndirection = \"{}\"",
        "k".repeat(900_000)
    );
    let error = parse(&value).unwrap_err().to_string();
    assert!(
        error.len() < 1000 && error.ends_with("expected three values in brackets"),
        "{error}"
    );
}

#[test]
fn what_a_message_repeats_cannot_break_its_line() {
    for text in [
        "\"a`b\\n\" = 1",
        "[body]\nsurface = \"s\"\nunit = \"a\\nb\\u001b[31m\"",
        "[body]\nsurface = \"s\"\nunit = \"\"\"a\nb\"\"\"",
        "[body]\nsurface = \"s\"\n[[layer]]\ntissue = \"\"\"a\n\tb\"\"\"",
        "[body]\nsurface = \"s\"\n[[layer]]\ntissue = \"fat\"\nthickness = \"\"\"1\n\tmm\n\"\"\"",
        "[body]\nsurface = \"s\"\n[[layer]]\ntissue = \"fat\"\nthickness = \"\"\"\n1000 km\"\"\"",
    ] {
        let error = parse(text).unwrap_err().to_string();
        assert!(
            !error.contains(|c: char| c.is_control()),
            "{text:?}: {error:?}"
        );
    }
    let error = parse("\"a`b\" = 1").unwrap_err();
    let SceneError::Unknown { found, allowed, .. } = error else {
        panic!("{error}")
    };
    assert_eq!((found.as_str(), allowed.len()), ("a`b", 10));
}
