//! A user's own bodies: files that a page sends, their check, and the scenes made of them.
//!
//! ```text
//!  file ─► Shelf::take ─┬─ surface: read, checked          ─► Grow: template ─► scene in a Folder
//!                       ├─ ZIP: unpacked into a Folder      ─► LoadUploaded
//!                       └─ others                           ─► LoadText, LoadTable with files
//! ```
//! A file is kept in a temporary folder of its own that only this user can read. The folder is removed
//! when neither the shelf nor a scene needs it, at the latest when the session ends.

mod archive;
mod folder;
mod inspect;
mod template;

use std::collections::VecDeque;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use anyhow::{Context as _, bail, ensure};
use palpa::mesh::{SurfaceFile, read_surface_named};
use palpa_scene::{LengthUnit, Scene};
use palpa_viewer::control::{Template, UPLOAD_LIMITS, Uploaded, UploadedContent};
use palpa_viewer::wire::MeshSnapshot;

pub(crate) use archive::packed;
pub(crate) use folder::Folder;
use template::Dimensions;

/// Most files on the shelf.
const MOST_KEPT: usize = UPLOAD_LIMITS.files as usize + 2;
/// Most bytes on the shelf.
const MOST_BYTES: u64 = 4 * UPLOAD_LIMITS.bytes;
/// Endings of files that are read as surfaces.
const SURFACES: [&str; 6] = ["stl", "ply", "obj", "off", "glb", "gltf"];

/// The files that pages have sent. All threads of the session share them.
#[derive(Debug, Clone, Default)]
pub(crate) struct Shelf {
    kept: Arc<Mutex<Kept>>,
}

#[derive(Debug, Default)]
struct Kept {
    /// The oldest first.
    items: VecDeque<Item>,
    n_taken: u32,
}

/// A file that a page has sent.
#[derive(Debug, Clone)]
struct Item {
    id: u32,
    /// Name of the file as it was sent.
    name: String,
    folder: Arc<Folder>,
    kind: ItemKind,
}

#[derive(Debug, Clone)]
enum ItemKind {
    /// A surface, and its dimensions, in the unit of its file.
    Surface(Arc<SurfaceFile>, Dimensions),
    /// A scene whose files are in the folder.
    Scene(Box<Scene>),
    Other,
}

impl Shelf {
    /// Takes a file: reads and checks it.
    ///
    /// # Errors
    /// When it is none that a scene could use; with place and advice.
    pub(crate) fn take(&self, name: &str, bytes: &[u8]) -> anyhow::Result<Uploaded> {
        let plain = folder::plain_name(name);
        ensure!(
            bytes.len() as u64 <= UPLOAD_LIMITS.bytes,
            "{plain} is larger than {} MB, the most that can be uploaded; thin the mesh out, or cut the part of interest from it",
            UPLOAD_LIMITS.bytes >> 20
        );
        ensure!(
            !bytes.is_empty(),
            "{plain} is empty; export it again, or choose another file"
        );
        let ending = Path::new(&plain).extension().map(|ending| {
            let ending = ending.to_string_lossy();
            ending.to_ascii_lowercase()
        });
        let ending = ending.unwrap_or_default();
        let (folder, kind) = if archive::is_archive(bytes) {
            let (folder, scene) = archive::unpacked(&plain, bytes)?;
            (folder, ItemKind::Scene(Box::new(scene)))
        } else if ["csv", "txt"].contains(&ending.as_str()) {
            (Folder::with(&[(&plain, bytes)])?, ItemKind::Other)
        } else {
            if ending == "toml" {
                bail!("{plain} is a scene; its text is loaded, not uploaded");
            }
            let surface = read_surface_named(Path::new(&plain), bytes)
                .map_err(|error| with_known_endings(error, &ending))?;
            let n = surface.surface.triangles.len();
            ensure!(
                n <= UPLOAD_LIMITS.triangles as usize,
                "{plain} has {n} triangles, more than the {} that are taken; thin the mesh out (Blender: Decimate; MeshLab: Quadric \
                 Edge Collapse Decimation), or cut the part of interest from it",
                UPLOAD_LIMITS.triangles
            );
            let folder = Folder::with(&[(&plain, bytes)])?;
            let (info, dimensions) = inspect::inspected(&plain, &surface, None);
            let kind = ItemKind::Surface(Arc::new(surface), dimensions);
            let item = self.put(plain, folder, kind);
            return Ok(Uploaded {
                id: item.id,
                name: item.name,
                content: UploadedContent::Surface(Box::new(info)),
            });
        };
        let content = match &kind {
            ItemKind::Scene(scene) => UploadedContent::Scene {
                files: names_of(scene),
            },
            ItemKind::Surface(..) | ItemKind::Other => UploadedContent::Other,
        };
        let Item { id, name, .. } = self.put(plain, folder, kind);
        Ok(Uploaded { id, name, content })
    }

