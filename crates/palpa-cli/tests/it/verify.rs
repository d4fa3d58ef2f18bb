//! `palpa verify` as a process.

use std::fs;

use serde_json::{Value, json};

use crate::palpa;

#[test]
fn figures_within_tolerance_are_printed_and_written() {
    let bench = palpa();
    let (code, stdout, stderr) = bench.run(&["verify", "patch", "LAME", "--out", "out"]);
    assert_eq!((code, stderr.as_str()), (0, ""), "{stdout}");
    assert!(stdout.starts_with("patch: uniform strain"), "{stdout}");
    assert!(stdout.contains("\nlame: thick cylinder"), "{stdout}");
    let last = stdout.lines().last().unwrap();
    let n_rows = bench.read("out/verify.csv").lines().count() - 1;
    assert_eq!(last, format!("{n_rows} of {n_rows} within tolerance"));
    let json = bench.read("out/verify.json");
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json.as_array().unwrap().len(), n_rows);
    let svg = bench.read("out/convergence.svg");
    assert!(svg.contains("thick cylinder") && svg.contains("tolerance"));
    assert!(bench.path("out/convergence.png").is_file());
    let study = bench.read("out/convergence.csv");
    assert!(
        study.starts_with("case,series,h,nodes,error\nlame,"),
        "{study}"
    );

    // A later run without a study leaves no picture of an older one.
    let (code, stdout, _) = bench.run(&["verify", "patch", "--out", "out"]);
    assert_eq!(code, 0);
    assert!(!stdout.contains("convergence"), "{stdout}");
    assert!(!bench.path("out/convergence.png").exists());
}

#[test]
fn the_json_is_a_list_of_figures() {
    let bench = palpa();
    let (code, stdout, stderr) = bench.run(&["verify", "prony", "--json"]);
    assert_eq!((code, stderr.as_str()), (0, ""));
    let rows: Vec<serde_json::Map<String, Value>> = serde_json::from_str(&stdout).unwrap();
    assert!(rows.len() > 10);
    for row in rows {
        let keys: Vec<&str> = row.keys().map(String::as_str).collect();
        let mut wanted = [
            "case",
            "quantity",
            "reference",
            "computed",
            "rel_error",
            "tolerance",
            "nodes",
            "pass",
        ];
        wanted.sort_unstable();
        let mut sorted = keys.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, wanted);
        assert_eq!(row["case"], "prony");
        assert_eq!(row["pass"], true);
        let [reference, computed, error, tolerance] =
            ["reference", "computed", "rel_error", "tolerance"].map(|k| row[k].as_f64().unwrap());
        assert!(
            (computed / reference - 1.0 - error).abs() < 1e-12,
            "{row:?}"
        );
        assert!(error.abs() <= tolerance && row["nodes"].as_u64().unwrap() > 0);
    }
}

/// A patch of 16 wedges in a cube of 1 m, with stresses that no law has.
fn wrong_patch() -> Value {
    let mut nodes = Vec::new();
    for level in 0..3 {
        for j in 0..3 {
            for i in 0..3 {
                nodes.push([i, j, level].map(|n: i32| 0.5 * f64::from(n)));
            }
        }
    }
    let mut wedges = Vec::new();
    for below in [0, 9] {
        for corner in [0, 1, 3, 4] {
            for [a, b, c] in [[0, 1, 4], [0, 4, 3]] {
                let lower = [a, b, c].map(|n| below + corner + n);
                wedges.push([lower, lower.map(|n| n + 9)].concat());
            }
        }
    }
    let unit = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    json!({
        "nodes": nodes,
        "wedges": wedges,
        "E": 30e3,
        "nu": 0.45,
        "grad_u_small": [[1e-3, 0.0, 0.0], [0.0, 2e-3, 0.0], [0.0, 0.0, 1e-3]],
        "sigma_small": unit,
        "F_large": [[1.2, 0.1, 0.0], [0.0, 0.9, 0.0], [0.0, 0.0, 1.1]],
        "PK1_large": unit,
    })
}

