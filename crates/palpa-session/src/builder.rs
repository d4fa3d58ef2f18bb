//! The wanted scene, and the thread that builds its body.
//!
//! ```text
//!  Idle ── build ──► Building ── another scene is wanted ──► Stale
//!    ▲ finish: take over │                                     │ finish: leave it, build again
//!    └───────────────────┘                                     └──► Building
//! ```
//! One body is built at a time. Meanwhile, the previous body can be pressed.

use std::io;
use std::sync::mpsc::Sender;
use std::thread;

use palpa_scene::Scene;

use crate::remote::Order;
use crate::world::World;

/// A scene that a page asked for.
#[derive(Debug, Clone)]
pub(crate) struct Wanted {
    /// The scene.
    pub(crate) scene: Scene,
    /// Its key, if it is of the gallery.
    pub(crate) key: Option<String>,
}

/// The builder's state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Work {
    /// Nothing is being built.
    Idle,
    /// The wanted scene is being built.
    Building,
    /// A scene is being built that is no longer wanted.
    Stale,
}

/// Starts to build a scene on another thread. The outcome arrives as [`Order::Built`].
type StartBuilding = Box<dyn FnMut(&Scene) -> io::Result<()> + Send>;

/// The builder.
pub(crate) struct Builder {
    /// The scene of the present body, or the scene that will replace it.
    pub(crate) wanted: Wanted,
    work: Work,
    start: StartBuilding,
}

impl Builder {
    /// A builder that builds on threads of its own and sends each outcome to `orders`.
    pub(crate) fn new(wanted: Wanted, orders: Sender<Order>) -> Self {
        Self::starting(wanted, Box::new(move |scene| spawn(scene, &orders)))
    }

    fn starting(wanted: Wanted, start: StartBuilding) -> Self {
        Self {
            wanted,
            work: Work::Idle,
            start,
        }
    }

    /// Builds the wanted scene, now or after the present build.
    ///
    /// # Errors
    /// When the system gives no thread.
    pub(crate) fn build(&mut self) -> io::Result<()> {
        self.work = match self.work {
            Work::Idle => {
                (self.start)(&self.wanted.scene)?;
                Work::Building
            }
            Work::Building | Work::Stale => Work::Stale,
        };
        Ok(())
    }

    /// Called when a build has ended. Returns whether it was for the wanted scene; if not, build
    /// again.
    #[must_use]
    pub(crate) fn finish(&mut self) -> bool {
        std::mem::replace(&mut self.work, Work::Idle) != Work::Stale
    }

    /// Whether a body is being built.
    pub(crate) fn is_building(&self) -> bool {
        self.work != Work::Idle
    }
}

fn spawn(scene: &Scene, orders: &Sender<Order>) -> io::Result<()> {
    let (scene, orders) = (scene.clone(), orders.clone());
    thread::Builder::new()
        .name("palpa-build".to_owned())
        .spawn(move || {
            let built = std::panic::catch_unwind(|| World::build(&scene));
            let built = built.unwrap_or_else(|_| {
                Err(anyhow::anyhow!(
                    "building the body failed because of a bug in Palpa, not of the scene"
                ))
            });
            // A session that has ended needs no body.
            let _ = orders.send(Order::Built(Box::new(built)));
        })?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::{Arc, Mutex};

    fn wanted(key: &str) -> Wanted {
        let mut scene = Scene::embedded();
        scene.layers[0].tissue.name = key.to_owned();
        Wanted {
            scene,
            key: Some(key.to_owned()),
        }
    }

    /// A builder, and the scenes that it started to build.
    fn builder(key: &str) -> (Builder, Arc<Mutex<Vec<String>>>) {
        let started = Arc::<Mutex<Vec<String>>>::default();
        let log = Arc::clone(&started);
        let start: StartBuilding = Box::new(move |scene| {
            log.lock()
                .unwrap()
                .push(scene.layers[0].tissue.name.clone());
            Ok(())
        });
        (Builder::starting(wanted(key), start), started)
    }

    #[test]
    fn a_body_that_is_still_wanted_is_taken_over() {
        let (mut builder, started) = builder("a");
        assert!(!builder.is_building());
        builder.build().unwrap();
        assert!(builder.is_building());
        assert!(builder.finish());
        assert!(!builder.is_building());
        assert_eq!(*started.lock().unwrap(), ["a"]);
    }

    #[test]
    fn of_scenes_wanted_meanwhile_only_the_latest_is_built() {
        let (mut builder, started) = builder("a");
        builder.build().unwrap();
        for key in ["b", "c", "d"] {
            builder.wanted = wanted(key);
            builder.build().unwrap();
        }
        assert_eq!(*started.lock().unwrap(), ["a"]);
        // "a" is built but no longer wanted.
        assert!(!builder.finish());
        builder.build().unwrap();
        assert_eq!(*started.lock().unwrap(), ["a", "d"]);
        assert!(builder.finish());
    }

    #[test]
    fn without_a_thread_the_builder_is_idle_and_can_be_asked_again() {
        let mut n_left = 1;
        let start: StartBuilding = Box::new(move |_| {
            n_left -= 1;
            if n_left >= 0 {
                Err(io::Error::other("no thread"))
            } else {
                Ok(())
            }
        });
        let mut builder = Builder::starting(wanted("a"), start);
        assert!(builder.build().is_err());
        assert!(!builder.is_building());
        builder.build().unwrap();
        assert!(builder.finish());
    }
}
