//! A hand that strokes fast over a forearm while the background is slow, as on a small machine beside a browser:
//! meshes and zones come late, and the force is not let go.

use palpa::live::{LiveScene, RehearsalParams, open_device, rehearse, servo_params};
use palpa_device::LiveTarget;
use palpa_rt::StepStatus;
use palpa_scene::BuiltIn;

use crate::strokes::{STEP_TIME, Skin, strokes};

/// Steps that a job takes: 0.16 s.
const JOB_STEPS: u32 = 40;
/// Speed of the strokes, m/s.
const SPEED: f64 = 0.06;
/// Largest share of the steps that hold the last good state; 0.015 was measured.
const MOST_HELD: f64 = 0.02;

#[test]
fn strokes_with_slow_jobs_take_up_every_mesh_and_never_let_go() {
    let scene = BuiltIn::find("forearm_lump").unwrap().scene().unwrap();
    let live = LiveScene::build(&scene).unwrap();
    let tips = Skin::of(&live).tips(&live, &strokes(SPEED));
    let target = LiveTarget::new(tips[0]);
    let mut device = open_device(&scene.device, target.clone()).unwrap();
    let params = RehearsalParams {
        step_time: STEP_TIME,
        job_steps: JOB_STEPS,
        duration: tips.len() as f64 * STEP_TIME,
        servo: servo_params(&*device),
    };
    let mut tissue = live.tissue_at(tips[0]).unwrap();
    let (mut n_steps, mut n_held, mut n_failed) = (0, 0, 0);
    rehearse(&mut tissue, &mut *device, &params, |_, _, done| {
        target.set(tips[n_steps.min(tips.len() - 1)]);
        n_steps += 1;
        n_held += usize::from(done.kept_from.is_some());
        n_failed += usize::from(done.status == StepStatus::Failed);
    });
    let [n_meshes, n_refused] = tissue.n_meshes();
    println!(
        "{n_meshes} meshes, {n_refused} refused; {n_held} of {n_steps} steps held, {n_failed} failed"
    );
    assert!(n_steps > 1_500 && n_meshes > 5, "{n_steps} {n_meshes}");
    assert_eq!((n_refused, n_failed), (0, 0));
    assert!((n_held as f64) < MOST_HELD * n_steps as f64, "{n_held}");
}
