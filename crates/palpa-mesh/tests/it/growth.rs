//! Growth: exact on shapes with a known answer, valid or refused on all others.

use std::f64::consts::TAU;

use palpa_mesh::generate::tube::{Ends, tube};
use palpa_mesh::generate::{block_skin, cylinder, forearm};
use palpa_mesh::growth::{ScatteredThickness, Thickness};
use palpa_mesh::quality::{prism_shapes, prism_volume};
use palpa_mesh::{Growth, GrowthError, GrowthParams, LayerSpec, Surface, Vec3, grow};
use palpa_testkit::cases;
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;

fn layer(name: &str, thickness: Option<f64>, n_levels: usize) -> LayerSpec {
    LayerSpec {
        name: name.to_owned(),
        thickness: thickness.map(Thickness::Constant),
        n_levels,
        min_thickness: 1e-4,
    }
}

fn limb_layers() -> Vec<LayerSpec> {
    vec![
        layer("skin", Some(1.5e-3), 1),
        layer("fat", Some(4e-3), 1),
        layer("muscle", None, 3),
    ]
}

fn params(layers: Vec<LayerSpec>) -> GrowthParams {
    GrowthParams {
        layers,
        cut_out: None,
        coarsening: None,
        max_nodes: palpa_mesh::growth::MAX_NODES,
    }
}

/// What every grown body keeps, whatever its shape.
fn assert_sound(growth: &Growth, layers: &[LayerSpec]) {
    let (body, report) = (&growth.body, &growth.report);
    let shapes = prism_shapes(body, &body.positions);
    assert!(
        shapes.iter().all(palpa_mesh::quality::PrismShape::is_valid),
        "{report:?}"
    );
    assert!(report.scaled_jacobian.min > 0.0);
    assert_eq!(
        body.n_levels,
        1 + layers.iter().map(|l| l.n_levels).sum::<usize>()
    );
    assert_eq!(
        (report.n_nodes, report.n_prisms),
        (body.positions.len(), shapes.len())
    );
    for (v, p) in body.skin.points.iter().enumerate() {
        assert_eq!(body.positions[body.node(v, 0)], *p, "the skin is level 0");
    }
    for face in body.cut_faces.iter().filter(|f| f.is_flat) {
        for &v in &face.vertices {
            for l in 0..body.n_levels {
                let height =
                    (body.positions[body.node(v as usize, l)] - face.point).dot(&face.normal);
                let rim = (body.skin.points[v as usize] - face.point).dot(&face.normal);
                assert!(
                    (height - rim).abs() < 1e-9,
                    "column {v} leaves its cut face by {height} m"
                );
            }
        }
    }
}

#[test]
fn a_block_grows_straight_and_exactly() {
    let layers = vec![
        layer("skin", Some(2e-3), 1),
        layer("muscle", Some(18e-3), 3),
    ];
    let growth = grow(
        &block_skin([0.06, 0.04], 5e-3),
        &[],
        &params(layers.clone()),
    )
    .unwrap();
    assert_sound(&growth, &layers);
    let body = &growth.body;
    for v in 0..body.n_vertices() {
        let skin = body.skin.points[v];
        for (l, depth) in [0.0, 2e-3, 8e-3, 14e-3, 20e-3].into_iter().enumerate() {
            let at = body.positions[body.node(v, l)];
            assert!(
                (at - (skin - Vec3::z() * depth)).norm() < 1e-12,
                "vertex {v} level {l}: {at:?}"
            );
        }
    }
    assert_eq!(body.cut_faces.len(), 4);
    assert!(
        body.cut_faces
            .iter()
            .all(|f| f.is_flat && f.vertices.len() >= 9)
    );
    let volume: f64 = (0..body.skin.triangles.len())
        .flat_map(|t| (0..4).map(move |i| (t, i)))
        .map(|(t, i)| prism_volume(&body.prism(t, i).map(|n| body.positions[n])))
        .sum();
    assert!(
        (volume / (0.06 * 0.04 * 0.02) - 1.0).abs() < 1e-12,
        "{volume}"
    );
}

