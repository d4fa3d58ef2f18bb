//! Checks of a surface: the defects, their places, and what can be done about them.

mod connect;
mod intersect;
mod shape;

use serde::Serialize;

use crate::repair::{RepairOptions, RepairReport, repair};
use crate::{Surface, SurfaceFile, Vec3};

pub use connect::{BoundaryLoop, Part};
pub use intersect::{Intersections, self_intersections};

/// Number of places listed for each finding, and of parts and loops listed in each report. The
/// counts cover all of them.
pub const N_LISTED: usize = 10;

/// The result of a check of a surface.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SurfaceReport {
    /// The verdict, which follows from the most severe finding.
    pub verdict: Verdict,
    /// Number of vertices.
    pub n_vertices: usize,
    /// Number of triangles.
    pub n_triangles: usize,
    /// Number of edges, each counted once.
    pub n_edges: usize,
    /// Number of edges with one triangle.
    pub n_boundary_edges: usize,
    /// Number of edges with three or more triangles.
    pub n_nonmanifold_edges: usize,
    /// Smallest coordinates of the finite points. m
    pub lower: [f64; 3],
    /// Largest coordinates of the finite points. m
    pub upper: [f64; 3],
    /// Total area. m²
    pub area: f64,
    /// Number of parts. A part is a set of triangles connected over edges.
    pub n_parts: usize,
    /// The first [`N_LISTED`] parts, largest area first.
    pub parts: Vec<Part>,
    /// Number of loops of boundary edges.
    pub n_loops: usize,
    /// The first [`N_LISTED`] loops, longest first.
    pub loops: Vec<BoundaryLoop>,
    /// The findings, most severe first.
    pub findings: Vec<Finding>,
}

/// Whether a surface can be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// It can be used as it is.
    Good,
    /// It can be used after [`repair`].
    Repairable,
    /// It can be used only after a change by hand.
    Bad,
}

/// How severe a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// Worth knowing.
    Note,
    /// A defect that [`repair`] removes.
    Repairable,
    /// A defect that has no safe repair.
    Unrepairable,
}

/// One kind of finding, with all places where it occurs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// The kind of finding.
    pub kind: FindingKind,
    /// How severe it is.
    pub severity: Severity,
    /// How often it occurs.
    pub count: usize,
    /// Whether counting stopped at `count`, so that there may be more.
    pub is_at_least: bool,
    /// The first [`N_LISTED`] places where it occurs.
    pub spots: Vec<Spot>,
    /// Description of the finding, for people.
    pub message: String,
    /// Advice on what to do.
    pub advice: String,
}

/// The kinds of findings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum FindingKind {
    /// There are no triangles.
    Empty,
    /// A triangle uses a vertex index that does not exist.
    OutOfRange,
    /// A coordinate is NaN, infinite or far too large.
    NotFinite,
    /// A triangle has a repeated vertex or no area.
    Degenerate,
    /// Two triangles have the same three vertices.
    Duplicate,
    /// Most triangles have no neighbour.
    Unjoined,
    /// Vertices lie almost at the same place.
    NearlyCoincident,
    /// Three or more triangles meet at an edge.
    NonManifoldEdge,
    /// Parts meet at a single vertex.
    NonManifoldVertex,
    /// Neighbouring triangles are wound against each other.
    Winding,
    /// A part faces inward as a whole.
    Inverted,
    /// A part has only one side.
    OneSided,
    /// A small or crooked loop of boundary edges.
    Hole,
    /// A vertex lies on an edge, but is not one of its ends.
    TJunction,
    /// Triangles cross or touch.
    SelfIntersection,
    /// A vertex belongs to no triangle.
    UnusedVertex,
    /// Boundary loops such as those of a cut limb or an open sheet.
    OpenBoundary,
    /// There are several parts.
    SeveralParts,
    /// Triangles with very small angles.
    Sliver,
    /// The size does not fit a body part in metres.
    Scale,
    /// The surface lies far from the origin.
    FarFromOrigin,
    /// It is not clear which side of an open part is the outside.
    UnclearSide,
}

/// The place of a finding.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Spot {
    /// The vertices that identify the place: one vertex, or the two ends of an edge.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub vertices: Vec<u32>,
    /// The triangles that identify the place.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub triangles: Vec<u32>,
    /// A point at the place (the vertex, the middle of the edge, or the centre of the first
    /// triangle). m
    pub point: [f64; 3],
}

impl Spot {
    fn vertex(surface: &Surface, v: u32) -> Self {
        Self {
            vertices: vec![v],
            triangles: vec![],
            point: surface.points[v as usize].into(),
        }
    }

    fn edge(surface: &Surface, [a, b]: [u32; 2]) -> Self {
        let point = (surface.points[a as usize] + surface.points[b as usize]) * 0.5;
        Self {
            vertices: vec![a, b],
            triangles: vec![],
            point: point.into(),
        }
    }

    fn triangles(surface: &Surface, triangles: &[u32]) -> Self {
        let [a, b, c] = surface.corners(triangles[0] as usize);
        Self {
            vertices: vec![],
            triangles: triangles.to_vec(),
            point: ((a + b + c) / 3.0).into(),
        }
    }
}

/// The findings so far. The checks add to them.
#[derive(Debug, Default)]
struct Findings(Vec<Finding>);

