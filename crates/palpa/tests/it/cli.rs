//! The command as a process: exit codes, errors, help.

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
