//! `palpa press` with the reference method as a person runs it: results, refusals, Ctrl-C.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;

/// A block of 9 × 9 vertices: a fraction of a second.
const BLOCK: &str = r#"
[body]
generator = { kind = "block", size = ["80 mm", "80 mm", "30 mm"], spacing = "10 mm" }
[[layer]]
tissue = { name = "soft", young = "10 kPa", poisson = 0.45 }
thickness = "10 mm"
levels = 2
[[layer]]
tissue = { name = "stiff", young = "40 kPa", poisson = 0.45 }
levels = 2
[tool]
shape = "disc"
radius = "15 mm"
[press]
at = ["0 mm", "0 mm", "0 mm"]
depth = "3 mm"
step = "0.5 mm"
hold = "0.2 s"
"#;

pub(crate) struct Bench {
    pub(crate) folder: TempDir,
    model: &'static str,
}

impl Bench {
    fn new() -> Self {
        Self::of("reference")
    }

    pub(crate) fn of(model: &'static str) -> Self {
        Self {
            folder: TempDir::new().unwrap(),
            model,
        }
    }

    pub(crate) fn file(&self, name: &str, text: &str) -> String {
        fs::write(self.folder.path().join(name), text).unwrap();
        name.to_owned()
    }

    pub(crate) fn press(&self, args: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_palpa"))
            .current_dir(self.folder.path())
            .args(["press", "--model", self.model])
            .args(args)
            .output()
            .unwrap()
    }

    pub(crate) fn report(&self, args: &[&str]) -> Value {
        let output = self.press(args);
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        serde_json::from_slice(&output.stdout).unwrap()
    }

    /// A refusal where an earlier run has left its files.
    fn refusal_of_part(&self, args: &[&str]) -> String {
        let output = self.press(args);
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        String::from_utf8(output.stderr).unwrap()
    }

    pub(crate) fn refusal(&self, args: &[&str]) -> String {
        let output = self.press(args);
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{args:?}: {text}");
        assert!(
            output.stdout.is_empty(),
            "{args:?}: nothing is printed as a result"
        );
        assert_eq!(text.trim_end().lines().count(), 1, "one paragraph: {text}");
        assert!(!self.folder.path().join("out/press/press.csv").exists());
        text
    }
}

fn forces(report: &Value, phase: &str) -> Vec<f64> {
    let samples = report["samples"].as_array().unwrap().iter();
    samples
        .filter(|s| s["phase"] == phase)
        .map(|s| s["force_n"].as_f64().unwrap())
        .collect()
}

#[test]
fn a_block_is_pressed_and_every_file_is_there() {
    let bench = Bench::new();
    bench.file("block.toml", BLOCK);
    let report = bench.report(&["block.toml", "--json", "--frames", "3"]);
    let loading = forces(&report, "load");
    assert_eq!(loading.len(), 7);
    assert!(loading.windows(2).all(|f| f[1] > f[0]), "{loading:?}");
    // A soft layer over a stiffer one: between the two as uniform columns of the disc's area, up to the field around.
    let area = std::f64::consts::PI * 0.015_f64.powi(2);
    let softest = 10e3 * area * 3e-3 / 30e-3;
    assert!(
        loading[6] > softest && loading[6] < 20.0 * softest,
        "{} N against {softest} N",
        loading[6]
    );
    assert_eq!(forces(&report, "hold").len(), 5);
    let back = forces(&report, "retract");
    assert!(back.last().unwrap().abs() < 0.1 * loading[6], "{back:?}");
    assert_eq!(report["result"]["is_complete"], true);
    assert_eq!(report["press"]["n_operated_nodes"], 9);
    assert!((report["press"]["mesh_size_near_tool_mm"].as_f64().unwrap() - 11.0).abs() < 2.0);
    assert!(
        report["result"]["material_status"]
            .as_str()
            .unwrap()
            .contains("given by the scene")
    );

    let out = bench.folder.path().join("out/press");
    for name in [
        "press.json",
        "press.pvd",
        "force_depth.svg",
        "force_depth.png",
        "force_time.svg",
        "force_time.png",
    ] {
        assert!(out.join(name).is_file(), "{name}");
    }
    assert!(out.join("section.svg").is_file() && out.join("section.png").is_file());
    assert_eq!(fs::read_dir(out.join("series")).unwrap().count(), 3);
    let table = fs::read_to_string(out.join("press.csv")).unwrap();
    assert_eq!(
        table.lines().count(),
        1 + report["samples"].as_array().unwrap().len()
    );
    let leftovers = fs::read_dir(&out).unwrap().filter(|f| {
        f.as_ref()
            .unwrap()
            .file_name()
            .to_string_lossy()
            .contains("partial")
    });
    assert_eq!(leftovers.count(), 0);
}

