//! Error bars of the live mesh.

use std::path::Path;
use std::sync::Arc;

use nalgebra::UnitQuaternion;
use palpa::accuracy::Descent;
use palpa::fem::realtime::FineBodies;
use palpa::live::{FineScene, LiveScene, Moment, NoBar, Prober, probe};
use palpa::mesh::Vec3;
use palpa::press::tissue::Indentation;
use palpa::scene::Scene;
use palpa_rt::Wish;
use palpa_testkit::{Layer, Scene as SceneText};

/// A soft layer under a stiff one, pressed by a ball.
fn block() -> SceneText {
    SceneText::block([60.0, 60.0, 20.0], 10.0)
        .layer(Layer::elastic("stiff", "60 kPa").thick(4.0))
        .layer(Layer::elastic("soft", "10 kPa").levels(3))
        .sphere(8.0)
        .near_tool(3.0)
        .press(3.0)
        .motion("press", 3.0)
}

fn parse(scene: &SceneText) -> Scene {
    Scene::parse(&scene.to_string(), Path::new(".")).unwrap()
}

/// The tool of a live scene at a depth below its first touch, `aside` (m) across.
fn moment(live: &LiveScene, depth: f64, aside: f64) -> Moment {
    let above = live.prepared.scene.motion.above;
    Moment {
        model: Arc::clone(&live.model),
        tool: live.posed(Vec3::new(aside, 0.0, -above - depth)),
    }
}

#[test]
fn the_bar_of_the_live_mesh_is_that_of_a_press_there_on_the_same_mesh() {
    let scene = parse(&block().growth(0.5));
    let live = LiveScene::build(&scene).unwrap();
    let bar = probe(&live.prepared, &moment(&live, 3e-3, 0.0), || true).unwrap();
    let press = Indentation::build(Arc::clone(&live.prepared)).unwrap();
    assert_eq!(bar.n_nodes, press.model.n_nodes());
    let probed = Descent::from_rest(&press, || true)
        .unwrap()
        .probe(&press, |_, _| true)
        .unwrap();
    let probed = probed.deepest();
    println!("{bar:?}\n{probed:?}");
    assert!((bar.probed.depth_mm - 3.0).abs() < 1e-6, "{bar:?}");
    assert!((bar.probed.force_n / probed.force_n - 1.0).abs() < 1e-6);
    assert!((bar.half_width - probed.half_width().unwrap()).abs() < 1e-4);
    assert!(bar.half_width > 0.002 && bar.half_width < 0.5, "{bar:?}");
    assert!((bar.at - press.place().at).norm() < 1e-6);
    assert!((bar.direction + Vec3::z()).norm() < 1e-9);
}

/// A mesh that moves is fine under the whole of a long tool, with room to go.
#[test]
fn a_mesh_that_moves_is_fine_under_a_long_tool() {
    let text = block()
        .sized([120.0, 60.0, 20.0], 10.0)
        .set("mesh", "moves", true)
        .set("tool", "shape", "capsule")
        .set("tool", "radius", "5 mm")
        .set("tool", "length", "40 mm")
        .motion("press", 3.0);
    let live = LiveScene::build(&parse(&text)).unwrap();
    let fine = FineScene::new(Arc::clone(&live.prepared)).unwrap();
    assert!(fine.radius() > 30e-3, "{} m", fine.radius());
}

/// A mesh that moves is probed as it is where the tool is, and a finer one has a smaller bar.
#[test]
fn a_mesh_that_moves_is_judged_where_it_is_fine() {
    let text = block()
        .sized([120.0, 60.0, 20.0], 10.0)
        .set("mesh", "moves", true)
        .motion("drag", 3.0)
        .set("motion", "length", "60 mm");
    let widths = ["4 mm", "2 mm"].map(|near| {
        let scene = parse(&text.clone().set("mesh", "near_tool", near));
        let live = LiveScene::build(&scene).unwrap();
        let fine = FineScene::new(Arc::clone(&live.prepared)).unwrap();
        let home = moment(&live, 3e-3, 0.0);
        let away = moment(&live, 3e-3, 30e-3);
        let at = away.tool.pose.translation.vector;
        let model = fine.model(fine.place(at)).unwrap();
        let bar = |moment: &Moment| probe(&live.prepared, moment, || true).unwrap();
        let there = bar(&Moment {
            model: Arc::clone(&model),
            ..away.clone()
        });
        assert!((there.at - at).xy().norm() < 1e-6, "{there:?} {at}");
        assert_eq!(there.n_nodes, model.n_nodes());
        // The mesh that is fine at home is coarse there.
        let home_model = fine.model(fine.place(home.tool.pose.translation.vector));
        let left = bar(&Moment {
            model: home_model.unwrap(),
            ..away
        });
        println!("{} here, {} left", there.half_width, left.half_width);
        there.half_width
    });
    assert!(widths[1] < 0.7 * widths[0], "{widths:?}");
}

#[test]
fn what_cannot_be_probed_says_why() {
    let live = LiveScene::build(&parse(&block())).unwrap();
    let none = |moment: &Moment| probe(&live.prepared, moment, || true).unwrap_err();
    assert_eq!(none(&moment(&live, -1e-3, 0.0)), NoBar::NotTouching);
    // Through the body.
    assert_eq!(none(&moment(&live, 25e-3, 0.0)), NoBar::NoEquilibrium);
    // Upside down.
    let mut turned = moment(&live, 3e-3, 0.0);
    let half_turn = UnitQuaternion::from_axis_angle(&Vec3::x_axis(), std::f64::consts::PI);
    turned.tool.pose.rotation = half_turn * turned.tool.pose.rotation;
    assert_eq!(none(&turned), NoBar::NotTouching);
    let moment = moment(&live, 3e-3, 0.0);
    let given_up = probe(&live.prepared, &moment, || false);
    assert_eq!(given_up, Err(NoBar::Interrupted));
    let n_asked = std::cell::Cell::new(0);
    let given_up = probe(&live.prepared, &moment, || {
        n_asked.set(n_asked.get() + 1);
        n_asked.get() < 4
    });
    assert_eq!((given_up, n_asked.get()), (Err(NoBar::Interrupted), 4));
}

#[test]
fn the_thread_gives_the_same_bar() {
    let live = LiveScene::build(&parse(&block())).unwrap();
    let moment = moment(&live, 2e-3, 0.0);
    let here = probe(&live.prepared, &moment, || true).unwrap();
    // With its share of the time however busy the machine is.
    let mut prober = Prober::start_as(Wish::NORMAL).unwrap();
    assert!(prober.begin(&live.prepared, moment.clone()));
    assert!(!prober.begin(&live.prepared, moment));
    assert_eq!(prober.wait(), Some(Ok(here)));
}
