//! Valid scenes: what they become, and that writing and reading them again changes nothing.

use std::path::Path;

use palpa_scene::built_in::{LOOPED, PRESSED, PRESSED_BONDED, VIEWED};
use palpa_scene::{
    Body, BuiltIn, CutFaces, Cutout, Generator, InPlane, LengthUnit, Press, Scene, Skin, Solver,
    Status, Target, Thickness, Tool,
};

const MINIMAL: &str = include_str!("scenes/minimal.toml");
const LIMB: &str = include_str!("scenes/limb.toml");
const THESIS: &str = include_str!("scenes/thesis.toml");

fn parse(text: &str) -> Scene {
    Scene::parse(text, Path::new("bodies")).unwrap_or_else(|e| panic!("{e}"))
}

#[track_caller]
fn assert_close(a: f64, b: f64) {
    assert!(
        (a - b).abs() <= 4.0 * f64::EPSILON * b.abs(),
        "{a} is not {b}"
    );
}

#[test]
fn a_surface_and_one_layer_are_enough() {
    let scene = parse(MINIMAL);
    assert_eq!(
        scene.body,
        Body {
            skin: Skin::File("bodies/skin.ply".into()),
            bones: vec![],
            unit: LengthUnit::M,
            cutout: None,
            cut_faces: CutFaces::Free,
        }
    );
    assert_eq!(scene.layers.len(), 1);
    let layer = &scene.layers[0];
    assert_eq!(layer.tissue.name, "fat");
    assert_eq!(layer.thickness, Some(Thickness::Uniform(0.02)));
    assert_eq!((layer.levels, layer.min_thickness), (1, 0.004));
    assert_eq!(layer.thickness_status, Status::Given);
    assert_eq!(scene.tool, Tool::Disc { radius: 0.008 });
    assert_eq!(
        scene.press,
        Press {
            target: Target::Middle,
            direction: None,
            depth: 0.008,
            speed: 0.01,
            hold: 0.5,
            retract: true,
            step: 0.0005,
            speeds: vec![],
            cycles: 1,
        }
    );
    assert_eq!(scene.reference.substeps, 4);
    assert_eq!(scene.reference.solver, Solver::Sparse);
    assert_eq!(scene.reference.in_plane, InPlane::Below);
    assert_eq!(
        (scene.reference.spring_gain, scene.reference.shape_gain),
        (0.0, 0.0)
    );
}

#[test]
fn everything_that_can_be_said_is_understood() {
    let scene = parse(LIMB);
    assert_eq!(scene.body.skin, Skin::File("bodies/scan/skin.stl".into()));
    assert_eq!(scene.body.bones[1], Path::new("bodies/scan/fibula.ply"));
    assert_eq!(scene.body.unit.metres(), 1e-3);
    assert_eq!(scene.body.cut_faces, CutFaces::Symmetric);
    let cutout = Cutout {
        radius: 0.06,
        at: Target::Point([0.12, 0.0, 0.04]),
    };
    assert_eq!(scene.body.cutout, Some(cutout));

    let [skin, fat, muscle] = scene.layers.as_slice() else {
        panic!("three layers")
    };
    let table = vec![[0.07, 0.0012], [0.2, 0.0015]];
    assert_eq!(
        skin.thickness,
        Some(Thickness::Along {
            axis: [0.0, 0.0, 1.0],
            table
        })
    );
    assert_eq!(
        (skin.thickness_status, skin.min_thickness),
        (Status::Measured, 0.0003)
    );
    assert_eq!(
        fat.thickness,
        Some(Thickness::File("bodies/fat.csv".into()))
    );
    assert_eq!(fat.min_thickness, 0.0005);
    assert_eq!(muscle.thickness, None);
    assert_eq!(muscle.tissue.young(), Some(50e3));
    assert_eq!(muscle.tissue.poisson(), Some(0.49));
    assert_close(muscle.tissue.density.as_ref().unwrap().value, 1060.0);
    assert_eq!(scene.n_intervals(), 7);

    let Tool::Disc { radius } = scene.tool else {
        panic!("a disc")
    };
    assert_close(radius, 6.35e-3);
    assert_eq!(scene.press.target, Target::Vertex(812));
    assert_eq!(scene.press.direction, Some([0.0, -0.6, 0.8]));
    assert_close(scene.press.speed, 0.01);
    assert_close(scene.press.step, 0.0005);
    assert!(!scene.press.retract);
    assert_eq!(scene.reference.solver, Solver::DenseInverse);
    assert_eq!(
        (scene.reference.spring_gain, scene.reference.shape_gain),
        (0.0, 0.25)
    );
}

