//! Error bars: how far the force of a press may be from that of an infinitely fine mesh.
//!
//! A *probe* is the same press on a mesh that is finer in one respect: prisms near the tool,
//! triangles of the skin around it, or deep intervals between levels, each divided in two.
//! The change of the force is that respect's contribution. Probes cover the part of the body near
//! the tool; its border moves as in the press. They start from the press's own displacements, which
//! a finer mesh of the same body can take over.
//!
//! The bar is the sum of the *sizes* of the contributions times [`SAFETY`], so that errors of
//! opposite sign do not hide each other.
//!
//! Probes are elastic: tissue that relaxes is probed at its instantaneous stiffness, and the relative
//! error is taken over. Errors of the scene (its surface, thicknesses, stiffnesses) are not in the
//! bar.

mod choice;
mod descent;
mod probe;

use std::fmt;

use serde::Serialize;

pub use self::choice::{End, Goal, MeshChoice, Round, choose_mesh};
pub use self::descent::{Descent, Stops};
use crate::press::tissue::Sample;

/// Factor between the sum of the contributions and the bar. Halving a size shows half of an error of
/// first order and three quarters of one of second order.
pub const SAFETY: f64 = 2.0;
/// Factor between the sum of the signed contributions and the expected error. Halving a size shows
/// three quarters of an error of second order.
pub const EXTRAPOLATION: f64 = 4.0 / 3.0;
/// The same for load steps: their contribution is half of the change from steps twice as long, and in
/// relaxing tissue the error, of second order, is a third of that change.
const STEP_EXTRAPOLATION: f64 = 2.0 / 3.0;
/// Depths that are probed, as shares of the deepest.
const DEPTHS: [f64; 3] = [1.0, 0.5, 0.25];

/// Depths closer than this are the same, mm.
const SAME_DEPTH: f64 = 1e-9;

/// What a probe makes finer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// Edges of the skin's triangles near the tool, and heights of the intervals between levels near
    /// the skin. They are made finer together, because the error of a prism depends on its shape: of
    /// edges or heights alone, the change is often many times the error, with opposite signs.
    Near,
    /// Edges of the skin's triangles around that.
    SkinFar,
    /// Heights of the deeper intervals.
    LevelsDeep,
}

/// Number of sources.
pub const N_SOURCES: usize = 3;

impl Source {
    /// All sources, in the order of every list of contributions.
    pub const ALL: [Self; N_SOURCES] = [Self::Near, Self::SkinFar, Self::LevelsDeep];
}

/// What becomes finer, in English.
impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Near => "prisms near the tool",
            Self::SkinFar => "triangles around them",
            Self::LevelsDeep => "deep intervals",
        })
    }
}

/// Contributions to the error at one depth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Probed {
    /// Depth of the tool, mm.
    pub depth_mm: f64,
    /// Force on the press's own mesh, of the elastic problem that the probes solve, N.
    pub force_n: f64,
    /// Relative change of the force by each probe, in the order of [`Source::ALL`]; `None` if its
    /// probe found no equilibrium, here and at all smaller depths.
    pub changes: [Option<f64>; N_SOURCES],
    /// Whether the change is that at the next smaller depth, because the probe found no equilibrium
    /// here.
    pub is_stand_in: [bool; N_SOURCES],
}

impl Probed {
    /// Half the width of the bar relative to the force; `None` if a probe failed.
    pub fn half_width(&self) -> Option<f64> {
        let sizes: Option<Vec<f64>> = self.changes.iter().map(|c| c.map(f64::abs)).collect();
        sizes.map(|sizes| SAFETY * sizes.iter().sum::<f64>())
    }

    /// The force extrapolated to an infinitely fine mesh, N; `None` if a probe failed.
    pub fn extrapolated_n(&self) -> Option<f64> {
        let sum: Option<f64> = self.changes.into_iter().sum();
        sum.map(|sum| self.force_n * (1.0 + EXTRAPOLATION * sum))
    }
}

/// The error bar of a force.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ErrorBar {
    /// Half the width of the bar, N.
    pub half_width_n: f64,
    /// The force extrapolated to an infinitely fine mesh, N.
    pub extrapolated_n: f64,
    /// Signed contributions, N, in the order of [`Source::ALL`].
    pub contributions_n: [f64; N_SOURCES],
    /// Signed contribution of the load steps, N.
    pub load_step_n: f64,
}

