//! Meshes of the loop and of its audit on flat layers, against a solution by other means.

use palpa::audit::{REFERENCE_SHARE, Reference};
use palpa_fem::PosedTool;
use palpa_mesh::Vec3;
use palpa_testkit::{Layer, Scene, Value};

use crate::live;

/// Depths, m.
const DEPTHS: [f64; 2] = [3e-3, 5e-3];

/// Thin skin, soft fat and muscle, mm, on a rigid base.
fn thin_over_soft(muscle: f64) -> Scene {
    Scene::block([100.0, 100.0, 5.5 + muscle], 10.0)
        .layer(Layer::elastic("skin", "210 kPa").thick(1.5))
        .layer(Layer::of(r#"name = "fat", c10 = "0.42 kPa", bulk = "36 kPa""#).thick(4.0))
        .layer(Layer::elastic("muscle", "22 kPa"))
        .sphere(10.0)
}

/// Layers, and forces on a ball of 10 mm at the depths, N: axisymmetric elements with quadratic
/// displacements and linear pressures, 0.6 mm long under the ball, on a cylinder of 50 mm (B2: 56.4 mm, as
/// large as the block); contact by a penalty that moves them by 0.2 % if it is four times as stiff.
fn slabs() -> [(Scene, [f64; 2]); 3] {
    let b2 = Scene::skin_fat_muscle(1, 1).sized([100.0, 100.0, 40.0], 10.0);
    [
        (thin_over_soft(4.0), [0.9285, 3.085]),
        (thin_over_soft(15.0), [0.619, 1.683]),
        (b2, [0.3606, 0.890]),
    ]
}

#[test]
fn meshes_of_the_loop_and_of_its_audit_agree_with_an_axisymmetric_solution() {
    for (layers, forces) in slabs() {
        let scene = layers
            .press(4.0)
            .set("press", "at", Value::lengths([3.0, 2.0, 0.0]))
            .motion("stroke", 5.0)
            .set("motion", "length", "20 mm");
        let live = live(&scene);
        let own = Reference::on(&live.prepared).unwrap();
        let place = live.prepared.place();
        for (depth, expected) in DEPTHS.into_iter().zip(forces) {
            let mut pose = live.scene_from_device;
            // Beside the place, on the way of the stroke.
            let at = place.at + Vec3::new(4e-3, 0.0, 0.0);
            pose.translation.vector = at + place.direction.into_inner() * depth;
            let tool = PosedTool {
                tool: live.tool,
                pose,
            };
            let tip = pose.translation.vector;
            let finer = Reference::round(&live.prepared, tip, REFERENCE_SHARE).unwrap();
            for (mesh, most) in [(&own, 0.04), (&finer, 0.015)] {
                let error = mesh.press(&tool).force.unwrap().norm() / expected - 1.0;
                println!(
                    "{} nodes, {:.0} mm deep: {:+.2} %",
                    mesh.n_nodes(),
                    1e3 * depth,
                    1e2 * error
                );
                assert!(error.abs() < most, "{depth} m: {error}");
            }
        }
    }
}
