//! What a wrong scene is told: the place, what was found, what is allowed and what to do.

use std::fmt::Write;
use std::path::Path;

use palpa_tissue::{Scene, SceneError};

/// A valid scene; each case below replaces one piece of it.
const SCENE: &str = r#"[body]
surface = "skin.ply"
bones = ["ulna.ply"]
cutout_radius = "60 mm"
cutout_at = ["120 mm", "0 mm", "40 mm"]

[[layer]]
tissue = { young = "12 kPa", poisson = 0.45, density = "1060 kg/m³" }
thickness = "1.5 mm"
levels = 2
min_thickness = "0.3 mm"

[[layer]]
tissue = "fat"
thickness = { axis = "x", table = [["50 mm", "1.2 mm"], ["200 mm", "1.5 mm"]] }

[[layer]]
tissue = "muscle"

[tool]
radius = "8 mm"

[press]
at = ["120 mm", "0 mm", "40 mm"]
direction = [0, 0, -1]
depth = "8 mm"
speed = "10 mm/s"
hold = "0.5 s"
step = "0.25 mm"

[reference]
substeps = 4
solver = "sparse"
spring_gain = 0.5
"#;

fn refusal(text: &str) -> SceneError {
    match Scene::parse(text, Path::new("")) {
        Err(error) => error,
        Ok(scene) => panic!("this scene is taken:\n{text}\nas {scene:?}"),
    }
}

/// The messages for `SCENE` with each `old` replaced by its `new`.
fn refusals(cases: &[(&str, &str)]) -> String {
    let mut said = String::new();
    for (old, new) in cases {
        assert_eq!(
            SCENE.matches(old).count(),
            1,
            "{old} stands once in the scene"
        );
        let error = refusal(&SCENE.replace(old, new));
        writeln!(said, "{}\n    {error}", new.trim()).unwrap();
    }
    said
}

#[test]
fn the_scene_itself_is_valid() {
    Scene::parse(SCENE, Path::new("")).unwrap();
}

#[test]
fn every_range() {
    let said = refusals(&[
        ("cutout_radius = \"60 mm\"", "cutout_radius = \"60 m\""),
        ("cutout_at = [\"120 mm\"", "cutout_at = [\"120 m\""),
        ("young = \"12 kPa\"", "young = \"0 kPa\""),
        ("young = \"12 kPa\"", "young = \"-12 kPa\""),
        ("young = \"12 kPa\"", "young = \"12 GPa\""),
        ("poisson = 0.45", "poisson = 0.5"),
        ("poisson = 0.45", "poisson = -0.1"),
        ("poisson = 0.45", "poisson = nan"),
        (
            "young = \"12 kPa\", poisson = 0.45",
            "spring = \"0 dyn/cm\"",
        ),
        (
            "young = \"12 kPa\", poisson = 0.45",
            "spring = \"-90 dyn/cm\"",
        ),
        (
            "young = \"12 kPa\", poisson = 0.45",
            "spring = \"1e9 kN/m\"",
        ),
        ("density = \"1060 kg/m³\"", "density = \"1 kg/m³\""),
        ("thickness = \"1.5 mm\"", "thickness = \"1.5 m\""),
        ("thickness = \"1.5 mm\"", "thickness = \"0 mm\""),
        ("thickness = \"1.5 mm\"", "thickness = \"-3 mm\""),
        ("levels = 2", "levels = 0"),
        ("levels = 2", "levels = 65"),
        ("min_thickness = \"0.3 mm\"", "min_thickness = \"0 mm\""),
        ("[\"50 mm\", \"1.2 mm\"]", "[\"50 m\", \"1.2 mm\"]"),
        ("[\"50 mm\", \"1.2 mm\"]", "[\"50 mm\", \"1.2 m\"]"),
        ("radius = \"8 mm\"", "radius = \"8 m\""),
        (
            "at = [\"120 mm\", \"0 mm\", \"40 mm\"]\ndirection",
            "at = [\"120 mm\", \"0 mm\", \"40 km\"]\ndirection",
        ),
        ("depth = \"8 mm\"", "depth = \"8 m\""),
        ("speed = \"10 mm/s\"", "speed = \"10 m/s\""),
        ("hold = \"0.5 s\"", "hold = \"-1 s\""),
        ("hold = \"0.5 s\"", "hold = \"1 h\""),
        ("step = \"0.25 mm\"", "step = \"0 mm\""),
        ("substeps = 4", "substeps = 0"),
        ("substeps = 4", "substeps = 2000"),
        ("spring_gain = 0.5", "spring_gain = 1.5"),
        ("spring_gain = 0.5", "shape_gain = -0.5"),
    ]);
    insta::assert_snapshot!(said);
}

