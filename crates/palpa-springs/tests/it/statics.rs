//! Equilibrium, closed forms, and what is to be expected of a step.

use palpa_mesh::Vec3;
use palpa_springs::{
    Bar, Constraints, Corrections, Network, Outcome, Solver, SpringModel, SpringState, StepParams,
    Workspace, step,
};

use crate::{HARD, SOFT, assert_converged, pushed, thesis_model};

const NO_CORRECTION: StepParams = StepParams {
    substeps: 1,
    method: palpa_springs::Method::FiniteElements,
    corrections: Corrections::OFF,
    literal_duration_ms: None,
};

#[test]
fn free_nodes_carry_no_residual_and_action_equals_reaction() {
    let model = thesis_model([SOFT, HARD, SOFT], Solver::Auto);
    let (mut state, mut ws) = (SpringState::new(&model), Workspace::new(&model));
    let push = Vec3::new(0.001, 0.0005, -0.002);
    for _ in 0..20 {
        let report = step(&model, &mut state, &mut ws, push, &NO_CORRECTION);
        assert_converged(&report);
        assert!(
            report.free_residual < 1e-12,
            "residual {:e}",
            report.free_residual
        );
        let sum = state.fixed_reaction(&model) - state.force;
        assert!(
            sum.norm() < 1e-12 * state.force.norm(),
            "unbalanced by {sum:?}"
        );
    }
    // With the corrections, too, all nodal forces add up to zero.
    let (state, _) = pushed(&model, push * 20.0, 20, &StepParams::default());
    let sum: Vec3 = state.node_forces.iter().sum();
    assert!(sum.norm() < 1e-12 * state.force.norm());
}

/// A column of bars in series, sideways held by planes of symmetry as a lone column cannot stand.
fn column(stiffnesses: &[f64]) -> SpringModel {
    let n = stiffnesses.len();
    let network = Network {
        positions: (0..=n)
            .map(|l| Vec3::new(0.1, 0.2, -0.01 * l as f64))
            .collect(),
        bars: (0..n)
            .map(|l| Bar {
                a: l as u32,
                b: l as u32 + 1,
                stiffness: stiffnesses[l],
                length: 0.01,
            })
            .collect(),
        column: vec![0; n + 1],
    };
    let inner = 1..n;
    let constraints = Constraints {
        fixed: vec![n],
        operated: vec![0],
        symmetric: inner
            .flat_map(|l| [(l, Vec3::x()), (l, Vec3::y())])
            .collect(),
    };
    SpringModel::from_network(network, &constraints, Solver::Auto).expect("a model")
}

#[test]
fn a_pressed_column_is_springs_in_series() {
    let push = Vec3::new(0.0, 0.0, -0.004);
    for stiffnesses in [
        &[3.0; 4][..],
        &[1.0, 90.0, 1.0],
        &[5.0, 0.2, 700.0, 31.0, 8.0],
    ] {
        let (state, report) = pushed(&column(stiffnesses), push, 5, &NO_CORRECTION);
        assert_converged(&report);
        let compliance: f64 = stiffnesses.iter().map(|k| 1.0 / k).sum();
        let expected = 0.004 / compliance;
        assert!((state.force.z - expected).abs() < 1e-12 * expected);
        assert!((report.bar_force.z - expected).abs() < 1e-12 * expected);
        // Every bar carries the same force.
        let mut depth = 0.0;
        for (l, k) in stiffnesses.iter().enumerate() {
            depth += expected / k;
            let sunk = -0.01 * (l + 1) as f64 - state.positions[l + 1].z;
            assert!((sunk - (0.004 - depth)).abs() < 1e-14);
        }
    }
}

#[test]
fn error_falls_in_proportion_to_the_number_of_parts() {
    let model = thesis_model([SOFT; 3], Solver::Auto);
    let push = Vec3::new(0.0, 0.0, -0.04);
    let force = |substeps| {
        let params = StepParams {
            substeps,
            ..NO_CORRECTION
        };
        pushed(&model, push, 1, &params).0.force
    };
    let limit = force(1024);
    let errors = [1, 4, 16, 64].map(|n| (force(n) - limit).norm() / limit.norm());
    for pair in errors.windows(2) {
        let ratio = pair[0] / pair[1];
        assert!((3.0..6.0).contains(&ratio), "first order: {errors:?}");
    }
    assert!(errors[2] < 0.015, "{errors:?}");
}

