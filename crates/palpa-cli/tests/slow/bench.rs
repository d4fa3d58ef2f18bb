//! The forces by which `palpa bench` judges its errors, computed again.

use palpa_lab::bench::refined::Problem;

#[test]
fn the_recorded_forces_are_those_of_the_refined_meshes() {
    for problem in [Problem::Layers, Problem::OneTissue] {
        let (forces, nodes) = problem.compute().unwrap();
        assert!(!forces.is_empty());
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
}
