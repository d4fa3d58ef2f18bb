//! Refinement: the same geometry, conforming, angles kept, fields carried.

use std::cell::Cell;
use std::f64::consts::PI;

use palpa_mesh::generate::patch::{centre_vertex, patch};
use palpa_mesh::generate::{GradedBlock, LevelStack, Outline, cylinder, forearm, graded_block};
use palpa_mesh::growth::Thickness;
use palpa_mesh::quality::prism_volume;
use palpa_mesh::refine::{
    RefineParams, Refined, along, mean_depths, near_depth, near_points, parts_for, refine,
    split_levels,
};
use palpa_mesh::{GrowthParams, LayerSpec, LayeredBody, Surface, Vec3, grow};
use palpa_testkit::cases;
use proptest::prelude::*;

use crate::sound::{assert_sound, smallest_angle, volume};

/// The volume of the prisms under each triangle of `body`.
fn volumes(body: &LayeredBody) -> Vec<f64> {
    (0..body.skin.triangles.len())
        .map(|t| {
            (0..body.n_levels - 1)
                .map(|i| prism_volume(&body.prism(t, i).map(|n| body.positions[n])))
                .sum()
        })
        .collect()
}

/// What every refinement keeps.
fn assert_faithful(old: &LayeredBody, refined: &Refined) {
    let new = &refined.body;
    assert_sound(new);
    assert_eq!(refined.n_invalid, 0);
    assert_eq!(refined.parents.len(), new.skin.triangles.len());
    assert!(refined.parents.is_sorted());
    assert_eq!(new.skin.points[..old.n_vertices()], old.skin.points);
    assert_eq!(new.cut_faces.len(), old.cut_faces.len());
    // The parts of each triangle fill the prisms under it.
    let mut sums = vec![0.0; old.skin.triangles.len()];
    for (&parent, volume) in refined.parents.iter().zip(volumes(new)) {
        sums[parent as usize] += volume;
    }
    for (t, (sum, volume)) in sums.iter().zip(volumes(old)).enumerate() {
        assert!(
            (sum / volume - 1.0).abs() < 1e-11,
            "triangle {t}: {sum} of {volume}"
        );
    }
    assert!((volume(new) / volume(old) - 1.0).abs() < 1e-12);
    // Fields that are linear in space are carried exactly, since positions are.
    let linear = |p: &Vec3| 3.0 * p.x - 2.0 * p.y + 0.5 * p.z + 1.0;
    let field: Vec<f64> = old.positions.iter().map(linear).collect();
    for (value, p) in refined.interpolate(&field).iter().zip(&new.positions) {
        assert!((value - linear(p)).abs() < 1e-14);
    }
    let field: Vec<f64> = old.skin.points.iter().map(linear).collect();
    for (value, p) in refined.interpolate(&field).iter().zip(&new.skin.points) {
        assert!((value - linear(p)).abs() < 1e-14);
    }
}

fn longest_edges(skin: &Surface) -> impl Iterator<Item = (f64, Vec3)> + '_ {
    (0..skin.triangles.len()).map(|t| {
        let p = skin.corners(t);
        let longest = (0..3)
            .map(|k| (p[(k + 1) % 3] - p[k]).norm())
            .fold(0.0, f64::max);
        (longest, p.iter().sum::<Vec3>() / 3.0)
    })
}

fn layer(name: &str, thickness: Option<f64>, n_levels: usize) -> LayerSpec {
    LayerSpec {
        name: name.to_owned(),
        thickness: thickness.map(Thickness::Constant),
        n_levels,
        min_thickness: 1e-4,
    }
}

fn grown_as(skin: &Surface, bones: &[Surface], layers: Vec<LayerSpec>) -> LayeredBody {
    let params = GrowthParams {
        layers,
        cut_out: None,
        coarsening: None,
        max_nodes: palpa_mesh::growth::MAX_NODES,
    };
    grow(skin, bones, &params).unwrap().body
}

pub(crate) fn grown(skin: &Surface, bones: &[Surface]) -> LayeredBody {
    let layers = vec![
        layer("skin", Some(1.5e-3), 1),
        layer("fat", Some(4e-3), 2),
        layer("muscle", None, 3),
    ];
    grown_as(skin, bones, layers)
}

/// A flat skin with straight columns.
pub(crate) fn flat(skin: &Surface) -> LayeredBody {
    grown_as(skin, &[], vec![layer("muscle", Some(0.01), 2)])
}