#[test]
fn a_cylinder_grows_radially_down_to_its_bone() {
    let (radius, bone_radius) = (0.04, 0.012);
    let (skin, bone) = cylinder(0.16, radius, bone_radius, 5e-3);
    let growth = grow(&skin, &[bone], &params(limb_layers())).unwrap();
    assert_sound(&growth, &limb_layers());
    let body = &growth.body;
    for v in 0..body.n_vertices() {
        let skin = body.skin.points[v];
        for (l, depth) in [1.5e-3, 5.5e-3].into_iter().enumerate() {
            let at = body.positions[body.node(v, l + 1)];
            assert!(
                (at.yz().norm() - (radius - depth)).abs() < 2e-5,
                "depth of level {} at {v}: {at:?}",
                l + 1
            );
        }
        let base = body.positions[body.node(v, body.n_levels - 1)];
        // The polygons that stand for the circles differ from them by up to 0.15 mm.
        assert!(
            (base.yz().norm() - bone_radius).abs() < 3e-4,
            "base of {v}: {base:?}"
        );
        let sideways = base.yz().normalize().dot(&skin.yz().normalize());
        // The bone is a polygon of 19 sides, and the field that of its triangles: 3° at most.
        assert!(
            sideways > 0.9986,
            "column {v} turns round the bone: {sideways}"
        );
        assert!(
            (base.x - skin.x).abs() < 2e-3,
            "column {v} drifts along: {} to {}",
            skin.x,
            base.x
        );
    }
    assert!(growth.report.thinned_share < 1e-12);
    assert!(growth.report.stand_off.unwrap().max < 3e-4);
}

#[test]
fn flat_caps_of_a_closed_limb_are_found_and_not_grown_from() {
    let section =
        |along: f64, angle: f64| Vec3::new(0.16 * along, 0.04 * angle.cos(), 0.03 * angle.sin());
    let (open, closed) = (
        tube(30, 40, Ends::Open, section),
        tube(30, 40, Ends::Closed, section),
    );
    let layers = vec![layer("fat", Some(5e-3), 2)];
    let [open, closed] =
        [open, closed].map(|skin| grow(&skin, &[], &params(layers.clone())).unwrap());
    assert_sound(&closed, &layers);
    assert_eq!((open.report.n_caps, closed.report.n_caps), (0, 2));
    assert_eq!(
        open.body.skin.triangles.len(),
        closed.body.skin.triangles.len()
    );
    assert_eq!(closed.body.cut_faces.len(), 2);
}

#[test]
fn without_room_all_layers_thin_in_proportion_and_none_is_dropped() {
    // A bone that runs 3 mm under the skin on one side: 5.5 mm of skin and fat, and muscle below,
    // do not fit there.
    let (skin, bone) = cylinder(0.16, 0.04, 0.012, 4e-3);
    let mut bone = bone;
    bone.points.iter_mut().for_each(|p| p.y += 0.025);
    let growth = grow(&skin, &[bone], &params(limb_layers())).unwrap();
    assert_sound(&growth, &limb_layers());
    let report = &growth.report;
    assert!(
        report.thinned_share > 0.01 && report.thinned_share < 0.3,
        "{}",
        report.thinned_share
    );
    let worst = report.worst_thinning.as_ref().unwrap();
    assert!(
        worst.at[1] > 0.035,
        "the worst place lies over the bone: {worst:?}"
    );
    let median = report.median_thinning.unwrap();
    assert!(median > worst.value && median < 1.0, "{median}");
    let body = &growth.body;
    let at = |l: usize| body.positions[body.node(worst.vertex as usize, l)];
    let (skin, fat, muscle) = (
        (at(1) - at(0)).norm(),
        (at(2) - at(1)).norm(),
        (at(5) - at(2)).norm(),
    );
    assert!(
        (fat / skin / (4.0 / 1.5) - 1.0).abs() < 1e-6,
        "skin {skin} and fat {fat} keep their ratio"
    );
    assert!(
        muscle > 2e-4 && (skin + fat + muscle - 3e-3).abs() < 3e-4,
        "{skin} {fat} {muscle}"
    );
}

#[test]
fn the_usual_thinning_is_that_of_half_of_the_thinned_skin() {
    // A bone of 14.5 mm, 3 mm off the axis of a limb of 20 mm. At the angle θ from that side the room
    // is |20 mm e^{iθ} − 3 mm| − 14.5 mm, and 6.6 mm are asked for: 5.5 mm, and a fifth of it of muscle.
    let (skin, mut bone) = cylinder(0.16, 0.02, 0.0145, 3e-3);
    bone.points.iter_mut().for_each(|p| p.y += 0.003);
    let growth = grow(&skin, &[bone], &params(limb_layers())).unwrap();
    let report = &growth.report;
    let room = |angle: f64| (20.0_f64.powi(2) + 9.0 - 120.0 * angle.cos()).sqrt() - 14.5;
    let border = ((20.0_f64.powi(2) + 9.0 - 21.1_f64.powi(2)) / 120.0).acos();
    let share = border / std::f64::consts::PI;
    assert!(
        (report.thinned_share - share).abs() < 0.06,
        "{} for {share}",
        report.thinned_share
    );
    let (median, expected) = (report.median_thinning.unwrap(), room(0.5 * border) / 6.6);
    assert!(
        (median / expected - 1.0).abs() < 0.08,
        "{median} for {expected}"
    );
    let (plenty, bone) = cylinder(0.16, 0.04, 0.012, 4e-3);
    let growth = grow(&plenty, &[bone], &params(limb_layers())).unwrap();
    assert_eq!(growth.report.median_thinning, None);
}

