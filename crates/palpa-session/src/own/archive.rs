//! A scene with its files as a ZIP.
//!
//! A ZIP from a page is not trusted: names that lead out of its folder are refused, and sizes are
//! counted while it is unpacked, whatever its directory says.

use std::collections::BTreeMap;
use std::io::{Cursor, Read as _, Write as _};
use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail, ensure};
use palpa::mesh::{read_surface, read_surface_named, write_surface};
use palpa_scene::Scene;
use palpa_viewer::control::UPLOAD_LIMITS;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use super::folder::{Folder, plain_name};
use super::inspect::is_surface;

/// Largest scene file, bytes.
const MOST_TEXT: u64 = 1 << 20;
/// Most bytes of all files of a ZIP together, unpacked.
const MOST_UNPACKED: u64 = 2 * UPLOAD_LIMITS.bytes;

/// Whether the bytes are those of a ZIP.
pub(super) fn is_archive(bytes: &[u8]) -> bool {
    bytes.starts_with(b"PK\x03\x04") || bytes.starts_with(b"PK\x05\x06")
}

/// The scene of a ZIP, and a folder with its files.
///
/// # Errors
/// When the ZIP is damaged or too large, has no scene or several, or its scene refers to files that
/// are not in it.
pub(super) fn unpacked(name: &str, bytes: &[u8]) -> anyhow::Result<(Folder, Scene)> {
    unpack(bytes).with_context(|| name.to_owned())
}

fn unpack(bytes: &[u8]) -> anyhow::Result<(Folder, Scene)> {
    let mut archive = ZipArchive::new(Cursor::new(bytes))
        .context("the ZIP cannot be read; pack it again, with ordinary (deflate) compression")?;
    let most = UPLOAD_LIMITS.files as usize + 1;
    ensure!(
        archive.len() <= 2 * most,
        "the ZIP has {} entries, more than the {} allowed; pack only the scene and its files",
        archive.len(),
        2 * most
    );
    let mut files: BTreeMap<PathBuf, Vec<u8>> = BTreeMap::new();
    let mut left = MOST_UNPACKED;
    for i in 0..archive.len() {
        let entry = archive.by_index(i);
        let entry = entry.context("an entry of the ZIP cannot be read; pack it again")?;
        let name = (entry.name())
            .context("an entry of the ZIP has a name that cannot be read; pack it again")?
            .into_owned();
        if entry.is_dir() || is_of_the_system(&name) {
            continue;
        }
        let path = entry.enclosed_name().filter(|_| !entry.is_symlink());
        let Some(path) = path else {
            bail!("the ZIP has an entry {name:?} that leads out of its folder; pack it again");
        };
        let mut content = Vec::new();
        let read = entry.take(left + 1).read_to_end(&mut content);
        read.with_context(|| format!("{} in the ZIP is damaged; pack it again", path.display()))?;
        ensure!(
            content.len() as u64 <= left,
            "the ZIP is larger than {} MB when unpacked; thin its meshes out",
            MOST_UNPACKED >> 20
        );
        left -= content.len() as u64;
        files.insert(path, content);
    }
    let scene_path = scene_among(&files)?;
    let text = files.remove(&scene_path).unwrap_or_default();
    ensure!(
        text.len() as u64 <= MOST_TEXT,
        "{} is larger than 1 MiB, so it is no scene",
        scene_path.display()
    );
    let text = String::from_utf8(text)
        .with_context(|| format!("{} is not UTF-8 text", scene_path.display()))?;
    // Paths in a scene are relative to its file.
    let base = scene_path.parent().unwrap_or(Path::new(""));
    let mut folder = Folder::new()?;
    let scene = Scene::parse(&text, folder.path())
        .with_context(|| format!("the scene {}", scene_path.display()))?;
    for (path, content) in &files {
        let Ok(inside) = path.strip_prefix(base) else {
            continue;
        };
        if !scene
            .files()
            .contains(&folder.path().join(inside).as_path())
        {
            continue;
        }
        if is_surface(inside) {
            let surface = read_surface_named(inside, content)?;
            let n = surface.surface.triangles.len();
            ensure!(
                n <= UPLOAD_LIMITS.triangles as usize,
                "{} has {n} triangles, more than the {} that are taken; thin the mesh out",
                inside.display(),
                UPLOAD_LIMITS.triangles
            );
        }
        folder.add(&inside.to_string_lossy().replace('\\', "/"), content)?;
    }
    folder.check_has_all_of(&scene)?;
    Ok((folder, scene))
}

