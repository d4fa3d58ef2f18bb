//! Vertices moved along the skin: one is exactly at the point, the body stays sound, and the mesh
//! around it keeps its shape.

use palpa_mesh::generate::{block_skin, cylinder, forearm};
use palpa_mesh::refine::{RefineParams, Refined, Slide, near_points, refine, slide_vertices};
use palpa_mesh::{LayeredBody, SurfaceIndex, Vec3};

use crate::refine::{flat, grown};
use crate::sound::{assert_sound, smallest_angle, volume};

const RADIUS: f64 = 6e-3;

fn fine(body: &LayeredBody, at: Vec3) -> LayeredBody {
    let wish = near_points(&[at], RADIUS, 2.8e-3, 0.3);
    refine(body, &RefineParams::default(), wish).body
}

fn nearest(body: &LayeredBody, point: Vec3) -> u32 {
    let distance = |v: &u32| (body.skin.points[*v as usize] - point).norm();
    (0..body.n_vertices() as u32)
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
        .unwrap()
}

fn slid(body: &LayeredBody, to: Vec3) -> Option<Refined> {
    let vertex = nearest(body, to);
    let radius = RADIUS;
    slide_vertices(body, &Slide { vertex, to, radius })
}

#[test]
fn on_a_plane_the_mesh_under_the_tool_is_shifted_as_it_is() {
    let coarse = flat(&block_skin([0.1, 0.1], 8e-3));
    for to in [[0.001, 0.002], [0.0191, 0.0077], [-0.012, 0.0215]] {
        let to = Vec3::new(to[0], to[1], 0.0);
        let body = fine(&coarse, to);
        let vertex = nearest(&body, to);
        let way = to - body.skin.points[vertex as usize];
        let slid = slid(&body, to).unwrap();
        assert_sound(&slid.body);
        assert_eq!(slid.n_invalid, 0);
        for (v, p) in body.skin.points.iter().enumerate() {
            let moved = slid.body.skin.points[v] - p;
            assert!(moved.norm() < way.norm() + 1e-12);
            let distance = (p - to).norm();
            let share = moved.norm() / way.norm();
            if distance < RADIUS {
                assert!((moved - way).norm() < 1e-12, "{moved:?}");
            } else if distance > RADIUS + 8.1 * way.norm() {
                assert!(moved.norm() < 1e-15, "{share} at {distance} m");
            }
        }
        assert!((volume(&slid.body) / volume(&body) - 1.0).abs() < 1e-12);
        assert!(smallest_angle(&slid.body.skin) > 0.8 * smallest_angle(&body.skin));
        assert_eq!(slid.body.cut_faces, body.cut_faces);
    }
}

#[test]
fn on_limbs_a_vertex_comes_to_the_point_and_the_body_stays_sound() {
    let (skin, bone) = cylinder(0.12, 0.04, 0.012, 8e-3);
    let (arm, bones) = forearm(14e-3, 1.0);
    let mut rng = fastrand::Rng::with_seed(3);
    for body in [grown(&skin, &[bone]), grown(&arm, &bones)] {
        let index = SurfaceIndex::build(&body.skin);
        for _ in 0..6 {
            let t = rng.usize(0..body.skin.triangles.len());
            let [a, b, c] = body.skin.corners(t);
            let (u, v) = (rng.f64(), rng.f64());
            let (u, v) = if u + v > 1.0 {
                (1.0 - u, 1.0 - v)
            } else {
                (u, v)
            };
            let to = a + (b - a) * u + (c - a) * v;
            let body = fine(&body, to);
            let vertex = nearest(&body, to) as usize;
            let Some(slid) = slid(&body, to) else {
                // Beside the rim.
                let rim = body.skin.boundary_loops();
                let from_rim = (rim.iter().flatten())
                    .map(|&v| (body.skin.points[v as usize] - to).norm())
                    .fold(f64::INFINITY, f64::min);
                assert!(from_rim < 5e-3, "{from_rim} m from the rim");
                continue;
            };
            assert_sound(&slid.body);
            assert!((slid.body.skin.points[vertex] - to).norm() < 1e-12);
            // Vertices stay on the skin, and every column is the mean of columns.
            for (v, p) in slid.body.skin.points.iter().enumerate() {
                assert!(index.closest(*p).unwrap().signed_distance.abs() < 1e-9);
                let sum: f64 = slid.origins.of(v).iter().map(|(_, weight)| weight).sum();
                assert!((sum - 1.0).abs() < 1e-12);
            }
            assert!((volume(&slid.body) / volume(&body) - 1.0).abs() < 1e-3);
            assert!(smallest_angle(&slid.body.skin) > 0.5 * smallest_angle(&body.skin));
        }
    }
}

#[test]
fn nothing_moves_at_a_vertex_or_beside_the_rim() {
    let body = flat(&block_skin([0.1, 0.1], 5e-3));
    assert!(slid(&body, Vec3::new(0.01, 0.015, 0.0)).is_none());
    for x in [0.05, 0.0499, 0.047] {
        let to = Vec3::new(x, 0.0013, 0.0);
        if let Some(slid) = slid(&body, to) {
            assert_sound(&slid.body);
        }
    }
    assert!(slid(&body, Vec3::new(0.05, 0.0013, 0.0)).is_none());
    assert!(slid(&body, Vec3::new(0.0499, 0.0013, 0.0)).is_none());
}