#[test]
fn the_forearm_grows_at_every_resolution() {
    for spacing in [0.010, 0.006, 0.004] {
        let (skin, bones) = forearm(spacing, 1.0);
        let growth = grow(&skin, &bones, &params(limb_layers())).unwrap();
        assert_sound(&growth, &limb_layers());
        let report = &growth.report;
        assert!(
            report.scaled_jacobian.p05 > 0.2,
            "{spacing}: {:?}",
            report.scaled_jacobian
        );
        assert!(
            report.stand_off.unwrap().min > -1e-3,
            "{:?}",
            report.stand_off
        );
        assert_eq!(report.n_base_overlaps, 0);
        assert!(report.layers[0].thickness.median > 1.45e-3);
    }
}

#[test]
fn thickness_follows_a_table_and_samples() {
    let skin = block_skin([0.06, 0.06], 5e-3);
    let along = Thickness::AlongAxis {
        axis: Vec3::x(),
        table: vec![[-0.03, 2e-3], [0.03, 8e-3]],
    };
    let samples: Vec<(Vec3, f64)> = skin.points.iter().map(|&p| (p, 5e-3 + 0.1 * p.x)).collect();
    let scattered = Thickness::Scattered(ScatteredThickness::build(&samples).unwrap());
    for thickness in [along, scattered] {
        let layers = vec![LayerSpec {
            thickness: Some(thickness),
            ..layer("fat", None, 2)
        }];
        let growth = grow(&skin, &[], &params(layers.clone())).unwrap();
        assert_sound(&growth, &layers);
        let body = &growth.body;
        for v in 0..body.n_vertices() {
            let depth = -body.positions[body.node(v, 2)].z;
            let want = 5e-3 + 0.1 * body.skin.points[v].x;
            assert!((depth - want).abs() < 1e-9, "{depth} at {v}, not {want}");
        }
    }
}

#[test]
fn a_cut_out_keeps_the_part_round_its_centre() {
    let (skin, bones) = forearm(0.004, 1.0);
    let centre = skin.points[skin.points.len() / 2];
    let layers = limb_layers();
    let growth = grow(
        &skin,
        &bones,
        &GrowthParams {
            layers: layers.clone(),
            cut_out: Some((centre, 0.04)),
            coarsening: None,
            max_nodes: palpa_mesh::growth::MAX_NODES,
        },
    )
    .unwrap();
    assert_sound(&growth, &layers);
    assert!(growth.body.n_vertices() < skin.points.len() / 2);
    assert!(
        growth
            .body
            .skin
            .points
            .iter()
            .all(|p| (p - centre).norm() <= 0.04)
    );
    assert!(growth.body.skin.points.contains(&centre));
    assert!(!growth.body.cut_faces.is_empty());
}

#[test]
fn what_cannot_be_grown_is_refused_with_its_place() {
    let (skin, bone) = cylinder(0.16, 0.04, 0.012, 6e-3);
    let moved = |dy: f64| {
        let mut bone = bone.clone();
        bone.points.iter_mut().for_each(|p| p.y += dy);
        bone
    };
    let error = |skin: &Surface, bones: &[Surface], layers: Vec<LayerSpec>| {
        grow(skin, bones, &params(layers)).unwrap_err().to_string()
    };
    let mut inverted = skin.clone();
    inverted.triangles[7].swap(0, 1);
    let mut not_finite = skin.clone();
    not_finite.points[11].x = f64::NAN;
    let negative = Thickness::AlongAxis {
        axis: Vec3::x(),
        table: vec![[0.0, 1e-3], [0.16, -1e-3]],
    };
    let messages = [
        error(&skin, &[moved(0.034)], limb_layers()),
        error(&skin, &[moved(5.0)], limb_layers()),
        error(&skin, &[], vec![layer("fat", Some(0.05), 2)]),
        error(
            &skin,
            std::slice::from_ref(&bone),
            vec![
                layer("skin", Some(0.02), 1),
                layer("fat", Some(0.02), 1),
                layer("muscle", None, 1),
            ],
        ),
        error(&skin, &[], limb_layers()),
        error(
            &skin,
            std::slice::from_ref(&bone),
            vec![layer("skin", None, 1), layer("fat", Some(1e-3), 1)],
        ),
        error(&skin, &[], vec![layer("fat", Some(1e-3), 0)]),
        error(
            &skin,
            &[],
            vec![LayerSpec {
                thickness: Some(negative),
                ..layer("fat", None, 1)
            }],
        ),
        error(&skin, &[], Vec::new()),
        error(&inverted, &[], vec![layer("fat", Some(1e-3), 1)]),
        error(&not_finite, &[], vec![layer("fat", Some(1e-3), 1)]),
        error(&Surface::default(), &[], vec![layer("fat", Some(1e-3), 1)]),
    ];
    insta::assert_snapshot!(messages.join("\n\n"));
}

