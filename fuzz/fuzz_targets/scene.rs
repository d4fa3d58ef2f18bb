#![no_main]

use libfuzzer_sys::fuzz_target;
use palpa_scene::Scene;

// What is read is written and read again, and must be the same scene.
fuzz_target!(|text: &str| {
    let folder = "bodies".as_ref();
    let Ok(scene) = Scene::parse(text, folder) else {
        return;
    };
    let again = Scene::parse(&scene.to_toml(), folder)
        .expect("a scene that was read can be written and read");
    assert_eq!(scene.to_toml(), again.to_toml());
});
