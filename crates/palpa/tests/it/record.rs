//! The record of a press: its figures and the notes on its samples.

use std::path::Path;
use std::sync::Arc;

use palpa::press::Phase;
use palpa::press::tissue::{Indentation, Record, Sample};
use palpa::scene::Scene;
use palpa::{Note, Prepared};
use palpa_testkit::{Layer, Scene as SceneText, Value};

/// A block of gel under a ball, with a coarse mesh.
fn gel() -> SceneText {
    SceneText::block([40.0, 40.0, 16.0], 10.0)
        .layer(Layer::elastic("gel", "10 kPa"))
        .sphere(8.0)
        .press(1.0)
        .near_tool(5.0)
        .set("press", "step", "1 mm")
        .set("press", "retract", false)
}

fn indentation(scene: &SceneText) -> Indentation {
    let scene = Scene::parse(&scene.to_string(), Path::new(".")).unwrap();
    Indentation::build(Arc::new(Prepared::build(&scene).unwrap())).unwrap()
}

fn pressed(indentation: &Indentation) -> Record<'_> {
    let mut record = Record::new(indentation);
    let mut run = indentation.start(0);
    while let Some(sample) = run.advance() {
        record.push(&run, sample);
    }
    record
}

/// A record of this sample again and again, each time with one of these changes.
fn changed<'a>(
    indentation: &'a Indentation,
    sample: &Sample,
    changes: &[&dyn Fn(&mut Sample)],
) -> Record<'a> {
    let run = indentation.start(0);
    let mut record = Record::new(indentation);
    for change in changes {
        let mut sample = sample.clone();
        change(&mut sample);
        record.push(&run, sample);
    }
    record
}

#[test]
fn a_contact_of_few_edges_is_noted_and_bonded_skin_is_not() {
    let coarse = indentation(&gel());
    let record = pressed(&coarse);
    let deepest = record.samples.last().unwrap();
    let [
        Note::FewTouching {
            n_vertices,
            radius,
            edge,
        },
    ] = record.notes()[..]
    else {
        panic!("{:?}", record.notes());
    };
    assert_eq!(n_vertices, deepest.n_touching);
    let area = std::f64::consts::PI * radius * radius;
    assert!((area - 1e-6 * deepest.contact_area_mm2).abs() < 1e-15);
    assert!(radius < 3.0 * edge, "{radius} {edge}");
    let wide =
        |s: &mut Sample| s.contact_area_mm2 = 4e6 * std::f64::consts::PI * (3.0 * edge).powi(2);
    assert_eq!(changed(&coarse, deepest, &[&wide]).notes(), []);

    let bonded = indentation(&gel().disc(8.0));
    assert_eq!(pressed(&bonded).notes(), []);
}

#[test]
fn a_failed_step_is_noted_and_its_sample_does_not_count() {
    // Gel that keeps its volume cannot leave the gap of 0.1 mm between disc and bone.
    let gel = r#"{ name = "gel", young = "10 kPa", poisson = 0.4999 }"#;
    let flat = (self::gel().with_layer(0, |layer| layer.set("tissue", Value::raw(gel))))
        .disc(8.0)
        .press(15.9)
        .set("press", "step", "5 mm");
    let press = indentation(&flat);
    let record = pressed(&press);
    let last = record.samples.last().unwrap();
    assert!(!last.outcome.is_converged());
    assert_eq!(record.outcome(), last.outcome);
    assert_eq!(record.converged().len(), record.samples.len() - 1);
    let [Note::StepFailed { depth, .. }, ..] = record.notes()[..] else {
        panic!("{:?}", record.notes());
    };
    assert!((depth - 1e-3 * last.depth_mm).abs() < 1e-12);
    let deepest = &record.samples[record.samples.len() - 2];
    assert_eq!(record.deepest.depth_mm, deepest.depth_mm);
    assert_eq!(record.runs()[0].at_depth_mm, deepest.depth_mm);
}

#[test]
fn hysteresis_is_the_share_of_each_cycles_loading_work_that_is_lost() {
    let press = indentation(&gel().disc(8.0));
    let sample = press.start(0).advance().unwrap();
    let at = |cycle, phase, depth_mm, work_mj| {
        move |s: &mut Sample| {
            (s.cycle, s.phase, s.depth_mm, s.work_mj) = (cycle, phase, depth_mm, work_mj);
        }
    };
    let record = changed(
        &press,
        &sample,
        &[
            &at(0, Phase::Load, 0.0, 0.0),
            &at(0, Phase::Load, 1.0, 4.0),
            &at(0, Phase::Retract, 0.0, 1.0),
            &at(1, Phase::Load, 1.0, 3.0),
            &at(1, Phase::Retract, 0.0, 2.0),
            // A cycle that has not come back has no loss yet.
            &at(2, Phase::Load, 1.0, 4.0),
        ],
    );
    let runs = record.runs();
    assert_eq!(runs.len(), 1);
    assert_eq!(runs[0].hysteresis, [0.25, 0.5]);
    assert_eq!(runs[0].relaxation, None);
    assert_eq!(runs[0].force_after_retract_n, None);
}

#[test]
fn relaxation_is_the_share_of_force_lost_in_the_first_hold() {
    let prony = r#"poisson = 0.45, prony = { terms = [{ g = 0.4, tau = "0.2 s" }] }"#;
    let gel = gel().with_layer(0, |_| {
        Layer::of(&format!(r#"name = "gel", young = "10 kPa", {prony}"#))
    });
    let press = indentation(&gel.disc(8.0).set("press", "hold", "1 s"));
    let record = pressed(&press);
    let [_, top, .., rested] = &record.samples[..] else {
        panic!("{} samples", record.samples.len());
    };
    assert_eq!((top.phase, rested.phase), (Phase::Load, Phase::Hold));
    let share = 1.0 - rested.force_n / top.force_n;
    assert_eq!(record.runs()[0].relaxation, Some(share));
    assert!((0.2..0.5).contains(&share), "{share}");
}
