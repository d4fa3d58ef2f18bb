//! Laws that every shape keeps, and what each is by its own formula.

use nalgebra::{UnitQuaternion, Vector3};
use palpa_fem::Mat3;
use palpa_fem::shape::{
    Capsule, Cone, Ellipsoid, FlatPunch, Pose, RoundedBox, Shape, Sphere, Tool,
};
use palpa_mesh::Vec3;

/// A shape beside what decides, independently of it, which points are inside, and points all over
/// its surface.
struct Case {
    shape: Shape,
    is_inside: Box<dyn Fn(&Vec3) -> bool>,
    /// A surface point for any two numbers in 0..1.
    surface: Box<dyn Fn(f64, f64) -> Vec3>,
    /// Region borders: points on them, off the medial axis.
    borders: Vec<Vec3>,
    /// A length round which points are tried.
    size: f64,
}

fn sphere(r: f64) -> Case {
    Case {
        shape: Sphere::new(r).unwrap().into(),
        is_inside: Box::new(move |p| (p - Vec3::z() * r).norm() < r),
        surface: Box::new(move |a, b| (unit(a, b) + Vec3::z()) * r),
        borders: vec![],
        size: r,
    }
}

fn flat_punch(r: f64, e: f64) -> Case {
    let flat = r - e;
    let height = 2.0 * r;
    Case {
        shape: FlatPunch::new(r, e).unwrap().into(),
        is_inside: Box::new(move |p| {
            let from_axis = p.x.hypot(p.y);
            let is_in_cut_corner = from_axis > flat && p.z < e;
            p.z > 0.0
                && from_axis < r
                && (!is_in_cut_corner || (from_axis - flat).hypot(p.z - e) < e)
        }),
        surface: Box::new(move |a, b| {
            // Along the profile by its length: face, rim, side.
            let rim = std::f64::consts::FRAC_PI_2 * e;
            let s = a * (flat + rim + height);
            let (x, z) = if s < flat {
                (s, 0.0)
            } else if s < flat + rim {
                let angle = (s - flat) / e;
                (flat + e * angle.sin(), e - e * angle.cos())
            } else {
                (r, e + s - flat - rim)
            };
            let (sin, cos) = (std::f64::consts::TAU * b).sin_cos();
            Vec3::new(x * cos, x * sin, z)
        }),
        borders: vec![
            Vec3::new(flat, 0.0, -0.3 * r),
            Vec3::new(flat * 0.6, -flat * 0.8, 0.5 * e),
            Vec3::new(1.4 * r, 0.0, e),
            Vec3::new(0.0, r - 0.3 * e, e),
        ],
        size: r,
    }
}

fn capsule(r: f64, length: f64) -> Case {
    let half = 0.5 * length;
    Case {
        shape: Capsule::new(r, length).unwrap().into(),
        is_inside: Box::new(move |p| {
            let on_line = Vec3::new(p.x.clamp(-half, half), 0.0, r);
            (p - on_line).norm() < r
        }),
        surface: Box::new(move |a, b| {
            // A ball drawn apart, with part of the samples on the straight part.
            let straight = length / (length + 2.0 * r);
            if a < straight {
                let (sin, cos) = (std::f64::consts::TAU * b).sin_cos();
                Vec3::new(a / straight * length - half, r * sin, r + r * cos)
            } else {
                let u = unit((a - straight) / (1.0 - straight), b);
                Vec3::x() * half.copysign(u.x) + (u + Vec3::z()) * r
            }
        }),
        borders: vec![Vec3::new(half, r, -r), Vec3::new(-half, 0.3 * r, 0.5 * r)],
        size: half + r,
    }
}

