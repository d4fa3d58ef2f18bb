//! What a wrong scene is told: the place, what was found, what is allowed and what to do.

use std::fmt::Write;
use std::path::Path;

use palpa_scene::{Press, Scene, SceneError};

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

/// The messages for a scene of one layer with each of these in place of its tissue's table.
fn tissue_refusals(tables: &[&str]) -> String {
    let mut said = String::new();
    for table in tables {
        let text = format!(
            "[body]\nsurface = \"s.ply\"\n[[layer]]\nthickness = \"9 mm\"\ntissue = {{ {table} }}"
        );
        writeln!(said, "{table}\n    {}", refusal(&text)).unwrap();
    }
    said
}

#[test]
fn every_range_of_a_law() {
    let said = tissue_refusals(&[
        "shear = \"0 kPa\"",
        "c10 = \"2 GPa\"",
        "law = \"mooney-rivlin\", c10 = \"1 kPa\", c01 = \"-1 kPa\"",
        "law = \"yeoh\", c10 = \"1 kPa\", c20 = \"-2 GPa\"",
        "law = \"yeoh\", c10 = \"1 kPa\", c30 = \"-1 kPa\"",
        "law = \"ogden\", terms = []",
        "law = \"ogden\", terms = [{ mu = \"0 Pa\", alpha = 2 }]",
        "law = \"ogden\", terms = [{ mu = \"1 kPa\", alpha = 2 }, { mu = \"1 kPa\", alpha = 0 }]",
        "law = \"ogden\", terms = [{ mu = \"1 kPa\", alpha = nan }]",
        "law = \"ogden\", young = \"1 kPa\", alpha = -101",
        "law = \"fung\", young = \"1 kPa\", b = 0",
        "law = \"fung\", young = \"1 kPa\", b = -inf",
        "law = \"gent\", young = \"1 kPa\", jm = 0",
        "young = \"1 kPa\", bulk = \"0 Pa\"",
        "shear = \"1 Pa\", poisson = 0.499",
        "young = \"1 kPa\", bulk = \"2.2 GPa\"",
        "young = \"1 kPa\", bulk = \"100 Pa\"",
        "c10 = \"1 kPa\", bulk = \"1 kPa\"",
        "c10 = \"1 kPa\", bulk = \"2.2 GPa\"",
        "law = \"ogden\", terms = [{ mu = \"1 GPa\", alpha = 2 }], poisson = 0.3",
        "law = \"ogden\", young = \"1 kPa\", alpha = 2, bulk = \"10 Pa\"",
        "young = \"1 kPa\", prony = { terms = [] }",
        "young = \"1 kPa\", prony = { terms = [{ g = 0, tau = \"1 s\" }] }",
        "young = \"1 kPa\", prony = { terms = [{ g = 1, tau = \"1 s\" }] }",
        "young = \"1 kPa\", prony = { terms = [{ g = 0.5, tau = \"0 s\" }] }",
        "young = \"1 kPa\", prony = { terms = [{ g = 0.5, tau = \"1 s\" }, { g = 0.5, tau = \"2 s\" }] }",
    ]);
    insta::assert_snapshot!(said);
}

#[test]
fn what_a_law_does_not_take() {
    let said = tissue_refusals(&[
        "law = \"neo-hookian\", young = \"1 kPa\"",
        "law = \"neo-hookean\"",
        "young = \"1 kPa\", shear = \"1 kPa\"",
        "young = \"1 kPa\", c10 = \"1 kPa\"",
        "shear = \"1 kPa\", c10 = \"1 kPa\"",
        "young = \"1 kPa\", c01 = \"1 kPa\"",
        "law = \"linear\", c10 = \"1 kPa\"",
        "law = \"fung\", young = \"1 kPa\"",
        "law = \"fung\", b = 10",
        "law = \"gent\", young = \"1 kPa\"",
        "law = \"gent\", young = \"1 kPa\", b = 10",
        "law = \"mooney-rivlin\", c10 = \"1 kPa\"",
        "law = \"mooney-rivlin\", young = \"1 kPa\", c01 = \"1 kPa\"",
        "law = \"yeoh\", c10 = \"1 kPa\", c20 = \"-1 Pa\"",
        "law = \"yeoh\", c10 = \"1 kPa\", c20 = \"-2 kPa\", c30 = \"1 kPa\"",
        "law = \"ogden\", young = \"1 kPa\"",
        "law = \"ogden\", alpha = 10",
        "law = \"ogden\", terms = [{ mu = \"1 kPa\", alpha = 2 }], alpha = 3",
        "law = \"ogden\", terms = [{ mu = \"1 kPa\", alpha = 2 }], young = \"1 kPa\"",
        "law = \"ogden\", terms = [{ mu = \"1 kPa\", exponent = 2 }]",
        "young = \"1 kPa\", poisson = 0.45, bulk = \"1 MPa\"",
        "law = \"linear\", young = \"1 kPa\", volume = \"logarithmic\"",
        "young = \"1 kPa\", volume = \"log\"",
        "young = \"1 kPa\", prony = { g = 0.4, tau = \"1 s\" }",
        "young = \"1 kPa\", prony = { terms = [{ g = 0.4 }] }",
        "young = \"1 kPa\", prony = { terms = [{ g = 0.4, tau = 1 }] }",
        "young = \"1 kPa\", prony = { terms = [{ g = 0.4, tau = \"1 s\" }], moduli = \"long\" }",
        "spring = \"1 N/m\", law = \"linear\"",
        "spring = \"1 N/m\", prony = { terms = [{ g = 0.4, tau = \"1 s\" }] }",
    ]);
    insta::assert_snapshot!(said);
}

