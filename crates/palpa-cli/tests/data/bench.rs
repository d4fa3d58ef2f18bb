//! The forces by which `palpa bench` judges its errors, against other codes.

use palpa_lab::bench::refined::Problem;

/// Largest relative difference of the recorded forces from tables made on a block or on a cylinder
/// of its width.
const TOLERANCE: f64 = 0.012;

#[test]
fn the_recorded_forces_of_one_tissue_are_those_of_other_codes() {
    let path = crate::reference().join("B4_sphere_frictionless_homogeneous.csv");
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