/// Whether an entry was added by a system, as `__MACOSX/…` or `.DS_Store`.
fn is_of_the_system(name: &str) -> bool {
    name.split(['/', '\\'])
        .any(|part| part == "__MACOSX" || (part.starts_with('.') && !part.starts_with("..")))
}

/// The scene of the files: `scene.toml`, or the only other scene.
fn scene_among(files: &BTreeMap<PathBuf, Vec<u8>>) -> anyhow::Result<PathBuf> {
    let scenes: Vec<&PathBuf> = (files.keys())
        .filter(|path| palpa::check::is_scene(path))
        .collect();
    let named: Vec<&&PathBuf> = (scenes.iter())
        .filter(|path| path.file_name().is_some_and(|name| name == "scene.toml"))
        .collect();
    match (&scenes[..], &named[..]) {
        ([only], _) => Ok((*only).clone()),
        (_, [only]) => Ok((**only).clone()),
        ([], _) => bail!("the ZIP has no scene; add its scene file (scene.toml)"),
        _ => bail!(
            "the ZIP has {} scenes, so it is not clear which is meant; keep one",
            scenes.len()
        ),
    }
}

/// A ZIP with the scene as `scene.toml` and the files that it refers to beside it. A glTF, whose
/// buffers may be in other files, becomes a PLY.
///
/// # Errors
/// When a file cannot be read.
pub(crate) fn packed(scene: &Scene) -> anyhow::Result<Vec<u8>> {
    let mut names: BTreeMap<PathBuf, String> = BTreeMap::new();
    for path in scene.files() {
        if names.contains_key(path) {
            continue;
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let name = plain_name(&name);
        let name = match name.strip_suffix(".gltf") {
            Some(stem) => format!("{stem}.ply"),
            None => name,
        };
        let (stem, ending) = name.rsplit_once('.').unwrap_or((&name, ""));
        let numbered = (2..).map(|n| format!("{stem}-{n}.{ending}"));
        let unused = [name.clone()]
            .into_iter()
            .chain(numbered)
            .find(|name| name != "scene.toml" && names.values().all(|other| other != name));
        names.insert(path.to_owned(), unused.unwrap_or_default());
    }
    let moved = scene.with_files_at(Path::new(""), |path| {
        names
            .get(path)
            .map_or_else(|| path.to_owned(), PathBuf::from)
    });
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    zip.start_file("scene.toml", options)?;
    zip.write_all(moved.to_toml().as_bytes())?;
    for (path, name) in &names {
        let bytes = if path
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("gltf"))
        {
            let folder = tempfile::tempdir()?;
            let copy = folder.path().join(name);
            write_surface(&copy, &read_surface(path)?.surface)?;
            std::fs::read(copy)?
        } else {
            std::fs::read(path).with_context(|| format!("{} cannot be read", path.display()))?
        };
        zip.start_file(name.as_str(), options)?;
        zip.write_all(&bytes)?;
    }
    Ok(zip.finish()?.into_inner())
}

#[cfg(test)]
mod tests {
    use super::super::tests::tetrahedron;
    use super::*;

    const SCENE: &str = "[body]\nsurface = \"meshes/skin.obj\"\n[[layer]]\ntissue = \"fat\"\nthickness = \"10 mm\"\n[press]\ndepth = \"2 mm\"\n";

    fn zip(files: &[(&str, &[u8])]) -> Vec<u8> {
        let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
        for (name, bytes) in files {
            zip.start_file(*name, SimpleFileOptions::default()).unwrap();
            zip.write_all(bytes).unwrap();
        }
        zip.finish().unwrap().into_inner()
    }

    fn why(files: &[(&str, &[u8])]) -> String {
        palpa::one_paragraph(&unpacked("a.zip", &zip(files)).unwrap_err())
    }

