//! Checks of the connectivity: edges, boundaries, parts, winding.

use rstar::primitives::{GeomWithData, Line};
use rstar::{AABB, RTree};
use serde::Serialize;

use super::{FindingKind, Findings, N_LISTED, Severity, Spot, SurfaceReport, counted, diagonal};
use crate::orient::{Enclosed, chains, facing, patches};
use crate::repair::{DEFAULT_WELD_TOLERANCE, duplicates, used_bounds};
use crate::topology::{Side, UnionFind, by_edge, components, has_sides, sides};
use crate::{Surface, Vec3};

/// A boundary loop in one plane counts as a cut face if it spans more than this share of the area
/// of its part. A smaller one counts as a hole.
const SMALLEST_CUT: f64 = 0.01;
/// A loop that is not in one plane counts as the rim of a sheet if it spans more than this share of
/// the area. A smaller one counts as a hole.
const SMALLEST_RIM: f64 = 0.05;
/// Largest distance of a flat loop's vertices from its plane, as a share of its length.
const FLATNESS: f64 = 2e-3;

/// A part of a surface: triangles connected over edges.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Part {
    /// Number of triangles in the part.
    pub n_triangles: usize,
    /// Whether every edge has at least two triangles.
    pub is_closed: bool,
    /// Area of the part. m²
    pub area: f64,
    /// Volume enclosed by the part with its boundary loops capped; negative if the part faces
    /// inward. m³
    pub volume: f64,
    /// The first triangle of the part.
    pub triangle: u32,
}

/// Connected boundary edges.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BoundaryLoop {
    /// Number of edges in the loop.
    pub n_edges: usize,
    /// Length of the loop. m
    pub length: f64,
    /// Area that the loop spans, seen along the normal of its plane. m²
    pub area: f64,
    /// Whether the loop lies in one plane.
    pub is_flat: bool,
    /// Mean of the loop's vertices. m
    pub centre: [f64; 3],
    /// Whether the loop looks like a hole rather than a cut face or the rim of a sheet.
    pub is_hole: bool,
}

pub(super) fn check(surface: &Surface, report: &mut SurfaceReport, findings: &mut Findings) {
    // Double triangles have a finding of their own. If they took part here, each of their edges
    // would count as non-manifold.
    let mut is_double = vec![false; surface.triangles.len()];
    for (_, t) in duplicates(surface) {
        is_double[t as usize] = true;
    }
    let sides = sides(
        surface,
        (0..surface.triangles.len() as u32).filter(|&t| !is_double[t as usize]),
    );
    check_edges(surface, &sides, report, findings);
    check_vertices(surface, &sides, findings);
    // Volumes are meaningful only if the winding is consistent.
    let wound = check_winding(surface, &sides, findings);
    let parts = components(surface, &sides);
    let area_of_part = check_parts(&wound, &sides, &parts, report, findings);
    check_boundary(surface, &sides, &parts, &area_of_part, report, findings);
}

fn check_edges(
    surface: &Surface,
    sides: &[Side],
    report: &mut SurfaceReport,
    findings: &mut Findings,
) {
    let mut crowded: Vec<[u32; 2]> = Vec::new();
    let mut has_neighbour = vec![false; surface.triangles.len()];
    for on_edge in by_edge(sides) {
        report.n_edges += 1;
        match on_edge.len() {
            1 => report.n_boundary_edges += 1,
            2 => {}
            _ => crowded.push(on_edge[0].edge),
        }
        if on_edge.len() > 1 {
            for side in on_edge {
                has_neighbour[side.triangle as usize] = true;
            }
        }
    }
    report.n_nonmanifold_edges = crowded.len();
    findings.add(
        (FindingKind::NonManifoldEdge, Severity::Unrepairable),
        &crowded,
        |&edge| Spot::edge(surface, edge),
        counted(
            crowded.len(),
            "edge belongs to three triangles or more",
            "edges belong to three triangles or more",
        ),
        "which of them are skin cannot be known: delete the inner ones (Blender: Select > All by Trait > Non Manifold; \
         MeshLab: Repair Non Manifold Edges), or remesh by volume",
    );
    let has_sides = has_sides(surface, sides);
    let alone: Vec<u32> = (0..surface.triangles.len() as u32)
        .filter(|&t| has_sides[t as usize] && !has_neighbour[t as usize])
        .collect();
    if 2 * alone.len() > surface.triangles.len() {
        findings.add(
            (FindingKind::Unjoined, Severity::Unrepairable),
            &alone,
            |&t| Spot::triangles(surface, &[t]),
            format!(
                "{} of {} triangles have no neighbour",
                alone.len(),
                surface.triangles.len()
            ),
            "if they should meet, weld them with a larger tolerance; otherwise this is no surface",
        );
    }
}