/// The refusals of a scene with one more table each.
fn refusals_of(tables: &[(&str, String)]) -> String {
    let mut said = String::new();
    for (table, keys) in tables {
        let text = format!(
            "[body]\nsurface = \"s.ply\"\n[[layer]]\nthickness = \"9 mm\"\ntissue = \"fat\"\n{table}\n{keys}"
        );
        let keys = keys.replace('\n', "; ");
        writeln!(said, "{table} {keys}\n    {}", refusal(&text)).unwrap();
    }
    said
}

#[test]
fn wrong_lumps() {
    let tissue = "tissue = \"fibrous lump\"";
    let good = format!("{tissue}\nradius = \"6 mm\"\ndepth = \"9 mm\"");
    let mut said = refusals_of(&[
        ("[[lump]]", "radius = \"6 mm\"\ndepth = \"9 mm\"".to_owned()),
        ("[[lump]]", tissue.to_owned()),
        ("[[lump]]", format!("{tissue}\nradius = \"6 mm\"")),
        ("[[lump]]", format!("{tissue}\ndepth = \"9 mm\"")),
        ("[lump]", good.clone()),
        ("[[lump]]", good.replace("6 mm", "0 mm")),
        ("[[lump]]", good.replace("9 mm", "-9 mm")),
        ("[[lump]]", good.replace("fibrous lump", "fibrous lumps")),
        (
            "[[lump]]",
            good.replace("\"fibrous lump\"", "{ spring = \"1 N/m\" }"),
        ),
        (
            "[[lump]]",
            good.replace("\"fibrous lump\"", "{ young = \"1 Pa\" }"),
        ),
        (
            "[[lump]]",
            format!("{good}\nat = [\"0 m\", \"0 m\", \"0 m\"]"),
        ),
        (
            "[[lump]]",
            format!("{good}\nbelow_vertex = 3\nbelow = [\"0 m\", \"0 m\", \"0 m\"]"),
        ),
        (
            "[[lump]]",
            format!("{tissue}\nradius = \"6 mm\"\nbelow_vertex = 3"),
        ),
        (
            "[[lump]]",
            format!("{good}\nbelow = [\"0 m\", \"11 m\", \"0 m\"]"),
        ),
        ("[[lump]]", format!("{good}\nlength = \"6 mm\"")),
        ("[[lump]]", format!("{good}\naxis = \"x\"")),
        ("[[lump]]", format!("{good}\nshape = \"capsule\"")),
        ("[[lump]]", format!("{good}\nshape = \"ellipsoid\"")),
        ("[[lump]]", format!("{good}\nshape = \"cube\"")),
        (
            "[[lump]]",
            format!("{tissue}\nshape = \"ellipsoid\"\ndepth = \"9 mm\""),
        ),
        ("[[lump]]", format!("{tissue}\nshape = \"mesh\"")),
        (
            "[[lump]]",
            format!("{tissue}\nshape = \"mesh\"\nfile = \"\""),
        ),
        ("[[lump]]", format!("{good}\ntransition = \"13 mm\"")),
        ("[[lump]]", format!("{good}\ntransition = \"-1 mm\"")),
    ]);
    let many = format!(
        "[body]\nsurface = \"s.ply\"\n[[layer]]\nthickness = \"9 mm\"\ntissue = \"fat\"\n{}",
        format!("[[lump]]\n{good}\n").repeat(65)
    );
    writeln!(said, "65 lumps\n    {}", refusal(&many)).unwrap();
    insta::assert_snapshot!(said);
}

