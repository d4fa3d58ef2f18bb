//! `palpa press` with the reference method as a person runs it: results, refusals, Ctrl-C.

use std::fs;
use std::process::Stdio;

use palpa_scene::BuiltIn;
use palpa_testkit::{Bench, Layer, Scene, Value as Toml, without_system_errors};
use serde_json::Value;

use crate::palpa;

/// A block of 9 × 9 vertices: a fraction of a second.
fn block() -> Scene {
    Scene::soft_over_stiff([80.0, 80.0, 30.0], 10.0, 10.0, 15.0)
        .press(3.0)
        .set("press", "step", "0.5 mm")
        .set("press", "hold", "0.2 s")
}

/// `palpa press` with one of the two models.
pub(crate) struct Press {
    pub(crate) bench: Bench,
    model: &'static str,
}

impl Press {
    pub(crate) fn with(model: &'static str) -> Self {
        Self {
            bench: palpa(),
            model,
        }
    }

    pub(crate) fn run(&self, args: &[&str]) -> (i32, String, String) {
        let command = ["press", "--model", self.model];
        self.bench.run(&[&command, args].concat())
    }

    /// The report of a press of a scene that succeeds.
    pub(crate) fn report(&self, scene: &Scene, args: &[&str]) -> Value {
        self.bench.file("scene.toml", scene);
        self.report_of("scene.toml", args)
    }

    /// The same of a scene file that is there.
    fn report_of(&self, file: &str, args: &[&str]) -> Value {
        let command = ["press", "--model", self.model, file, "--json"];
        self.bench.report(&[&command, args].concat())
    }

    pub(crate) fn refusal(&self, args: &[&str]) -> String {
        let (code, stdout, stderr) = self.run(args);
        assert_eq!(code, 2, "{args:?}: {stderr}");
        assert_eq!(stdout, "", "{args:?}: nothing is printed as a result");
        assert_eq!(
            stderr.trim_end().lines().count(),
            1,
            "one paragraph: {stderr}"
        );
        assert!(!self.bench.path("out/press/press.csv").exists());
        stderr
    }
}

/// Neither frames nor the way back: all that a force needs.
const FORCE: [&str; 3] = ["--frames", "0", "--no-retract"];

fn last_force(report: &Value) -> f64 {
    *forces(report, "load").last().unwrap()
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
    let press = Press::with("reference");
    let report = press.report(&block(), &["--frames", "3"]);
    let loading = forces(&report, "load");
    assert_eq!(loading.len(), 7);
    assert!(loading.windows(2).all(|f| f[1] > f[0]), "{loading:?}");
    // A soft layer over a stiffer one: between the two as uniform columns of the disc's area, up to
    // the field around.
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

    let out = press.bench.path("out/press");
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
    let press = Press::with("reference");
    let small = |soft: &str, stiff: &str| {
        Scene::block([40.0, 40.0, 30.0], 10.0)
            .layer(Layer::elastic("soft", soft).thick(10.0).levels(2))
            .layer(Layer::elastic("stiff", stiff).levels(2))
            .disc(8.0)
            .press(3.0)
            .set("press", "step", "0.5 mm")
            .set("press", "hold", "0.2 s")
    };
    let sparse = small("10 kPa", "40 kPa");
    let dense = sparse.clone().set("reference", "solver", "dense-inverse");
    let stiffer = small("20 kPa", "80 kPa");
    let [sparse, dense, stiffer] =
        [sparse, dense, stiffer].map(|scene| last_force(&press.report(&scene, &FORCE)));
    assert!((sparse / dense - 1.0).abs() < 1e-8, "{sparse} and {dense}");
    assert!(
        (stiffer / sparse - 2.0).abs() < 1e-8,
        "{stiffer} and {sparse}"
    );
}

