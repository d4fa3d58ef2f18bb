//! The gallery: the built-in scenes that a page can choose.

use anyhow::Context as _;
use palpa_scene::{BuiltIn, Scene};
use palpa_viewer::control::GalleryEntry;

fn scenes() -> impl Iterator<Item = &'static BuiltIn> {
    (BuiltIn::all().iter()).filter(|built_in| built_in.is_in_gallery)
}

/// All scenes of the gallery, in order.
pub(crate) fn entries() -> Vec<GalleryEntry> {
    scenes()
        .map(|built_in| GalleryEntry {
            key: built_in.key.to_owned(),
            name: built_in.name.to_owned(),
        })
        .collect()
}

/// The scene with this key.
///
/// # Errors
/// When no scene has this key.
pub(crate) fn scene(key: &str) -> anyhow::Result<Scene> {
    let known = || {
        let keys: Vec<&str> = scenes().map(|built_in| built_in.key).collect();
        format!("there is no scene \"{key}\"; there are {}", keys.join(", "))
    };
    let built_in = scenes().find(|s| s.key == key).with_context(known)?;
    built_in
        .scene()
        .with_context(|| format!("the scene \"{key}\""))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::World;

    #[test]
    fn every_scene_can_be_pressed_and_the_patch_of_2009_has_its_36_nodes() {
        assert_eq!(entries().len(), 6);
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
