//! Checks of single vertices and triangles, and of the size of the surface.

use super::{FindingKind, Findings, Severity, Spot, SurfaceReport, counted, diagonal, length};
use crate::Surface;
use crate::repair::{DEFAULT_WELD_TOLERANCE, duplicates, flaw, used_bounds};
use crate::weld::weld_within;

/// Larger coordinates are an error, whatever the unit: in metres this is a million kilometres.
const LARGEST_COORDINATE: f64 = 1e9;
/// A triangle is a sliver if its height is below this share of its longest side (an angle of about
/// half a degree).
const SLIVER_HEIGHT: f64 = 0.01;
/// Plausible diagonals of a body part, in metres: from a fingertip to more than the height of a
/// man.
const BODY_SIZES: std::ops::RangeInclusive<f64> = 0.005..=3.0;
/// If a surface is further from the origin than this many diagonals, it loses two or more digits in
/// single precision.
const FAR: f64 = 100.0;

/// Whether there are triangles and all their vertices exist.
pub(super) fn check_indices(surface: &Surface, findings: &mut Findings) -> bool {
    let n = surface.points.len();
    let wild: Vec<u32> = (0..surface.triangles.len() as u32)
        .filter(|&t| {
            surface.triangles[t as usize]
                .iter()
                .any(|&v| v as usize >= n)
        })
        .collect();
    let spot = |&t: &u32| Spot {
        vertices: vec![],
        triangles: vec![t],
        point: [f64::NAN; 3],
    };
    findings.add(
        (FindingKind::OutOfRange, Severity::Unrepairable),
        &wild,
        spot,
        format!(
            "{} triangle(s) name vertices that are not there, of {n}",
            wild.len()
        ),
        "export the surface again",
    );
    if surface.triangles.is_empty() {
        findings.add_global(
            (FindingKind::Empty, Severity::Unrepairable),
            "there are no triangles",
            "export the mesh itself, not its points",
        );
    }
    wild.is_empty() && !surface.triangles.is_empty()
}

pub(super) fn check(surface: &Surface, report: &mut SurfaceReport, findings: &mut Findings) {
    check_vertices(surface, findings);
    check_triangles(surface, findings);
    if let Some((lo, hi)) = used_bounds(surface) {
        (report.lower, report.upper) = (lo.into(), hi.into());
        check_size(diagonal((lo, hi)), (lo * 0.5 + hi * 0.5).norm(), findings);
    }
    report.area = (0..surface.triangles.len())
        .map(|t| surface.area_vector(t).norm())
        .filter(|area| area.is_finite())
        .sum();
}

fn check_vertices(surface: &Surface, findings: &mut Findings) {
    let vertex = |&v: &u32| Spot::vertex(surface, v);
    let is_used = crate::topology::is_used(surface);
    let select = |keep: &dyn Fn(usize) -> bool| -> Vec<u32> {
        (0..surface.points.len())
            .filter(|&v| keep(v))
            .map(|v| v as u32)
            .collect()
    };

    let is_wild = |v: usize| {
        !surface.points[v]
            .iter()
            .all(|x| x.abs() <= LARGEST_COORDINATE)
    };
    let wild = select(&|v| is_used[v] && is_wild(v));
    findings.add(
        (FindingKind::NotFinite, Severity::Unrepairable),
        &wild,
        vertex,
        counted(
            wild.len(),
            "vertex with coordinates that are NaN, infinite or beyond 1e9",
            "vertices with coordinates that are NaN, infinite or beyond 1e9",
        ),
        "Palpa cannot know the right coordinates: correct or delete these vertices in the program that made the surface",
    );
    let unused = select(&|v| !is_used[v]);
    findings.add(
        (FindingKind::UnusedVertex, Severity::Repairable),
        &unused,
        vertex,
        counted(
            unused.len(),
            "vertex belongs to no triangle",
            "vertices belong to no triangle",
        ),
        "repair drops them",
    );
    let tolerance = DEFAULT_WELD_TOLERANCE * used_bounds(surface).map_or(0.0, diagonal);
    let new_index = weld_within(surface, tolerance).new_index;
    let mut n_kept = 0;
    let mut coincident = Vec::new();
    for (v, &new) in new_index.iter().enumerate() {
        if new == n_kept {
            n_kept += 1;
        } else {
            coincident.push(v as u32);
        }
    }
    findings.add(
        (FindingKind::NearlyCoincident, Severity::Repairable),
        &coincident,
        vertex,
        format!(
            "{} within {} of another",
            counted(coincident.len(), "vertex lies", "vertices lie"),
            length(tolerance)
        ),
        "repair welds them",
    );
}

