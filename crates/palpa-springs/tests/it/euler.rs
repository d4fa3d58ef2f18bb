//! Explicit Euler alone, against the combined method.

use palpa_mesh::Vec3;
use palpa_springs::{
    Corrections, Outcome, Solver, SpringState, StepParams, Workspace, step, steps_to_cross,
};

use crate::{HARD, SOFT, thesis_model};

/// Pulls in 40 steps, holds for 500, and returns the worst outcome.
fn pull(distance: f64, params: &StepParams) -> Outcome {
    let model = thesis_model([SOFT; 3], Solver::Auto);
    let (mut state, mut ws) = (SpringState::new(&model), Workspace::new(&model));
    for i in 0..540 {
        let part = if i < 40 { distance / 40.0 } else { 0.0 };
        let report = step(
            &model,
            &mut state,
            &mut ws,
            Vec3::new(0.0, 0.0, part),
            params,
        );
        assert!(
            state
                .positions
                .iter()
                .all(|p| p.iter().all(|x| x.is_finite()))
        );
        if report.outcome != Outcome::Converged {
            return report.outcome;
        }
    }
    Outcome::Converged
}

#[test]
fn the_load_at_which_euler_diverges_the_combined_method_bears() {
    let model = thesis_model([SOFT; 3], Solver::Auto);
    let euler = StepParams::euler(&model, 0.8);
    assert_eq!(pull(0.04, &euler), Outcome::Converged);
    assert!(matches!(pull(0.12, &euler), Outcome::Diverged { .. }));
    assert_eq!(pull(0.12, &StepParams::default()), Outcome::Converged);
    // A smaller step bears it.
    assert_eq!(
        pull(0.12, &StepParams::euler(&model, 0.4)),
        Outcome::Converged
    );
}

#[test]
fn a_force_crosses_at_once_by_finite_elements_and_slowly_by_euler() {
    let push = Vec3::new(0.0, 0.0, -0.001);
    let combined = StepParams {
        corrections: Corrections::OFF,
        ..StepParams::default()
    };
    for (stiffnesses, at_least) in [([SOFT; 3], 20), ([SOFT, HARD, SOFT], 500)] {
        let model = thesis_model(stiffnesses, Solver::Auto);
        let at_once = steps_to_cross(&model, push, &combined, 0.9, 10).unwrap();
        assert_eq!((at_once.first_steps, at_once.settled_steps), (1, 1));
        let euler = StepParams::euler(&model, 0.9);
        let slowly = steps_to_cross(&model, push, &euler, 0.9, 20_000).unwrap();
        assert!(
            slowly.first_steps > 1 && slowly.settled_steps >= at_least,
            "{slowly:?}"
        );
        // Both come to the same force, but for 1 mm of geometry.
        let difference = (slowly.reaction - at_once.reaction).abs() / at_once.reaction;
        assert!(difference < 0.05, "{difference}");
    }
}
