//! Error bars: they hold what a finer mesh gives.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use palpa::Prepared;
use palpa::accuracy::{
    Descent, End, ErrorBars, Goal, MeshChoice, SAFETY, Stops, change_by_lumps, choose_mesh,
    loading, wide,
};
use palpa::press::Phase;
use palpa::press::tissue::{Indentation, Record, Sample};
use palpa::scene::Scene;
use palpa_testkit::{Layer, Lump, Scene as SceneText, Value};

/// A soft layer under a stiff one.
fn block() -> SceneText {
    SceneText::block([60.0, 60.0, 20.0], 10.0)
        .layer(Layer::elastic("stiff", "60 kPa").thick(4.0))
        .layer(Layer::elastic("soft", "10 kPa").levels(3))
        .press(3.0)
        .set("press", "step", "1.5 mm")
}

fn set_up(scene: &SceneText) -> Indentation {
    let scene = Scene::parse(&scene.to_string(), Path::new(".")).unwrap();
    Indentation::build(Arc::new(Prepared::build(&scene).unwrap())).unwrap()
}

fn run(press: &Indentation) -> Record<'_> {
    let mut record = Record::with_displacements(press);
    let mut run = press.start(0);
    while let Some(sample) = run.advance() {
        assert!(sample.outcome.is_converged());
        record.push(&run, sample);
    }
    record
}

fn bars_of(record: &Record<'_>, progress: impl FnMut(usize, usize) -> bool) -> Option<ErrorBars> {
    Descent::at(record.indentation(), &Stops::of(record))?.probe(record.indentation(), progress)
}

fn deepest(record: &Record<'_>) -> Sample {
    loading(&record.samples, 0)
        .last()
        .copied()
        .cloned()
        .unwrap()
}

#[test]
fn the_force_of_a_finer_mesh_lies_within_the_bar() {
    let tools = [
        ("disc", 1.0, block().set("tool", "radius", "6 mm")),
        (
            "sphere",
            1.5,
            block()
                .set("tool", "shape", "sphere")
                .set("tool", "radius", "8 mm"),
        ),
    ];
    for (name, order, scene) in tools {
        let coarse = set_up(&scene.clone().set("mesh", "near_tool", "2.5 mm"));
        let fine = set_up(&scene.set("mesh", "near_tool", "1 mm").set(
            "mesh",
            "growth",
            Value::raw("0.4"),
        ));
        let mut record = run(&coarse);
        let bars = bars_of(&record, |_, _| true).unwrap();
        bars.enter(&mut record.samples);
        let sample = deepest(&record);
        let bar = sample.error_bar_n.unwrap();
        let truth = deepest(&run(&fine)).force_n;
        let error = (truth - sample.force_n).abs();
        println!("{name}: {} ± {bar} N, fine {truth} N", sample.force_n);
        assert!(error < bar, "{name}: {error} N, bar {bar} N");
        // What the finer mesh still lacks, by the order of convergence.
        let lacks = (1.0_f64 / 2.5).powf(order);
        let limit = sample.force_n + (truth - sample.force_n) / (1.0 - lacks);
        let extrapolated = sample.extrapolated_n.unwrap();
        println!("{name}: extrapolated {extrapolated} N, limit {limit} N");
        let left = (limit - extrapolated).abs();
        // Where the error is as small as the scatter between meshes, extrapolation cannot help.
        assert!(left < 0.5 * bar, "{name}: {left}");
        assert!(bar < 0.4 * sample.force_n, "{name}: {bar} N");
        let parts = [
            sample.error_near_n,
            sample.error_skin_far_n,
            sample.error_levels_deep_n,
        ];
        let rest = SAFETY * sample.error_contact_n.unwrap();
        let sum = wide(parts.map(Option::unwrap), name == "disc") + rest;
        assert!((sum - bar).abs() < 1e-12 * bar, "{name}");
        // On the way back the bar is that of the same depth on the way down.
        let (down, back): (Vec<&Sample>, Vec<&Sample>) = (record
            .samples
            .iter()
            .filter(|s| s.depth_mm > 0.0 && s.depth_mm < 2.0))
        .partition(|s| s.phase == palpa::press::Phase::Load);
        let [down, back] = [down, back].map(|samples| samples[0].error_bar_n.unwrap());
        assert!((down - back).abs() < 1e-4 * down, "{name}: {down}, {back}");
    }
}

