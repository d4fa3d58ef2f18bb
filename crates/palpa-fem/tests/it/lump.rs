//! Lumps: which tissue is where.

use nalgebra::UnitQuaternion;
use palpa_fem::lump::{ClosedMesh, Lump, LumpError, LumpShape};
use palpa_fem::shape::{Capsule, Ellipsoid, Pose, Sphere};
use palpa_mesh::{Surface, Vec3, generate};

/// A pose that turns and shifts, so that a frame mixed up shows.
fn pose() -> Pose {
    Pose::from_parts(
        Vec3::new(0.12, -0.03, 0.05).into(),
        UnitQuaternion::from_scaled_axis(Vec3::new(0.4, -1.1, 0.7)),
    )
}

fn shapes() -> Vec<LumpShape> {
    vec![
        LumpShape::Sphere(Sphere::new(6e-3).unwrap()),
        LumpShape::Ellipsoid(Ellipsoid::new(Vec3::new(9e-3, 6e-3, 4e-3)).unwrap()),
        LumpShape::Capsule(Capsule::new(4e-3, 12e-3).unwrap()),
        LumpShape::Mesh(ClosedMesh::new(&bone()).unwrap()),
    ]
}

/// A closed surface that is not in the middle of its own coordinates.
fn bone() -> Surface {
    let (_, mut bone) = generate::cylinder(0.02, 0.02, 5e-3, 1e-3);
    for p in &mut bone.points {
        *p += Vec3::new(0.3, 0.0, -0.1);
    }
    bone
}

/// A box by its corners, each face of two triangles.
fn block(size: Vec3) -> Surface {
    let points = (0..8)
        .map(|i| Vec3::from_fn(|k, _| f64::from((i >> k) & 1) * size[k]))
        .collect();
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let triangles = quads
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    Surface { points, triangles }
}

/// Halton points of the ball that bounds a lump, as integration points.
fn points_in_bounds(lump: &Lump, n: u32) -> Vec<Vec3> {
    let (middle, radius) = lump.bounding_sphere();
    let halton = |mut i: u32, base: u32| {
        let (mut f, mut x) = (1.0, 0.0);
        while i > 0 {
            f /= f64::from(base);
            x += f * f64::from(i % base);
            i /= base;
        }
        2.0 * x - 1.0
    };
    (1..=n)
        .map(|i| middle + Vec3::new(halton(i, 2), halton(i, 3), halton(i, 5)) * radius)
        .collect()
}

#[test]
fn the_fractions_of_a_sharp_lump_sum_to_its_volume() {
    for shape in shapes() {
        let lump = Lump::new(shape, pose(), 0.0, 3).unwrap();
        let n = 40_000;
        let inside: f64 = points_in_bounds(&lump, n)
            .iter()
            .map(|p| lump.fraction(p))
            .sum();
        let cube = (2.0 * lump.bounding_sphere().1).powi(3);
        let volume = cube * inside / f64::from(n);
        assert!(
            (volume / lump.volume() - 1.0).abs() < 0.01,
            "{:?}: {volume} for {}",
            lump.shape(),
            lump.volume()
        );
        assert_eq!(lump.material(), 3);
    }
}

#[test]
fn the_transition_is_smooth_and_centred_on_the_surface() {
    let width = 2e-3;
    for shape in shapes() {
        let lump = Lump::new(shape, pose(), width, 0).unwrap();
        let mut n_between = 0;
        for p in points_in_bounds(&lump, 3000) {
            let (d, fraction) = (lump.signed_distance(&p), lump.fraction(&p));
            if d <= -0.5 * width {
                assert_eq!(fraction, 1.0);
            } else if d >= 0.5 * width {
                assert_eq!(fraction, 0.0);
            } else {
                n_between += 1;
                let t = 0.5 - d / width;
                assert!((fraction - (3.0 * t * t - 2.0 * t * t * t)).abs() < 1e-12);
                assert_eq!(fraction > 0.5, d < 0.0);
            }
        }
        assert!(n_between > 100, "{:?}: {n_between}", lump.shape());
        let far = lump.bounding_sphere().0 + Vec3::x();
        assert_eq!(lump.fraction(&far), 0.0);
    }
}

/// Distance and volume of a box are known, whichever way its triangles face.
#[test]
fn a_mesh_knows_its_inside_whichever_way_it_faces() {
    let size = Vec3::new(6e-3, 10e-3, 4e-3);
    let mut inside_out = block(size);
    for triangle in &mut inside_out.triangles {
        triangle.reverse();
    }
    for surface in [block(size), inside_out] {
        let mesh = ClosedMesh::new(&surface).unwrap();
        assert!((mesh.centroid() - 0.5 * size).norm() < 1e-15);
        let back = Pose::from_parts(mesh.centroid().into(), UnitQuaternion::identity());
        let lump = Lump::new(LumpShape::Mesh(mesh), back, 0.0, 1).unwrap();
        assert!((lump.volume() / size.product() - 1.0).abs() < 1e-12);
        for p in points_in_bounds(&lump, 2000) {
            let q = (p - 0.5 * size).abs() - 0.5 * size;
            let exact = q.sup(&Vec3::zeros()).norm() + q.max().min(0.0);
            assert!((lump.signed_distance(&p) - exact).abs() < 1e-15, "{p:?}");
        }
    }
}

#[test]
fn surfaces_without_an_inside_and_impossible_borders_are_refused() {
    let whole = block(Vec3::new(6e-3, 10e-3, 4e-3));
    let mut open = whole.clone();
    open.triangles.remove(0);
    let mut twisted = whole.clone();
    twisted.triangles[3].reverse();
    let mut flat = whole.clone();
    for p in &mut flat.points {
        p.z = 0.0;
    }
    let mut broken = whole;
    broken.points[5].y = f64::NAN;
    let ball = |radius| LumpShape::Sphere(Sphere::new(radius).unwrap());
    let messages: Vec<String> = [
        ClosedMesh::new(&open).unwrap_err(),
        ClosedMesh::new(&twisted).unwrap_err(),
        ClosedMesh::new(&flat).unwrap_err(),
        ClosedMesh::new(&Surface::default()).unwrap_err(),
        ClosedMesh::new(&broken).unwrap_err(),
        Lump::new(ball(3e-3), pose(), 7e-3, 0).unwrap_err(),
        Lump::new(ball(3e-3), pose(), f64::NAN, 0).unwrap_err(),
    ]
    .map(|e: LumpError| e.to_string())
    .into();
    assert_eq!(
        messages,
        [
            "lump: the surface is open: 3 edges have one triangle only, the first at (0.003000, 0.005000, 0.000000) m; \
             close its holes, or join equal points if it was never joined",
            "lump: the triangles at the edge at (0.000000, 0.005000, 0.004000) m do not agree on which side is outside, \
             or are more than two; orient and repair the surface",
            "lump: the surface has 12 triangles and encloses no volume; give a closed surface",
            "lump: the surface has 0 triangles and encloses no volume; give a closed surface",
            "lump: point 5 of the surface is not finite; mend the file",
            "lump: a transition of 0.007 m is not possible; give 0 (sharp) to 0.006 m, the width of the lump",
            "lump: a transition of NaN m is not possible; give 0 (sharp) to 0.006 m, the width of the lump",
        ]
    );
}