/// Finds vertices where fans of triangles meet that share no edge at the vertex.
fn check_vertices(surface: &Surface, sides: &[Side], findings: &mut Findings) {
    // Corner k of triangle t has the number 3t + k. Corners at a vertex are joined if their
    // triangles share an edge there.
    let corner = |side: &Side, v: u32| {
        let k = surface.triangles[side.triangle as usize]
            .iter()
            .position(|&u| u == v)
            .unwrap_or(0);
        3 * side.triangle + k as u32
    };
    let mut fans = UnionFind::new(3 * surface.triangles.len());
    for on_edge in by_edge(sides) {
        for pair in on_edge.windows(2) {
            for v in pair[0].edge {
                fans.join(corner(&pair[0], v), corner(&pair[1], v));
            }
        }
    }
    let mut fan_of_vertex = vec![u32::MAX; surface.points.len()];
    let has_sides = has_sides(surface, sides);
    let mut pinched = Vec::new();
    for (t, triangle) in surface.triangles.iter().enumerate() {
        if !has_sides[t] {
            continue;
        }
        for (k, &v) in triangle.iter().enumerate() {
            let fan = fans.find((3 * t + k) as u32);
            let known = &mut fan_of_vertex[v as usize];
            if *known == u32::MAX {
                *known = fan;
            } else if *known != fan {
                pinched.push(v);
            }
        }
    }
    pinched.sort_unstable();
    pinched.dedup();
    findings.add(
        (FindingKind::NonManifoldVertex, Severity::Unrepairable),
        &pinched,
        |&v| Spot::vertex(surface, v),
        counted(
            pinched.len(),
            "vertex at which parts meet that share no edge",
            "vertices at which parts meet that share no edge",
        ),
        "pull the parts apart or join them along an edge (MeshLab: Repair Non Manifold Vertices by Splitting)",
    );
}

/// Reports triangles with a winding against their neighbours, and parts that face inward. Returns
/// the surface with one winding per part.
fn check_winding(surface: &Surface, sides: &[Side], findings: &mut Findings) -> Surface {
    let mut wound = surface.clone();
    let (mut odd, mut inverted, mut one_sided, mut unclear) = (vec![], vec![], vec![], vec![]);
    let (mut area, mut unclear_area) = (0.0, 0.0);
    for patch in patches(surface, sides) {
        let first = patch.triangles[0];
        if patch.is_one_sided {
            one_sided.push(first);
            continue;
        }
        for t in patch.odd_triangles() {
            odd.push(t);
            wound.triangles[t as usize].swap(1, 2);
        }
        let (shape, facing) = facing(&mut wound, &patch.triangles);
        area += shape.area;
        match facing {
            Some(true) => {}
            Some(false) => inverted.push(first),
            None => {
                unclear.push(first);
                unclear_area += shape.area;
            }
        }
    }
    // Single triangles between non-manifold edges are flat, too, but that says nothing about the
    // surface.
    if 2.0 * unclear_area < area {
        unclear.clear();
    }
    odd.sort_unstable();
    let triangle = |&t: &u32| Spot::triangles(surface, &[t]);
    findings.add(
        (FindingKind::Winding, Severity::Repairable),
        &odd,
        triangle,
        counted(
            odd.len(),
            "triangle is wound against its neighbours",
            "triangles are wound against their neighbours",
        ),
        "repair turns them to agree with the majority",
    );
    findings.add(
        (FindingKind::Inverted, Severity::Repairable),
        &inverted,
        triangle,
        counted(inverted.len(), "part faces inward", "parts face inward"),
        "a closed part then has a negative volume, an open part bulges inward; repair turns it. If the part is meant to \
         be hollow (an armpit), keep it as it is",
    );
    findings.add(
        (FindingKind::OneSided, Severity::Unrepairable),
        &one_sided,
        triangle,
        counted(
            one_sided.len(),
            "part has but one side, as a Möbius strip has",
            "parts have but one side, as a Möbius strip has",
        ),
        "cut the surface open where it is twisted, and close it the right way",
    );
    findings.add(
        (FindingKind::UnclearSide, Severity::Note),
        &unclear,
        triangle,
        counted(
            unclear.len(),
            "open part is too flat to tell which side is out",
            "open parts are too flat to tell which side is out",
        ),
        "its winding is taken to be right: counter-clockwise seen from outside",
    );
    wound
}

