//! The built-in scenes: those of the page's gallery, those that commands use if none is named, and
//! starts for scenes of one's own.
//!
//! To add one: put its file into `scenes/`, and a row into `SCENES`. A scene of the gallery also
//! gets a name for each language of the page, in `web/src/i18n`.

use std::path::Path;

use crate::{Scene, SceneError};

/// A scene that is part of the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BuiltIn {
    /// Its name on the command line, and its key in the gallery.
    pub key: &'static str,
    /// Its name for people.
    pub name: &'static str,
    /// What it is, in a line.
    pub about: &'static str,
    /// Its scene file, with comments.
    pub toml: &'static str,
    /// Whether the page offers it.
    pub is_in_gallery: bool,
    /// Whether it names surface files that the user has to add.
    pub is_template: bool,
}

/// A row of [`SCENES`]; the file has the name of the key.
macro_rules! scene {
    ($key:literal, $name:literal, $about:literal) => {
        BuiltIn {
            key: $key,
            name: $name,
            about: $about,
            toml: include_str!(concat!("../scenes/", $key, ".toml")),
            is_in_gallery: false,
            is_template: false,
        }
    };
}

/// A scene that the page offers.
const fn in_gallery(scene: BuiltIn) -> BuiltIn {
    BuiltIn {
        is_in_gallery: true,
        ..scene
    }
}

/// The scene that is shown if none is named.
pub const VIEWED: &str = "forearm";
/// The scene that is pressed along a script if none is named.
pub const PRESSED: &str = "forearm_press";
/// The scene that is pressed by a method without contact if none is named.
pub const PRESSED_BONDED: &str = "forearm_disc";
/// The scene that the loop runs in real time if none is named.
pub const LOOPED: &str = "forearm_loop";

const SCENES: [BuiltIn; 12] = [
    in_gallery(scene!(
        "forearm",
        "Forearm",
        "skin, fat and muscle on two bones, for real time"
    )),
    in_gallery(scene!(
        "forearm_lump",
        "Forearm with a lump",
        "the same with a fibrous lump of 16 mm in the muscle"
    )),
    in_gallery(scene!(
        "limb",
        "Limb like a calf",
        "a round limb with one bone; the fingertip has friction"
    )),
    in_gallery(scene!(
        "block",
        "Layered block",
        "a phantom: soft silicone with a stiffer slab inside"
    )),
    in_gallery(scene!(
        "patch_bars",
        "36 nodes of 2009, bars",
        "soft, hard and soft bars: the method of 2009"
    )),
    in_gallery(scene!(
        "patch_tissue",
        "36 nodes of 2009, continuum",
        "the same block as a continuum under a ball"
    )),
    scene!(
        "forearm_press",
        "Forearm, pressed along a script",
        "the forearm with tissues that relax, for palpa press"
    ),
    scene!(
        "forearm_press_lump",
        "Forearm with a lump, pressed along a script",
        "the same with a fibrous lump of 12 mm in the muscle"
    ),
    scene!(
        "forearm_disc",
        "Forearm under a bonded disc",
        "the forearm under a disc, for methods without contact"
    ),
    scene!(
        "forearm_five_tissues",
        "Forearm of five tissues",
        "epidermis, dermis, fat, relaxed and contracted muscle"
    ),
    scene!(
        "forearm_loop",
        "Forearm with a lump, for the loop",
        "the forearm with a lump, stroked by a simulated hand"
    ),
    BuiltIn {
        is_template: true,
        ..scene!(
            "own_mesh",
            "Your own meshes",
            "a start to fill in: skin and bones from mesh files"
        )
    },
];

impl BuiltIn {
    /// All built-in scenes; those of the gallery come first, in its order.
    pub fn all() -> &'static [Self] {
        &SCENES
    }

    /// The scene with this key. Upper case and hyphens are allowed, as in `Forearm-Lump`.
    pub fn find(key: &str) -> Option<&'static Self> {
        let key = key.replace('-', "_");
        SCENES.iter().find(|s| s.key.eq_ignore_ascii_case(&key))
    }

    /// The scene, read and checked. Paths in a template are relative to the current folder.
    ///
    /// # Errors
    /// Never: the files are valid, which a test checks.
    pub fn scene(&self) -> Result<Scene, SceneError> {
        Scene::parse(self.toml, Path::new(""))
    }
}
