//! Scenes set up for real time: what is refused, and what is noted.

use std::path::Path;

use palpa::Note;
use palpa::live::{LiveScene, SpringScene};
use palpa::scene::Scene;
use palpa_testkit::{Layer, Scene as SceneText, Value};

fn block() -> SceneText {
    SceneText::block([40.0, 40.0, 16.0], 10.0)
        .layer(Layer::elastic("gel", "10 kPa"))
        .press(1.0)
}

fn parse(scene: &SceneText) -> Scene {
    Scene::parse(&scene.to_string(), Path::new(".")).unwrap()
}

#[test]
fn a_slanted_press_of_the_reference_method_is_noted() {
    let notes = |direction: &str| {
        let scene = block()
            .disc(8.0)
            .set("press", "direction", Value::raw(direction));
        SpringScene::build(&parse(&scene)).unwrap().notes
    };
    assert_eq!(notes("[0.0, 0.0, -1.0]"), []);
    // 60° is the limit; the tangent of 63.4° is 2.
    let [Note::ObliquePress { angle }] = notes("[2.0, 0.0, -1.0]")[..] else {
        panic!("{:?}", notes("[2.0, 0.0, -1.0]"));
    };
    assert!((angle - 2f64.atan()).abs() < 1e-9, "{angle}");
}

#[test]
fn a_bonded_tool_and_a_moving_mesh_without_refinement_are_refused() {
    let refusal = |scene: SceneText| LiveScene::build(&parse(&scene)).unwrap_err().to_string();
    let bonded = refusal(block().disc(8.0));
    assert!(bonded.contains("presses by contact"), "{bonded}");
    let still = block()
        .sphere(8.0)
        .set("mesh", "moves", true)
        .set("mesh", "refine", false);
    let still = refusal(still);
    assert!(still.contains("needs refine = true"), "{still}");
}