#[test]
fn every_range_of_a_generator() {
    let mut said = String::new();
    for generator in [
        "kind = \"block\", spacing = \"0.1 mm\"",
        "kind = \"block\", size = [\"100 mm\", \"100 m\", \"40 mm\"]",
        "kind = \"block\", size = [\"2 m\", \"2 m\", \"40 mm\"], spacing = \"2 mm\"",
        "kind = \"block\", size = [\"20 mm\", \"20 mm\", \"40 mm\"], spacing = \"30 mm\"",
        "kind = \"block\", radius = \"30 mm\"",
        "kind = \"cylinder\", length = \"0 mm\"",
        "kind = \"cylinder\", radius = \"3 m\"",
        "kind = \"cylinder\", bone_radius = \"0 mm\"",
        "kind = \"cylinder\", radius = \"30 mm\", bone_radius = \"30 mm\"",
        "kind = \"cylinder\", size = [\"100 mm\", \"100 mm\", \"40 mm\"]",
        "kind = \"cylinder\", scale = 1",
        "kind = \"forearm\", scale = 10",
        "kind = \"forearm\", scale = inf",
        "kind = \"fore arm\"",
        "kind = \"cylinder\" }\n[press]\ndepth = \"30 mm\"\n#",
        "spacing = \"5 mm\"",
        "kind = \"forearm\" }\nbones = [\"ulna.ply\"]\n#",
        "kind = \"forearm\" }\nsurface = \"skin.ply\"\n#",
    ] {
        let text = format!("[body]\ngenerator = {{ {generator} }}\n[[layer]]\ntissue = \"fat\"\n");
        writeln!(said, "{generator}\n    {}", refusal(&text)).unwrap();
    }
    insta::assert_snapshot!(said);
}

#[test]
fn wrong_kinds_and_words() {
    let said = refusals(&[
        ("thickness = \"1.5 mm\"", "thickness = 1.5"),
        ("thickness = \"1.5 mm\"", "thickness = \"12\""),
        ("thickness = \"1.5 mm\"", "thickness = \"12 kg\""),
        ("thickness = \"1.5 mm\"", "thickness = \"nan mm\""),
        ("thickness = \"1.5 mm\"", "thickness = \"1e400 m\""),
        ("thickness = \"1.5 mm\"", "thickness = [\"1 mm\"]"),
        ("thickness = \"1.5 mm\"", "thicknes = \"1.5 mm\""),
        ("min_thickness = \"0.3 mm\"", "min_thickness = 3"),
        ("tissue = \"fat\"", "tissue = \"fatt\""),
        ("tissue = \"fat\"", "tissue = \"granite\""),
        ("tissue = \"fat\"", "tissue = 3"),
        ("tissue = \"fat\"", "thickness_source = \"ultrasound\""),
        ("young = \"12 kPa\"", "young = 12000"),
        ("young = \"12 kPa\"", "youngs = \"12 kPa\""),
        ("axis = \"x\"", "axis = \"w\""),
        ("axis = \"x\"", "axis = [1, 0]"),
        ("axis = \"x\"", "axis = [0, 0, 0]"),
        ("direction = [0, 0, -1]", "direction = [0, 0, 0.0]"),
        ("direction = [0, 0, -1]", "direction = [0, nan, 1]"),
        ("direction = [0, 0, -1]", "direction = \"down\""),
        ("levels = 2", "levels = -1"),
        ("levels = 2", "levels = 2.5"),
        ("solver = \"sparse\"", "solver = \"spars\""),
        ("surface = \"skin.ply\"", "surface = \"\""),
        (
            "surface = \"skin.ply\"",
            "surface = \"skin.ply\"\nunit = \"yard\"",
        ),
        ("[tool]", "[tools]"),
        ("[press]", "[press"),
        ("hold = \"0.5 s\"", "hold = 0.5 s"),
        ("hold = \"0.5 s\"", "hold = \"0.5 s\"\nhold = \"0.5 s\""),
        (
            "[[layer]]\ntissue = \"muscle\"",
            "[layer]\ntissue = \"muscle\"",
        ),
    ]);
    insta::assert_snapshot!(said);
}

#[test]
fn what_does_not_go_together() {
    let said = refusals(&[
        ("direction = [0, 0, -1]", "vertex = 812"),
        ("thickness = \"1.5 mm\"\n", ""),
        ("surface = \"skin.ply\"\n", ""),
        ("bones = [\"ulna.ply\"]\n", ""),
        ("cutout_radius = \"60 mm\"\n", ""),
        (
            "young = \"12 kPa\"",
            "young = \"12 kPa\", spring = \"1 N/m\"",
        ),
        ("young = \"12 kPa\"", "spring = \"1 N/m\""),
        ("young = \"12 kPa\", poisson = 0.45, ", ""),
        ("min_thickness = \"0.3 mm\"", "min_thickness = \"3 mm\""),
        ("axis = \"x\", ", ""),
        ("axis = \"x\"", "file = \"fat.csv\", axis = \"x\""),
        ("[\"50 mm\", \"1.2 mm\"]", "[\"500 mm\", \"1.2 mm\"]"),
        ("[[\"50 mm\", \"1.2 mm\"], [\"200 mm\", \"1.5 mm\"]]", "[]"),
        ("radius = \"8 mm\"", "radius = \"8 mm\"\nshape = \"node\""),
        ("step = \"0.25 mm\"", "step = \"9 mm\""),
        ("step = \"0.25 mm\"", "step = \"1 um\""),
    ]);
    insta::assert_snapshot!(said);
}

