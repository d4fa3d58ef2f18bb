//! The thread that builds the body of the wanted scene.
//!
//! ```text
//!  Idle ── build ──► Building ── another scene is wanted ──► Stale
//!    ▲ finish: take over │                                     │ finish: leave it, build again
//!    ├───────────────────┤ cancel                              └──► Building
//!    └─ finish: leave it ┴──► Cancelled
//! ```
//! One body is built at a time. Meanwhile, the previous body can be pressed. A build cannot be
//! interrupted: one that is cancelled ends by itself, and its body is left.

use std::io;
use std::sync::mpsc::Sender;
use std::thread;

use palpa_scene::Scene;

use crate::remote::Order;
use crate::world::World;

/// The builder's state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Work {
    /// Nothing is being built.
    Idle,
    /// The wanted scene is being built.
    Building,
    /// A scene is being built that is no longer wanted; another one is.
    Stale,
    /// A scene is being built that is no longer wanted; the present body is.
    Cancelled,
}

/// What to do with a body that was built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Built {
    /// It is the wanted one.
    Wanted,
    /// Another one is wanted: build again.
    Stale,
    /// None is wanted any more.
    Unwanted,
}

/// Starts to build a scene on another thread. The outcome arrives as [`Order::Built`].
type StartBuilding = Box<dyn FnMut(&Scene) -> io::Result<()> + Send>;

/// The builder.
pub(crate) struct Builder {
    work: Work,
    start: StartBuilding,
}

impl Builder {
    /// A builder that builds on threads of its own and sends each outcome to `orders`.
    pub(crate) fn new(orders: Sender<Order>) -> Self {
        Self::starting(Box::new(move |scene| spawn(scene, &orders)))
    }

    fn starting(start: StartBuilding) -> Self {
        Self {
            work: Work::Idle,
            start,
        }
    }

    /// Builds the wanted scene, now or after the present build.
    ///
    /// # Errors
    /// When the system gives no thread.
    pub(crate) fn build(&mut self, wanted: &Scene) -> io::Result<()> {
        self.work = match self.work {
            Work::Idle => {
                (self.start)(wanted)?;
                Work::Building
            }
            Work::Building | Work::Stale | Work::Cancelled => Work::Stale,
        };
        Ok(())
    }

    /// The body that is being built is not wanted any more, nor is another. Returns whether there was
    /// one.
    pub(crate) fn cancel(&mut self) -> bool {
        let is_wanted = self.is_building();
        if is_wanted {
            self.work = Work::Cancelled;
        }
        is_wanted
    }

    /// Called when a build has ended. Returns what to do with its body.
    #[must_use]
    pub(crate) fn finish(&mut self) -> Built {
        match std::mem::replace(&mut self.work, Work::Idle) {
            Work::Stale => Built::Stale,
            Work::Cancelled => Built::Unwanted,
            Work::Idle | Work::Building => Built::Wanted,
        }
    }

    /// Whether a body is being built that is wanted.
    pub(crate) fn is_building(&self) -> bool {
        matches!(self.work, Work::Building | Work::Stale)
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

    fn scene(name: &str) -> Scene {
        let mut scene = Scene::embedded();
        name.clone_into(&mut scene.layers[0].tissue.name);
        scene
    }

    /// A builder, and the scenes that it started to build.
    fn builder() -> (Builder, Arc<Mutex<Vec<String>>>) {
        let started = Arc::<Mutex<Vec<String>>>::default();
        let log = Arc::clone(&started);
        let start: StartBuilding = Box::new(move |scene| {
            log.lock()
                .unwrap()
                .push(scene.layers[0].tissue.name.clone());
            Ok(())
        });
        (Builder::starting(start), started)
    }

    #[test]
    fn a_body_that_is_still_wanted_is_taken_over() {
        let (mut builder, started) = builder();
        assert!(!builder.is_building() && !builder.cancel());
        builder.build(&scene("a")).unwrap();
        assert!(builder.is_building());
        assert_eq!(builder.finish(), Built::Wanted);
        assert!(!builder.is_building());
        assert_eq!(*started.lock().unwrap(), ["a"]);
    }

    #[test]
    fn of_scenes_wanted_meanwhile_only_the_latest_is_built() {
        let (mut builder, started) = builder();
        builder.build(&scene("a")).unwrap();
        for name in ["b", "c"] {
            builder.build(&scene(name)).unwrap();
            assert!(builder.is_building());
        }
        assert_eq!(builder.finish(), Built::Stale);
        builder.build(&scene("c")).unwrap();
        assert_eq!(builder.finish(), Built::Wanted);
        assert_eq!(*started.lock().unwrap(), ["a", "c"]);
    }

    #[test]
    fn a_body_that_was_cancelled_is_left() {
        let (mut builder, started) = builder();
        builder.build(&scene("a")).unwrap();
        assert!(builder.cancel());
        assert!(!builder.is_building(), "nothing that is wanted");
        // One build at a time, still.
        builder.build(&scene("b")).unwrap();
        assert_eq!(*started.lock().unwrap(), ["a"]);
        assert_eq!(builder.finish(), Built::Stale);
        builder.build(&scene("b")).unwrap();
        assert!(builder.cancel());
        assert_eq!(builder.finish(), Built::Unwanted);
        assert_eq!(*started.lock().unwrap(), ["a", "b"]);
    }

    #[test]
    fn without_a_thread_nothing_is_being_built() {
        let mut n_left = 1;
        let start: StartBuilding = Box::new(move |_| {
            n_left -= 1;
            if n_left >= 0 {
                Err(io::Error::other("no thread"))
            } else {
                Ok(())
            }
        });
        let mut builder = Builder::starting(start);
        assert!(builder.build(&scene("a")).is_err());
        assert!(!builder.is_building());
        builder.build(&scene("a")).unwrap();
        assert_eq!(builder.finish(), Built::Wanted);
    }
}