fn rounded_box(half: Vec3, e: f64) -> Case {
    let core = half.add_scalar(-e);
    Case {
        shape: RoundedBox::new(half, e).unwrap().into(),
        is_inside: Box::new(move |p| {
            let p = p - Vec3::z() * half.z;
            let on_core = p.sup(&-core).inf(&core);
            p.abs().iter().zip(&half).all(|(p, h)| p < h)
                && (on_core == p || (p - on_core).norm() < e)
        }),
        surface: Box::new(move |a, b| {
            // The middle projected: a ball's directions onto the box of half extents, then pushed
            // onto the rounding.
            let u = unit(a, b).component_mul(&half);
            let on_box = u / u.component_div(&half).amax();
            let on_core = on_box.sup(&-core).inf(&core);
            let out = on_box - on_core;
            let p = if e == 0.0 {
                on_box
            } else {
                on_core + out.normalize() * e
            };
            p + Vec3::z() * half.z
        }),
        borders: vec![
            Vec3::new(core.x, 0.2 * core.y, -0.4 * e - 0.1 * half.z),
            Vec3::new(core.x, core.y, -0.2 * half.z),
            Vec3::new(core.x, 1.5 * half.y, 2.0 * half.z - e),
        ],
        size: half.max(),
    }
}

fn ellipsoid(radii: Vec3) -> Case {
    let middle = Vec3::z() * radii.z;
    Case {
        shape: Ellipsoid::new(radii).unwrap().into(),
        is_inside: Box::new(move |p| (p - middle).component_div(&radii).norm() < 1.0),
        surface: Box::new(move |a, b| unit(a, b).component_mul(&radii) + middle),
        borders: vec![],
        size: radii.max(),
    }
}

fn cone(r: f64, half_angle: f64, tip: f64, edge: f64) -> Case {
    let (sin, cos) = half_angle.sin_cos();
    // Where the flank leaves the tip and reaches the rim, in distance from the axis and height.
    let start = [tip * cos, tip * (1.0 - sin)];
    let end_out = r - edge + edge * cos;
    let end = [end_out, start[1] + (end_out - start[0]) * cos / sin];
    let rim_height = end[1] + edge * sin;
    let height = 1.5 * r;
    Case {
        shape: Cone::new(r, half_angle, tip, edge).unwrap().into(),
        is_inside: Box::new(move |p| {
            let out = p.x.hypot(p.y);
            let is_over_flank = p.z - start[1] > (out - start[0]) * cos / sin;
            let is_in_tip = out.hypot(p.z - tip) < tip || p.z >= start[1];
            let from_rim = [out - (r - edge), p.z - rim_height];
            let is_in_rim = from_rim[0] <= 0.0
                || p.z <= end[1]
                || from_rim[1] >= 0.0
                || from_rim[0].hypot(from_rim[1]) < edge;
            out < r && is_over_flank && is_in_tip && is_in_rim
        }),
        surface: Box::new(move |a, b| {
            // Along the profile by its length: tip, flank, rim, shaft.
            let arcs = [
                tip * (std::f64::consts::FRAC_PI_2 - half_angle),
                edge * half_angle,
            ];
            let flank = (end[0] - start[0]).hypot(end[1] - start[1]);
            let s = a * (arcs[0] + flank + arcs[1] + height);
            let (x, z) = if s < arcs[0] {
                let angle = s / tip;
                (tip * angle.sin(), tip - tip * angle.cos())
            } else if s < arcs[0] + flank {
                let share = (s - arcs[0]) / flank;
                (
                    start[0] + share * (end[0] - start[0]),
                    start[1] + share * (end[1] - start[1]),
                )
            } else if s < arcs[0] + flank + arcs[1] {
                // The angle of the normal over the flank's, up to the shaft's.
                let angle = half_angle - (s - arcs[0] - flank) / edge;
                (
                    r - edge + edge * angle.cos(),
                    rim_height - edge * angle.sin(),
                )
            } else {
                (r, rim_height + s - arcs[0] - flank - arcs[1])
            };
            let (sin, cos) = (std::f64::consts::TAU * b).sin_cos();
            Vec3::new(x * cos, x * sin, z)
        }),
        borders: vec![
            Vec3::new(start[0] + 0.3 * r * cos, 0.0, start[1] - 0.3 * r * sin),
            Vec3::new(0.0, end[0] + 0.2 * r * cos, end[1] - 0.2 * r * sin),
            Vec3::new(-1.3 * r, 0.0, rim_height),
        ],
        size: r,
    }
}