#[test]
fn angles_do_not_degrade_with_the_number_of_rounds() {
    let body = patch(5, 5, 0.01, &[0.0, 0.01], &[0]);
    let place = [body.skin.points[centre_vertex(5, 5)] + Vec3::new(1.1e-3, 0.7e-3, 0.0)];
    let mut sizes = Vec::new();
    for round in 1..=14 {
        let h = 0.02 * 0.5_f64.powi(round);
        let params = RefineParams {
            max_depth: 20,
            ..RefineParams::default()
        };
        let refined = refine(&body, &params, near_points(&place, 0.0, h, 0.5));
        assert_faithful(&body, &refined);
        assert_eq!(refined.n_too_large, 0);
        // Half an angle of 45° is the least that a green triangle over such a red one can have:
        // atan(1/2) − … = 18.43°.
        let angle = smallest_angle(&refined.body.skin);
        assert!(angle > 18.4, "round {round}: {angle}°");
        let nearest = longest_edges(&refined.body.skin)
            .min_by(|a, b| (a.1 - place[0]).norm().total_cmp(&(b.1 - place[0]).norm()));
        assert!(nearest.unwrap().0 <= h + 0.5 * h);
        sizes.push(refined.body.n_vertices());
    }
    // As many vertices for every halving: the rest is not refined.
    println!("{sizes:?}");
    assert!(sizes[13] - sizes[12] < 200 && sizes[13] < 2000);
}

#[test]
fn limbs_stay_sound_when_refined_near_a_place() {
    let (skin, bone) = cylinder(0.16, 0.04, 0.012, 8e-3);
    let (arm, bones) = forearm(8e-3, 1.0);
    for body in [grown(&skin, &[bone]), grown(&arm, &bones)] {
        let rim = body.cut_faces[0].vertices[0] as usize;
        // In the middle, and at the rim, where cut faces are refined along.
        for v in [body.n_vertices() / 2, rim] {
            let place = [body.skin.points[v]];
            let size = near_points(&place, 8e-3, 1.2e-3, 0.3);
            let refined = refine(&body, &RefineParams::default(), &size);
            assert_faithful(&body, &refined);
            assert_eq!(refined.n_too_large, 0);
            for (t, &parent) in refined.parents.iter().enumerate() {
                let corners = refined.body.skin.corners(t);
                let longest = (0..3)
                    .map(|k| (corners[(k + 1) % 3] - corners[k]).norm())
                    .fold(0.0, f64::max);
                assert!(longest <= size(parent, &corners) * 1.5);
            }
            let (before, after) = (
                smallest_angle(&body.skin),
                smallest_angle(&refined.body.skin),
            );
            println!(
                "{} to {} vertices, smallest angle {before:.1}° to {after:.1}°",
                body.n_vertices(),
                refined.body.n_vertices()
            );
            assert!(after > 0.45 * before);
        }
    }
}

#[test]
fn triangles_that_are_a_little_too_large_are_divided_into_two() {
    let halving = RefineParams {
        divides_in_two: true,
        ..RefineParams::default()
    };
    // Right triangles with legs of 10 mm, or 5 mm once divided into four.
    let body = patch(9, 9, 0.01, &[0.0, 0.01], &[0]);
    for (wanted, parts) in [
        (14.2e-3, 1),
        (12e-3, 2),
        (9.5e-3, 4),
        (6e-3, 8),
        (5.1e-3, 8),
    ] {
        let refined = refine(&body, &halving, |_, _| wanted);
        assert_faithful(&body, &refined);
        assert_eq!(refined.n_too_large, 0, "{wanted}");
        assert_eq!(refined.parents.len(), 128 * parts, "{wanted}");
        assert!((smallest_angle(&refined.body.skin) - 45.0).abs() < 1e-9);
    }
    let shallow = RefineParams {
        max_depth: 1,
        ..halving
    };
    let refined = refine(&body, &shallow, |_, _| 1e-3);
    assert_eq!(refined.n_too_large, 128 * 4);

    let (arm, bones) = forearm(14e-3, 1.0);
    let body = grown(&arm, &bones);
    let place = [body.skin.points[body.n_vertices() / 2]];
    let mut n_vertices = Vec::new();
    for h in [
        6e-3, 5e-3, 4.2e-3, 3.5e-3, 3e-3, 2.5e-3, 2.1e-3, 1.75e-3, 1.5e-3,
    ] {
        let size = near_points(&place, 15e-3, h, 0.5);
        let refined = refine(&body, &halving, &size);
        assert_faithful(&body, &refined);
        assert_eq!(refined.n_too_large, 0);
        let angle = smallest_angle(&refined.body.skin);
        println!("{h} m: {} vertices, {angle:.1}°", refined.body.n_vertices());
        assert!(angle > 0.45 * smallest_angle(&body.skin), "{angle}°");
        n_vertices.push(refined.body.n_vertices() as f64);
    }
    // No step is as large as that of triangles divided into four.
    let steps = n_vertices.windows(2).map(|pair| pair[1] / pair[0]);
    let largest = steps.fold(0.0, f64::max);
    assert!(
        largest < 2.2 && n_vertices[8] > 3.0 * n_vertices[0],
        "{n_vertices:?}"
    );
}

