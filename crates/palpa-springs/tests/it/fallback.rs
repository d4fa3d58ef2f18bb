//! Where finite elements are singular, explicit Euler carries on until they are regular again.

use palpa_mesh::Vec3;
use palpa_mesh::generate::patch::patch;
use palpa_springs::{
    Bar, Constraints, Mode, Network, Outcome, Solver, SpringModel, SpringState, StepParams,
    Workspace, step,
};

/// A flat net: the skin of a 5 × 5 patch, its rim fixed. Every inner node can leave the plane
/// without force.
fn flat_net() -> (Network, Constraints) {
    let skin = patch(5, 5, 0.04, &[0.0, 0.01], &[0]).skin;
    let bars = skin.edges().into_iter().map(|[a, b]| Bar {
        a,
        b,
        stiffness: 1.0,
        length: (skin.points[a as usize] - skin.points[b as usize]).norm(),
    });
    let is_rim = |v: usize| [0, 4].contains(&(v % 5)) || [0, 4].contains(&(v / 5));
    let constraints = Constraints {
        fixed: (0..25).filter(|&v| is_rim(v)).collect(),
        operated: vec![12],
        symmetric: Vec::new(),
    };
    let network = Network {
        bars: bars.collect(),
        column: (0..25).collect(),
        positions: skin.points,
    };
    (network, constraints)
}

#[test]
fn a_flat_net_begins_by_euler_and_goes_over_to_finite_elements_once_it_is_a_dome() {
    for solver in [Solver::Sparse, Solver::Dense, Solver::HistoricalInverse] {
        let (network, constraints) = flat_net();
        let model = SpringModel::from_network(network, &constraints, solver).unwrap();
        let (mut state, mut ws) = (SpringState::new(&model), Workspace::new(&model));
        let down = Vec3::new(0.0, 0.0, -0.004);
        let mut modes = Vec::new();
        for _ in 0..12 {
            let report = step(&model, &mut state, &mut ws, down, &StepParams::default());
            let is_euler = matches!(report.outcome, Outcome::EulerFallback { n_substeps: 1 });
            assert_eq!(state.mode == Mode::Euler, is_euler, "{:?}", report.outcome);
            assert!(report.force.iter().all(|x| x.is_finite()));
            modes.push(state.mode);
        }
        assert_eq!(modes[0], Mode::Euler, "a flat net is a mechanism");
        let change = modes.iter().position(|m| *m == Mode::FiniteElements);
        let change = change.unwrap_or_else(|| panic!("{solver:?}: never regular: {modes:?}"));
        assert!(
            modes[change..].iter().all(|m| *m == Mode::FiniteElements),
            "{solver:?}: {modes:?}"
        );
        assert!(state.force.z > 0.0, "stretched, it pushes back");
    }
}

#[test]
fn a_net_pushed_back_to_flat_enters_the_fallback_again() {
    let (network, constraints) = flat_net();
    let flat = network.positions.clone();
    let model = SpringModel::from_network(network, &constraints, Solver::Auto).unwrap();
    let (mut state, mut ws) = (SpringState::new(&model), Workspace::new(&model));
    for _ in 0..12 {
        step(
            &model,
            &mut state,
            &mut ws,
            Vec3::new(0.0, 0.0, -0.004),
            &StepParams::default(),
        );
    }
    assert_eq!(state.mode, Mode::FiniteElements);
    state.positions.copy_from_slice(&flat);
    let sideways = Vec3::new(0.001, 0.0, 0.0);
    let report = step(
        &model,
        &mut state,
        &mut ws,
        sideways,
        &StepParams::default(),
    );
    assert_eq!(report.outcome, Outcome::EulerFallback { n_substeps: 1 });
}

#[test]
fn a_body_that_nothing_holds_is_singular_and_stays_finite() {
    let (network, constraints) = flat_net();
    let unsupported = Constraints {
        fixed: Vec::new(),
        ..constraints
    };
    let model = SpringModel::from_network(network, &unsupported, Solver::Auto).unwrap();
    let (mut state, mut ws) = (SpringState::new(&model), Workspace::new(&model));
    for _ in 0..50 {
        let push = Vec3::new(0.002, 0.001, -0.003);
        let report = step(&model, &mut state, &mut ws, push, &StepParams::default());
        assert!(
            matches!(report.outcome, Outcome::EulerFallback { .. }),
            "{:?}",
            report.outcome
        );
    }
    assert!(state.positions.iter().all(|p| p.norm() < 10.0));
}