fn cases() -> Vec<Case> {
    vec![
        sphere(8e-3),
        flat_punch(10e-3, 1e-3),
        flat_punch(10e-3, 0.0),
        flat_punch(5e-3, 5e-3),
        flat_punch(0.2, 1e-4),
        capsule(4e-3, 20e-3),
        capsule(5e-3, 1e-5),
        capsule(1e-3, 1.0),
        rounded_box(Vec3::new(10e-3, 6e-3, 4e-3), 1e-3),
        rounded_box(Vec3::new(10e-3, 6e-3, 4e-3), 0.0),
        rounded_box(Vec3::new(5e-3, 5e-3, 5e-3), 5e-3),
        rounded_box(Vec3::new(0.5, 1e-3, 0.02), 2e-4),
        ellipsoid(Vec3::new(7e-3, 9e-3, 5e-3)),
        ellipsoid(Vec3::new(8e-3, 8e-3, 8e-3)),
        ellipsoid(Vec3::new(8e-3, 8e-3, 3e-3)),
        ellipsoid(Vec3::new(3e-3, 8e-3, 8e-3)),
        ellipsoid(Vec3::new(8e-3, 8e-3, 8e-3 * (1.0 + 1e-12))),
        ellipsoid(Vec3::new(0.5, 1e-2, 1e-3)),
        cone(8e-3, 0.8, 1e-3, 2e-3),
        cone(8e-3, 0.3, 2e-3, 5e-3),
        cone(10e-3, 1.3, 2e-5, 0.0),
        cone(5e-3, 0.6, 5e-3, 1e-3),
        cone(0.1, 1.2, 1e-4, 0.1),
    ]
}

/// Uniform numbers in 0..1, the same on every run.
struct Random(fastrand::Rng);

impl Random {
    fn new(seed: u64) -> Self {
        Self(fastrand::Rng::with_seed(seed))
    }

    fn number(&mut self) -> f64 {
        self.0.f64()
    }

    fn unit(&mut self) -> Vec3 {
        unit(self.number(), self.number())
    }
}

/// A point of the unit ball's surface, evenly spread over two numbers in 0..1.
fn unit(a: f64, b: f64) -> Vec3 {
    let z: f64 = 2.0 * a - 1.0;
    let (sin, cos) = (std::f64::consts::TAU * b).sin_cos();
    let r = (1.0 - z * z).max(0.0).sqrt();
    Vec3::new(r * cos, r * sin, z)
}

/// Points near the surface, at all distances outside, and inside.
fn points(case: &Case, n: usize) -> Vec<Vec3> {
    let mut random = Random::new(11);
    (0..n)
        .map(|i| {
            let on = (case.surface)(random.number(), random.number());
            match i % 3 {
                0 => on + random.unit() * (1e-3 * case.size * random.number()),
                1 => on + random.unit() * (3.0 * case.size * random.number()),
                _ => on.lerp(
                    &(case.surface)(random.number(), random.number()),
                    random.number(),
                ),
            }
        })
        .collect()
}

#[test]
fn the_sign_tells_inside_from_outside() {
    for case in cases() {
        let mut n_inside = 0;
        for p in points(&case, 900) {
            let d = case.shape.distance(&p).distance;
            if d.abs() > 1e-12 * case.size {
                assert_eq!(
                    d < 0.0,
                    (case.is_inside)(&p),
                    "{:?} at {p:?}: {d}",
                    case.shape
                );
                n_inside += usize::from(d < 0.0);
            }
        }
        assert!(n_inside > 150, "{:?}: {n_inside}", case.shape);
    }
}

