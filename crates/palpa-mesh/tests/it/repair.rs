//! Repair gives back what was there before the damage, and leaves alone what it must not guess.

use nalgebra::Rotation3;
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
    fn a_second_repair_has_nothing_to_do(
        triangles in prop::collection::vec(prop::array::uniform3(0_u32..12), 1..40),
        jitter in prop::collection::vec(prop::array::uniform3(-2_i8..=2), 12),
    ) {
        // Small whole coordinates, so that corners coincide and lie on lines often.
        let points = jitter.iter().map(|p| Vec3::from(p.map(f64::from))).collect();
        needs_no_second_repair(&Surface { points, triangles }, &RepairOptions::default());
    }

    #[test]
    fn a_second_repair_has_nothing_to_do_on_awkward_surfaces(
        surface in awkward(),
        weld_tolerance in prop::sample::select(vec![0.0, 1e-9, 1e-6, 0.1]),
        recentre: bool,
    ) {
        needs_no_second_repair(&surface, &RepairOptions { weld_tolerance, recentre });
    }
}

/// Few vertices, many triangles on them: fans, doubles and folds. The vertices are on a small grid
/// or on two lines, shifted by about the tolerance of welding or of flatness, then turned and moved
/// away from the origin, so that nothing is exact.
fn awkward() -> impl Strategy<Value = Surface> {
    let vertex = (
        prop::array::uniform3(-2_i8..=2),
        any::<bool>(),
        prop::array::uniform3(-2_i8..=2),
    );
    let shift = prop::sample::select(vec![0.0, 1e-12, 1e-9, 1e-6, 3e-6, 1e-3]);
    let away = prop::sample::select(vec![0.0, 1e3, 1e9]);
    let size = prop::sample::select(vec![1.0, 1e-3, 1e-90, 1e170]);
    let shape = (any::<bool>(), shift, any::<bool>(), away, size);
    (3..12_u32, prop::collection::vec(vertex, 12), shape).prop_flat_map(
        |(n, vertices, (on_lines, shift, is_turned, away, size))| {
            let turn = Rotation3::from_euler_angles(0.3, 1.1, 2.3);
            let at = move |(p, line, q): &([i8; 3], bool, [i8; 3])| {
                let mut at = Vec3::from(p.map(f64::from));
                if on_lines {
                    let direction = [Vec3::new(1.0, 0.0, 0.0), Vec3::new(1.0, 3.0, 2.0)];
                    at = direction[usize::from(*line)] * (at.x + at.y / 3.0);
                }
                at += Vec3::from(q.map(f64::from)) * shift;
                if is_turned {
                    at = turn * at;
                }
                (at + Vec3::new(away, 0.0, -away)) * size
            };
            let points: Vec<Vec3> = vertices.iter().map(at).collect();
            prop::collection::vec(prop::array::uniform3(0..n), 1..30).prop_map(move |triangles| {
                let points = points.clone();
                Surface { points, triangles }
            })
        },
    )
}

/// Repairs a surface and asserts that repairing it again changes nothing.
#[track_caller]
fn needs_no_second_repair(surface: &Surface, options: &RepairOptions) -> Surface {
    let (once, first) = repair(surface, options);
    let (twice, second) = repair(&once, options);
    let said = format!("{surface:?}\n{options:?}\nfirst {first:?}\nsecond {second:?}");
    assert!(!second.is_changed(), "{said}");
    assert_eq!(twice, once, "{said}");
    assert!(once.triangles.len() <= surface.triangles.len(), "{said}");
    assert!(
        once.triangles
            .iter()
            .flatten()
            .all(|&v| (v as usize) < once.points.len()),
        "{said}"
    );
    once
}

/// Corners on one line, two triangles on them that are each other's double. Each used to be kept
/// for the other's sake, and the one that was left after dropping doubles fell to the second
/// repair.
#[test]
fn a_flat_triangle_and_its_double_both_go() {
    let mut points = vec![Vec3::zeros(); 12];
    points[1] = Vec3::new(-1.0, 0.0, 1.0);
    points[4] = Vec3::new(0.0, 1.0, 2.0);
    points[6] = Vec3::new(-2.0, -1.0, 0.0);
    let triangles = vec![[1, 4, 6], [6, 4, 1]];
    let surface = Surface { points, triangles };
    let repaired = needs_no_second_repair(&surface, &RepairOptions::default());
    assert_eq!(repaired, Surface::default());
}

/// Turning the longest side of the flat triangle a–m–b makes the flat triangle far–a–m, whose
/// longest side turned makes the first one again.
#[test]
fn flat_triangles_are_not_turned_to_and_fro() {
    let points = [
        [0.0, 0.0, 0.0],
        [4e-6, 4e-10, 0.0],
        [1.0, 1e-4, 0.0],
        [-1.0, 0.0, 0.0],
    ];
    let surface = Surface {
        points: points.map(Vec3::from).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let repaired = needs_no_second_repair(&surface, &RepairOptions::default());
    assert_eq!(repaired, surface);
}

/// The side of a closed part without volume is rounding error, which may differ when the part is
/// turned.
#[test]
fn a_closed_part_without_volume_is_turned_once_at_most() {
    let square = [[0., 0., 0.], [3., 0., 0.], [3., 1., 0.], [0., 1., 0.]];
    for k in 0..200 {
        let k = f64::from(k);
        let turn = Rotation3::from_euler_angles(0.1 * k, 0.3 * k, 0.7 * k);
        let surface = Surface {
            points: square.map(|p| turn * Vec3::from(p)).to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]],
        };
        let repaired = needs_no_second_repair(&surface, &RepairOptions::default());
        assert_eq!(repaired.triangles.len(), 4);
    }
}

/// An unused vertex just outside used to take the place of a used one near it. That widened the
/// bounding box, and with it the tolerance, so that the second repair welded the last two.
#[test]
fn unused_vertices_do_not_widen_the_tolerance() {
    let points = [
        [-1.7e-6, 0.0, 0.0],
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.5, 0.5, 0.5],
        [0.5 + 1.7320512e-6, 0.5, 0.5],
    ];
    let surface = Surface {
        points: points.map(Vec3::from).to_vec(),
        triangles: vec![[1, 3, 2], [1, 2, 4], [1, 4, 3], [2, 3, 4], [5, 6, 3]],
    };
    let repaired = needs_no_second_repair(&surface, &RepairOptions::default());
    assert_eq!(repaired.points, surface.points[1..]);
}

#[test]
fn a_huge_surface_is_not_welded_to_one_point() {
    let huge = icosphere(1).scaled(1e170);
    let repaired = needs_no_second_repair(&huge, &RepairOptions::default());
    assert_eq!(repaired.points, huge.points);
}

/// So far out the first move is rounded by more than the second would move.
#[test]
fn what_is_far_is_recentred_once() {
    for far in [0.0, 1.0, 4.5e6, 1e12] {
        let surface = moved(&icosphere(2), [far, -far, 0.3 * far]);
        let options = RepairOptions {
            recentre: true,
            ..RepairOptions::default()
        };
        let repaired = needs_no_second_repair(&surface, &options);
        let (lo, hi) = repaired.bounds().unwrap();
        assert!((lo + hi).norm() < 1e-8);
    }
}

#[test]
fn everything_that_is_safe_at_once() {
    let clean = tube(16, 8);
    let mut damaged = clean.clone();
    // Unweld all, with a jitter below the tolerance; turn a fifth; double some; add triangles
    // without area and loose points.
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
    // A pyramid over a square whose side 0–1 has a vertex in its middle, bridged by the flat
    // triangle 0-1-5.
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
