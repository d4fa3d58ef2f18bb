//! Whether error bars hold: presses that are drawn at random, against the same presses on meshes
//! with less than half the size.

mod draw;
mod picture;

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use anyhow::Context as _;
use palpa::Prepared;
use palpa::accuracy::{Descent, SAFETY, Source, wide};
use palpa::build::{BuiltBody, build};
use palpa::press::mesh::Sizes;
use palpa::press::tissue::Indentation;
use palpa_scene::Scene;
use serde::{Deserialize, Serialize};

pub use self::draw::{Drawn, draw_scene};
pub use self::picture::draw;

/// Factors on the sizes near and far of the meshes on the way to the reference, the reference last.
const FINER: [[f64; 2]; 2] = [[0.7, 0.7], [0.45, 0.55]];
/// Order of convergence of the force in the size: under a bonded disc, whose edge is sharp, and under
/// a tool in contact.
const EDGE_ORDER: f64 = 1.0;
const ORDER: f64 = 1.5;
/// Least share of the true forces that shall lie within the bars, and largest median of bar by true
/// error.
pub const LEAST_COVERAGE: f64 = 0.9;
/// See [`LEAST_COVERAGE`].
pub const MOST_WIDTH: f64 = 3.0;

/// The press of one drawn scene at its deepest.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Case {
    /// Seed of the scene.
    pub seed: u64,
    /// Shape of the tool.
    pub tool: String,
    /// Body, number of layers and lumps.
    pub body: String,
    /// Depth, mm.
    pub depth_mm: f64,
    /// Number of nodes.
    pub n_nodes: usize,
    /// Force, N; `None` without equilibrium.
    pub force_n: Option<f64>,
    /// Contribution near the tool, N.
    pub error_near_n: Option<f64>,
    /// Contribution of the skin around it, N.
    pub error_skin_far_n: Option<f64>,
    /// Contribution of deep levels, N.
    pub error_levels_deep_n: Option<f64>,
    /// Contribution of the edge of the contact, N.
    pub error_contact_n: Option<f64>,
    /// The force extrapolated to an infinitely fine mesh, N; `None` if it cannot be.
    pub extrapolated_n: Option<f64>,
    /// Number of nodes of the reference.
    pub reference_nodes: Option<usize>,
    /// Force of the reference, N; `None` without equilibrium, or if its mesh is too large.
    pub reference_n: Option<f64>,
    /// Change of the force from the mesh before the reference to the reference, N.
    pub reference_change_n: Option<f64>,
    /// Time for the press, s.
    pub press_s: f64,
    /// Time for the probes, s.
    pub probes_s: f64,
    /// Time for the reference, s.
    pub reference_s: f64,
    /// Why a force, a bar or the reference is missing.
    pub missing: String,
}

impl Case {
    /// True error, N: force of an infinitely fine mesh minus force. What the reference lacks of it
    /// is taken into account by the order of convergence.
    pub fn error_n(&self) -> Option<f64> {
        let order = if self.tool == draw::DISC {
            EDGE_ORDER
        } else {
            ORDER
        };
        let lacks = FINER[FINER.len() - 1][0].powf(order);
        Some((self.reference_n? - self.force_n?) / (1.0 - lacks))
    }

    fn contributions_n(&self) -> Option<[f64; 3]> {
        Some([
            self.error_near_n?,
            self.error_skin_far_n?,
            self.error_levels_deep_n?,
        ])
    }

    /// Half the width of the error bar, N; `None` if a probe failed.
    pub fn error_bar_n(&self) -> Option<f64> {
        let contact = self.error_contact_n.unwrap_or(0.0).abs();
        Some(wide(self.contributions_n()?, self.tool == draw::DISC) + SAFETY * contact)
    }

    /// Width of the bar in true errors; `None` without bar or reference.
    pub fn width(&self) -> Option<f64> {
        Some(self.error_bar_n()? / self.error_n()?.abs())
    }
}

