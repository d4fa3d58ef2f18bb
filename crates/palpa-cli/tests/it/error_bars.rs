//! Error bars of `palpa press`, and meshes chosen by them.

use std::process::Stdio;

use palpa_testkit::{Layer, Lump, Scene as SceneText, Value as Toml};
use serde_json::Value;

use crate::press_tissue::{SIZE, array, arrays, column, number, tissue};

/// A small block that is pressed in two steps.
fn block() -> SceneText {
    SceneText::soft_over_stiff(SIZE, 8.0, 8.0, 10.0)
        .press(2.0)
        .set("press", "step", "1 mm")
        .set("press", "hold", "0 s")
}

/// The block under a tool of a single node.
fn under_a_node() -> SceneText {
    block()
        .set("tool", "shape", "node")
        .without("tool", "radius")
}

#[test]
fn every_force_has_an_error_bar_unless_it_is_left_out() {
    let press = tissue();
    let scene = SceneText::soft_over_stiff(SIZE, 8.0, 8.0, 10.0)
        .press(2.0)
        .set("press", "step", "1 mm");
    let report = press.report(&scene, &["--frames", "0"]);
    let samples = report["samples"].as_array().unwrap();
    assert!(samples.len() > 3);
    for sample in samples {
        let pressed = number(&sample["depth_mm"]) > 0.0;
        assert_eq!(number(&sample["error_bar_n"]) > 1e-9, pressed, "{sample}");
        assert!(number(&sample["extrapolated_n"]).is_finite());
    }
    let result = &report["result"];
    let (bar, at) = (
        &result["secant_stiffness_error_bar_n_per_mm"],
        number(&result["at_depth_mm"]),
    );
    let deepest = (samples.iter()).find(|s| number(&s["depth_mm"]) > at - 1e-6);
    let expected = number(&deepest.unwrap()["error_bar_n"]) / at;
    assert!((number(bar) - expected).abs() < 1e-9 * expected);
    let without = press.report(&scene, &["--frames", "0", "--no-error-bar"]);
    assert!(without["error_bars"].is_null());
    let all = without["samples"].as_array().unwrap();
    assert_eq!(all.len(), samples.len());
    for (with, without) in samples.iter().zip(all) {
        assert!(without["error_bar_n"].is_null());
        assert_eq!(with["force_n"], without["force_n"]);
    }
}

#[test]
fn the_change_by_a_lump_has_an_error_bar_and_errors_their_place() {
    let press = tissue();
    let scene = block().lump(Lump::sphere(4.0, "hard", "200 kPa").below(9.0));
    let report = press.report(&scene, &["--frames", "0", "--lump-change"]);
    let change = &report["lump_change"];
    let forces = column(&report, "force_n");
    let with = forces.iter().copied().fold(0.0, f64::max);
    // The tissue is elastic, so that the press itself is the elastic one.
    let sum = number(&change["without_n"]) + number(&change["change_n"]);
    assert!((sum - with).abs() < 1e-4 * with, "{sum} N, {with} N");
    let bar = number(&change["error_bar_n"]);
    assert!(
        number(&change["change_n"]) > 2.0 * bar && bar > 0.0,
        "{change}"
    );

    let [point, _] = arrays(&press.bench.path("out/press/error_bars.vtu"));
    let bars = array(&point, "displacement_error_bar");
    assert_eq!(
        bars.len() as u64,
        report["press"]["n_nodes"].as_u64().unwrap()
    );
    let names = ["moved_near", "moved_skin_far", "moved_levels_deep"];
    let moves = names.map(|name| array(&point, name));
    for (i, bar) in bars.iter().enumerate() {
        let sum: f64 = moves.iter().map(|of| of[i]).sum();
        assert!((2.0 * sum - bar).abs() <= 1e-5 * bar);
    }
    // Errors are far smaller than the depth, and not everywhere.
    let largest = bars.iter().copied().fold(0.0, f64::max);
    assert!((1e-6..1e-3).contains(&largest), "{largest} m");
    assert!(bars.iter().any(|&bar| bar < 1e-2 * largest));
}

#[test]
fn a_mesh_is_chosen_for_an_accuracy() {
    let press = tissue();
    let report = press.report(&block(), &["--frames", "0", "--accuracy", "40 %"]);
    let choice = &report["mesh_choice"];
    assert_eq!(choice["end"]["kind"], "reached");
    let best = choice["best"].as_u64().unwrap() as usize;
    assert_eq!(
        choice["rounds"][best]["n_nodes"],
        report["press"]["n_nodes"]
    );
    let half_width = number(&choice["rounds"][best]["half_width"]);
    let deepest = (report["samples"].as_array().unwrap().iter())
        .find(|s| number(&s["depth_mm"]) > 1.99)
        .unwrap();
    let bar = number(&deepest["error_bar_n"]) / number(&deepest["force_n"]);
    assert!(half_width <= 0.4 && (bar - half_width).abs() < 0.01 * bar);
    // In relaxing tissue, load steps are part of the bar here too.
    let relaxing = r#"name = "gel", young = "20 kPa", poisson = 0.45, prony = { terms = [{ g = 0.6, tau = "0.1 s" }] }"#;
    let relaxing = SceneText::block(SIZE, 8.0)
        .layer(Layer::of(relaxing).levels(2))
        .disc(10.0)
        .press(2.0)
        .set("press", "step", "1 mm");
    let report = press.report(&relaxing, &["--frames", "0", "--accuracy", "40 %"]);
    let load_step = number(&report["error_bars"]["load_step"]);
    assert!(load_step.abs() > 1e-6, "{load_step}");
}

