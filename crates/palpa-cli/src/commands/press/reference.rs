//! A press with the reference method.

mod pictures;
mod record;
mod report;

use self::pictures::draw_pictures;
use self::record::record;
use self::report::{BarReport, announce, conclude, facts, result_of};
use super::Job;
use super::files::remove_older;
use crate::commands::Outcome;
use palpa::Note;
use palpa::build::build;
use palpa::press::reference::{BarIndentation, BarOutcome};

/// Runs the press.
pub(super) fn run(job: &Job<'_>) -> anyhow::Result<Outcome> {
    let Job {
        args,
        context,
        out,
        scene,
        scene_name,
    } = *job;
    let spinner = context.progress(0, "growing the body");
    let built = build(scene)?;
    drop(spinner);
    let indentation = BarIndentation::build(scene, &built)?;
    let notes: Vec<String> = (built.notes.iter().chain(&indentation.notes))
        .map(Note::to_string)
        .collect();
    let materials = scene.material_status();
    announce(context, scene_name, scene, &built, &indentation, &materials)?;

    context.begin_recording();
    remove_older(out.path())?;
    let recorded = record(args, context, out, &built, &indentation)?;
    let result = result_of(&recorded.samples, &materials, context.is_interrupted());
    let report = BarReport {
        model: "reference",
        scene: scene_name.to_owned(),
        body: &built.growth.report,
        materials: &materials,
        press: facts(scene, &indentation),
        result,
        notes: &notes,
        samples: &recorded.samples,
    };
    out.write_json("press.json", &report)?;
    let pictures = if recorded.samples.len() > 1 {
        draw_pictures(out, scene, &built, &indentation, &recorded, &report.result)?
    } else {
        Vec::new()
    };
    context.json(&report)?;
    conclude(context, out.path(), &recorded, &report, &pictures, &notes)?;
    Ok(match (context.is_interrupted(), report.result.outcome) {
        (true, _) => Outcome::Interrupted,
        (_, BarOutcome::Diverged) => Outcome::NotGood,
        _ => Outcome::Done,
    })
}
