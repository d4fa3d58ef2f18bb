//! The tool presses where the scene says, between vertices as well.

use std::path::Path;
use std::sync::Arc;

use palpa::Note;
use palpa::mesh::{SurfaceIndex, Vec3};
use palpa::press::tissue::Indentation;
use palpa::scene::Scene;
use palpa::{Prepared, build};
use palpa_testkit::{Layer, Scene as SceneText, Value};

const MICROMETRE: f64 = 1e-6;

/// A soft block of one tissue, its vertices 10 mm apart.
fn block() -> SceneText {
    SceneText::block([60.0, 60.0, 20.0], 10.0)
        .layer(Layer::elastic("gel", "10 kPa").levels(3))
        .press(2.0)
        .set("press", "step", "1 mm")
}

/// A round limb, 40 mm in radius, along x.
fn limb() -> SceneText {
    let cylinder = "{ kind = \"cylinder\", length = \"100 mm\", radius = \"40 mm\", bone_radius = \"12 mm\", spacing = \"8 mm\" }";
    block()
        .set("body", "generator", Value::raw(cylinder))
        .with_layer(0, |layer| layer.thick(20.0))
}

fn at(scene: SceneText, mm: [f64; 3]) -> SceneText {
    scene.set("press", "at", Value::lengths(mm))
}

fn parse(scene: &SceneText) -> Scene {
    Scene::parse(&scene.to_string(), Path::new(".")).unwrap()
}

fn prepared(scene: &SceneText) -> Prepared {
    Prepared::build(&parse(scene)).unwrap()
}

fn set_up(scene: &SceneText) -> Indentation {
    Indentation::build(Arc::new(prepared(scene))).unwrap()
}

fn forces(press: &Indentation) -> Vec<f64> {
    let mut run = press.start(0);
    std::iter::from_fn(|| run.advance())
        .inspect(|sample| assert!(sample.outcome.is_converged()))
        .map(|sample| sample.force_n)
        .collect()
}

/// Largest and smallest of some numbers, relative to their mean.
fn spread(values: &[f64]) -> f64 {
    let (lo, hi) = (values.iter()).fold((f64::INFINITY, 0.0_f64), |(lo, hi), &x| {
        (lo.min(x), hi.max(x))
    });
    2.0 * (hi - lo) / (hi + lo)
}

/// At a vertex, on edges along and across the grid, inside triangles; mm.
const ON_BLOCK: [[f64; 2]; 6] = [
    [0.0, 0.0],
    [8.0, 0.0],
    [5.0, 5.0],
    [3.21, 1.234],
    [-7.0, 2.001],
    [1e-3, -2e-3],
];

#[test]
fn the_place_is_the_point_of_the_skin_nearest_to_the_scenes() {
    for refine in [true, false] {
        for [x, y] in ON_BLOCK {
            let scene = at(block().sphere(8.0), [x, y, 3.0]).set("mesh", "refine", refine);
            let prepared = prepared(&scene);
            let place = prepared.place();
            let asked = Vec3::new(x, y, 0.0) * 1e-3;
            assert!((place.at - asked).norm() < 1e-12, "{:?}", place.at);
            assert!((place.distance_asked().unwrap() - 3e-3).abs() < 1e-12);
            assert!((place.direction.into_inner() + Vec3::z()).norm() < 1e-12);
            assert!((place.tissue_depth - 0.020).abs() < 1e-12);
            // The vertices between which it lies are there, too.
            let points = &prepared.mesh.body.skin.points;
            assert!((place.point.mean(|v| points[v]) - asked).norm() < 1e-12);
            // A mesh that may be refined has a vertex there.
            let beside = (points[place.vertex] - asked).norm();
            assert!(!refine || beside < 1e-9, "{beside} m beside {x}, {y} mm");
        }
    }
}

