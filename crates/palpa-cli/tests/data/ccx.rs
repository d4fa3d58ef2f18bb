//! Exported decks, run by the real CalculiX (Debian: `calculix-ccx`). `make test-data` leaves these
//! tests out where it is not installed.

use std::fs;
use std::path::Path;
use std::process::Command;

use nalgebra::{Rotation3, Vector3};
use palpa::continuum::{self, material};
use palpa_fem::law::Law;
use palpa_fem::lump::{Lump, LumpShape};
use palpa_fem::shape::{Pose, Sphere};
use palpa_fem::{Mat3, Material, Supports};
use palpa_lab::export::{Deck, Element, Export, PatchForce, patch_forces};
use palpa_mesh::generate::patch::{centre_vertex, patch};
use palpa_mesh::generate::{GradedBlock, GradedLayer, LevelStack, Outline, graded_block};
use palpa_mesh::{LayeredBody, Vec3};
use palpa_scene::{CutFaces, Scene};
use palpa_testkit::{Bench, Layer, Scene as SceneText};
use tempfile::TempDir;

/// Runs `body.inp` in a folder.
fn solve(folder: &Path) -> Vec<PatchForce> {
    let run = Command::new("ccx").arg("body").current_dir(folder).output();
    let run = run.expect("`ccx` runs (Debian: calculix-ccx)");
    let said = String::from_utf8_lossy(&run.stdout).into_owned();
    assert!(!said.contains("*ERROR"), "{said}");
    let forces = patch_forces(&fs::read_to_string(folder.join("body.dat")).unwrap());
    assert!(forces.last().is_some_and(|f| f.share > 0.999), "{said}");
    forces
}

