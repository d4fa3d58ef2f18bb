//! A temporary folder with the files of a scene.

use std::fs;
use std::path::{Component, Path};
use std::sync::Arc;

use anyhow::{Context as _, bail};
use palpa_scene::Scene;
use tempfile::TempDir;

/// Longest name of a file in a folder, in characters.
const LONGEST_NAME: usize = 80;

/// A temporary folder with files, removed when it is dropped.
#[derive(Debug)]
pub(crate) struct Folder {
    temporary: TempDir,
    /// Names of the files, relative to the folder, with `/`.
    names: Vec<String>,
    bytes: u64,
}

impl Folder {
    /// An empty folder.
    pub(super) fn new() -> anyhow::Result<Self> {
        let temporary = tempfile::Builder::new().prefix("palpa-").tempdir();
        let temporary = temporary.context("no temporary folder can be made for the files")?;
        Ok(Self {
            temporary,
            names: Vec::new(),
            bytes: 0,
        })
    }

    /// An empty folder that says that it has so many bytes.
    #[cfg(test)]
    pub(crate) fn new_for_test(bytes: u64) -> Self {
        let folder = Self::new().expect("a temporary folder");
        Self { bytes, ..folder }
    }

    /// A folder with these files. Names are relative, and checked by the caller.
    pub(super) fn with(files: &[(&str, &[u8])]) -> anyhow::Result<Self> {
        let mut folder = Self::new()?;
        for (name, bytes) in files {
            folder.add(name, bytes)?;
        }
        Ok(folder)
    }

    /// Adds a file. The name is relative, and checked by the caller.
    pub(super) fn add(&mut self, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
        let path = self.temporary.path().join(name);
        let written = path
            .parent()
            .map_or(Ok(()), fs::create_dir_all)
            .and_then(|()| fs::write(&path, bytes));
        written.with_context(|| format!("{name} cannot be kept in the temporary folder"))?;
        self.names.push(name.to_owned());
        self.bytes += bytes.len() as u64;
        Ok(())
    }

    /// A folder with the files of others. Of files with the same name, the later ones get a number.
    pub(super) fn gathered(folders: &[Arc<Self>]) -> anyhow::Result<Self> {
        let mut all = Self::new()?;
        for folder in folders {
            for name in &folder.names {
                let unused = all.unused(name);
                let (from, to) = (folder.path().join(name), all.path().join(&unused));
                let made = to
                    .parent()
                    .map_or(Ok(()), fs::create_dir_all)
                    // A link shares the bytes, where the system has links.
                    .and_then(|()| {
                        fs::hard_link(&from, &to).or_else(|_| fs::copy(&from, &to).map(|_| ()))
                    });
                made.with_context(|| format!("{name} cannot be kept in the temporary folder"))?;
                all.names.push(unused);
            }
            all.bytes += folder.bytes;
        }
        Ok(all)
    }

    fn unused(&self, name: &str) -> String {
        let (stem, ending) = name.rsplit_once('.').unwrap_or((name, ""));
        let dot = if ending.is_empty() { "" } else { "." };
        let numbered = (2..).map(|n| format!("{stem}-{n}{dot}{ending}"));
        let mut names = [name.to_owned()].into_iter().chain(numbered);
        let is_new = |name: &String| !self.names.contains(name);
        names.find(is_new).unwrap_or_default()
    }

    /// The folder.
    pub(crate) fn path(&self) -> &Path {
        self.temporary.path()
    }

    /// Names of the files, relative to the folder, in the order in which they were added.
    pub(super) fn names(&self) -> &[String] {
        &self.names
    }

    /// Sum of the files' sizes.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Refuses a scene that refers to a file outside this folder, or to one that is not there.
    pub(super) fn check_has_all_of(&self, scene: &Scene) -> anyhow::Result<()> {
        for path in scene.files() {
            let inside = path.strip_prefix(self.path()).ok();
            let is_plain =
                |path: &Path| path.components().all(|c| matches!(c, Component::Normal(_)));
            let is_there = inside.is_some_and(|inside| {
                is_plain(inside) && self.names.iter().any(|name| Path::new(name) == inside)
            });
            if !is_there {
                let named = inside.unwrap_or(path).display();
                bail!(
                    "the scene refers to {named}, which did not come with it; give the scene together with its files, or a ZIP of all"
                );
            }
        }
        Ok(())
    }
}

/// The last part of a path from another machine as a plain file name: with letters, digits, `.`, `-` and
/// `_` only.
pub(super) fn plain_name(name: &str) -> String {
    let last = name.rsplit(['/', '\\']).next().unwrap_or_default();
    let plain: String = last
        .chars()
        .map(|c| {
            if c.is_alphanumeric() || "._-".contains(c) {
                c
            } else {
                '_'
            }
        })
        .collect();
    let plain = plain.trim_start_matches('.');
    let skipped = plain.chars().count().saturating_sub(LONGEST_NAME);
    // The ending stays.
    let plain: String = plain.chars().skip(skipped).collect();
    if plain.is_empty() {
        "file".to_owned()
    } else {
        plain
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_from_elsewhere_become_plain() {
        for (name, plain) in [
            ("skin.stl", "skin.stl"),
            (r"C:\Users\me\left arm.STL", "left_arm.STL"),
            ("../../etc/passwd", "passwd"),
            ("前腕.ply", "前腕.ply"),
            ("...", "file"),
            ("", "file"),
            ("a\0b:c.obj", "a_b_c.obj"),
        ] {
            assert_eq!(plain_name(name), plain, "{name:?}");
        }
        let long = format!("{}.stl", "x".repeat(300));
        let short = plain_name(&long);
        assert_eq!(short.chars().count(), LONGEST_NAME);
        assert_eq!(Path::new(&short).extension(), Some("stl".as_ref()));
    }

    #[test]
    fn files_of_one_name_are_kept_apart() {
        let one = Arc::new(Folder::with(&[("a.obj", b"1")]).unwrap());
        let two = Arc::new(Folder::with(&[("a.obj", b"22")]).unwrap());
        let both = Folder::gathered(&[one, two]).unwrap();
        assert_eq!(both.names(), ["a.obj", "a-2.obj"]);
        assert_eq!(both.bytes(), 3);
        assert_eq!(fs::read(both.path().join("a-2.obj")).unwrap(), b"22");
    }
}
