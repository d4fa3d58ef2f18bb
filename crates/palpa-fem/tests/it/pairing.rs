//! Pairing of triangles: as many as can be, near to rectangles, the same each time.

use palpa_fem::pairing::{Pair, Pairing, pair_triangles, pair_triangles_like, worst_corner};
use palpa_mesh::generate::patch::patch;
use palpa_mesh::generate::{
    GradedBlock, LevelStack, Outline, block_skin, cylinder, forearm, graded_block,
};
use palpa_mesh::refine::{RefineParams, near_points, refine};
use palpa_mesh::{Surface, Vec3};

/// The properties of every pairing: each triangle once, corners in their order.
fn assert_sound(skin: &Surface, pairing: &Pairing) {
    let mut uses = vec![0; skin.triangles.len()];
    for Pair { triangles, corners } in &pairing.pairs {
        let [a, i, j, b] = *corners;
        for (t, corners) in [(triangles[0], [a, i, j]), (triangles[1], [b, j, i])] {
            uses[t as usize] += 1;
            let mut turned = skin.triangles[t as usize];
            while turned[0] != corners[0] {
                turned.rotate_left(1);
            }
            assert_eq!(turned, corners);
        }
    }
    for &t in &pairing.singles {
        uses[t as usize] += 1;
    }
    assert!(uses.iter().all(|&n| n == 1));
}

/// Mean and largest distance of the worst corner of a pair from 90°. Degrees
fn corners(skin: &Surface, pairing: &Pairing) -> (f64, f64) {
    let worst: Vec<f64> = pairing
        .pairs
        .iter()
        .map(|pair| worst_corner(skin, pair).to_degrees())
        .collect();
    (
        worst.iter().sum::<f64>() / worst.len() as f64,
        worst.iter().copied().fold(0.0, f64::max),
    )
}

/// A square of irregular triangles with this spacing, m.
fn irregular(spacing: f64) -> Surface {
    let block = GradedBlock {
        outline: Outline::Square,
        half_width: 50e-3,
        centre: [0.0, 0.0],
        ring_radius: None,
        spacing,
        inner_growth: 0.0,
        growth: 0.0,
        jitter: Some(1),
    };
    let levels = LevelStack {
        depths: vec![0.0, 0.04],
        interval_layer: vec![0],
    };
    graded_block(&block, &levels).skin
}

#[test]
fn cells_of_a_grid_are_paired_over_their_diagonals() {
    let skin = patch(31, 22, 0.01, &[0.0, 0.01], &[0]).skin;
    let pairing = pair_triangles(&skin);
    assert_sound(&skin, &pairing);
    assert!(pairing.singles.is_empty());
    assert_eq!(pairing.pairs.len(), 30 * 21);
    assert!(corners(&skin, &pairing).1 < 1e-9);
}

#[test]
fn limbs_are_paired_to_the_last_triangle() {
    let (tube, _) = cylinder(0.2, 0.04, 0.012, 4e-3);
    let arm = forearm(5e-3, 1.0).0;
    for skin in [tube, arm, block_skin([0.07, 0.05], 4e-3)] {
        let pairing = pair_triangles(&skin);
        assert_sound(&skin, &pairing);
        let (mean, max) = corners(&skin, &pairing);
        println!(
            "{} triangles, {} alone, corners {mean:.1}°, at most {max:.1}°",
            skin.triangles.len(),
            pairing.singles.len()
        );
        assert_eq!(pairing.singles.len(), skin.triangles.len() % 2);
        assert!(mean < 35.0 && max < 60.0);
        assert_eq!(pair_triangles(&skin), pairing, "the same each time");
    }
}

#[test]
fn a_part_of_a_skin_keeps_the_pairs_of_the_whole() {
    let whole = irregular(4e-3);
    let pairing = pair_triangles(&whole);
    // Half of the skin, through some pairs.
    let is_left: Vec<bool> = (0..whole.triangles.len())
        .map(|t| whole.corners(t).iter().map(|p| p.x).sum::<f64>() < 0.0)
        .collect();
    let of_part = whole.triangles.iter().zip(&is_left);
    let part = Surface {
        points: whole.points.clone(),
        triangles: of_part
            .filter(|(_, left)| **left)
            .map(|(t, _)| *t)
            .collect(),
    };
    let corners = |pairs: &[Pair]| -> Vec<[u32; 4]> { pairs.iter().map(|p| p.corners).collect() };
    let all = corners(&pairing.pairs);
    let is_whole = |pair: &&Pair| pair.triangles.iter().all(|&t| is_left[t as usize]);
    let n_whole = pairing.pairs.iter().filter(is_whole).count();
    let n_same = |pairing: &Pairing| {
        let same = corners(&pairing.pairs);
        same.iter().filter(|corners| all.contains(corners)).count()
    };
    let (like, anew) = (pair_triangles_like(&part, &all), pair_triangles(&part));
    for pairing in [&like, &anew] {
        assert_sound(&part, pairing);
        assert_eq!(pairing.singles.len(), part.triangles.len() % 2);
    }
    println!(
        "{n_whole} pairs, {} kept, {} without preference",
        n_same(&like),
        n_same(&anew)
    );
    assert!(n_same(&like) as f64 > 0.9 * n_whole as f64);
    assert!(n_same(&like) > n_same(&anew));
}

