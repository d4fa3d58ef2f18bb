//! Undo and redo: the scenes that were wanted, in order, and which of them is wanted now.
//!
//! ```text
//!  scenes:  A ─ B ─ C ─ D        undo: B,  redo: D
//!                   ↑ wanted
//! ```
//! A change of another scene than the newest forgets those after it. Changes of the same keys that follow
//! each other quickly, as while a slider moves, count as one.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use palpa_scene::Scene;

use crate::own::Folder;

/// Most scenes that are kept.
const MOST_SCENES: usize = 100;
/// Most bytes of users' files that the kept scenes refer to.
const MOST_BYTES: u64 = 512 << 20;
/// Changes of the same keys within this time count as one.
const ONE_CHANGE: Duration = Duration::from_secs(2);

/// A scene that a page asked for.
#[derive(Debug, Clone)]
pub(crate) struct Wanted {
    /// The scene.
    pub(crate) scene: Scene,
    /// Its key, if it is of the gallery.
    pub(crate) key: Option<String>,
    /// The scene as it was loaded.
    pub(crate) origin: Arc<Origin>,
    /// The user's files that the scene refers to.
    pub(crate) files: Option<Arc<Folder>>,
}

/// A scene as it was loaded.
#[derive(Debug, PartialEq)]
pub(crate) struct Origin {
    /// Number of the load.
    pub(crate) number: u64,
    /// The scene.
    pub(crate) scene: Scene,
}

impl Wanted {
    /// A scene that is loaded.
    pub(crate) fn loaded(
        number: u64,
        scene: Scene,
        key: Option<String>,
        files: Option<Arc<Folder>>,
    ) -> Self {
        let origin = Arc::new(Origin {
            number,
            scene: scene.clone(),
        });
        Self {
            scene,
            key,
            origin,
            files,
        }
    }

    /// The same body with a changed scene.
    pub(crate) fn changed(&self, scene: Scene) -> Self {
        Self {
            scene,
            ..self.clone()
        }
    }

    /// Whether the scene was changed since it was loaded.
    pub(crate) fn is_changed(&self) -> bool {
        self.scene != self.origin.scene
    }

    fn is_same(&self, other: &Self) -> bool {
        self.origin.number == other.origin.number && self.scene == other.scene
    }
}

/// The scenes that were wanted.
#[derive(Debug)]
pub(crate) struct History {
    /// Never empty.
    scenes: VecDeque<Wanted>,
    at: usize,
    /// The keys that the last change set, and its time.
    last: Option<(Vec<String>, Instant)>,
}

impl History {
    /// The history of a session that begins.
    pub(crate) fn new(first: Wanted) -> Self {
        Self {
            scenes: [first].into(),
            at: 0,
            last: None,
        }
    }

    /// The scene that is wanted.
    pub(crate) fn wanted(&self) -> &Wanted {
        &self.scenes[self.at]
    }

    /// Adds a scene, which is then wanted. `keys` are those that an edit has set; none if the scene was
    /// loaded.
    pub(crate) fn push(&mut self, wanted: Wanted, keys: Vec<String>, now: Instant) {
        let is_newest = self.at + 1 == self.scenes.len();
        let is_one_change = is_newest
            && !keys.is_empty()
            && (self.last.as_ref()).is_some_and(|(before, at)| {
                *before == keys && now.duration_since(*at) < ONE_CHANGE
            });
        if is_one_change && self.at > 0 {
            self.scenes[self.at] = wanted;
        } else {
            self.scenes.truncate(self.at + 1);
            self.scenes.push_back(wanted);
            self.at += 1;
        }
        self.last = (!keys.is_empty()).then_some((keys, now));
        while self.scenes.len() > MOST_SCENES || (self.bytes() > MOST_BYTES && self.at > 0) {
            self.scenes.pop_front();
            self.at -= 1;
        }
    }

    /// The scene before the wanted one is wanted again. `None` if there is none.
    pub(crate) fn undo(&mut self) -> Option<&Wanted> {
        self.at = self.at.checked_sub(1)?;
        self.last = None;
        Some(self.wanted())
    }

    /// The scene after the wanted one is wanted again. `None` if there is none.
    pub(crate) fn redo(&mut self) -> Option<&Wanted> {
        (self.at + 1 < self.scenes.len()).then(|| self.at += 1)?;
        self.last = None;
        Some(self.wanted())
    }

    /// The wanted scene cannot be built, or is not wanted any more: forgets it, and wants the scene of the
    /// present body again.
    pub(crate) fn give_up(&mut self, present: &Wanted) {
        self.last = None;
        if self.wanted().is_same(present) {
            return;
        }
        let found = (0..self.scenes.len())
            // The nearest, if it was wanted several times.
            .filter(|&i| self.scenes[i].is_same(present))
            .min_by_key(|i| i.abs_diff(self.at));
        if let Some(found) = found {
            self.scenes.remove(self.at);
            self.at = found - usize::from(found > self.at);
        } else {
            self.scenes[self.at] = present.clone();
        }
    }

    /// Number of changes that can be undone.
    pub(crate) fn n_undo(&self) -> usize {
        self.at
    }

    /// Number of changes that can be redone.
    pub(crate) fn n_redo(&self) -> usize {
        self.scenes.len() - self.at - 1
    }

