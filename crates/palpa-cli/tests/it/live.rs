//! `palpa loop-report` and `palpa replay` as processes. How punctual a machine is, no test says: `loop-report` may end with 1.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;

const SCENE: &str = r#"
[body]
generator = { kind = "block", size = ["60 mm", "60 mm", "15 mm"], spacing = "8 mm" }
[[layer]]
tissue = { name = "gel", young = "10 kPa", poisson = 0.45 }
levels = 2
[tool]
shape = "sphere"
radius = "8 mm"
[press]
at = ["0 mm", "0 mm", "0 mm"]
depth = "3 mm"
[mesh]
near_tool = "4 mm"
[device]
preset = "falcon"
grip = "medium"
[motion]
kind = "tap"
depth = "3 mm"
speed = "30 mm/s"
"#;

fn palpa(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_palpa"));
    command.args(args).current_dir(folder).stdin(Stdio::null());
    command
}

fn seen(command: &mut Command) -> (i32, Value, String) {
    let Output {
        status,
        stdout,
        stderr,
    } = command.output().unwrap();
    let stderr = String::from_utf8(stderr).unwrap();
    let json = serde_json::from_slice(&stdout).unwrap_or(Value::Null);
    (status.code().unwrap(), json, stderr)
}

fn bench() -> TempDir {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("gel.toml"), SCENE).unwrap();
    folder
}

/// Replays the log, to the bit.
fn same_again(folder: &TempDir) -> Value {
    let (code, found, stderr) = seen(&mut palpa(
        folder.path(),
        &["replay", "live/log.mcap", "--json"],
    ));
    assert_eq!(
        (code, &found["verdict"]),
        (0, &Value::from("same")),
        "{found} {stderr}"
    );
    found
}

#[test]
fn a_run_is_reported_logged_exported_and_the_same_again() {
    let folder = bench();
    let args = [
        "loop-report",
        "gel.toml",
        "--seconds",
        "5",
        "--json",
        "--out",
        "live",
    ];
    let (code, report, stderr) = seen(&mut palpa(folder.path(), &args));
    assert!(code == 0 || code == 1, "{code}: {stderr}");
    let ticks = report["ticks"].as_u64().unwrap();
    assert!(ticks > 100, "{ticks}");
    assert!(
        report["devices"][0]["max_force_n"].as_f64().unwrap() > 0.02,
        "{report}"
    );
    assert_eq!(report["lost_ticks"], 0);
    for file in [
        "loop.json",
        "loop_times.svg",
        "loop_times.png",
        "force_time.png",
        "force_depth.png",
    ] {
        assert!(folder.path().join("live").join(file).is_file(), "{file}");
    }
    let found = same_again(&folder);
    // The log has the ramp down at the end, too.
    assert!(found["ticks"].as_u64().unwrap() >= ticks);
    assert!(found["steps"].as_u64().unwrap() > 10);
    let export = [
        "replay",
        "live/log.mcap",
        "--export",
        "csv",
        "--out",
        "tables",
    ];
    assert_eq!(seen(&mut palpa(folder.path(), &export)).0, 0);
    let table = fs::read_to_string(folder.path().join("tables/ticks.csv")).unwrap();
    assert_eq!(
        table.lines().count() as u64,
        found["ticks"].as_u64().unwrap() + 1
    );

    // Another body gives other forces, and that is told.
    let other = SCENE.replace("10 kPa", "12 kPa");
    fs::write(folder.path().join("other.toml"), other).unwrap();
    let args = ["replay", "live/log.mcap", "--scene", "other.toml", "--json"];
    let (code, found, _) = seen(&mut palpa(folder.path(), &args));
    assert_eq!(
        (code, &found["verdict"]),
        (1, &Value::from("different")),
        "{found}"
    );
    assert!(found["max_force_difference_n"].as_f64().unwrap() > 1e-3);
}

