//! `palpa press` with the continuum model: physics that any body must show, and every file that is
//! written.

use std::collections::BTreeSet;
use std::fs;

use palpa::press::tissue::Indentation;
use palpa::{Note, Prepared};
use palpa_scene::{BuiltIn, ModelKind, Scene};
use palpa_testkit::{Layer, Lump, Scene as SceneText, Value as Toml};
use serde_json::Value;
use vtkio::Vtk;
use vtkio::model::{Attribute, DataSet, Piece};

use crate::press::Press;

pub(crate) const SIZE: [f64; 3] = [60.0, 60.0, 24.0];

/// A small block, a fraction of a second a step.
fn block() -> SceneText {
    SceneText::soft_over_stiff(SIZE, 8.0, 8.0, 10.0)
        .press(2.0)
        .set("press", "step", "0.5 mm")
        .set("press", "speed", "10 mm/s")
        .set("press", "hold", "0 s")
        .near_tool(5.0)
}

/// The block with 3 kPa of tension in its soft layer.
fn tense() -> SceneText {
    block().with_layer(0, |soft| soft.set("prestress", "3 kPa"))
}

pub(crate) fn tissue() -> Press {
    Press::with("tissue")
}

fn report(press: &Press, scene: &SceneText) -> Value {
    press.report(scene, &["--frames", "0"])
}

pub(crate) fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is no number"))
}

pub(crate) fn column(report: &Value, name: &str) -> Vec<f64> {
    let samples = report["samples"].as_array().unwrap();
    samples.iter().map(|s| number(&s[name])).collect()
}

fn peak(report: &Value) -> f64 {
    number(&report["result"]["max_force_n"])
}

#[test]
fn an_elastic_block_comes_back_and_every_file_is_there() {
    let press = tissue();
    let report = press.report(&block(), &["--frames", "3"]);
    assert_eq!(report["model"], "tissue");
    assert_eq!(report["result"]["outcome"], "converged");
    assert_eq!(report["result"]["is_complete"], true);
    let force = column(&report, "force_n");
    assert_eq!(force.len(), 9);
    assert!(force[..5].windows(2).all(|f| f[1] > f[0]), "{force:?}");
    // There and back by the same way, and nothing is left.
    for (down, back) in force[..4].iter().zip(force[5..].iter().rev()) {
        assert!((down - back).abs() < 1e-6 * force[4], "{force:?}");
    }
    let run = &report["result"]["runs"][0];
    assert!(number(&run["hysteresis"][0]).abs() < 1e-6, "{run}");
    assert_eq!(run["relaxation"], Value::Null);
    // The work of the tool is in the tissue; the trapezoidal rule takes a little more of a
    // stiffening curve.
    let (energy, work) = (
        column(&report, "energy_mj")[4],
        column(&report, "work_mj")[4],
    );
    assert!((work / energy - 1.0).abs() < 0.02, "{work} and {energy}");
    // The patch has the disc's area.
    let radius = number(&report["press"]["effective_radius_mm"]);
    assert!((radius - 10.0).abs() < 0.01, "{radius}");
    // What the tool presses with, every layer hands on, and the base bears.
    for layer in report["result"]["layers"].as_array().unwrap() {
        let handed_on = number(&layer["force_below_n"]);
        assert!((handed_on / force[4] - 1.0).abs() < 1e-6, "{layer}");
    }
    assert_eq!(report["result"]["gives_most"], "soft");
    let thickness = |i: usize| -> Vec<f64> {
        let samples = report["samples"].as_array().unwrap().iter();
        samples
            .map(|s| number(&s["layer_thickness_mm"][i]))
            .collect()
    };
    let (soft, stiff) = (thickness(0), thickness(1));
    assert!((soft[0] - 8.0).abs() < 1e-9 && (stiff[0] - 16.0).abs() < 1e-9);
    // The patch goes down by 2 mm, of which both layers together give all.
    assert!(
        (soft[4] + stiff[4] - 22.0).abs() < 1e-6,
        "{soft:?} {stiff:?}"
    );

    let out = press.bench.path("out/press");
    for stem in ["force_depth", "force_time", "layers", "section", "stress"] {
        for end in ["svg", "png"] {
            assert!(out.join(format!("{stem}.{end}")).is_file(), "{stem}.{end}");
        }
    }
    assert!(!out.join("relaxation.png").exists());
    let json: Value =
        serde_json::from_str(&fs::read_to_string(out.join("press.json")).unwrap()).unwrap();
    assert_eq!(json, report);
    check_table(&fs::read_to_string(out.join("press.csv")).unwrap(), &report);
    check_series(&out.join("series"));
}

