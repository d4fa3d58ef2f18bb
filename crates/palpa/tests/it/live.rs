//! Scenes set up for real time: what is refused, and what is noted.

use std::path::Path;
use std::sync::Arc;

use palpa::Note;
use palpa::live::{LiveScene, SpringScene};
use palpa::press::tissue::Indentation;
use palpa::scene::Scene;
use palpa_rt::{StepStatus, Tissue, TissueInput, empty_patch};
use palpa_servo::{ContactPatch, MAX_TOOLS, Pose, Vec3};
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

#[test]
fn the_live_mesh_is_as_fine_as_the_scene_asks() {
    let mesh = |accuracy: &str| {
        let scene = SceneText::block([80.0, 80.0, 40.0], 10.0)
            .layer(Layer::elastic("gel", "10 kPa"))
            .press(4.0)
            .sphere(8.0);
        let scene = if accuracy.is_empty() {
            scene
        } else {
            scene.set("mesh", "accuracy", accuracy)
        };
        let live = LiveScene::build(&parse(&scene)).unwrap();
        let is_too_fine = |note: &&Note| matches!(note, Note::AccuracyTooFine { .. });
        let note = live.notes.iter().find(is_too_fine);
        // Where sizes near the tool are not those that the accuracy asks for, a note says so.
        assert_eq!(
            note.is_some(),
            ["1 %", "2 %"].contains(&accuracy),
            "{note:?}"
        );
        (
            live.mesh_size,
            live.model.n_nodes(),
            note.map(ToString::to_string),
        )
    };
    let usual = mesh("");
    assert_eq!(usual, mesh("3 %"));
    let (fine, coarse) = (mesh("1 %"), mesh("9 %"));
    let (_, _, note) = mesh("2 %");
    let note = note.unwrap();
    let words = "are 4 % smaller for an accuracy of 2 % than by default, not 24 %";
    assert!(note.contains(words), "{note}");
    assert!(fine.0 < 0.7 * usual.0, "{fine:?} {usual:?}");
    assert!(fine.1 > 2 * usual.1, "{fine:?} {usual:?}");
    assert!(coarse.0 > 1.4 * usual.0, "{coarse:?} {usual:?}");
    assert!(coarse.1 < usual.1, "{coarse:?} {usual:?}");
}

/// Tissue whose upper layer is under tension, pressed near an edge, where tension moves the skin.
fn tense() -> SceneText {
    SceneText::soft_over_stiff([60.0, 60.0, 24.0], 8.0, 8.0, 10.0)
        .with_layer(0, |soft| soft.set("prestress", "3 kPa"))
        .sphere(8.0)
        .press(2.0)
        .set("press", "at", Value::lengths([18.0, 0.0, 0.0]))
        .set("press", "step", "0.5 mm")
        .set("press", "retract", false)
        .near_tool(4.0)
        .motion("press", 2.0)
}

/// The input of a step of 5 ms with one tool.
fn input(number: u64, pose: Pose) -> TissueInput {
    TissueInput {
        step: number,
        tick: number,
        sampled_at: 0.0,
        now: 0.0,
        dt: 5e-3,
        period: 5e-3,
        poses: [pose; MAX_TOOLS],
        n_tools: 1,
        aim: None,
    }
}

#[test]
fn a_press_of_tense_skin_has_the_force_of_a_scripted_press() {
    let scene = parse(&tense());
    let live = LiveScene::build(&scene).unwrap();
    // On one mesh.
    let indentation = Indentation::build(Arc::clone(&live.prepared)).unwrap();
    let mut run = indentation.start(0);
    let last = std::iter::from_fn(|| run.advance()).last().unwrap();
    let expected = last.force_n;

    let mut tissue = live.tissue().unwrap();
    let mut patch = empty_patch();
    let mut step = |number: u64, depth: f64| {
        let z = -(scene.motion.above + depth);
        let input = input(number, Pose::translation(0.0, 0.0, z));
        tissue.step(&input, &mut patch);
        if let Some(job) = tissue.take_job() {
            let done = palpa::live::LiveTissue::run(job);
            tissue.install(done);
        }
        tissue.force(0).z
    };
    // Twenty steps just above the skin at rest: nothing touches, so nothing has moved.
    for k in 0..20 {
        assert_eq!(step(k, -0.05e-3), 0.0, "step {k}");
    }
    let mut force = 0.0;
    for k in 0..100 {
        force = step(20 + k, 2e-3 * (k.min(50) as f64) / 50.0);
    }
    println!("{force} N, {expected} N in a scripted press");
    assert!(expected > 0.05, "{expected} N");
    assert!((force / expected - 1.0).abs() < 0.01, "{force} {expected}");
}

/// A block much wider than the fine part of its mesh, mm.
fn wide(size: [f64; 3]) -> Scene {
    let scene = SceneText::soft_over_stiff(size, 8.0, 8.0, 10.0)
        .sphere(8.0)
        .press(3.0)
        .near_tool(4.0)
        .motion("press", 3.0);
    parse(&scene)
}

