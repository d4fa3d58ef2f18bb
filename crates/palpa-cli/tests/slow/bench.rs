//! The forces by which `palpa bench` judges its errors, computed again. The deeper ones take several
//! times as long, and are computed by `palpa bench --refined`.

use palpa_lab::bench::refined::Problem;

/// As deep as forces are computed, m.
const DEEPEST: f64 = 3e-3;

#[test]
fn the_recorded_forces_on_layers_are_those_of_the_refined_mesh() {
    recorded_forces_are_those_of(Problem::Layers);
}

#[test]
fn the_recorded_forces_on_one_tissue_are_those_of_the_refined_mesh() {
    recorded_forces_are_those_of(Problem::OneTissue);
}

fn recorded_forces_are_those_of(problem: Problem) {
    let (forces, nodes) = problem.compute(DEEPEST).unwrap();
    assert_eq!(forces.len(), 2, "{problem:?}");
    for known in forces {
        let recorded = problem.force_at(known.depth).unwrap();
        let error = known.force.z / recorded - 1.0;
        assert!(
            error.abs() < 1e-4,
            "{problem:?}, {nodes} nodes, {}: {error:e}",
            known.depth
        );
    }
}
