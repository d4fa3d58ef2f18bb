//! Graded blocks and mapped grids: exact outlines and rings, good shapes, conforming.

use std::f64::consts::{FRAC_PI_2, PI};

use palpa_mesh::generate::{
    Diagonal, GradedBlock, GradedLayer, Grid, LevelStack, Outline, graded_block, mapped_grid,
};
use palpa_mesh::{LayeredBody, Vec3};

use crate::sound::{assert_conforming, assert_sound, smallest_angle, volume};

fn levels() -> LevelStack {
    let layer = |thickness, first_height, growth| GradedLayer {
        thickness,
        first_height,
        growth,
    };
    LevelStack::graded(&[
        layer(2e-3, 2e-3, 0.0),
        layer(10e-3, 2e-3, 0.2),
        layer(28e-3, 5e-3, 0.5),
    ])
}

fn block(outline: Outline, spacing: f64, jitter: Option<u64>) -> GradedBlock {
    GradedBlock {
        outline,
        half_width: 50e-3,
        centre: [0.1, -0.2],
        ring_radius: Some(10e-3),
        spacing,
        inner_growth: 0.0,
        growth: 0.45 * spacing / 3.3e-3,
        jitter,
    }
}

#[test]
fn graded_blocks_have_their_volume_their_ring_and_good_triangles() {
    for outline in [Outline::Square, Outline::Disc] {
        for spacing in [5e-3, 3.3e-3, 2.5e-3, 1.25e-3] {
            for jitter in [None, Some(1), Some(2)] {
                let block = block(outline, spacing, jitter);
                let body = graded_block(&block, &levels());
                assert_sound(&body);
                let area = match outline {
                    Outline::Square => 0.1 * 0.1,
                    Outline::Disc => PI * 0.05 * 0.05,
                };
                assert!((volume(&body) / (area * 0.04) - 1.0).abs() < 1e-12);
                let angle = smallest_angle(&body.skin);
                println!(
                    "{outline:?} h {:.2} mm {jitter:?}: {} vertices, smallest angle {angle:.1}°",
                    spacing * 1e3,
                    body.n_vertices()
                );
                assert!(
                    angle > if jitter.is_none() { 20.0 } else { 12.0 },
                    "{angle}"
                );
                assert_ring(&block, &body);
            }
        }
    }
}

/// The triangles within the ring have the area of its circle: no edge crosses it.
fn assert_ring(block: &GradedBlock, body: &LayeredBody) {
    let patch = block.patch_vertices(body);
    let is_in = |v: &u32| patch.binary_search(v).is_ok();
    let area: f64 = (0..body.skin.triangles.len())
        .filter(|&t| body.skin.triangles[t].iter().all(is_in))
        .map(|t| body.skin.area_vector(t).norm())
        .sum();
    assert!((area / (PI * 0.01 * 0.01) - 1.0).abs() < 1e-12, "{area}");
    let m = (0.01 / block.spacing).round() as usize;
    assert_eq!(patch.len(), 1 + 3 * m * (m + 1));
}

#[test]
fn halving_a_block_halves_its_edges_everywhere() {
    let coarse = GradedBlock {
        ring_radius: None,
        ..block(Outline::Square, 4e-3, None)
    };
    let [coarse, fine] = [coarse, coarse.halved()].map(|b| graded_block(&b, &levels()));
    let ratio = fine.n_vertices() as f64 / coarse.n_vertices() as f64;
    assert!((3.0..4.6).contains(&ratio), "{ratio}");
    let longest = |body: &LayeredBody| {
        let edges = body.skin.edges().into_iter();
        let length =
            |[a, b]: [u32; 2]| (body.skin.points[a as usize] - body.skin.points[b as usize]).norm();
        edges.map(length).fold(0.0, f64::max)
    };
    let ratio = longest(&coarse) / longest(&fine);
    assert!((1.6..2.5).contains(&ratio), "{ratio}");
    let middle = coarse.skin.points[0];
    assert_eq!(middle, Vec3::new(0.1, -0.2, 0.0));
}

#[test]
#[should_panic(expected = "the ring leaves no room")]
fn a_ring_wider_than_the_block_is_refused() {
    graded_block(
        &GradedBlock {
            half_width: 9e-3,
            ..block(Outline::Disc, 2e-3, None)
        },
        &levels(),
    );
}

#[test]
fn mapped_grids_are_sound_whichever_way_they_are_cut() {
    // Cook's trapezoid: 48 wide, 44 high on the left, from 44 to 60 on the right.
    let cook = |u: f64, v: f64| Vec3::new(48.0 * u, 44.0 * u + v * (44.0 - 28.0 * u), 0.0);
    let ring = |u: f64, v: f64| {
        let (sin, cos) = (FRAC_PI_2 * v).sin_cos();
        Vec3::new((1.0 + u) * cos, (1.0 + u) * sin, 0.0)
    };
    let one = LevelStack {
        depths: vec![0.0, 1.0],
        interval_layer: vec![0],
    };
    let all = [
        Diagonal::Right,
        Diagonal::Left,
        Diagonal::Alternate,
        Diagonal::Random(3),
    ];
    for diagonal in all {
        for jitter in [None, Some(5)] {
            let grid = Grid {
                n_cells: [8, 6],
                diagonal,
                jitter,
            };
            let body = mapped_grid(&grid, cook, &one);
            assert_sound(&body);
            assert!((volume(&body) - 48.0 * 0.5 * (44.0 + 16.0)).abs() < 1e-9);
            assert!(body.cut_faces.iter().all(|f| f.is_flat));
            let body = mapped_grid(&grid, ring, &one.halved());
            assert_sound(&body);
            let is_flat: Vec<bool> = body.cut_faces.iter().map(|f| f.is_flat).collect();
            assert_eq!(is_flat, [false, false, true, true]);
            assert!(
                (body.cut_faces[0].normal + Vec3::new(1.0, 1.0, 0.0).normalize()).norm() < 1e-12
            );
            // A polygon of six sides for each of the arcs.
            let angle = PI / 12.0;
            assert!((volume(&body) / (0.5 * 3.0 * 6.0 * angle.sin()) - 1.0).abs() < 1e-12);
        }
    }
    let cut = |diagonal| {
        let grid = Grid {
            n_cells: [2, 1],
            diagonal,
            jitter: None,
        };
        let body = mapped_grid(&grid, |u, v| Vec3::new(u, v, 0.0), &one);
        assert_conforming(&body.skin);
        body.skin.triangles
    };
    assert_eq!(cut(Diagonal::Right)[0], [0, 1, 4]);
    assert_eq!(cut(Diagonal::Left)[0], [0, 1, 3]);
    assert_eq!(
        cut(Diagonal::Alternate)[..3],
        [[0, 1, 4], [0, 4, 3], [1, 2, 4]]
    );
}
