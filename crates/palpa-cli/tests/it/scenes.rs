//! `palpa scenes`, and built-in scenes in the place of a scene file.

use palpa_scene::{BuiltIn, Scene};
use palpa_testkit::{Bench, Layer, Scene as SceneText};
use serde_json::Value;

use crate::palpa;

/// The one line with which a command refuses its arguments.
fn refusal(bench: &Bench, args: &[&str]) -> String {
    let (code, stdout, stderr) = bench.run(args);
    assert_eq!((code, stdout.as_str()), (2, ""), "{args:?}: {stderr}");
    assert_eq!(stderr.trim_end().lines().count(), 1, "{stderr}");
    stderr.trim_end().to_owned()
}

#[test]
fn all_built_in_scenes_are_listed() {
    let bench = palpa();
    let listed = bench.report(&["scenes", "--json"]);
    let listed = listed.as_array().unwrap();
    let names: Vec<&str> = listed.iter().map(|s| s["name"].as_str().unwrap()).collect();
    let known: Vec<&str> = BuiltIn::all().iter().map(|s| s.key).collect();
    assert_eq!(names, known);
    let limb = listed.iter().find(|s| s["name"] == "limb").unwrap();
    assert_eq!(limb["layers"], serde_json::json!(["skin", "fat", "muscle"]));
    assert_eq!(
        (&limb["motion"], &limb["depth_mm"], &limb["is_in_gallery"]),
        (&"palpate".into(), &8.0.into(), &true.into())
    );
    assert!(limb["tool"].as_str().unwrap().contains("friction 0.3"));
    assert!(limb.get("toml").is_none());
    let of_press = listed.iter().find(|s| s["name"] == "forearm_press");
    assert_eq!(of_press.unwrap()["default_of"][0], "palpa press");

    let (code, table, stderr) = bench.run(&["scenes"]);
    assert_eq!((code, stderr.as_str()), (0, ""));
    for built_in in BuiltIn::all() {
        let is_row = |line: &str| {
            line.split_whitespace().next() == Some(built_in.key) && line.ends_with(built_in.about)
        };
        assert!(table.lines().any(is_row), "{}: {table}", built_in.key);
    }
    let widest = table.lines().map(|line| line.chars().count()).max();
    assert!(widest.unwrap() <= 110, "{table}");
    assert!(table.lines().all(|line| line == line.trim_end()), "{table}");
}

#[test]
fn a_scene_is_printed_and_written_but_never_over_a_file() {
    let bench = palpa();
    let limb = BuiltIn::find("limb").unwrap().toml;
    let (code, printed, _) = bench.run(&["scenes", "limb"]);
    assert_eq!((code, printed.trim_end()), (0, limb.trim_end()));
    assert_eq!(bench.report(&["scenes", "limb", "--json"])["toml"], limb);

    let (code, said, _) = bench.run(&["scenes", "--write", "limb"]);
    assert!(code == 0 && said.starts_with("limb.toml: "), "{said}");
    assert_eq!(bench.read("limb.toml"), limb);
    bench.file("limb.toml", "mine");
    let again = refusal(&bench, &["scenes", "--write", "limb"]);
    assert!(again.contains("limb.toml\" exists already"), "{again}");
    // With several, none is written if one cannot be.
    refusal(&bench, &["scenes", "--write", "block", "limb"]);
    assert_eq!(bench.read("limb.toml"), "mine");
    assert!(!bench.path("block.toml").exists());

    // Into a folder, and under another name.
    let written = bench.report(&["scenes", "--write", "--out", "new/all", "--json"]);
    assert_eq!(written.as_array().unwrap().len(), BuiltIn::all().len());
    for built_in in BuiltIn::all() {
        let path = bench.path(&format!("new/all/{}.toml", built_in.key));
        assert_eq!(
            Scene::load(&path).unwrap().layers,
            built_in.scene().unwrap().layers
        );
    }
    let (code, ..) = bench.run(&["scenes", "block", "--out", "new/my.toml"]);
    assert_eq!(code, 0);
    assert_eq!(
        bench.read("new/my.toml"),
        BuiltIn::find("block").unwrap().toml
    );
    let two = refusal(&bench, &["scenes", "block", "limb", "--out", "two.toml"]);
    assert!(two.contains("names one file"), "{two}");
    let two = refusal(&bench, &["scenes", "block", "limb"]);
    assert!(two.contains("--write"), "{two}");
}

