//! Thickness of grown layers: as asked, wherever there is room.
//!
//! Shapes whose distance from the skin is known by formula. Their skins are polyhedra with vertices
//! on the smooth shape, so a mesh of long edges is a little nearer to its inside than the formula
//! says.

use std::f64::consts::TAU;

use palpa_mesh::generate::cylinder;
use palpa_mesh::generate::tube::{Ends, tube};
use palpa_mesh::growth::{MAX_NODES, Moved, Thickness};
use palpa_mesh::{Growth, GrowthParams, LayerSpec, Surface, SurfaceIndex, Vec3, grow};

use crate::shapes::icosphere;

/// Largest error of a layer's thickness, as a share of it.
const TOLERANCE: f64 = 0.01;

fn layer(name: &str, thickness: Option<Thickness>, n_levels: usize) -> LayerSpec {
    LayerSpec {
        name: name.to_owned(),
        thickness,
        n_levels,
        min_thickness: 1e-4,
    }
}

fn fixed(name: &str, thickness: f64, n_levels: usize) -> LayerSpec {
    layer(name, Some(Thickness::Constant(thickness)), n_levels)
}

/// Skin 2 mm, fat 8 mm, and muscle down to the bone.
fn to_bone(n_levels: usize) -> Vec<LayerSpec> {
    vec![
        fixed("skin", 2e-3, 1),
        fixed("fat", 8e-3, 1),
        layer("muscle", None, n_levels),
    ]
}

fn grown(skin: &Surface, bones: &[Surface], layers: &[LayerSpec]) -> Growth {
    let params = GrowthParams {
        layers: layers.to_vec(),
        cut_out: None,
        coarsening: None,
        max_nodes: MAX_NODES,
    };
    grow(skin, bones, &params).unwrap()
}

/// Errors of the layers' thicknesses as shares of them, at all vertices farther than an edge from
/// the cut faces. `depth` is the distance of a point from the skin.
fn errors(growth: &Growth, layers: &[LayerSpec], depth: impl Fn(Vec3) -> f64) -> Vec<f64> {
    let body = &growth.body;
    let edge = body.skin.mean_edge_length();
    let mut errors = Vec::new();
    for (v, &p) in body.skin.points.iter().enumerate() {
        let is_at_cut = (body.cut_faces.iter())
            .any(|face| face.is_flat && (p - face.point).dot(&face.normal).abs() <= edge);
        if is_at_cut || growth.thinning[v] < 1.0 {
            continue;
        }
        let (mut level, mut above) = (0, 0.0);
        for layer in layers {
            level += layer.n_levels;
            let Some(asked) = layer.thickness.as_ref().map(|t| t.at(p)) else {
                continue;
            };
            let below = depth(body.positions[body.node(v, level)]);
            errors.push((below - above) / asked - 1.0);
            above = below;
        }
    }
    errors
}

fn worst(errors: &[f64]) -> f64 {
    errors.iter().fold(0.0, |worst, e| worst.max(e.abs()))
}

/// Checks a body against the distance from its smooth shape and from its mesh.
fn assert_kept(name: &str, growth: &Growth, layers: &[LayerSpec], smooth: impl Fn(Vec3) -> f64) {
    let index = SurfaceIndex::build(&growth.body.skin);
    let to_mesh = |x: Vec3| -index.closest(x).unwrap().signed_distance;
    let (from_mesh, from_smooth) = (
        errors(growth, layers, to_mesh),
        errors(growth, layers, smooth),
    );
    println!(
        "{name}: worst error {:.5} of the thickness from the mesh, {:.5} from the smooth shape, {} values",
        worst(&from_mesh),
        worst(&from_smooth),
        from_mesh.len()
    );
    assert!(from_mesh.len() > growth.body.n_vertices());
    assert!(worst(&from_mesh) < 1e-4, "{name}: {}", worst(&from_mesh));
    assert!(
        worst(&from_smooth) < TOLERANCE,
        "{name}: {}",
        worst(&from_smooth)
    );
    assert!(growth.report.moved_share <= 0.0, "{name}");
    assert_eq!(growth.report.worst_moved, None, "{name}");
    for (report, layer) in growth.report.layers.iter().zip(layers) {
        let Some(Thickness::Constant(asked)) = layer.thickness else {
            continue;
        };
        let spread = report.thickness;
        assert!(
            spread.min > 0.999 * asked && spread.max < 1.001 * asked,
            "{name}: {report:?}"
        );
    }
}