/// A column held by planes of symmetry on all sides and pressed over its whole top: every layer is
/// strained evenly, so the force follows from the laws alone.
fn column(lower: &str) -> SceneText {
    SceneText::block([20.0, 20.0, 24.0], 10.0)
        .set("body", "cut_faces", "symmetric")
        .layer(
            Layer::of(r#"name = "upper", young = "10 kPa", poisson = 0.4"#)
                .thick(8.0)
                .levels(1),
        )
        .layer(Layer::of(&format!(r#"name = "lower", {lower}"#)).levels(2))
        .disc(30.0)
        .set("press", "depth", "4 mm")
        .set("press", "step", "2 mm")
}

#[test]
fn confined_columns_have_the_exact_force_of_every_law() {
    for tissue in [
        r#"young = "30 kPa", poisson = 0.45"#,
        r#"law = "st-venant-kirchhoff", young = "30 kPa", poisson = 0.3"#,
        r#"law = "mooney-rivlin", young = "30 kPa", c01 = "2 kPa", poisson = 0.45"#,
        r#"law = "yeoh", young = "30 kPa", c20 = "3 kPa", c30 = "5 kPa", poisson = 0.45"#,
        r#"law = "ogden", terms = [{ mu = "5 kPa", alpha = 4 }], poisson = 0.45"#,
        r#"law = "ogden", terms = [{ mu = "5 kPa", alpha = 4 }, { mu = "2 kPa", alpha = -3 }, { mu = "1 kPa", alpha = 6 }], poisson = 0.45"#,
    ] {
        let text = column(tissue).to_string();
        let scene = Scene::parse(&text, "".as_ref()).unwrap();
        let bench = Bench::new(env!("CARGO_BIN_EXE_palpa"));
        let file = bench.file("scene.toml", &text);
        let (code, _, stderr) = bench.run(&["export", file, "--out", "."]);
        assert_eq!(code, 0, "{stderr}");
        let laws = [0, 1].map(|i| material(&scene.layers[i].tissue, 0.0).unwrap().law);
        let forces = solve(bench.folder());
        assert_eq!(forces.len(), 2);
        for found in forces {
            let exact = column_force(&laws, [8e-3, 16e-3], 4e-3 * found.share, 20e-3 * 20e-3);
            let error = -found.force.z / exact - 1.0;
            println!(
                "{tissue}: {:.1} mm, {exact:.6} N, ccx {error:+.1e}",
                4.0 * found.share
            );
            assert!(error.abs() < 2e-6, "{tissue}: {found:?} for {exact} N");
        }
    }
}

/// Force on a confined column of layers in series: the stress is the same in all, the shortenings
/// add up.
fn column_force(laws: &[Law; 2], heights: [f64; 2], depth: f64, area: f64) -> f64 {
    let pressure = |law: &Law, stretch: f64| {
        -law.stress(&Mat3::from_diagonal(&Vector3::new(1.0, 1.0, stretch)))[(2, 2)]
    };
    let bisect = |mut lo: f64, mut hi: f64, is_low: &dyn Fn(f64) -> bool| {
        for _ in 0..200 {
            let middle = 0.5 * (lo + hi);
            if is_low(middle) {
                lo = middle;
            } else {
                hi = middle;
            }
        }
        0.5 * (lo + hi)
    };
    let shortening = |p: f64| -> f64 {
        let stretch = |law: &Law| bisect(0.1, 1.0, &|s| pressure(law, s) > p);
        laws.iter()
            .zip(heights)
            .map(|(law, h)| h * (1.0 - stretch(law)))
            .sum()
    };
    area * bisect(0.0, 1e6, &|p| shortening(p) < depth)
}

/// A small block, pressed in the middle, turned in space.
struct Turned {
    body: LayeredBody,
    rotation: Rotation3<f64>,
}

impl Turned {
    fn new(angle: Vec3) -> Self {
        let rotation = Rotation3::new(angle);
        let mut body = patch(5, 5, 5e-3, &[0.0, 4e-3, 12e-3], &[0, 1]);
        body.positions.iter_mut().for_each(|p| *p = rotation * *p);
        body.skin.points.iter_mut().for_each(|p| *p = rotation * *p);
        for face in &mut body.cut_faces {
            face.normal = rotation * face.normal;
            face.point = rotation * face.point;
        }
        Self { body, rotation }
    }

    /// The force at 2 mm, in the block's own axes.
    fn force(&self, cut_faces: CutFaces, lumps: &[Lump]) -> Vec3 {
        let body = &self.body;
        let tissue = |young: f64| {
            let law = palpa_fem::law::NeoHookean::from_young(young, 0.45).unwrap();
            Material::new("tissue", law)
        };
        let centre = centre_vertex(5, 5);
        let vertices = [centre, centre - 1, centre + 1, centre - 5, centre + 5];
        let patch = vertices.map(|v| body.node(v, 0));
        let mut notes = Vec::new();
        let supports: Supports = continuum::supports(cut_faces, body, &mut notes);
        let export = Export {
            body,
            materials: &[tissue(5e3), tissue(30e3), tissue(300e3)],
            lumps,
            supports: &supports,
            patch: &patch,
            travel: self.rotation * Vec3::new(0.3e-3, 0.0, -2e-3),
            n_results: 1,
            element: Element::C3d15,
            is_approximate: false,
            title: &[],
        };
        let folder = TempDir::new().unwrap();
        let mut file = fs::File::create(folder.path().join("body.inp")).unwrap();
        Deck::build(&export).unwrap().write(&mut file).unwrap();
        self.rotation.inverse() * solve(folder.path())[0].force
    }
}

/// Planes of symmetry across the axes are held in frames of their own, corners in two planes at
/// once.
#[test]
fn a_turned_body_has_the_turned_force() {
    let [straight, turned] = [Vec3::zeros(), Vec3::new(0.5, -0.8, 0.3)].map(Turned::new);
    let mut forces = Vec::new();
    for cut_faces in [CutFaces::Free, CutFaces::Symmetric, CutFaces::Fixed] {
        let [a, b] = [&straight, &turned].map(|block| block.force(cut_faces, &[]));
        println!("{cut_faces:?}: {a:?} N, turned {b:?} N");
        assert!(
            (a - b).norm() < 2e-6 * a.norm(),
            "{cut_faces:?}: {a:?} {b:?}"
        );
        forces.push(-a.z);
    }
    // The more it is held, the harder it is.
    assert!(
        forces[0] < 0.99 * forces[1] && forces[1] < 0.99 * forces[2],
        "{forces:?}"
    );
}

#[test]
fn a_hard_lump_is_felt_in_the_deck() {
    let block = Turned::new(Vec3::zeros());
    let lump = |radius| {
        let shape = LumpShape::Sphere(Sphere::new(radius).unwrap());
        let pose = Pose::translation(10e-3, 10e-3, -7e-3);
        [Lump::new(shape, pose, 0.0, 2).unwrap()]
    };
    let without = -block.force(CutFaces::Free, &[]).z;
    let with = -block.force(CutFaces::Free, &lump(5e-3)).z;
    println!("{without:.4} N without, {with:.4} N with a lump");
    assert!(with > 1.1 * without, "{with} N against {without} N");
}

/// Skin over fat over muscle under a bonded disc of 10 mm, computed by others with other elements
/// of CalculiX.
#[test]
fn the_layered_block_of_the_reference_has_its_force() {
    let table = crate::reference().join("B2_layered_block_nu045.csv");
    let block = GradedBlock {
        outline: Outline::Square,
        half_width: 50e-3,
        centre: [0.0, 0.0],
        ring_radius: Some(10e-3),
        spacing: 3.4e-3,
        inner_growth: 0.0,
        growth: 0.4,
        jitter: None,
    };
    let layer = |thickness, first_height| GradedLayer {
        thickness,
        first_height,
        growth: 0.5,
    };
    let levels = LevelStack::graded(&[layer(2e-3, 1e-3), layer(10e-3, 2.5e-3), layer(28e-3, 6e-3)]);
    let body = graded_block(&block, &levels);
    let tissue = |young: f64| {
        let law = palpa_fem::law::NeoHookean::from_young(young, 0.45).unwrap();
        Material::new("tissue", law)
    };
    let patch = block.patch_vertices(&body);
    let patch: Vec<usize> = patch.iter().map(|&v| body.node(v as usize, 0)).collect();
    let export = Export {
        body: &body,
        materials: &[tissue(100e3), tissue(5e3), tissue(30e3)],
        lumps: &[],
        supports: &Supports::on_base(&body),
        patch: &patch,
        travel: -4e-3 * Vec3::z(),
        n_results: 2,
        element: Element::C3d15,
        is_approximate: false,
        title: &[],
    };
    let deck = Deck::build(&export).unwrap();
    let folder = TempDir::new().unwrap();
    let mut file = fs::File::create(folder.path().join("body.inp")).unwrap();
    deck.write(&mut file).unwrap();
    let forces = solve(folder.path());
    let table = fs::read_to_string(table).unwrap();
    let mut rows = table
        .lines()
        .map(|line| line.split(',').collect::<Vec<_>>());
    let column = rows
        .next()
        .unwrap()
        .iter()
        .position(|&c| c == "F_N_extrapolated")
        .unwrap();
    for (row, found) in rows.zip(&forces) {
        let reference: f64 = row[column].parse().unwrap();
        let error = -found.force.z / reference - 1.0;
        println!(
            "{} mm: {:.4} N for {reference} N, {:+.1} %, {} nodes",
            4.0 * found.share,
            -found.force.z,
            100.0 * error,
            deck.n_nodes()
        );
        assert!(error.abs() < 0.05);
    }
    assert_eq!(forces.len(), 2);
}
