//! The SCENE of a command: a scene file, or the name of a built-in scene.
//!
//! A file comes first: `limb` is the file of that name if there is one, and the built-in scene if
//! not. A folder of that name does not hide the scene.

use std::ffi::OsStr;
use std::fs;
use std::path::Path;

use anyhow::{Context as _, bail};
use palpa_scene::{BuiltIn, Scene, nearest};

/// Most entries of a folder that are looked at for a similar name.
const MOST_ENTRIES: usize = 10_000;

/// A scene with its name.
#[derive(Debug, Clone)]
pub struct NamedScene {
    /// The scene.
    pub scene: Scene,
    /// Its name for reports: the path of its file, or the key of a built-in scene.
    pub name: String,
    /// The built-in scene; `None` for a file.
    pub built_in: Option<&'static BuiltIn>,
}

/// Reads the scene that an argument names.
///
/// # Errors
/// If there is neither such a file nor such a built-in scene, if the built-in scene is a template, or
/// if the file is not a valid scene.
pub fn load(argument: &Path) -> anyhow::Result<NamedScene> {
    if let Some(built_in) = built_in(argument) {
        return of_built_in(built_in);
    }
    // A path that may not be looked at is for the reader to refuse.
    if !argument.try_exists().unwrap_or(true) {
        bail!("{}", absent(argument));
    }
    Ok(NamedScene {
        scene: Scene::load(argument)?,
        name: argument.display().to_string(),
        built_in: None,
    })
}

/// As [`load`]; without an argument, the built-in scene with the key `default`, even if there is a file
/// of that name.
///
/// # Errors
/// As [`load`].
pub fn load_or(argument: Option<&Path>, default: &str) -> anyhow::Result<NamedScene> {
    match argument {
        Some(argument) => load(argument),
        None => of_built_in(BuiltIn::find(default).context("a built-in scene")?),
    }
}

/// The built-in scene that an argument names; `None` if it names a file.
pub fn built_in(argument: &Path) -> Option<&'static BuiltIn> {
    if argument.is_file() {
        return None;
    }
    BuiltIn::find(argument.to_str()?)
}

fn of_built_in(built_in: &'static BuiltIn) -> anyhow::Result<NamedScene> {
    let key = built_in.key;
    if built_in.is_template {
        bail!(
            "\"{key}\" is a start for a scene with your own meshes: `palpa scenes --write {key}` writes it as {key}.toml; \
             name your mesh files in it"
        );
    }
    let scene = built_in.scene();
    Ok(NamedScene {
        scene: scene.with_context(|| format!("the built-in scene \"{key}\""))?,
        name: key.to_owned(),
        built_in: Some(built_in),
    })
}

fn absent(argument: &Path) -> String {
    let hint = match meant(argument, &["toml"]) {
        Some(meant) => format!("did you mean \"{meant}\"? "),
        None => String::new(),
    };
    format!(
        "\"{}\" is neither a file nor a built-in scene; {hint}`palpa scenes` lists the built-in scenes",
        argument.display()
    )
}

/// The name that was probably meant by an argument that names nothing: of a built-in scene, or of a
/// file with one of these extensions in the folder of the argument.
pub fn meant(argument: &Path, extensions: &[&str]) -> Option<String> {
    let folder = argument.parent().filter(|p| !p.as_os_str().is_empty());
    // All files of a kind have the same extension: it makes no name more alike.
    let bare = |name: &str| {
        let name = name.to_lowercase();
        match name.rsplit_once('.') {
            Some((stem, end)) if extensions.contains(&end) => stem.to_owned(),
            _ => name,
        }
    };
    let files = file_names(folder.unwrap_or(Path::new(".")), extensions).into_iter();
    let files = files.map(|name| {
        let shown = folder.map_or(name.clone(), |f| f.join(&name).display().to_string());
        (bare(&name), shown)
    });
    let keys = BuiltIn::all().iter().map(|built_in| built_in.key);
    let keys = keys.map(|key| (key.to_owned(), key.to_owned()));
    // A file comes before a built-in scene of the same name.
    let known: Vec<(String, String)> = files.chain(keys).collect();
    let found = bare(argument.file_name()?.to_str()?);
    let meant = nearest(&found, known.iter().map(|(bare, _)| bare.as_str()))?;
    let (_, shown) = known.iter().find(|(bare, _)| bare == meant)?;
    Some(shown.clone())
}

/// Names of the files in a folder with one of these extensions, in order.
fn file_names(folder: &Path, extensions: &[&str]) -> Vec<String> {
    let is_of_kind = |name: &str| {
        let extension = Path::new(name).extension().and_then(OsStr::to_str);
        extension.is_some_and(|e| extensions.contains(&e.to_lowercase().as_str()))
    };
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries
        .take(MOST_ENTRIES)
        .filter_map(|entry| entry.file_name().into_string().ok())
        .filter(|name| is_of_kind(name))
        .collect();
    names.sort();
    names
}
