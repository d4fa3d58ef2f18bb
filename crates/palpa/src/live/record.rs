//! The scene's part of a log: the notes written into it, and the scene read back.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use palpa_rt::Header;
use palpa_scene::Scene;

const BASE: &str = "scene_dir";
const FILE: &str = "file ";

/// A file of the scene that has changed since the log was made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileState {
    /// The file.
    pub path: PathBuf,
    /// The difference to the file at the time of the log.
    pub problem: String,
}

/// Notes for a log, from which its scene can be restored: the folder that its paths are relative
/// to, and a fingerprint of each of its files.
///
/// # Errors
/// When a file cannot be read.
pub fn notes_of(scene: &Scene) -> anyhow::Result<BTreeMap<String, String>> {
    let base = std::path::absolute(&scene.base_dir).unwrap_or_else(|_| scene.base_dir.clone());
    let mut notes = BTreeMap::from([(BASE.to_owned(), base.display().to_string())]);
    for path in scene.files() {
        notes.insert(format!("{FILE}{}", path.display()), fingerprint(path)?);
    }
    Ok(notes)
}

/// The scene that a log was recorded with.
///
/// # Errors
/// When the log has no scene, or this version cannot read it.
pub fn scene_of(header: &Header) -> anyhow::Result<Scene> {
    if header.scene.is_empty() {
        anyhow::bail!(
            "the log has no scene in it; name the one that it was made with: --scene SCENE"
        );
    }
    let base = header.notes.get(BASE).map_or("", String::as_str);
    Scene::parse(&header.scene, Path::new(base)).context("the scene in the log")
}

/// The files that have changed since the log was made.
pub fn changed_files(header: &Header, scene: &Scene) -> Vec<FileState> {
    let mut changed = Vec::new();
    for path in scene.files() {
        let was = header.notes.get(&format!("{FILE}{}", path.display()));
        let problem = match (was, fingerprint(path)) {
            (_, Err(error)) => format!("{error:#}"),
            (None, _) => "the log says nothing of it".to_owned(),
            (Some(was), Ok(is)) if *was != is => "it has changed since the log was made".to_owned(),
            _ => continue,
        };
        let path = path.to_owned();
        changed.push(FileState { path, problem });
    }
    changed
}

/// Length and a hash (FNV-1a) of a file: protects against mix-ups, not against manipulation.
fn fingerprint(path: &Path) -> anyhow::Result<String> {
    let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
    let hash = bytes.iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
    });
    Ok(format!("{} bytes, {hash:016x}", bytes.len()))
}
