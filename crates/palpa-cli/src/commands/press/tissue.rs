//! A press with the continuum model.

mod fields;
mod mesh_choice;
mod pictures;
mod record;
mod report;
mod result;

use std::sync::Arc;

use palpa_scene::Scene;

use self::fields::error_grid;
use self::pictures::draw_pictures;
use self::record::{Probing, Recorded, record, table};
use self::report::{PressReport, announce, conclude, facts};
use self::result::result_of;
use super::Job;
use super::files::{ERROR_BARS, remove_older};
use crate::commands::Outcome;
use palpa::accuracy::ErrorBars;
use palpa::press::tissue::{Indentation, SampleOutcome};
use palpa::{Note, Prepared};

/// Notes on a press without error bars.
const NO_SIZE: &str = "there are no error bars, because the force of a single node has no limit on ever finer meshes; \
                       press with a tool that has a size";
const CUT_SHORT: &str =
    "there are no error bars, because the press was interrupted before they were computed";
const NOTHING_TO_PROBE: &str =
    "there are no error bars, because no depth has both a force and an elastic equilibrium";
/// Note on a length of the scene that is not used.
const NEAR_TOOL_REPLACED: &str =
    "`near_tool` of the scene is not used, because --accuracy chooses the lengths near the tool";

/// Runs the press.
pub(super) fn run(job: &Job<'_>) -> anyhow::Result<Outcome> {
    let Job {
        context,
        out,
        scene,
        ..
    } = *job;
    if job.args.lump_change && scene.lumps.is_empty() {
        anyhow::bail!(
            "--lump-change needs a scene with lumps; add a [[lump]], or leave the option out"
        );
    }
    let spinner = context.progress(0, "growing the body");
    let (indentation, choice) = match scene.mesh.accuracy {
        None => {
            let prepared = Arc::new(Prepared::build(scene)?);
            spinner.set_message("setting up the model");
            let indentation = Indentation::build(prepared)?;
            remove_older(out.path())?;
            (indentation, None)
        }
        Some(accuracy) => match mesh_choice::choose(job, accuracy, &spinner)? {
            Some((indentation, choice)) => (indentation, Some(choice)),
            None => return Ok(Outcome::Interrupted),
        },
    };
    context.begin_recording();
    drop(spinner);
    let materials: Vec<_> = materials_of(scene);
    announce(job, &indentation, &materials)?;

    let chosen = choice.as_ref().and_then(|choice| choice.bars.clone());
    let probing = if job.args.no_error_bar || !scene.tool.has_size() {
        Probing::Nothing
    } else if chosen.is_none() || job.args.lump_change {
        Probing::Everything
    } else {
        Probing::LoadSteps
    };
    let Recorded {
        record: mut recorded,
        bars: probed,
        load_step,
    } = record(job, &indentation, probing)?;
    let why_no_bars = match probing {
        _ if job.args.no_error_bar => None,
        Probing::Nothing => Some(NO_SIZE),
        Probing::Everything if probed.is_none() && context.is_interrupted() => Some(CUT_SHORT),
        Probing::Everything if probed.is_none() => Some(NOTHING_TO_PROBE),
        _ => None,
    };
    let (probed, lump_change) = probed.map(|found| (found.bars, found.lumps)).unzip();
    let bars = probed
        .or(chosen)
        .map(|bars| ErrorBars { load_step, ..bars });
    if let Some(bars) = &bars {
        bars.enter(&mut recorded.samples);
        out.write_with(ERROR_BARS, |w| error_grid(&indentation, bars).write(w))?;
        let mut table = table(job)?;
        for sample in &recorded.samples {
            table.push(sample)?;
        }
        table.finish()?;
    }
    let result = result_of(&recorded, &materials, context.is_interrupted());
    let mut notes: Vec<String> = (indentation.notes.iter().chain(&recorded.notes()))
        .map(Note::to_string)
        .collect();
    if job.args.accuracy.is_some() && scene.mesh.near_tool.is_some() {
        notes.push(NEAR_TOOL_REPLACED.to_owned());
    }
    notes.extend(why_no_bars.map(str::to_owned));
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
        lump_change: lump_change.flatten(),
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

/// Materials of the layers, then of the lumps.
fn materials_of(scene: &Scene) -> Vec<palpa_scene::MaterialStatus> {
    let mut materials = scene.material_status();
    materials.extend(scene.lump_status());
    materials
}