fn check_triangles(surface: &Surface, findings: &mut Findings) {
    let triangle = |&t: &u32| Spot::triangles(surface, &[t]);
    let all = || 0..surface.triangles.len() as u32;
    let degenerate: Vec<u32> = all()
        .filter(|&t| flaw(surface, t as usize).is_some())
        .collect();
    findings.add(
        (FindingKind::Degenerate, Severity::Repairable),
        &degenerate,
        triangle,
        counted(
            degenerate.len(),
            "triangle without area",
            "triangles without area",
        ),
        "repair drops them, or turns an edge where dropping would leave a slit",
    );
    let doubles = duplicates(surface);
    findings.add(
        (FindingKind::Duplicate, Severity::Repairable),
        &doubles,
        |&(first, double)| Spot::triangles(surface, &[first, double]),
        counted(
            doubles.len(),
            "triangle has the same vertices as another",
            "triangles have the same vertices as another",
        ),
        "repair keeps the first of each",
    );
    let slivers: Vec<u32> = all()
        .filter(|&t| is_sliver(surface, t as usize) && flaw(surface, t as usize).is_none())
        .collect();
    findings.add(
        (FindingKind::Sliver, Severity::Note),
        &slivers,
        triangle,
        counted(slivers.len(), "triangle flatter than 1 : 100", "triangles flatter than 1 : 100"),
        "prisms under them are poor elements; remesh for accuracy (Blender: Remesh; MeshLab: Isotropic Explicit Remeshing)",
    );
}

fn is_sliver(surface: &Surface, t: usize) -> bool {
    let [a, b, c] = surface.corners(t);
    let longest_sq = (b - a)
        .norm_squared()
        .max((c - b).norm_squared())
        .max((a - c).norm_squared());
    (b - a).cross(&(c - a)).norm() < SLIVER_HEIGHT * longest_sq
}

fn check_size(diagonal: f64, distance: f64, findings: &mut Findings) {
    if diagonal > 0.0 && !BODY_SIZES.contains(&diagonal) {
        let units = [("mm", 1e-3), ("cm", 1e-2), ("in", 0.0254)];
        let fitting = units
            .iter()
            .find(|(_, unit)| BODY_SIZES.contains(&(diagonal * unit)));
        let advice = match fitting {
            Some((name, unit)) => format!(
                "if its unit is {name} (it would then measure {}), say so with `unit = \"{name}\"` or `--unit {name}`",
                length(diagonal * unit)
            ),
            None => "scale it to metres".to_owned(),
        };
        let message = format!(
            "the surface measures {diagonal:.4} m from corner to corner, which no body part does"
        );
        findings.add_global((FindingKind::Scale, Severity::Note), message, advice);
    }
    if distance > FAR * diagonal {
        let message = format!(
            "it lies {distance:.6} from the origin, {:.0} times its size",
            distance / diagonal
        );
        let advice = "nothing is lost here, but formats of single precision (STL, GLB) would round it; `--recentre` moves it to the origin";
        findings.add_global(
            (FindingKind::FarFromOrigin, Severity::Note),
            message,
            advice,
        );
    }
}
