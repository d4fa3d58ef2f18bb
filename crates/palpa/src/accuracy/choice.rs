//! The choice of a mesh by its error bar: finer where it matters, coarser where it does not.

use std::sync::Arc;
use std::time::{Duration, Instant};

use palpa_scene::Scene;
use serde::Serialize;

use super::descent::Descent;
use super::{EDGE_SAFETY, ErrorBars, Probed, SAFETY, Source};
use crate::Prepared;
use crate::build::BuiltBody;
use crate::note::Note;
use crate::press::mesh::Sizes;
use crate::press::tissue::Indentation;

/// Most meshes that are tried, and most sizes for a mesh that differs from the one before.
const MOST_ROUNDS: usize = 10;
const MOST_TRIES: usize = 8;
/// Edges of the first mesh, as a share of the contact radius, and their limits, m.
const FIRST: f64 = 0.35;
const LIMITS: (f64, f64) = (0.1e-3, 10e-3);
/// Share of the bar that the part near the tool may have.
const NEAR_SHARE: f64 = 0.65;
/// Each mesh aims at this share of the bar that is asked for.
const AIM: f64 = 0.9;
/// Expected order of a contribution in its size: at the sharp edge of a bonded disc, and else.
const EDGE_ORDER: f64 = 1.0;
pub(crate) const ORDER: f64 = 1.5;
/// Range of factors on a size from one mesh to the next.
const FACTORS: (f64, f64) = (0.6, 1.4);
/// Factor on sizes whose probe found no equilibrium, or on all if the press found none. Since
/// triangles are divided in two, a factor nearer to 1 would change little.
const BLIND: f64 = 0.7;
/// Expected growth of the time of a round with the number of nodes.
const TIME_ORDER: f64 = 1.4;

/// The accuracy that is asked for, and the time it may take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// Half the width of the error bar at the deepest, as a share of the force.
    pub accuracy: f64,
    /// Longest time for the choice; `None` without limit.
    pub max_time: Option<Duration>,
}

/// One mesh that was tried.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Round {
    /// Number of nodes.
    pub n_nodes: usize,
    /// Number of levels.
    pub n_levels: usize,
    /// Mean length of the skin's edges near the tool, mm.
    pub edge_mm: f64,
    /// The probes at the deepest; `None` if the press found no equilibrium.
    pub probed: Option<Probed>,
    /// Half the width of the bar as a share of the force; `None` if a probe failed.
    pub half_width: Option<f64>,
    /// Time for this mesh, s.
    pub seconds: f64,
}

/// How a choice ended.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum End {
    /// The bar is small enough.
    Reached,
    /// The next mesh would have more skin vertices than are allowed.
    MaxVertices {
        /// The number allowed.
        max_vertices: usize,
    },
    /// The next mesh would have too many levels.
    MaxLevels,
    /// The next mesh would probably take longer than what is left of the time.
    MaxTime {
        /// Time that it would take, s.
        expected_s: f64,
    },
    /// A probe of the last mesh was too large.
    ProbeTooLarge,
    /// Finer meshes did not make the bar smaller, or none found an equilibrium.
    NoProgress,
    /// It was given up before its end.
    Interrupted,
}

/// How a mesh was chosen.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MeshChoice {
    /// Half the width of the bar that was asked for, as a share of the force.
    pub accuracy: f64,
    /// The meshes that were tried, in their order.
    pub rounds: Vec<Round>,
    /// Index of the best.
    pub best: usize,
    /// How the choice ended.
    pub end: End,
    /// The error bars of the best mesh, if it was probed.
    #[serde(skip)]
    pub bars: Option<ErrorBars>,
}

impl MeshChoice {
    /// Half the width of the best bar as a share of the force.
    pub fn half_width(&self) -> Option<f64> {
        self.rounds[self.best].half_width
    }
}

/// Factors on the sizes of a mesh: near the tool, and far from it. Edges and heights have the same
/// factor, since prisms that are flat or tall have larger errors.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Factors {
    near: f64,
    far: f64,
    /// Whether the sizes had to be smaller than those before.
    is_smaller: [bool; 2],
}