    #[test]
    fn a_scene_comes_back_from_its_zip_with_its_meshes() {
        let skin = tetrahedron(1.0);
        // In a folder of the ZIP, as systems pack them.
        let bytes = zip(&[
            ("arm/scene.toml", SCENE.as_bytes()),
            ("arm/meshes/skin.obj", &skin),
            ("arm/readme.txt", b"hello"),
            ("__MACOSX/arm/._scene.toml", b"\0"),
        ]);
        let (folder, scene) = unpacked("arm.zip", &bytes).unwrap();
        assert_eq!(folder.names(), ["meshes/skin.obj"]);
        let again = packed(&scene).unwrap();
        let (folder, scene) = unpacked("scene.zip", &again).unwrap();
        assert_eq!(folder.names(), ["skin.obj"]);
        assert_eq!(std::fs::read(scene.files()[0]).unwrap(), skin);
    }

    #[test]
    fn files_of_one_name_and_scenes_without_files_are_packed() {
        let folder = tempfile::tempdir().unwrap();
        for part in ["a", "b"] {
            std::fs::create_dir(folder.path().join(part)).unwrap();
            let path = folder.path().join(part).join("x.obj");
            std::fs::write(path, tetrahedron(1.0)).unwrap();
        }
        let text = SCENE.replace(
            "surface = \"meshes/skin.obj\"",
            "surface = \"a/x.obj\"\nbones = [\"b/x.obj\"]",
        );
        let scene = Scene::parse(&text, folder.path()).unwrap();
        let (unpacked_to, again) = unpacked("x.zip", &packed(&scene).unwrap()).unwrap();
        let mut names = unpacked_to.names().to_vec();
        names.sort();
        assert_eq!(names, ["x-2.obj", "x.obj"]);
        assert_eq!(again.body.bones.len(), 1);
        let (folder, scene) = unpacked("f.zip", &packed(&Scene::embedded()).unwrap()).unwrap();
        assert!(folder.names().is_empty());
        assert_eq!(scene.layers, Scene::embedded().layers);
    }

    #[test]
    fn zips_that_cannot_be_trusted_or_used_are_refused() {
        let skin = tetrahedron(1.0);
        let scene = SCENE.as_bytes();
        let missing = why(&[("scene.toml", scene)]);
        assert!(missing.contains("meshes/skin.obj"), "{missing}");
        let outside = SCENE.replace("meshes/skin.obj", "../skin.obj");
        let outside = why(&[("scene.toml", outside.as_bytes()), ("skin.obj", &skin)]);
        assert!(outside.contains("../skin.obj"), "{outside}");
        let leading = why(&[("scene.toml", scene), ("../skin.obj", &skin)]);
        assert!(leading.contains("leads out"), "{leading}");
        assert!(why(&[("skin.obj", &skin)]).contains("no scene"));
        let two = why(&[("a.toml", scene), ("b.toml", scene)]);
        assert!(two.contains("2 scenes"), "{two}");
        let wrong = why(&[("scene.toml", b"[layer")]);
        assert!(wrong.contains("not valid TOML"), "{wrong}");
        let damaged = why(&[("scene.toml", scene), ("meshes/skin.obj", b"f 1 2 3\n")]);
        assert!(damaged.contains("line 1"), "{damaged}");
        let mut cut = zip(&[("scene.toml", scene)]);
        cut.truncate(40);
        let cut = palpa::one_paragraph(&unpacked("cut.zip", &cut).unwrap_err());
        assert!(
            cut.contains("cut.zip") && cut.contains("cannot be read"),
            "{cut}"
        );
    }

    #[test]
    fn a_zip_that_grows_beyond_all_bounds_is_stopped() {
        // A kilobyte for each megabyte of zeros.
        let zeros = vec![0; MOST_UNPACKED as usize + 1];
        let bytes = zip(&[("zeros.bin", &zeros), ("scene.toml", SCENE.as_bytes())]);
        assert!((bytes.len() as u64) < UPLOAD_LIMITS.bytes / 100);
        let error = palpa::one_paragraph(&unpacked("bomb.zip", &bytes).unwrap_err());
        assert!(error.contains("when unpacked"), "{error}");
    }
}
