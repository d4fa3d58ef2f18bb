//! Static forces on meshes that are finer than the loop's.

use std::path::Path;

use palpa::audit::{REFERENCE_SHARE, Reference, Stop, has_history, thinned};
use palpa::live::LiveScene;
use palpa::mesh::Vec3;
use palpa::scene::Scene;
use palpa_testkit::{Layer, Scene as SceneText};

fn block() -> SceneText {
    SceneText::block([60.0, 60.0, 20.0], 10.0)
        .layer(Layer::elastic("gel", "10 kPa").levels(3))
        .sphere(8.0)
        .near_tool(3.0)
        .press(3.0)
        .motion("stroke", 3.0)
        .set("motion", "length", "8 mm")
}

fn live(scene: &SceneText) -> LiveScene {
    LiveScene::build(&Scene::parse(&scene.to_string(), Path::new(".")).unwrap()).unwrap()
}

fn stop(live: &LiveScene, x: f64, depth: f64, time: f64) -> Stop {
    let above = live.prepared.scene.motion.above;
    Stop {
        tool: live.posed(Vec3::new(x, 0.0, -above - depth)),
        time,
    }
}

#[test]
fn a_reference_is_finer_than_the_mesh_of_the_loop_and_near_to_a_still_finer_one() {
    let live = live(&block());
    let tool = stop(&live, 1.3e-3, 3e-3, 0.0).tool;
    let at = tool.pose.translation.vector;
    let force = |mesh: &Reference| mesh.press(&tool).force.unwrap().z;
    let own = Reference::on(&live.prepared).unwrap();
    let round = |times: f64| {
        let share = times * REFERENCE_SHARE;
        Reference::round(&live.prepared, at, share).unwrap()
    };
    let [coarse, fine] = [2.0, 1.4].map(round);
    assert!(fine.n_nodes() > coarse.n_nodes() && coarse.n_nodes() > own.n_nodes());
    assert!(fine.mesh_size() < 0.8 * own.mesh_size());
    let [own, coarse, fine] = [force(&own), force(&coarse), force(&fine)];
    println!("{own} {coarse} {fine} N");
    assert!((coarse / fine - 1.0).abs() < 0.05, "{coarse} {fine}");
    assert!((own / fine - 1.0).abs() < 0.2, "{own} {fine}");
}

/// A scene may ask for edges of its own under the tool. All else stays as the loop chooses it: edges a little
/// longer or shorter than by default change the force a little, and not for the worse.
#[test]
fn edges_that_a_scene_gives_change_the_force_a_little() {
    let scene = || {
        SceneText::block([60.0, 60.0, 20.0], 10.0)
            .layer(Layer::elastic("skin", "100 kPa").thick(1.5))
            .layer(Layer::elastic("fat", "5 kPa").thick(6.0))
            .layer(Layer::elastic("muscle", "30 kPa"))
            .sphere(8.0)
            .press(3.0)
            .motion("press", 3.0)
    };
    let error = |scene: &SceneText| {
        let live = live(scene);
        let tool = stop(&live, 0.0, 3e-3, 0.0).tool;
        let at = tool.pose.translation.vector;
        let own = Reference::on(&live.prepared).unwrap().press(&tool).force;
        let fine = Reference::round(&live.prepared, at, 1.4 * REFERENCE_SHARE).unwrap();
        let fine = fine.press(&tool).force;
        let error = own.unwrap().z / fine.unwrap().z - 1.0;
        println!(
            "{:.2} mm, {} nodes: {error:+.4}",
            1e3 * live.mesh_size,
            live.model.n_nodes()
        );
        error
    };
    let usual = error(&scene());
    assert!(usual.abs() < 0.03, "{usual}");
    for given in [3.5, 2.5] {
        let given = error(&scene().near_tool(given));
        assert!(given.abs() < 0.03, "{given}");
    }
}

/// A ball of 30 mm that is pressed 2.5 mm deep has a contact as small as one of 10 mm, and needs its edges.
#[test]
fn a_large_ball_has_a_mesh_for_the_depth_of_the_hand() {
    let scene = SceneText::block([80.0, 80.0, 30.0], 10.0)
        .layer(Layer::elastic("gel", "10 kPa"))
        .sphere(30.0)
        .press(2.5)
        .motion("press", 2.5);
    let live = live(&scene);
    let tool = stop(&live, 0.0, 2.5e-3, 0.0).tool;
    let at = tool.pose.translation.vector;
    let own = Reference::on(&live.prepared).unwrap().press(&tool).on_loop;
    let fine = Reference::round(&live.prepared, at, REFERENCE_SHARE).unwrap();
    assert!(fine.mesh_size() < 0.75 * live.mesh_size);
    assert!(fine.n_nodes() > 2 * live.model.n_nodes());
    let fine = fine.press(&tool).force.unwrap().z;
    let error = own.unwrap().z / fine - 1.0;
    println!("{} nodes: {error:+.4}", live.model.n_nodes());
    assert!(error.abs() < 0.03, "{error}");
}

#[test]
fn without_friction_the_way_does_not_matter_and_with_friction_it_does() {
    for friction in [0.0, 0.3] {
        let live = live(&block().set(
            "tool",
            "friction",
            palpa_testkit::Value::raw(friction.to_string()),
        ));
        assert_eq!(has_history(&live.prepared.scene), friction > 0.0);
        let way: Vec<Stop> = (0..=14)
            .map(|i| {
                let s = f64::from(i) * 0.5e-3;
                stop(&live, (s - 3e-3).max(0.0), s.min(3e-3) - 0.1e-3, 0.0)
            })
            .collect();
        let mesh = Reference::on(&live.prepared).unwrap();
        let forces = mesh.follow(&way, || true);
        let gone = forces.last().unwrap().unwrap();
        let straight = mesh.press(&way[14].tool).force.unwrap();
        let differ = (gone - straight).norm() / straight.norm();
        if friction > 0.0 {
            assert!(differ > 0.1 && -gone.x > 0.1 * gone.z, "{gone} {straight}");
        } else {
            assert!(differ < 1e-3, "{gone} {straight}");
        }
        let given_up = mesh.follow(&way, || false);
        assert!(given_up.iter().all(Option::is_none));
    }
}

#[test]
fn a_way_is_thinned_but_keeps_what_is_asked_for() {
    let live = live(&block());
    let way: Vec<Stop> = (0..=100)
        .map(|i| stop(&live, 0.0, 1e-4 * f64::from(i), 1e-3 * f64::from(i)))
        .collect();
    let kept = thinned(&way, &[33, 34], 0.55e-3, None);
    assert!(
        kept.starts_with(&[0, 5, 10]) && kept.ends_with(&[94, 99]),
        "{kept:?}"
    );
    assert!(kept.contains(&33) && kept.contains(&34), "{kept:?}");
    let in_time = thinned(&way, &[], 1.0, Some(10.5e-3));
    assert_eq!(in_time, [0, 10, 20, 30, 40, 50, 60, 70, 80, 90]);
}
