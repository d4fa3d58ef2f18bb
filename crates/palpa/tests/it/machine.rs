//! Compiler and libraries of a log's header.

use std::fs;

use palpa::live::machine;

#[path = "../../build/lock.rs"]
mod lock;

const LOCK: &str = r#"version = 4

[[package]]
name = "faer"
version = "0.24.4"
source = "registry+https://github.com/rust-lang/crates.io-index"
dependencies = [
 "pulp",
]

[[package]]
name = "nalgebra"
version = "0.33.0"

[[package]]
name = "nalgebra"
version = "0.35.0"

[[package]]
name = "serde"
version = "1.0.0"
"#;

#[test]
fn libraries_are_read_from_a_lock_file() {
    assert_eq!(lock::versions(LOCK), "faer 0.24.4;nalgebra 0.33.0+0.35.0");
    assert_eq!(lock::versions(""), "");
}

/// In a checkout and in the workspace of a user the folder of results is below the lock file; the
/// lock file of a packaged crate lies beside its manifest.
#[test]
fn the_lock_file_is_found_from_the_results_and_from_the_manifest() {
    let folder = tempfile::tempdir().unwrap();
    let at = |path: &str| folder.path().join(path);
    fs::create_dir_all(at("workspace/target/debug/build/out")).unwrap();
    fs::create_dir_all(at("registry/palpa")).unwrap();
    fs::create_dir_all(at("elsewhere/out")).unwrap();
    fs::write(at("registry/palpa/Cargo.lock"), LOCK).unwrap();
    fs::write(at("workspace/Cargo.lock"), LOCK.replace("0.24.4", "0.24.5")).unwrap();
    // One of a program without our libraries is passed over.
    fs::write(at("elsewhere/Cargo.lock"), "version = 4\n").unwrap();
    let found = |out: &str| {
        let starts = [at(out), at("registry/palpa")];
        lock::find(&starts).map(|(path, versions)| {
            let path = path.strip_prefix(folder.path()).unwrap().to_owned();
            (
                path.display().to_string(),
                versions.split(';').next().unwrap().to_owned(),
            )
        })
    };
    let of = |path: &str, faer: &str| Some((path.to_owned(), faer.to_owned()));
    assert_eq!(
        found("workspace/target/debug/build/out"),
        of("workspace/Cargo.lock", "faer 0.24.5")
    );
    assert_eq!(
        found("elsewhere/out"),
        of("registry/palpa/Cargo.lock", "faer 0.24.4")
    );
}

#[test]
fn this_program_knows_its_compiler_libraries_and_caches() {
    let machine = machine();
    assert!(
        machine.compiler.starts_with("rustc 1."),
        "{}",
        machine.compiler
    );
    assert!(machine.compiler.contains(" for "), "{}", machine.compiler);
    for library in ["faer", "gemm-common", "nalgebra", "pulp"] {
        let version = &machine.libraries[library];
        assert!(
            version.starts_with(|c: char| c.is_ascii_digit()),
            "{version}"
        );
    }
    assert_eq!(
        machine.caches.matches(" KiB").count(),
        3,
        "{}",
        machine.caches
    );
    assert!(machine.threads.parse::<usize>().unwrap() > 0);
}
