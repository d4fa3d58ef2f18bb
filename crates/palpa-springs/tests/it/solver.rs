//! Sparse against dense against the inverse of 2009; memory; work.

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use palpa_mesh::Vec3;
use palpa_mesh::generate::patch::centre_vertex;
use palpa_springs::{
    Constraints, Solver, SpringModel, SpringParams, SpringState, StepParams, Workspace, step,
};

use crate::{HARD, SOFT, pushed, springs, thesis_body, thesis_model};

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

#[test]
fn the_three_solvers_agree_to_1e_9() {
    let push = Vec3::new(0.01, -0.004, -0.05);
    let params = StepParams {
        substeps: 3,
        ..StepParams::default()
    };
    let [sparse, dense, inverse] = [Solver::Sparse, Solver::Dense, Solver::HistoricalInverse]
        .map(|solver| pushed(&thesis_model([SOFT, HARD, SOFT], solver), push, 10, &params).0);
    for (name, other) in [("dense", dense), ("inverse", inverse)] {
        let force = (sparse.force - other.force).norm() / sparse.force.norm();
        assert!(force < 1e-9, "{name}: forces differ by {force:e}");
        for (p, q) in sparse.positions.iter().zip(&other.positions) {
            assert!(
                (p - q).norm() < 1e-9 * push.norm(),
                "{name}: {p:?} and {q:?}"
            );
        }
    }
}

#[test]
fn solvers_agree_under_slanted_planes_of_symmetry() {
    let body = thesis_body(4, 3);
    let mut constraints = Constraints::hold(&body, [body.node(5, 0), body.node(6, 0)]);
    for v in 0..4 {
        for l in 0..2 {
            constraints
                .symmetric
                .push((body.node(v, l), Vec3::new(0.2, 1.0, 0.1)));
        }
    }
    constraints
        .symmetric
        .push((body.node(0, 0), Vec3::new(1.0, 0.0, 0.3)));
    let push = Vec3::new(0.003, 0.0, -0.01);
    let states = [Solver::Sparse, Solver::Dense, Solver::HistoricalInverse].map(|solver| {
        let params = SpringParams {
            solver,
            ..springs(&[SOFT, HARD])
        };
        let model = SpringModel::build(&body, &params, &constraints).unwrap();
        let (state, report) = pushed(&model, push, 4, &StepParams::default());
        assert!(report.free_residual < 1e-12);
        for &(node, normal) in &constraints.symmetric {
            let moved = (state.positions[node] - body.positions[node]).dot(&normal.normalize());
            assert!(
                moved.abs() < 1e-15,
                "node {node} leaves its plane by {moved:e}"
            );
        }
        state
    });
    for other in &states[1..] {
        assert!((states[0].force - other.force).norm() < 1e-9 * other.force.norm());
    }
}

#[test]
fn steps_do_not_allocate_after_the_first() {
    for solver in [Solver::Sparse, Solver::Dense, Solver::HistoricalInverse] {
        let model = thesis_model([SOFT, HARD, SOFT], solver);
        let (mut state, mut ws) = (SpringState::new(&model), Workspace::new(&model));
        let params = StepParams::default();
        let down = Vec3::new(0.0, 0.0, -0.001);
        step(&model, &mut state, &mut ws, down, &params);
        assert_no_alloc(|| {
            for _ in 0..20 {
                step(&model, &mut state, &mut ws, down, &params);
            }
        });
        assert!(state.force.z > 0.0);
    }
}

/// The work of the solver in use against that of the inverse of 2009. `palpa bench` measures the
/// times.
#[test]
fn the_solver_in_use_multiplies_fewer_numbers_the_larger_the_body() {
    let share = |n: usize| {
        let body = thesis_body(n, 4);
        let held = Constraints::hold(&body, [body.node(centre_vertex(n, n), 0)]);
        let [auto, inverse] = [Solver::Auto, Solver::HistoricalInverse].map(|solver| {
            let params = SpringParams {
                solver,
                ..springs(&[SOFT; 3])
            };
            SpringModel::build(&body, &params, &held).unwrap()
        });
        assert_eq!(auto.solver(), Solver::Sparse);
        auto.n_factor_entries() as f64 / inverse.n_factor_entries() as f64
    };
    let shares = [4, 8, 15].map(share);
    assert!(shares[0] < 1.0, "{shares:?}");
    assert!(shares[1] < 0.6 * shares[0], "{shares:?}");
    assert!(shares[2] < 0.6 * shares[1], "{shares:?}");
}
