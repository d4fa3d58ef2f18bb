//! Circles in the skin: closed rings at their radius that no edge crosses.

use std::f64::consts::{PI, TAU};

use palpa_mesh::generate::patch::patch;
use palpa_mesh::generate::{block_skin, cylinder, forearm};
use palpa_mesh::refine::{
    Circle, Imprint, ImprintError, RefineParams, imprint_circle, near_points, refine,
};
use palpa_mesh::{LayeredBody, Vec3};
use palpa_testkit::cases;
use proptest::prelude::*;

use crate::refine::{flat, grown};
use crate::sound::{assert_sound, smallest_angle, volume};

/// What every imprint keeps.
fn assert_imprinted(old: &LayeredBody, circle: &Circle, imprint: &Imprint) {
    let body = &imprint.refined.body;
    assert_sound(body);
    assert_eq!(imprint.refined.n_invalid, 0);
    let axis = circle.direction.normalize();
    let off = |v: u32| {
        let d = body.skin.points[v as usize] - circle.point;
        (d - axis * d.dot(&axis)).norm() - circle.radius
    };
    let eps = 1e-12 * (1.0 + circle.radius);
    for &v in &imprint.ring {
        assert!(
            off(v).abs() < eps,
            "vertex {v} of the ring is off by {}",
            off(v)
        );
    }
    for &t in &imprint.inside {
        assert!(
            body.skin.triangles[t as usize]
                .iter()
                .all(|&v| off(v) < eps)
        );
    }
    // Outside triangles reach in nowhere near the place; those on the far side of a limb are
    // another matter.
    let near = |t: usize| {
        let p = body.skin.corners(t).iter().sum::<Vec3>() / 3.0;
        (p - circle.point).norm() < 1.5 * circle.radius
    };
    for t in (0..body.skin.triangles.len()).filter(|&t| near(t)) {
        if imprint.inside.binary_search(&(t as u32)).is_err() {
            let corners = body.skin.triangles[t];
            assert!(
                corners.iter().all(|&v| off(v) > -eps),
                "triangle {t} crosses"
            );
        }
    }
    // Round the ring, along edges, once.
    let angle = |v: u32| {
        let e1 = axis.cross(&Vec3::ith(axis.iamin(), 1.0)).normalize();
        let d = body.skin.points[v as usize] - circle.point;
        d.dot(&axis.cross(&e1)).atan2(d.dot(&e1))
    };
    let n = imprint.ring.len();
    let turns: f64 = (0..n)
        .map(|k| {
            let step = angle(imprint.ring[(k + 1) % n]) - angle(imprint.ring[k]);
            (step + PI).rem_euclid(TAU) - PI
        })
        .sum();
    assert!((turns.abs() - TAU).abs() < 1e-9, "{turns}");
    let ratio = imprint.effective_radius / circle.radius;
    assert!(ratio < 1.0 && ratio > 0.9, "{ratio}");
    // Its own origins say where the new vertices are.
    let positions = imprint.refined.interpolate(&old.positions);
    for (p, q) in positions.iter().zip(&body.positions) {
        assert!((p - q).norm() < 1e-14);
    }
}

#[test]
fn a_flat_block_gets_an_exact_ring_and_keeps_its_volume() {
    let coarse = patch(21, 21, 5e-3, &[0.0, 2e-3, 1e-2], &[0, 1]);
    let circle = Circle {
        point: Vec3::new(0.0517, 0.0483, 0.0),
        direction: Vec3::new(0.0, 0.0, -2.0),
        radius: 10e-3,
    };
    let mut errors = Vec::new();
    for h in [4e-3, 2e-3, 1e-3] {
        let size = near_points(&[circle.point], circle.radius, h, 0.3);
        let refined = refine(&coarse, &RefineParams::default(), size);
        let imprint = imprint_circle(&refined.body, &circle).unwrap();
        assert_imprinted(&refined.body, &circle, &imprint);
        let body = &imprint.refined.body;
        assert!((volume(body) / volume(&coarse) - 1.0).abs() < 1e-12);
        let angle = smallest_angle(&body.skin);
        println!(
            "h {:.0} mm: ring of {}, {} moved, effective radius {:.3} mm, smallest angle {angle:.1}°",
            h * 1e3,
            imprint.ring.len(),
            imprint.n_moved,
            imprint.effective_radius * 1e3
        );
        assert!(angle > 8.0, "{angle}");
        errors.push(1.0 - imprint.effective_radius / circle.radius);
        // In terms of the coarse body, too.
        let whole = imprint.refined.clone().after(&refined);
        let positions = whole.interpolate(&coarse.positions);
        for (p, q) in positions.iter().zip(&whole.body.positions) {
            assert!((p - q).norm() < 1e-14);
        }
        assert!(whole.parents.is_sorted() && whole.parents.len() == body.skin.triangles.len());
    }
    // A polygon of side s misses (s / 2 r)² / 6 or so of its radius.
    assert!(
        errors[2] < 0.3 * errors[0] && errors[2] < 2e-3,
        "{errors:?}"
    );
}

