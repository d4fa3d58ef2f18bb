//! Coarsening: what a coarse skin keeps of the given one.

use palpa_mesh::check_surface;
use palpa_mesh::coarsen::{CoarsenLimits, Coarsened, coarsen};
use palpa_mesh::generate::{block_skin, cylinder, forearm};
use palpa_mesh::growth::Thickness;
use palpa_mesh::{Coarsening, Growth, GrowthParams, LayerSpec, Surface, SurfaceIndex, Vec3, grow};
use proptest::prelude::*;

use crate::shapes::icosphere;

/// Coarsens to edges of `longest` and a distance of `tolerance`, m, with some vertices that stay.
fn coarse(skin: &Surface, kept: &[usize], tolerance: f64, longest: f64) -> Coarsened {
    let mut is_kept = vec![false; skin.points.len()];
    for &v in kept {
        is_kept[v] = true;
    }
    let limits = CoarsenLimits {
        is_kept: &is_kept,
        tolerance: &vec![tolerance; skin.points.len()],
        longest: |_: &[Vec3; 3]| longest,
    };
    coarsen(skin, &limits)
}

/// Largest distance of the vertices, middles of edges and centres of triangles of one surface from
/// another, m.
fn distance(from: &Surface, to: &Surface) -> f64 {
    let index = SurfaceIndex::build(to);
    let corners = (0..from.triangles.len()).map(|t| from.corners(t));
    let places = corners.flat_map(|[a, b, c]| {
        let middles = [a + b, b + c, c + a].map(|sum| sum / 2.0);
        [a, b, c, (a + b + c) / 3.0].into_iter().chain(middles)
    });
    let far = |p: Vec3| index.closest(p).unwrap().signed_distance.abs();
    places.map(far).fold(0.0, f64::max)
}

/// What holds for every coarse skin.
fn assert_sound(skin: &Surface, coarse: &Coarsened, tolerance: f64, longest: f64) {
    let surface = &coarse.surface;
    let places = coarse.given.iter().map(|&v| skin.points[v as usize]);
    assert!(places.eq(surface.points.iter().copied()));
    assert!(coarse.deviation <= tolerance);
    assert!(distance(skin, surface) <= tolerance * (1.0 + 1e-9));
    // Between its vertices, which are given, the coarse skin is as near.
    assert!(distance(surface, skin) <= 1.5 * tolerance + 1e-12);
    let (report, of_skin) = (check_surface(surface), check_surface(skin));
    assert_eq!(report.n_nonmanifold_edges, 0);
    assert_eq!(
        [report.n_parts, report.n_loops],
        [of_skin.n_parts, of_skin.n_loops]
    );
    let euler = |s: &Surface| s.points.len() + s.triangles.len() - s.edges().len();
    assert_eq!(euler(surface), euler(skin));
    // No triangle is turned against the given skin at its centre.
    let index = SurfaceIndex::build(skin);
    for t in 0..surface.triangles.len() {
        let corners = surface.corners(t);
        let below = index.closest(corners.iter().sum::<Vec3>() / 3.0).unwrap();
        let given = skin.area_vector(below.triangle as usize);
        assert!(surface.area_vector(t).dot(&given) > 0.0, "triangle {t}");
        let edges = [(0, 1), (1, 2), (2, 0)].map(|(a, b)| (corners[a] - corners[b]).norm());
        let before = skin.mean_edge_length() * 2.0;
        assert!(edges.iter().all(|edge| *edge <= longest.max(before)));
    }
}

#[test]
fn a_closed_skin_stays_closed_and_near() {
    let sphere = icosphere(4).scaled(0.05);
    let coarse = coarse(&sphere, &[], 0.3e-3, f64::INFINITY);
    assert_sound(&sphere, &coarse, 0.3e-3, f64::INFINITY);
    assert_eq!(check_surface(&coarse.surface).n_boundary_edges, 0);
    // Chords of 11 mm lie 0.3 mm below a sphere of 50 mm.
    let n = coarse.surface.points.len();
    assert!((300..900).contains(&n), "{n} of {}", sphere.points.len());
    assert!(coarse.deviation > 0.1e-3, "{}", coarse.deviation);
}

#[test]
fn a_flat_skin_keeps_its_rim_and_its_corners() {
    let skin = block_skin([0.1, 0.06], 2e-3);
    let coarse = coarse(&skin, &[], 1e-6, 25e-3);
    assert_sound(&skin, &coarse, 1e-6, 25e-3);
    let area = |s: &Surface| {
        (0..s.triangles.len())
            .map(|t| s.area_vector(t).norm())
            .sum::<f64>()
    };
    assert!((area(&coarse.surface) - 6e-3).abs() < 1e-12);
    assert_eq!(coarse.surface.bounds(), skin.bounds());
    let n = coarse.surface.points.len();
    assert!(n < 80, "{n} of {}", skin.points.len());
}

