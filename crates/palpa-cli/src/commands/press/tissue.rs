//! A press with the continuum model.

mod fields;
mod mesh_choice;
mod pictures;
mod record;
mod report;
mod result;

use std::sync::Arc;

use palpa_scene::Scene;

use self::pictures::draw_pictures;
use self::record::{record, table};
use self::report::{PressReport, announce, conclude, facts};
use self::result::result_of;
use super::Job;
use super::files::remove_older;
use crate::commands::Outcome;
use palpa::accuracy::{ErrorBars, MeshChoice};
use palpa::press::tissue::{Indentation, Record, SampleOutcome};
use palpa::{Note, Prepared};

/// Runs the press.
pub(super) fn run(job: &Job<'_>) -> anyhow::Result<Outcome> {
    let Job {
        context,
        out,
        scene,
        ..
    } = *job;
    let spinner = context.progress(0, "growing the body");
    let (indentation, choice) = match scene.mesh.accuracy {
        None => {
            let prepared = Arc::new(Prepared::build(scene)?);
            spinner.set_message("setting up the model");
            let indentation = Indentation::build(prepared)?;
            context.begin_recording();
            remove_older(out.path())?;
            (indentation, None)
        }
        Some(accuracy) => match mesh_choice::choose(job, accuracy, &spinner)? {
            Some((indentation, choice)) => (indentation, Some(choice)),
            None => return Ok(Outcome::Interrupted),
        },
    };
    drop(spinner);
    let materials: Vec<_> = materials_of(scene);
    announce(job, &indentation, &materials)?;

    let with_bars = job.args.error_bar || choice.is_some();
    let mut recorded = record(job, &indentation, with_bars)?;
    let bars = if with_bars {
        estimate_bars(job, choice.as_ref(), &mut recorded)?
    } else {
        None
    };
    let result = result_of(&recorded, &materials, context.is_interrupted());
    let notes: Vec<String> = (indentation.notes.iter().chain(&recorded.notes()))
        .map(Note::to_string)
        .collect();
    let report = PressReport {
        model: "tissue",
        scene: job.scene_name,
        body: &indentation.prepared.grown.growth.report,
        materials: &materials,
        press: facts(scene, &indentation),
        result,
        notes: &notes,
        mesh_choice: choice.as_ref(),
        error_bars: bars.as_ref(),
        samples: &recorded.samples,
    };
    out.write_json("press.json", &report)?;
    let pictures = if recorded.samples.len() > 1 {
        draw_pictures(job, &indentation, &recorded, &report.result)?
    } else {
        Vec::new()
    };
    context.json(&report)?;
    conclude(job, &indentation, &report, &pictures)?;
    Ok(match (context.is_interrupted(), report.result.outcome) {
        (true, _) => Outcome::Interrupted,
        (_, SampleOutcome::Converged) => Outcome::Done,
        _ => Outcome::NotGood,
    })
}

/// Estimates the error bars, enters them into the samples and writes the table again; `None` if it
/// was interrupted.
fn estimate_bars(
    job: &Job<'_>,
    choice: Option<&MeshChoice>,
    recorded: &mut Record<'_>,
) -> anyhow::Result<Option<ErrorBars>> {
    let context = job.context;
    let known = choice.and_then(MeshChoice::probed);
    let progress = context.progress(0, "error bar");
    let bars = ErrorBars::estimate(recorded, known, |probe, n_probes| {
        progress.set_message(format!("error bar, probe {} of {n_probes}", probe + 1));
        !context.is_interrupted()
    });
    drop(progress);
    if let Some(bars) = &bars {
        bars.enter(&mut recorded.samples);
        let mut table = table(job)?;
        for sample in &recorded.samples {
            table.push(sample)?;
        }
        table.finish()?;
    }
    Ok(bars)
}

/// Materials of the layers, then of the lumps.
fn materials_of(scene: &Scene) -> Vec<palpa_scene::MaterialStatus> {
    let mut materials = scene.material_status();
    materials.extend(scene.lump_status());
    materials
}