#[test]
fn on_a_slope_the_place_is_on_the_skin_and_the_depth_that_of_the_tissue_there() {
    for refine in [true, false] {
        for angle in [0.0_f64, 0.37, 1.0, -2.2] {
            let [y, z] = [angle.sin(), angle.cos()].map(|x| 42.0 * x);
            let prepared =
                prepared(&at(limb().sphere(8.0), [53.3, y, z]).set("mesh", "refine", refine));
            let place = prepared.place();
            let skin = &prepared.grown.growth.body.skin;
            let asked = Vec3::new(53.3, y, z) * 1e-3;
            let nearest = SurfaceIndex::build(skin).closest(asked).unwrap().point;
            assert!((place.at - nearest).norm() < 1e-12);
            // The skin is a polygon of some 31 sides in the circle.
            assert!((place.at.x - 53.3e-3).abs() < 0.2e-3, "{:?}", place.at);
            assert!(((place.at - asked).norm() - 2e-3).abs() < 0.3e-3);
            let radial = Vec3::new(0.0, angle.sin(), angle.cos());
            assert!(-place.direction.dot(&radial) > 0.999);
            assert!((place.tissue_depth - 20e-3).abs() < 0.3e-3);
            // On the pressed skin, and at the mean of its vertices.
            let pressed = &prepared.mesh.body.skin;
            let on = SurfaceIndex::build(pressed).closest(place.at).unwrap();
            assert!((on.point - place.at).norm() < MICROMETRE);
            let mean = place.point.mean(|v| pressed.points[v]);
            assert!((mean - place.at).norm() < MICROMETRE);
        }
    }
}

/// Smallest distance of a tool at depth 0 from the skin at rest, sampled densely in the triangles
/// near the place, and the sample's place. m
fn gap(press: &Indentation) -> (f64, Vec3) {
    const N: i32 = 60;
    let tool = press.tool_at(0.0).unwrap();
    let skin = &press.mesh().body.skin;
    let place = press.place().at;
    let at_place = tool.tool.distance_at(&tool.pose, &place).distance;
    let mut least = (at_place, place);
    for t in 0..skin.triangles.len() {
        let corners = skin.corners(t);
        if corners.iter().all(|p| (p - place).norm() > 15e-3) {
            continue;
        }
        for i in 0..=N {
            for j in 0..=N - i {
                let [u, v] = [i, j].map(|i| f64::from(i) / f64::from(N));
                let p = corners[0] * (1.0 - u - v) + corners[1] * u + corners[2] * v;
                let distance = tool.tool.distance_at(&tool.pose, &p).distance;
                if distance < least.0 {
                    least = (distance, p);
                }
            }
        }
    }
    least
}

#[test]
fn at_depth_zero_the_tip_touches_the_skin_at_the_place() {
    let cone = || {
        block()
            .tool("cone", 8.0)
            .set("tool", "opening_angle", "90 deg")
            .set("tool", "tip_radius", "0.5 mm")
    };
    for refine in [true, false] {
        for [x, y] in ON_BLOCK {
            for scene in [block().sphere(8.0), cone()] {
                let scene = at(scene, [x, y, 0.0]).set("mesh", "refine", refine);
                let press = set_up(&scene);
                let tip = press.tool_at(0.0).unwrap().pose.translation.vector;
                let asked = Vec3::new(x, y, 0.0) * 1e-3;
                assert!((tip - asked).norm() < 1e-8, "{tip:?}");
                assert!(gap(&press).0.abs() < MICROMETRE);
            }
        }
    }
}

#[test]
fn on_a_slope_the_tool_comes_down_on_the_place_and_its_depth_counts_from_the_skin() {
    for refine in [true, false] {
        for angle in [0.0_f64, 0.37, 1.0] {
            for radius in [4.0, 10.0] {
                let [y, z] = [angle.sin(), angle.cos()].map(|x| 41.0 * x);
                let scene = at(limb().sphere(radius), [51.7, y, z]).set("mesh", "refine", refine);
                let press = set_up(&scene);
                let place = press.place();
                let tip = press.tool_at(0.0).unwrap().pose.translation.vector;
                let off = tip - place.at;
                let along = off.dot(&place.direction);
                // On the line through the place; a little above it, as a facet of the skin is not
                // exactly across the smooth normal.
                assert!((off - place.direction.into_inner() * along).norm() < 1e-9);
                assert!((-0.05e-3..=0.0).contains(&along), "{along}");
                // Samples 0.1 mm apart miss the touch by about a micrometre.
                let (distance, touched) = gap(&press);
                assert!((-1e-9..2.0 * MICROMETRE).contains(&distance), "{distance}");
                assert!((touched - place.at).norm() < 0.12 * radius * 1e-3);
            }
        }
    }
}