#[test]
fn a_spike_is_grown_or_refused_where_it_is() {
    let mut skin = block_skin([0.06, 0.06], 5e-3);
    let middle = skin.points.len() / 2;
    skin.points[middle].z += 0.04;
    match grow(&skin, &[], &params(vec![layer("fat", Some(0.01), 2)])) {
        Ok(growth) => assert_sound(&growth, &[layer("fat", Some(0.01), 2)]),
        Err(GrowthError::Tangled { at, .. }) => assert!(at[0].hypot(at[1]) < 0.02, "{at:?}"),
        Err(other) => panic!("{other}"),
    }
}

/// A bumpy tube with one or two bumpy bones inside.
#[derive(Debug, Clone)]
struct Limb {
    n_rings: usize,
    n_around: usize,
    radius: f64,
    bump: [f64; 3],
    bones: Vec<[f64; 3]>,
}

fn limbs() -> impl Strategy<Value = Limb> {
    let bone = (0.05..0.2, -0.45..0.45, -0.45..0.45).prop_map(|(r, y, z)| [r, y, z]);
    (
        8_usize..24,
        16_usize..40,
        0.02..0.08_f64,
        prop::array::uniform3(-0.12..0.12_f64),
        prop::collection::vec(bone, 1..3),
    )
        .prop_map(|(n_rings, n_around, radius, bump, bones)| Limb {
            n_rings,
            n_around,
            radius,
            bump,
            bones,
        })
}

impl Limb {
    fn surfaces(&self) -> (Surface, Vec<Surface>) {
        let length = 4.0 * self.radius;
        let [a, b, c] = self.bump;
        let skin = tube(self.n_rings, self.n_around, Ends::Open, |s, angle| {
            let r = self.radius
                * (1.0
                    + a * (TAU * s).sin()
                    + b * (2.0 * angle).cos()
                    + c * (3.0 * angle + TAU * s).sin());
            Vec3::new(s * length, r * angle.cos(), r * angle.sin())
        });
        let bones = self
            .bones
            .iter()
            .map(|&[r, y, z]| {
                tube(30, 16, Ends::Closed, |s, angle| {
                    let r = self.radius * r * (1.0 + 0.3 * (2.0 * TAU * s).cos() * a.signum());
                    let centre =
                        Vec3::new((1.1 * s - 0.05) * length, y * self.radius, z * self.radius);
                    centre + Vec3::new(0.0, r * angle.cos(), r * angle.sin())
                })
            })
            .collect();
        (skin, bones)
    }
}

#[test]
fn random_limbs_grow_soundly_or_are_refused_and_mostly_grow() {
    let n_limbs = cases(60);
    let any_limb = (
        limbs(),
        prop::array::uniform2(0.005..0.12_f64),
        1_usize..5,
        any::<bool>(),
    );
    let mut runner = TestRunner::default();
    let (mut n_grown, mut n_tangled) = (0, 0);
    for _ in 0..n_limbs {
        let (limb, shares, n_levels, to_bone) = any_limb.new_tree(&mut runner).unwrap().current();
        let (skin, bones) = limb.surfaces();
        let [first, second] = shares.map(|s| s * limb.radius);
        let last = if to_bone { None } else { Some(second) };
        let layers = vec![
            layer("skin", Some(first), 1),
            layer("fat", Some(second), 1),
            layer("muscle", last, n_levels),
        ];
        match grow(&skin, &bones, &params(layers.clone())) {
            Ok(growth) => {
                assert_sound(&growth, &layers);
                n_grown += 1;
            }
            Err(GrowthError::Tangled { n_bad, .. }) => {
                assert!(n_bad > 0);
                n_tangled += 1;
            }
            Err(GrowthError::BoneOutside { depth, .. }) => assert!(depth > 0.0),
            Err(GrowthError::NoRoom { asked, room }) => assert!(asked > room),
            Err(other) => panic!("{other}"),
        }
    }
    println!("{n_grown} grown, {n_tangled} tangled");
    assert!(
        2 * n_grown >= n_limbs && n_tangled * 10 <= n_grown,
        "{n_grown} grown, {n_tangled} tangled"
    );
}

