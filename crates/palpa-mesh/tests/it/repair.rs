//! Repair gives back what was there before the damage, and leaves alone what it must not guess.

use palpa_mesh::orient::orient;
use palpa_mesh::{RepairOptions, Surface, Vec3, Verdict, check_surface, examine, repair};
use proptest::prelude::*;

use crate::shapes::{icosphere, joined, moebius, moved, tube};

/// Triangles as they are wound, whichever vertex comes first, in one order.
fn wound(surface: &Surface) -> Vec<[u32; 3]> {
    let mut triangles: Vec<[u32; 3]> = surface
        .triangles
        .iter()
        .map(|&t| {
            let first = (0..3).min_by_key(|&k| t[k]).unwrap();
            [0, 1, 2].map(|k| t[(first + k) % 3])
        })
        .collect();
    triangles.sort_unstable();
    triangles
}

#[test]
fn a_clean_surface_stays_as_it_is() {
    for surface in [icosphere(2), tube(16, 8)] {
        let (repaired, report) = repair(&surface, &RepairOptions::default());
        assert_eq!(repaired, surface);
        assert!(!report.is_changed());
    }
}

proptest! {
    #[test]
    fn winding_is_restored_whatever_is_flipped(flips in prop::collection::vec(any::<bool>(), 320), closed: bool) {
        let clean = if closed { icosphere(2) } else { tube(16, 10) };
        let mut damaged = clean.clone();
        for (t, flip) in damaged.triangles.iter_mut().zip(&flips) {
            if *flip {
                t.swap(1, 2);
            }
        }
        let n_flipped = flips.iter().filter(|f| **f).count();
        let report = orient(&mut damaged);
        prop_assert_eq!(wound(&damaged), wound(&clean));
        prop_assert_eq!(report.n_flipped, n_flipped);
    }

    #[test]
    fn repair_is_idempotent_and_never_makes_things_worse(
        triangles in prop::collection::vec(prop::array::uniform3(0_u32..12), 1..40),
        jitter in prop::collection::vec(prop::array::uniform3(-2_i8..=2), 12),
    ) {
        // Small whole coordinates, so that corners coincide and lie on lines often.
        let points = jitter.iter().map(|p| Vec3::from(p.map(f64::from))).collect();
        let (once, _) = repair(&Surface { points, triangles }, &RepairOptions::default());
        let (twice, report) = repair(&once, &RepairOptions::default());
        prop_assert_eq!(report.n_welded, 0);
        prop_assert_eq!(report.n_unused, 0);
        prop_assert!(twice.triangles.len() <= once.triangles.len());
        prop_assert!(once.triangles.iter().flatten().all(|&v| (v as usize) < once.points.len()));
    }
}

#[test]
fn everything_that_is_safe_at_once() {
    let clean = tube(16, 8);
    let mut damaged = clean.clone();
    // Unweld all, with a jitter below the tolerance; turn a fifth; double some; add triangles without area and loose points.
    damaged.points = clean
        .triangles
        .iter()
        .flatten()
        .map(|&v| clean.points[v as usize])
        .collect();
    damaged
        .points
        .iter_mut()
        .enumerate()
        .for_each(|(i, p)| p.x += 1e-9 * (i % 3) as f64);
    damaged.triangles = (0..clean.triangles.len() as u32)
        .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
        .collect();
    damaged
        .triangles
        .iter_mut()
        .step_by(5)
        .for_each(|t| t.swap(0, 1));
    damaged.triangles.extend_from_within(10..20);
    damaged.triangles.push([4, 4, 9]);
    damaged.points.push(Vec3::new(9.0, 9.0, 9.0));

    let examination = examine(&damaged, &RepairOptions::default());
    assert_eq!(examination.verdict, Verdict::Repairable);
    let repaired = examination.repaired.unwrap();
    assert_eq!(repaired.report.verdict, Verdict::Good);
    assert_eq!(repaired.surface.triangles.len(), clean.triangles.len());
    assert_eq!(repaired.surface.points.len(), clean.points.len());
    let report = repaired.repair;
    assert_eq!(
        (report.n_duplicate, report.n_degenerate, report.n_unused),
        (10, 1, 1)
    );
    assert!(
        (repaired.report.parts[0].volume - check_surface(&clean).parts[0].volume).abs() < 1e-10
    );
}

#[test]
fn a_flat_triangle_is_turned_away_without_a_slit() {
    // A pyramid over a square whose side 0–1 has a vertex in its middle, bridged by the flat triangle 0-1-5.
    let points = [
        [0., 0., 0.],
        [2., 0., 0.],
        [2., 2., 0.],
        [0., 2., 0.],
        [1., 1., 1.],
        [1., 0., 0.],
    ];
    let surface = Surface {
        points: points.map(Vec3::from).to_vec(),
        triangles: vec![
            [0, 5, 4],
            [5, 1, 4],
            [1, 2, 4],
            [2, 3, 4],
            [3, 0, 4],
            [0, 1, 5],
            [0, 2, 1],
            [0, 3, 2],
        ],
    };
    let examination = examine(&surface, &RepairOptions::default());
    assert_eq!(examination.verdict, Verdict::Repairable);
    let repaired = examination.repaired.unwrap();
    assert_eq!(repaired.repair.n_degenerate, 1);
    assert_eq!(repaired.report.n_boundary_edges, 0);
    assert!((repaired.report.parts[0].volume - 4.0 / 3.0).abs() < 1e-12);
}

#[test]
fn outward_for_each_part_by_itself() {
    let mut inner = moved(&icosphere(1), [3.0, 0.0, 0.0]);
    inner.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    let surface = joined(&icosphere(1), &inner);
    let (repaired, report) = repair(&surface, &RepairOptions::default());
    assert_eq!(report.orientation.n_inverted_closed, 1);
    assert!(
        check_surface(&repaired)
            .parts
            .iter()
            .all(|part| part.volume > 0.0)
    );
}

#[test]
fn a_flat_sheet_keeps_its_side_and_a_strip_with_one_side_its_winding() {
    let at = |x: f64, y: f64| Vec3::new(x, y, 0.0);
    let mut sheet = Surface {
        points: vec![at(0., 0.), at(1., 0.), at(1., 1.), at(0., 1.)],
        triangles: vec![[0, 2, 1], [0, 3, 2]],
    };
    let before = sheet.clone();
    assert_eq!(orient(&mut sheet).n_undecided, 1);
    assert_eq!(sheet, before);

    let mut strip = moebius(20);
    let before = strip.clone();
    assert_eq!(orient(&mut strip).n_one_sided, 1);
    assert_eq!(strip, before);
}

#[test]
fn holes_and_folds_are_not_touched() {
    let mut holed = tube(24, 10);
    holed.triangles.remove(100);
    let examination = examine(&holed, &RepairOptions::default());
    assert_eq!(examination.verdict, Verdict::Bad);
    assert_eq!(examination.repaired, None);
}

#[test]
fn recentring_moves_the_middle_of_the_box_to_the_origin() {
    let far = moved(&tube(8, 4), [4.5e6, -1.2e6, 3e5]);
    let options = RepairOptions {
        recentre: true,
        ..RepairOptions::default()
    };
    let (near, report) = repair(&far, &options);
    let (lo, hi) = near.bounds().unwrap();
    // As near as coordinates of millions of metres resolve.
    assert!((lo + hi).norm() < 2e-9);
    let back = Vec3::from(report.moved_by.unwrap());
    assert!((far.points[3] + back - near.points[3]).norm() < 1e-9);
}
