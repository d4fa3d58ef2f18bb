//! The forces by which `palpa bench` judges its errors, computed again.

use palpa_lab::bench::refined::Problem;
use palpa_lab::bench::shipped::ShippedRow;
use palpa_testkit::Bench;

#[test]
fn the_recorded_forces_are_those_of_the_refined_meshes() {
    for problem in [Problem::Layers, Problem::OneTissue] {
        let (forces, nodes) = problem.compute().unwrap();
        assert!(!forces.is_empty());
        for known in forces {
            let recorded = problem.force_at(known.depth).unwrap();
            let error = known.force.z / recorded - 1.0;
            assert!(
                error.abs() < 1e-4,
                "{problem:?}, {nodes} nodes, {}: {error:e}",
                known.depth
            );
        }
    }
}

/// A shipped scene goes through the same door as the loop. Its forces are solved again on a finer mesh.
#[test]
fn a_shipped_scene_is_measured_at_a_place_drawn_at_random() {
    let bench = Bench::new(env!("CARGO_BIN_EXE_palpa"));
    let args = [
        "bench",
        "--case",
        "shipped-block",
        "--places",
        "1",
        "--poses",
        "1",
        "--json",
        "--out",
        "out",
    ];
    let report = bench.report(&args);
    assert_eq!(report["is_complete"], true);
    let row = &report["rows"][0];
    assert_eq!(row["case"], "shipped-block");
    assert_eq!(row["accuracy"], serde_json::Value::Null);
    let row: ShippedRow = serde_json::from_value(row.clone()).unwrap();
    assert_eq!(
        (row.n_places, row.n_poses, row.n_poses_failed),
        (1, 3, 0),
        "{row:?}"
    );
    assert!(
        row.steps_per_s_mean > 0.0 && row.step_ms_p99 > 0.0 && row.n_steps > 20,
        "{row:?}"
    );
    let (p95, max) = (row.total_error_p95.unwrap(), row.total_error_max.unwrap());
    assert!(p95 <= max && max < 0.5, "{row:?}");
    assert!(
        row.reference_nodes > row.nodes && row.reference_change.unwrap() < 0.02,
        "{row:?}"
    );
    assert!(
        row.hand_mm_per_s_min >= 5.0 && row.hand_mm_per_s_max <= 50.0,
        "{row:?}"
    );
    assert_eq!(bench.read("out/bench_shipped.csv").lines().count(), 2);
}