#[test]
fn an_accuracy_that_is_not_reached_keeps_what_was_there() {
    let press = tissue();
    let scene = block().set("mesh", "max_vertices", Toml::raw("150"));
    press.report(&scene, &["--frames", "0", "--no-error-bar"]);
    let before = press.bench.read("out/press/press.json");
    let (code, tried, said) = press.run(&["scene.toml", "--accuracy", "0.2 %"]);
    assert_eq!(code, 2, "{said}");
    assert!(tried.contains("error bar of ±0.2 %"), "{tried}");
    assert!(
        said.contains("an accuracy of 0.2 % was not reached"),
        "{said}"
    );
    assert!(said.contains("raise max_vertices"), "{said}");
    assert_eq!(press.bench.read("out/press/press.json"), before);
    let choice: Value =
        serde_json::from_str(&press.bench.read("out/press/mesh_choice.json")).unwrap();
    let bar = number(&choice["rounds"][0]["half_width"]);
    // What it says to ask for instead can be asked for.
    let asked = said.split("ask for --accuracy \"").nth(1);
    match asked.and_then(|rest| rest.split(" %").next()) {
        Some(asked) => {
            let asked: f64 = asked.parse().unwrap();
            assert!((100.0 * bar..=50.0).contains(&asked), "{said}");
        }
        None => assert!(bar > 0.5, "{said}"),
    }
}

#[test]
fn an_accuracy_that_cannot_be_is_refused_before_the_work() {
    let press = tissue();
    let few = SceneText::soft_over_stiff(SIZE, 5.0, 8.0, 10.0).set(
        "mesh",
        "max_vertices",
        Toml::raw("100"),
    );
    let file = press.bench.file("few", few);
    let said = press.refusal(&[file, "--accuracy", "3 %"]);
    assert!(
        said.contains("before it is refined, and max_vertices in [mesh] is 100"),
        "{said}"
    );
    let file = press.bench.file("block", block());
    for share in ["0 %", "-3 %"] {
        let said = press.refusal(&[file, "--accuracy", share]);
        assert!(
            said.contains("outside the allowed range 0.2 % to 50 %"),
            "{said}"
        );
    }
    let said = press.refusal(&[file, "--max-time", "60 s"]);
    assert!(said.contains("add --accuracy"), "{said}");
    let node = under_a_node();
    let file = press.bench.file("node", &node);
    let said = press.refusal(&[file, "--accuracy", "3 %"]);
    assert!(said.contains("tool of a single node"), "{said}");
    let file = press
        .bench
        .file("exact", node.set("mesh", "accuracy", "3 %"));
    let said = press.refusal(&[file]);
    assert!(said.contains("tool of a single node"), "{said}");
    let file = press
        .bench
        .file("asks", block().set("mesh", "accuracy", "30 %"));
    let said = press.refusal(&[file, "--no-error-bar"]);
    assert!(said.contains("leave out --no-error-bar"), "{said}");
}

#[test]
fn a_press_without_error_bars_says_why() {
    let press = tissue();
    let report = press.report(&under_a_node(), &["--frames", "0"]);
    assert!(report["error_bars"].is_null());
    let notes = report["notes"].to_string();
    assert!(
        notes.contains("no error bars") && notes.contains("single node"),
        "{notes}"
    );
}

#[test]
fn a_length_that_the_accuracy_replaces_is_noted() {
    let press = tissue();
    let report = press.report(
        &block().near_tool(5.0),
        &["--frames", "0", "--accuracy", "40 %"],
    );
    let notes = report["notes"].to_string();
    assert!(
        notes.contains("`near_tool` of the scene is not used"),
        "{notes}"
    );
}

#[cfg(unix)]
#[test]
fn ctrl_c_during_the_probes_keeps_the_press_and_says_why_there_are_no_bars() {
    let press = tissue();
    // Probes of a second and more, in a press of a single step.
    let scene = block().near_tool(2.0).set("press", "step", "2 mm").set(
        "press",
        "retract",
        Toml::raw("false"),
    );
    press.bench.file("scene.toml", scene);
    let mut child = press
        .bench
        .command(&["press", "scene.toml", "--frames", "2"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let out = press.bench.path("out/press");
    palpa_testkit::wait_for("the deepest frame", || {
        assert!(
            child.try_wait().unwrap().is_none(),
            "it ended before it was interrupted"
        );
        out.join("series/body_001.vtu").exists().then_some(())
    });
    palpa_testkit::interrupt(&child);
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let report: Value = serde_json::from_str(&press.bench.read("out/press/press.json")).unwrap();
    assert_eq!(report["samples"].as_array().unwrap().len(), 2);
    assert!(report["error_bars"].is_null());
    let notes = report["notes"].to_string();
    assert!(
        notes.contains("interrupted before they were computed"),
        "{notes}"
    );
}
