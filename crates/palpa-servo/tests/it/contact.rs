//! The small contact problem against closed forms and a slow oracle.

use crate::support::{HalfSpace, Loop, RADIUS, SPEC};
use palpa_servo::{ContactPatch, Faults, Pose, ServoParams, Vec3};

fn pressed(bed: &HalfSpace, centre: Vec3, from: Vec3) -> (Vec3, ContactPatch, u32, Vec3) {
    let mut patch = Box::new(ContactPatch::EMPTY);
    bed.fill(from, 1, &mut patch);
    let params = ServoParams {
        passes: 4,
        ..ServoParams::default()
    };
    let mut servo = Loop::new(&params, SPEC);
    // Comes back in the air, with friction's memory there, then goes where it is asked to in one
    // tick.
    servo.settle(&patch, from, 700);
    servo.send(patch.clone());
    servo.tick(Some(from));
    let mut report = servo.tick(Some(centre));
    assert_eq!(report.faults, Faults::NONE);
    // A millimetre in one tick and 60 contacts on fine skin: what friction is left to settle takes
    // a second tick, in which no anchor moves that is not to.
    if bed.friction == 0.0 || bed.n > 36 {
        report = servo.tick(Some(centre));
    }
    (
        report.tools[0].tissue_force,
        *patch,
        report.sweeps,
        report.tools[0].tissue_torque,
    )
}

#[test]
fn one_vertex_is_a_spring() {
    let bed = HalfSpace {
        spacing: 2e-3,
        compliance: 1e-3,
        friction: 0.0,
        n: 1,
    };
    let from = Vec3::new(0.0, 0.0, RADIUS + 1e-4);
    for depth in [1e-5, 1e-4, 1e-3] {
        let at = Vec3::new(0.0, 0.0, RADIUS - depth);
        let (force, ..) = pressed(&bed, at, from);
        assert!((force - Vec3::z() * depth / 1e-3).norm() < 1e-6, "{force}");
    }
}

#[test]
fn one_vertex_sticks_and_slides_by_coulomb() {
    let friction = 0.4;
    let bed = HalfSpace {
        spacing: 2e-3,
        compliance: 1e-3,
        friction,
        n: 1,
    };
    let from = Vec3::new(0.0, 0.0, RADIUS + 1e-6);
    // Along the tool's underside the curvature is felt by less than a percent here.
    let stick = pressed(&bed, Vec3::new(1e-4, 0.0, RADIUS - 1e-3), from).0;
    let own = bed.block(&Vec3::zeros(), &Vec3::zeros());
    assert!(
        (stick.x + 1e-4 / own.m11).abs() < 0.02 * 1e-4 / own.m11,
        "{stick}"
    );
    let slide = pressed(&bed, Vec3::new(1.5e-3, 0.0, RADIUS - 1e-3), from).0;
    assert!(slide.x < 0.0);
    // Its normal leans back with the sphere, by at most 1.5 in 8.
    let angle = slide.x.abs().atan2(slide.z) - friction.atan();
    assert!(angle.abs() < 1.5 / 8.0, "{slide}");
}

#[test]
fn many_vertices_agree_with_a_slow_oracle() {
    for (n, friction) in [
        (2, 0.0),
        (3, 0.5),
        (9, 0.0),
        (25, 0.0),
        (25, 0.3),
        (49, 0.0),
        (49, 0.6),
        (60, 0.3),
    ] {
        for spacing in [0.8e-3, 2e-3] {
            let bed = HalfSpace {
                spacing,
                compliance: 4e-3,
                friction,
                n,
            };
            let from = Vec3::new(0.0, 0.0, RADIUS + 1e-5);
            let at = Vec3::new(4e-4, -1e-4, RADIUS - 1.2e-3);
            let (force, patch, sweeps, torque) = pressed(&bed, at, from);
            let anchors: Vec<Vec3> = bed.places().iter().map(|p| p - from).collect();
            let forces = bed.oracle(&patch, at, &anchors);
            let oracle = -forces.iter().sum::<Vec3>();
            let error = (force - oracle).norm() / oracle.norm();
            let n_active = forces.iter().filter(|f| f.norm() > 0.0).count();
            println!(
                "n {n:2} friction {friction} spacing {spacing}: active {n_active:2} force {:.3} N error {error:.1e} sweeps {sweeps}",
                oracle.norm()
            );
            assert!(
                error < 1e-3,
                "{n} {friction} {spacing}: {error:.2e} {sweeps}"
            );
            // All forces pass near the centre of the sphere, but for friction.
            assert!(torque.norm() <= (friction + 0.02) * force.norm() * RADIUS * 1.2);
        }
    }
}

