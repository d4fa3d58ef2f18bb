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
mod lumps;
mod probe;

use std::fmt;

use serde::Serialize;

pub(crate) use self::choice::ORDER;
pub use self::choice::{End, Goal, MeshChoice, Round, choose_mesh};
pub use self::descent::{Descent, Stops};
pub use self::lumps::{LumpChange, change_by_lumps};
use crate::press::Phase;
use crate::press::tissue::Sample;

/// Factor between a contribution and its share of the bar. Halving a size shows two thirds of an error
/// of order 1.5 and three quarters of one of second order.
pub const SAFETY: f64 = 2.0;
/// The same for the contribution near a bonded disc: at its sharp edge the error is of first order, so
/// that halving shows half of it; a quarter is for safety.
pub const EDGE_SAFETY: f64 = 2.5;
/// Factor between the sum of the signed contributions and the expected error. Halving a size shows
/// three quarters of an error of second order.
pub const EXTRAPOLATION: f64 = 4.0 / 3.0;
/// The same for load steps: their contribution is half of the change from steps twice as long, and in
/// relaxing tissue the error, of second order, is a third of that change.
const STEP_EXTRAPOLATION: f64 = 2.0 / 3.0;
/// Contribution of the edge of a round tool's contact, as a share of the force, times the number of
/// vertices that touch. The force rises in jumps as ring after ring of vertices touches, which finer
/// meshes of the same few vertices do not show. Against spheres on layers whose forces are known
/// exactly (5 to 40 vertices), errors are 0.6 in the median, and 2.4 where a ring has just touched.
const CONTACT: f64 = 0.7;
/// Name of that contribution, in English.
pub const FEW_VERTICES: &str = "few vertices in contact";
/// Factor on a change that stands in for that at twice the depth: changes grow to at most 1.6 times
/// where both are known (a bonded disc pressed by more than its radius).
const STAND_IN: f64 = 2.0;
/// There is no extrapolation if half the bar's width, or the contribution of the edge of the contact,
/// is more than this share of the force: sizes are then too large for an order of convergence.
const MOST_EXTRAPOLATED: f64 = 0.25;
const MOST_CONTACT: f64 = 0.02;
/// Depths that are probed, as shares of the deepest.
const DEPTHS: [f64; 3] = [1.0, 0.5, 0.25];

/// On the way back, the force is extrapolated only if it differs from that of the press down by no more
/// than this share.
const SAME_FORCE: f64 = 0.01;
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
    /// Whether the change is twice that at the next smaller depth, because the probe found no
    /// equilibrium here.
    pub is_stand_in: [bool; N_SOURCES],
    /// Number of skin vertices in contact with a round tool; `None` for other tools.
    pub n_touching: Option<usize>,
    /// Whether the tool is bonded to the skin, so that [`EDGE_SAFETY`] applies near it.
    pub is_bonded: bool,
}

impl Probed {
    /// Half the width of the bar relative to the force, without load steps; `None` if a probe failed.
    pub fn half_width(&self) -> Option<f64> {
        self.relative().map(|relative| relative.half_width(0.0))
    }

    /// Contribution of the edge of the contact, as a share of the force; `None` if a probe failed.
    pub fn contact(&self) -> Option<f64> {
        self.relative().map(|relative| relative.contact)
    }

    /// The force extrapolated to an infinitely fine mesh, N; `None` if a probe failed, or if there is
    /// no order of convergence to be seen.
    pub fn extrapolated_n(&self) -> Option<f64> {
        let relative = self.relative()?;
        let can = relative.has_order(0.0);
        can.then(|| self.force_n * (1.0 + EXTRAPOLATION * relative.sum()))
    }

    fn relative(&self) -> Option<Relative> {
        let is_stand_in = self.is_stand_in.contains(&true);
        let changes = all_known(self.changes)?;
        Some(self.with_changes(changes, is_stand_in, self.n_touching))
    }