    fn put(&self, name: String, folder: Folder, kind: ItemKind) -> Item {
        let mut kept = self.kept();
        kept.n_taken += 1;
        let item = Item {
            id: kept.n_taken,
            name,
            folder: Arc::new(folder),
            kind,
        };
        kept.items.push_back(item.clone());
        let bytes = |kept: &Kept| -> u64 { kept.items.iter().map(|i| i.folder.bytes()).sum() };
        while kept.items.len() > MOST_KEPT || bytes(&kept) > MOST_BYTES {
            kept.items.pop_front();
        }
        item
    }

    /// Checks a surface again, in another unit.
    pub(crate) fn check(&self, id: u32, unit: LengthUnit) -> Option<Uploaded> {
        let item = self.item(id)?;
        let ItemKind::Surface(surface, _) = &item.kind else {
            return None;
        };
        let (info, _) = inspect::inspected(&item.name, surface, Some(unit));
        Some(Uploaded {
            id,
            name: item.name,
            content: UploadedContent::Surface(Box::new(info)),
        })
    }

    /// A surface for the picture, with its middle at the origin.
    pub(crate) fn mesh(&self, id: u32) -> Option<MeshSnapshot> {
        match self.item(id)?.kind {
            ItemKind::Surface(surface, _) => Some(inspect::picture(&surface.surface)),
            ItemKind::Scene(_) | ItemKind::Other => None,
        }
    }

    /// The scene of a ZIP, and the folder of its files.
    ///
    /// # Errors
    /// When there is no such file.
    pub(crate) fn scene(&self, id: u32) -> anyhow::Result<(Scene, Arc<Folder>)> {
        let item = self.need(id)?;
        match item.kind {
            ItemKind::Scene(scene) => Ok((*scene, item.folder)),
            ItemKind::Surface(..) | ItemKind::Other => {
                bail!("{} is no scene; grow a body from it", item.name)
            }
        }
    }

    /// A scene from its text and the files that it refers to by their names.
    ///
    /// # Errors
    /// When the text is no scene, or refers to a file that is not among them.
    pub(crate) fn scene_of_text(
        &self,
        text: &str,
        files: &[u32],
    ) -> anyhow::Result<(Scene, Arc<Folder>)> {
        let folder = self.gathered(files)?;
        let scene = Scene::parse(text, folder.path())?;
        folder.check_has_all_of(&scene)?;
        Ok((scene, Arc::new(folder)))
    }

    /// The scene of a body that grows from a surface.
    ///
    /// # Errors
    /// When a file is not there or is no surface, or too many are named.
    pub(crate) fn grown(
        &self,
        skin: u32,
        bones: &[u32],
        unit: LengthUnit,
        template: Template,
    ) -> anyhow::Result<(Scene, Arc<Folder>)> {
        let all: Vec<u32> = [skin].into_iter().chain(bones.iter().copied()).collect();
        let sizes = all
            .iter()
            .map(|&id| self.need(id)?.dimensions())
            .collect::<anyhow::Result<Vec<_>>>()?;
        let size = *sizes.first().context("no file was named")?;
        let folder = self.gathered(&all)?;
        let (skin, bones) = folder.names().split_first().context("no file was named")?;
        let body = template::Body {
            skin,
            bones,
            unit,
            size: size.scaled(unit.metres()),
        };
        let scene = body.scene(template, folder.path())?;
        Ok((scene, Arc::new(folder)))
    }

