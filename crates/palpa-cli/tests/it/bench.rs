//! `palpa bench` as a process. How fast it is, no test says.

use std::fs;
use std::process::Command;

use palpa_lab::bench::{BenchRow, Mode};
use serde_json::Value;
use tempfile::TempDir;

fn bench(folder: &TempDir, args: &[&str]) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_palpa"))
        .arg("bench")
        .args(args)
        .current_dir(folder.path())
        .output()
        .unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (
        output.status.code().unwrap(),
        text(output.stdout),
        text(output.stderr),
    )
}

#[test]
fn a_quick_look_has_all_the_figures() {
    let folder = TempDir::new().unwrap();
    let (code, stdout, stderr) = bench(&folder, &["--quick", "--json", "--out", "out"]);
    assert_eq!((code, stderr.as_str()), (0, ""), "{stdout}");
    let report: Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!(report["is_complete"], true);
    let rows: Vec<BenchRow> = serde_json::from_value(report["rows"].clone()).unwrap();
    let modes: Vec<Mode> = rows.iter().map(|row| row.mode).collect();
    assert_eq!(modes, [Mode::Full, Mode::Zone]);
    for row in &rows {
        assert_eq!((row.nodes, row.levels), (324, 4));
        assert_eq!((row.n_failed, row.n_backed_off), (0, 0));
        assert!(row.steps_per_s > 0.0 && row.step_ms_p99 >= row.step_ms_median);
        assert!((row.steps_per_s * row.step_ms_median * 1e-3 - 1.0).abs() < 1e-9);
        assert!(row.travel_mm <= 0.25 + 1e-9 && row.tool_mm_per_s <= 50.0 + 1e-9);
        assert!(row.most_active > 0 && row.n_active_changes > 0);
        // The forces are those of the body, at any speed.
        assert!(row.step_error < 0.05, "{}", row.step_error);
        // Twelve millimetres between columns cannot be right.
        assert!(row.mesh_error.unwrap() > 0.02);
        assert!(row.total_error.unwrap() > 0.02);
    }
    let [full, zone] = &rows[..] else {
        panic!("two rows")
    };
    assert_eq!((full.zone_radius_mm, full.n_zone_switches), (None, 0));
    assert!(full.background_cpu_share.abs() < 1e-12);
    assert_eq!(zone.zone_radius_mm, Some(15.0));
    assert!(zone.n_zone_switches > 0 && zone.background_cpu_share > 0.0);
    assert!(zone.zone_nodes < full.zone_nodes);

    let ratios = report["ratios"].as_array().unwrap();
    assert!(
        ratios
            .iter()
            .all(|ratio| ratio["ratio"].as_f64().unwrap() > 0.0)
    );
    let against = |what: &str| {
        ratios
            .iter()
            .filter(|r| r["against"].as_str().unwrap().contains(what))
            .count()
    };
    assert_eq!((against("dense inverse"), against("faer")), (2, 2));
    let written = |name: &str| fs::read_to_string(folder.path().join("out").join(name)).unwrap();
    assert_eq!(written("bench.csv").lines().count(), 3);
    assert!(written("bench.svg").contains("steps per second"));
    assert!(folder.path().join("out/bench.png").is_file());
}

#[test]
fn an_unknown_case_names_the_known() {
    let folder = TempDir::new().unwrap();
    let (code, stdout, stderr) = bench(&folder, &["--case", "5k"]);
    assert_eq!((code, stdout.as_str()), (2, ""));
    assert!(
        stderr.contains("no case \"5k\"") && stderr.contains("4k-prony"),
        "{stderr}"
    );
}