#[test]
fn a_figure_out_of_tolerance_is_exit_code_1() {
    let bench = palpa();
    bench.file("V_wedge_patch_test.json", wrong_patch().to_string());
    let (code, stdout, stderr) = bench.run(&["verify", "v-patch", "--reference", "."]);
    assert_eq!((code, stderr.as_str()), (1, ""), "{stdout}");
    // Two against the stresses given; the others need none.
    assert_eq!(stdout.matches("FAIL").count(), 2, "{stdout}");
    assert!(stdout.ends_with("4 of 6 within tolerance\n"), "{stdout}");
}

#[test]
fn bad_input_is_refused_in_one_line() {
    let bench = palpa();
    fs::create_dir(bench.path("empty")).unwrap();
    for (args, said) in [
        (
            &["pach"][..],
            "there is no case \"pach\"; the cases are patch, columns, ",
        ),
        (
            &["patch", "--reference", "nowhere"],
            "there is no folder \"nowhere\"",
        ),
        (&["B1"], "name their folder with --reference DIR"),
        (
            &["B1", "--reference", "empty"],
            "empty/B1_homogeneous_block.csv",
        ),
    ] {
        let (code, stdout, stderr) = bench.run(&[&["verify"], args].concat());
        assert_eq!((code, stdout.as_str()), (2, ""), "{args:?}");
        let stderr = stderr.replace('\\', "/");
        assert!(stderr.contains(said), "{args:?}: {stderr}");
        assert_eq!(stderr.lines().count(), 1, "{stderr}");
    }
}

#[test]
fn the_list_names_every_case() {
    let bench = palpa();
    let (code, stdout, _) = bench.run(&["verify", "--list"]);
    assert_eq!(code, 0);
    assert!(!palpa_lab::verify::cases().is_empty());
    for case in palpa_lab::verify::cases() {
        let name = case.name.replace(' ', "-");
        assert!(stdout.contains(&name) && stdout.contains(case.title));
    }
    let (_, stdout, _) = bench.run(&["verify", "--list", "--json", "B2"]);
    let listed: Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!(listed.as_array().unwrap().len(), 1);
    assert_eq!(listed[0]["name"], "B2");
    assert_eq!(listed[0]["needs_reference"], true);
    assert!(!bench.path("out").exists());
}

#[test]
fn error_bars_of_drawn_presses_are_checked_and_kept() {
    let bench = palpa();
    let run = || bench.run(&["verify", "--error-bars", "1", "--out", "out"]);
    let (code, stdout, stderr) = run();
    assert_eq!((code, stderr.as_str()), (0, ""), "{stdout}");
    assert!(stdout.starts_with("0: disc on limb"), "{stdout}");
    assert!(stdout.contains("1 of 1 presses"), "{stdout}");
    let table = bench.read("out/error_bars.csv");
    assert!(table.starts_with("seed,tool,body,depth_mm,"), "{table}");
    let json: Value = serde_json::from_str(&bench.read("out/error_bars.json")).unwrap();
    assert_eq!(json["summary"]["coverage"], json!(1.0));
    assert!(json["summary"]["median_error"].as_f64().unwrap() > 0.005);
    assert!(bench.read("out/error_bars.svg").contains("true error"));
    assert!(bench.path("out/error_bars.png").is_file());

    // A press that is in the table is not computed again.
    let (code, stdout, _) = run();
    assert_eq!(code, 0);
    assert!(!stdout.contains("0: disc"), "{stdout}");
    assert_eq!(bench.read("out/error_bars.csv"), table);

    fs::write(bench.path("out/error_bars.csv"), "a,b\n1,2\n").unwrap();
    let (code, _, stderr) = run();
    assert_eq!(code, 2);
    assert!(
        stderr.contains("is not a table of error bars; remove it"),
        "{stderr}"
    );
    assert_eq!(bench.read("out/error_bars.csv"), "a,b\n1,2\n");
    let (code, _, stderr) = bench.run(&["verify", "--error-bars", "0"]);
    assert_eq!(code, 2);
    assert!(stderr.contains("at least one press"), "{stderr}");
}
