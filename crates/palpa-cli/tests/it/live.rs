//! `palpa loop-report` and `palpa replay` as processes. No test asserts how punctual a machine is:
//! `loop-report` may end with 1.

use std::fs;

use palpa_testkit::{Bench, Layer, Scene};
use serde_json::Value;

use crate::palpa;

/// A gel that a simulated hand taps.
fn gel() -> Scene {
    Scene::block([60.0, 60.0, 15.0], 8.0)
        .layer(Layer::elastic("gel", "10 kPa").levels(2))
        .sphere(8.0)
        .press(3.0)
        .near_tool(4.0)
        .set("device", "preset", "falcon")
        .set("device", "grip", "medium")
        .motion("tap", 3.0)
        .set("motion", "speed", "30 mm/s")
}

/// Runs a scene in real time; the report.
fn loop_report(bench: &Bench, scene: &Scene, seconds: &str) -> Value {
    bench.file("gel.toml", scene);
    let (code, report) = bench.json(&[
        "loop-report",
        "gel.toml",
        "--seconds",
        seconds,
        "--json",
        "--out",
        "live",
    ]);
    assert!(code == 0 || code == 1, "{code}: {report}");
    let most = report["devices"][0]["max_force_n"].as_f64().unwrap();
    assert!(most > 0.02, "{report}");
    report
}

/// Replays the log bit for bit; the replay's report.
fn same_again(bench: &Bench) -> Value {
    let found = bench.report(&["replay", "live/log.mcap", "--json"]);
    assert_eq!(found["verdict"], "same", "{found}");
    found
}

#[test]
fn a_run_is_reported_logged_exported_and_the_same_again() {
    let bench = palpa();
    let report = loop_report(&bench, &gel(), "5");
    let ticks = report["ticks"].as_u64().unwrap();
    assert!(ticks > 100, "{ticks}");
    assert_eq!(report["lost_ticks"], 0);
    for file in [
        "loop.json",
        "loop_times.svg",
        "loop_times.png",
        "force_time.png",
        "force_depth.png",
    ] {
        assert!(bench.path("live").join(file).is_file(), "{file}");
    }
    let found = same_again(&bench);
    // The log has the ramp down at the end, too.
    assert!(found["ticks"].as_u64().unwrap() >= ticks);
    assert!(found["steps"].as_u64().unwrap() > 10);
    // Threads of the pool change no bit, and are named where they differ.
    let threads = ["1", "3"].map(|n| {
        let mut replay = bench.command(&["replay", "live/log.mcap", "--json"]);
        let output = replay.env("RAYON_NUM_THREADS", n).output().unwrap();
        let found: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(found["verdict"], "same", "{found}");
        let said = String::from_utf8(output.stderr).unwrap();
        let differences = found["differences"].as_array().unwrap().clone();
        assert!(differences.iter().all(|d| d["effect"] == "none"), "{found}");
        assert_eq!(
            said.contains("this changes no force"),
            !differences.is_empty(),
            "{said}"
        );
        differences.len()
    });
    assert!(threads.contains(&1), "{threads:?}");
    let export = [
        "replay",
        "live/log.mcap",
        "--export",
        "csv",
        "--out",
        "tables",
    ];
    assert_eq!(bench.run(&export).0, 0);
    let n_rows = bench.read("tables/ticks.csv").lines().count() as u64;
    assert_eq!(n_rows, found["ticks"].as_u64().unwrap() + 1);
    felt_where_it_presses(&bench.read("tables/device0.csv"));

    // Another body gives other forces, and the command says so.
    let stiffer = gel().with_layer(0, |_| Layer::elastic("gel", "12 kPa").levels(2));
    bench.file("other.toml", stiffer);
    let (code, found) = bench.json(&["replay", "live/log.mcap", "--scene", "other.toml", "--json"]);
    assert_eq!(
        (code, &found["verdict"]),
        (1, &Value::from("different")),
        "{found}"
    );
    assert!(found["max_force_difference_n"].as_f64().unwrap() > 1e-3);
}

/// Depth, force and place come first, and fit together: where the tool is over the flat skin there is no
/// force, and the largest is deep below it.
fn felt_where_it_presses(table: &str) {
    let mut lines = table.lines();
    let header = lines.next().unwrap();
    let lead = "time_s,depth_mm,force_n,place_x_mm,place_y_mm,place_z_mm,tick,";
    assert!(header.starts_with(lead), "{header}");
    let rows: Vec<Vec<Option<f64>>> = lines
        .map(|line| line.split(',').take(6).map(|c| c.parse().ok()).collect())
        .collect();
    let known: Vec<(f64, f64)> = rows.iter().filter_map(|r| Some((r[1]?, r[2]?))).collect();
    // The ramp down at the end has no reading of the device.
    assert!(
        known.len() > rows.len() / 2,
        "{} of {}",
        known.len(),
        rows.len()
    );
    let deepest = known.iter().map(|r| r.0).fold(0.0, f64::max);
    assert!(deepest > 1.0, "{deepest} mm");
    let above = known.iter().filter(|(depth, _)| *depth < -0.5);
    assert!(above.clone().count() > 0 && above.clone().all(|(_, force)| *force < 1e-3));
    let most = known.iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
    assert!(most.0 > 0.5 * deepest && most.1 > 0.02, "{most:?}");
}