#[test]
fn the_nearest_point_is_on_the_surface_and_none_is_nearer() {
    let mut random = Random::new(5);
    for case in cases() {
        let samples: Vec<Vec3> = (0..4000)
            .map(|_| (case.surface)(random.number(), random.number()))
            .collect();
        for s in &samples {
            let d = case.shape.distance(s).distance;
            assert!(
                d.abs() < 1e-14 * (1.0 + case.size),
                "{:?} at {s:?}: {d}",
                case.shape
            );
        }
        for p in points(&case, 300) {
            let found = case.shape.distance(&p);
            let foot = p - found.normal * found.distance;
            let left = case.shape.distance(&foot).distance;
            assert!(
                left.abs() < 1e-13 * case.size,
                "{:?} at {p:?}: {left} left of {found:?}",
                case.shape
            );
            for s in &samples {
                assert!(
                    (p - s).norm() > found.distance.abs() - 1e-13 * case.size,
                    "{:?} at {p:?}: {s:?} is nearer than {found:?}",
                    case.shape
                );
            }
        }
    }
}

/// A convex shape is what lies behind all its supporting planes: `d(p) = max u·p − h(u)`, outside
/// as inside.
#[test]
fn the_distance_is_that_of_the_furthest_supporting_plane() {
    let mut random = Random::new(3);
    for case in cases() {
        let tolerance = 1e-12 * case.size;
        let mut n_planes = 0;
        for p in points(&case, 300) {
            let found = case.shape.distance(&p);
            let beyond = |u: &Vec3| case.shape.support(u).map(|s| u.dot(&(p - s)));
            if let Some(of_nearest) = beyond(&found.normal) {
                n_planes += 1;
                assert!(
                    (of_nearest - found.distance).abs() < tolerance,
                    "{:?} at {p:?}: {of_nearest} {found:?}",
                    case.shape
                );
            }
            for _ in 0..30 {
                let u = random.unit();
                if let Some(d) = beyond(&u) {
                    assert!(
                        d < found.distance + tolerance,
                        "{:?} at {p:?} along {u:?}: {d} {found:?}",
                        case.shape
                    );
                }
            }
        }
        assert!(n_planes > 0, "{:?}", case.shape);
    }
}

#[test]
fn gradient_and_curvature_agree_with_finite_differences() {
    for case in cases() {
        let (mut n_gradients, mut n_curvatures) = (0, 0);
        let all = points(&case, 900);
        for p in &all {
            let found = case.shape.distance(p);
            assert!((found.normal.norm() - 1.0).abs() < 1e-14, "{found:?}");
            let largest = found.curvature.symmetric_eigenvalues().max();
            // Steps small beside the curvature radius there, and large beside rounding.
            let h = 1e-4 / (largest + 1.0 / case.size);
            let ends = Vec3::identity_axes()
                .map(|axis| [-1.0, 1.0].map(|side| case.shape.distance(&(p + axis * (side * h)))));
            let is_smooth = ends
                .iter()
                .flatten()
                .all(|end| (end.normal - found.normal).norm() < 1e-3);
            if !is_smooth {
                continue; // the medial axis passes between
            }
            n_gradients += 1;
            let gradient = Vec3::from(ends.map(|[a, b]| (b.distance - a.distance) / (2.0 * h)));
            assert!(
                (gradient - found.normal).norm() < 1e-6,
                "{:?} at {p:?}: {gradient:?} {found:?}",
                case.shape
            );
            let is_one_region = ends
                .iter()
                .flatten()
                .all(|end| (end.curvature - found.curvature).norm() <= 1e-2 * largest);
            let is_exact = found.distance > 0.0;
            if is_one_region && is_exact {
                n_curvatures += 1;
                let columns = ends.map(|[a, b]| (b.normal - a.normal) / (2.0 * h));
                let curvature = Mat3::from_columns(&columns);
                assert!(
                    (curvature - found.curvature).norm() <= 1e-5 * (largest + 1e-3 / case.size),
                    "{:?} at {p:?}: {curvature} {found:?}",
                    case.shape
                );
            }
        }
        assert!(
            n_gradients > 800 && n_curvatures > 300,
            "{:?}: {n_gradients} {n_curvatures}",
            case.shape
        );
    }
}