#[test]
fn probes_can_be_given_up() {
    let press = set_up(&block());
    let record = run(&press);
    let mut asked = Vec::new();
    let bars = bars_of(&record, |probe, n_probes| {
        asked.push((probe, n_probes));
        probe < 1
    });
    assert_eq!(bars, None);
    // Before each depth too.
    asked.dedup();
    assert_eq!(asked, [(0, 3), (1, 3)]);
}

#[test]
fn each_run_has_the_bars_of_its_own_forces() {
    let press = set_up(&block().set("mesh", "near_tool", "4 mm"));
    let mut record = run(&press);
    let bars = bars_of(&record, |_, _| true).unwrap();
    // A run at another speed, with twice the forces.
    let twice: Vec<Sample> = (record.samples.iter())
        .map(|sample| Sample {
            run: 1,
            force_n: 2.0 * sample.force_n,
            ..sample.clone()
        })
        .collect();
    let n = twice.len();
    record.samples.extend(twice);
    bars.enter(&mut record.samples);
    for (one, two) in record.samples.iter().zip(&record.samples[n..]) {
        let [one, two] = [one, two].map(|sample| sample.error_bar_n.unwrap());
        assert!((two - 2.0 * one).abs() < 1e-12);
    }
    assert!(deepest(&record).error_bar_n.unwrap() > 0.0);
}

#[test]
fn halved_load_steps_change_the_force_as_longer_ones_foretell() {
    let relaxing = r#"name = "gel", young = "20 kPa", poisson = 0.45, prony = { terms = [{ g = 0.6, tau = "0.1 s" }] }"#;
    let viscous = |step: &str| {
        set_up(
            &SceneText::block([40.0, 40.0, 20.0], 10.0)
                .layer(Layer::of(relaxing).levels(2))
                .press(2.0)
                .set("press", "speed", "10 mm/s")
                .set("press", "step", step),
        )
    };
    let force = |press: &Indentation| deepest(&run(press)).force_n;
    let (long, short) = (viscous("0.5 mm"), viscous("0.25 mm"));
    let (at_long, at_short) = (force(&long), force(&short));
    let expected = at_short / at_long - 1.0;
    let foretold = long.load_step_change(at_long, || true).unwrap();
    assert!(expected.abs() > 1e-5, "{expected}");
    // Here the error is of second order, so that what is foretold is twice the change.
    let ratio = foretold / expected;
    assert!((0.9..2.5).contains(&ratio), "{foretold}, halved {expected}");
    assert_eq!(long.load_step_change(at_long, || false), None);
    // Elastic tissue without friction has no history.
    assert_eq!(set_up(&block()).load_step_change(1.0, || true), None);
}

#[test]
fn the_bars_of_relaxed_tissue_fit_its_own_force() {
    let relaxing = r#"name = "gel", young = "20 kPa", poisson = 0.45, prony = { terms = [{ g = 0.6, tau = "0.1 s" }] }"#;
    let press = set_up(
        &SceneText::block([40.0, 40.0, 20.0], 10.0)
            .layer(Layer::of(relaxing).levels(2))
            .disc(8.0)
            .press(2.0)
            .set("press", "speed", "10 mm/s")
            .set("press", "hold", "0.5 s")
            .set("press", "step", "0.5 mm"),
    );
    let mut record = run(&press);
    let bars = bars_of(&record, |_, _| true).unwrap();
    bars.enter(&mut record.samples);
    let share = |s: &Sample| s.error_bar_n.unwrap() / s.force_n.abs();
    let extrapolated = |s: &Sample| s.extrapolated_n.unwrap() / s.force_n;
    let deepest = deepest(&record);
    let of = |phase: Phase| record.samples.iter().filter(move |s| s.phase == phase);
    let held = of(Phase::Hold).next_back().unwrap();
    assert!(held.force_n < 0.9 * deepest.force_n);
    assert!((share(held) - share(&deepest)).abs() < 1e-9);
    assert!((extrapolated(held) - extrapolated(&deepest)).abs() < 1e-9);
    // The tissue has not come back: the disc pulls.
    let last = of(Phase::Retract).next_back().unwrap();
    assert!(last.force_n < -0.05, "{}", last.force_n);
    assert!(share(last) > 0.01, "{}", share(last));
    assert!(of(Phase::Retract).all(|s| s.extrapolated_n.is_none()));
}