#[test]
fn a_cylinder_keeps_its_layers_at_every_spacing() {
    let radius = 0.045;
    for mm in [8.0, 7.0, 6.0, 5.0, 4.0, 3.0, 2.0] {
        let (skin, bone) = cylinder(0.1, radius, 0.014, mm * 1e-3);
        // Fine meshes need no repair, so one number of levels is enough there.
        for n_levels in if mm < 4.0 { 1..=1 } else { 1..=3 } {
            let layers = to_bone(n_levels);
            let growth = grown(&skin, std::slice::from_ref(&bone), &layers);
            let name = format!("cylinder at {mm} mm, {n_levels} levels");
            assert_kept(&name, &growth, &layers, |x| radius - x.yz().norm());
            assert!(growth.report.thinned_share <= 0.0, "{name}");
            // The base slides along the bone and does not leave it.
            assert!(growth.report.stand_off.unwrap().max < 1e-4, "{name}");
        }
    }
}

#[test]
fn a_sphere_keeps_its_layers_with_and_without_a_bone() {
    let (radius, bone) = (0.04, icosphere(3).scaled(0.012));
    for n in [3, 4] {
        let skin = icosphere(n).scaled(radius);
        let depth = |x: Vec3| radius - x.norm();
        let layers = to_bone(2);
        let growth = grown(&skin, std::slice::from_ref(&bone), &layers);
        assert_kept("sphere to a bone", &growth, &layers, depth);
        let layers = [fixed("skin", 2e-3, 1), fixed("fat", 8e-3, 2)];
        assert_kept("sphere", &grown(&skin, &[], &layers), &layers, depth);
    }
}

/// Distance from a point inside an ellipsoid of the given half axes to its surface. The nearest
/// point is `a² p / (a² + t)` by components, for the largest `t` that puts it on the surface
/// (Eberly 2013).
fn depth_in_ellipsoid(axes: [f64; 3], p: Vec3) -> f64 {
    let at = |t: f64| Vec3::from_fn(|i, _| axes[i].powi(2) * p[i] / (axes[i].powi(2) + t));
    let level = |t: f64| (0..3).map(|i| (at(t)[i] / axes[i]).powi(2)).sum::<f64>() - 1.0;
    let smallest = axes.into_iter().fold(f64::INFINITY, f64::min);
    let (mut lo, mut hi) = (-smallest * smallest * (1.0 - 1e-12), 0.0);
    for _ in 0..200 {
        let middle = f64::midpoint(lo, hi);
        if level(middle) > 0.0 {
            lo = middle;
        } else {
            hi = middle;
        }
    }
    (at(hi) - p).norm()
}

#[test]
fn an_ellipsoid_keeps_its_layers_where_columns_lean_towards_its_bone() {
    let scaled = |surface: Surface, axes: [f64; 3]| Surface {
        points: (surface.points.iter())
            .map(|p| p.component_mul(&Vec3::from(axes)))
            .collect(),
        ..surface
    };
    let axes = [0.06, 0.045, 0.035];
    let bone = scaled(icosphere(3), [0.03, 0.015, 0.012]);
    let skin = scaled(icosphere(4), axes);
    let depth = |x: Vec3| depth_in_ellipsoid(axes, x);
    let layers = to_bone(2);
    let growth = grown(&skin, std::slice::from_ref(&bone), &layers);
    assert_kept("ellipsoid to a bone", &growth, &layers, depth);
    let layers = [fixed("skin", 2e-3, 1), fixed("fat", 8e-3, 2)];
    assert_kept("ellipsoid", &grown(&skin, &[], &layers), &layers, depth);
}