    /// Contributions under the same tool, with other changes.
    fn with_changes(
        &self,
        changes: [f64; N_SOURCES],
        is_stand_in: bool,
        n_touching: Option<usize>,
    ) -> Relative {
        // The probe near the tool shows a part of it.
        let least = n_touching.map_or(0.0, |n| CONTACT / n.max(1) as f64);
        Relative {
            changes,
            contact: (least - changes[Source::Near as usize].abs()).max(0.0),
            is_stand_in,
            is_bonded: self.is_bonded,
        }
    }
}

/// The contributions, if there are all of them.
fn all_known(contributions: [Option<f64>; N_SOURCES]) -> Option<[f64; N_SOURCES]> {
    let [near, skin_far, levels_deep] = contributions;
    Some([near?, skin_far?, levels_deep?])
}

/// Contributions as shares of the force.
#[derive(Debug, Clone, Copy)]
struct Relative {
    /// In the order of [`Source::ALL`].
    changes: [f64; N_SOURCES],
    /// Of the edge of the contact.
    contact: f64,
    is_stand_in: bool,
    is_bonded: bool,
}

impl Relative {
    fn half_width(&self, load_step: f64) -> f64 {
        wide(self.changes, self.is_bonded) + SAFETY * (self.contact + load_step.abs())
    }

    fn sum(&self) -> f64 {
        self.changes.iter().sum()
    }

    /// Whether the force can be extrapolated.
    fn has_order(&self, load_step: f64) -> bool {
        let is_seen = self.contact <= MOST_CONTACT && !self.is_stand_in;
        is_seen && self.half_width(load_step) <= MOST_EXTRAPOLATED
    }
}

/// Half the width of the bar of contributions in the order of [`Source::ALL`].
pub fn wide(contributions: [f64; N_SOURCES], is_bonded: bool) -> f64 {
    let factor = |source: Source| {
        if is_bonded && source == Source::Near {
            EDGE_SAFETY
        } else {
            SAFETY
        }
    };
    let parts = Source::ALL.into_iter().zip(contributions);
    parts.map(|(source, c)| factor(source) * c.abs()).sum()
}

/// The error bar of a force.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ErrorBar {
    /// Half the width of the bar, N.
    pub half_width_n: f64,
    /// The force extrapolated to an infinitely fine mesh, N; `None` if no order of convergence can be
    /// seen: few vertices touch a round tool, a probe's change stands in for another, or the bar is
    /// wider than a quarter of the force.
    pub extrapolated_n: Option<f64>,
    /// Signed contributions, N, in the order of [`Source::ALL`].
    pub contributions_n: [f64; N_SOURCES],
    /// Contribution of the edge of the contact, N.
    pub contact_n: f64,
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
    /// Whether a probe was left out because it would be too large.
    pub is_too_large: bool,
    /// For each source, how far each node moves by its probe at the deepest, m; 0 outside the part
    /// that is probed. `[n_nodes of the press]`
    #[serde(skip)]
    pub moves: [Vec<f64>; N_SOURCES],
}

impl ErrorBars {
    /// Half the width of the bar at a depth that was probed, relative to the force; `None` if a
    /// probe failed.
    pub fn half_width(&self, probed: &Probed) -> Option<f64> {
        let steps = SAFETY * self.load_step.map_or(0.0, f64::abs);
        probed.half_width().map(|half| half + steps)
    }

