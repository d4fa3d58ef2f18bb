//! What a scene says of the continuum model: laws, lumps, tools, programmes.

use std::path::Path;

use palpa_scene::built_in::PRESSED_BONDED;
use palpa_scene::{
    BuiltIn, ContactShape, ContactTool, Damping, Dynamics, Elastic, Energy, Lump, LumpPlace,
    LumpShape, Mesh, ModelKind, Moduli, Scene, Status, Target, Tissue, Tool, Volume,
};
use proptest::prelude::*;

const EVERYTHING: &str = include_str!("scenes/everything.toml");

fn parse(text: &str) -> Scene {
    Scene::parse(text, Path::new("bodies")).unwrap_or_else(|e| panic!("{e}\nin:\n{text}"))
}

/// The tissue that this inline table is.
fn tissue(table: &str) -> Tissue {
    let text = format!(
        "[body]\nsurface = \"s.ply\"\n[[layer]]\nthickness = \"9 mm\"\ntissue = {{ {table} }}"
    );
    let mut scene = parse(&text);
    let written = scene.to_toml();
    assert_eq!(parse(&written), scene, "{written}");
    assert_eq!(parse(&written).to_toml(), written);
    scene.layers.remove(0).tissue
}

fn law(table: &str) -> Elastic {
    tissue(table).elastic().unwrap().clone()
}

#[track_caller]
fn assert_near(a: f64, b: f64) {
    assert!((a - b).abs() <= 1e-12 * b.abs(), "{a} is not {b}");
}

/// Moduli of an isotropic solid hang together: E = 2µ(1 + ν) = 3K(1 − 2ν).
#[track_caller]
fn assert_consistent(law: &Elastic) {
    let (e, nu, mu, k) = (law.young(), law.poisson(), law.shear(), law.bulk());
    // ν close to ½ makes 1 − 2ν, and with it K, inexact.
    let tolerance = 1e-12 / (1.0 - 2.0 * nu);
    assert!((2.0 * mu * (1.0 + nu) / e - 1.0).abs() < 1e-12, "{law:?}");
    assert!(
        (3.0 * k * (1.0 - 2.0 * nu) / e - 1.0).abs() < tolerance,
        "{law:?}"
    );
}

#[test]
fn everything_is_understood_and_survives_being_written() {
    let scene = parse(EVERYTHING);
    let written = scene.to_toml();
    assert_eq!(parse(&written), scene, "in:\n{written}");
    assert_eq!(parse(&written).to_toml(), written);
    let laws: Vec<_> = scene.layers.iter().map(|l| l.tissue.law.name()).collect();
    assert_eq!(
        laws,
        [
            "fung",
            "mooney-rivlin",
            "ogden",
            "ogden",
            "yeoh",
            "yeoh",
            "st-venant-kirchhoff",
            "linear",
            "neo-hookean"
        ]
    );
    for layer in &scene.layers {
        assert_consistent(layer.tissue.elastic().unwrap());
    }
    assert_eq!(scene.layers[0].prestress, 28e3);
    assert_eq!(scene.layers[1].prestress, 0.0);
    assert_eq!(
        scene.layers[2].tissue.elastic().unwrap().volume,
        Volume::Logarithmic
    );
    let prony = scene.layers[8].tissue.prony.as_ref().unwrap();
    assert_eq!((prony.terms[1].g, prony.terms[1].tau), (0.2, 60.0));
    assert_eq!(
        (prony.moduli, prony.relaxes_volume, prony.status),
        (Moduli::Instantaneous, true, Status::Given)
    );
    assert_near(prony.stiffening(), 2.0);
    assert_eq!(
        scene.model.dynamics,
        Dynamics::Implicit(Damping {
            mass: 5.0,
            stiffness: 1e-3
        })
    );
    assert_eq!(
        (scene.model.alpha, scene.model.tolerance),
        (Some(0.7), 1e-6)
    );
    let mesh = Mesh {
        refine: false,
        coarsen: Some(true),
        near_tool: Some(2e-3),
        near_lumps: Some(1.5e-3),
        growth: Some(0.5),
        level_growth: Some(0.7),
        max_vertices: 5000,
        accuracy: None,
        max_time: Some(90.0),
        moves: true,
    };
    assert_eq!(scene.mesh, mesh);
    let press = &scene.press;
    assert_eq!((press.speed, press.cycles), (1e-3, 3));
    assert_eq!(press.speeds, [1e-3, 1e-2, 0.1]);
    let size = [20e-3, 10e-3, 30e-3];
    let tool = ContactTool {
        shape: ContactShape::Box {
            size,
            edge_radius: 2e-3,
        },
        friction: 0.3,
        axis: Some([0.0, 1.0, 0.0]),
    };
    assert_eq!(scene.tool, Tool::Contact(tool));
}