#[test]
fn cut_faces_can_be_free_fixed_or_symmetric() {
    let press = Press::with("reference");
    let force = |cut: &str| {
        let scene = block().set("body", "cut_faces", cut);
        last_force(&press.report(&scene, &FORCE))
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
    let press = Press::with("reference");
    let mut limb = tube(20, 24, Ends::Closed, |s, a| {
        Vec3::new(0.12 * s, 0.04 * a.cos(), 0.04 * a.sin())
    });
    // Caps first, every point twice removed from its place in the order of the triangles.
    limb.triangles.reverse();
    limb.points.insert(0, Vec3::new(9.0, 9.0, 9.0));
    limb.triangles.iter_mut().flatten().for_each(|v| *v += 1);
    palpa_mesh::write_surface(&press.bench.path("limb.obj"), &limb).unwrap();
    let layer = "[[layer]]\ntissue = \"fat\"\nthickness = \"10 mm\"\nlevels = 2\n";
    let place = "[press]\nvertex = 250\ndepth = \"1 mm\"\nstep = \"1 mm\"\n";
    for cutout in ["", "cutout_radius = \"40 mm\"\n"] {
        press.bench.file(
            "limb.toml",
            format!("[body]\nsurface = \"limb.obj\"\n{cutout}{layer}{place}"),
        );
        let report = press.report_of("limb.toml", &FORCE);
        let at: Vec<f64> = serde_json::from_value(report["press"]["at_m"].clone()).unwrap();
        assert!(
            (Vec3::from_column_slice(&at) - limb.points[250]).norm() < 1e-9,
            "{at:?}"
        );
    }
    // The hub of a cap is cut away with it.
    let hub = limb.points.len() - 1;
    let (code, _, message) = press.run(&["limb.toml", &format!("--vertex={hub}")]);
    assert_eq!(code, 2, "{message}");
    assert!(message.contains("not part of the grown skin"), "{message}");
}

#[test]
fn the_force_depends_little_on_the_step() {
    let press = Press::with("reference");
    let force = |step: &str| {
        let scene = block().set("press", "step", step);
        last_force(&press.report(&scene, &FORCE))
    };
    let (coarse, fine) = (force("1.5 mm"), force("0.1 mm"));
    assert!((coarse / fine - 1.0).abs() < 0.05, "{coarse} and {fine}");
}

#[test]
fn bad_input_is_refused_in_one_paragraph() {
    let press = Press::with("reference");
    let file = |name, content: &str| press.bench.file(name, content);
    let write = |name, scene: Scene| press.bench.file(name, scene);
    // The layers and the press of the block on a surface of a file.
    let surface = |name, path: &str| {
        let text = block().with_layer(1, |stiff| stiff.thick(5.0)).to_string();
        let layers = &text[text.find("[[layer]]").unwrap()..];
        file(name, &format!("[body]\nsurface = \"{path}\"\n{layers}"))
    };
    let soft = |tissue: &str| block().with_layer(0, |_| Layer::of(tissue).thick(10.0).levels(2));
    file("not_a_mesh.ply", "this is no mesh");
    file(
        "lies.ply",
        "ply\nformat ascii 1.0\nelement vertex 1000000000\nproperty float x\nproperty float y\nproperty float z\nelement face 1000000000\nproperty list uchar int vertex_indices\nend_header\n",
    );
    file("nan.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    file("no_faces.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    file("flat.obj", "v 0 0 0\nv 0.1 0 0\nv 0.2 0 0\nf 1 2 3\n");
    file("a_file", "");
    write("block.toml", block());
    let thickness = Toml::raw(r#"{ axis = "x", table = [["-40 mm", "5 mm"], ["40 mm", "8 mm"]] }"#);
    let scenes = [
        write(
            "zero.toml",
            soft(r#"name = "soft", young = "0 kPa", poisson = 0.45"#),
        ),
        write(
            "negative.toml",
            soft(r#"name = "soft", young = "-3 kPa", poisson = 0.45"#),
        ),
        write("deep.toml", block().press(31.0)),
        write("thick.toml", block().with_layer(0, |soft| soft.thick(35.0))),
        file(
            "key.toml",
            &block().to_string().replace("radius =", "radiu ="),
        ),
        write(
            "far.toml",
            block().set("press", "at", Toml::lengths([0.0, 9000.0, 0.0])),
        ),
        write(
            "varying.toml",
            block().with_layer(0, |soft| soft.set("thickness", thickness)),
        ),
        write(
            "dense.toml",
            block()
                .sized([80.0, 80.0, 30.0], 4.0)
                .set("reference", "solver", "dense-inverse"),
        ),
        write(
            "vertex.toml",
            block()
                .without("press", "at")
                .set("press", "vertex", Toml::raw("812")),
        ),
        surface("missing.toml", "nowhere.ply"),
        surface("format.toml", "not_a_mesh.ply"),
        surface("header.toml", "lies.ply"),
        surface("finite.toml", "nan.obj"),
        surface("empty.toml", "no_faces.obj"),
        write(
            "outward.toml",
            block().set("press", "direction", Toml::raw("[0, 0.2, 1]")),
        ),
        "no_faces.obj",
        file(
            "flat.toml",
            "[body]\nsurface = \"flat.obj\"\ncutout_radius = \"50 mm\"\n[[layer]]\ntissue = \"fat\"\n\
             thickness = \"5 mm\"\n[press]\nvertex = 0\ndepth = \"1 mm\"\n",
        ),
        "nowhere.toml",
    ];
    let mut messages: Vec<String> = scenes.iter().map(|scene| press.refusal(&[scene])).collect();
    for args in [
        ["block.toml", "--vertex=5000"],
        ["block.toml", "--at=0 mm,0 mm"],
        ["block.toml", "--at=0,0,0"],
        ["block.toml", "--depth=40 mm"],
        ["block.toml", "--step=9 mm"],
        ["block.toml", "--speed=1e-30 m/s"],
        ["block.toml", "--out=a_file/results"],
    ] {
        messages.push(press.refusal(&args));
    }
    insta::assert_snapshot!(without_system_errors(&messages.join("\n")));
}

#[test]
fn bars_press_the_built_in_scenes_whose_tool_is_bonded() {
    let (mut n_refused, mut n_pressed) = (0, 0);
    for built_in in BuiltIn::all().iter().filter(|b| !b.is_template) {
        let scene = built_in.scene().unwrap();
        let built = palpa::build::build(&scene).unwrap();
        let indentation = palpa::press::reference::BarIndentation::build(&scene, &built);
        if !scene.tool.is_bonded() || !scene.lumps.is_empty() {
            // Bars neither touch nor hold a lump.
            let refusal = indentation.unwrap_err().to_string();
            assert!(refusal.contains("the reference method"), "{refusal}");
            n_refused += 1;
            continue;
        }
        let indentation = indentation.unwrap();
        let mut run = indentation.start(&built.growth.body);
        let force = (0..2).filter_map(|_| run.advance()).last().unwrap().force_n;
        assert!(force > 0.0, "{}: {force}", built_in.key);
        n_pressed += 1;
    }
    assert_eq!((n_refused, n_pressed), (9, 2));
}

#[test]
fn a_reader_that_leaves_does_not_keep_the_work_from_being_done() {
    let press = Press::with("reference");
    press.bench.file("block.toml", block());
    let args = [
        "press",
        "--model",
        "reference",
        "block.toml",
        "--frames",
        "0",
    ];
    let mut child = press
        .bench
        .command(&args)
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    assert!(child.wait().unwrap().success());
    let table = press.bench.read("out/press/press.csv");
    assert_eq!(table.lines().count(), 19);
}

#[cfg(unix)]
#[test]
fn ctrl_c_leaves_a_valid_table_of_what_was_done() {
    ctrl_c_during_a_press("reference", 4.0);
    ctrl_c_during_a_press("tissue", 10.0);
}

#[cfg(unix)]
fn ctrl_c_during_a_press(model: &'static str, spacing: f64) {
    let bench = palpa();
    // Hundreds of steps, of which a few are done when the interrupt comes.
    let scene = block()
        .sized([80.0, 80.0, 30.0], spacing)
        .set("press", "step", "0.005 mm");
    bench.file("long.toml", scene);
    let args = ["press", "--model", model, "long.toml", "--frames", "200"];
    let mut child = bench
        .command(&args)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let out = bench.path("out/press");
    palpa_testkit::wait_for("the second frame of the series", || {
        assert!(
            child.try_wait().unwrap().is_none(),
            "it ended before it was interrupted"
        );
        out.join("series/body_001.vtu").exists().then_some(())
    });
    palpa_testkit::interrupt(&child);
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