#[test]
fn a_pressing_hand_is_followed_within_a_thousandth() {
    // As it is used: 0.1 mm a tick, the default passes and sweeps.
    for n in [9, 25, 49, 60] {
        let bed = HalfSpace {
            spacing: 1.2e-3,
            compliance: 4e-3,
            friction: 0.0,
            n,
        };
        let from = Vec3::new(0.0, 0.0, RADIUS + 1e-5);
        let mut patch = Box::new(ContactPatch::EMPTY);
        bed.fill(from, 1, &mut patch);
        let mut servo = Loop::new(&ServoParams::default(), SPEC);
        servo.settle(&patch, from, 700);
        servo.send(patch.clone());
        let mut most = 0;
        for k in 1..=15 {
            let at = from + Vec3::new(3e-5, 0.0, -1e-4) * f64::from(k);
            let report = servo.tick(Some(at));
            most = most.max(report.sweeps);
            if k % 5 == 0 {
                let oracle = -bed.oracle(&patch, at, &bed.places()).iter().sum::<Vec3>();
                let error = (report.tools[0].tissue_force - oracle).norm() / oracle.norm();
                println!(
                    "n {n:2} at {:.1} mm: error {error:.1e} active {} sweeps {}",
                    0.1 * f64::from(k),
                    report.n_active,
                    report.sweeps
                );
                assert!(error < 1e-3, "{n} {k}: {error:.2e}");
            }
        }
        assert!(most <= ServoParams::default().max_sweeps, "{most}");
    }
}

#[test]
fn friction_remembers_across_patches() {
    // Pressed and dragged with patches that know nothing of friction: the force stays on the cone,
    // and stays when at rest.
    let bed = HalfSpace {
        spacing: 2e-3,
        compliance: 4e-3,
        friction: 0.5,
        n: 49,
    };
    let mut patch = Box::new(ContactPatch::EMPTY);
    let from = Vec3::new(0.0, 0.0, RADIUS + 1e-5);
    bed.fill(from, 1, &mut patch);
    let mut servo = Loop::new(&ServoParams::default(), SPEC);
    servo.settle(&patch, from, 700);
    let mut at = from;
    for k in 0..100 {
        at = from + Vec3::new(0.0, 0.0, -1e-3 * f64::from(k) / 99.0);
        servo.settle(&patch, at, 1);
    }
    let down = servo.settle(&patch, at, 10).tools[0].tissue_force;
    for k in 0..200 {
        let across = at + Vec3::x() * (2e-3 * f64::from(k) / 199.0);
        servo.settle(&patch, across, 1);
    }
    let at = at + Vec3::x() * 2e-3;
    let dragged = servo.settle(&patch, at, 1).tools[0].tissue_force;
    let rested = servo.settle(&patch, at, 300).tools[0].tissue_force;
    assert!(down.x.abs() < 0.02 * down.z);
    assert!(dragged.x < -0.3 * dragged.z, "{dragged}");
    assert!(
        (rested - dragged).norm() < 0.01 * dragged.norm(),
        "{rested} {dragged}"
    );
}

/// A step looks ahead of the tool. A vertex that slid there slides here too; one that stuck is let go of on the way
/// back to the tool.
#[test]
fn a_patch_of_a_place_ahead_keeps_the_friction_of_what_slides() {
    const AHEAD: f64 = 1e-4;
    let (friction, push) = (0.4, 1.0);
    let bed = HalfSpace {
        spacing: 2e-3,
        compliance: 1e-3,
        friction,
        n: 1,
    };
    let own = bed.block(&Vec3::zeros(), &Vec3::zeros());
    let patch_of = |share: f64, id: u64| {
        let force = Vec3::new(share * friction * push, 0.0, -push);
        let (position, down) = (own * force, -Vec3::z());
        let centre = position - down * RADIUS;
        let mut patch = Box::new(ContactPatch::EMPTY);
        bed.fill(centre, id, &mut patch);
        let contact = &mut patch.contacts[0];
        (contact.position, contact.force) = (position, force);
        (contact.normal, contact.surface) = (down, down * RADIUS);
        contact.anchor = down * RADIUS;
        (patch, centre)
    };
    for (share, kept) in [(1.0, true), (0.5, false)] {
        let (patch, centre) = patch_of(share, 1);
        let here = centre - Vec3::x() * AHEAD;
        let mut servo = Loop::new(&ServoParams::default(), SPEC);
        servo.settle(&patch, here, 700);
        let (next, _) = patch_of(share, 10_000);
        servo.send(next);
        servo.tick(Some(here));
        let found = servo.tick(Some(here)).tools[0].tissue_force;
        let lost = if kept { 0.0 } else { AHEAD / own.m11 };
        let expected = share * friction * push - lost;
        println!("{share}: {found}, {expected} N of friction expected");
        assert!(
            (found.x + expected).abs() < 0.02 * friction,
            "{share}: {found}"
        );
        assert!((found.z - push).abs() < 0.02, "{share}: {found}");
    }
}