/// The columns of press.csv before the layers: programs read them by these names.
const COLUMNS: [&str; 30] = [
    "run",
    "speed_mm_s",
    "phase",
    "cycle",
    "time_s",
    "depth_mm",
    "force_n",
    "force_x_n",
    "force_y_n",
    "force_z_n",
    "contact_area_mm2",
    "max_pressure_kpa",
    "n_touching",
    "penetration_um",
    "contact_mismatch",
    "residual",
    "iterations",
    "substeps",
    "outcome",
    "energy_mj",
    "work_mj",
    "volume_ratio_min",
    "volume_ratio_max",
    "error_bar_n",
    "extrapolated_n",
    "error_near_n",
    "error_skin_far_n",
    "error_levels_deep_n",
    "error_contact_n",
    "error_load_step_n",
];

/// The table has the fields of the samples and their values.
fn check_table(table: &str, report: &Value) {
    let mut lines = table.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let (fields, layers) = header.split_at(COLUMNS.len());
    assert_eq!(fields, COLUMNS);
    assert_eq!(layers, ["layer_0_soft_mm", "layer_1_stiff_mm"]);
    let samples = report["samples"].as_array().unwrap();
    let keys: BTreeSet<&str> = samples[0]
        .as_object()
        .unwrap()
        .keys()
        .map(String::as_str)
        .collect();
    let expected: BTreeSet<&str> = (fields.iter().copied())
        .chain(["layer_thickness_mm"])
        .collect();
    assert_eq!(keys, expected);
    let mut n = 0;
    for (line, sample) in lines.zip(samples) {
        let row: Vec<&str> = line.split(',').collect();
        assert_eq!(row.len(), header.len(), "{line}");
        let at = |name: &str| row[header.iter().position(|h| *h == name).unwrap()];
        for name in ["depth_mm", "force_n", "volume_ratio_min"] {
            let (row, sample) = (at(name).parse::<f64>().unwrap(), number(&sample[name]));
            assert!(
                (row - sample).abs() <= 1e-12 * sample.abs(),
                "{name}: {row}, {sample}"
            );
        }
        assert_eq!(at("phase"), sample["phase"].as_str().unwrap());
        let thickness = number(&sample["layer_thickness_mm"][1]);
        let column: f64 = at("layer_1_stiff_mm").parse().unwrap();
        assert!((column - thickness).abs() < 1e-9);
        n += 1;
    }
    assert_eq!(n, samples.len());
}

/// The point and cell arrays of a file for ParaView.
pub(crate) fn arrays(path: &std::path::Path) -> [Vec<Attribute>; 2] {
    let DataSet::UnstructuredGrid { pieces, .. } = Vtk::import(path).unwrap().data else {
        panic!("no unstructured grid");
    };
    let Some(Piece::Inline(piece)) = pieces.into_iter().next() else {
        panic!("no piece");
    };
    [piece.data.point, piece.data.cell]
}

pub(crate) fn array(attributes: &[Attribute], name: &str) -> Vec<f64> {
    let found = attributes.iter().find_map(|a| match a {
        Attribute::DataArray(array) if array.name == name => Some(array),
        _ => None,
    });
    let data = &found.unwrap_or_else(|| panic!("no {name}")).data;
    data.clone().cast_into().unwrap()
}

