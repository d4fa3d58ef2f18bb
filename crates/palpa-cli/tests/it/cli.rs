//! The command as a process: exit codes, errors, help.

use std::process::{Output, Stdio};

use palpa_testkit::without_system_errors;

use crate::palpa;

#[test]
fn a_word_that_is_no_command_is_bad_input() {
    let (code, stdout, stderr) = palpa().run(&["chek"]);
    assert_eq!(code, 2);
    assert_eq!(stdout, "");
    insta::assert_snapshot!(stderr.lines().next().unwrap(), @"error: unrecognized subcommand 'chek'");
}

#[test]
fn the_schema_is_json_with_and_without_the_flag() {
    for args in [
        &["schema"][..],
        &["schema", "--json"],
        &["--json", "schema"],
    ] {
        let (code, stdout, stderr) = palpa().run(args);
        assert_eq!((code, stderr.as_str()), (0, ""), "{args:?}");
        let schema: serde_json::Value = serde_json::from_str(&stdout).unwrap();
        assert!(schema["title"].is_string(), "{args:?}");
    }
}

/// A square of two triangles, one of them twice: repairable.
const DOUBLED: &str = "v 0 0 0\nv 0.1 0 0\nv 0.1 0.1 0\nv 0 0.1 0\nf 1 2 3\nf 1 3 4\nf 1 3 4\n";

#[test]
fn an_output_folder_that_cannot_be_made_is_one_clear_error() {
    let bench = palpa();
    bench.file("skin.obj", DOUBLED);
    let args = ["check", "skin.obj", "--json", "--out", "skin.obj/out"];
    let (code, stdout, stderr) = bench.run(&args);
    assert_eq!((code, stdout.as_str()), (2, ""));
    insta::assert_snapshot!(
        without_system_errors(stderr.trim_end()),
        @r#"error: cannot write results to "skin.obj/out"; choose another folder with --out DIR: [system error]"#
    );
}

#[test]
fn with_json_standard_output_is_json_alone() {
    let bench = palpa();
    bench.file("skin.obj", DOUBLED);
    let (code, stdout, stderr) = bench.run(&["check", "skin.obj", "--json", "--out", "new/folder"]);
    assert_eq!((code, stderr.as_str()), (1, ""));
    serde_json::from_str::<serde_json::Value>(&stdout).unwrap();
    assert!(bench.path("new/folder/skin_repaired.obj").is_file());
}

#[test]
fn no_colour_where_nobody_sees_it() {
    let (code, _, stderr) = palpa().run(&["check", "no such file.obj"]);
    assert_eq!(code, 2);
    assert!(
        stderr.starts_with("error: ") && !stderr.contains('\u{1b}'),
        "{stderr:?}"
    );
    assert!(stderr.contains("no such file.obj"), "{stderr:?}");
}

#[cfg(unix)]
#[test]
fn a_reader_that_leaves_early_is_no_error() {
    let bench = palpa();
    let mut child = bench
        .command(&["schema"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let Output { status, stderr, .. } = child.wait_with_output().unwrap();
    assert_eq!((status.code(), stderr.as_slice()), (Some(0), &b""[..]));
}
