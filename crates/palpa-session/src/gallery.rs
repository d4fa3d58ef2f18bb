//! The gallery: scenes that a page can choose.

use std::path::Path;

use anyhow::Context as _;
use palpa_scene::Scene;
use palpa_viewer::control::GalleryEntry;

/// Key, name in English, and text of each scene file.
const SCENES: [(&str, &str, &str); 6] = [
    (
        "forearm",
        "Forearm",
        include_str!("../scenes/gallery/forearm.toml"),
    ),
    (
        "forearm_lump",
        "Forearm with a lump",
        include_str!("../scenes/gallery/forearm_lump.toml"),
    ),
    (
        "limb",
        "Limb like a calf",
        include_str!("../scenes/gallery/limb.toml"),
    ),
    (
        "block",
        "Layered block",
        include_str!("../scenes/gallery/block.toml"),
    ),
    (
        "patch_bars",
        "36 nodes of 2009, bars",
        include_str!("../scenes/gallery/patch_bars.toml"),
    ),
    (
        "patch_tissue",
        "36 nodes of 2009, continuum",
        include_str!("../scenes/gallery/patch_tissue.toml"),
    ),
];

/// Key of the scene that is shown when none is named.
pub const FIRST: &str = SCENES[0].0;

/// All scenes of the gallery, in order.
pub fn entries() -> Vec<GalleryEntry> {
    SCENES
        .iter()
        .map(|(key, name, _)| GalleryEntry {
            key: (*key).to_owned(),
            name: (*name).to_owned(),
        })
        .collect()
}

/// The scene with this key.
///
/// # Errors
/// When no scene has this key.
pub fn scene(key: &str) -> anyhow::Result<Scene> {
    let known = || {
        let keys: Vec<&str> = SCENES.iter().map(|(key, ..)| *key).collect();
        format!("there is no scene \"{key}\"; there are {}", keys.join(", "))
    };
    let (_, _, text) = SCENES
        .iter()
        .find(|(k, ..)| *k == key)
        .with_context(known)?;
    Scene::parse(text, Path::new("")).with_context(|| format!("the scene \"{key}\""))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::World;

    #[test]
    fn every_scene_can_be_pressed_and_the_patch_of_2009_has_its_36_nodes() {
        for entry in entries() {
            let world = World::build(&scene(&entry.key).unwrap()).unwrap();
            assert!(world.home.thickness > 5e-3, "{}", entry.key);
            assert!(world.greatest_depth() > 2e-3, "{}", entry.key);
            if entry.key.starts_with("patch") {
                assert_eq!(world.n_nodes(), 36, "{}", entry.key);
            }
        }
        assert!(
            scene("nonsense")
                .unwrap_err()
                .to_string()
                .contains("forearm")
        );
    }
}