    /// Bytes of all users' files, each counted once.
    fn bytes(&self) -> u64 {
        let mut folders: Vec<&Arc<Folder>> = (self.scenes.iter())
            .filter_map(|w| w.files.as_ref())
            .collect();
        folders.dedup_by(|a, b| Arc::ptr_eq(a, b));
        folders.iter().map(|folder| folder.bytes()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(name: &str) -> Scene {
        let mut scene = Scene::embedded();
        name.clone_into(&mut scene.layers[0].tissue.name);
        scene
    }

    fn loaded(name: &str) -> Wanted {
        Wanted::loaded(1, scene(name), None, None)
    }

    fn keys(key: &str) -> Vec<String> {
        vec![key.to_owned()]
    }

    fn name(history: &History) -> &str {
        &history.wanted().scene.layers[0].tissue.name
    }

    #[test]
    fn changes_are_undone_and_redone_in_order() {
        let (mut history, now) = (History::new(loaded("a")), Instant::now());
        assert!(history.undo().is_none() && history.redo().is_none());
        for (i, next) in ["b", "c", "d"].into_iter().enumerate() {
            let wanted = history.wanted().changed(scene(next));
            history.push(wanted, keys(&format!("/{i}")), now);
        }
        assert!(history.wanted().is_changed());
        assert_eq!((history.n_undo(), history.n_redo()), (3, 0));
        history.undo().unwrap();
        history.undo().unwrap();
        assert_eq!((name(&history), history.n_redo()), ("b", 2));
        history.redo().unwrap();
        assert_eq!(name(&history), "c");
        // A change forgets what was undone.
        history.push(loaded("e"), Vec::new(), now);
        assert!(history.redo().is_none());
        let names: Vec<String> = std::iter::from_fn(|| {
            let name = history.undo()?.scene.layers[0].tissue.name.clone();
            Some(name)
        })
        .collect();
        assert_eq!(names, ["c", "b", "a"]);
        assert!(!history.wanted().is_changed());
    }

    #[test]
    fn a_slider_is_one_change_and_two_fields_are_two() {
        let (mut history, begin) = (History::new(loaded("a")), Instant::now());
        let at = |ms| begin + Duration::from_millis(ms);
        for (ms, next) in [(0, "b"), (500, "c"), (1900, "d"), (3800, "e")] {
            history.push(loaded(next), keys("/x"), at(ms));
        }
        assert_eq!((name(&history), history.n_undo()), ("e", 1));
        history.push(loaded("f"), keys("/y"), at(3900));
        history.push(loaded("g"), keys("/y"), at(6000));
        assert_eq!(history.n_undo(), 3);
        // What is loaded twice is two changes, however quickly.
        history.push(loaded("h"), Vec::new(), at(6001));
        history.push(loaded("i"), Vec::new(), at(6002));
        assert_eq!(history.n_undo(), 5);
        // After an undo a change is a new one.
        history.push(loaded("j"), keys("/z"), at(6003));
        history.undo();
        history.push(loaded("k"), keys("/z"), at(6004));
        assert_eq!((name(&history), history.n_undo()), ("k", 6));
    }

    #[test]
    fn the_history_is_bounded() {
        let (mut history, now) = (History::new(loaded("0")), Instant::now());
        for i in 1..=MOST_SCENES + 20 {
            history.push(loaded(&i.to_string()), Vec::new(), now);
        }
        assert_eq!(history.n_undo(), MOST_SCENES - 1);
        while history.undo().is_some() {}
        assert_eq!(name(&history), "21");
    }

    #[test]
    fn a_scene_that_fails_is_forgotten_and_the_present_one_wanted_again() {
        let now = Instant::now();
        let (a, b) = (loaded("a"), loaded("b"));
        let mut history = History::new(a.clone());
        history.push(b.clone(), keys("/x"), now);
        history.push(loaded("bad"), keys("/y"), now);
        history.give_up(&b);
        assert_eq!(
            (name(&history), history.n_undo(), history.n_redo()),
            ("b", 1, 0)
        );
        // Undone to a scene that fails now.
        history.undo();
        history.give_up(&b);
        assert_eq!(
            (name(&history), history.n_undo(), history.n_redo()),
            ("b", 0, 0)
        );
        // One change of a slider failed after another was built: the built one stays.
        history.push(loaded("c"), keys("/x"), now);
        let built = loaded("d");
        history.push(built.clone(), keys("/x"), now);
        history.push(loaded("bad"), keys("/x"), now);
        history.give_up(&built);
        assert_eq!((name(&history), history.n_undo()), ("d", 1));
        // Nothing fails.
        history.give_up(&built);
        assert_eq!((name(&history), history.n_undo()), ("d", 1));
    }

    #[test]
    fn files_go_with_the_scenes_that_need_them() {
        let folder = Arc::new(Folder::new_for_test(300 << 20));
        let path = folder.path().to_owned();
        let with = |number| Wanted::loaded(number, scene("own"), None, Some(Arc::clone(&folder)));
        let now = Instant::now();
        let mut history = History::new(loaded("a"));
        history.push(with(2), Vec::new(), now);
        // The same files again are not counted twice.
        history.push(with(3), Vec::new(), now);
        assert_eq!(history.n_undo(), 2);
        drop(folder);
        let other = Arc::new(Folder::new_for_test(300 << 20));
        let wanted = Wanted::loaded(4, scene("other"), None, Some(other));
        history.push(wanted, Vec::new(), now);
        assert_eq!(history.n_undo(), 0);
        assert!(!path.exists());
    }
}