trait Axes {
    fn identity_axes() -> [Vec3; 3];
}

impl Axes for Vec3 {
    fn identity_axes() -> [Vec3; 3] {
        [Vec3::x(), Vec3::y(), Vec3::z()]
    }
}

#[test]
fn the_curvature_is_exact_to_half_the_radius_inside_and_bounded_below() {
    for case in cases() {
        for p in points(&case, 900) {
            let found = case.shape.distance(&p);
            let h = found.curvature;
            let largest = h.symmetric_eigenvalues();
            assert!((h - h.transpose()).norm() <= 1e-12 * h.norm());
            assert!(largest.min() >= -1e-12 * h.norm(), "{found:?}");
            assert!((h * found.normal).norm() <= 1e-12 * h.norm(), "{found:?}");
            assert!(h.iter().all(|x| x.is_finite()), "{found:?}");
        }
    }
    let ball = Shape::from(Sphere::new(2e-3).unwrap());
    for (depth, radius) in [
        (0.5e-3, 1.5e-3),
        (0.999e-3, 1.001e-3),
        (1.5e-3, 1e-3),
        (2e-3, 1e-3),
    ] {
        let found = ball.distance(&Vec3::new(0.0, 0.0, depth));
        assert!((found.distance + depth).abs() < 1e-18);
        assert!(
            (found.curvature[(0, 0)] - 1.0 / radius).abs() < 1e-9,
            "{found:?}"
        );
    }
}

#[test]
fn nothing_jumps_at_the_borders_of_regions() {
    let nudge = 1e-12;
    let mut n_borders = 0;
    for case in cases() {
        let mut tried = case.borders.clone();
        tried.retain(|p| {
            let d = case.shape.distance(p);
            d.distance.abs() > 1e-6 * case.size // sharp edges themselves have no normal
        });
        for p in tried {
            n_borders += 1;
            let here = case.shape.distance(&p);
            for axis in Vec3::identity_axes() {
                for side in [-1.0, 1.0] {
                    let beside = case.shape.distance(&(p + axis * (side * nudge)));
                    assert!((beside.distance - here.distance).abs() <= 1.01 * nudge);
                    assert!(
                        (beside.normal - here.normal).norm() <= 1e-6,
                        "{:?} at {p:?}: {here:?} {beside:?}",
                        case.shape
                    );
                }
            }
        }
    }
    assert!(n_borders > 20, "{n_borders}");
}

#[test]
fn the_tip_touches_first_at_the_origin() {
    for case in cases() {
        let at_tip = case.shape.distance(&Vec3::zeros());
        assert!(
            at_tip.distance.abs() < 1e-15 + 1e-15 * case.size,
            "{at_tip:?}"
        );
        assert!((at_tip.normal + Vec3::z()).norm() < 1e-12, "{at_tip:?}");
        let lowest = case.shape.support(&-Vec3::z()).unwrap();
        assert!(lowest.z.abs() < 1e-15 + 1e-15 * case.size, "{lowest:?}");
        // The radius of the tip against the curvature there, just outside the surface.
        let r = case.shape.tip_radius();
        let least = case
            .shape
            .distance(&(-Vec3::z() * 1e-9 * case.size))
            .curvature;
        let smallest = least.fixed_view::<2, 2>(0, 0).symmetric_eigenvalues().min();
        if r.is_finite() {
            assert!(
                (smallest * r - 1.0).abs() < 1e-4,
                "{:?}: {smallest} {r}",
                case.shape
            );
        } else {
            assert_eq!(smallest, 0.0, "{:?}", case.shape);
        }
    }
}