#[test]
fn a_level_split_divides_the_same_body() {
    let (arm, bones) = forearm(8e-3, 1.0);
    let body = grown(&arm, &bones);
    let place = [(body.n_vertices() / 2) as u32];
    let depths = mean_depths(&body, &place);
    let wanted = along(depths, near_depth(8e-3, 3e-3, 1e-3, 0.3));
    let (parts, is_resolved) = parts_for(body.n_levels - 1, wanted, 40);
    assert!(is_resolved);
    let split = split_levels(&body, &parts);
    assert_sound(&split.body);
    assert_eq!(split.n_invalid, 0);
    assert!((volume(&split.body) / volume(&body) - 1.0).abs() < 1e-12);
    let positions = split.interpolate(&body.positions);
    assert_eq!(positions, split.body.positions);
    // Borders of layers are where they were.
    let borders = |body: &LayeredBody| -> Vec<Vec3> {
        (1..body.n_levels - 1)
            .filter(|&l| body.interval_layer[l] != body.interval_layer[l - 1])
            .map(|l| body.positions[body.node(place[0] as usize, l)])
            .collect()
    };
    assert_eq!(borders(&split.body), borders(&body));
    let new_depths = mean_depths(&split.body, &place);
    println!("{} to {} levels", body.n_levels, split.body.n_levels);
    for d in new_depths
        .windows(2)
        .filter(|d| d[1] > 5e-3 && d[0] < 11e-3)
    {
        assert!(d[1] - d[0] <= 1e-3 * (1.0 + 1e-9), "{new_depths:?}");
    }
    // Both kinds of refinement, in either order, give one body.
    let params = RefineParams::default();
    let size = near_points(&[body.skin.points[place[0] as usize]], 5e-3, 2e-3, 0.3);
    let columns_last = refine(&split.body, &params, &size).body;
    let levels_last = split_levels(&refine(&body, &params, &size).body, &parts).body;
    assert_eq!(columns_last.skin, levels_last.skin);
    for (p, q) in columns_last.positions.iter().zip(&levels_last.positions) {
        assert!((p - q).norm() < 1e-15);
    }
}

#[test]
fn limits_are_kept_and_said() {
    let body = patch(9, 9, 0.01, &[0.0, 0.01], &[0]);
    let shallow = RefineParams {
        max_depth: 2,
        ..RefineParams::default()
    };
    let refined = refine(&body, &shallow, |_, _| 0.0);
    assert_eq!(refined.parents.len(), 128 * 16);
    assert_eq!(refined.n_too_large, 128 * 16);
    let small = RefineParams {
        max_vertices: 500,
        ..RefineParams::default()
    };
    for wanted in [0.0, -1.0, f64::NEG_INFINITY] {
        let refined = refine(&body, &small, |_, _| wanted);
        assert_sound(&refined.body);
        assert!(refined.n_too_large > 0);
        assert!((500..560).contains(&refined.body.n_vertices()));
    }
    for wanted in [f64::NAN, f64::INFINITY, 0.1] {
        let refined = refine(&body, &small, |_, _| wanted);
        assert_eq!(refined.body, body);
        assert_eq!(refined.n_too_large, 0);
    }
    let none = refine(&body, &small, near_points(&[], 0.1, 1e-3, 0.1));
    assert_eq!(none.body, body);
}

#[test]
fn a_closed_rim_is_refined_all_round() {
    let block = GradedBlock {
        outline: Outline::Disc,
        half_width: 0.05,
        centre: [0.0, 0.0],
        ring_radius: Some(0.01),
        spacing: 5e-3,
        inner_growth: 0.0,
        growth: 0.4,
        jitter: Some(1),
    };
    let levels = LevelStack {
        depths: vec![0.0, 0.01],
        interval_layer: vec![0],
    };
    let body = graded_block(&block, &levels);
    let refined = refine(&body, &RefineParams::default(), |_, _| 8e-3);
    assert_faithful(&body, &refined);
    assert!(refined.body.cut_faces[0].vertices.len() > body.cut_faces[0].vertices.len());
}

