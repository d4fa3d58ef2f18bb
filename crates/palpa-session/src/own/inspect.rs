//! A surface and its findings, as pages see them.

use std::path::Path;

use palpa::Note;
use palpa::check::{SurfaceCheck, probable_unit};
use palpa::mesh::check::{Finding, Severity, Spot, SurfaceReport};
use palpa::mesh::{RepairOptions, Surface, SurfaceFile, Vec3, Verdict};
use palpa_scene::LengthUnit;
use palpa_viewer::control::{FindingInfo, FindingSeverity, SurfaceInfo, SurfaceVerdict};
use palpa_viewer::wire::MeshSnapshot;

use super::template::{self, Dimensions};
use crate::publish::shown;

/// A surface with its check in `unit`, or in the probable one; and its dimensions, in the unit of the file.
pub(super) fn inspected(
    name: &str,
    file: &SurfaceFile,
    unit: Option<LengthUnit>,
) -> (SurfaceInfo, Dimensions) {
    let probable = probable_unit(file.format, &file.surface);
    let unit = unit.unwrap_or(probable);
    let options = RepairOptions::default();
    let check = SurfaceCheck::of(name.into(), file, unit, &options);
    let report = &check.examination.report;
    let (lower, upper) = finite_bounds(&file.surface);
    let notes = file.notes.iter().map(|note| {
        shown(&Note::FileRead {
            file: name.to_owned(),
            note: note.clone(),
        })
    });
    let top = top_of(&file.surface, [lower, upper]).map(|p| (p * unit.metres()).into());
    let size = dimensions_of(report, top);
    let info = SurfaceInfo {
        format: check.format.to_string(),
        n_vertices: report.n_vertices as u32,
        n_triangles: report.n_triangles as u32,
        n_parts: report.n_parts as u32,
        is_closed: report.parts.first().is_some_and(|part| part.is_closed),
        unit,
        probable_unit: probable,
        size: (upper - lower).into(),
        middle: ((lower + upper) * 0.5).into(),
        verdict: match check.examination.verdict {
            Verdict::Good => SurfaceVerdict::Good,
            Verdict::Repairable => SurfaceVerdict::Repairable,
            Verdict::Bad => SurfaceVerdict::Bad,
        },
        notes: notes.collect(),
        findings: (report.findings.iter())
            .map(|found| finding(found, &file.surface, unit))
            .collect(),
        templates: template::infos(size),
    };
    (info, size.scaled(unit.metres().recip()))
}

fn finding(finding: &Finding, surface: &Surface, unit: LengthUnit) -> FindingInfo {
    let kind = match serde_json::to_value(finding.kind) {
        Ok(serde_json::Value::String(kind)) => kind,
        _ => String::new(),
    };
    let places = (finding.spots.iter()).filter_map(|spot| place(spot, surface, unit));
    FindingInfo {
        kind,
        severity: match finding.severity {
            Severity::Note => FindingSeverity::Note,
            Severity::Repairable => FindingSeverity::Repairable,
            Severity::Unrepairable => FindingSeverity::Unrepairable,
        },
        count: finding.count as u32,
        is_at_least: finding.is_at_least,
        places: places.collect(),
        text: finding.message.clone(),
        advice: finding.advice.clone(),
    }
}

/// The place of a finding, m. A vertex whose coordinates are no numbers is shown at a neighbour.
fn place(spot: &Spot, surface: &Surface, unit: LengthUnit) -> Option<[f64; 3]> {
    let is_finite = |point: &[f64; 3]| point.iter().all(|x| x.is_finite());
    if is_finite(&spot.point) {
        return Some(spot.point);
    }
    let vertex = spot.vertices.first()?;
    (surface
        .triangles
        .iter()
        .filter(|t| t.contains(vertex))
        .flatten())
    .filter_map(|&v| surface.points.get(v as usize))
    .map(|point| (point * unit.metres()).into())
    .find(is_finite)
}

/// The dimensions by which a template chooses its layers, m.
fn dimensions_of(report: &SurfaceReport, top: Option<[f64; 3]>) -> Dimensions {
    let diagonal = (Vec3::from(report.upper) - Vec3::from(report.lower)).norm();
    let part = report.parts.first();
    // A sheet encloses no volume: capped, its volume says nothing about its thickness.
    let radius = part
        .filter(|part| part.is_closed && part.area > 0.0)
        .map(|part| 2.0 * part.volume.abs() / part.area)
        .filter(|radius| radius.is_finite() && *radius > 0.0);
    Dimensions {
        diagonal: if diagonal.is_finite() { diagonal } else { 0.0 },
        radius,
        press: radius.and(top),
    }
}

/// The highest place over the middle of a surface with these bounds; if it stands upright, the foremost before it.
/// `None` if nothing is there.
fn top_of(surface: &Surface, [lower, upper]: [Vec3; 2]) -> Option<Vec3> {
    /// From the middle at most this share of the width.
    const NEAR: f64 = 0.2;
    let size = upper - lower;
    let (up, sign) = if size.z > size.x.max(size.y) {
        (1, -1.0)
    } else {
        (2, 1.0)
    };
    let middle = (lower + upper) * 0.5;
    let is_near = |p: &&Vec3| (0..3).all(|c| c == up || (p[c] - middle[c]).abs() <= NEAR * size[c]);
    (surface.points.iter().filter(is_near))
        .max_by(|p, q| (sign * p[up]).total_cmp(&(sign * q[up])))
        .copied()
}

/// The surface for a picture, with its middle at the origin. Triangles that cannot be drawn are left out.
pub(super) fn picture(surface: &Surface) -> MeshSnapshot {
    let (lower, upper) = finite_bounds(surface);
    let middle = (lower + upper) * 0.5;
    let is_drawn = |&v: &u32| {
        let point = surface.points.get(v as usize);
        point.is_some_and(|p| p.iter().all(|x| x.is_finite()))
    };
    let positions = surface.points.iter().flat_map(|p| {
        let p = p - middle;
        [p.x, p.y, p.z].map(|x| if x.is_finite() { x as f32 } else { 0.0 })
    });
    let triangles = (surface.triangles.iter()).filter(|t| t.iter().all(is_drawn));
    MeshSnapshot {
        n_levels: 1,
        positions: positions.collect(),
        triangles: triangles.flatten().copied().collect(),
        ..MeshSnapshot::default()
    }
}

/// Smallest and largest finite coordinates.
fn finite_bounds(surface: &Surface) -> (Vec3, Vec3) {
    let is_finite = |p: &&Vec3| p.iter().all(|x| x.is_finite());
    let mut points = surface.points.iter().filter(is_finite);
    let Some(&first) = points.next() else {
        return (Vec3::zeros(), Vec3::zeros());
    };
    points.fold((first, first), |(lo, hi), p| (lo.inf(p), hi.sup(p)))
}

/// Whether a path names a file that is read as a surface.
pub(super) fn is_surface(path: &Path) -> bool {
    path.extension().is_some_and(|ending| {
        let ending = ending.to_string_lossy().to_ascii_lowercase();
        super::SURFACES.contains(&ending.as_str())
    })
}