impl Findings {
    /// Adds a finding about some items, unless there are none.
    fn add<T>(
        &mut self,
        (kind, severity): (FindingKind, Severity),
        things: &[T],
        spot: impl Fn(&T) -> Spot,
        message: impl Into<String>,
        advice: impl Into<String>,
    ) {
        if things.is_empty() {
            return;
        }
        self.0.push(Finding {
            kind,
            severity,
            count: things.len(),
            is_at_least: false,
            spots: things.iter().take(N_LISTED).map(spot).collect(),
            message: message.into(),
            advice: advice.into(),
        });
    }

    /// Adds a finding about the surface as a whole.
    fn add_global(
        &mut self,
        (kind, severity): (FindingKind, Severity),
        message: impl Into<String>,
        advice: impl Into<String>,
    ) {
        self.0.push(Finding {
            kind,
            severity,
            count: 1,
            is_at_least: false,
            spots: vec![],
            message: message.into(),
            advice: advice.into(),
        });
    }
}

/// Finds the defects of a surface. Coordinates count as metres. The surface is not changed.
///
/// Topology is judged by vertex indices, so weld first ([`crate::read_surface`] does). The check
/// takes about as long as sorting. For surfaces with many layers over each other, the time is
/// limited: the search for self-intersections stops early and says so.
pub fn check_surface(surface: &Surface) -> SurfaceReport {
    let mut findings = Findings::default();
    let mut report = SurfaceReport {
        verdict: Verdict::Good,
        n_vertices: surface.points.len(),
        n_triangles: surface.triangles.len(),
        n_edges: 0,
        n_boundary_edges: 0,
        n_nonmanifold_edges: 0,
        lower: [0.0; 3],
        upper: [0.0; 3],
        area: 0.0,
        n_parts: 0,
        parts: vec![],
        n_loops: 0,
        loops: vec![],
        findings: vec![],
    };
    // The other checks require valid indices.
    if shape::check_indices(surface, &mut findings) {
        shape::check(surface, &mut report, &mut findings);
        connect::check(surface, &mut report, &mut findings);
        intersect::check(surface, &mut findings);
    }
    findings
        .0
        .sort_by_key(|f| (std::cmp::Reverse(f.severity), f.kind));
    report.verdict = match findings.0.first().map(|f| f.severity) {
        Some(Severity::Unrepairable) => Verdict::Bad,
        Some(Severity::Repairable) => Verdict::Repairable,
        Some(Severity::Note) | None => Verdict::Good,
    };
    report.findings = findings.0;
    report
}

/// A check of a surface. If [`repair`] can remove a defect, it also holds the repaired copy and the
/// check of that copy.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Examination {
    /// The verdict. It is [`Verdict::Repairable`] if, and only if, the repaired copy is good and
    /// the surface itself is not.
    pub verdict: Verdict,
    /// The report on the surface itself.
    pub report: SurfaceReport,
    /// The repaired copy and its reports; `None` if there was nothing to repair.
    pub repaired: Option<Repaired>,
}

/// A repaired copy of a surface, with reports on it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Repaired {
    /// The repaired copy.
    #[serde(skip)]
    pub surface: Surface,
    /// The changes that the repair made.
    pub repair: RepairReport,
    /// The check of the copy: the remaining defects.
    pub report: SurfaceReport,
}

/// Checks a surface, repairs what can be repaired, and checks again.
pub fn examine(surface: &Surface, options: &RepairOptions) -> Examination {
    let report = check_surface(surface);
    let is_indexable = report
        .findings
        .iter()
        .all(|f| f.kind != FindingKind::OutOfRange);
    let has_repairable = report
        .findings
        .iter()
        .any(|f| f.severity == Severity::Repairable);
    let repaired = (is_indexable && (has_repairable || options.recentre)).then(|| {
        let (surface, repair) = repair(surface, options);
        let report = check_surface(&surface);
        Repaired {
            surface,
            repair,
            report,
        }
    });
    // Repair may remove more than the finding it was meant for: edges are non-manifold where
    // triangles are doubled. It may also fail to remove a defect.
    let is_mended = |r: &Repaired| r.report.verdict == Verdict::Good;
    let verdict = match report.verdict {
        Verdict::Good => Verdict::Good,
        _ if repaired.as_ref().is_some_and(is_mended) => Verdict::Repairable,
        _ => Verdict::Bad,
    };
    Examination {
        verdict,
        report,
        repaired,
    }
}

impl SurfaceFile {
    /// [`examine`]s the surface of the file, scaled to metres by `metres_per_unit`. Notes from the
    /// reader about left-out or guessed content also affect the verdict.
    pub fn examine(&self, metres_per_unit: f64, options: &RepairOptions) -> Examination {
        let mut examination = examine(&self.surface.scaled(metres_per_unit), options);
        let of_notes = self.notes.iter().map(|note| match note.severity() {
            Severity::Note => Verdict::Good,
            Severity::Repairable => Verdict::Repairable,
            Severity::Unrepairable => Verdict::Bad,
        });
        examination.verdict = of_notes.fold(examination.verdict, Verdict::max);
        examination
    }
}

/// The number `n` with its noun, singular or plural.
fn counted(n: usize, one: &str, more: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { more })
}

/// A length for messages, in a suitable unit.
fn length(metres: f64) -> String {
    match metres {
        x if x >= 1.0 => format!("{x:.3} m"),
        x if x >= 1e-3 => format!("{:.1} mm", x * 1e3),
        x => format!("{:.2} µm", x * 1e6),
    }
}

fn diagonal((lo, hi): (Vec3, Vec3)) -> f64 {
    (hi - lo).norm()
}