#[test]
fn solvers_agree_and_stiffness_scales_the_force() {
    let bench = Bench::new();
    let small = BLOCK
        .replace("80 mm\", \"80 mm", "40 mm\", \"40 mm")
        .replace("radius = \"15 mm\"", "radius = \"8 mm\"");
    bench.file("sparse.toml", &small);
    bench.file(
        "dense.toml",
        &format!("{small}\n[reference]\nsolver = \"dense-inverse\"\n"),
    );
    bench.file(
        "stiffer.toml",
        &small
            .replace("10 kPa", "20 kPa")
            .replace("40 kPa", "80 kPa"),
    );
    let [sparse, dense, stiffer] = ["sparse.toml", "dense.toml", "stiffer.toml"].map(|scene| {
        *forces(
            &bench.report(&[scene, "--json", "--frames", "0", "--no-retract"]),
            "load",
        )
        .last()
        .unwrap()
    });
    assert!((sparse / dense - 1.0).abs() < 1e-8, "{sparse} and {dense}");
    assert!(
        (stiffer / sparse - 2.0).abs() < 1e-8,
        "{stiffer} and {sparse}"
    );
}

#[test]
fn cut_faces_can_be_free_fixed_or_symmetric() {
    let bench = Bench::new();
    let force = |cut: &str| {
        let scene = bench.file(
            "scene.toml",
            &BLOCK.replace("[body]", &format!("[body]\ncut_faces = \"{cut}\"")),
        );
        *forces(
            &bench.report(&[&scene, "--json", "--frames", "0", "--no-retract"]),
            "load",
        )
        .last()
        .unwrap()
    };
    let (free, symmetric, fixed) = (force("free"), force("symmetric"), force("fixed"));
    assert!(
        free < symmetric && symmetric < fixed,
        "{free} {symmetric} {fixed}"
    );
}

#[test]
fn a_vertex_counts_in_the_file_whatever_is_mended_or_cut_away() {
    use palpa_mesh::Vec3;
    use palpa_mesh::generate::tube::{Ends, tube};
    let bench = Bench::new();
    let mut limb = tube(20, 24, Ends::Closed, |s, a| {
        Vec3::new(0.12 * s, 0.04 * a.cos(), 0.04 * a.sin())
    });
    // Caps first, every point twice removed from its place in the order of the triangles.
    limb.triangles.reverse();
    limb.points.insert(0, Vec3::new(9.0, 9.0, 9.0));
    limb.triangles.iter_mut().flatten().for_each(|v| *v += 1);
    palpa_mesh::write_surface(&bench.folder.path().join("limb.obj"), &limb).unwrap();
    let layer = "[[layer]]\ntissue = \"fat\"\nthickness = \"10 mm\"\nlevels = 2\n";
    let press = "[press]\nvertex = 250\ndepth = \"1 mm\"\nstep = \"1 mm\"\n";
    for cutout in ["", "cutout_radius = \"40 mm\"\n"] {
        bench.file(
            "limb.toml",
            &format!("[body]\nsurface = \"limb.obj\"\n{cutout}{layer}{press}"),
        );
        let report = bench.report(&["limb.toml", "--json", "--frames", "0", "--no-retract"]);
        let at: Vec<f64> = serde_json::from_value(report["press"]["at_m"].clone()).unwrap();
        assert!(
            (Vec3::from_column_slice(&at) - limb.points[250]).norm() < 1e-9,
            "{at:?}"
        );
    }
    // The hub of a cap is cut away with it.
    let hub = limb.points.len() - 1;
    let message = bench.refusal_of_part(&["limb.toml", &format!("--vertex={hub}")]);
    assert!(message.contains("not part of the grown skin"), "{message}");
}