#[test]
fn a_name_that_is_nearly_right_is_answered_with_the_right_one() {
    let bench = palpa();
    bench.file("my_thigh.toml", "");
    std::fs::create_dir(bench.path("bodies")).unwrap();
    bench.file("bodies/elbow.toml", "");
    bench.file("skin.stl", "");
    let meant = |args: &[&str], meant: &str| {
        let said = refusal(&bench, args);
        assert!(
            said.contains(&format!("did you mean \"{meant}\"?")),
            "{said}"
        );
    };
    meant(&["scenes", "limbb"], "limb");
    meant(&["scenes", "--write", "forarm"], "forearm");
    for command in ["press", "view", "loop-report", "export"] {
        meant(&[command, "limbb"], "limb");
    }
    // A check has a line for each file, whatever it finds.
    for (file, right) in [("limbb", "limb"), ("skin.stil", "skin.stl")] {
        let (code, stdout, said) = bench.run(&["check", file]);
        assert_eq!(
            (code, &*stdout),
            (2, &*format!("{file}: cannot be read\n")),
            "{said}"
        );
        assert!(
            said.contains(&format!("did you mean \"{right}\"?")),
            "{said}"
        );
    }
    meant(&["view", "forarm", "--no-open"], "forearm");
    meant(&["press", "scenes/limb.toml"], "limb");
    meant(&["press", "my_tigh.toml"], "my_thigh.toml");
    let elbow = std::path::Path::new("bodies").join("elbow.toml");
    meant(&["press", "bodies/elbo.toml"], &elbow.display().to_string());
    let nothing = refusal(&bench, &["press", "qqq"]);
    assert!(!nothing.contains("did you mean"), "{nothing}");
    assert!(nothing.contains("`palpa scenes`"), "{nothing}");
    let template = refusal(&bench, &["press", "own_mesh"]);
    assert!(
        template.contains("palpa scenes --write own_mesh"),
        "{template}"
    );
}

/// A small block, a fraction of a second a step.
fn gel() -> SceneText {
    SceneText::block([60.0, 60.0, 20.0], 10.0)
        .layer(Layer::elastic("gel", "10 kPa").levels(2))
        .sphere(10.0)
        .press(2.0)
        .set("press", "step", "1 mm")
        .near_tool(5.0)
}

#[test]
fn a_file_comes_before_a_built_in_scene_and_a_folder_does_not() {
    let bench = palpa();
    let press = |scene: &str| {
        bench.report(&[
            "press",
            scene,
            "--json",
            "--frames",
            "0",
            "--no-error-bar",
            "--no-retract",
        ])
    };
    std::fs::create_dir(bench.path("patch_tissue")).unwrap();
    let built_in = press("patch_tissue");
    assert_eq!(built_in["scene"], "patch_tissue");
    assert_eq!(built_in["press"]["n_nodes"], 36);
    assert_eq!(press("Patch-Tissue")["press"]["n_nodes"], 36);
    std::fs::remove_dir(bench.path("patch_tissue")).unwrap();
    bench.file("patch_tissue", gel());
    let file = press("patch_tissue");
    assert_eq!(file["materials"][0]["tissue"], "gel");
    assert_ne!(file["press"]["n_nodes"], 36);
}

#[test]
fn every_command_takes_the_name_of_a_built_in_scene() {
    let bench = palpa();
    let bars = bench.report(&["press", "patch_bars", "--json", "--frames", "0"]);
    assert_eq!(
        (&bars["model"], &bars["scene"]),
        (&"reference".into(), &"patch_bars".into())
    );
    let (code, said, _) = bench.run(&["check", "block", "patch_tissue"]);
    assert!(code == 0 && said.starts_with("block: good"), "{said}");
    let (code, printed, _) = bench.run(&["loop-report", "block", "--print-scene"]);
    let block = BuiltIn::find("block").unwrap().toml;
    assert_eq!((code, printed.trim_end()), (0, block.trim_end()));
    // A deck holds no tool that touches, and says so.
    let touches = refusal(&bench, &["export", "forearm_press"]);
    assert!(touches.contains("presses by contact"), "{touches}");
    let deck = bench.report(&["export", "forearm_disc", "--json"]);
    assert_eq!(deck["scene"], "forearm_disc");
    let default: Value = bench.report(&["export", "--json"]);
    assert_eq!(default, deck);
}

#[test]
fn the_press_without_a_scene_touches_the_forearm_and_lets_it_go() {
    let bench = palpa();
    // A file of the name of the default scene is another scene.
    bench.file("forearm_press", gel());
    let args = [
        "press",
        "--json",
        "--frames",
        "0",
        "--no-error-bar",
        "--depth",
        "2 mm",
        "--step",
        "1 mm",
    ];
    let report = bench.report(&args);
    assert_eq!(report["scene"], "forearm_press");
    let tool = report["press"]["tool"].as_str().unwrap();
    assert!(tool.starts_with("sphere, radius 10.0 mm"), "{tool}");
    let samples = report["samples"].as_array().unwrap();
    let force = |sample: &Value| sample["force_n"].as_f64().unwrap();
    assert!(
        samples.iter().all(|s| force(s) >= 0.0),
        "a ball never pulls"
    );
    let last = samples.last().unwrap();
    assert_eq!(last["depth_mm"], 0.0);
    assert!(force(last).abs() < 1e-12, "{last}");
    assert!(report["result"]["max_force_n"].as_f64().unwrap() > 0.2);
    // Bars have no contact: their forearm is under a bonded disc.
    let args = ["press", "--model", "reference", "--json", "--frames", "0"];
    assert_eq!(bench.report(&args)["scene"], "forearm_disc");
}
