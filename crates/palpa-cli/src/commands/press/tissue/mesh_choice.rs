//! Chooses the mesh of a press by its error bar.

use std::time::Duration;

use anyhow::bail;
use indicatif::ProgressBar;
use palpa::accuracy::{End, Goal, MeshChoice, Round, choose_mesh};
use palpa::build::build;
use palpa::press::tissue::Indentation;
use palpa_scene::Mesh;
use palpa_scene::units::Share;

use super::super::Job;
use super::super::files::remove_older;
use crate::table::Table;

/// The press on a mesh with this accuracy, a share, and how the mesh was chosen; `None` if it was
/// interrupted. The meshes that were tried are then kept.
pub(super) fn choose(
    job: &Job<'_>,
    accuracy: f64,
    progress: &ProgressBar,
) -> anyhow::Result<Option<(Indentation, MeshChoice)>> {
    let (context, scene) = (job.context, job.scene);
    let grown = build(scene)?.into();
    let goal = Goal {
        accuracy,
        max_time: scene.mesh.max_time.map(Duration::from_secs_f64),
    };
    let chosen = choose_mesh(scene, &grown, &goal, |rounds| {
        if !rounds.is_empty() {
            // Before, there is nothing to keep.
            context.begin_recording();
        }
        progress.set_message(match rounds.last() {
            None => "choosing the mesh".to_owned(),
            Some(last) => format!(
                "choosing the mesh: {} nodes have an error bar of {}; mesh {}",
                last.n_nodes,
                bar(last),
                rounds.len() + 1
            ),
        });
        !context.is_interrupted()
    })?;
    let Some((indentation, choice)) = chosen else {
        return Ok(None);
    };
    if choice.end == End::Reached {
        // Only the press replaces what was there.
        remove_older(job.out.path())?;
    }
    job.out.write_json("mesh_choice.json", &choice)?;
    say_rounds(job, &choice)?;
    match choice.end {
        End::Reached => Ok(Some((indentation, choice))),
        End::Interrupted => Ok(None),
        _ => bail!("{}", refusal(job, &choice)),
    }
}

fn say_rounds(job: &Job<'_>, choice: &MeshChoice) -> anyhow::Result<()> {
    let mut table = Table::new([
        "mesh",
        "nodes",
        "levels",
        "edge mm",
        "force N",
        "error bar",
        "time s",
    ]);
    for (i, round) in choice.rounds.iter().enumerate() {
        let force = round.probed.as_ref().map(|probed| probed.force_n);
        table.push([
            (i + 1).to_string(),
            round.n_nodes.to_string(),
            round.n_levels.to_string(),
            format!("{:.2}", round.edge_mm),
            force.map_or("–".to_owned(), |force| format!("{force:.4}")),
            bar(round),
            format!("{:.1}", round.seconds),
        ]);
    }
    job.context.say(format!(
        "meshes tried for an error bar of ±{} at the deepest:",
        Share::from_si(choice.accuracy)
    ))?;
    job.context.say(table.to_string())
}

fn bar(round: &Round) -> String {
    match round.half_width {
        Some(half) => format!("±{:.1} %", 100.0 * half),
        None => "none".to_owned(),
    }
}

/// The reason why an accuracy was not reached, and what to do.
fn refusal(job: &Job<'_>, choice: &MeshChoice) -> String {
    let asked = Share::from_si(choice.accuracy);
    let (why, advice) = match choice.end {
        End::MaxVertices { max_vertices } => (
            format!("a finer mesh would have more than {max_vertices} skin vertices"),
            "raise max_vertices in [mesh]",
        ),
        End::MaxLevels => (
            "a finer mesh would have too many levels".to_owned(),
            "make the tool larger or the layers thinner",
        ),
        End::ProbeTooLarge => (
            "a probe of the last mesh would be too large".to_owned(),
            "make the tool larger or the layers thinner",
        ),
        End::MaxTime { expected_s } => (
            format!("with the next mesh the choice would take about {expected_s:.0} s"),
            "raise --max-time",
        ),
        End::Reached | End::Interrupted | End::NoProgress => (
            "finer meshes did not make the error bar smaller".to_owned(),
            "look at the contributions in mesh_choice.json",
        ),
    };
    match choice.half_width() {
        Some(half) => {
            let reached = Mesh {
                accuracy: Some((1000.0 * half).ceil() / 1000.0),
                ..job.scene.mesh
            };
            let can_be_asked = reached.check(&job.scene.tool).is_ok();
            let ask = if let Some(wider) = reached.accuracy.filter(|_| can_be_asked) {
                format!("ask for --accuracy \"{}\", or ", Share::from_si(wider))
            } else {
                String::new()
            };
            format!(
                "an accuracy of {asked} was not reached: {why}. The best mesh has an error bar of ±{:.1} % with {} nodes; \
                 {ask}{advice}",
                100.0 * half,
                choice.rounds[choice.best].n_nodes,
            )
        }
        None => format!(
            "an accuracy of {asked} was not reached: no error bar was found, because the press or a probe has no equilibrium; {advice}"
        ),
    }
}