#[test]
fn bounds_hold_the_whole_surface() {
    let mut random = Random::new(23);
    for case in cases() {
        let (ball, shadow) = (case.shape.bounding_radius(), case.shape.footprint_radius());
        let (mut far, mut wide) = (0.0_f64, 0.0_f64);
        for _ in 0..5000 {
            let p = (case.surface)(random.number(), random.number());
            far = far.max(p.norm());
            wide = wide.max(p.xy().norm());
        }
        assert!(
            far <= ball * (1.0 + 1e-12) && wide <= shadow * (1.0 + 1e-12),
            "{:?}",
            case.shape
        );
        assert!(wide > 0.9 * shadow, "{:?}: {wide} {shadow}", case.shape);
    }
}

#[test]
fn points_deep_inside_are_pushed_out_somewhere() {
    for case in cases() {
        let (shape, size) = (case.shape, case.size);
        for i in 0..200 {
            for p in [
                Vec3::z() * (0.02 * f64::from(i) * size),
                Vec3::new(1e-320, -0.0, 0.01 * f64::from(i) * size),
                Vec3::new(1e-9 * size * f64::from(i), 0.0, size),
            ] {
                let found = shape.distance(&p);
                assert!(
                    (found.normal.norm() - 1.0).abs() < 1e-12,
                    "{shape:?} {p:?}: {found:?}"
                );
                assert!(found.distance.is_finite() && found.curvature.norm().is_finite());
                let left = shape
                    .distance(&(p - found.normal * found.distance))
                    .distance;
                assert!(
                    left.abs() < 1e-12 * size,
                    "{shape:?} {p:?}: {left} {found:?}"
                );
            }
        }
    }
    // Equally near to many points: toward the side that presses.
    for (shape, middle) in [
        (Shape::from(Sphere::new(1e-2).unwrap()), 1e-2),
        (FlatPunch::new(1e-2, 1e-3).unwrap().into(), 1e-2),
        (Capsule::new(1e-2, 1e-2).unwrap().into(), 1e-2),
        (
            RoundedBox::new(Vec3::new(1e-2, 1e-2, 1e-2), 0.0)
                .unwrap()
                .into(),
            1e-2,
        ),
        (
            Ellipsoid::new(Vec3::new(3e-2, 2e-2, 1e-2)).unwrap().into(),
            1e-2,
        ),
        (
            Ellipsoid::new(Vec3::new(1e-2, 1e-2, 1e-2)).unwrap().into(),
            1e-2,
        ),
    ] {
        let found = shape.distance(&(Vec3::z() * middle));
        assert!(
            (found.normal + Vec3::z()).norm() < 1e-12,
            "{shape:?}: {found:?}"
        );
        assert!(
            (found.distance + middle).abs() < 1e-15,
            "{shape:?}: {found:?}"
        );
    }
}

/// On an axis of revolution the nearest point has a closed form, down to the middle of the extreme
/// shapes.
#[test]
fn the_ellipsoid_is_exact_on_its_axes_at_any_aspect_ratio() {
    for aspect in [1.0, 1.5, 30.0, 1e3, 1e5, 1e7] {
        let (long, short) = (10.0, 10.0 / aspect);
        let shape =
            Shape::from(Ellipsoid::new(Vec3::new(long, 0.5 * (long + short), short)).unwrap());
        let middle = Vec3::z() * short;
        for share in [0.0, 1e-9, 0.3, 0.999, 1.0, 1.001, 5.0] {
            // Along the shortest axis the pole of that axis is nearest.
            let found = shape.distance(&(middle - Vec3::z() * (share * short)));
            assert!(
                (found.distance - (share - 1.0) * short).abs() < 1e-14 * long,
                "{aspect} {share}: {found:?}"
            );
            // Along the longest, the pole only from the evolute's cusp on, at (a² − c²)/a.
            let x = share * long;
            let c_sq = long * long - short * short;
            let expected = if x >= c_sq / long {
                x - long
            } else {
                -short * (1.0 - x * x / c_sq).max(0.0).sqrt()
            };
            let found = shape.distance(&(middle + Vec3::x() * x));
            assert!(
                (found.distance - expected).abs() < 1e-14 * long,
                "{aspect} {share}: {expected} {found:?}"
            );
        }
    }
}

