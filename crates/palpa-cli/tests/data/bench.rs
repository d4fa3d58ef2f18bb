//! What rates are judged by, against other codes.

use palpa_lab::bench::refined::Problem;

/// Force that the recorded forces may differ by, as a share, from tables made on a block or on a cylinder of its width.
const TOLERANCE: f64 = 0.012;

#[test]
fn the_recorded_forces_of_one_tissue_are_those_of_other_codes() {
    let Some(reference) = crate::data().map(|data| data.join("../reference")) else {
        return;
    };
    let path = reference.join("B4_sphere_frictionless_homogeneous.csv");
    let table = std::fs::read_to_string(&path).unwrap();
    let mut compared = 0;
    for line in table.lines().skip(1) {
        let mut cells = line.split(',');
        let depth: f64 = cells.next().unwrap().parse().unwrap();
        let known = cells.next().unwrap().parse::<f64>();
        let (Some(force), Ok(known)) = (Problem::OneTissue.force_at(depth), known) else {
            continue;
        };
        assert!(
            (force / known - 1.0).abs() < TOLERANCE,
            "{depth}: {force} N, not {known} N"
        );
        compared += 1;
    }
    assert_eq!(compared, 5);
}

#[test]
fn slow_the_recorded_forces_are_those_of_the_refined_meshes() {
    if crate::data().is_none() {
        return;
    }
    for problem in [Problem::Layers, Problem::OneTissue] {
        let (forces, nodes) = problem.compute().unwrap();
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