/// The background never gets a core, so the body holds the tool at the edge of its zone. What the hand feels must go
/// with the hand, and not stay behind.
#[test]
fn the_dent_goes_with_a_tool_that_waits_for_its_zone() {
    let scene = wide([120.0, 60.0, 24.0]);
    let live = LiveScene::build(&scene).unwrap();
    let mut tissue = live.tissue().unwrap();
    let mut patch = empty_patch();
    let down = -(scene.motion.above + 3e-3);
    let mut step = |number: u64, x: f64, z: f64| {
        let input = input(number, Pose::translation(x, 0.0, z));
        let status = tissue.step(&input, &mut patch).status;
        let pressed = patch.contacts[..patch.n_contacts].iter();
        let (force, middle) = pressed.fold((0.0, 0.0), |(force, middle), contact| {
            let size = contact.force.norm();
            (force + size, middle + size * contact.position.x)
        });
        (
            status,
            force,
            middle / force,
            patch.tools[0].pose.translation.x,
        )
    };
    for k in 0..50 {
        step(k, 0.0, down * (k as f64 / 40.0).min(1.0));
    }
    let (_, pressed, _, _) = step(50, 0.0, down);
    let mut held_at = None;
    for k in 1..=58_u32 {
        let x = 0.25e-3 * f64::from(k);
        let (status, force, middle, tool) = step(50 + u64::from(k), x, down);
        // The force is that of the body where it holds the tool.
        let change = force / pressed - 1.0;
        assert!(change.abs() < 0.12, "{x}: {force} {pressed} {status:?}");
        if held_at.is_none() && status == StepStatus::Behind {
            held_at = Some(x);
        }
        let far = held_at.map_or(0.0, |held_at| x - held_at);
        if far < 6e-3 {
            assert!((middle - x).abs() < 1.2e-3, "{x}: {middle}");
            assert!((tool - x).abs() < 0.1e-3, "{x}: {tool}");
        } else if far > 9e-3 {
            // No farther than 8 mm.
            assert!(x - tool > 0.8e-3, "{x}: {tool}");
        }
    }
    assert!(held_at.is_some_and(|x| x < 0.015), "{held_at:?}");
}

/// The force (N) of a patch's local model along its first normal when the tool goes on by `way`, m, without friction.
fn force_further_on(patch: &ContactPatch, way: Vec3) -> f64 {
    let pose = patch.tools[0].pose;
    let contacts = &patch.contacts[..patch.n_contacts];
    let normals: Vec<Vec3> = contacts.iter().map(|c| pose.rotation * c.normal).collect();
    let along = |i: usize, j: usize| normals[i].dot(&(patch.block(i, j) * normals[j]));
    let gaps: Vec<f64> = (contacts.iter().zip(&normals))
        .map(|(contact, normal)| {
            let surface = pose.transform_point(&contact.surface.into()).coords + way;
            normal.dot(&(contact.position - surface))
        })
        .collect();
    let mut forces = vec![0.0; contacts.len()];
    for _ in 0..2000 {
        for i in 0..contacts.len() {
            let moved: f64 = (0..contacts.len()).map(|j| along(i, j) * forces[j]).sum();
            forces[i] = (forces[i] - (gaps[i] + moved) / along(i, i)).max(0.0);
        }
    }
    forces.iter().zip(&normals).map(|(f, n)| f * -n.z).sum()
}

/// Gap between tool and skin when the tissue sees them last before the touch, m.
const GAP: f64 = 0.1e-3;

/// Where the tissue has no core for a while, the hand feels the local model of the time before the first touch, also
/// where the triangles are large because the fine mesh is elsewhere.
#[test]
fn a_first_touch_is_felt_right_before_the_tissue_has_seen_it() {
    let scene = wide([160.0, 80.0, 24.0]);
    let live = LiveScene::build(&scene).unwrap();
    // In the fine part and outside it, with the tool over vertices, edges and faces.
    for (xs, worst) in [([0.0, 1.5e-3, 3e-3], 0.7), ([45e-3, 47.5e-3, 52e-3], 1.0)] {
        let (mut sum, mut n) = (0.0, 0);
        for (x, y) in xs.into_iter().flat_map(|x| [(x, 0.0), (x, 2.3e-3)]) {
            let mut tissue = live.tissue().unwrap();
            let mut patch = empty_patch();
            let mut number = 0;
            let mut step = |height: f64, patch: &mut ContactPatch| {
                number += 1;
                let pose = Pose::translation(x, y, height - scene.motion.above);
                tissue.step(&input(number, pose), patch);
                tissue.force(0).z
            };
            for k in (0..20).rev() {
                step(GAP + 0.05e-3 * f64::from(k), &mut patch);
            }
            let before = patch.clone();
            assert!(
                before.contacts[..before.n_contacts]
                    .iter()
                    .all(|c| c.force == Vec3::zeros())
            );
            for k in 1..=30 {
                let depth = 0.05e-3 * f64::from(k);
                let tissue = step(-depth, &mut patch);
                if k % 10 == 0 {
                    let felt = force_further_on(&before, -Vec3::z() * (GAP + depth));
                    let ratio = felt / tissue;
                    assert!(
                        (ratio - 1.0).abs() < worst,
                        "{x} {y}: {felt} N for {tissue} N at {depth}"
                    );
                    sum += ratio;
                    n += 1;
                }
            }
        }
        let mean = sum / f64::from(n);
        println!("{mean}");
        assert!((mean - 1.0).abs() < 0.2, "{mean}");
    }
}