/// What the cases with bar and reference say.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Number of cases.
    pub n_cases: usize,
    /// Number of cases with bar and reference.
    pub n_judged: usize,
    /// Share of the judged cases in which the true force lies within the bar.
    pub coverage: f64,
    /// Median of half the bar's width by the size of the true error.
    pub median_width: f64,
    /// Median size of the true error as a share of the force.
    pub median_error: f64,
    /// Number of judged cases with an extrapolated force.
    pub n_extrapolated: usize,
    /// Median distance of the extrapolated force from the truth, as a share of the force.
    pub median_extrapolated_error: Option<f64>,
    /// Median of half the bar's width as a share of the force.
    pub median_bar: f64,
    /// Median time of the probes by the time of the press.
    pub median_cost: f64,
    /// Seeds of the cases in which it lies outside.
    pub outside: Vec<u64>,
}

impl Summary {
    /// Sums up cases; `None` if none can be judged.
    pub fn of(cases: &[Case]) -> Option<Self> {
        let judged: Vec<&Case> = cases.iter().filter(|case| case.width().is_some()).collect();
        let median = |of: &dyn Fn(&Case) -> Option<f64>| -> Option<f64> {
            let mut all: Vec<f64> = judged.iter().filter_map(|case| of(case)).collect();
            all.sort_by(f64::total_cmp);
            all.get(all.len() / 2).copied()
        };
        let outside: Vec<u64> = (judged.iter())
            .filter(|case| case.width().is_some_and(|width| width < 1.0))
            .map(|case| case.seed)
            .collect();
        Some(Self {
            n_cases: cases.len(),
            n_judged: judged.len(),
            coverage: 1.0 - outside.len() as f64 / judged.len() as f64,
            median_width: median(&Case::width)?,
            median_error: median(&|case| Some(case.error_n()?.abs() / case.force_n?))?,
            n_extrapolated: (judged.iter())
                .filter(|case| case.extrapolated_n.is_some())
                .count(),
            median_extrapolated_error: median(&|case| {
                let left = case.force_n? + case.error_n()? - case.extrapolated_n?;
                Some(left.abs() / case.force_n?)
            }),
            median_bar: median(&|case| Some(case.error_bar_n()? / case.force_n?))?,
            median_cost: median(&|case| Some(case.probes_s / case.press_s))?,
            outside,
        })
    }

    /// Whether the bars hold and are not too wide.
    pub fn is_good(&self) -> bool {
        self.coverage >= LEAST_COVERAGE && self.median_width <= MOST_WIDTH
    }
}

/// The shapes of tools in cases, each once, in alphabetical order.
pub fn tools(cases: &[Case]) -> Vec<&str> {
    let mut tools: Vec<&str> = cases.iter().map(|case| case.tool.as_str()).collect();
    tools.sort_unstable();
    tools.dedup();
    tools
}

/// The cases of a table (`.csv`); none if there is no such file.
///
/// # Errors
/// If the file is something else.
pub fn read(path: &Path) -> anyhow::Result<Vec<Case>> {
    if !path.exists() {
        return Ok(Vec::new());
    }
    let rows = csv::Reader::from_path(path).and_then(|mut reader| reader.deserialize().collect());
    rows.with_context(|| {
        format!(
            "{} is not a table of error bars; remove it, or choose another folder with --out",
            path.display()
        )
    })
}

/// Presses the scene of a seed with its error bar, and on the mesh of the reference. `progress` is
/// called before each part; if it returns false, the case is given up, and there is no result.
///
/// # Errors
/// If the scene of the seed cannot be read: the draw is wrong then.
pub fn run(seed: u64, mut progress: impl FnMut() -> bool) -> anyhow::Result<Option<Case>> {
    let drawn = draw_scene(seed);
    let scene = Scene::parse(&drawn.text, Path::new("."))
        .with_context(|| format!("the scene drawn for seed {seed}"))?;
    let mut case = Case {
        seed,
        tool: drawn.tool.to_owned(),
        body: drawn.body,
        depth_mm: scene.press.depth * 1e3,
        ..Case::default()
    };
    let begin = Instant::now();
    let grown: Arc<BuiltBody> = build(&scene)?.into();
    let sizes = Sizes::of(&scene).context("a drawn tool has a size")?;
    let press = press_of(&scene, &grown, sizes)?;
    case.n_nodes = press.model.n_nodes();
    let descent = Descent::from_rest(&press, &mut progress);
    if !progress() {
        return Ok(None);
    }
    let Some(descent) = descent else {
        "no equilibrium".clone_into(&mut case.missing);
        return Ok(Some(case));
    };
    case.force_n = Some(descent.force_n());
    case.press_s = begin.elapsed().as_secs_f64();

    let begin = Instant::now();
    let Some(bars) = descent.probe(&press, |_, _| progress()) else {
        return Ok(None);
    };
    let probed = bars.deepest();
    case.probes_s = begin.elapsed().as_secs_f64();
    let part = |source: Source| probed.changes[source as usize].map(|c| c * probed.force_n);
    case.error_near_n = part(Source::Near);
    case.error_skin_far_n = part(Source::SkinFar);
    case.error_levels_deep_n = part(Source::LevelsDeep);
    case.error_contact_n = probed.contact().map(|c| c * probed.force_n);
    case.extrapolated_n = probed.extrapolated_n();
    drop(press);

    let begin = Instant::now();
    let mut found = descent.only_deepest();
    for factors in FINER {
        let next = finer(&scene, &grown, sizes, factors, &found, &mut progress);
        if !progress() {
            return Ok(None);
        }
        match next {
            Ok((n_nodes, next)) => {
                case.reference_nodes = Some(n_nodes);
                case.reference_change_n = Some(next.force_n() - found.force_n());
                case.reference_n = Some(next.force_n());
                found = next;
            }
            Err(error) => {
                case.reference_n = None;
                case.missing = format!("reference: {error:#}");
                break;
            }
        }
    }
    case.reference_s = begin.elapsed().as_secs_f64();
    Ok(Some(case))
}