#[test]
fn a_bone_just_under_the_skin_is_met_and_not_passed() {
    // Two bones with a membrane; one is 1 mm under the skin.
    let (skin, bone) = cylinder(0.16, 0.04, 0.008, 4e-3);
    let moved = |dy: f64| {
        let mut bone = bone.clone();
        bone.points.iter_mut().for_each(|p| p.y += dy);
        bone
    };
    let growth = grow(&skin, &[moved(0.031), moved(0.005)], &params(limb_layers())).unwrap();
    assert_sound(&growth, &limb_layers());
    let body = &growth.body;
    for v in 0..body.n_vertices() {
        let p = body.skin.points[v];
        if p.y > 0.0397 {
            // 0.1 mm are the polygons'.
            assert!(
                growth.stand_off[v].abs() < 2e-4,
                "{} m at {p:?}",
                growth.stand_off[v]
            );
        }
    }
}

#[test]
fn growth_does_not_depend_on_where_the_body_is_and_how_it_lies() {
    let (skin, bones) = forearm(0.009, 1.0);
    let here = grow(&skin, &bones, &params(limb_layers())).unwrap();
    let turn = nalgebra::Rotation3::from_euler_angles(0.4, -1.1, 2.0);
    let shift = Vec3::new(0.3, -0.2, 0.5);
    let moved = |surface: &Surface| {
        let mut surface = surface.clone();
        surface
            .points
            .iter_mut()
            .for_each(|p| *p = turn * *p + shift);
        surface
    };
    let bones: Vec<Surface> = bones.iter().map(moved).collect();
    let there = grow(&moved(&skin), &bones, &params(limb_layers())).unwrap();
    assert_sound(&there, &limb_layers());
    // Ties in the trees and axes of relaxation differ; the shape does not.
    let distances: Vec<f64> = (here.body.positions.iter().zip(&there.body.positions))
        .map(|(p, q)| (turn * *p + shift - q).norm())
        .collect();
    let mean = distances.iter().sum::<f64>() / distances.len() as f64;
    assert!(mean < 1e-5, "{mean} m");
}

#[test]
fn a_cut_out_has_the_core_of_the_whole() {
    let (skin, bones) = forearm(0.005, 1.0);
    let centre = *skin
        .points
        .iter()
        .min_by(|a, b| {
            (a.x - 0.11 - a.z)
                .abs()
                .total_cmp(&(b.x - 0.11 - b.z).abs())
        })
        .unwrap();
    let whole = grow(&skin, &bones, &params(limb_layers())).unwrap();
    let cut = GrowthParams {
        layers: limb_layers(),
        cut_out: Some((centre, 0.035)),
        coarsening: None,
        max_nodes: palpa_mesh::growth::MAX_NODES,
    };
    let part = grow(&skin, &bones, &cut).unwrap();
    let base = |growth: &Growth| {
        let v = growth
            .body
            .skin
            .points
            .iter()
            .position(|p| *p == centre)
            .unwrap();
        growth.body.positions[growth.body.node(v, growth.body.n_levels - 1)]
    };
    let apart = (base(&whole) - base(&part)).norm();
    assert!(apart < 1.5e-3, "{apart} m");
}

#[test]
fn a_body_of_more_nodes_than_are_wanted_is_refused() {
    let (skin, bones) = forearm(0.01, 1.0);
    let mut few = params(limb_layers());
    let n_nodes = grow(&skin, &bones, &few).unwrap().body.n_nodes();
    few.max_nodes = n_nodes;
    assert!(grow(&skin, &bones, &few).is_ok());
    few.max_nodes = n_nodes - 1;
    let error = grow(&skin, &bones, &few).unwrap_err().to_string();
    assert!(
        error.contains(&format!(
            "are {n_nodes} nodes, more than the {}",
            n_nodes - 1
        )),
        "{error}"
    );
}