#[test]
fn limbs_get_rings_on_the_side_that_is_meant() {
    let (skin, bone) = cylinder(0.16, 0.04, 0.012, 6e-3);
    let (arm, bones) = forearm(6e-3, 1.0);
    for body in [grown(&skin, &[bone]), grown(&arm, &bones)] {
        let v = body.n_vertices() / 2 + 3;
        let normal = body.skin.vertex_normals()[v];
        let circle = Circle {
            point: body.skin.points[v] + normal * 1e-3,
            direction: normal,
            radius: 8e-3,
        };
        let size = near_points(&[circle.point], circle.radius, 2e-3, 0.3);
        let refined = refine(&body, &RefineParams::default(), size);
        let imprint = imprint_circle(&refined.body, &circle).unwrap();
        assert_imprinted(&refined.body, &circle, &imprint);
        let change = volume(&imprint.refined.body) / volume(&body) - 1.0;
        println!(
            "ring of {}, {} moved, effective radius {:.3} mm, volume changed by {change:.1e}, smallest angle {:.1}°",
            imprint.ring.len(),
            imprint.n_moved,
            imprint.effective_radius * 1e3,
            smallest_angle(&imprint.refined.body.skin)
        );
        assert!(change.abs() < 1e-4);
        assert!(imprint.effective_radius > 0.985 * circle.radius);
    }
}

#[test]
fn circles_that_cannot_be_are_refused() {
    let body = flat(&block_skin([0.06, 0.06], 2e-3));
    let circle = Circle {
        point: Vec3::zeros(),
        direction: Vec3::z(),
        radius: 8e-3,
    };
    let of = |changed: Circle| imprint_circle(&body, &changed).err().unwrap();
    for bad in [
        Circle {
            radius: 0.0,
            ..circle
        },
        Circle {
            radius: f64::NAN,
            ..circle
        },
        Circle {
            direction: Vec3::zeros(),
            ..circle
        },
        Circle {
            point: Vec3::repeat(f64::NAN),
            ..circle
        },
    ] {
        assert!(matches!(of(bad), ImprintError::NoCircle { .. }));
    }
    let over = Circle {
        point: Vec3::x() * 0.025,
        ..circle
    };
    assert!(matches!(of(over), ImprintError::OverRim { .. }));
    let beside = Circle {
        point: Vec3::x() * 0.05,
        ..circle
    };
    assert!(matches!(of(beside), ImprintError::TooCoarse { .. }));
    let tiny = Circle {
        radius: 1e-4,
        ..circle
    };
    assert!(matches!(of(tiny), ImprintError::TooCoarse { .. }));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(60)))]

    #[test]
    fn circles_anywhere_are_imprinted(
        (x, y) in (-0.012..0.012_f64, -0.012..0.012_f64),
        radius in 6e-3..1.2e-2_f64,
        tilt in -0.3..0.3_f64,
    ) {
        let body = flat(&block_skin([0.06, 0.06], 2e-3));
        let circle = Circle {
            point: Vec3::new(x, y, 0.0),
            direction: Vec3::new(tilt, 0.1, 1.0),
            radius,
        };
        let imprint = imprint_circle(&body, &circle).unwrap();
        assert_imprinted(&body, &circle, &imprint);
        prop_assert!((volume(&imprint.refined.body) / volume(&body) - 1.0).abs() < 1e-12);
        prop_assert!(smallest_angle(&imprint.refined.body.skin) > 5.0);
    }
}