#[test]
fn the_force_hardly_depends_on_where_in_a_triangle_the_place_is() {
    // Over one triangle of the grown skin: its corners, the middles of its edges, and inside. mm
    let places = [
        [0.0, 0.0],
        [5.0, 0.0],
        [2.5, 0.3],
        [0.7, 0.6],
        [3.3, 3.3],
        [4.4, 1.9],
    ];
    let press = |scene: &dyn Fn() -> SceneText| -> Vec<Vec<f64>> {
        let scenes = places.map(|[x, y]| at(scene(), [x, y, 0.0]));
        scenes.iter().map(|s| forces(&set_up(s))).collect()
    };
    let spread_at =
        |runs: &[Vec<f64>], i: usize| spread(&runs.iter().map(|run| run[i]).collect::<Vec<_>>());
    // The samples are at 0, 1 and 2 mm.
    let sphere = press(&|| block().sphere(8.0));
    let (shallow, deep) = (spread_at(&sphere, 1), spread_at(&sphere, 2));
    assert!(shallow < 0.015 && deep < 0.01, "{shallow} {deep}");
    // A flat face and a disc feel each vertex that enters their edge.
    let disc = spread_at(&press(&|| block().disc(6.0)), 2);
    assert!(disc < 0.02, "{disc}");
    let punch = spread_at(
        &press(&|| {
            block()
                .tool("flat-punch", 7.0)
                .set("tool", "edge_radius", "5 mm")
                .near_tool(1.6)
        }),
        2,
    );
    assert!(punch < 0.01, "{punch}");
}

#[test]
fn the_middle_of_a_disc_is_at_the_place() {
    for [x, y] in ON_BLOCK {
        let prepared = prepared(&at(block().disc(6.0), [x, y, 0.0]));
        let place = Vec3::new(x, y, 0.0) * 1e-3;
        let (mesh, patch) = (&prepared.mesh, prepared.mesh.patch.as_ref().unwrap());
        let points = &mesh.body.skin.points;
        let distances: Vec<f64> = (patch.vertices.iter())
            .map(|&v| (points[v] - place).norm())
            .collect();
        // All vertices of the rim are equally far from the place; so are none inside.
        let radius = distances.iter().copied().fold(0.0, f64::max);
        let on_rim: Vec<usize> = (0..distances.len())
            .filter(|&i| distances[i] > radius - MICROMETRE)
            .collect();
        assert!(on_rim.len() >= 12, "{} on the rim", on_rim.len());
        assert!((radius - 6.2e-3).abs() < 0.3e-3, "{radius}");
        for quarter in 0..8 {
            let turn = f64::from(quarter) * std::f64::consts::FRAC_PI_4;
            let way = Vec3::new(turn.cos(), turn.sin(), 0.0);
            let farthest = (patch.vertices.iter())
                .map(|&v| (points[v] - place).dot(&way))
                .fold(0.0, f64::max);
            assert!(farthest > 0.9 * radius, "{farthest} of {radius}");
        }
    }
    // Without refinement: the vertices within the radius.
    let scene = at(block().disc(9.0), [5.0, 5.0, 0.0]).set("mesh", "refine", false);
    let prepared = prepared(&scene);
    let points = &prepared.mesh.body.skin.points;
    let mut held: Vec<[i64; 2]> = (prepared.mesh.patch.as_ref().unwrap().vertices.iter())
        .map(|&v| [points[v].x, points[v].y].map(|x| (x * 1e3).round() as i64))
        .collect();
    held.sort_unstable();
    assert_eq!(held, [[0, 0], [0, 10], [10, 0], [10, 10]]);
}

#[test]
fn a_node_stays_at_the_nearest_vertex_and_a_note_says_how_far_that_is() {
    let node = block().set("tool", "shape", "node");
    let prepared = prepared(&at(node, [8.0, 0.0, 0.0]));
    assert!((prepared.place().at - Vec3::new(0.01, 0.0, 0.0)).norm() < 1e-12);
    let [Note::NodeBeside { distance }] = prepared.notes[..] else {
        panic!("{:?}", prepared.notes);
    };
    assert!((distance - 2e-3).abs() < 1e-12, "{distance}");
}

#[test]
fn a_vertex_is_pressed_at_its_point() {
    let vertex =
        block()
            .sphere(8.0)
            .without("press", "at")
            .set("press", "vertex", Value::raw("17"));
    let prepared = prepared(&vertex);
    let place = prepared.place();
    assert_eq!((place.vertex, place.asked), (17, None));
    assert_eq!(place.at, prepared.grown.growth.body.skin.points[17]);
}