impl Factors {
    fn sizes(self, scene: &Scene) -> Sizes {
        let h = scene.tool.edge_length(FIRST).clamp(LIMITS.0, LIMITS.1);
        let mut sizes = Sizes::graded(scene, h);
        for graded in [&mut sizes.skin, &mut sizes.levels] {
            (graded.near, graded.far) = (self.near, self.far);
        }
        sizes
    }

    /// The factors after a mesh with these contributions.
    fn after(self, round: &Round, accuracy: f64, is_edged: bool, is_first: bool) -> Self {
        let probed = round.probed.as_ref();
        // Only the first mesh is made coarser where it is too fine: else sizes would go to and fro.
        let most = if is_first && round.half_width.is_some_and(|half| half < accuracy) {
            FACTORS.1
        } else {
            1.0
        };
        let size = |sources: &[Source]| -> Option<f64> {
            let size = |source: &Source| probed?.changes[*source as usize].map(f64::abs);
            sources.iter().map(size).sum()
        };
        let edge = if is_edged { EDGE_SAFETY / SAFETY } else { 1.0 };
        // More vertices touch where edges are shorter.
        let contact = probed.and_then(Probed::contact).unwrap_or(0.0);
        let sums = [
            size(&[Source::Near]).map(|near| edge * near + contact),
            size(&[Source::SkinFar, Source::LevelsDeep]),
        ];
        // Each part may have its share of the bar, and what the other part leaves of its own.
        let all = AIM * accuracy / SAFETY;
        let shares = [NEAR_SHARE * all, (1.0 - NEAR_SHARE) * all];
        let left = |i: usize| sums[1 - i].map_or(0.0, |other| (shares[1 - i] - other).max(0.0));
        let orders = [if is_edged { EDGE_ORDER } else { ORDER }, ORDER];
        let factor = |i: usize| {
            let Some(sum) = sums[i] else {
                return BLIND;
            };
            // The share of a part that is too coarse is not spent elsewhere.
            let wanted = ((shares[i] + left(i)) / sum).powf(1.0 / orders[i]);
            if wanted < 1.0 {
                wanted.clamp(FACTORS.0, BLIND)
            } else {
                wanted.min(most)
            }
        };
        let [near, far] = [factor(0), factor(1)];
        Self {
            near: self.near * near,
            far: self.far * far,
            is_smaller: [near < 1.0, far < 1.0],
        }
    }

    /// Smaller sizes where they had to be smaller.
    fn finer(self) -> Self {
        let [near, far] = self.is_smaller.map(|is| if is { BLIND } else { 1.0 });
        Self {
            near: self.near * near,
            far: self.far * far,
            ..self
        }
    }
}

