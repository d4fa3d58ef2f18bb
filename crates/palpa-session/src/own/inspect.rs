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

/// The highest place over the middle of a surface with these bounds; if it stands upright, or was cut off there, the
/// foremost before it, or else the one at its side. `None` if nothing is there.
fn top_of(surface: &Surface, [lower, upper]: [Vec3; 2]) -> Option<Vec3> {
    /// From the middle at most this share of the width.
    const NEAR: f64 = 0.2;
    let size = upper - lower;
    let is_upright = size.z > size.x.max(size.y);
    let ways = [(2, 1.0), (1, -1.0), (0, 1.0)];
    let mut ways = ways.into_iter().skip(usize::from(is_upright));
    let is_round = |&(up, sign): &(usize, f64)| !is_cut_off(surface, [lower, upper], up, sign);
    // A block is flat everywhere.
    let (up, sign) = ways.clone().find(is_round).or_else(|| ways.next())?;
    let middle = (lower + upper) * 0.5;
    let is_near = |p: &&Vec3| (0..3).all(|c| c == up || (p[c] - middle[c]).abs() <= NEAR * size[c]);
    (surface.points.iter().filter(is_near))
        .max_by(|p, q| (sign * p[up]).total_cmp(&(sign * q[up])))
        .copied()
}

/// Whether a surface with these bounds ends in a plane across an axis, as a limb that was cut off.
fn is_cut_off(surface: &Surface, [lower, upper]: [Vec3; 2], axis: usize, sign: f64) -> bool {
    /// Distance from the bound that counts as in the plane, as a share of the extent, and the least share of the
    /// bounds' area that lies in it.
    const THIN: f64 = 1e-3;
    const LEAST: f64 = 0.1;
    let size = upper - lower;
    let end = if sign > 0.0 { upper } else { lower }[axis];
    let of = |t: &[u32; 3]| t.map(|v| surface.points.get(v as usize).copied());
    let triangles = surface.triangles.iter().filter_map(|t| match of(t) {
        [Some(a), Some(b), Some(c)] => Some([a, b, c]),
        _ => None,
    });
    let is_in_plane = |corners: &[Vec3; 3]| {
        let off = corners.map(|p| (p[axis] - end).abs());
        off.iter().all(|off| *off <= THIN * size[axis])
    };
    let areas = triangles
        .filter(is_in_plane)
        .map(|[a, b, c]| 0.5 * (b - a).cross(&(c - a)).norm());
    let across = size[(axis + 1) % 3] * size[(axis + 2) % 3];
    areas.sum::<f64>() > LEAST * across
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A tube of eight sides along z with this length and radius, m, closed by two planes.
    fn tube(length: f64, radius: f64) -> Surface {
        let corner = |k: u32, z: f64| {
            let angle = std::f64::consts::FRAC_PI_4 * f64::from(k);
            Vec3::new(radius * angle.cos(), radius * angle.sin(), z)
        };
        // On the side there is a ring in the middle, too.
        let rings = [0.0, 0.5 * length, length];
        let mut points: Vec<Vec3> = (rings.iter())
            .flat_map(|&z| (0..8).map(move |k| corner(k, z)))
            .collect();
        points.extend([Vec3::zeros(), Vec3::z() * length]);
        let triangles = (0..8).flat_map(|k| {
            let next = (k + 1) % 8;
            let side = |r: u32| {
                [
                    [8 * r + k, 8 * r + next, 8 * r + 8 + k],
                    [8 * r + next, 8 * r + 8 + next, 8 * r + 8 + k],
                ]
            };
            let ends = [[24, next, k], [25, 16 + k, 16 + next]];
            side(0).into_iter().chain(side(1)).chain(ends)
        });
        Surface {
            triangles: triangles.collect(),
            points,
        }
    }

    #[test]
    fn a_limb_that_was_cut_off_is_pressed_on_its_skin() {
        // Wider than long, as a slice of a calf.
        for length in [0.1, 0.3] {
            let top = top_of(
                &tube(length, 0.07),
                [Vec3::new(-0.07, -0.07, 0.0), Vec3::new(0.07, 0.07, length)],
            );
            let top = top.unwrap();
            assert!(
                (top.xy().norm() - 0.07).abs() < 1e-9 && top.y < -0.06,
                "{top:?}"
            );
            assert!((top.z - 0.5 * length).abs() < 0.2 * length, "{top:?}");
        }
    }
}
