//! The reports of an indentation, for machines and for people.

use std::path::{Path, PathBuf};

use palpa_mesh::growth::GrowthReport;
use palpa_scene::{MaterialStatus, Scene};
use serde::Serialize;

use super::super::words::{say_layers, status_line};
use super::record::BarRecord;
use crate::cli::Context;
use crate::table::Table;
use palpa::build::{BuiltBody, in_mm};
use palpa::press::Phase;
use palpa::press::reference::{BarIndentation, BarOutcome, BarSample};

/// Content of press.json and of the `--json` output.
#[derive(Debug, Serialize)]
pub(super) struct BarReport<'a> {
    pub(super) model: &'static str,
    pub(super) scene: String,
    pub(super) body: &'a GrowthReport,
    pub(super) materials: &'a [MaterialStatus],
    pub(super) press: BarFacts,
    pub(super) result: BarResult,
    pub(super) notes: &'a [String],
    pub(super) samples: &'a [BarSample],
}

#[derive(Debug, Serialize)]
pub(super) struct BarFacts {
    /// The skin vertex nearest to the place.
    pub(super) vertex: usize,
    /// The place: the point of the skin nearest to `asked_m`, or the vertex of the scene.
    pub(super) at_m: [f64; 3],
    /// The point that the scene names, and its distance from the place; `None` if the scene names a
    /// vertex or nothing.
    pub(super) asked_m: Option<[f64; 3]>,
    pub(super) asked_distance_mm: Option<f64>,
    pub(super) direction: [f64; 3],
    pub(super) tool: String,
    pub(super) n_operated_nodes: usize,
    pub(super) mesh_size_near_tool_mm: f64,
    pub(super) tissue_depth_mm: f64,
    pub(super) substeps: u32,
}

#[derive(Debug, Serialize)]
pub(super) struct BarResult {
    pub(super) outcome: BarOutcome,
    /// Whether the whole script was run; false after Ctrl-C or a divergence.
    pub(super) is_complete: bool,
    pub(super) max_force_n: f64,
    pub(super) at_depth_mm: f64,
    pub(super) secant_stiffness_n_per_mm: Option<f64>,
    pub(super) force_after_retract_n: Option<f64>,
    /// Depth from which prisms are inverted, so that the force comes from the bars alone.
    pub(super) inverted_from_mm: Option<f64>,
    pub(super) material_status: String,
}

pub(super) fn facts(scene: &Scene, indentation: &BarIndentation) -> BarFacts {
    BarFacts {
        vertex: indentation.place.vertex,
        at_m: indentation.place.at.into(),
        asked_m: indentation.place.asked.map(Into::into),
        asked_distance_mm: indentation.place.distance_asked().map(|d| d * 1e3),
        direction: indentation.place.direction.into_inner().into(),
        tool: scene.tool.to_string(),
        n_operated_nodes: indentation.model.operated().len(),
        mesh_size_near_tool_mm: indentation.mesh_size * 1e3,
        tissue_depth_mm: indentation.place.tissue_depth * 1e3,
        substeps: scene.reference.substeps,
    }
}

pub(super) fn result_of(
    samples: &[BarSample],
    materials: &[MaterialStatus],
    is_interrupted: bool,
) -> BarResult {
    let good: Vec<&BarSample> = samples
        .iter()
        .filter(|s| s.outcome != BarOutcome::Diverged)
        .collect();
    let max = good.iter().max_by(|a, b| a.force_n.total_cmp(&b.force_n));
    let (max_force_n, at_depth_mm) = max.map_or((0.0, 0.0), |s| (s.force_n, s.depth_mm));
    let is_any = |outcome: BarOutcome| samples.iter().any(|s| s.outcome == outcome);
    BarResult {
        is_complete: !is_interrupted && !is_any(BarOutcome::Diverged),
        outcome: match () {
            () if is_any(BarOutcome::Diverged) => BarOutcome::Diverged,
            () if is_any(BarOutcome::EulerFallback) => BarOutcome::EulerFallback,
            () => BarOutcome::Converged,
        },
        max_force_n,
        at_depth_mm,
        secant_stiffness_n_per_mm: (at_depth_mm > 0.0).then(|| max_force_n / at_depth_mm),
        force_after_retract_n: good
            .last()
            .filter(|s| s.phase == Phase::Retract && s.depth_mm == 0.0)
            .map(|s| s.force_n),
        inverted_from_mm: good.iter().find(|s| s.n_inverted > 0).map(|s| s.depth_mm),
        material_status: status_line(materials),
    }
}