#[test]
fn the_world_may_be_turned() {
    let bed = HalfSpace {
        spacing: 1.2e-3,
        compliance: 4e-3,
        friction: 0.4,
        n: 36,
    };
    let mut patch = Box::new(ContactPatch::EMPTY);
    let from = Vec3::new(0.0, 0.0, RADIUS + 1e-5);
    let to = Vec3::new(5e-4, 2e-4, RADIUS - 1e-3);
    bed.fill(from, 1, &mut patch);
    let plain = (patch.clone(), from, to);
    let turn = Pose::new(Vec3::new(0.1, -0.2, 0.05), Vec3::new(0.7, -1.1, 0.4));
    let matrix = turn.rotation.to_rotation_matrix().into_inner();
    for i in 0..patch.n_contacts {
        let c = &mut patch.contacts[i];
        c.position = (turn * nalgebra::Point3::from(c.position)).coords;
        for j in 0..patch.n_contacts {
            let block = matrix * patch.block(i, j) * matrix.transpose();
            patch.set_block(i, j, &block);
        }
    }
    // The tool turns with the world: what is said in its own frame stays.
    let pose = |at: Vec3| turn * Pose::translation(at.x, at.y, at.z);
    let press = |patch: &ContactPatch, poses: [Pose; 2]| {
        let mut servo = Loop::new(&ServoParams::default(), SPEC);
        let mut report = palpa_servo::TickReport::ZERO;
        for k in 0..730 {
            if k % 5 == 0 {
                let mut patch = Box::new(patch.clone());
                patch.id = k + 1;
                servo.send(patch);
            }
            servo.now += 1e-3;
            let share = (k as f64 - 710.0).clamp(0.0, 10.0) / 10.0;
            let mut at = poses[0];
            at.translation.vector +=
                share * (poses[1].translation.vector - poses[0].translation.vector);
            let states = [Some(palpa_servo::DeviceState {
                time: servo.now,
                pose: at,
                velocity: Vec3::zeros(),
                buttons: 0,
            })];
            report = servo
                .servo
                .tick(servo.now, &states, &mut servo.mail, &mut servo.command);
            servo.mail.next = None;
        }
        report.tools[0].force
    };
    let still = |at: Vec3| Pose::translation(at.x, at.y, at.z);
    let straight = press(&plain.0, [still(plain.1), still(plain.2)]);
    let turned = press(&patch, [pose(from), pose(to)]);
    let error = (turn.rotation * straight - turned).norm() / straight.norm();
    assert!(
        straight.norm() > 0.5 && error < 1e-3,
        "{straight} {turned} {error:.1e}"
    );
}

#[test]
fn a_bonded_tool_pulls() {
    let bed = HalfSpace {
        spacing: 2e-3,
        compliance: 4e-3,
        friction: 0.0,
        n: 9,
    };
    let mut patch = Box::new(ContactPatch::EMPTY);
    let from = Vec3::new(0.0, 0.0, RADIUS);
    bed.fill(from, 1, &mut patch);
    patch.tools[0].is_bonded = true;
    let mut servo = Loop::new(&ServoParams::default(), SPEC);
    servo.settle(&patch, from, 700);
    let up = servo.settle(&patch, from + Vec3::z() * 1e-3, 1).tools[0].tissue_force;
    let down = servo.settle(&patch, from - Vec3::z() * 1e-3, 1).tools[0].tissue_force;
    assert!(up.z < -0.1, "{up}");
    assert!((up + down).norm() < 1e-3 * up.norm(), "{up} {down}");
    // Against the dense solution W r = −Z.
    let places = bed.places();
    let w = nalgebra::DMatrix::from_fn(27, 27, |i, j| {
        bed.block(&places[i / 3], &places[j / 3])[(i % 3, j % 3)]
    });
    let shift = nalgebra::DVector::from_fn(27, |i, _| if i % 3 == 2 { 1e-3 } else { 0.0 });
    let forces = w.lu().solve(&shift).expect("regular");
    let total: f64 = (0..9).map(|i| forces[3 * i + 2]).sum();
    assert!((up.z + total).abs() < 1e-3 * total, "{up} {total}");
}

