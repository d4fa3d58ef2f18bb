//! What is wrong with a surface, where, and what can be done about it.

mod connect;
mod intersect;
mod shape;

use serde::Serialize;

use crate::repair::{RepairOptions, RepairReport, repair};
use crate::{Surface, SurfaceFile, Vec3};

pub use connect::{BoundaryLoop, Part};
pub use intersect::{Intersections, self_intersections};

/// Places that are listed of each finding, and parts and loops of each report; the counts are of all.
pub const N_LISTED: usize = 10;

/// What a check of a surface has come to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SurfaceReport {
    /// The gravest of the findings.
    pub verdict: Verdict,
    /// Vertices.
    pub n_vertices: usize,
    /// Triangles.
    pub n_triangles: usize,
    /// Edges, each counted once.
    pub n_edges: usize,
    /// Edges with one triangle.
    pub n_boundary_edges: usize,
    /// Edges with three triangles or more.
    pub n_nonmanifold_edges: usize,
    /// Smallest coordinates of the finite points. m
    pub lower: [f64; 3],
    /// Largest coordinates of the finite points. m
    pub upper: [f64; 3],
    /// Total area. m²
    pub area: f64,
    /// Parts that hang together over edges.
    pub n_parts: usize,
    /// The first [`N_LISTED`] of the parts, the largest area first.
    pub parts: Vec<Part>,
    /// Loops of boundary edges.
    pub n_loops: usize,
    /// The first [`N_LISTED`] of the loops, the longest first.
    pub loops: Vec<BoundaryLoop>,
    /// What was found, the gravest first.
    pub findings: Vec<Finding>,
}

/// Whether a surface can be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// As it is.
    Good,
    /// After [`repair`].
    Repairable,
    /// Only after somebody has changed it by hand.
    Bad,
}

/// How grave a finding is.
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

/// One kind of thing that was found, wherever it occurs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// What it is.
    pub kind: FindingKind,
    /// How grave it is.
    pub severity: Severity,
    /// How often it occurs.
    pub count: usize,
    /// Whether counting stopped there, so that there may be more.
    pub is_at_least: bool,
    /// The first [`N_LISTED`] places where it occurs.
    pub spots: Vec<Spot>,
    /// What was found, in words.
    pub message: String,
    /// What to do.
    pub advice: String,
}

/// The kinds of findings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum FindingKind {
    /// There are no triangles.
    Empty,
    /// A triangle names a vertex that is not there.
    OutOfRange,
    /// A coordinate is NaN, infinite or beyond all measure.
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
    /// A part has but one side.
    OneSided,
    /// A small or crooked loop of boundary edges.
    Hole,
    /// A vertex lies on an edge that it is no end of.
    TJunction,
    /// Triangles cross or touch.
    SelfIntersection,
    /// A vertex belongs to no triangle.
    UnusedVertex,
    /// Boundary loops as a cut limb or an open sheet has them.
    OpenBoundary,
    /// There are several parts.
    SeveralParts,
    /// Triangles with very small angles.
    Sliver,
    /// The size is not that of a part of a body in metres.
    Scale,
    /// The surface lies far from the origin.
    FarFromOrigin,
    /// It is not clear which side of an open part is out.
    UnclearSide,
}

/// Where something was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Spot {
    /// The vertices that name the place: one vertex, or the two ends of an edge.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub vertices: Vec<u32>,
    /// The triangles that name the place.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub triangles: Vec<u32>,
    /// A point there (the centre of the first triangle, the middle of the edge). m
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

/// What the checks add to, each only where there is something to add.
#[derive(Debug, Default)]
struct Findings(Vec<Finding>);

impl Findings {
    /// Adds a finding for some things, unless there are none of them.
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

/// Finds what is wrong with a surface. Coordinates are taken as metres; nothing is changed.
///
/// Topology is judged by vertex indices: weld first ([`crate::read_surface`] does). Time is about that of sorting, and bounded
/// for surfaces that lie in many layers over each other: there the search for self-intersections stops and says so.
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
    // What comes after takes indices for granted.
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

/// A check, and where it found something that [`repair`] removes, the repaired copy and its own check.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Examination {
    /// [`Verdict::Repairable`] if, and only if, the repaired copy is good and the surface itself is not.
    pub verdict: Verdict,
    /// What was found.
    pub report: SurfaceReport,
    /// What the repair came to, if there was anything for it to do.
    pub repaired: Option<Repaired>,
}

/// A repaired copy and what is known about it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Repaired {
    /// The copy.
    #[serde(skip)]
    pub surface: Surface,
    /// What the repair did.
    pub repair: RepairReport,
    /// What is still wrong with the copy.
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
    // Repair may remove more than it set out to: edges are crowded where triangles are doubled. And it may fall short.
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
    /// [`examine`]s the surface of the file, scaled to metres by `metres_per_unit`; what the reader had to leave out or to guess
    /// counts for the verdict.
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

/// `n` things, with the words that follow for one and for more.
fn counted(n: usize, one: &str, more: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { more })
}

/// A length for people, in the unit that fits it.
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