/// Names and numbers of the arrays in the deepest frame of a series.
fn check_series(folder: &std::path::Path) {
    assert_eq!(fs::read_dir(folder).unwrap().count(), 3);
    let [point, cell] = arrays(&folder.join("body_001.vtu"));
    let cells = |name: &str| array(&cell, name);
    let points = |name: &str| array(&point, name);
    let von_mises = cells("von_mises");
    let cauchy = cells("cauchy");
    assert_eq!(cauchy.len(), 9 * von_mises.len());
    let pressure = cells("pressure");
    for (s, p) in cauchy.chunks(9).zip(&pressure) {
        assert!(((s[0] + s[4] + s[8]) / 3.0 + p).abs() < 1e-6 * (1.0 + p.abs()));
    }
    assert!(von_mises.iter().all(|s| *s >= 0.0) && von_mises.iter().any(|s| *s > 500.0));
    let (least, most) = (cells("stretch_min"), cells("stretch_max"));
    assert!(
        least
            .iter()
            .zip(&most)
            .all(|(a, b)| *a <= *b && *a > 0.3 && *b < 3.0)
    );
    assert!(cells("volume_ratio").iter().all(|j| (0.5..1.5).contains(j)));
    assert!(cells("strain_energy").iter().all(|w| *w >= -1e-9));
    let is_layer = |l: &f64| [0.0, 1.0].contains(l);
    assert!(cells("layer").iter().all(is_layer));
    // The pressure on the skin is the force, as far as skin is under the disc.
    let contact = points("contact_pressure");
    assert!(contact.iter().any(|p| *p > 500.0));
    let displacement = points("displacement");
    let deepest = displacement.iter().copied().fold(0.0, f64::min);
    assert!((deepest + 2e-3).abs() < 1e-9, "{deepest}");
    for name in ["force", "thinning", "is_base", "cut_face"] {
        assert!(!points(name).is_empty());
    }
}