/// Chooses the mesh for the press of a scene, on a body grown for it. `progress` is called before
/// each mesh and probe with the meshes so far; if it returns false, the choice is given up. Returns
/// the press on the best mesh; `None` if the choice was given up during the first one.
///
/// The first mesh has edges of about a third of the contact radius. Its probes say how much each size
/// contributes to the bar; the sizes of the next mesh follow from that.
///
/// # Errors
/// When place, depth, tissues or lumps do not fit the body, the tool has no size, or the body has more
/// skin vertices than are allowed.
pub fn choose_mesh(
    scene: &Scene,
    grown: &Arc<BuiltBody>,
    goal: &Goal,
    mut progress: impl FnMut(&[Round]) -> bool,
) -> anyhow::Result<Option<(Indentation, MeshChoice)>> {
    if !scene.tool.has_size() {
        anyhow::bail!(
            "a tool of a single node has a force that grows without limit as the mesh gets finer, so that no accuracy \
             can be reached; press with a disc or another shape"
        );
    }
    let (n_vertices, max_vertices) = (grown.growth.body.n_vertices(), scene.mesh.max_vertices);
    if n_vertices > max_vertices {
        anyhow::bail!(
            "no mesh can be chosen: the skin has {n_vertices} vertices before it is refined, and max_vertices in [mesh] is \
             {max_vertices}; raise it, or take a coarser surface"
        );
    }
    let start = Instant::now();
    let mut factors = Factors {
        near: 1.0,
        far: 1.0,
        is_smaller: [false; 2],
    };
    let mut rounds: Vec<Round> = Vec::new();
    let mut solved: Option<Descent> = None;
    let mut best: Option<(usize, Indentation, Option<ErrorBars>)> = None;
    let end = loop {
        if !progress(&rounds) {
            break End::Interrupted;
        }
        let begin = Instant::now();
        let prepared = next_mesh(scene, grown, &mut factors, rounds.last())?;
        if let Some(last) = rounds.last() {
            let n_nodes = prepared.mesh.body.n_nodes();
            if let Some(limit) = limit_met(&prepared) {
                break limit;
            }
            let growth = (n_nodes as f64 / last.n_nodes as f64).powf(TIME_ORDER);
            let expected_s = start.elapsed().as_secs_f64() + last.seconds * growth.max(1.0);
            if (goal.max_time).is_some_and(|most| expected_s > most.as_secs_f64()) {
                break End::MaxTime { expected_s };
            }
        }
        let press = Indentation::build(Arc::new(prepared))?;
        let mut bars = None;
        let mut goes_on = || progress(&rounds);
        let near = (solved.as_ref()).and_then(|last| Descent::near(&press, last, &mut goes_on));
        let found = near.or_else(|| Descent::from_rest(&press, &mut goes_on));
        if !goes_on() {
            break End::Interrupted;
        }
        if let Some(descent) = found {
            bars = descent.probe(&press, |_, _| progress(&rounds));
            if bars.is_none() {
                break End::Interrupted;
            }
            solved = Some(descent);
        }
        let probed = bars.as_ref().map(|bars| bars.deepest().clone());
        let half_width = probed.as_ref().and_then(Probed::half_width);
        let is_too_large = bars.as_ref().is_some_and(|bars| bars.is_too_large);
        let is_best = best.as_ref().is_none_or(|(index, ..)| {
            let before = rounds[*index].half_width.unwrap_or(f64::INFINITY);
            half_width.is_some_and(|now| now < before)
        });
        let round = Round {
            n_nodes: press.model.n_nodes(),
            n_levels: press.mesh().body.n_levels,
            edge_mm: press.mesh().mesh_size * 1e3,
            probed,
            half_width,
            seconds: begin.elapsed().as_secs_f64(),
        };
        let is_edged = scene.tool.is_bonded();
        factors = factors.after(&round, goal.accuracy, is_edged, rounds.is_empty());
        rounds.push(round);
        if is_best {
            best = Some((rounds.len() - 1, press, bars));
        }
        if half_width.is_some_and(|half| half <= goal.accuracy) {
            break End::Reached;
        }
        if is_too_large {
            break End::ProbeTooLarge;
        }
        if rounds.len() == MOST_ROUNDS {
            break End::NoProgress;
        }
    };
    let Some((best, press, bars)) = best else {
        // The first mesh is the best at first.
        return Ok(None);
    };
    let choice = MeshChoice {
        accuracy: goal.accuracy,
        rounds,
        best,
        end,
        bars,
    };
    Ok(Some((press, choice)))
}

/// The mesh with these sizes. If it is the last one again, sizes are made smaller: triangles are
/// divided in two, so that a somewhat smaller size may change nothing.
fn next_mesh(
    scene: &Scene,
    grown: &Arc<BuiltBody>,
    factors: &mut Factors,
    last: Option<&Round>,
) -> anyhow::Result<Prepared> {
    let mut n_tries = 0;
    loop {
        let sizes = Some(factors.sizes(scene));
        let prepared = Prepared::with_sizes(scene, Arc::clone(grown), sizes, &[])?;
        let is_new = last.is_none_or(|last| last.n_nodes != prepared.mesh.body.n_nodes());
        if is_new || n_tries == MOST_TRIES {
            return Ok(prepared);
        }
        *factors = factors.finer();
        n_tries += 1;
    }
}

/// The limit that kept a mesh from being as fine as wanted.
fn limit_met(prepared: &Prepared) -> Option<End> {
    prepared.notes.iter().find_map(|note| match note {
        Note::SkinTooCoarse { max_vertices, .. } => Some(End::MaxVertices {
            max_vertices: *max_vertices,
        }),
        Note::LevelsTooHigh { .. } => Some(End::MaxLevels),
        _ => None,
    })
}