#[test]
fn the_rims_of_a_limb_stay_in_their_planes() {
    let (skin, _) = cylinder(0.2, 0.04, 0.01, 3e-3);
    let coarse = coarse(&skin, &[], 0.4e-3, f64::INFINITY);
    assert_sound(&skin, &coarse, 0.4e-3, f64::INFINITY);
    let rims = coarse.surface.boundary_loops();
    assert_eq!(rims.len(), 2);
    for rim in rims {
        let x = coarse.surface.points[rim[0] as usize].x;
        let is_flat = |v: &u32| (coarse.surface.points[*v as usize].x - x).abs() < 1e-12;
        assert!(
            rim.iter().all(is_flat) && rim.len() >= 8,
            "{} vertices",
            rim.len()
        );
    }
}

#[test]
fn a_skin_as_coarse_as_wanted_stays_as_it_is() {
    let (skin, _) = forearm(8e-3, 1.0);
    let same = coarse(&skin, &[], 1e-3, 5e-3);
    assert_eq!(same.surface, skin);
    assert!(same.deviation <= 0.0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(palpa_testkit::cases(24)))]

    /// Bumpy spheres, with vertices that stay; twice the same.
    #[test]
    fn kept_vertices_stay_and_results_are_the_same_again(
        bumps in 0.0..0.08_f64,
        waves in 1.0..5.0_f64,
        tolerance in 0.05e-3..1e-3_f64,
        longest in 5e-3..40e-3_f64,
        kept in prop::collection::vec(0..642_usize, 0..40),
    ) {
        let mut skin = icosphere(3).scaled(0.04);
        for p in &mut skin.points {
            *p *= 1.0 + bumps * (waves * p.x / 0.02).sin() * (waves * p.y / 0.02).cos();
        }
        let once = coarse(&skin, &kept, tolerance, longest);
        assert_sound(&skin, &once, tolerance, longest);
        for v in kept.iter().map(|&v| v as u32) {
            prop_assert!(once.given.binary_search(&v).is_ok());
        }
        prop_assert_eq!(coarse(&skin, &kept, tolerance, longest), once);
    }
}

/// A limb whose skin is fine round one place.
fn grown(coarsening: Option<Coarsening>) -> Growth {
    let (skin, bone) = cylinder(0.2, 0.04, 0.01, 3e-3);
    let layer = |name: &str, thickness| LayerSpec {
        name: name.to_owned(),
        thickness,
        n_levels: 1,
        min_thickness: 1e-4,
    };
    // The fat gets thicker along the limb.
    let fat = Thickness::AlongAxis {
        axis: Vec3::x(),
        table: vec![[0.0, 3e-3], [0.2, 9e-3]],
    };
    let params = GrowthParams {
        layers: vec![layer("fat", Some(fat)), layer("muscle", None)],
        cut_out: None,
        coarsening,
        max_nodes: palpa_mesh::growth::MAX_NODES,
    };
    grow(&skin, &[bone], &params).unwrap()
}

fn away_from(place: Vec3) -> Coarsening {
    Coarsening {
        fine: vec![place],
        radius: 15e-3,
        edge: 3e-3,
        growth: 1.2,
        deviation: 0.05e-3,
        deviation_growth: 0.03,
        most_deviation: 0.5e-3,
        thickness_share: 0.02,
        kept: vec![place],
    }
}

#[test]
fn a_body_grows_from_the_coarse_skin_with_the_layers_of_the_given_one() {
    let place = Vec3::new(0.1, 0.0, 0.04);
    let (given, coarse) = (grown(None), grown(Some(away_from(place))));
    assert_eq!(given.coarsened, None);
    let report = coarse.coarsened.unwrap();
    let (all, body) = (&given.body, &coarse.body);
    assert_eq!(
        [report.n_given, report.n_vertices],
        [all.n_vertices(), body.n_vertices()]
    );
    assert!(report.n_vertices < report.n_given / 3, "{report:?}");
    assert!(report.deviation <= 0.5e-3 && report.deviation > 0.0);
    // The skin near the place is the given one, and the cut faces are where they were.
    let near = |s: &Surface| {
        let near = s.points.iter().filter(|p| (*p - place).norm() < 13e-3);
        near.copied().collect::<Vec<_>>()
    };
    assert_eq!(near(&body.skin), near(&all.skin));
    assert_eq!(body.cut_faces.len(), 2);
    for (a, b) in body.cut_faces.iter().zip(&all.cut_faces) {
        assert!(a.is_flat && b.is_flat && a.normal.dot(&b.normal) > 0.999);
        assert!((a.point - b.point).dot(&b.normal).abs() < 1e-9);
    }
    // Thicknesses are those of the place of each column.
    for v in 0..body.n_vertices() {
        let [top, below] = [0, 1].map(|l| body.positions[body.node(v, l)]);
        let asked = 3e-3 + 6e-3 * top.x / 0.2;
        let found = (top - below).norm();
        assert!(
            (found / asked - 1.0).abs() < 0.06,
            "{found} m, not {asked} m, at {top:?}"
        );
    }
}