#[test]
fn the_force_pushes_back_and_comes_back_to_nothing() {
    let model = thesis_model([SOFT; 3], Solver::Auto);
    let (mut state, mut ws) = (SpringState::new(&model), Workspace::new(&model));
    let down = Vec3::new(0.0, 0.0, -0.0001);
    for _ in 0..50 {
        step(&model, &mut state, &mut ws, down, &NO_CORRECTION);
    }
    let pressed = state.force.z;
    assert!(pressed > 0.0);
    for _ in 0..50 {
        step(&model, &mut state, &mut ws, -down, &NO_CORRECTION);
    }
    // The path there and back differ by the first-order error of the steps.
    assert!(
        state.force.norm() < 0.01 * pressed,
        "{:?} of {pressed}",
        state.force
    );
}

#[test]
fn the_literal_force_is_what_the_nearest_bars_would_give_alone() {
    let model = thesis_model([SOFT; 3], Solver::Auto);
    let params = StepParams {
        literal_duration_ms: Some(2.0),
        ..NO_CORRECTION
    };
    let push = Vec3::new(0.0, 0.0, -0.001);
    let (_, report) = pushed(&model, push, 1, &params);
    let held = model.operated()[0];
    let rest = model.rest_positions();
    let mut stiffness = 0.0;
    for bar in model.bars() {
        if bar.a as usize == held || bar.b as usize == held {
            let c = (rest[bar.b as usize] - rest[bar.a as usize]).normalize();
            stiffness += bar.stiffness * c.z * c.z;
        }
    }
    let literal = report.literal_force.unwrap();
    assert!((literal.z - stiffness * 0.001 / 2.0).abs() < 1e-12 * literal.z);
    assert!(
        literal.z * 2.0 > report.force.z,
        "before the nodes moved it is stiffer"
    );
}

#[test]
fn bad_displacements_leave_the_state_as_it_was() {
    let model = thesis_model([SOFT; 3], Solver::Auto);
    let (mut state, mut ws) = (SpringState::new(&model), Workspace::new(&model));
    step(
        &model,
        &mut state,
        &mut ws,
        Vec3::new(0.0, 0.0, -0.01),
        &StepParams::default(),
    );
    let before = state.clone();
    for (push, is_finite) in [
        (Vec3::new(f64::NAN, 0.0, 0.0), false),
        (Vec3::new(0.0, f64::INFINITY, 0.0), false),
        (Vec3::new(0.0, 0.0, -1.0e6), true),
    ] {
        let report = step(&model, &mut state, &mut ws, push, &StepParams::default());
        match report.outcome {
            Outcome::NotFinite => assert!(!is_finite),
            Outcome::Diverged { .. } => assert!(is_finite),
            other => panic!("{other:?}"),
        }
        assert_eq!(state, before);
        assert_eq!(report.force, before.force);
    }
}

#[test]
fn the_pull_to_the_initial_shape_brings_a_released_body_back() {
    let model = thesis_model([SOFT; 3], Solver::Auto);
    let away = |corrections| {
        let params = StepParams {
            corrections,
            ..NO_CORRECTION
        };
        let (mut state, mut ws) = (SpringState::new(&model), Workspace::new(&model));
        for push in [-0.02, 0.02] {
            step(
                &model,
                &mut state,
                &mut ws,
                Vec3::new(0.0, 0.0, push),
                &params,
            );
        }
        for _ in 0..300 {
            step(&model, &mut state, &mut ws, Vec3::zeros(), &params);
        }
        let displacements = state.displacements(&model);
        displacements.iter().map(Vec3::norm).fold(0.0, f64::max)
    };
    let drifted = away(Corrections::OFF);
    assert!(drifted > 1e-4, "two large steps do not cancel: {drifted:e}");
    let springs = Corrections::default();
    let shape = Corrections {
        shape_gain: 1.0,
        ..springs
    };
    assert!(away(springs) < 0.5 * drifted);
    assert!(away(shape) < 1e-3 * drifted);
}