#[test]
fn the_units_of_the_thesis_are_understood() {
    let scene = parse(THESIS);
    assert_close(scene.layers[0].tissue.spring().unwrap(), 0.001);
    assert_close(scene.layers[1].tissue.spring().unwrap(), 0.09);
    assert_eq!(scene.tool, Tool::Node);
    let Skin::Generated(Generator::Block { size, spacing }) = scene.body.skin else {
        panic!("a block")
    };
    assert_close(size[2], 0.12);
    assert_close(spacing, 0.04);
}

#[test]
fn a_scene_survives_being_written_and_read() {
    for text in [MINIMAL, LIMB, THESIS, BuiltIn::find(PRESSED).unwrap().toml] {
        let scene = parse(text);
        let written = scene.to_toml();
        let again = Scene::parse(&written, Path::new("bodies"))
            .unwrap_or_else(|e| panic!("{e}\nin:\n{written}"));
        assert_eq!(again, scene, "in:\n{written}");
        assert_eq!(again.to_toml(), written);
    }
}

#[test]
fn the_built_in_scenes_are_valid_and_each_has_its_own_name() {
    let mut keys = std::collections::BTreeSet::new();
    for built_in in BuiltIn::all() {
        let key = built_in.key;
        assert!(keys.insert(key), "{key} twice");
        let scene = built_in.scene().unwrap_or_else(|e| panic!("{key}: {e}"));
        let again = Scene::parse(&scene.to_toml(), Path::new(""));
        assert_eq!(again.unwrap(), scene, "{key}");
        assert!(
            !built_in.name.is_empty() && !built_in.about.is_empty(),
            "{key}"
        );
        // A template names files; the others need none.
        let has_files = matches!(scene.body.skin, Skin::File(_));
        assert_eq!(has_files, built_in.is_template, "{key}");
        assert_eq!(BuiltIn::find(key), Some(built_in));
    }
    assert_eq!(keys.len(), 12);
    let files = std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes")).unwrap();
    assert_eq!(files.count(), keys.len(), "a file in scenes/ is not listed");
    assert_eq!(BuiltIn::find("Forearm-Lump"), BuiltIn::find("forearm_lump"));
    assert_eq!(BuiltIn::find("limbb"), None);
    for used in [VIEWED, PRESSED, PRESSED_BONDED, LOOPED] {
        assert!(keys.contains(used), "{used}");
    }
}

fn built_in(key: &str) -> Scene {
    BuiltIn::find(key).unwrap().scene().unwrap()
}

#[test]
fn the_forearms_that_are_pressed_differ_as_they_say() {
    let forearm = Scene::embedded();
    assert_eq!(forearm, built_in(PRESSED));
    // The lump alone makes the difference.
    let with_lump = built_in("forearm_press_lump");
    assert_eq!(with_lump.lumps.len(), 1);
    let without = Scene {
        lumps: vec![],
        ..with_lump
    };
    assert_eq!(without, forearm);
    // Skin and tool make the difference.
    let disc = built_in(PRESSED_BONDED);
    assert!(disc.tool.is_bonded() && !forearm.tool.is_bonded());
    let under_a_ball = Scene {
        tool: forearm.tool,
        body: forearm.body.clone(),
        ..disc
    };
    assert_eq!(under_a_ball, forearm);
    // Of the forearms to be touched, the lump and the motion make the difference.
    let touched_lump = built_in("forearm_lump");
    assert_eq!(touched_lump.lumps.len(), 1);
    let touched = built_in("forearm");
    let without = Scene {
        lumps: vec![],
        motion: touched.motion,
        ..touched_lump
    };
    assert_eq!(without, touched);
    let five = built_in("forearm_five_tissues");
    assert_eq!(five.layers.len(), 5);
    assert_eq!(five.layers[0].thickness, Some(Thickness::Uniform(1e-4)));
}