#[test]
fn what_the_body_has_no_room_for() {
    let mut said = String::new();
    for rest in [
        "surface = \"s.ply\"\n",
        "surface = \"s.ply\"\n[[layer]]\ntissue = \"fat\"\nthickness = \"5 mm\"\n",
        "surface = \"s.ply\"\ncutout_radius = \"60 mm\"\n[[layer]]\ntissue = \"fat\"\nthickness = \"50 mm\"\n",
        "generator = { kind = \"block\" }\n[[layer]]\ntissue = \"fat\"\nthickness = \"50 mm\"\n",
        "generator = { kind = \"block\" }\n[[layer]]\ntissue = \"fat\"\nthickness = \"40 mm\"\n[[layer]]\ntissue = \"skin\"\n",
        "generator = { kind = \"block\" }\n[[layer]]\ntissue = \"fat\"\n[press]\ndepth = \"40 mm\"\n",
    ] {
        let text = format!("[body]\n{rest}");
        writeln!(said, "{rest}    {}", refusal(&text)).unwrap();
    }
    let many = format!(
        "[body]\nsurface = \"s.ply\"\n{}",
        "[[layer]]\ntissue = \"fat\"\nthickness = \"1 mm\"\n".repeat(33)
    );
    writeln!(said, "33 layers\n    {}", refusal(&many)).unwrap();
    let deep = format!(
        "[body]\nsurface = \"s.ply\"\n{}",
        "[[layer]]\ntissue = \"fat\"\nthickness = \"9 mm\"\nlevels = 64\n".repeat(5)
    );
    writeln!(said, "320 levels\n    {}", refusal(&deep)).unwrap();
    let bones = format!(
        "[body]\nsurface = \"s.ply\"\nbones = [{}]\n[[layer]]\ntissue = \"fat\"\n",
        "\"b.ply\", ".repeat(65)
    );
    writeln!(said, "65 bones\n    {}", refusal(&bones)).unwrap();
    insta::assert_snapshot!(said);
}

#[test]
fn a_file_that_is_no_scene_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let load = |path: &Path| {
        let error = Scene::load(path).unwrap_err().to_string();
        error.replace(&folder.path().display().to_string(), "scenes")
    };
    let path = folder.path().join("scene.toml");
    let missing = load(&path);
    assert!(
        missing.starts_with("scenes/scene.toml: cannot be read: "),
        "{missing}"
    );
    let is_folder = load(folder.path());
    assert!(
        is_folder.starts_with("scenes: cannot be read: "),
        "{is_folder}"
    );

    let mut said = String::new();
    std::fs::write(&path, SCENE.replace("1.5 mm\"\nlevels", "15 m\"\nlevels")).unwrap();
    writeln!(said, "{}", load(&path)).unwrap();
    std::fs::write(&path, b"[body]\nsurface = \"\xff.ply\"").unwrap();
    writeln!(said, "{}", load(&path)).unwrap();
    std::fs::write(&path, vec![b'#'; (1 << 20) + 1]).unwrap();
    writeln!(said, "{}", load(&path)).unwrap();
    std::fs::write(&path, "").unwrap();
    writeln!(said, "{}", load(&path)).unwrap();
    let one_layer = "[body]\nsurface = \"s.ply\"\n[layer]\ntissue = \"fat\"";
    std::fs::write(&path, one_layer).unwrap();
    writeln!(said, "{}", load(&path)).unwrap();
    insta::assert_snapshot!(said);
}

/// The fields say the same as the message, for programs.
#[test]
fn an_error_carries_its_place() {
    let error = refusal(&SCENE.replace("\"1.5 mm\"\nlevels", "\"0 mm\"\nlevels"));
    let SceneError::OutOfRange {
        place,
        found,
        allowed,
    } = error
    else {
        panic!("{error}")
    };
    assert_eq!(
        (place.line, place.column, place.key.as_str()),
        (9, 13, "layer[0].thickness")
    );
    assert_eq!(
        (found.as_str(), allowed.as_str()),
        ("\"0 mm\"", "10 µm to 500 mm")
    );
}
