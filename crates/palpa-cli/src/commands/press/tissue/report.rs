//! The reports of a press with the continuum, for machines and for people.

use std::path::PathBuf;

use palpa_mesh::growth::GrowthReport;
use palpa_scene::{MaterialStatus, Scene};
use serde::Serialize;

use super::super::Job;
use super::super::words::{say_layers, status_word};
use super::result::PressResult;
use crate::table::Table;
use palpa::accuracy::{ErrorBars, FEW_VERTICES, LumpChange, MeshChoice, SAFETY, Source};
use palpa::build::in_mm;
use palpa::press::tissue::{Indentation, RunResult, Sample};

/// Half the width of an error bar above which the report says how to get a smaller one, as a share
/// of the force.
const WANTED: f64 = 0.03;

/// Content of press.json and of the `--json` output.
#[derive(Debug, Serialize)]
pub(super) struct PressReport<'a> {
    pub(super) model: &'static str,
    pub(super) scene: &'a str,
    /// The body as it was grown, before it was refined.
    pub(super) body: &'a GrowthReport,
    /// Materials of the layers, then of the lumps.
    pub(super) materials: &'a [MaterialStatus],
    pub(super) press: PressFacts,
    pub(super) result: PressResult,
    pub(super) notes: &'a [String],
    /// How the mesh was chosen; `None` if no accuracy was asked for.
    pub(super) mesh_choice: Option<&'a MeshChoice>,
    /// Contributions to the force's error at the depths that were probed; `None` if they were not.
    pub(super) error_bars: Option<&'a ErrorBars>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) lump_change: Option<LumpChange>,
    pub(super) samples: &'a [Sample],
}

#[derive(Debug, Serialize)]
pub(super) struct PressFacts {
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
    /// Number of skin vertices bonded to the tool; 0 for a tool that only touches.
    pub(super) n_operated_nodes: usize,
    /// Radius of the circle with the area of the bonded skin; `None` for a tool that is not bonded.
    pub(super) effective_radius_mm: Option<f64>,
    pub(super) mesh_size_near_tool_mm: f64,
    pub(super) tissue_depth_mm: f64,
    pub(super) n_vertices: usize,
    pub(super) n_levels: usize,
    pub(super) n_nodes: usize,
    pub(super) n_free_nodes: usize,
    pub(super) n_prisms: usize,
    pub(super) n_single_triangles: usize,
    pub(super) is_resolved: bool,
    pub(super) alpha: f64,
    pub(super) is_viscous: bool,
    pub(super) is_dynamic: bool,
}

pub(super) fn facts(scene: &Scene, indentation: &Indentation) -> PressFacts {
    let (model, mesh, place) = (&indentation.model, indentation.mesh(), indentation.place());
    PressFacts {
        vertex: place.vertex,
        at_m: place.at.into(),
        asked_m: place.asked.map(Into::into),
        asked_distance_mm: place.distance_asked().map(|d| d * 1e3),
        direction: place.direction.into_inner().into(),
        tool: scene.tool.to_string(),
        n_operated_nodes: indentation.n_bonded(),
        effective_radius_mm: mesh.patch.as_ref().map(|patch| patch.radius * 1e3),
        mesh_size_near_tool_mm: mesh.mesh_size * 1e3,
        tissue_depth_mm: place.tissue_depth * 1e3,
        n_vertices: mesh.body.n_vertices(),
        n_levels: mesh.body.n_levels,
        n_nodes: model.n_nodes(),
        n_free_nodes: model.n_free_nodes(),
        n_prisms: mesh.body.n_prisms(),
        n_single_triangles: model.n_single_triangles(),
        is_resolved: mesh.is_resolved,
        alpha: scene.model.alpha(),
        is_viscous: indentation.is_viscous,
        is_dynamic: indentation.is_dynamic(),
    }
}

pub(super) fn announce(
    job: &Job<'_>,
    indentation: &Indentation,
    materials: &[MaterialStatus],
) -> anyhow::Result<()> {
    let Job {
        context,
        scene,
        scene_name,
        ..
    } = *job;
    let grown = &indentation.prepared.grown.growth.report;
    let facts = facts(scene, indentation);
    context.say(format!(
        "{scene_name}: grown to {} skin vertices × {} levels; refined to {} × {} = {} nodes, {} prisms",
        grown.n_vertices,
        grown.n_levels,
        facts.n_vertices,
        facts.n_levels,
        facts.n_nodes,
        facts.n_prisms
    ))?;
    say_layers(context, scene, grown, materials)?;
    for (lump, material) in scene.lumps.iter().zip(&materials[scene.layers.len()..]) {
        context.say(format!(
            "lump \"{}\": {}; {}",
            lump.name,
            material.summary,
            status_word(material.status)
        ))?;
    }
    let hold = match facts.effective_radius_mm {
        Some(radius) => format!(
            " (effective radius {radius:.2} mm, {} vertices)",
            facts.n_operated_nodes
        ),
        None => String::new(),
    };
    context.say(format!(
        "continuum model; {}{hold} at ({}) mm, where the tissue is {:.1} mm deep; skin edges near the tool {:.1} mm",
        facts.tool,
        in_mm(indentation.place().at),
        facts.tissue_depth_mm,
        facts.mesh_size_near_tool_mm
    ))
}

