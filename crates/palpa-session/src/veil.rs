//! Decides what pages may see while lumps are hidden. No other module decides this.

use anyhow::bail;
use palpa::Note;
use palpa_scene::Scene;
use palpa_viewer::control::{self, Field, LumpInfo, MapSight};

use crate::game::Game;
use crate::publish::shown;

/// Whether lumps are hidden.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Veil<'a> {
    /// Pages may see everything.
    Lifted,
    /// Lumps are hidden.
    Drawn {
        /// The scene before they were hidden: the one that pages may see.
        before: &'a Scene,
        /// What pages may see of the palpation map.
        map: MapSight,
    },
}

impl<'a> Veil<'a> {
    /// The veil over a game, if one is on.
    pub(crate) fn of(game: Option<&'a Game>) -> Self {
        match game {
            Some(game) if !game.is_revealed() => Self::Drawn {
                before: &game.before,
                map: game.map_sight(),
            },
            _ => Self::Lifted,
        }
    }

    /// Whether lumps are hidden.
    pub(crate) fn is_drawn(self) -> bool {
        matches!(self, Self::Drawn { .. })
    }

    /// Refuses a field that shows where lumps are.
    pub(crate) fn check_field(self, field: Field) -> anyhow::Result<()> {
        if self.is_drawn() && field != Field::None {
            bail!("while lumps are hidden, only the displacement can be shown");
        }
        Ok(())
    }

    /// Refuses a recording: its log holds the scene with its lumps.
    pub(crate) fn check_recording(self) -> anyhow::Result<()> {
        if self.is_drawn() {
            bail!(
                "a log contains the whole scene with its hidden lumps; reveal the lumps before you record"
            );
        }
        Ok(())
    }

    /// Whether the file of the body may be had: its mesh is finer around lumps.
    pub(crate) fn shows_body_file(self) -> bool {
        !self.is_drawn()
    }

    /// Whether error bars may be shown: they are smaller where the mesh is finer around lumps.
    pub(crate) fn shows_error_bars(self) -> bool {
        !self.is_drawn()
    }

    /// Whether a mesh may carry the stiffness of lumps.
    pub(crate) fn shows_lumps(self) -> bool {
        !self.is_drawn()
    }

    /// What may be shown of the palpation map: it shows what the hand is to find by itself.
    pub(crate) fn map(self) -> MapSight {
        match self {
            Self::Lifted => MapSight::Everything,
            Self::Drawn { map, .. } => map,
        }
    }

    /// The scene for the file of the scene.
    pub(crate) fn scene_file(self, scene: &'a Scene) -> &'a Scene {
        match self {
            Self::Lifted => scene,
            Self::Drawn { before, .. } => before,
        }
    }

    /// The scene for the state: the one that is pressed, without hidden lumps.
    pub(crate) fn scene(self, scene: &Scene) -> Scene {
        let mut scene = scene.clone();
        if self.is_drawn() {
            scene.lumps.clear();
        }
        scene
    }

    /// The lumps for the state.
    pub(crate) fn lumps(self, lumps: &[LumpInfo]) -> Vec<LumpInfo> {
        if self.is_drawn() {
            Vec::new()
        } else {
            lumps.to_vec()
        }
    }

    /// The notes for the state.
    pub(crate) fn notes(self, notes: &[Note]) -> Vec<control::Note> {
        (notes.iter())
            // A note on a lump says where it is.
            .filter(|note| !(self.is_drawn() && note.is_about_lumps()))
            .map(shown)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drawn_veil_lets_nothing_of_lumps_through() {
        let before = Scene::embedded();
        let lump = r#"
            [[lump]]
            name = "secret"
            shape = "sphere"
            radius = "5 mm"
            below = ["120 mm", "0 mm", "40 mm"]
            depth = "12 mm"
            tissue = "fibrous lump"
        "#;
        let text = format!("{}\n{lump}", before.to_toml());
        let pressed = Scene::parse(&text, &before.base_dir).unwrap();
        assert_eq!(pressed.lumps.len(), 1);
        let left_out = Note::TensionLeftOut;
        let notes = [Note::LevelsTooHigh { max_levels: 9 }, left_out.clone()];

        let drawn = Veil::Drawn {
            before: &before,
            map: MapSight::Nothing,
        };
        assert!(drawn.scene(&pressed).lumps.is_empty());
        assert_eq!(*drawn.scene_file(&pressed), before);
        assert_eq!(drawn.notes(&notes), [shown(&left_out)]);
        assert!(drawn.check_field(Field::VonMises).is_err());
        assert!(drawn.check_field(Field::None).is_ok());
        assert!(drawn.check_recording().is_err());
        assert!(!drawn.shows_body_file() && !drawn.shows_lumps());
        assert_eq!(drawn.map(), MapSight::Nothing);

        let lifted = Veil::Lifted;
        assert_eq!(lifted.scene(&pressed), pressed);
        assert_eq!(*lifted.scene_file(&pressed), pressed);
        assert_eq!(lifted.notes(&notes).len(), 2);
        assert!(lifted.check_field(Field::VonMises).is_ok());
        assert!(lifted.check_recording().is_ok());
        assert!(lifted.shows_body_file() && lifted.shows_lumps());
        assert_eq!(lifted.map(), MapSight::Everything);
    }
}