#[test]
fn an_inline_tissue_without_a_ratio_keeps_its_default() {
    let text = MINIMAL.replace("\"fat\"", "{ young = \"12 kPa\" }");
    let scene = parse(&text);
    let status = &scene.material_status()[0];
    assert_eq!((status.young, status.status), (Some(12e3), Status::Given));
    assert_eq!(
        (status.poisson, status.poisson_status),
        (Some(0.45), Some(Status::Assumed))
    );
    assert_eq!(parse(&scene.to_toml()), scene);
}

#[test]
fn defaults_stay_within_the_ranges_they_are_read_with() {
    for (thickness, depth) in [
        ("10 um", "1 um"),
        ("500 mm", "499 mm"),
        ("0.7 mm", "0.3 mm"),
    ] {
        let scene = MINIMAL.replace("20 mm", thickness);
        let scene = parse(&format!("{scene}[press]\ndepth = \"{depth}\""));
        assert_eq!(parse(&scene.to_toml()), scene);
    }
}

#[test]
fn directions_of_any_length_become_unit_vectors() {
    for direction in [
        "[0, 0, -7]",
        "[1e308, 1e308, -1e308]",
        "[1e-320, 0, 0]",
        "[0.1, 0.2, 0.3]",
    ] {
        let scene = parse(&format!("{MINIMAL}[press]\ndirection = {direction}"));
        let unit = scene.press.direction.unwrap();
        let length = unit.iter().map(|x| x * x).sum::<f64>().sqrt();
        assert!((length - 1.0).abs() < 1e-15, "{direction} became {unit:?}");
        assert_eq!(parse(&scene.to_toml()), scene);
    }
}

#[test]
fn the_written_scene_reads_well() {
    let mut settings = insta::Settings::clone_current();
    settings.set_prepend_module_to_snapshot(false);
    settings.bind(|| insta::assert_snapshot!("limb_written", parse(LIMB).to_toml()));
}

#[test]
fn the_embedded_forearm_is_skin_fat_and_muscle_to_the_bone() {
    let scene = Scene::embedded();
    assert_eq!(scene, Scene::default());
    let layers: Vec<_> = scene
        .layers
        .iter()
        .map(|l| (l.tissue.name.as_str(), l.thickness.clone(), l.levels))
        .collect();
    assert_eq!(
        layers,
        [
            ("skin", Some(Thickness::Uniform(0.0015)), 1),
            ("fat", Some(Thickness::Uniform(0.004)), 1),
            ("muscle", None, 4),
        ]
    );
    let status: Vec<_> = scene
        .material_status()
        .iter()
        .map(|m| (m.status, m.thickness_status))
        .collect();
    assert_eq!(
        status,
        [
            (Status::Assumed, Some(Status::Assumed)),
            (Status::Literature, Some(Status::Assumed)),
            (Status::Assumed, None),
        ]
    );
}

#[test]
fn status_of_a_spring_layer_is_given() {
    let status = &parse(THESIS).material_status()[1];
    assert_eq!(
        (status.young, status.poisson, status.poisson_status),
        (None, None, None)
    );
    assert_close(status.spring.unwrap(), 0.09);
    assert_eq!(status.status, Status::Given);
    let json = serde_json::to_value(status).unwrap();
    assert_eq!(json["status"], "given");
    assert_eq!(json["tissue"], "hard");
}

#[test]
fn a_file_is_read_from_its_own_folder() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    // A byte order mark and the line ends of Windows are no reason to refuse a scene.
    std::fs::write(&path, format!("\u{feff}{}", MINIMAL.replace('\n', "\r\n"))).unwrap();
    let scene = Scene::load(&path).unwrap();
    assert_eq!(scene.body.skin, Skin::File(folder.path().join("skin.ply")));
    assert_eq!(scene.to_toml(), parse(MINIMAL).to_toml());
}