pub(super) fn conclude(
    job: &Job<'_>,
    indentation: &Indentation,
    report: &PressReport<'_>,
    pictures: &[PathBuf],
) -> anyhow::Result<()> {
    let context = job.context;
    say_table(job, indentation, report.samples)?;
    let r = &report.result;
    for run in &r.runs {
        context.say(run_in_words(run))?;
    }
    say_bars(job, report)?;
    say_forces(job, r)?;
    let w = &r.worst;
    if !indentation.is_bonded() {
        context.say(format!(
            "contact: skin up to {} µm inside the tool, law of contact missed by {} of the force",
            scientific(w.penetration_um),
            scientific(w.contact_mismatch)
        ))?;
    }
    context.say(format!(
        "prisms keep {:.1} to {:.1} % of their volume; {}",
        100.0 * w.volume_ratio_min,
        100.0 * w.volume_ratio_max,
        r.material_status
    ))?;
    for note in report.notes {
        context.say(format!("note: {note}"))?;
    }
    context.say(format!(
        "table, series and pictures in {}",
        job.out.path().display()
    ))?;
    if let Some(picture) = pictures.first() {
        context.say(format!("force against depth: {}", picture.display()))?;
    }
    Ok(())
}

/// The number with two digits; zero is "0".
fn scientific(x: f64) -> String {
    if x == 0.0 {
        "0".to_owned()
    } else {
        format!("{x:.1e}")
    }
}

/// Text for the result at one speed.
fn run_in_words(run: &RunResult) -> String {
    let mut parts = vec![format!(
        "{} mm/s: largest force {:.3} N at {:.2} mm{}",
        run.speed_mm_s,
        run.max_force_n,
        run.at_depth_mm,
        run.secant_stiffness_n_per_mm
            .map_or(String::new(), |k| format!(
                " ({k:.3}{} N/mm on average)",
                run.secant_stiffness_error_bar_n_per_mm
                    .map_or(String::new(), |bar| format!(" ± {bar:.3}"))
            ))
    )];
    parts
        .extend((run.relaxation).map(|share| format!("relaxes by {:.1} % at rest", 100.0 * share)));
    parts.extend(run.hysteresis.first().map(|share| {
        let percent = (1000.0 * share).round() / 10.0 + 0.0;
        format!("{percent:.1} % of the work is lost on the way back")
    }));
    let left = run.force_after_retract_n;
    parts.extend(
        left.filter(|f| f.abs() > 0.02 * run.max_force_n)
            .map(|left| {
                let why = if left < 0.0 {
                    ", the pull of bonded skin that has not come back yet"
                } else {
                    ""
                };
                format!("back at the start {left:.3} N{why}")
            }),
    );
    parts.join("; ")
}

/// Prints the table of the first loading.
fn say_table(job: &Job<'_>, indentation: &Indentation, samples: &[Sample]) -> anyhow::Result<()> {
    const ROWS: usize = 12;
    let is_down = |s: &&Sample| s.run == 0 && s.is_first_loading();
    let loading: Vec<&Sample> = samples.iter().filter(is_down).collect();
    let names = indentation.mesh().body.layer_names.join(", ");
    let mut table = Table::new([
        "depth mm",
        "force N",
        "contact mm²",
        "max kPa",
        &format!("thickness mm: {names}"),
    ]);
    let stride = loading.len().div_ceil(ROWS).max(1);
    for (i, sample) in loading.iter().enumerate() {
        if i % stride != 0 && i + 1 != loading.len() {
            continue;
        }
        let thicknesses: Vec<String> = (sample.layer_thickness_mm.iter())
            .map(|t| format!("{t:6.2}"))
            .collect();
        table.push([
            format!("{:.2}", sample.depth_mm),
            force_in_words(sample),
            format!("{:.0}", sample.contact_area_mm2),
            sample
                .max_pressure_kpa
                .map_or(String::new(), |p| format!("{:.2}", p + 0.0)),
            thicknesses.join(" "),
        ]);
    }
    job.context.say(table)
}

