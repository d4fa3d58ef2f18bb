//! Result files are whole or absent.

use std::fs;
use std::io;
use std::path::Path;

use palpa_plot::output::OutDir;
use palpa_testkit::without_system_errors;
use serde::Serialize;

#[derive(Serialize)]
struct Row {
    depth: f64,
    note: &'static str,
}

const ROWS: [Row; 2] = [
    Row {
        depth: 0.5,
        note: "a, \"b\"",
    },
    Row {
        depth: 1.0,
        note: "",
    },
];

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn a_finished_table_is_whole_and_alone() {
    let folder = tempfile::tempdir().unwrap();
    let dir = OutDir::create(folder.path().join("a/b")).unwrap();
    let mut table = dir.table("press.csv").unwrap();
    for row in &ROWS {
        table.push(row).unwrap();
    }
    let path = table.finish().unwrap();
    assert_eq!(
        fs::read_to_string(&path).unwrap(),
        "depth,note\n0.5,\"a, \"\"b\"\"\"\n1.0,\n"
    );
    assert_eq!(names(dir.path()), ["press.csv"]);
}

#[test]
fn rows_reach_the_disk_whole_and_an_unfinished_table_has_no_name() {
    let folder = tempfile::tempdir().unwrap();
    let dir = OutDir::create(folder.path().to_owned()).unwrap();
    let mut table = dir.table("press.csv").unwrap();
    table.push(&ROWS[1]).unwrap();
    let found = names(dir.path());
    assert!(
        found.len() == 1 && found[0].starts_with(".palpa-"),
        "{found:?}"
    );
    let text = fs::read_to_string(dir.path().join(&found[0])).unwrap();
    assert_eq!(text, "depth,note\n1.0,\n");
    drop(table);
    assert_eq!(names(dir.path()), Vec::<String>::new());
}

#[test]
fn a_failed_write_keeps_the_older_file() {
    let folder = tempfile::tempdir().unwrap();
    let dir = OutDir::create(folder.path().to_owned()).unwrap();
    dir.write("a.txt", b"old").unwrap();
    dir.write_with("a.txt", |w| {
        w.write_all(b"ne")?;
        Err(io::Error::other("full"))
    })
    .unwrap_err();
    assert_eq!(fs::read_to_string(dir.path().join("a.txt")).unwrap(), "old");
    assert_eq!(names(dir.path()), ["a.txt"]);
}

#[cfg(unix)]
#[test]
fn results_are_as_readable_as_other_files() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let dir = OutDir::create(folder.path().to_owned()).unwrap();
    let ours = dir.write("ours", b"").unwrap();
    let other = folder.path().join("other");
    fs::write(&other, b"").unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
    assert_eq!(mode(&ours), mode(&other));
}

#[test]
fn a_folder_that_cannot_be_made_says_what_where_and_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, b"").unwrap();
    let error = OutDir::create(file.join("out")).unwrap_err();
    let text = format!("{error:#}").replace(folder.path().to_str().unwrap(), "[folder]");
    insta::assert_snapshot!(
        without_system_errors(&text).replace('\\', "/"),
        @r#"cannot write results to "[folder]/file/out"; choose another folder with --out DIR: [system error]"#
    );
}