#[test]
fn a_tool_moves_rigidly() {
    let mut random = Random::new(77);
    let tool = Tool::new(Ellipsoid::new(Vec3::new(7e-3, 9e-3, 5e-3)).unwrap(), 0.3).unwrap();
    assert_eq!(tool.friction(), 0.3);
    for _ in 0..50 {
        let turn = UnitQuaternion::from_scaled_axis(random.unit() * 3.0);
        let pose = Pose::from_parts((random.unit() * 0.3).into(), turn);
        let p = random.unit() * (0.02 * random.number());
        let (local, world) = (
            tool.shape().distance(&p),
            tool.distance_at(&pose, &(turn * p + pose.translation.vector)),
        );
        assert!((local.distance - world.distance).abs() < 1e-15);
        assert!((turn * local.normal - world.normal).norm() < 1e-12);
        let across = turn * Vector3::new(0.3, -0.2, 0.5);
        let back = turn * (local.curvature * Vector3::new(0.3, -0.2, 0.5));
        assert!((world.curvature * across - back).norm() < 1e-9 * world.curvature.norm());
    }
}

#[test]
fn sizes_that_no_shape_has_are_refused() {
    let messages: Vec<String> = [
        Sphere::new(0.0).unwrap_err(),
        Sphere::new(f64::NAN).unwrap_err(),
        Capsule::new(1e-3, -1.0).unwrap_err(),
        FlatPunch::new(1e-2, 2e-2).unwrap_err(),
        FlatPunch::new(f64::INFINITY, 0.0).unwrap_err(),
        Cone::new(1e-2, 0.5, 2e-2, 0.0).unwrap_err(),
        Cone::new(1e-2, 1.6, 1e-3, 0.0).unwrap_err(),
        RoundedBox::new(Vec3::new(1e-2, 1e-2, 1e-9), 0.0).unwrap_err(),
        RoundedBox::new(Vec3::new(1e-2, 5e-3, 1e-2), -1e-3).unwrap_err(),
        Ellipsoid::new(Vec3::new(1e-2, 11.0, 1e-2)).unwrap_err(),
        Tool::new(Sphere::new(1.0).unwrap(), -0.1).unwrap_err(),
    ]
    .map(|e| e.to_string())
    .into();
    assert_eq!(
        messages,
        [
            "sphere: the radius is 0 m, outside 0.000001 to 10 m; give a positive length in metres",
            "sphere: the radius is NaN m, outside 0.000001 to 10 m; give a positive length in metres",
            "capsule: the length is -1 m, outside 0.000001 to 10 m; give a positive length in metres",
            "flat punch: an edge radius of 0.02 m does not fit; give 0 (sharp) to 0.01 m, which rounds it completely",
            "flat punch: the radius is inf m, outside 0.000001 to 10 m; give a positive length in metres",
            "cone: an edge radius of 0.02 m does not fit; give 0 (sharp) to 0.01 m, which rounds it completely",
            "cone: a half angle of 1.6 rad is outside 0.05 to 1.55 rad; give the angle between flank and axis",
            "box: the half height is 0.000000001 m, outside 0.000001 to 10 m; give a positive length in metres",
            "box: an edge radius of -0.001 m does not fit; give 0 (sharp) to 0.005 m, which rounds it completely",
            "ellipsoid: the radius along y is 11 m, outside 0.000001 to 10 m; give a positive length in metres",
            "a friction coefficient of -0.1 is not possible; give 0 (slippery) or more",
        ]
    );
}