    /// How far each node of the press may be from its place on an infinitely fine mesh at the deepest,
    /// m: the bar of its displacement, where errors arise.
    pub fn displacement_bars(&self) -> Vec<f64> {
        let sum = |i: usize| SAFETY * self.moves.iter().map(|of| of[i]).sum::<f64>();
        (0..self.moves[0].len()).map(sum).collect()
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
            sample.extrapolated_n = bar.and_then(|bar| bar.extrapolated_n);
            let part = |i: usize| bar.map(|bar| bar.contributions_n[i]);
            sample.error_near_n = part(0);
            sample.error_skin_far_n = part(1);
            sample.error_levels_deep_n = part(2);
            sample.error_contact_n = bar.map(|bar| bar.contact_n);
            sample.error_load_step_n = bar.map(|bar| bar.load_step_n);
        }
    }

    /// The bar of a sample. `loading` are the samples of its run's first press down. Where no depth was
    /// probed, relative contributions are interpolated; above the least depth they are those at it.
    pub fn of(&self, sample: &Sample, loading: &[&Sample]) -> Option<ErrorBar> {
        let (force, n_touching) = pressed_at(loading, sample.depth_mm)?;
        let n_touching = self.deepest().n_touching.and(Some(n_touching));
        let relative = self.relative_at(sample.depth_mm, n_touching)?;
        let load_step = self.load_step.unwrap_or(0.0);
        let correction = EXTRAPOLATION * relative.sum() + STEP_EXTRAPOLATION * load_step;
        let is_as_before = (sample.force_n - force).abs() <= SAME_FORCE * force.abs();
        let has_order =
            relative.has_order(load_step) && (sample.phase != Phase::Retract || is_as_before);
        let of = Self::size(sample, force);
        Some(ErrorBar {
            half_width_n: relative.half_width(load_step) * of.abs(),
            extrapolated_n: has_order.then_some(sample.force_n + correction * of),
            contributions_n: relative.changes.map(|change| change * of),
            contact_n: relative.contact * of,
            load_step_n: load_step * of,
        })
    }

    /// The force of which relative contributions are shares: while a tool rests, relaxing tissue keeps
    /// its relative error; on the way back, no less than the force of the press down at that depth.
    fn size(sample: &Sample, pressed_down: f64) -> f64 {
        let is_larger = sample.force_n.abs() > pressed_down.abs();
        match sample.phase {
            Phase::Load => pressed_down,
            Phase::Retract if !is_larger => pressed_down,
            Phase::Hold | Phase::Retract => sample.force_n,
        }
    }

    /// Contributions at a depth. `n_touching` as in [`Probed`].
    fn relative_at(&self, depth_mm: f64, n_touching: Option<usize>) -> Option<Relative> {
        // Ascending by depth.
        let all: Vec<(f64, Relative)> = (self.probed.iter().rev())
            .filter_map(|probed| Some((probed.depth_mm, probed.relative()?)))
            .collect();
        let after = all.partition_point(|(depth, _)| *depth < depth_mm);
        let before = after.checked_sub(1).map(|i| all[i]);
        let (changes, is_stand_in) = match (before, all.get(after).copied()) {
            (Some((a, from)), Some((b, to))) => {
                let share = (depth_mm - a) / (b - a);
                let between =
                    |i: usize| from.changes[i] + (to.changes[i] - from.changes[i]) * share;
                (std::array::from_fn(between), to.is_stand_in)
            }
            (Some((_, at)), None) | (None, Some((_, at))) => (at.changes, at.is_stand_in),
            (None, None) => return None,
        };
        let at = self.deepest();
        Some(at.with_changes(changes, is_stand_in, n_touching))
    }
}

/// The converged samples of the first press down of a run.
pub fn loading(samples: &[Sample], run: usize) -> Vec<&Sample> {
    let down = |s: &&Sample| s.run == run && s.is_first_loading() && s.outcome.is_converged();
    samples.iter().filter(down).collect()
}

/// Force of the press down at a depth, N, linear between samples, and the least number of vertices in
/// contact there.
fn pressed_at(loading: &[&Sample], depth_mm: f64) -> Option<(f64, usize)> {
    let after = loading.partition_point(|s| s.depth_mm < depth_mm - SAME_DEPTH);
    let next = loading.get(after)?;
    let Some(before) = after.checked_sub(1).map(|i| loading[i]) else {
        return Some((next.force_n, next.n_touching));
    };
    let share = (depth_mm - before.depth_mm) / (next.depth_mm - before.depth_mm);
    let force = before.force_n + (next.force_n - before.force_n) * share;
    let n_touching = if share < 1.0 - SAME_DEPTH {
        before.n_touching.min(next.n_touching)
    } else {
        next.n_touching
    };
    Some((force, n_touching))
}
