//! `palpa bench` as a process. No test asserts how fast it is.

use palpa_lab::bench::{BenchRow, Mode};

use crate::palpa;

#[test]
fn a_quick_look_has_all_the_figures() {
    let bench = palpa();
    let report = bench.report(&["bench", "--quick", "--json", "--out", "out"]);
    assert_eq!(report["is_complete"], true);
    let rows: Vec<BenchRow> = serde_json::from_value(report["rows"].clone()).unwrap();
    let modes: Vec<Mode> = rows.iter().map(|row| row.mode).collect();
    assert_eq!(modes, [Mode::Full, Mode::Zone]);
    for row in &rows {
        assert_eq!((row.nodes, row.levels), (324, 4));
        assert_eq!((row.n_failed, row.n_backed_off), (0, 0));
        assert!(row.steps_per_s > 0.0 && row.step_ms_p99 >= row.step_ms_median);
        // The rate has all costs: it is the number of steps over their whole time.
        assert!((row.steps_per_s * row.step_ms_mean * 1e-3 - 1.0).abs() < 1e-9);
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
    assert_eq!(bench.read("out/bench.csv").lines().count(), 3);
    assert!(bench.read("out/bench.svg").contains("steps per second"));
    assert!(bench.path("out/bench.png").is_file());
}

#[test]
fn an_unknown_case_names_the_known() {
    let (code, stdout, stderr) = palpa().run(&["bench", "--case", "5k"]);
    assert_eq!((code, stdout.as_str()), (2, ""));
    assert!(
        stderr.contains("no case \"5k\"") && stderr.contains("4k-prony"),
        "{stderr}"
    );
}

#[test]
fn scans_need_their_folder() {
    let (code, _, stderr) = palpa().run(&["bench", "--case", "shipped-calf"]);
    assert!(
        code == 2 && stderr.contains("shipped-calf needs --data"),
        "{stderr}"
    );
    let (code, _, stderr) = palpa().run(&["bench", "--list", "--data", "nowhere"]);
    assert!(
        code == 2 && stderr.contains("calf_skin_open_10k.ply"),
        "{stderr}"
    );
}