/// The fine part of the mesh follows the tool: meshes come from the background, and a replay goes through the same.
#[test]
fn a_mesh_that_moves_is_the_same_again() {
    let folder = bench();
    let scene = SCENE
        .replace("spacing = \"8 mm\"", "spacing = \"10 mm\"")
        .replace("size = [\"60 mm\"", "size = [\"140 mm\"")
        .replace("near_tool = \"4 mm\"", "near_tool = \"4 mm\"\nmoves = true")
        .replace(
            "kind = \"tap\"",
            "kind = \"drag\"\nlength = \"80 mm\"\ntimes = 2",
        );
    fs::write(folder.path().join("gel.toml"), scene).unwrap();
    let args = [
        "loop-report",
        "gel.toml",
        "--seconds",
        "8",
        "--json",
        "--out",
        "live",
    ];
    let (code, report, stderr) = seen(&mut palpa(folder.path(), &args));
    assert!(code == 0 || code == 1, "{code}: {stderr}");
    assert!(report["tissue"]["meshes"].as_u64().unwrap() > 1, "{report}");
    assert!(
        report["devices"][0]["max_force_n"].as_f64().unwrap() > 0.02,
        "{report}"
    );
    same_again(&folder);
}

#[test]
fn what_cannot_be_felt_in_time_is_told() {
    let folder = bench();
    let args = |scene: &'static str| ["loop-report", scene, "--seconds", "5", "--out", "live"];
    // Deeper than the gel, and far off it.
    fs::write(
        folder.path().join("deep.toml"),
        SCENE.replace("depth = \"3 mm\"\nspeed", "depth = \"30 mm\"\nspeed"),
    )
    .unwrap();
    let (code, _, stderr) = seen(&mut palpa(folder.path(), &args("deep.toml")));
    assert!(
        code == 2 && stderr.contains("[motion] depth"),
        "{code} {stderr}"
    );
    // So fine that no step would be in time: refused before it is grown.
    fs::write(
        folder.path().join("fine.toml"),
        SCENE
            .replace("spacing = \"8 mm\"", "spacing = \"0.5 mm\"")
            .replace("levels = 2", "levels = 8"),
    )
    .unwrap();
    let (code, _, stderr) = seen(&mut palpa(folder.path(), &args("fine.toml")));
    assert!(
        code == 2 && stderr.contains("nodes, more than the 80000"),
        "{code} {stderr}"
    );
    // So slow that it never touches.
    fs::write(
        folder.path().join("slow.toml"),
        SCENE.replace("30 mm/s", "0.2 mm/s"),
    )
    .unwrap();
    let output = palpa(folder.path(), &args("slow.toml")).output().unwrap();
    let stdout = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(output.status.code(), Some(1), "{stdout}");
    assert!(stdout.contains("NOT GOOD: nothing was felt"), "{stdout}");
}

#[test]
fn a_scene_is_printed_to_be_changed() {
    let folder = bench();
    let output = palpa(folder.path(), &["loop-report", "--print-scene"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(0));
    let scene = String::from_utf8(output.stdout).unwrap();
    assert!(
        scene.contains("[motion]") && scene.contains("[device]"),
        "{scene}"
    );
    fs::write(folder.path().join("printed.toml"), scene).unwrap();
    assert_eq!(
        seen(&mut palpa(folder.path(), &["check", "printed.toml"])).0,
        0
    );
}

#[test]
fn a_stable_range_is_found() {
    let folder = bench();
    let args = ["z-width", "--device", "ideal", "--grip", "soft", "--json"];
    let (code, found, stderr) = seen(&mut palpa(folder.path(), &args));
    assert_eq!(code, 0, "{stderr}");
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
    assert!(folder.path().join("out/z-width/z_width.png").is_file());
}

#[test]
fn a_log_that_is_cut_off_or_none_is_told() {
    let folder = bench();
    fs::write(folder.path().join("none.mcap"), "no log").unwrap();
    for file in ["none.mcap", "missing.mcap"] {
        let (code, _, stderr) = seen(&mut palpa(folder.path(), &["replay", file]));
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
    let folder = bench();
    let mut child = palpa(
        folder.path(),
        &[
            "loop-report",
            "gel.toml",
            "--seconds",
            "600",
            "--out",
            "live",
        ],
    )
    .stdout(Stdio::null())
    .stderr(Stdio::null())
    .spawn()
    .unwrap();
    let log = folder.path().join("live/log.mcap");
    let start = Instant::now();
    while fs::metadata(&log).map_or(0, |m| m.len()) < 10_000 {
        assert!(
            child.try_wait().unwrap().is_none(),
            "it ended before it was interrupted"
        );
        assert!(
            start.elapsed() < Duration::from_mins(2),
            "nothing is logged"
        );
        std::thread::sleep(Duration::from_millis(20));
    }
    let kill = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    assert!(kill.success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    same_again(&folder);
}