    /// A folder with the files of some items.
    fn gathered(&self, files: &[u32]) -> anyhow::Result<Folder> {
        ensure!(
            files.len() <= UPLOAD_LIMITS.files as usize,
            "{} files are more than the {} that a scene can have",
            files.len(),
            UPLOAD_LIMITS.files
        );
        let folders = files
            .iter()
            .map(|&id| Ok(self.need(id)?.folder))
            .collect::<anyhow::Result<Vec<_>>>()?;
        Folder::gathered(&folders)
    }

    fn need(&self, id: u32) -> anyhow::Result<Item> {
        let missing = || format!("there is no uploaded file {id} any more; send it again");
        self.item(id).with_context(missing)
    }

    fn item(&self, id: u32) -> Option<Item> {
        self.kept().items.iter().find(|item| item.id == id).cloned()
    }

    fn kept(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Item {
    /// Dimensions of a surface, in the unit of its file.
    fn dimensions(&self) -> anyhow::Result<Dimensions> {
        match self.kind {
            ItemKind::Surface(_, dimensions) => Ok(dimensions),
            ItemKind::Scene(_) | ItemKind::Other => bail!(
                "{} is no surface; choose an STL, PLY, OBJ, OFF or GLB file",
                self.name
            ),
        }
    }
}

/// Names of the files that a scene refers to, as its file writes them.
pub(crate) fn names_of(scene: &Scene) -> Vec<String> {
    let name = |path: &Path| {
        let path = path.strip_prefix(&scene.base_dir).unwrap_or(path);
        path.to_string_lossy().replace('\\', "/")
    };
    let mut names: Vec<String> = scene.files().into_iter().map(name).collect();
    names.sort();
    names.dedup();
    names
}

fn with_known_endings(error: palpa::mesh::ReadError, ending: &str) -> anyhow::Error {
    let is_unknown = matches!(error, palpa::mesh::ReadError::UnknownFormat { .. });
    let is_known = SURFACES.contains(&ending);
    if is_unknown && !is_known {
        return anyhow::anyhow!(
            "a file of this kind (.{ending}) is not known; give a surface (STL, PLY, OBJ, OFF, GLB), a scene (TOML), or a ZIP of both"
        );
    }
    error.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron of 10 cm, in the text of an OBJ file.
    pub(super) fn tetrahedron(unit: f64) -> Vec<u8> {
        let s = 0.1 / unit;
        format!("v 0 0 0\nv {s} 0 0\nv 0 {s} 0\nv 0 0 {s}\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
            .into_bytes()
    }

    fn surface_of(uploaded: &Uploaded) -> &palpa_viewer::control::SurfaceInfo {
        match &uploaded.content {
            UploadedContent::Surface(info) => info,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_surface_is_checked_in_its_probable_unit_and_again_in_another() {
        let shelf = Shelf::default();
        let taken = shelf.take("a b/skin.obj", &tetrahedron(1e-3)).unwrap();
        assert_eq!(taken.name, "skin.obj");
        let info = surface_of(&taken);
        assert_eq!((info.n_triangles, info.is_closed), (4, true));
        assert_eq!(info.unit, LengthUnit::Mm);
        assert!(info.size.iter().all(|side| (side - 100.0).abs() < 1e-9));
        assert!(info.findings.iter().all(|f| f.kind != "scale"));
        let again = shelf.check(taken.id, LengthUnit::M).unwrap();
        let info = surface_of(&again);
        assert_eq!(
            (info.unit, info.probable_unit),
            (LengthUnit::M, LengthUnit::Mm)
        );
        assert!(info.findings.iter().any(|f| f.kind == "scale"));
        assert!(shelf.check(99, LengthUnit::M).is_none());

        let mesh = shelf.mesh(taken.id).unwrap();
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (12, 12));
        assert!(mesh.positions.iter().all(|x| x.abs() <= 50.0));
    }

    #[test]
    fn a_vertex_without_a_place_is_shown_at_a_neighbour() {
        let shelf = Shelf::default();
        let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\nnan 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";
        let taken = shelf.take("skin.ply", ply.as_bytes()).unwrap();
        let info = surface_of(&taken);
        let found = info.findings.iter().find(|f| f.kind == "not-finite");
        let places = &found.unwrap().places;
        assert!(places.len() == 1 && places[0].iter().all(|x| x.is_finite()));
        assert!(info.size.iter().all(|x| x.is_finite()));
        let mesh = shelf.mesh(taken.id).unwrap();
        assert_eq!(mesh.triangles.len(), 3, "only the whole triangle is drawn");
    }

    #[test]
    fn bad_files_are_refused_with_place_and_advice() {
        let shelf = Shelf::default();
        let why = |name: &str, bytes: &[u8]| {
            let error = shelf.take(name, bytes).unwrap_err();
            palpa::one_paragraph(&error)
        };
        let wild = why("skin.obj", b"v 0 0 0\nf 1 2 3\n");
        assert!(
            wild.contains("skin.obj") && wild.contains("line 2"),
            "{wild}"
        );
        let other = why("notes.docx", b"hello");
        assert!(other.contains(".docx") && other.contains("STL"), "{other}");
        assert!(why("skin.stl", b"").contains("is empty"));
        assert!(why("scene.toml", b"[body]").contains("is a scene"));
        assert!(why("..", b"\0\0").contains("not known"));
    }

    #[test]
    fn old_files_make_room_for_new_ones() {
        let shelf = Shelf::default();
        let ids: Vec<u32> = (0..=MOST_KEPT)
            .map(|_| shelf.take("a.csv", b"x,y,z,thickness\n").unwrap().id)
            .collect();
        assert!(shelf.item(ids[0]).is_none());
        let first = shelf.item(ids[1]).unwrap();
        assert_eq!(shelf.kept().items.len(), MOST_KEPT);
        // Its folder goes with its last user.
        let path = first.folder.path().to_owned();
        assert!(path.join("a.csv").is_file());
        drop((first, shelf));
        assert!(!path.exists());
    }

    #[test]
    fn a_scene_grows_from_a_surface_in_a_folder_of_its_own() {
        let shelf = Shelf::default();
        let skin = shelf.take("skin.obj", &tetrahedron(1e-3)).unwrap().id;
        let bone = shelf.take("skin.obj", &tetrahedron(1e-2)).unwrap().id;
        let (scene, folder) = shelf
            .grown(skin, &[bone], LengthUnit::Mm, Template::Limb)
            .unwrap();
        assert_eq!(names_of(&scene), ["skin-2.obj", "skin.obj"]);
        assert!(scene.files().iter().all(|path| path.is_file()));
        assert_eq!(scene.layers.len(), 3);
        assert!(scene.layers[2].thickness.is_none(), "down to the bone");
        let path = folder.path().to_owned();
        drop(folder);
        assert!(!path.exists());
        let error = shelf.grown(77, &[], LengthUnit::M, Template::Limb);
        assert!(error.unwrap_err().to_string().contains("send it again"));
    }

    #[test]
    fn a_text_may_refer_to_the_files_that_came_with_it_and_to_no_others() {
        let shelf = Shelf::default();
        let skin = shelf.take("skin.obj", &tetrahedron(1.0)).unwrap().id;
        let text = |path: &str| {
            format!(
                "[body]\nsurface = '{path}'\n[[layer]]\ntissue = \"fat\"\nthickness = \"10 mm\"\n[press]\ndepth = \"2 mm\"\n"
            )
        };
        let (scene, _folder) = shelf.scene_of_text(&text("skin.obj"), &[skin]).unwrap();
        assert!(scene.files()[0].is_file());
        for path in [
            "other.obj",
            "/etc/passwd",
            "../skin.obj",
            "a/../../skin.obj",
        ] {
            let error = shelf.scene_of_text(&text(path), &[skin]).unwrap_err();
            assert!(error.to_string().contains(path), "{error}");
        }
    }
}