#[test]
fn the_first_touch_is_as_stiff_as_the_tissue_or_the_device() {
    const MOST: f64 = 2000.0;
    let normal = Vec3::z();
    let along = |normal: f64| palpa_servo::Mat3::from_diagonal(&Vec3::new(0.0, 0.0, normal));
    let both = |normal: f64, tangential: f64| {
        palpa_servo::Mat3::from_diagonal(&Vec3::new(tangential, tangential, normal))
    };
    // Without friction the tissue sends the compliance along the normal only. Softer than the
    // device renders, a little stiffer, and much stiffer; with friction; and a normal that has
    // turned a little since the tissue's step.
    let tilted = Vec3::new(0.2, 0.0, 0.98).normalize();
    for (name, own, friction, stiffness) in [
        ("soft, frictionless", along(1e-3), 0.0, 1000.0_f64),
        ("firm, frictionless", along(4.5e-4), 0.0, 2222.0),
        ("bone, frictionless", along(1e-4), 0.0, 10_000.0),
        ("soft", both(1e-3, 1.5e-3), 0.4, 1000.0),
        ("firm", both(4e-4, 8e-4), 0.4, 2500.0),
        (
            "soft, turned",
            1e-3 * tilted * tilted.transpose(),
            0.0,
            1000.0,
        ),
    ] {
        let bed = HalfSpace {
            spacing: 2e-3,
            compliance: 1e-3,
            friction,
            n: 1,
        };
        let from = Vec3::new(0.0, 0.0, RADIUS + 1e-4);
        let mut patch = Box::new(ContactPatch::EMPTY);
        bed.fill(from, 1, &mut patch);
        patch.set_block(0, 0, &own);
        let spec = palpa_servo::DeviceSpec {
            max_stiffness: MOST,
            ..SPEC
        };
        let mut servo = Loop::new(&ServoParams::default(), spec);
        servo.settle(&patch, from, 700);
        let depth = 1e-4;
        let report = servo.tick(Some(Vec3::new(0.0, 0.0, RADIUS - depth)));
        let felt = report.tools[0].tissue_force.dot(&normal) / depth;
        let wanted = stiffness.min(MOST);
        println!("{name}: {felt:.0} N/m for {wanted:.0} N/m");
        // The contact itself is along the tool's normal, which is off by 11 degrees where it turned.
        let share = if name.contains("turned") { 0.06 } else { 0.01 };
        assert!((felt / wanted - 1.0).abs() < share, "{name}: {felt} N/m");
    }
}

#[test]
fn the_coupling_is_a_spring_in_series() {
    let bed = HalfSpace {
        spacing: 2e-3,
        compliance: 1e-4,
        friction: 0.0,
        n: 1,
    };
    let mut patch = Box::new(ContactPatch::EMPTY);
    let from = Vec3::new(0.0, 0.0, RADIUS + 1e-4);
    bed.fill(from, 1, &mut patch);
    patch.tools[0].stiffness[(2, 2)] = 1e4;
    let spec = palpa_servo::DeviceSpec {
        max_stiffness: 2000.0,
        ..SPEC
    };
    let mut servo = Loop::new(&ServoParams::default(), spec);
    servo.settle(&patch, from, 700);
    let report = servo.settle(&patch, Vec3::new(0.0, 0.0, RADIUS - 1e-3), 400);
    let tool = &report.tools[0];
    assert!((tool.force.z - 2.0).abs() < 0.02, "{tool:?}");
    assert!((tool.softening - 0.8).abs() < 0.01, "{tool:?}");
    assert!((tool.stretch.z - 0.8e-3).abs() < 1e-5, "{tool:?}");
    // A patch that says nothing leaves the tool at the device.
    patch.id = 9999;
    patch.contacts[0].position.x = f64::NAN;
    servo.send(patch);
    let report = servo.tick(Some(Vec3::new(0.0, 0.0, RADIUS - 1e-3)));
    assert_eq!(report.tools[0].stretch, Vec3::zeros());
}
