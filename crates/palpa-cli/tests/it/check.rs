//! `palpa check` as a process.

use std::fs;

use palpa_testkit::Bench;

/// A tetrahedron of 10 cm.
const GOOD: &str = "v 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 .1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

/// `palpa check` in a folder with files.
struct Check(Bench);

impl Check {
    fn new(files: &[(&str, &str)]) -> Self {
        let bench = crate::palpa();
        for (name, content) in files {
            bench.file(name, *content);
        }
        Self(bench)
    }

    fn run(&self, args: &[&str]) -> (i32, String, String) {
        self.0.run(&[&["check"], args].concat())
    }
}

#[test]
fn a_good_surface() {
    let check = Check::new(&[("good.obj", GOOD)]);
    let (code, stdout, stderr) = check.run(&["good.obj"]);
    assert_eq!((code, stderr.as_str()), (0, ""));
    insta::assert_snapshot!(stdout, @r"
    good.obj: good
      OBJ: 4 vertices, 4 faces (0 of them polygons), 1 object(s); welded: 4 vertices, 4 triangles
      0.1000 × 0.1000 × 0.1000 m, area 2.3660e-2 m², closed, volume 1.6667e-4 m³
    ");
}

#[test]
fn a_repairable_surface_and_its_copy() {
    let damaged = GOOD.replace("f 1 2 4", "f 1 4 2") + "f 3 1 4\nv 9 9 9\n";
    let check = Check::new(&[("skin.obj", &damaged)]);
    let (code, stdout, stderr) = check.run(&["skin.obj", "--repaired", "mended.off"]);
    assert_eq!((code, stderr.as_str()), (1, ""));
    insta::assert_snapshot!(stdout, @r"
    skin.obj: has defects that repair removes
      OBJ: 5 vertices, 5 faces (0 of them polygons), 1 object(s); welded: 5 vertices, 5 triangles
      0.1000 × 0.1000 × 0.1000 m, area 2.8660e-2 m², closed, volume 1.6667e-4 m³
      defect (repairable): 1 triangle has the same vertices as another
          triangles 3, 4 at (0.00000, 0.03333, 0.03333)
          → repair keeps the first of each
      defect (repairable): 1 triangle is wound against its neighbours
          triangle 1 at (0.03333, 0.00000, 0.03333)
          → repair turns them to agree with the majority
      defect (repairable): 1 vertex belongs to no triangle
          vertex 4 at (9.00000, 9.00000, 9.00000)
          → repair drops them
      repair: 1 doubles dropped, 1 triangles turned, 1 unused vertices dropped
      after repair: good
      repaired copy, in metres: mended.off
    ");
    let (code, stdout, _) = check.run(&["mended.off"]);
    assert_eq!(code, 0, "{stdout}");

    let (_, stdout, _) = check.run(&["skin.obj", "--json", "--out", "made"]);
    let report: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!(report[0]["verdict"], "repairable");
    assert_eq!(
        report[0]["surfaces"][0]["written"],
        "made/skin_repaired.obj"
    );
    assert!(check.0.path("made/skin_repaired.obj").exists());
}

#[test]
fn what_cannot_be_read_is_exit_code_2_and_the_rest_is_reported() {
    let check = Check::new(&[
        ("good.obj", GOOD),
        ("bad.obj", "v 0 0 0\nf 1 2 3\n"),
        ("points.ply", "ply\n"),
    ]);
    let (code, stdout, stderr) = check.run(&["bad.obj"]);
    assert_eq!(code, 2);
    insta::assert_snapshot!(stdout, @"bad.obj: cannot be read");
    insta::assert_snapshot!(stderr, @"error: bad.obj: OBJ, line 2: a face uses vertex 2, but the vertices are 1 to 1");

    let (code, stdout, stderr) = check.run(&[
        "bad.obj",
        "good.obj",
        "points.ply",
        "not_there.stl",
        "--json",
    ]);
    assert_eq!(code, 2);
    insta::assert_snapshot!(stderr, @"error: 3 of 4 files cannot be read, the first: bad.obj: OBJ, line 2: a face uses vertex 2, but the vertices are 1 to 1");
    let report: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!(report[1]["verdict"], "good");
    assert!(
        report[3]["error"]
            .as_str()
            .unwrap()
            .starts_with("cannot read not_there.stl: ")
    );

    let (code, _, stderr) = check.run(&["good.obj", "bad.obj", "--repaired", "x.obj"]);
    assert_eq!(code, 2);
    insta::assert_snapshot!(stderr, @"error: --repaired names one file, but 2 are checked; give --out DIR instead");
}

#[test]
fn a_scene_is_checked_with_its_surfaces_in_its_unit() {
    let scene = "[body]\nsurface = \"skin.obj\"\nunit = \"mm\"\n[[layer]]\ntissue = \"fat\"\nthickness = \"10 mm\"\n";
    let skin = GOOD.replace(".1", "100");
    let check = Check::new(&[
        ("limb.toml", scene),
        ("skin.obj", &skin),
        ("typo.toml", &scene.replace("tissue", "tisue")),
    ]);
    let (code, stdout, stderr) = check.run(&["limb.toml"]);
    assert_eq!((code, stderr.as_str()), (0, ""));
    assert!(stdout.contains("0.1000 × 0.1000 × 0.1000 m"), "{stdout}");
    let (code, _, stderr) = check.run(&["typo.toml"]);
    assert_eq!(code, 2);
    assert!(stderr.contains("typo.toml:5:1"), "{stderr}");
    fs::remove_file(check.0.path("skin.obj")).unwrap();
    let (code, _, stderr) = check.run(&["limb.toml"]);
    assert_eq!(code, 2);
    assert!(
        stderr.contains("limb.toml") && stderr.contains("skin.obj"),
        "{stderr}"
    );
}

#[test]
fn the_unit_of_a_surface_is_that_of_the_option() {
    let check = Check::new(&[("skin.obj", &GOOD.replace(".1", "100"))]);
    let (code, stdout, _) = check.run(&["skin.obj"]);
    assert!(code == 0 && stdout.contains("`--unit mm`"), "{stdout}");
    let (code, stdout, _) = check.run(&["skin.obj", "--unit", "mm"]);
    assert!(code == 0 && !stdout.contains("note"), "{stdout}");
    assert_eq!(check.run(&["skin.obj", "--unit", "furlong"]).0, 2);
}

#[test]
fn a_scene_whose_parts_do_not_fit_is_not_good() {
    use palpa_mesh::generate::cylinder;
    use palpa_mesh::{Vec3, write_surface};
    let scene = "[body]\nsurface = \"skin.ply\"\nbones = [\"bone.ply\"]\n[[layer]]\ntissue = \"fat\"\nthickness = \"5 mm\"\n[[layer]]\ntissue = \"muscle\"\n[press]\ndepth = \"2 mm\"\n";
    let check = Check::new(&[("limb.toml", scene)]);
    let (skin, mut bone) = cylinder(0.12, 0.04, 0.01, 8e-3);
    write_surface(&check.0.path("skin.ply"), &skin).unwrap();
    write_surface(&check.0.path("bone.ply"), &bone).unwrap();
    let (code, stdout, _) = check.run(&["limb.toml"]);
    assert_eq!(code, 0, "{stdout}");
    assert!(stdout.contains("prisms, all valid"), "{stdout}");
    bone.points
        .iter_mut()
        .for_each(|p| *p += Vec3::new(2.0, 0.0, 0.0));
    write_surface(&check.0.path("bone.ply"), &bone).unwrap();
    let (code, stdout, _) = check.run(&["limb.toml"]);
    assert_eq!(code, 1, "{stdout}");
    assert!(
        stdout.contains("bone.ply: bone 0 is nowhere inside the skin"),
        "{stdout}"
    );
}

#[test]
fn layers_that_are_thinned_over_most_of_the_skin_are_noted() {
    use palpa_mesh::generate::cylinder;
    use palpa_mesh::write_surface;
    let scene = "[body]\nsurface = \"skin.ply\"\nbones = [\"bone.ply\"]\n[[layer]]\ntissue = \"skin\"\nthickness = \"1.5 mm\"\n\
                 [[layer]]\ntissue = \"fat\"\nthickness = \"4 mm\"\n[[layer]]\ntissue = \"muscle\"\n\
                 [press]\ndepth = \"0.5 mm\"\nstep = \"0.5 mm\"\n";
    let check = Check::new(&[("limb.toml", scene)]);
    // A bone off the axis: on the other side of the limb there is room.
    let with_bone = |radius: f64| {
        let (skin, mut bone) = cylinder(0.1, 0.02, radius, 4e-3);
        bone.points.iter_mut().for_each(|p| p.y += 0.003);
        write_surface(&check.0.path("skin.ply"), &skin).unwrap();
        write_surface(&check.0.path("bone.ply"), &bone).unwrap();
    };
    let is_noted = |text: &str| {
        text.contains("layers are thinner than asked under")
            && text.contains("give the layers less thickness")
    };
    with_bone(14.5e-3);
    let (code, stdout, stderr) = check.run(&["limb.toml"]);
    assert_eq!((code, stderr.as_str()), (0, ""), "{stdout}");
    assert!(stdout.contains("note: ") && is_noted(&stdout), "{stdout}");
    let (_, stdout, _) = check.run(&["limb.toml", "--json"]);
    let report: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    assert!(is_noted(&report[0]["notes"].to_string()), "{report}");
    let body = &report[0]["body"];
    assert!(body["thinned_share"].as_f64().unwrap() > 0.5, "{body}");
    let median = body["median_thinning"].as_f64().unwrap();
    assert!((0.4..0.8).contains(&median), "{median}");
    // A press says it too.
    let args = [
        "press",
        "limb.toml",
        "--json",
        "--frames",
        "0",
        "--no-error-bar",
    ];
    let report = check.0.report(&args);
    assert!(is_noted(&report["notes"].to_string()), "{report}");
    // Thin on one side only: a figure, but no note.
    with_bone(12e-3);
    let (_, stdout, _) = check.run(&["limb.toml"]);
    assert!(stdout.contains("layers thinned under"), "{stdout}");
    assert!(!is_noted(&stdout), "{stdout}");
}
