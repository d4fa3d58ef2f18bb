//! The command as a process: exit codes, errors, help.

use std::fs;
use std::process::{Command, Output, Stdio};

fn palpa(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_palpa"));
    command.args(args).stdin(Stdio::null());
    command
}

/// Exit code and what people see, on standard output and standard error.
fn seen(command: &mut Command) -> (i32, String, String) {
    let Output {
        status,
        stdout,
        stderr,
    } = command.output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (status.code().unwrap(), text(stdout), text(stderr))
}

#[test]
fn a_word_that_is_no_command_is_bad_input() {
    let (code, stdout, stderr) = seen(&mut palpa(&["chek"]));
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
        let (code, stdout, stderr) = seen(&mut palpa(args));
        assert_eq!((code, stderr.as_str()), (0, ""), "{args:?}");
        let schema: serde_json::Value = serde_json::from_str(&stdout).unwrap();
        assert!(schema["title"].is_string(), "{args:?}");
    }
}

/// A square of two triangles, one of them twice: repairable.
const DOUBLED: &str = "v 0 0 0\nv 0.1 0 0\nv 0.1 0.1 0\nv 0 0.1 0\nf 1 2 3\nf 1 3 4\nf 1 3 4\n";

#[test]
fn an_output_folder_that_cannot_be_made_is_one_clear_error() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("skin.obj"), DOUBLED).unwrap();
    let mut command = palpa(&["check", "skin.obj", "--json", "--out", "skin.obj/out"]);
    let (code, stdout, stderr) = seen(command.current_dir(folder.path()));
    assert_eq!((code, stdout.as_str()), (2, ""));
    insta::assert_snapshot!(
        stderr.trim_end(),
        @r#"error: cannot write results to "skin.obj/out"; choose another folder with --out DIR: Not a directory (os error 20)"#
    );
}

#[test]
fn with_json_standard_output_is_json_alone() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("skin.obj"), DOUBLED).unwrap();
    let mut command = palpa(&["check", "skin.obj", "--json", "--out", "new/folder"]);
    let (code, stdout, stderr) = seen(command.current_dir(folder.path()));
    assert_eq!((code, stderr.as_str()), (1, ""));
    serde_json::from_str::<serde_json::Value>(&stdout).unwrap();
    assert!(folder.path().join("new/folder/skin_repaired.obj").is_file());
}

#[test]
fn no_colour_where_nobody_sees_it() {
    let (code, _, stderr) = seen(&mut palpa(&["check", "no such file.obj"]));
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
    let mut child = palpa(&["schema"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let Output { status, stderr, .. } = child.wait_with_output().unwrap();
    assert_eq!((status.code(), stderr.as_slice()), (Some(0), &b""[..]));
}