#[test]
fn graded_blocks_leave_at_most_the_odd_triangle_alone() {
    let levels = LevelStack {
        depths: vec![0.0, 0.04],
        interval_layer: vec![0],
    };
    for outline in [Outline::Square, Outline::Disc] {
        for spacing in [5e-3, 3.3e-3, 2.5e-3, 1.25e-3] {
            for jitter in [None, Some(1), Some(2), Some(3)] {
                let block = GradedBlock {
                    outline,
                    half_width: 50e-3,
                    centre: [0.0, 0.0],
                    ring_radius: Some(10e-3),
                    spacing,
                    inner_growth: 0.0,
                    growth: 0.45 * spacing / 3.3e-3,
                    jitter,
                };
                let skin = graded_block(&block, &levels).skin;
                let pairing = pair_triangles(&skin);
                assert_sound(&skin, &pairing);
                let (mean, max) = corners(&skin, &pairing);
                println!(
                    "{outline:?} {:.2} mm {jitter:?}: {} triangles, {} alone, corners {mean:.1}°, at most {max:.1}°",
                    spacing * 1e3,
                    skin.triangles.len(),
                    pairing.singles.len()
                );
                assert_eq!(pairing.singles.len(), skin.triangles.len() % 2);
                // A reflex corner only where its triangles would be left alone: round vertices of
                // three triangles.
                let is_reflex = |pair: &&Pair| worst_corner(&skin, pair).to_degrees() >= 90.0;
                let n_reflex = pairing.pairs.iter().filter(is_reflex).count();
                assert!(n_reflex <= skin.triangles.len() / 500, "{n_reflex}");
                assert!(jitter.is_some() || n_reflex == 0);
            }
        }
    }
}

#[test]
fn a_locally_refined_skin_is_paired_too() {
    let body = patch(21, 21, 5e-3, &[0.0, 0.01], &[0]);
    for (place, h) in [
        ([0.05, 0.05], 1e-3),
        ([0.013, 0.071], 0.4e-3),
        ([0.0, 0.1], 2e-3),
    ] {
        let place = [Vec3::new(place[0], place[1], 0.0)];
        let size = near_points(&place, 5e-3, h, 0.3);
        let skin = refine(&body, &RefineParams::default(), size).body.skin;
        let pairing = pair_triangles(&skin);
        assert_sound(&skin, &pairing);
        let (mean, max) = corners(&skin, &pairing);
        println!(
            "{} triangles, {} alone, corners {mean:.1}°, at most {max:.1}°",
            skin.triangles.len(),
            pairing.singles.len()
        );
        assert_eq!(pairing.singles.len(), skin.triangles.len() % 2);
        // The two halves of a green triangle make a quad with one corner of 180°, where nothing
        // better is left.
        assert!(max < 90.0 + 1e-6);
    }
}

#[test]
fn sharp_folds_and_seams_are_not_crossed() {
    for (fold, n_pairs) in [(59.0_f64, 1), (61.0, 0)] {
        let (sin, cos) = fold.to_radians().sin_cos();
        let skin = Surface {
            points: [
                [0.0, 0.0, 0.0],
                [1.0, 0.0, 0.0],
                [0.5, 1.0, 0.0],
                [0.5, -cos, sin],
            ]
            .map(Vec3::from)
            .to_vec(),
            triangles: vec![[0, 1, 2], [1, 0, 3]],
        };
        assert_eq!(pair_triangles(&skin).pairs.len(), n_pairs, "{fold}°");
    }
    // Three triangles on one edge, and two that disagree on the outside.
    let points = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.5, 1.0, 0.0],
        [0.5, -1.0, 0.0],
        [0.5, -1.0, 0.1],
    ];
    let mut skin = Surface {
        points: points.map(Vec3::from).to_vec(),
        triangles: vec![[0, 1, 2], [1, 0, 3], [1, 0, 4]],
    };
    assert_eq!(pair_triangles(&skin).singles, [0, 1, 2]);
    skin.triangles = vec![[0, 1, 2], [0, 1, 3]];
    assert_eq!(pair_triangles(&skin).singles, [0, 1]);
    skin.triangles = vec![[0, 1, 2], [1, 0, 3]];
    assert_eq!(
        pair_triangles(&skin).pairs,
        [Pair {
            triangles: [0, 1],
            corners: [2, 0, 1, 3]
        }]
    );
    assert_eq!(pair_triangles(&Surface::default()), Pairing::default());
}

#[test]
fn a_reflex_pair_is_made_only_where_a_triangle_would_be_left_alone() {
    // An arrowhead: the two triangles share the edge from its notch to its tip.
    let mut skin = Surface {
        points: [
            [0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [-1.0, -0.5, 0.0],
            [1.0, -0.5, 0.0],
        ]
        .map(Vec3::from)
        .to_vec(),
        triangles: vec![[2, 0, 1], [3, 1, 0]],
    };
    let pairing = pair_triangles(&skin);
    assert_eq!(pairing.pairs.len(), 1);
    assert!(worst_corner(&skin, &pairing.pairs[0]) > std::f64::consts::FRAC_PI_2);
    // A third triangle with which one of them makes a convex pair: one is left alone either way.
    skin.points.push(Vec3::new(-1.0, 0.6, 0.0));
    skin.triangles.push([1, 4, 2]);
    let pairing = pair_triangles(&skin);
    assert_eq!(pairing.pairs[0].triangles, [0, 2]);
    assert_eq!(pairing.singles, [1]);
}

#[test]
fn a_skin_of_twenty_thousand_irregular_triangles_leaves_at_most_the_odd_one_alone() {
    let skin = irregular(1e-3);
    assert!(skin.triangles.len() > 20_000);
    let pairing = pair_triangles(&skin);
    assert_sound(&skin, &pairing);
    assert_eq!(pairing.singles.len(), skin.triangles.len() % 2);
}