#[test]
fn the_change_by_a_lump_on_a_finer_mesh_lies_within_its_bar() {
    let lump = Lump::sphere(4.0, "hard", "200 kPa").below(9.0);
    let scene = block().lump(lump).set("tool", "radius", "6 mm");
    let change_on = |edge: &str| {
        let press = set_up(&scene.clone().set("mesh", "near_tool", edge));
        let descent = Descent::from_rest(&press, || true).unwrap();
        let bars = descent.probe(&press, |_, _| true).unwrap();
        assert_eq!(bars.moves[0].len(), press.model.n_nodes());
        let change = change_by_lumps(&press, &descent, &bars, || true).unwrap();
        assert_eq!(
            change_by_lumps(&press, &descent, &bars, || false).unwrap(),
            None
        );
        change.unwrap()
    };
    let (coarse, fine) = (change_on("2.5 mm"), change_on("1.6 mm"));
    let bar = coarse.error_bar_n.unwrap();
    let error = (coarse.change_n - fine.change_n).abs();
    println!("{} ± {bar} N, fine {} N", coarse.change_n, fine.change_n);
    assert!(error < bar, "{error} N");
    assert!(bar < 0.2 * coarse.change_n);
}

/// The choice of a mesh for the block under a ball.
fn choose(
    accuracy: f64,
    max_time: Option<Duration>,
    max_vertices: &str,
) -> (Indentation, MeshChoice) {
    let scene = block()
        .set("tool", "shape", "sphere")
        .set("tool", "radius", "20 mm")
        .set("mesh", "max_vertices", Value::raw(max_vertices));
    let scene = Scene::parse(&scene.to_string(), Path::new(".")).unwrap();
    let grown = Arc::new(palpa::build::build(&scene).unwrap());
    let goal = Goal { accuracy, max_time };
    let chosen = choose_mesh(&scene, &grown, &goal, |_| true).unwrap();
    let (press, choice) = chosen.unwrap();
    assert_eq!(press.model.n_nodes(), choice.rounds[choice.best].n_nodes);
    (press, choice)
}

#[test]
fn a_mesh_is_as_fine_as_the_accuracy_asks() {
    let (coarse_press, coarse) = choose(0.5, None, "20000");
    let wide = coarse.half_width().unwrap();
    let (fine_press, fine) = choose(0.7 * wide, None, "20000");
    assert_eq!((coarse.end, fine.end), (End::Reached, End::Reached));
    assert!(wide <= 0.5 && fine.half_width().unwrap() <= 0.7 * wide);
    assert!(fine_press.model.n_nodes() > coarse_press.model.n_nodes());
    let force = |choice: &MeshChoice| {
        let probed = choice.rounds[choice.best].probed.as_ref();
        probed.unwrap().force_n
    };
    let (coarse, fine) = (force(&coarse), force(&fine));
    assert!(coarse != fine && (coarse - fine).abs() < wide * coarse);
}

#[test]
fn a_choice_says_which_limit_it_met_and_keeps_the_best_mesh() {
    let (_, choice) = choose(0.002, None, "150");
    let end = End::MaxVertices { max_vertices: 150 };
    assert_eq!(choice.end, end);
    assert!(choice.half_width().unwrap() > 0.002);
    let (_, choice) = choose(0.002, Some(Duration::ZERO), "20000");
    assert!(matches!(choice.end, End::MaxTime { expected_s } if expected_s > 0.0));
    assert_eq!(choice.rounds.len(), 1);
}

#[test]
fn an_interrupted_choice_keeps_the_best_mesh_so_far() {
    let scene = Scene::parse(&block().to_string(), Path::new(".")).unwrap();
    let grown = Arc::new(palpa::build::build(&scene).unwrap());
    let goal = Goal {
        accuracy: 0.002,
        max_time: None,
    };
    let choose = |n_rounds: usize| {
        choose_mesh(&scene, &grown, &goal, |rounds| rounds.len() < n_rounds).unwrap()
    };
    let (press, choice) = choose(1).unwrap();
    assert_eq!((choice.end, choice.rounds.len()), (End::Interrupted, 1));
    assert_eq!(press.model.n_nodes(), choice.rounds[0].n_nodes);
    assert!(choice.half_width().unwrap() > goal.accuracy);
    assert!(choose(0).is_none(), "nothing was computed");
}

#[test]
fn a_single_node_has_no_accuracy() {
    let scene = block().set("tool", "shape", "node");
    let scene = Scene::parse(&scene.to_string(), Path::new(".")).unwrap();
    let grown = Arc::new(palpa::build::build(&scene).unwrap());
    let goal = Goal {
        accuracy: 0.1,
        max_time: None,
    };
    let why = choose_mesh(&scene, &grown, &goal, |_| true).unwrap_err();
    assert!(why.to_string().contains("single node"), "{why}");
}
