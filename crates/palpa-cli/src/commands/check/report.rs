//! The report of `palpa check` for people.

use palpa_mesh::check::{Finding, Severity, Spot, SurfaceReport};
use palpa_mesh::{RepairReport, Verdict};

use super::{FileResult, SurfaceResult};
use crate::cli::Context;

/// Number of places printed for each finding; `--json` lists more.
const N_NAMED: usize = 3;

/// Prints the report on one file. Unreadable files are reported when the command ends.
pub(super) fn say(result: &FileResult, context: &Context) -> anyhow::Result<()> {
    let Some(verdict) = result.verdict else {
        return context.say(format_args!("{}: cannot be read", result.file.display()));
    };
    context.say(format_args!(
        "{}: {}",
        result.file.display(),
        in_words(verdict)
    ))?;
    for surface in &result.surfaces {
        let check = &surface.check;
        if check.file != result.file {
            let verdict = in_words(check.examination.verdict);
            context.say(format_args!("  {}: {verdict}", check.file.display()))?;
        }
        say_surface(surface, context)?;
    }
    if let Some(body) = &result.body {
        context.say(format_args!(
            "  grows into {} nodes and {} prisms, all valid (scaled Jacobian: smallest {:.2}, 5 % below {:.2}); layers thinned \
             under {:.1} % of the skin's area",
            body.n_nodes,
            body.n_prisms,
            body.scaled_jacobian.min,
            body.scaled_jacobian.p05,
            100.0 * body.thinned_share
        ))?;
    }
    for note in &result.notes {
        context.say(format_args!("  note: {note}"))?;
    }
    if let Some(refusal) = &result.refusal {
        context.say(format_args!("  grows into no body: {refusal}"))?;
    }
    Ok(())
}

fn in_words(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Good => "good",
        Verdict::Repairable => "has defects that repair removes",
        Verdict::Bad => "has defects that must be mended by hand",
    }
}

fn say_surface(result: &SurfaceResult, context: &Context) -> anyhow::Result<()> {
    let check = &result.check;
    let (counts, examination) = (&check.counts, &check.examination);
    let report = &examination.report;
    context.say(format_args!(
        "  {}: {} vertices, {} faces ({} of them polygons), {} object(s); welded: {} vertices, {} triangles",
        check.format,
        counts.n_points,
        counts.n_faces,
        counts.n_polygons,
        counts.n_objects,
        report.n_vertices,
        report.n_triangles
    ))?;
    say_shape(report, context)?;
    for note in &check.notes {
        context.say(format_args!("  {}: {}", label(note.severity), note.message))?;
    }
    for finding in &report.findings {
        say_finding(finding, context)?;
    }
    let Some(repaired) = &examination.repaired else {
        return Ok(());
    };
    context.say(format_args!(
        "  repair: {}",
        what_was_done(&repaired.repair)
    ))?;
    let left: Vec<&Finding> = repaired
        .report
        .findings
        .iter()
        .filter(|f| f.severity > Severity::Note)
        .collect();
    if left.is_empty() {
        context.say("  after repair: good")?;
    }
    for finding in left {
        context.say(format_args!("  after repair still: {}", finding.message))?;
    }
    match &result.written {
        Some(path) => context.say(format_args!(
            "  repaired copy, in metres: {}",
            path.display()
        )),
        None if repaired.surface.triangles.is_empty() => Ok(()),
        None => context.say("  `--repaired FILE` or `--out DIR` writes the repaired copy"),
    }
}

/// Prints size and area, and the volume if there is one.
fn say_shape(report: &SurfaceReport, context: &Context) -> anyhow::Result<()> {
    let Some(part) = report.parts.first() else {
        return Ok(());
    };
    let size: Vec<String> = report
        .upper
        .iter()
        .zip(&report.lower)
        .map(|(hi, lo)| format!("{:.4}", hi - lo))
        .collect();
    let volume = match (report.n_parts, part.is_closed) {
        (1, true) => format!("closed, volume {:.4e} m³", part.volume),
        (1, false) => format!(
            "open, volume with its openings capped {:.4e} m³",
            part.volume
        ),
        (n, _) => format!("{n} parts"),
    };
    context.say(format_args!(
        "  {} m, area {:.4e} m², {volume}",
        size.join(" × "),
        report.area
    ))
}

fn say_finding(finding: &Finding, context: &Context) -> anyhow::Result<()> {
    context.say(format_args!(
        "  {}: {}",
        label(finding.severity),
        finding.message
    ))?;
    for spot in finding.spots.iter().take(N_NAMED) {
        context.say(format_args!("      {}", place(spot)))?;
    }
    if finding.count > N_NAMED && !finding.spots.is_empty() {
        context.say(format_args!("      and {} more", finding.count - N_NAMED))?;
    }
    context.say(format_args!("      → {}", finding.advice))
}

fn label(severity: Severity) -> &'static str {
    match severity {
        Severity::Note => "note",
        Severity::Repairable => "defect (repairable)",
        Severity::Unrepairable => "defect",
    }
}

fn place(spot: &Spot) -> String {
    let join = |ids: &[u32]| {
        ids.iter()
            .map(u32::to_string)
            .collect::<Vec<_>>()
            .join(", ")
    };
    let [x, y, z] = spot.point;
    let at = format!("at ({x:.5}, {y:.5}, {z:.5})");
    match (&spot.vertices[..], &spot.triangles[..]) {
        ([v], []) => format!("vertex {v} {at}"),
        (vertices @ [_, ..], []) => format!("edge {} {at}", join(vertices)),
        (_, [t]) => format!("triangle {t} {at}"),
        (_, triangles) => format!("triangles {} {at}", join(triangles)),
    }
}

fn what_was_done(repair: &RepairReport) -> String {
    let orientation = &repair.orientation;
    let counts = [
        (repair.n_welded, "vertices welded"),
        (repair.n_degenerate, "triangles without area resolved"),
        (repair.n_duplicate, "doubles dropped"),
        (orientation.n_flipped, "triangles turned"),
        (repair.n_unused, "unused vertices dropped"),
    ];
    let mut done: Vec<String> = counts
        .iter()
        .filter(|(n, _)| *n > 0)
        .map(|(n, what)| format!("{n} {what}"))
        .collect();
    if let Some([x, y, z]) = repair.moved_by {
        done.push(format!("moved by ({x}, {y}, {z}) m"));
    }
    if done.is_empty() {
        "nothing to do".to_owned()
    } else {
        done.join(", ")
    }
}