pub(super) fn announce(
    context: &Context,
    scene_name: &str,
    scene: &Scene,
    built: &BuiltBody,
    indentation: &BarIndentation,
    materials: &[MaterialStatus],
) -> anyhow::Result<()> {
    let r = &built.growth.report;
    context.say(format!(
        "{scene_name}: {} skin vertices × {} levels = {} nodes, {} prisms, all valid (scaled Jacobian: smallest {:.2}, \
         5 % below {:.2})",
        r.n_vertices, r.n_levels, r.n_nodes, r.n_prisms, r.scaled_jacobian.min, r.scaled_jacobian.p05
    ))?;
    say_layers(context, scene, r, materials)?;
    context.say(format!(
        "reference method; {} holding {} nodes at ({}) mm, where the tissue is {:.1} mm deep; skin edges near the tool \
         {:.1} mm",
        scene.tool,
        indentation.model.operated().len(),
        in_mm(indentation.place.at),
        indentation.place.tissue_depth * 1e3,
        indentation.mesh_size * 1e3
    ))
}

pub(super) fn conclude(
    context: &Context,
    folder: &Path,
    recorded: &BarRecord,
    report: &BarReport<'_>,
    pictures: &[PathBuf],
    notes: &[String],
) -> anyhow::Result<()> {
    const ROWS: usize = 12;
    let loading: Vec<&BarSample> = recorded
        .samples
        .iter()
        .filter(|s| s.phase == Phase::Load)
        .collect();
    let mut table = Table::new(["depth mm", "force N"]);
    let stride = loading.len().div_ceil(ROWS).max(1);
    for (i, sample) in loading.iter().enumerate() {
        if i % stride == 0 || i + 1 == loading.len() {
            table.push([
                format!("{:.2}", sample.depth_mm),
                format!("{:.4}", (sample.force_n * 1e4).round() / 1e4 + 0.0),
            ]);
        }
    }
    context.say(table)?;
    let r = &report.result;
    context.say(format!(
        "largest force {:.3} N at {:.2} mm{}",
        r.max_force_n,
        r.at_depth_mm,
        r.secant_stiffness_n_per_mm
            .map_or(String::new(), |k| format!(" ({k:.3} N/mm on average)"))
    ))?;
    context.say(format!(
        "{}. Bars always have Poisson's ratio ¼, and their forces do not depend on time: speed and hold change only the \
         times in the table.",
        r.material_status
    ))?;
    if let Some(depth) = r.inverted_from_mm {
        context.say(format!(
            "from a depth of {depth:.2} mm on, prisms are TURNED INSIDE OUT: bars have no volume, so nothing stops a \
             soft layer from turning inside out. Use the force only up to this depth"
        ))?;
    }
    if let Some(left) = r
        .force_after_retract_n
        .filter(|f| f.abs() > 0.02 * r.max_force_n)
    {
        context.say(format!(
            "back at the start, {left:.3} N remain: the method sums the force along the path, and the sum drifts; \
             tissue does not do this"
        ))?;
    }
    if r.outcome == BarOutcome::Diverged {
        context.say(
            "the last step DIVERGED; results end before it. Use more substeps or a smaller step",
        )?;
    }
    for note in notes {
        context.say(format!("note: {note}"))?;
    }
    context.say(format!(
        "table, series and pictures in {}",
        folder.display()
    ))?;
    if let Some(picture) = pictures.first() {
        context.say(format!("force against depth: {}", picture.display()))?;
    }
    Ok(())
}
