//! Each defect, put into a clean surface, is found where it was put; and clean surfaces are clean.

use palpa_mesh::check::{Finding, FindingKind, Severity, SurfaceReport, self_intersections};
use palpa_mesh::{Surface, Vec3, Verdict, check_surface};

use crate::shapes::{icosphere, joined, moebius, moved, tube};

fn kinds(report: &SurfaceReport) -> Vec<FindingKind> {
    report.findings.iter().map(|f| f.kind).collect()
}

fn find(report: &SurfaceReport, kind: FindingKind) -> &Finding {
    let found = report.findings.iter().find(|f| f.kind == kind);
    found.unwrap_or_else(|| panic!("{kind:?} not among {:?}", kinds(report)))
}

#[test]
fn a_sphere_is_good() {
    let report = check_surface(&icosphere(3).scaled(0.1));
    assert_eq!(report.verdict, Verdict::Good);
    assert_eq!(report.findings, []);
    // V − E + F = 2.
    assert_eq!(
        (report.n_vertices, report.n_edges, report.n_triangles),
        (642, 1920, 1280)
    );
    let part = &report.parts[0];
    assert!(part.is_closed);
    // The inscribed polyhedron of three halvings lacks less than 1.5 % of the ball.
    let ball = 4.0 / 3.0 * std::f64::consts::PI * 1e-3;
    assert!(
        part.volume < ball && part.volume > 0.985 * ball,
        "{}",
        part.volume
    );
}

#[test]
fn an_open_tube_is_good_and_its_ends_are_cut_faces() {
    let report = check_surface(&tube(24, 10));
    assert_eq!(report.verdict, Verdict::Good);
    assert_eq!(kinds(&report), [FindingKind::OpenBoundary]);
    assert_eq!(report.loops.len(), 2);
    for end in &report.loops {
        assert!(end.is_flat && !end.is_hole && end.n_edges == 24);
        // A regular polygon of 24 sides.
        let perimeter = 24.0 * 2.0 * 0.04 * (std::f64::consts::PI / 24.0).sin();
        assert!((end.length - perimeter).abs() < 1e-12);
    }
    // Capped, it is a prism over that polygon.
    let volume = 0.2 * 12.0 * 0.04 * 0.04 * (std::f64::consts::TAU / 24.0).sin();
    assert!((report.parts[0].volume - volume).abs() < 1e-12);
    assert!(!report.parts[0].is_closed);
}

#[test]
fn a_missing_triangle_is_a_hole() {
    let mut tube = tube(24, 10);
    tube.triangles.remove(100);
    let report = check_surface(&tube);
    assert_eq!(report.verdict, Verdict::Bad);
    assert_eq!(find(&report, FindingKind::Hole).count, 1);
    assert_eq!(find(&report, FindingKind::OpenBoundary).count, 2);
}

#[test]
fn coordinates_that_are_not_finite() {
    for bad in [f64::NAN, f64::INFINITY, -1e300] {
        let mut sphere = icosphere(2);
        sphere.points[7].y = bad;
        let report = check_surface(&sphere);
        assert_eq!(report.verdict, Verdict::Bad);
        let finding = find(&report, FindingKind::NotFinite);
        assert_eq!(finding.spots[0].vertices, [7]);
    }
}

#[test]
fn indices_out_of_range_and_nothing_at_all() {
    let mut sphere = icosphere(0);
    sphere.triangles[3][1] = 12;
    let report = check_surface(&sphere);
    assert_eq!(
        find(&report, FindingKind::OutOfRange).spots[0].triangles,
        [3]
    );
    assert_eq!(
        kinds(&check_surface(&Surface::default())),
        [FindingKind::Empty]
    );
}

#[test]
fn triangles_without_area_and_doubles() {
    let mut sphere = icosphere(1);
    let n = sphere.triangles.len() as u32;
    let [a, b, c] = sphere.triangles[5];
    sphere.triangles.extend([[a, b, a], [c, a, b]]);
    let report = check_surface(&sphere);
    assert_eq!(
        find(&report, FindingKind::Degenerate).spots[0].triangles,
        [n]
    );
    assert_eq!(
        find(&report, FindingKind::Duplicate).spots[0].triangles,
        [5, n + 1]
    );
}

#[test]
fn a_fin_is_a_crowded_edge() {
    let mut sphere = icosphere(1);
    let [a, b, _] = sphere.triangles[0];
    sphere.points.push(sphere.points[a as usize] * 1.5);
    sphere
        .triangles
        .push([a, b, sphere.points.len() as u32 - 1]);
    let report = check_surface(&sphere);
    let finding = find(&report, FindingKind::NonManifoldEdge);
    assert_eq!(
        (finding.count, &finding.spots[0].vertices[..]),
        (1, &[a.min(b), a.max(b)][..])
    );
    assert_eq!(report.verdict, Verdict::Bad);
    assert!(
        !kinds(&report).contains(&FindingKind::Hole),
        "the rim of a fin is no hole"
    );
}

#[test]
fn parts_that_meet_in_a_vertex() {
    let (a, mut b) = (icosphere(1), icosphere(1));
    let shift = a.points[0] - b.points[3];
    b.points.iter_mut().for_each(|p| *p += shift);
    let mut both = joined(&a, &b);
    let n = a.points.len() as u32;
    both.triangles
        .iter_mut()
        .flatten()
        .filter(|v| **v == n + 3)
        .for_each(|v| *v = 0);
    let report = check_surface(&both);
    assert_eq!(
        find(&report, FindingKind::NonManifoldVertex).spots[0].vertices,
        [0]
    );
    assert_eq!(
        find(&report, FindingKind::UnusedVertex).spots[0].vertices,
        [n + 3]
    );
}