/// The error bars of a press.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ErrorBars {
    /// Contributions at the depths that were probed, the deepest first; at least one.
    pub probed: Vec<Probed>,
    /// Relative change of the force at the deepest if the load steps of the press were halved: at most
    /// half of the change from steps twice as long, which is the value. `None` if steps do not
    /// matter, as in elastic tissue without friction, or if the longer steps found no equilibrium.
    pub load_step: Option<f64>,
    /// Number of nodes of the largest probe.
    pub n_nodes: usize,
}

impl ErrorBars {
    /// Half the width of the bar at a depth that was probed, relative to the force; `None` if a
    /// probe failed.
    pub fn half_width(&self, probed: &Probed) -> Option<f64> {
        let steps = SAFETY * self.load_step.map_or(0.0, f64::abs);
        probed.half_width().map(|half| half + steps)
    }

    /// The contributions at the deepest.
    pub fn deepest(&self) -> &Probed {
        &self.probed[0]
    }

    /// Enters the bars into the samples of a press. Each run has the forces of its own press down.
    pub fn enter(&self, samples: &mut [Sample]) {
        let of = |sample: &Sample| self.of(sample, &loading(samples, sample.run));
        let bars: Vec<Option<ErrorBar>> = (samples.iter())
            .map(|s| s.outcome.is_converged().then(|| of(s)).flatten())
            .collect();
        for (sample, bar) in samples.iter_mut().zip(bars) {
            sample.error_bar_n = bar.map(|bar| bar.half_width_n);
            sample.extrapolated_n = bar.map(|bar| bar.extrapolated_n);
            let part = |i: usize| bar.map(|bar| bar.contributions_n[i]);
            sample.error_near_n = part(0);
            sample.error_skin_far_n = part(1);
            sample.error_levels_deep_n = part(2);
            sample.error_load_step_n = bar.map(|bar| bar.load_step_n);
        }
    }

    /// The bar of a sample. `loading` are the samples of its run's first press down. Where no depth was
    /// probed, relative contributions are interpolated; above the least depth they are those at it.
    pub fn of(&self, sample: &Sample, loading: &[&Sample]) -> Option<ErrorBar> {
        let force = force_at(loading, sample.depth_mm)?;
        let changes = self.changes_at(sample.depth_mm)?;
        let contributions_n = changes.map(|change| change * force);
        let load_step_n = self.load_step.map_or(0.0, |change| change * force);
        let sum: f64 = contributions_n.iter().sum();
        let sizes: f64 = contributions_n.iter().map(|c| c.abs()).sum();
        Some(ErrorBar {
            half_width_n: SAFETY * (sizes + load_step_n.abs()),
            extrapolated_n: sample.force_n + EXTRAPOLATION * sum + STEP_EXTRAPOLATION * load_step_n,
            contributions_n,
            load_step_n,
        })
    }

    fn changes_at(&self, depth_mm: f64) -> Option<[f64; N_SOURCES]> {
        let known = |probed: &Probed| -> Option<(f64, [f64; N_SOURCES])> {
            let mut changes = [0.0; N_SOURCES];
            for (into, change) in changes.iter_mut().zip(probed.changes) {
                *into = change?;
            }
            Some((probed.depth_mm, changes))
        };
        // Ascending by depth.
        let all: Vec<(f64, [f64; N_SOURCES])> =
            self.probed.iter().rev().filter_map(known).collect();
        let after = all.partition_point(|(depth, _)| *depth < depth_mm);
        let (before, next) = (
            after.checked_sub(1).map(|i| all[i]),
            all.get(after).copied(),
        );
        Some(match (before, next) {
            (Some((a, from)), Some((b, to))) => {
                let share = (depth_mm - a) / (b - a);
                std::array::from_fn(|i| from[i] + (to[i] - from[i]) * share)
            }
            (Some((_, changes)), None) | (None, Some((_, changes))) => changes,
            (None, None) => return None,
        })
    }
}

/// The converged samples of the first press down of a run.
pub fn loading(samples: &[Sample], run: usize) -> Vec<&Sample> {
    let down = |s: &&Sample| s.run == run && s.is_first_loading() && s.outcome.is_converged();
    samples.iter().filter(down).collect()
}

/// Force of the press down at a depth, N; linear between samples.
fn force_at(loading: &[&Sample], depth_mm: f64) -> Option<f64> {
    let after = loading.partition_point(|s| s.depth_mm < depth_mm - SAME_DEPTH);
    let next = loading.get(after)?;
    let Some(before) = after.checked_sub(1).map(|i| loading[i]) else {
        return Some(next.force_n);
    };
    let share = (depth_mm - before.depth_mm) / (next.depth_mm - before.depth_mm);
    Some(before.force_n + (next.force_n - before.force_n) * share)
}