/// Describes the parts; returns the area of each.
fn check_parts(
    wound: &Surface,
    sides: &[Side],
    parts: &[Vec<u32>],
    report: &mut SurfaceReport,
    findings: &mut Findings,
) -> Vec<f64> {
    let mut is_open = vec![false; wound.triangles.len()];
    for on_edge in by_edge(sides) {
        if let [only] = on_edge {
            is_open[only.triangle as usize] = true;
        }
    }
    let mut described: Vec<Part> = parts
        .iter()
        .map(|triangles| {
            let Enclosed { volume, area, .. } = Enclosed::of(wound, triangles);
            Part {
                n_triangles: triangles.len(),
                is_closed: !triangles.iter().any(|&t| is_open[t as usize]),
                area,
                volume,
                triangle: triangles[0],
            }
        })
        .collect();
    let areas = described.iter().map(|part| part.area).collect();
    described.sort_by(|a, b| b.area.total_cmp(&a.area).then(a.triangle.cmp(&b.triangle)));
    if described.len() > 1 {
        findings.add(
            (FindingKind::SeveralParts, Severity::Note),
            &described,
            |part| Spot::triangles(wound, &[part.triangle]),
            format!("{} parts that share no edge", described.len()),
            "a skin is one part: if the others are bones or clothes, put each into a file of its own",
        );
    }
    report.n_parts = described.len();
    described.truncate(N_LISTED);
    report.parts = described;
    areas
}

fn check_boundary(
    surface: &Surface,
    sides: &[Side],
    parts: &[Vec<u32>],
    area_of_part: &[f64],
    report: &mut SurfaceReport,
    findings: &mut Findings,
) {
    let boundary: Vec<Side> = by_edge(sides)
        .filter(|e| e.len() == 1)
        .map(|e| e[0])
        .collect();
    let mut part_of = vec![0; surface.triangles.len()];
    for (p, part) in parts.iter().enumerate() {
        for &t in part {
            part_of[t as usize] = p;
        }
    }
    let mut loops: Vec<(BoundaryLoop, [u32; 2])> = chains(&boundary)
        .iter()
        .filter(|chain| is_closed(chain))
        .map(|chain| {
            let area = area_of_part[part_of[chain[0].triangle as usize]];
            (describe_loop(surface, chain, area), chain[0].edge)
        })
        .collect();
    loops.sort_by(|(a, at_a), (b, at_b)| b.length.total_cmp(&a.length).then(at_a.cmp(at_b)));

    let (holes, cuts): (Vec<_>, Vec<_>) = loops.iter().partition(|(l, _)| l.is_hole);
    let spot = |(l, edge): &&(BoundaryLoop, [u32; 2])| Spot {
        vertices: edge.to_vec(),
        triangles: vec![],
        point: l.centre,
    };
    findings.add(
        (FindingKind::Hole, Severity::Unrepairable),
        &holes,
        spot,
        counted(
            holes.len(),
            "hole: a boundary loop that is small, or not in one plane",
            "holes: boundary loops that are small, or not in one plane",
        ),
        "fill them (Blender: Mesh > Clean Up > Fill Holes; MeshLab: Close Holes); cut a limb along a plane",
    );
    findings.add(
        (FindingKind::OpenBoundary, Severity::Note),
        &cuts,
        spot,
        format!(
            "open at {}, {} of them in one plane",
            counted(cuts.len(), "boundary loop", "boundary loops"),
            cuts.iter().filter(|(l, _)| l.is_flat).count()
        ),
        "they are taken as cut faces of the body",
    );
    check_t_junctions(surface, &boundary, findings);
    report.n_loops = loops.len();
    report.loops = loops.into_iter().take(N_LISTED).map(|(l, _)| l).collect();
}