#[test]
fn the_force_depends_little_on_the_step() {
    let bench = Bench::new();
    bench.file("block.toml", BLOCK);
    let force = |step: &str| {
        let args = [
            "block.toml",
            "--json",
            "--frames",
            "0",
            "--no-retract",
            "--step",
            step,
        ];
        *forces(&bench.report(&args), "load").last().unwrap()
    };
    let (coarse, fine) = (force("1.5 mm"), force("0.1 mm"));
    assert!((coarse / fine - 1.0).abs() < 0.05, "{coarse} and {fine}");
}

#[test]
fn bad_input_is_refused_in_one_paragraph() {
    let bench = Bench::new();
    let write = |name: &str, from: &str, to: &str| {
        assert!(BLOCK.contains(from), "{from}");
        bench.file(name, &BLOCK.replace(from, to))
    };
    let surface = |name: &str, file: &str| {
        let start = BLOCK.find("[[layer]]").unwrap();
        let layers = BLOCK[start..].replace("levels = 2\n[tool]", "thickness = \"5 mm\"\n[tool]");
        bench.file(name, &format!("[body]\nsurface = \"{file}\"\n{layers}"))
    };
    bench.file("not_a_mesh.ply", "this is no mesh");
    bench.file("lies.ply", "ply\nformat ascii 1.0\nelement vertex 1000000000\nproperty float x\nproperty float y\nproperty float z\nelement face 1000000000\nproperty list uchar int vertex_indices\nend_header\n");
    bench.file("nan.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    bench.file("no_faces.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    bench.file("a_file", "");
    write("block.toml", "10 kPa", "10 kPa");
    let scenes = [
        write("zero.toml", "10 kPa", "0 kPa"),
        write("negative.toml", "10 kPa", "-3 kPa"),
        write("deep.toml", "depth = \"3 mm\"", "depth = \"31 mm\""),
        write(
            "thick.toml",
            "thickness = \"10 mm\"",
            "thickness = \"35 mm\"",
        ),
        write("key.toml", "radius =", "radiu ="),
        write(
            "far.toml",
            "at = [\"0 mm\", \"0 mm\", \"0 mm\"]",
            "at = [\"0 mm\", \"9 m\", \"0 mm\"]",
        ),
        write(
            "varying.toml",
            "thickness = \"10 mm\"",
            "thickness = { axis = \"x\", table = [[\"-40 mm\", \"5 mm\"], [\"40 mm\", \"8 mm\"]] }",
        ),
        {
            let fine = BLOCK.replace("spacing = \"10 mm\"", "spacing = \"4 mm\"");
            bench.file(
                "dense.toml",
                &format!("{fine}\n[reference]\nsolver = \"dense-inverse\"\n"),
            )
        },
        write(
            "vertex.toml",
            "at = [\"0 mm\", \"0 mm\", \"0 mm\"]",
            "vertex = 812",
        ),
        surface("missing.toml", "nowhere.ply"),
        surface("format.toml", "not_a_mesh.ply"),
        surface("header.toml", "lies.ply"),
        surface("finite.toml", "nan.obj"),
        surface("empty.toml", "no_faces.obj"),
        write(
            "outward.toml",
            "at = [\"0 mm\", \"0 mm\", \"0 mm\"]",
            "at = [\"0 mm\", \"0 mm\", \"0 mm\"]\ndirection = [0, 0.2, 1]",
        ),
        "no_faces.obj".to_owned(),
        {
            bench.file("flat.obj", "v 0 0 0\nv 0.1 0 0\nv 0.2 0 0\nf 1 2 3\n");
            let body = "[body]\nsurface = \"flat.obj\"\ncutout_radius = \"50 mm\"\n";
            let layer = "[[layer]]\ntissue = \"fat\"\nthickness = \"5 mm\"\n";
            bench.file(
                "flat.toml",
                &format!("{body}{layer}[press]\nvertex = 0\ndepth = \"1 mm\"\n"),
            )
        },
        "nowhere.toml".to_owned(),
    ];
    let mut messages: Vec<String> = scenes.iter().map(|scene| bench.refusal(&[scene])).collect();
    for args in [
        ["block.toml", "--vertex=5000"],
        ["block.toml", "--at=0 mm,0 mm"],
        ["block.toml", "--at=0,0,0"],
        ["block.toml", "--depth=40 mm"],
        ["block.toml", "--step=9 mm"],
        ["block.toml", "--speed=1e-30 m/s"],
        ["block.toml", "--out=a_file/results"],
    ] {
        messages.push(bench.refusal(&args));
    }
    insta::assert_snapshot!(messages.join("\n"));
}

#[test]
fn the_shipped_scenes_can_be_read_and_those_without_files_pressed() {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let mut n = 0;
    for entry in fs::read_dir(scenes).unwrap() {
        let path = entry.unwrap().path();
        let scene = palpa_scene::Scene::load(&path).unwrap();
        n += 1;
        if matches!(scene.body.skin, palpa_scene::Skin::Generated(_)) {
            let built = palpa::build::build(&scene).unwrap();
            let indentation = palpa::press::reference::BarIndentation::build(&scene, &built);
            if !scene.tool.is_bonded() || !scene.lumps.is_empty() {
                // Bars neither touch nor hold a lump.
                let refusal = indentation.unwrap_err().to_string();
                assert!(refusal.contains("the reference method"), "{refusal}");
                continue;
            }
            let indentation = indentation.unwrap();
            let mut run = indentation.start(&built.growth.body);
            let force = (0..2).filter_map(|_| run.advance()).last().unwrap().force_n;
            assert!(force > 0.0, "{}: {force}", path.display());
        }
    }
    assert!(n >= 3);
}

#[test]
fn a_reader_that_leaves_does_not_keep_the_work_from_being_done() {
    let bench = Bench::new();
    bench.file("block.toml", BLOCK);
    let mut child = Command::new(env!("CARGO_BIN_EXE_palpa"))
        .current_dir(bench.folder.path())
        .args([
            "press",
            "--model",
            "reference",
            "block.toml",
            "--frames",
            "0",
        ])
        .stdout(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    assert!(child.wait().unwrap().success());
    let table = fs::read_to_string(bench.folder.path().join("out/press/press.csv")).unwrap();
    assert_eq!(table.lines().count(), 19);
}

#[cfg(unix)]
#[test]
fn ctrl_c_leaves_a_valid_table_of_what_was_done() {
    interrupt("reference", "4 mm");
    interrupt("tissue", "10 mm");
}

#[cfg(unix)]
fn interrupt(model: &str, spacing: &str) {
    let bench = Bench::new();
    // Hundreds of steps, of which a few are done when the interrupt comes.
    let scene = bench.file(
        "long.toml",
        &BLOCK
            .replace("10 mm\" }", &format!("{spacing}\" }}"))
            .replace("step = \"0.5 mm\"", "step = \"0.005 mm\""),
    );
    let mut child = Command::new(env!("CARGO_BIN_EXE_palpa"))
        .current_dir(bench.folder.path())
        .args(["press", "--model", model, &scene, "--frames", "200"])
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let out = bench.folder.path().join("out/press");
    // Not a wait for time but for what it does: the second frame of the series is there.
    while !out.join("series/body_001.vtu").exists() {
        assert!(
            child.try_wait().unwrap().is_none(),
            "it ended before it was interrupted"
        );
        std::thread::yield_now();
    }
    let kill = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    assert!(kill.success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(
        output.status.code(),
        Some(130),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let table = fs::read_to_string(out.join("press.csv")).unwrap();
    let rows: Vec<&str> = table.lines().collect();
    assert!(rows.len() > 2 && rows.len() < 1200, "{} rows", rows.len());
    let n_columns = rows[0].split(',').count();
    assert!(rows.iter().all(|row| row.split(',').count() == n_columns));
    let report: Value =
        serde_json::from_str(&fs::read_to_string(out.join("press.json")).unwrap()).unwrap();
    assert_eq!(report["samples"].as_array().unwrap().len(), rows.len() - 1);
    assert_eq!(report["result"]["is_complete"], false);
    assert!(out.join("press.pvd").is_file() && out.join("force_depth.png").is_file());
}
