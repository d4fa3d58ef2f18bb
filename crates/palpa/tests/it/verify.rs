//! `palpa verify` as a process.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;

fn verify(folder: &Path, args: &[&str]) -> (i32, String, String) {
    let Output {
        status,
        stdout,
        stderr,
    } = Command::new(env!("CARGO_BIN_EXE_palpa"))
        .arg("verify")
        .args(args)
        .current_dir(folder)
        .output()
        .unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (status.code().unwrap(), text(stdout), text(stderr))
}

#[test]
fn figures_within_tolerance_are_printed_and_written() {
    let folder = TempDir::new().unwrap();
    let (code, stdout, stderr) = verify(folder.path(), &["patch", "LAME", "--out", "out"]);
    assert_eq!((code, stderr.as_str()), (0, ""), "{stdout}");
    assert!(stdout.starts_with("patch: uniform strain"), "{stdout}");
    assert!(stdout.contains("\nlame: thick cylinder"), "{stdout}");
    let last = stdout.lines().last().unwrap();
    let n_rows = fs::read_to_string(folder.path().join("out/verify.csv"))
        .unwrap()
        .lines()
        .count()
        - 1;
    assert_eq!(last, format!("{n_rows} of {n_rows} within tolerance"));
    let json = fs::read_to_string(folder.path().join("out/verify.json")).unwrap();
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json.as_array().unwrap().len(), n_rows);
    let svg = fs::read_to_string(folder.path().join("out/convergence.svg")).unwrap();
    assert!(svg.contains("thick cylinder") && svg.contains("tolerance"));
    assert!(folder.path().join("out/convergence.png").is_file());
    let study = fs::read_to_string(folder.path().join("out/convergence.csv")).unwrap();
    assert!(
        study.starts_with("case,series,h,nodes,error\nlame,"),
        "{study}"
    );

    // A later run without a study leaves no picture of an older one.
    let (code, stdout, _) = verify(folder.path(), &["patch", "--out", "out"]);
    assert_eq!(code, 0);
    assert!(!stdout.contains("convergence"), "{stdout}");
    assert!(!folder.path().join("out/convergence.png").exists());
}

#[test]
fn the_json_is_a_list_of_figures() {
    let folder = TempDir::new().unwrap();
    let (code, stdout, stderr) = verify(folder.path(), &["prony", "--json"]);
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

/// A table that no model of the block could meet: the force on it is a million times too large.
#[test]
fn a_figure_out_of_tolerance_is_exit_code_1() {
    let folder = TempDir::new().unwrap();
    let put = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    put(
        "B1_homogeneous_block.csv",
        "depth_m,F_N_extrapolated\n1e-6,1000\n",
    );
    put("B1_surface_profile_F2.csv", "depth_m,X_m,uz_m\n");
    let (code, stdout, stderr) = verify(folder.path(), &["B1", "--reference", "."]);
    assert_eq!((code, stderr.as_str()), (1, ""), "{stdout}");
    assert!(stdout.contains("FAIL"), "{stdout}");
    assert!(stdout.ends_with("0 of 1 within tolerance\n"), "{stdout}");
}

#[test]
fn bad_input_is_refused_in_one_line() {
    let folder = TempDir::new().unwrap();
    fs::create_dir(folder.path().join("empty")).unwrap();
    for (args, said) in [
        (
            &["pach"][..],
            "there is no case \"pach\"; the cases are patch, columns, ",
        ),
        (
            &["patch", "--reference", "nowhere"],
            "there is no folder \"nowhere\"",
        ),
        (&["B1"], "say where they are: --reference DIR"),
        (
            &["B1", "--reference", "empty"],
            "empty/B1_homogeneous_block.csv",
        ),
    ] {
        let (code, stdout, stderr) = verify(folder.path(), args);
        assert_eq!((code, stdout.as_str()), (2, ""), "{args:?}");
        assert!(stderr.contains(said), "{args:?}: {stderr}");
        assert_eq!(stderr.lines().count(), 1, "{stderr}");
    }
}

#[test]
fn the_list_names_every_case() {
    let folder = TempDir::new().unwrap();
    let (code, stdout, _) = verify(folder.path(), &["--list"]);
    assert_eq!(code, 0);
    for case in palpa::verify::cases() {
        let name = case.name.replace(' ', "-");
        assert!(stdout.contains(&name) && stdout.contains(case.title));
    }
    let (_, stdout, _) = verify(folder.path(), &["--list", "--json", "B2"]);
    let listed: Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!(listed.as_array().unwrap().len(), 1);
    assert_eq!(listed[0]["name"], "B2");
    assert_eq!(listed[0]["needs_reference"], true);
    assert!(!folder.path().join("out").exists());
}