/// Whether a chain of boundary edges returns to its start. The rim of a fin does not.
fn is_closed(chain: &[Side]) -> bool {
    let mut ends: Vec<u32> = chain.iter().flat_map(|side| side.edge).collect();
    ends.sort_unstable();
    ends.chunk_by(|a, b| a == b)
        .all(|at_vertex| at_vertex.len() % 2 == 0)
}

fn describe_loop(surface: &Surface, chain: &[Side], part_area: f64) -> BoundaryLoop {
    let n = chain.len() as f64;
    let ends = |side: &Side| side.directed().map(|v| surface.points[v as usize]);
    let centre = chain.iter().map(|side| ends(side)[0]).sum::<Vec3>() / n;
    let mut normal = Vec3::zeros();
    let mut length = 0.0;
    for side in chain {
        let [a, b] = ends(side);
        normal += (a - centre).cross(&(b - centre)) * 0.5;
        length += (b - a).norm();
    }
    let area = normal.norm();
    let unit = normal
        .try_normalize(f64::MIN_POSITIVE)
        .unwrap_or_else(Vec3::zeros);
    let is_flat = chain
        .iter()
        .all(|side| (ends(side)[0] - centre).dot(&unit).abs() <= FLATNESS * length);
    let least = if is_flat { SMALLEST_CUT } else { SMALLEST_RIM };
    BoundaryLoop {
        n_edges: chain.len(),
        length,
        area,
        is_flat,
        centre: centre.into(),
        is_hole: area < least * part_area,
    }
}

/// Finds boundary vertices that lie inside a boundary edge: there the surface looks closed but is
/// not.
fn check_t_junctions(surface: &Surface, boundary: &[Side], findings: &mut Findings) {
    let tolerance = DEFAULT_WELD_TOLERANCE * used_bounds(surface).map_or(0.0, diagonal);
    let is_finite = |v: u32| surface.points[v as usize].iter().all(|x| x.is_finite());
    let lines = boundary
        .iter()
        .filter(|side| side.edge.iter().all(|&v| is_finite(v)))
        .map(|side| {
            let [a, b] = side.edge.map(|v| surface.points[v as usize].into());
            GeomWithData::new(Line::new(a, b), side.edge)
        })
        .collect();
    let tree: RTree<GeomWithData<Line<[f64; 3]>, [u32; 2]>> = RTree::bulk_load(lines);
    let mut vertices: Vec<u32> = boundary
        .iter()
        .flat_map(|side| side.edge)
        .filter(|&v| is_finite(v))
        .collect();
    vertices.sort_unstable();
    vertices.dedup();
    let is_on_edge = |v: u32| {
        let p = surface.points[v as usize];
        let reach = Vec3::repeat(tolerance);
        let near = AABB::from_corners((p - reach).into(), (p + reach).into());
        tree.locate_in_envelope_intersecting(near)
            .take(MAX_LINES_PER_VERTEX)
            .any(|line| {
                let [a, b] = line.data.map(|v| surface.points[v as usize]);
                !line.data.contains(&v) && is_inside_segment(&p, &a, &b, tolerance)
            })
    };
    let junctions: Vec<u32> = vertices.into_iter().filter(|&v| is_on_edge(v)).collect();
    findings.add(
        (FindingKind::TJunction, Severity::Unrepairable),
        &junctions,
        |&v| Spot::vertex(surface, v),
        counted(
            junctions.len(),
            "vertex lies on an edge that it does not end",
            "vertices lie on edges that they do not end",
        ),
        "split those edges there (Blender: Merge by Distance after Subdivide; MeshLab: Snap Mismatched Borders), or remesh",
    );
}

/// Largest number of edges whose boxes may contain a vertex before the search gives up. A clean
/// boundary has two.
const MAX_LINES_PER_VERTEX: usize = 1000;

fn is_inside_segment(p: &Vec3, a: &Vec3, b: &Vec3, tolerance: f64) -> bool {
    let along = b - a;
    let s = (p - a).dot(&along) / along.norm_squared();
    let end = tolerance / along.norm();
    s > end && s < 1.0 - end && (p - a - along * s).norm() <= tolerance
}