#[test]
fn winding_and_inversion() {
    let mut tube = tube(12, 6);
    tube.triangles[10].swap(0, 1);
    tube.triangles[77].swap(0, 1);
    let report = check_surface(&tube);
    assert_eq!(report.verdict, Verdict::Repairable);
    let finding = find(&report, FindingKind::Winding);
    assert_eq!(
        (finding.count, &finding.spots[1].triangles[..]),
        (2, &[77][..])
    );

    for mut surface in [icosphere(1), crate::shapes::tube(12, 6)] {
        surface.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        let report = check_surface(&surface);
        assert_eq!(
            find(&report, FindingKind::Inverted).severity,
            Severity::Repairable
        );
        assert!(report.parts[0].volume < 0.0);
    }
}

#[test]
fn a_moebius_strip_has_one_side() {
    let report = check_surface(&moebius(20));
    assert_eq!(report.verdict, Verdict::Bad);
    assert_eq!(find(&report, FindingKind::OneSided).count, 1);
}

#[test]
fn parts_are_counted_largest_first() {
    let two = joined(
        &icosphere(1).scaled(0.1),
        &moved(&icosphere(2), [3.0, 0.0, 0.0]),
    );
    let report = check_surface(&two);
    assert_eq!(report.verdict, Verdict::Good, "{:?}", report.findings);
    assert_eq!(find(&report, FindingKind::SeveralParts).count, 2);
    assert_eq!(
        (report.parts[0].n_triangles, report.parts[1].n_triangles),
        (320, 80)
    );
}

#[test]
fn a_soup_is_no_surface() {
    let sphere = icosphere(1);
    let mut soup = Surface::default();
    for t in 0..sphere.triangles.len() {
        let n = soup.points.len() as u32;
        let [a, b, c] = sphere.corners(t);
        let centre = (a + b + c) / 3.0;
        soup.points.extend([a, b, c].map(|p| p + centre));
        soup.triangles.push([n, n + 1, n + 2]);
    }
    assert_eq!(find(&check_surface(&soup), FindingKind::Unjoined).count, 80);
}

#[test]
fn a_vertex_on_a_border_edge_is_a_t_junction() {
    // Two halves of a square, one of which has a vertex in the middle of the common side.
    let at = |x: f64, y: f64| Vec3::new(x, y, 0.0);
    let surface = Surface {
        points: vec![
            at(0.0, 0.0),
            at(1.0, 0.0),
            at(1.0, 1.0),
            at(0.0, 1.0),
            at(0.5, 0.5),
        ],
        triangles: vec![[0, 1, 2], [0, 4, 3], [4, 2, 3]],
    };
    let report = check_surface(&surface);
    assert_eq!(find(&report, FindingKind::TJunction).spots[0].vertices, [4]);
}

#[test]
fn size_and_place() {
    let millimetres = icosphere(2).scaled(120.0);
    let finding = check_surface(&millimetres).findings.remove(0);
    assert_eq!(
        (finding.kind, finding.severity),
        (FindingKind::Scale, Severity::Note)
    );
    assert!(finding.advice.contains("--unit mm"), "{}", finding.advice);
    let far = moved(&icosphere(2).scaled(0.1), [4.5e6, -1.2e6, 3e5]);
    let report = check_surface(&far);
    assert_eq!(
        (report.verdict, kinds(&report)),
        (Verdict::Good, vec![FindingKind::FarFromOrigin])
    );
}

#[test]
fn self_intersections_are_those_of_brute_force() {
    // Two spheres through each other, at an angle where no vertices coincide, and a tube pushed
    // through both.
    let turned = nalgebra::Rotation3::from_euler_angles(0.3, 0.7, 1.1);
    let mut other = icosphere(2);
    other
        .points
        .iter_mut()
        .for_each(|p| *p = turned * *p + Vec3::new(0.9, 0.2, -0.1));
    let surface = joined(&joined(&icosphere(2), &other), &tube(12, 8).scaled(8.0));
    let found = self_intersections(&surface);
    assert!(found.is_complete);
    assert_eq!(found.pairs, brute_force(&surface));
    assert!(found.pairs.len() > 100, "{}", found.pairs.len());
    assert_eq!(check_surface(&surface).verdict, Verdict::Bad);
}

/// Pairs of triangles of which a side of one passes through the inside of the other, by a
/// parametric formula in floating point: another way than that of the code under test, good for
/// triangles in general position.
fn brute_force(surface: &Surface) -> Vec<[u32; 2]> {
    let pierces = |a: Vec3, b: Vec3, [u, v, w]: [Vec3; 3]| {
        // a + s (b − a) = u + p (v − u) + q (w − u)
        let m = nalgebra::Matrix3::from_columns(&[b - a, u - v, u - w]);
        m.try_inverse().is_some_and(|inverse| {
            let x = inverse * (u - a);
            x[0] > 0.0 && x[0] < 1.0 && x[1] > 0.0 && x[2] > 0.0 && x[1] + x[2] < 1.0
        })
    };
    let n = surface.triangles.len();
    let mut pairs = Vec::new();
    for s in 0..n {
        for t in s + 1..n {
            if surface.triangles[s]
                .iter()
                .any(|v| surface.triangles[t].contains(v))
            {
                continue;
            }
            let (p, q) = (surface.corners(s), surface.corners(t));
            let hit = (0..3).any(|k| {
                let next = (k + 1) % 3;
                pierces(p[k], p[next], q) || pierces(q[k], q[next], p)
            });
            if hit {
                pairs.push([s as u32, t as u32]);
            }
        }
    }
    pairs
}