#[test]
fn the_place_moves_with_the_skin_under_tension() {
    let tense = SceneText::block([60.0, 60.0, 20.0], 10.0)
        .layer(
            Layer::elastic("skin", "100 kPa")
                .thick(2.0)
                .set("prestress", "3 kPa"),
        )
        .layer(Layer::elastic("gel", "10 kPa").levels(2))
        .sphere(8.0)
        .set("press", "depth", "1 mm");
    let tense = at(tense, [18.0, 3.3, 0.0]);
    let prepared = Arc::new(prepared(&tense));
    let rest = prepared.rest().unwrap();
    let press = Indentation::build(Arc::clone(&prepared)).unwrap();
    let (body, place) = (&prepared.mesh.body, prepared.place());
    let moved = place.point.mean(|v| rest.displacements[body.node(v, 0)]);
    assert!(moved.x < -0.05e-3, "the free block contracts: {moved:?}");
    let tip = press.tool_at(0.0).unwrap().pose.translation.vector;
    let off = tip - (place.at + moved);
    assert!(off.xy().norm() < 1e-9, "{off:?}");
    assert!((0.0..0.1e-3).contains(&off.z), "{off:?}");
}

#[test]
fn a_lump_below_the_place_is_below_the_point_itself() {
    let scene = at(block().sphere(8.0), [8.0, 3.0, 1.0])
        .lump(
            palpa_testkit::Lump::sphere(2.0, "lump", "100 kPa")
                .set("below", Value::lengths([8.0, 3.0, 1.0]))
                .set("depth", "6 mm"),
        )
        .lump(
            palpa_testkit::Lump::sphere(2.0, "other", "100 kPa")
                .set("below", Value::lengths([-7.0, 4.0, 0.0]))
                .set("depth", "6 mm"),
        );
    let prepared = prepared(&scene);
    for (lump, [x, y]) in prepared.lumps().iter().zip([[8.0, 3.0], [-7.0, 4.0]]) {
        let middle = lump.pose().translation.vector;
        assert!((middle - Vec3::new(x, y, -6.0) * 1e-3).norm() < 1e-12);
    }
}

#[test]
fn a_place_that_is_not_over_the_skin_is_refused() {
    let refusal = |scene: SceneText| Prepared::build(&parse(&scene)).unwrap_err().to_string();
    let beyond = refusal(at(block().sphere(8.0), [35.0, 4.0, 0.0]));
    assert!(
        beyond.contains("(35.0, 4.0, 0.0) mm is not over the skin: it is 5.0 mm beyond the rim")
            && beyond.contains("(30.0, 4.0, 0.0) mm; press"),
        "{beyond}"
    );
    // Inside the cut face at the end of the limb.
    let inside = refusal(at(limb().sphere(8.0), [0.0, 3.0, 25.0]));
    assert!(inside.contains("inside a cut face"), "{inside}");
    // Above the rim is over the skin.
    let above = prepared(&at(block().sphere(8.0), [30.0, 4.0, 4.0]));
    assert!(
        above.notes.contains(&Note::PressOnCutFace),
        "{:?}",
        above.notes
    );
}

#[test]
fn a_place_far_from_the_skin_and_a_tool_beyond_the_rim_are_noted() {
    let notes = |scene: SceneText| build_notes(&scene);
    let over = |x: f64| {
        let punch = block().tool("flat-punch", 6.0);
        notes(at(punch, [x, 0.0, 0.0]).set("mesh", "refine", false))
            .iter()
            .find_map(|note| match note {
                Note::ToolOverRim { share } => Some(*share),
                _ => None,
            })
    };
    assert_eq!(over(23.9), None);
    assert!((over(30.0).unwrap() - 0.5).abs() < 1e-9);
    // The segment of a circle beyond half its radius has 19.55 % of its area.
    assert!((over(27.0).unwrap() - 0.1955).abs() < 0.01);
    let far = notes(at(block().sphere(8.0), [1.0, 2.0, 12.0]));
    let [Note::PlaceOffSkin { distance, .. }] = far[..] else {
        panic!("{far:?}");
    };
    assert!((distance - 12e-3).abs() < 1e-12);
    assert_eq!(
        far[0].to_string(),
        "the point (1.0, 2.0, 12.0) mm is 12.0 mm from the skin; the tool presses the nearest point of the skin, (1.0, 2.0, 0.0) mm"
    );
}

fn build_notes(scene: &SceneText) -> Vec<Note> {
    let scene = parse(scene);
    let grown = Arc::new(build::build(&scene).unwrap());
    Prepared::on(&scene, grown, &[]).unwrap().notes
}