/// The work does not grow faster than the mesh: each triangle of the forest is asked once, and they
/// are at most a third more than those of the result.
#[test]
fn wishes_are_asked_for_once_a_triangle_whatever_the_size() {
    for n in [25, 50, 100] {
        let depths = [0.0, 1e-3, 2e-3, 5e-3, 1e-2];
        let body = patch(n, n, 2e-3, &depths, &[0, 0, 1, 1]);
        let place = [body.skin.points[centre_vertex(n, n)]];
        let wish = near_points(&place, 8e-3, 0.3e-3, 0.2);
        let n_asked = Cell::new(0);
        let refined = refine(&body, &RefineParams::default(), |t, corners| {
            n_asked.set(n_asked.get() + 1);
            wish(t, corners)
        });
        assert_eq!(refined.n_too_large, 0);
        assert!(refined.body.n_vertices() > n * n);
        let per_triangle = f64::from(n_asked.get()) / refined.parents.len() as f64;
        assert!(
            per_triangle < 1.4,
            "{per_triangle} a triangle on {n} by {n} vertices"
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(40)))]

    #[test]
    fn any_wishes_give_a_sound_body(
        seed in 0..1000_u64,
        (x, y) in (0.0..0.1_f64, 0.0..0.1_f64),
        (other_x, other_y) in (0.0..0.1_f64, 0.0..0.1_f64),
        h in 1e-3..2e-2_f64,
        growth in 0.0..1.5_f64,
        is_square: bool,
    ) {
        let block = GradedBlock {
            outline: if is_square { Outline::Square } else { Outline::Disc },
            half_width: 0.05,
            centre: [0.05, 0.05],
            ring_radius: Some(0.01),
            spacing: 5e-3,
            inner_growth: 0.0,
            growth: 0.4,
            jitter: Some(seed),
        };
        let levels = LevelStack { depths: vec![0.0, 0.01, 0.03], interval_layer: vec![0, 1] };
        let mut body = graded_block(&block, &levels);
        // Columns that lean and bend.
        for v in 0..body.n_vertices() {
            let p = body.skin.points[v];
            let rim = body.cut_faces.iter().any(|f| f.vertices.contains(&(v as u32)));
            for l in 1..body.n_levels {
                let node = body.node(v, l);
                if !rim {
                    body.positions[node] += Vec3::new((90.0 * p.y).sin(), (80.0 * p.x).cos(), 0.5) * (1e-3 * l as f64);
                }
            }
        }
        let points = [Vec3::new(x, y, 0.0), Vec3::new(other_x, other_y, 2e-3)];
        let before = smallest_angle(&body.skin);
        let refined = refine(&body, &RefineParams::default(), near_points(&points, 1e-3, h, growth));
        assert_faithful(&body, &refined);
        prop_assert!(smallest_angle(&refined.body.skin) > 0.3 * before);
        let again = refine(&body, &RefineParams::default(), near_points(&points, 1e-3, h, growth));
        prop_assert_eq!(refined, again);
    }
}

/// A closed body with poles, as from a modelling program: slices along x, thin triangles at both ends.
fn pointed(axes: [f64; 3], around: usize, along: usize) -> Surface {
    let tip = |x: f64| Vec3::new(x, 0.0, 0.0);
    let mut points = vec![tip(-axes[0])];
    for i in 1..along {
        let (sin, cos) = (PI * i as f64 / along as f64).sin_cos();
        points.extend((0..around).map(|k| {
            let (s, c) = (2.0 * PI * k as f64 / around as f64).sin_cos();
            Vec3::new(-axes[0] * cos, axes[1] * sin * c, axes[2] * sin * s)
        }));
    }
    points.push(tip(axes[0]));
    let last = points.len() as u32 - 1;
    let at = |i: usize, k: usize| (1 + (i - 1) * around + k % around) as u32;
    let mut triangles = Vec::new();
    for k in 0..around {
        triangles.push([0, at(1, k + 1), at(1, k)]);
        triangles.push([last, at(along - 1, k), at(along - 1, k + 1)]);
        for i in 1..along - 1 {
            triangles.push([at(i, k), at(i, k + 1), at(i + 1, k)]);
            triangles.push([at(i, k + 1), at(i + 1, k + 1), at(i + 1, k)]);
        }
    }
    Surface { points, triangles }
}

/// At pointed ends, layers hardly have room. What growth lets pass there must stay valid in each part.
#[test]
fn a_body_with_pointed_ends_can_be_divided() {
    for fat in [7e-3, 8e-3] {
        let layers = [("skin", 1.5e-3), ("fat", fat), ("muscle", 15e-3)];
        let layers = layers.map(|(name, thickness)| layer(name, Some(thickness), 1));
        let skin = pointed([0.11, 0.038, 0.034], 20, 18);
        let body = grown_as(&skin, &[], layers.into());
        let split = split_levels(&body, &vec![vec![0.3, 0.3, 0.4]; body.n_levels - 1]);
        assert_eq!(split.n_invalid, 0, "{fat}");
        assert_sound(&split.body);
        let near_the_end = near_points(&[skin.points[0]], 0.01, 2e-3, 0.6);
        let refined = refine(&split.body, &RefineParams::default(), near_the_end);
        assert_eq!(refined.n_invalid, 0, "{fat}");
        assert_sound(&refined.body);
    }
}