#[test]
fn a_viscous_block_loses_work_relaxes_and_is_stiffer_when_it_is_pressed_fast() {
    let press = tissue();
    let prony = r#"poisson = 0.45, prony = { terms = [{ g = 0.4, tau = "0.2 s" }] }"#;
    let layer = |name, young| {
        Layer::of(&format!(r#"name = "{name}", young = "{young}", {prony}"#)).levels(2)
    };
    let steps = block().set("press", "step", "1 mm");
    let elastic = report(&press, &steps);
    let viscous = steps
        .with_layer(0, |_| layer("soft", "10 kPa").thick(8.0))
        .with_layer(1, |_| layer("stiff", "40 kPa"))
        .without("press", "speed")
        .set("press", "speeds", Toml::raw(r#"["2 mm/s", "50 mm/s"]"#))
        .set("press", "hold", "1 s")
        .set("press", "cycles", Toml::raw("2"));
    let viscous = report(&press, &viscous);
    let runs = viscous["result"]["runs"].as_array().unwrap();
    assert_eq!(runs.len(), 2);
    let of = |run: usize, name: &str| number(&runs[run][name]);
    // At rest it is as stiff as the elastic one, at once by 1/(1 - 0.4).
    let (slow, fast) = (
        of(0, "max_force_n") / peak(&elastic),
        of(1, "max_force_n") / peak(&elastic),
    );
    assert!(
        1.0 < slow && slow < fast && fast < 1.0 / 0.6,
        "{slow} {fast}"
    );
    // After 1 s, five time constants, the fast one has lost nearly all that it can: 0.4, less what
    // went on the way down.
    assert!(
        (of(1, "relaxation") - (1.0 - 1.0 / fast)).abs() < 0.01,
        "{runs:?}"
    );
    assert!(of(0, "relaxation") < of(1, "relaxation"));
    for run in runs {
        let losses: Vec<f64> = run["hysteresis"]
            .as_array()
            .unwrap()
            .iter()
            .map(number)
            .collect();
        assert_eq!(losses.len(), 2);
        assert!(
            losses.iter().all(|loss| (0.02..1.0).contains(loss)),
            "{losses:?}"
        );
    }
    // Time passes as the script says, and starts anew in every run.
    let time = column(&viscous, "time_s");
    assert!((time.iter().copied().fold(0.0, f64::max) - 2.0 * (2.0 + 1.0)).abs() < 1e-9);
    assert_eq!(time.iter().filter(|t| **t == 0.0).count(), 2);
    assert!(press.bench.path("out/press/relaxation.png").is_file());
}

#[test]
fn a_lump_is_felt_and_a_coarse_mesh_feels_it_as_a_fine_one_does() {
    let press = tissue();
    // Its own stiffness against that of the layer it lies in, on the same mesh.
    let felt = |near_lumps: f64| {
        let force = |young: &str| {
            let scene = block()
                .set("press", "step", "2 mm")
                .set("press", "retract", false)
                .lump(Lump::sphere(5.0, "lump", young).below(14.0))
                .growth(0.3)
                .set("mesh", "near_lumps", Toml::length(near_lumps));
            let report = report(&press, &scene);
            (peak(&report), number(&report["press"]["n_nodes"]))
        };
        let ((soft, n), (hard, _)) = (force("40 kPa"), force("400 kPa"));
        (hard / soft - 1.0, n)
    };
    let ((coarse, n_coarse), (fine, n_fine)) = (felt(12.0), felt(3.0));
    assert!(n_fine > 1.5 * n_coarse, "{n_coarse} and {n_fine} nodes");
    assert!(fine > 0.02, "{fine}");
    assert!((coarse / fine - 1.0).abs() < 0.2, "{coarse} and {fine}");
}

#[test]
fn tools_touch_push_and_never_pull() {
    let press = tissue();
    let punch = block()
        .tool("flat-punch", 8.0)
        .set("tool", "edge_radius", "2 mm")
        .set("tool", "friction", 0.3);
    let cone = block().tool("cone", 8.0).set("tool", "friction", 0.3);
    for (tool, scene) in [
        ("sphere", block().sphere(12.0)),
        ("punch", punch),
        ("cone", cone),
    ] {
        let report = report(&press, &scene);
        assert_eq!(report["result"]["outcome"], "converged", "{tool}");
        let force = column(&report, "force_n");
        let top = peak(&report);
        assert!(
            force[0] == 0.0 && force[..5].windows(2).all(|f| f[1] > f[0]),
            "{force:?}"
        );
        assert!(force.iter().all(|f| *f > -1e-9 * top), "{force:?}");
        assert!(force.last().unwrap().abs() < 1e-6 * top, "{force:?}");
        let mismatches = column(&report, "contact_mismatch");
        assert!(
            mismatches.iter().all(|m| *m < 1e-4),
            "{tool}: {mismatches:?}"
        );
        let depths = column(&report, "penetration_um");
        assert!(depths.iter().all(|d| *d < 500.0), "{tool}: {depths:?}");
        let area = column(&report, "contact_area_mm2");
        assert!(area[4] > area[1] || tool == "punch", "{area:?}");
        assert_eq!(report["press"]["effective_radius_mm"], Value::Null);
    }
}

#[test]
fn tension_of_the_skin_carries_part_of_the_force() {
    let press = tissue();
    let [slack, tense] =
        [block(), tense()].map(|scene| report(&press, &scene.set("body", "cut_faces", "fixed")));
    assert!(
        peak(&tense) > 1.03 * peak(&slack),
        "{} and {}",
        peak(&tense),
        peak(&slack)
    );
    // It is at rest before it is pressed.
    assert!(column(&tense, "force_n")[0].abs() < 1e-6 * peak(&tense));
}

#[test]
fn inertia_counts_when_it_is_asked_for() {
    let press = tissue();
    let fast = block()
        .set("press", "speed", "1 m/s")
        .set("press", "retract", false);
    let damping = Toml::raw(r#"{ mass = "20 1/s", stiffness = "1 ms" }"#);
    let dynamic = fast
        .clone()
        .set("model", "dynamics", "implicit")
        .set("model", "damping", damping);
    let [still, moving] = [fast, dynamic].map(|scene| report(&press, &scene));
    assert_eq!(moving["press"]["is_dynamic"], true);
    assert!(
        peak(&moving) > 1.1 * peak(&still),
        "{} and {}",
        peak(&moving),
        peak(&still)
    );
}

#[test]
fn a_step_that_fails_is_told_and_what_was_done_is_kept() {
    let press = tissue();
    // The whole block under a disc, pressed flat.
    let deep = block()
        .sized([30.0, 30.0, 24.0], 8.0)
        .press(23.5)
        .set("press", "step", "5 mm");
    press.bench.file("deep.toml", deep);
    let (code, stdout, stderr) = press.run(&["deep.toml", "--json", "--frames", "0"]);
    assert_eq!(code, 1, "{stderr}");
    let report: Value = serde_json::from_str(&stdout).unwrap();
    let samples = report["samples"].as_array().unwrap();
    assert!(samples.len() > 1);
    let (last, before) = (&samples[samples.len() - 1], &samples[samples.len() - 2]);
    assert_eq!(last["outcome"], report["result"]["outcome"]);
    assert_ne!(last["outcome"], "converged");
    assert_eq!(last["force_n"], before["force_n"]);
    assert_eq!(report["result"]["is_complete"], false);
    assert_eq!(
        report["result"]["failures"][0]["depth_mm"],
        last["depth_mm"]
    );
    let notes = report["notes"].to_string();
    assert!(notes.contains("FAILED"), "{notes}");
}

#[test]
fn what_a_continuum_cannot_be_is_refused() {
    let press = tissue();
    let soft = |tissue: &str| block().with_layer(0, |_| Layer::of(tissue).thick(8.0).levels(2));
    let messages: Vec<String> = [
        (
            "spring.toml",
            soft(r#"name = "soft", spring = "90 dyn/cm""#),
        ),
        (
            "mixed.toml",
            soft(r#"name = "soft", law = "linear", young = "10 kPa", poisson = 0.45"#),
        ),
        ("deep.toml", block().press(25.0)),
        (
            "outward.toml",
            block().set("press", "direction", Toml::raw("[0, 0, 1]")),
        ),
    ]
    .into_iter()
    .map(|(name, scene)| press.refusal(&[press.bench.file(name, scene)]))
    .collect();
    insta::assert_snapshot!(messages.join("\n"));
}

/// The notes of an indentation that is set up, or why it is not.
fn set_up(scene: &SceneText) -> Result<String, String> {
    let scene = Scene::parse(&scene.to_string(), std::path::Path::new(".")).unwrap();
    let prepared = Prepared::build(&scene).map_err(|error| format!("{error:#}"))?;
    let indentation = Indentation::build(prepared.into()).map_err(|error| format!("{error:#}"))?;
    let notes: Vec<String> = indentation.notes.iter().map(Note::to_string).collect();
    Ok(notes.join("\n"))
}

#[test]
fn a_lump_outside_the_tissue_is_refused_and_one_across_the_skin_noted() {
    let with_lump = |z: f64| {
        let stone = Lump::sphere(4.0, "hard", "100 kPa").at([0.0, 0.0, z]);
        let scene = block()
            .lump(stone.set("name", "stone"))
            .set("mesh", "near_lumps", "8 mm");
        set_up(&scene)
    };
    let refusal = with_lump(500.0).unwrap_err();
    for part in ["\"stone\"", "(0.0, 0.0, 500.0) mm", "outside the tissue"] {
        assert!(refusal.contains(part), "{refusal}");
    }
    let half = with_lump(0.0).unwrap();
    assert!(half.contains("% of the lump \"stone\" at"), "{half}");
    let inside = with_lump(-12.0).unwrap();
    assert!(!inside.contains("stone"), "{inside}");
}

#[test]
fn free_cut_faces_under_tension_are_noted() {
    let says_so = |scene: &SceneText| set_up(scene).unwrap().contains("cut faces are free");
    assert!(says_so(&tense()) && !says_so(&block()));
    assert!(!says_so(&tense().set("body", "cut_faces", "fixed")));
}

#[test]
fn prisms_turned_inside_out_at_a_corner_are_noted() {
    let press = tissue();
    let deep = block()
        .disc(8.0)
        .press(9.0)
        .set("press", "retract", false)
        .near_tool(2.0);
    let [deep, shallow] = [deep, block()].map(|scene| report(&press, &scene));
    let turned = |report: &Value| {
        let is_noted = report["notes"].to_string().contains("inside out");
        (number(&report["result"]["n_turned_prisms"]), is_noted)
    };
    assert!(
        turned(&deep).0 > 0.0 && turned(&deep).1,
        "{:?}",
        turned(&deep)
    );
    assert_eq!(turned(&shallow), (0.0, false));
    // At rest there is no force of which a share could be out of balance.
    let residuals = column(&shallow, "residual");
    let worst = residuals[1..].iter().copied().fold(0.0, f64::max);
    assert_eq!(shallow["result"]["worst"]["residual"], worst);
}

#[test]
fn the_built_in_scenes_can_be_set_up() {
    let mut n = 0;
    for built_in in BuiltIn::all().iter().filter(|b| !b.is_template) {
        let scene = built_in.scene().unwrap();
        if scene.model.kind == ModelKind::Reference {
            continue;
        }
        let refines = scene.mesh.refine;
        let indentation = Indentation::build(Prepared::build(&scene).unwrap().into()).unwrap();
        let sample = indentation.start(0).advance().unwrap();
        let is_at_rest = sample.outcome.is_converged() && sample.force_n.abs() < 1e-12;
        assert!(is_at_rest, "{}: {sample:?}", built_in.key);
        assert!(
            indentation.mesh().is_resolved || !refines,
            "{}",
            built_in.key
        );
        n += 1;
    }
    assert_eq!(n, 10);
}