fn press_of(scene: &Scene, grown: &Arc<BuiltBody>, sizes: Sizes) -> anyhow::Result<Indentation> {
    let prepared = Prepared::with_sizes(scene, Arc::clone(grown), Some(sizes), &[])?;
    anyhow::ensure!(prepared.mesh.is_resolved, "its mesh would be too large");
    Indentation::build(Arc::new(prepared))
}

/// The press on a finer mesh: its number of nodes, and its equilibrium.
fn finer(
    scene: &Scene,
    grown: &Arc<BuiltBody>,
    mut sizes: Sizes,
    [near, far]: [f64; 2],
    from: &Descent,
    mut goes_on: impl FnMut() -> bool,
) -> anyhow::Result<(usize, Descent)> {
    let mut scene = scene.clone();
    let lump = scene.lumps.first();
    scene.mesh.near_lumps = lump.and_then(|lump| scene.mesh.near_lump_of(lump).map(|h| far * h));
    for graded in [&mut sizes.skin, &mut sizes.levels] {
        (graded.near, graded.far) = (near, far);
    }
    let press = press_of(&scene, grown, sizes)?;
    let found = Descent::near(&press, from, &mut goes_on)
        .or_else(|| Descent::from_rest(&press, goes_on).map(Descent::only_deepest));
    let found = found.context("no equilibrium was found")?;
    Ok((press.model.n_nodes(), found))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A press with a true error of 4 % and this contribution near the tool.
    fn case(seed: u64, near: f64) -> Case {
        Case {
            seed,
            tool: "sphere".to_owned(),
            force_n: Some(1.0),
            error_near_n: Some(near),
            error_skin_far_n: Some(0.0),
            error_levels_deep_n: Some(0.0),
            reference_n: Some(1.0 + 0.04 * (1.0 - 0.45_f64.powf(1.5))),
            press_s: 1.0,
            probes_s: 2.0,
            ..Case::default()
        }
    }

    #[test]
    fn bars_that_are_too_narrow_or_too_wide_are_not_good() {
        let good = Summary::of(&[case(0, 0.03), case(1, 0.04), case(2, -0.05)]).unwrap();
        assert_eq!((good.n_judged, good.outside.len()), (3, 0));
        assert!((good.median_error - 0.04).abs() < 1e-12);
        assert!(
            (good.median_width - 2.0).abs() < 1e-12,
            "{}",
            good.median_width
        );
        assert!(good.is_good());
        let narrow = Summary::of(&[case(0, 0.01), case(7, 0.015), case(2, 0.05)]).unwrap();
        assert_eq!(narrow.outside, [0, 7]);
        assert!((narrow.coverage - 1.0 / 3.0).abs() < 1e-12);
        assert!(!narrow.is_good());
        assert!(!Summary::of(&[case(0, 0.2)]).unwrap().is_good());
        let missing = Case::default();
        assert!(Summary::of(std::slice::from_ref(&missing)).is_none());
        assert_eq!(Summary::of(&[missing, case(0, 0.03)]).unwrap().n_judged, 1);
    }
}
