//! The numerical libraries in a `Cargo.lock`.

use std::fs;
use std::path::{Path, PathBuf};

/// The libraries whose computations enter meshes and forces.
const LIBRARIES: [&str; 17] = [
    "faer",
    "gemm",
    "gemm-common",
    "gemm-f32",
    "gemm-f64",
    "libm",
    "matrixmultiply",
    "nalgebra",
    "nano-gemm",
    "nano-gemm-f32",
    "nano-gemm-f64",
    "private-gemm-x86",
    "pulp",
    "robust",
    "rstar",
    "simba",
    "spade",
];

/// The first `Cargo.lock` in the folders `starts` and the folders above them that has the library
/// of the factors in it, and the versions as in [`versions`].
pub(crate) fn find(starts: &[PathBuf]) -> Option<(PathBuf, String)> {
    (starts.iter().flat_map(|start| start.ancestors())).find_map(|folder: &Path| {
        let path = folder.join("Cargo.lock");
        let versions = versions(&fs::read_to_string(&path).ok()?);
        let has_factors = versions.split(';').any(|v| v.starts_with("faer "));
        has_factors.then_some((path, versions))
    })
}

/// Names and versions of the libraries in a lock file: `faer 0.24.4;gemm 0.19.0`. Where two
/// versions of one are in it, they are separated by `+`.
pub(crate) fn versions(lock: &str) -> String {
    let value = |line: &str, key: &str| {
        let rest = line.strip_prefix(key)?.trim().strip_prefix('=')?;
        Some(rest.trim().trim_matches('"').to_owned())
    };
    let mut found: Vec<(String, String)> = Vec::new();
    let mut name = String::new();
    for line in lock.lines() {
        if let Some(of) = value(line, "name") {
            name = of;
        } else if let Some(version) = value(line, "version")
            && LIBRARIES.contains(&name.as_str())
        {
            match found.last_mut().filter(|(last, _)| *last == name) {
                Some((_, versions)) => *versions = format!("{versions}+{version}"),
                None => found.push((name.clone(), version)),
            }
        }
    }
    let found: Vec<_> = (found.iter())
        .map(|(name, v)| format!("{name} {v}"))
        .collect();
    found.join(";")
}
