//! Error bars of presses whose forces are known from elsewhere: spheres on layers, and blocks under a
//! bonded disc, a disc above a lump, and a sphere. Every scene has the default mesh.
//!
//! The table of all of them stays in the build folder's `tmp/results/error_bars_of_references.csv`.

use std::collections::BTreeMap;
use std::path::Path;

use palpa::Prepared;
use palpa::accuracy::{Descent, Stops};
use palpa::press::tissue::{Indentation, Record, Sample};
use palpa_scene::Scene;
use palpa_testkit::{Layer, Lump, Scene as SceneText};

/// Parabola instead of sphere, finite block, and small strain: the uncertainty of the spheres' forces.
const SMALL_STRAIN: f64 = 0.02;

/// A force that is known.
#[derive(Debug, Clone, Copy)]
struct Known {
    depth_mm: f64,
    force_n: f64,
    /// Uncertainty as a share of the force.
    uncertainty: f64,
}

/// Where the uncertainty of a reference stands.
#[derive(Debug, Clone, Copy)]
enum Uncertainty {
    /// In this column, as a share of the force.
    Column(&'static str),
    /// The same share of every force.
    Share(f64),
}

/// The rows of a table by the names of its columns.
fn rows(file: &str) -> Vec<BTreeMap<String, String>> {
    let path = crate::reference().join(file);
    let mut reader = csv::Reader::from_path(path).unwrap();
    reader.deserialize().map(Result::unwrap).collect()
}

fn number(row: &BTreeMap<String, String>, column: &str) -> Option<f64> {
    row[column].parse().ok()
}

/// Forces of a table of blocks, down to a depth in mm.
fn block_forces(file: &str, column: &str, uncertainty: Uncertainty, deepest: f64) -> Vec<Known> {
    let known = |row: &BTreeMap<String, String>| {
        Some(Known {
            depth_mm: 1e3 * number(row, "depth_m")?,
            force_n: number(row, column)?,
            uncertainty: match uncertainty {
                // Where one family of meshes is left, the reference is known to 3 %.
                Uncertainty::Column(name) => number(row, name).unwrap_or(0.03),
                Uncertainty::Share(share) => share,
            },
        })
    };
    let all = rows(file);
    let found = all.iter().filter_map(known);
    found
        .filter(|known| known.depth_mm < deepest + 1e-6)
        .collect()
}

/// Forces of a sphere of 10 mm on layers, to a depth of 1 mm.
fn sphere_forces(file: &str, has: impl Fn(&BTreeMap<String, String>) -> bool) -> Vec<Known> {
    let known = |row: &BTreeMap<String, String>| Known {
        depth_mm: 1e3 * number(row, "delta_m").unwrap(),
        force_n: number(row, "F_N").unwrap(),
        uncertainty: SMALL_STRAIN,
    };
    let all = rows(file);
    let found = all.iter().filter(|row| has(row)).map(known);
    found.filter(|known| known.depth_mm < 1.0).collect()
}

/// A layer: thickness (mm), Young's modulus, Poisson's ratio.
type Elastic = (f64, &'static str, f64);

/// A block of a width, mm, made of layers.
fn block(width: f64, layers: &[Elastic]) -> SceneText {
    let depth = layers.iter().map(|layer| layer.0).sum();
    let text = SceneText::block([width, width, depth], 5.0);
    let last = layers.len() - 1;
    (layers.iter().enumerate()).fold(text, |text, (i, &(thickness, young, poisson))| {
        let tissue = format!("name = \"layer {i}\", young = \"{young}\", poisson = {poisson}");
        let layer = Layer::of(&tissue);
        text.layer(if i < last {
            layer.thick(thickness)
        } else {
            layer
        })
    })
}

fn samples(scene: &SceneText, depth: f64, step: &str) -> Vec<Sample> {
    let text = scene
        .clone()
        .press(depth)
        .set("press", "step", step)
        .set("press", "hold", "0 s")
        .set("press", "retract", false);
    let scene = Scene::parse(&text.to_string(), Path::new(".")).unwrap();
    let press = Indentation::build(Prepared::build(&scene).unwrap().into()).unwrap();
    let mut record = Record::with_displacements(&press);
    let mut run = press.start(0);
    while let Some(sample) = run.advance() {
        assert!(sample.outcome.is_converged());
        record.push(&run, sample);
    }
    let descent = Descent::at(&press, &Stops::of(&record)).unwrap();
    let bars = descent.probe(&press, |_, _| true).unwrap();
    bars.enter(&mut record.samples);
    record.samples
}

/// Force and half the width of its bar at a depth, mm; linear between samples.
fn at(samples: &[Sample], depth: f64) -> (f64, f64) {
    let after = samples
        .iter()
        .position(|s| s.depth_mm > depth - 1e-9)
        .unwrap();
    let [before, next] = [&samples[after.max(1) - 1], &samples[after.max(1)]];
    let share = (depth - before.depth_mm) / (next.depth_mm - before.depth_mm);
    let between = |of: &dyn Fn(&Sample) -> f64| of(before) + (of(next) - of(before)) * share;
    (
        between(&|s| s.force_n),
        between(&|s| s.error_bar_n.unwrap_or(0.0)),
    )
}

/// A body and tool with known forces.
struct Case {
    name: String,
    scene: SceneText,
    depth: f64,
    step: &'static str,
    known: Vec<Known>,
}

/// Skin, fat and muscle with this Poisson's ratio.
fn stack(nu: f64) -> [Elastic; 3] {
    [
        (2.0, "100 kPa", nu),
        (10.0, "5 kPa", nu),
        (28.0, "30 kPa", nu),
    ]
}

/// Blocks under large strain, computed by CalculiX.
fn blocks() -> Vec<Case> {
    let plain = [(40.0, "30 kPa", 0.45)];
    let lump = Lump::sphere(6.0, "hard", "300 kPa").below(14.0);
    let (extrapolated, spread) = ("F_N_extrapolated", Uncertainty::Column("half_spread_rel"));
    let calculix = "F_N_calculix_block_C3D10";
    let disc = |layers: &[Elastic]| block(100.0, layers).disc(10.0);
    let with_lump = disc(&stack(0.45)).lump(lump);
    let cases = [
        (
            "B1",
            "B1_homogeneous_block",
            disc(&plain),
            12.0,
            extrapolated,
            spread,
        ),
        (
            "B2 0.45",
            "B2_layered_block_nu045",
            disc(&stack(0.45)),
            8.0,
            extrapolated,
            spread,
        ),
        (
            "B2 0.49",
            "B2_layered_block_nu049",
            disc(&stack(0.49)),
            8.0,
            extrapolated,
            spread,
        ),
        (
            "B3c",
            "B3c_lump_under_centre",
            with_lump,
            8.0,
            "F_N_lump_corrected",
            Uncertainty::Share(0.013),
        ),
        (
            "B4",
            "B4_sphere_frictionless_homogeneous",
            block(100.0, &plain).sphere(10.0),
            6.0,
            calculix,
            Uncertainty::Share(0.005),
        ),
    ];
    let cases = cases.into_iter();
    let case =
        |(name, file, scene, depth, column, uncertainty): (&str, &str, _, _, &str, _)| Case {
            name: name.to_owned(),
            scene,
            depth,
            step: "1 mm",
            known: block_forces(&format!("{file}.csv"), column, uncertainty, depth),
        };
    cases.map(case).collect()
}

/// Spheres on layers under small strain, by formula.
fn spheres() -> Vec<Case> {
    let case = |name: String, layers: &[Elastic], known: Vec<Known>| Case {
        name,
        scene: block(160.0, layers).sphere(10.0),
        depth: 1.0,
        step: "0.125 mm",
        known,
    };
    let one = [("0.04", 40.0), ("0.02", 20.0)].map(|(h, depth)| {
        let given = [
            ("h_m", h),
            ("E_Pa", "30000"),
            ("nu", "0.45"),
            ("R_m", "0.01"),
        ];
        let known = sphere_forces("A2_sphere_on_layer.csv", |row| {
            given.iter().all(|(column, value)| row[*column] == *value)
        });
        case(format!("A2 {depth} mm"), &[(depth, "30 kPa", 0.45)], known)
    });
    let two = |above: Elastic, below: Elastic| vec![above, below];
    let stacks = [
        (
            "stiff_over_soft_2_38",
            two((2.0, "100 kPa", 0.45), (38.0, "10 kPa", 0.45)),
        ),
        (
            "stiff_over_soft_5_15",
            two((5.0, "100 kPa", 0.45), (15.0, "10 kPa", 0.45)),
        ),
        (
            "soft_over_stiff_12_28",
            two((12.0, "5 kPa", 0.45), (28.0, "30 kPa", 0.45)),
        ),
        (
            "soft_over_stiff_5_15",
            two((5.0, "10 kPa", 0.45), (15.0, "100 kPa", 0.45)),
        ),
        ("skin_fat_muscle_045", stack(0.45).to_vec()),
        ("skin_fat_muscle_049", stack(0.49).to_vec()),
    ];
    let several = stacks.map(|(name, layers)| {
        let known = sphere_forces("A3_layered_sphere.csv", |row| row["case"] == name);
        case(format!("A3 {name}"), &layers, known)
    });
    one.into_iter().chain(several).collect()
}

#[test]
fn forces_that_are_known_lie_within_the_bars() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("results");
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("error_bars_of_references.csv");
    let mut table = csv::Writer::from_path(path).unwrap();
    table
        .write_record([
            "case",
            "depth_mm",
            "force_n",
            "error_bar_n",
            "known_n",
            "uncertainty_n",
        ])
        .unwrap();
    let (mut n, mut n_inside) = (0_usize, 0_usize);
    for case in blocks().into_iter().chain(spheres()) {
        assert!(!case.known.is_empty(), "{}", case.name);
        let samples = samples(&case.scene, case.depth, case.step);
        for known in &case.known {
            let (force, bar) = at(&samples, known.depth_mm);
            let uncertainty = known.uncertainty * known.force_n;
            let error = known.force_n - force;
            let is_inside = error.abs() <= bar + uncertainty;
            let figures = [known.depth_mm, force, bar, known.force_n, uncertainty];
            let figures = figures.map(|x| format!("{x:.5}"));
            println!(
                "{} {figures:?}{}",
                case.name,
                if is_inside { "" } else { " OUTSIDE" }
            );
            table.write_field(&case.name).unwrap();
            table.write_record(&figures).unwrap();
            (n, n_inside) = (n + 1, n_inside + usize::from(is_inside));
        }
    }
    table.flush().unwrap();
    println!("{n_inside} of {n} inside");
    assert!(n > 40, "{n}");
    assert_eq!(n_inside, n);
}
