//! Compiler and versions of the numerical libraries are put into the program, for its logs.

use std::path::PathBuf;
use std::process::Command;

#[path = "build/lock.rs"]
mod lock;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=build/lock.rs");
    let variable = |name: &str| std::env::var(name).unwrap_or_default();
    let compiler = (Command::new(variable("RUSTC")).arg("--version").output())
        .map(|output| String::from_utf8_lossy(&output.stdout).trim().to_owned())
        .unwrap_or_default();
    println!(
        "cargo::rustc-env=PALPA_COMPILER={compiler} for {}",
        variable("TARGET")
    );
    // The program is built from the lock file of the workspace that its folder of results lies in;
    // if that folder is elsewhere, from that of the checkout or of the packaged crate.
    let starts = ["OUT_DIR", "CARGO_MANIFEST_DIR"].map(|name| PathBuf::from(variable(name)));
    let mut libraries = String::new();
    if let Some((path, versions)) = lock::find(&starts) {
        println!("cargo::rerun-if-changed={}", path.display());
        libraries = versions;
    }
    println!("cargo::rustc-env=PALPA_LIBRARIES={libraries}");
}