#[test]
fn wrong_tools() {
    let tools = [
        "shape = \"needle\"",
        "friction = 0.3",
        "shape = \"sphere\"\nfriction = -0.3",
        "shape = \"sphere\"\nfriction = 6",
        "shape = \"sphere\"\nlength = \"6 mm\"",
        "shape = \"sphere\"\naxis = \"x\"",
        "shape = \"flat-punch\"\nedge_radius = \"9 mm\"",
        "shape = \"flat-punch\"\nedge_radius = \"0 mm\"",
        "shape = \"capsule\"\nlength = \"1 m\"",
        "shape = \"capsule\"\naxis = [0, 0, 0]",
        "shape = \"box\"\nradius = \"6 mm\"",
        "shape = \"box\"\nsize = [\"9 mm\", \"0 mm\", \"9 mm\"]",
        "shape = \"box\"\nsize = [\"9 mm\", \"2 mm\", \"9 mm\"]\nedge_radius = \"1.5 mm\"",
        "shape = \"fingertip\"\nradii = [\"9 mm\", \"9 mm\"]",
        "shape = \"fingertip\"\nradii = [\"9 mm\", \"9 m\", \"9 mm\"]",
        "shape = \"cone\"\nopening_angle = \"170 deg\"",
        "shape = \"cone\"\nradius = \"5 mm\"\ntip_radius = \"6 mm\"",
        "shape = \"sphere\"\ntip_radius = \"1 mm\"",
    ];
    insta::assert_snapshot!(refusals_of(&tools.map(|keys| ("[tool]", keys.to_owned()))));
}

#[test]
fn wrong_programmes_models_and_meshes() {
    let said = refusals(&[
        ("min_thickness = \"0.3 mm\"", "prestress = \"-1 kPa\""),
        ("min_thickness = \"0.3 mm\"", "prestress = \"6.2 N/m\""),
        ("hold = \"0.5 s\"", "cycles = 0"),
        ("hold = \"0.5 s\"", "cycles = 101"),
        ("hold = \"0.5 s\"", "cycles = 2\nretract = false"),
        ("hold = \"0.5 s\"", "speeds = [\"1 mm/s\"]"),
        ("speed = \"10 mm/s\"", "speeds = [\"1 mm/s\", \"2 m/s\"]"),
        (
            "speed = \"10 mm/s\"",
            &format!("speeds = [{}]", "\"1 mm/s\", ".repeat(17)),
        ),
        ("[reference]", "[model]\nkind = \"springs\"\n[reference]"),
        ("[reference]", "[model]\nalpha = 1\n[reference]"),
        ("[reference]", "[model]\ntolerance = 0\n[reference]"),
        (
            "[reference]",
            "[model]\ndamping = { mass = \"5 1/s\" }\n[reference]",
        ),
        (
            "[reference]",
            "[model]\ndynamics = \"implicit\"\ndamping = { mass = \"5 s\" }\n[reference]",
        ),
        (
            "[reference]",
            "[model]\ndynamics = \"implicit\"\ndamping = { mass = \"-5 Hz\" }\n[reference]",
        ),
        (
            "[reference]",
            "[model]\ndynamics = \"implicit\"\ndamping = { stiffness = \"1 h\" }\n[reference]",
        ),
        (
            "[reference]",
            "[model]\ndynamics = \"explicit\"\n[reference]",
        ),
        ("[reference]", "[mesh]\nrefine = 1\n[reference]"),
        ("[reference]", "[mesh]\nnear_tool = \"0 mm\"\n[reference]"),
        ("[reference]", "[mesh]\nnear_lumps = \"1 m\"\n[reference]"),
        ("[reference]", "[mesh]\ngrowth = 0\n[reference]"),
        ("[reference]", "[mesh]\nmax_vertices = 10\n[reference]"),
        ("[reference]", "[mesh]\naccuracy = 0.02\n[reference]"),
        ("[reference]", "[mesh]\naccuracy = \"0 %\"\n[reference]"),
        ("[reference]", "[mesh]\naccuracy = \"-2 %\"\n[reference]"),
        ("[reference]", "[mesh]\nmax_time = \"0.2 s\"\n[reference]"),
        (
            "[reference]",
            "[mesh]\naccuracy = \"2 %\"\nnear_tool = \"1 mm\"\n[reference]",
        ),
        (
            "[reference]",
            "[mesh]\naccuracy = \"2 %\"\nrefine = false\n[reference]",
        ),
        ("[reference]", "[mesh]\nnear_lump = \"1 mm\"\n[reference]"),
    ]);
    insta::assert_snapshot!(said);
}

/// A program that sets its own numbers is held to the same ranges.
#[test]
fn a_press_of_a_program_is_checked() {
    let press = Scene::parse(SCENE, Path::new("")).unwrap().press;
    assert_eq!(press.check(), Ok(()));
    let said: Vec<String> = [
        Press {
            speeds: vec![1e-3, 2.0],
            ..press.clone()
        },
        Press {
            cycles: 0,
            ..press.clone()
        },
        Press {
            cycles: 2,
            retract: false,
            ..press.clone()
        },
    ]
    .iter()
    .map(|press| press.check().unwrap_err())
    .collect();
    insta::assert_snapshot!(said.join("\n"));
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