#[test]
fn lumps_lie_where_they_are_put() {
    let lumps = parse(EVERYTHING).lumps;
    let places: Vec<_> = lumps.iter().map(|lump| lump.place).collect();
    let below = |target, depth| LumpPlace::Below { target, depth };
    assert_eq!(
        places,
        [
            below(Target::Point([0.0; 3]), 0.014),
            below(Target::Point([0.01, 0.02, 0.0]), 0.02),
            LumpPlace::At([0.0, 0.0, -0.04]),
            LumpPlace::AsRead,
            below(Target::Vertex(7), 0.01),
        ]
    );
    assert_eq!(lumps[0].shape, LumpShape::Sphere { radius: 0.006 });
    assert_eq!(
        (lumps[0].name.as_str(), lumps[1].name.as_str()),
        ("node", "lump")
    );
    assert_eq!((lumps[0].transition, lumps[1].transition), (0.0, 1e-3));
    assert_eq!(lumps[1].axis, Some([0.6, 0.8, 0.0]));
    assert_eq!(lumps[3].shape, LumpShape::Mesh("bodies/gland.stl".into()));
    assert_eq!(lumps[3].tissue.name, "fibrous lump");
    assert_eq!(lumps[1].tissue.young(), Some(300e3));
}

#[test]
fn each_law_has_the_parameters_it_was_given() {
    let neo = law("c10 = \"5 kPa\", bulk = \"100 kPa\"");
    assert_near(neo.shear(), 10e3);
    assert_near(neo.young(), 9.0 * 100e3 * 10e3 / 310e3);
    assert_eq!((neo.c10(), neo.bulk()), (5e3, 100e3));

    let mooney = law("law = \"mooney-rivlin\", c10 = \"3 kPa\", c01 = \"2 kPa\", poisson = 0.49");
    assert_near(mooney.shear(), 10e3);
    assert_eq!((mooney.c10(), mooney.poisson()), (3e3, 0.49));

    // Young's modulus stands in place of C10: the rest of the stiffness is C01's.
    let mooney =
        law("law = \"mooney-rivlin\", young = \"29 kPa\", c01 = \"2 kPa\", poisson = 0.45");
    assert_eq!(mooney.young(), 29e3);
    assert_near(mooney.c10(), 3e3);

    let ogden = law(
        "law = \"ogden\", terms = [{ mu = \"4 kPa\", alpha = 10 }, { mu = \"1 kPa\", alpha = -2 }]",
    );
    assert_near(ogden.shear(), 5e3);
    assert_near(ogden.young(), 14.5e3);
    let one = law("law = \"ogden\", young = \"29 kPa\", alpha = 8, poisson = 0.45");
    let Energy::Ogden { terms } = &one.energy else {
        panic!("{one:?}")
    };
    assert_near(terms[0].mu.value, 10e3);
    assert_eq!((terms.len(), terms[0].alpha), (1, 8.0));

    let yeoh = law("law = \"yeoh\", c10 = \"5 kPa\"");
    let Energy::Yeoh { c20, c30, .. } = &yeoh.energy else {
        panic!("{yeoh:?}")
    };
    assert_eq!((c20.value, c30.value), (0.0, 0.0));
    assert_eq!(c20.status, Status::Assumed);

    let fung = law("law = \"fung\", young = \"29 kPa\", b = 20, poisson = 0.45");
    assert_near(fung.shear(), 10e3);
    let gent = law("law = \"gent\", shear = \"5 kPa\", jm = 12, bulk = \"90 kPa\"");
    assert_near(gent.shear(), 5e3);
    let Energy::Gent { jm, .. } = &gent.energy else {
        panic!("{gent:?}")
    };
    assert_eq!((jm.value, jm.status), (12.0, Status::Given));
    for law in [neo, mooney, ogden, one, yeoh, fung, gent] {
        assert_consistent(&law);
    }
}