/// The force, with its error bar if it has one.
fn force_in_words(sample: &Sample) -> String {
    let force = (sample.force_n * 1e4).round() / 1e4 + 0.0;
    match sample.error_bar_n {
        Some(bar) => format!("{force:.4} ± {bar:.4}"),
        None => format!("{force:.4}"),
    }
}

/// A share with its sign, to a tenth of a per cent; "0.0 %" has none.
fn signed_percent(share: f64) -> String {
    let tenths = (1000.0 * share).round();
    if tenths == 0.0 {
        "0.0 %".to_owned()
    } else {
        format!("{:+.1} %", tenths / 10.0)
    }
}

/// Prints the error bar at the deepest, and its contributions.
fn say_bars(job: &Job<'_>, report: &PressReport<'_>) -> anyhow::Result<()> {
    let Some(bars) = report.error_bars else {
        return Ok(());
    };
    let probed = bars.deepest();
    let mut changes: Vec<String> = Vec::new();
    let of_sources = Source::ALL.into_iter().zip(probed.changes);
    for ((source, change), is_stand_in) in of_sources.zip(probed.is_stand_in) {
        let from = if is_stand_in {
            " (twice that at a smaller depth; here its probe found no equilibrium)"
        } else {
            ""
        };
        changes.push(match change {
            Some(change) => format!("{source} {}{from}", signed_percent(change)),
            None => format!("{source}: no result"),
        });
    }
    changes.extend((bars.load_step).map(|step| format!("load steps {}", signed_percent(step))));
    let contact = probed.contact().filter(|&contact| contact > 0.0);
    changes.extend(contact.map(|contact| format!("{FEW_VERTICES} {:.1} %", 100.0 * contact)));
    let half_width = bars.half_width(probed);
    let bar = half_width.map_or_else(
        || "not known, because a probe failed".to_owned(),
        |half| format!("±{:.1} % of the force", 100.0 * half),
    );
    job.context.say(format!(
        "error bar at {:.2} mm: {bar}; halving sizes changes the force by: {}",
        probed.depth_mm,
        changes.join(", ")
    ))?;
    let at_deepest = |s: &&Sample| s.run == 0 && s.is_first_loading();
    let deepest = report.samples.iter().rfind(at_deepest);
    if let Some((sample, extrapolated)) = deepest.and_then(|s| Some((s, s.extrapolated_n?))) {
        let share = signed_percent(extrapolated / sample.force_n - 1.0);
        job.context.say(format!(
            "extrapolated to an infinitely fine mesh, the force at {:.2} mm is {extrapolated:.4} N ({share})",
            sample.depth_mm
        ))?;
    }
    if let Some(change) = &report.lump_change {
        let force = probed.force_n;
        let bar = change.error_bar_n.map_or_else(
            || "not known, because a probe failed".to_owned(),
            |bar| format!("±{bar:.4} N (±{:.1} %)", 100.0 * bar / force.abs()),
        );
        job.context.say(format!(
            "lumps change the force at {:.2} mm by {:+.4} N ({} of it), error bar of the change: {bar}; both without \
             relaxation",
            change.depth_mm,
            change.change_n,
            signed_percent(change.change_n / force)
        ))?;
    }
    let steps = 2.0 * SAFETY * bars.load_step.map_or(0.0, f64::abs);
    let asked = report.mesh_choice.map_or(WANTED, |choice| choice.accuracy);
    let is_too_wide = half_width.is_some_and(|half| half > asked);
    if is_too_wide && (report.mesh_choice.is_some() || half_width.is_some_and(|half| steps > half))
    {
        job.context.say(
            "smaller load steps make the error bar narrower: --step with less than the step of this press",
        )?;
    } else if is_too_wide {
        job.context.say(format!(
            "to have an error bar of at most ±{:.0} %: --accuracy \"{:.0} %\" chooses a mesh for it",
            100.0 * WANTED,
            100.0 * WANTED
        ))?;
    }
    Ok(())
}

/// Prints which layer deforms most, and the force that each layer passes on.
fn say_forces(job: &Job<'_>, r: &PressResult) -> anyhow::Result<()> {
    if let Some(name) = &r.gives_most {
        job.context.say(format!(
            "under the tool, the thickness of \"{name}\" changes most; force that each layer passes on along the press: {}",
            (r.layers.iter())
                .map(|layer| format!("{:.3} N below {}", layer.force_below_n, layer.name))
                .collect::<Vec<_>>()
                .join(", ")
        ))?;
    }
    Ok(())
}