/// The fine part of the mesh follows the tool: meshes come from the background, and a replay goes
/// through the same meshes.
#[test]
fn a_mesh_that_moves_is_the_same_again() {
    let bench = palpa();
    let scene = gel()
        .sized([140.0, 60.0, 15.0], 10.0)
        .set("mesh", "moves", true)
        .motion("drag", 3.0)
        .set("motion", "length", "80 mm")
        .set("motion", "times", palpa_testkit::Value::raw("2"));
    let report = loop_report(&bench, &scene, "8");
    assert!(report["tissue"]["meshes"].as_u64().unwrap() > 1, "{report}");
    same_again(&bench);
}

#[test]
fn scenes_that_cannot_be_felt_in_time_are_refused_or_reported() {
    let bench = palpa();
    let run = |scene: Scene| {
        bench.file("scene.toml", scene);
        bench.run(&[
            "loop-report",
            "scene.toml",
            "--seconds",
            "5",
            "--out",
            "live",
        ])
    };
    // Deeper than the gel.
    let (code, _, stderr) = run(gel().motion("tap", 30.0));
    assert!(
        code == 2 && stderr.contains("[motion] depth"),
        "{code} {stderr}"
    );
    // So fine that no step would be in time: refused before it is grown.
    let fine = gel()
        .sized([60.0, 60.0, 15.0], 0.5)
        .with_layer(0, |gel| gel.levels(8));
    let (code, _, stderr) = run(fine);
    assert!(
        code == 2 && stderr.contains("nodes, more than the 80000"),
        "{code} {stderr}"
    );
    // The loop has a continuum only.
    let (code, _, stderr) = run(gel().set("model", "kind", "reference"));
    assert!(
        code == 2 && stderr.contains("[model] kind is \"reference\""),
        "{code} {stderr}"
    );
    // So slow that it never touches.
    let (code, stdout, _) = run(gel().set("motion", "speed", "0.2 mm/s"));
    assert_eq!(code, 1, "{stdout}");
    assert!(stdout.contains("NOT GOOD: nothing was felt"), "{stdout}");
}

#[test]
fn a_scene_is_printed_to_be_changed() {
    let bench = palpa();
    let (code, scene, _) = bench.run(&["loop-report", "--print-scene"]);
    assert_eq!(code, 0);
    assert!(
        scene.contains("[motion]") && scene.contains("[device]"),
        "{scene}"
    );
    let printed = bench.report(&["loop-report", "--print-scene", "--json"]);
    let text = printed["scene"].as_str().unwrap();
    assert_eq!(text.trim_end(), scene.trim_end());
    bench.file("printed.toml", scene);
    assert_eq!(bench.run(&["check", "printed.toml"]).0, 0);
}

#[test]
fn a_stable_range_is_found() {
    let bench = palpa();
    let found = bench.report(&["z-width", "--device", "ideal", "--grip", "soft", "--json"]);
    assert_eq!(found["is_complete"], true);
    let stable = |observer: bool| -> Vec<f64> {
        let rows = found["rows"].as_array().unwrap().iter();
        rows.filter(|row| row["has_observer"] == observer)
            .map(|row| row["stiffness"].as_f64().unwrap())
            .collect()
    };
    let (without, with) = (stable(false), stable(true));
    assert_eq!((without.len(), with.len()), (9, 9));
    // What the law relies on is stable, and the observer takes nothing away.
    assert!(
        without[0] > 3000.0 && with[0] >= 0.98 * without[0],
        "{found}"
    );
    // Too much damping rattles as too much stiffness does.
    assert!(without[8] < without[1], "{found}");
    assert!(bench.path("out/z-width/z_width.png").is_file());
}

#[test]
fn a_file_that_is_no_log_is_refused() {
    let bench = palpa();
    bench.file("none.mcap", "no log");
    for file in ["none.mcap", "missing.mcap"] {
        let (code, _, stderr) = bench.run(&["replay", file]);
        assert_eq!(code, 2, "{stderr}");
        assert!(
            stderr.starts_with("error: ") && stderr.contains(file),
            "{stderr}"
        );
    }
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_a_run_and_keeps_its_log() {
    use std::process::Stdio;

    let bench = palpa();
    bench.file("gel.toml", gel());
    let args = [
        "loop-report",
        "gel.toml",
        "--seconds",
        "600",
        "--out",
        "live",
    ];
    let mut child = bench
        .command(&args)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let log = bench.path("live/log.mcap");
    palpa_testkit::wait_for("something is logged", || {
        assert!(
            child.try_wait().unwrap().is_none(),
            "it ended before it was interrupted"
        );
        let size = fs::metadata(&log).map_or(0, |m| m.len());
        (size > 10_000).then_some(())
    });
    palpa_testkit::interrupt(&child);
    assert_eq!(child.wait().unwrap().code(), Some(130));
    same_again(&bench);
}
