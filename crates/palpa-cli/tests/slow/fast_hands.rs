//! Hands that stroke over thin soft fat, where a step of the tissue often fails, and over a lump: the force is
//! not let go, and has no jolts.

use palpa_lab::bench::shipped::{Part, ShippedCase, StepTime, draw_spots, drive, shipped_cases};

use crate::resolved;

const N_PLACES: usize = 8;
/// Time of steps and jobs, s: about that of the machine that the documented figures come from.
const TIME: StepTime = StepTime::Counted {
    factor: 12e-3,
    iteration: 1.5e-3,
    job: 45e-3,
};
/// Largest share of the steps that fail, and of the ticks without the whole force.
const MOST_FAILED: f64 = 2e-3;
const MOST_LET_GO: f64 = 0.02;

/// A case of the bench, by its name.
fn shipped(name: &str) -> ShippedCase {
    let lump_forearm = resolved(&include_str!(
        "../../../palpa-scene/scenes/forearm_loop.toml"
    ));
    let cases = shipped_cases(&lump_forearm, None).unwrap();
    cases.into_iter().find(|case| case.name == name).unwrap()
}

#[test]
fn strokes_over_thin_fat_keep_their_force() {
    let case = shipped("shipped-forearm");
    let spots = draw_spots(&case, N_PLACES, || true).unwrap();
    assert_eq!(spots.len(), N_PLACES);
    let (mut n_steps, mut n_failed, mut n_ticks, mut n_let_go) = (0, 0, 0, 0);
    for (spot, live) in &spots {
        let driven = drive(&spot.scene(&case.scene), live, TIME).unwrap();
        n_steps += driven.times.len();
        n_failed += driven.n_failed;
        let across = driven.felt.iter().filter(|felt| felt.part == Part::Stroke);
        n_ticks += across.clone().count();
        n_let_go += across.filter(|felt| !felt.is_whole).count();
    }
    println!("{n_failed} of {n_steps} steps failed, force let go in {n_let_go} of {n_ticks} ticks");
    assert!(n_steps > 10_000 && n_ticks > 5_000, "{n_steps} {n_ticks}");
    let share = |n: usize, of: usize| n as f64 / of as f64;
    assert!(share(n_failed, n_steps) <= MOST_FAILED, "{n_failed}");
    assert!(share(n_let_go, n_ticks) <= MOST_LET_GO, "{n_let_go}");
}

/// Largest change of the force from one tick to the next, as a share.
const MOST_CHANGE: f64 = 0.05;

/// The largest change of the force from one tick to the next in a stroke at a place of a case, as a share, where
/// steps take no time.
fn largest_jolt(name: &str, place: usize) -> f64 {
    let case = shipped(name);
    let (spot, live) = draw_spots(&case, place + 1, || true)
        .unwrap()
        .pop()
        .unwrap();
    let driven = drive(&spot.scene(&case.scene), &live, StepTime::Zero).unwrap();
    let across = driven.felt.iter().filter(|felt| felt.part == Part::Stroke);
    let pressed = across.filter(|felt| felt.depth > 2e-3);
    let forces: Vec<f64> = pressed.map(|felt| felt.force.norm()).collect();
    assert!(forces.len() > 2_000, "{}", forces.len());
    let changes = forces
        .windows(2)
        .map(|pair| (pair[1] / pair[0] - 1.0).abs());
    changes.fold(0.0, f64::max)
}

/// A vertex left the contact there with a force of 1e-11 N that pointed aside.
#[test]
fn a_stroke_has_no_jolt_where_a_vertex_leaves_the_contact() {
    let most = largest_jolt("shipped-lump", 4);
    assert!(most < MOST_CHANGE, "{most}");
}

/// The stiffness of a step was raised there, and the local model was five times too stiff for one tick.
#[test]
fn a_stroke_has_no_jolt_where_thin_fat_is_nearly_unstable() {
    let most = largest_jolt("shipped-forearm", 5);
    assert!(most < MOST_CHANGE, "{most}");
}