#[test]
fn all_that_is_said_of_a_material_is_reported() {
    let scene = parse(EVERYTHING);
    let status = scene.material_status();
    let summaries: Vec<_> = (status.iter().chain(&scene.lump_status()))
        .map(|status| format!("{}: {}", status.tissue, status.summary))
        .collect();
    insta::assert_snapshot!(summaries.join("\n"));
    let skin = &status[0];
    assert_eq!((skin.law, skin.prestress), ("fung", 28e3));
    let names: Vec<_> = skin.parameters.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["shear", "b", "poisson", "density"]);
    assert!(skin.parameters.iter().all(|p| p.source == "a fit"));
    let prony = &status[8].parameters[2..];
    assert_eq!(
        (prony[3].name.as_str(), prony[3].value, prony[3].unit),
        ("prony.terms[1].tau", 60.0, "s")
    );
    let json = serde_json::to_value(&scene.lump_status()[0]).unwrap();
    assert_eq!(json["law"], "neo-hookean");
    assert_eq!(json["status"], "assumed");
    assert_eq!(json["thickness_status"], serde_json::Value::Null);
}

/// The tool that this table is.
fn tool(table: &str) -> Tool {
    let scene = parse(&format!(
        "[body]\nsurface = \"s.ply\"\n[[layer]]\nthickness = \"9 mm\"\ntissue = \"fat\"\n[tool]\n{table}"
    ));
    let written = scene.to_toml();
    assert_eq!(parse(&written), scene, "{written}");
    scene.tool
}

#[test]
fn every_tool_has_a_size_where_none_is_given() {
    let mut said = String::new();
    for shape in [
        "disc",
        "node",
        "sphere",
        "flat-punch",
        "capsule",
        "box",
        "fingertip",
        "cone",
    ] {
        let tool = tool(&format!("shape = \"{shape}\""));
        assert_eq!(tool.is_bonded(), ["disc", "node"].contains(&shape));
        assert_eq!(tool.is_bonded(), tool.contact().is_none());
        let wanted = parse(EVERYTHING);
        let wanted = Mesh {
            near_tool: None,
            ..wanted.mesh
        };
        let edges = wanted.near_tool_of(&tool);
        said += &format!(
            "{tool}; presses {:.2} mm wide; edges of {}\n",
            tool.contact_radius() * 2e3,
            edges.map_or("any length".to_owned(), |edge| format!(
                "{:.2} mm",
                edge * 1e3
            ))
        );
    }
    insta::assert_snapshot!(said);
}

#[test]
fn the_mesh_follows_what_is_smallest() {
    let scene = parse(EVERYTHING);
    let automatic = Mesh {
        near_tool: None,
        near_lumps: None,
        ..scene.mesh
    };
    let wanted = |i: usize| automatic.near_lump_of(&scene.lumps[i]);
    assert_eq!(
        [wanted(0), wanted(1), wanted(2), wanted(3)],
        [Some(3e-3), Some(2e-3), Some(1e-3), None]
    );
    assert_eq!(scene.mesh.near_lump_of(&scene.lumps[3]), Some(1.5e-3));
    let needle = tool("radius = \"0.5 mm\"");
    assert_eq!(automatic.near_tool_of(&needle), Some(0.5e-3));
    assert_eq!(scene.mesh.near_tool_of(&Tool::Node), Some(2e-3));
}

