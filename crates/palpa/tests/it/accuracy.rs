//! Error bars: they hold what a finer mesh gives.

use std::path::Path;
use std::sync::Arc;

use palpa::Prepared;
use palpa::accuracy::{ErrorBars, loading};
use palpa::press::tissue::{Indentation, Record, Sample};
use palpa::scene::Scene;
use palpa_testkit::{Layer, Scene as SceneText, Value};

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
    let mut record = Record::new(press);
    let mut run = press.start(0);
    while let Some(sample) = run.advance() {
        assert!(sample.outcome.is_converged());
        record.push(&run, sample);
    }
    record
}

fn deepest(record: &Record<'_>) -> Sample {
    loading(&record.samples).last().copied().cloned().unwrap()
}

#[test]
fn the_force_of_a_finer_mesh_lies_within_the_bar() {
    let tools = [
        ("disc", block().set("tool", "radius", "6 mm")),
        (
            "sphere",
            block()
                .set("tool", "shape", "sphere")
                .set("tool", "radius", "8 mm"),
        ),
    ];
    for (name, scene) in tools {
        let coarse = set_up(&scene.clone().set("mesh", "near_tool", "2.5 mm"));
        let fine = set_up(&scene.set("mesh", "near_tool", "1 mm").set(
            "mesh",
            "growth",
            Value::raw("0.4"),
        ));
        let mut record = run(&coarse);
        let bars = ErrorBars::estimate(&record, |_, _| true).unwrap();
        bars.enter(&mut record.samples);
        let sample = deepest(&record);
        let bar = sample.error_bar_n.unwrap();
        let truth = deepest(&run(&fine)).force_n;
        let error = (truth - sample.force_n).abs();
        println!("{name}: {} ± {bar} N, fine {truth} N", sample.force_n);
        assert!(error < bar, "{name}: {error} N, bar {bar} N");
        assert!(bar < 0.4 * sample.force_n, "{name}: {bar} N");
        let parts = [
            sample.error_skin_near_n,
            sample.error_skin_far_n,
            sample.error_levels_near_n,
            sample.error_levels_deep_n,
        ];
        let sum: f64 = parts.iter().map(|part| part.unwrap().abs()).sum();
        assert!((2.0 * sum - bar).abs() < 1e-12 * bar, "{name}");
        // On the way back the bar is that of the same depth on the way down.
        let (down, back): (Vec<&Sample>, Vec<&Sample>) = (record
            .samples
            .iter()
            .filter(|s| s.depth_mm > 0.0 && s.depth_mm < 2.0))
        .partition(|s| s.phase == palpa::press::Phase::Load);
        assert!((down[0].error_bar_n.unwrap() - back[0].error_bar_n.unwrap()).abs() < 1e-9);
    }
}

#[test]
fn probes_can_be_given_up() {
    let press = set_up(&block());
    let record = run(&press);
    let mut asked = Vec::new();
    let bars = ErrorBars::estimate(&record, |probe, n_probes| {
        asked.push((probe, n_probes));
        probe < 1
    });
    assert_eq!(bars, None);
    assert_eq!(asked, [(0, 4), (1, 4)]);
}
