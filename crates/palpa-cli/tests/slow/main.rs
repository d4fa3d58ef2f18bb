//! Tests that take minutes even with optimisation and need nothing but this tree: `make test-slow`.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod bench;
mod fast_hands;
mod faults;
mod lump_stroke;
mod moving;
mod palpation_map;
mod slabs;
mod slow_jobs;
mod stable;
mod strokes;
mod verify;

use std::path::{Path, PathBuf};

use palpa::live::LiveScene;
use palpa_plot::output::OutDir;
use palpa_scene::Scene;

/// The scene of a text, resolved.
fn resolved(scene: &impl ToString) -> Scene {
    Scene::parse(&scene.to_string(), Path::new("")).unwrap()
}

/// The scene of a text, built for real time.
fn live(scene: &impl ToString) -> LiveScene {
    LiveScene::build(&resolved(scene)).unwrap()
}

/// A folder under the build folder for tables and pictures that people look at after the tests.
fn results(name: &str) -> OutDir {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("results");
    OutDir::create(path.join(name)).unwrap()
}