#[test]
fn a_scene_of_old_has_the_defaults_of_the_continuum() {
    let scene = BuiltIn::find(PRESSED_BONDED).unwrap().scene().unwrap();
    assert_eq!(scene.model.kind, ModelKind::Tissue);
    assert_eq!(scene.model.dynamics, Dynamics::QuasiStatic);
    assert_eq!((scene.model.alpha(), scene.model.tolerance), (0.8, 1e-5));
    assert!(scene.lumps.is_empty() && scene.press.speeds.is_empty());
    assert_eq!(scene.press.cycles, 1);
    assert_eq!(scene.mesh.near_tool_of(&scene.tool), Some(2e-3));
    for layer in &scene.layers {
        assert_eq!(layer.prestress, 0.0);
        let prony = layer.tissue.prony.as_ref().unwrap();
        assert_eq!(prony.moduli, Moduli::LongTerm);
    }
}

/// Three unit vectors, each across the others, the third being the first cross the second.
fn assert_frame([x, y, z]: [[f64; 3]; 3]) {
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    for (a, b, expected) in [
        (x, x, 1.0),
        (y, y, 1.0),
        (z, z, 1.0),
        (x, y, 0.0),
        (y, z, 0.0),
        (z, x, 0.0),
    ] {
        assert!((dot(a, b) - expected).abs() < 1e-12, "{x:?} {y:?} {z:?}");
    }
    let volume = x[0] * (y[1] * z[2] - y[2] * z[1]) - x[1] * (y[0] * z[2] - y[2] * z[0])
        + x[2] * (y[0] * z[1] - y[1] * z[0]);
    assert!(volume > 0.0, "{x:?} {y:?} {z:?} is left-handed");
}

fn unit() -> impl Strategy<Value = [f64; 3]> {
    (-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64)
        .prop_filter("long enough", |(x, y, z)| x * x + y * y + z * z > 1e-2)
        .prop_map(|(x, y, z)| {
            let length = (x * x + y * y + z * z).sqrt();
            [x / length, y / length, z / length]
        })
}

fn lump(axis: Option<[f64; 3]>) -> Lump {
    Lump {
        axis,
        ..parse(EVERYTHING).lumps.swap_remove(1)
    }
}

proptest! {
    #[test]
    fn axes_are_a_frame_whatever_the_directions(axis in unit(), inward in unit()) {
        for inward in [inward, axis, axis.map(|x| -x)] {
            let turned = lump(Some(axis)).axes(inward);
            assert_frame(turned);
            prop_assert_eq!(turned[0], axis);
            let along_skin = lump(None).axes(inward);
            assert_frame(along_skin);
            prop_assert_eq!(along_skin[2], inward);
            let tool = ContactTool { shape: ContactShape::Sphere { radius: 0.01 }, friction: 0.0, axis: Some(axis) };
            let axes = tool.axes(inward);
            assert_frame(axes);
            prop_assert_eq!(axes[2], inward.map(|x| -x));
        }
    }

    #[test]
    fn moduli_agree_however_they_are_given(young in 1e2..1e8f64, nu in 0.0..0.4999f64) {
        let given = law(&format!("young = \"{young} Pa\", poisson = {nu}"));
        assert_consistent(&given);
        prop_assert_eq!(given.young(), young);
        prop_assert_eq!(given.poisson(), nu);
        let (mu, k) = (given.shear(), given.bulk());
        for table in [
            format!("shear = \"{mu} Pa\", bulk = \"{k} Pa\""),
            format!("c10 = \"{} Pa\", bulk = \"{k} Pa\"", mu / 2.0),
            format!("young = \"{young} Pa\", bulk = \"{k} Pa\""),
            format!("shear = \"{mu} Pa\", poisson = {nu}"),
        ] {
            // A ratio at the very end of its range may be beyond it by rounding.
            let nu_again = (3.0 * k - 2.0 * mu) / (6.0 * k + 2.0 * mu);
            prop_assume!((1e-12..0.4998999).contains(&nu_again));
            let other = law(&table);
            assert_consistent(&other);
            for (a, b) in [(other.young(), young), (other.shear(), mu), (other.bulk(), k)] {
                prop_assert!((a / b - 1.0).abs() < 1e-8, "{table}: {a} is not {b}");
            }
            prop_assert!((other.poisson() - nu).abs() < 1e-9, "{table}");
        }
    }
}