#[test]
fn a_tapered_limb_keeps_its_layers() {
    // A cone from 50 to 25 mm radius over 120 mm.
    let (length, first, taper) = (0.12, 0.05, 0.025 / 0.12);
    let cone = |first: f64, last: f64| {
        move |t: f64, angle: f64| {
            let r = first + (last - first) * t;
            Vec3::new(t * length, r * angle.cos(), r * angle.sin())
        }
    };
    let bone = tube(40, 20, Ends::Closed, cone(0.012, 0.007));
    let depth = |x: Vec3| (first - taper * x.x - x.yz().norm()) / taper.hypot(1.0);
    for (n_rings, n_around) in [(20, 40), (40, 80)] {
        let skin = tube(n_rings, n_around, Ends::Open, cone(first, 0.025));
        let layers = to_bone(2);
        let growth = grown(&skin, std::slice::from_ref(&bone), &layers);
        assert_kept("tapered limb", &growth, &layers, depth);
    }
}

#[test]
fn thickness_that_varies_is_kept_below_each_vertex() {
    let radius = 0.045;
    let (skin, bone) = cylinder(0.1, radius, 0.014, 4e-3);
    let along = |at_0: f64, at_100: f64| Thickness::AlongAxis {
        axis: Vec3::x(),
        table: vec![[0.0, at_0], [0.1, at_100]],
    };
    let layers = vec![
        layer("skin", Some(along(1e-3, 3e-3)), 1),
        layer("fat", Some(along(10e-3, 4e-3)), 2),
        layer("muscle", None, 1),
    ];
    let growth = grown(&skin, std::slice::from_ref(&bone), &layers);
    assert_kept("varying", &growth, &layers, |x| radius - x.yz().norm());
}

#[test]
fn an_oblique_cut_keeps_layers_and_columns_in_its_plane() {
    let radius = 0.045;
    let (mut skin, bone) = cylinder(0.1, radius, 0.014, 5e-3);
    for p in &mut skin.points {
        p.x *= 1.0 + 4.0 * p.y;
    }
    let layers = to_bone(1);
    let growth = grown(&skin, std::slice::from_ref(&bone), &layers);
    let index = SurfaceIndex::build(&skin);
    let to_mesh = |x: Vec3| -index.closest(x).unwrap().signed_distance;
    assert!(worst(&errors(&growth, &layers, to_mesh)) < 1e-4);
    for face in &growth.body.cut_faces {
        for &v in &face.vertices {
            for l in 0..growth.body.n_levels {
                let x = growth.body.positions[growth.body.node(v as usize, l)];
                let rim = growth.body.skin.points[v as usize];
                assert!((x - rim).dot(&face.normal).abs() < 1e-9);
            }
        }
    }
}

#[test]
fn a_layer_that_gives_way_is_reported_with_its_place() {
    // The furrow along this tube is so sharp that the columns below it cross within the layers.
    let section = |s: f64, angle: f64| {
        let r = 0.03 * (1.0 - 0.45 * (-((angle - 0.5 * TAU) / 0.25).powi(2)).exp());
        Vec3::new(0.1 * s, r * angle.cos(), r * angle.sin())
    };
    let skin = tube(24, 60, Ends::Open, section);
    let layers = [fixed("skin", 2e-3, 1), fixed("fat", 8e-3, 2)];
    let growth = grown(&skin, &[], &layers);
    let index = SurfaceIndex::build(&skin);
    let to_mesh = |x: Vec3| -index.closest(x).unwrap().signed_distance;

    let Moved {
        layer,
        asked,
        thickness,
        vertex,
        at,
    } = growth.report.worst_moved.as_ref().unwrap();
    let level = |l: usize| to_mesh(growth.body.positions[growth.body.node(*vertex as usize, l)]);
    assert_eq!((layer.as_str(), *asked), ("fat", 8e-3), "the deepest layer");
    assert!((level(3) - level(1) - thickness).abs() < 1e-12);
    assert!(*thickness < 0.99 * asked && *thickness > 0.5 * asked);
    assert!(at[1] < 0.0 && at[2].abs() < 0.015, "at the furrow: {at:?}");
    let share = growth.report.moved_share;
    assert!(share > 0.0 && share < 0.06, "{share}");
    // The skin above keeps its thickness, and so do both layers elsewhere.
    let skin_layer = &growth.report.layers[0].thickness;
    assert!(skin_layer.min > 0.999 * 2e-3 && skin_layer.max < 1.001 * 2e-3);
    assert!(worst(&errors(&growth, &layers, to_mesh)) < 1e-4);
}
