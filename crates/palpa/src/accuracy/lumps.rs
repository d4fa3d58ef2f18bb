//! The change of the force by the lumps, with an error bar of its own.

use std::sync::Arc;

use serde::Serialize;

use super::descent::Descent;
use super::probe::TOLERANCE;
use super::{ErrorBars, N_SOURCES, Probed, SAFETY, all_known, wide};
use crate::press::tissue::Indentation;

/// The change of the force at the deepest by the lumps: the force of the press minus that of the same
/// mesh with the tissues of the layers in their place. Elastic, as the probes are.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LumpChange {
    /// Depth of the tool, mm.
    pub depth_mm: f64,
    /// Force without the lumps, N.
    pub without_n: f64,
    /// Change of the force by the lumps, N.
    pub change_n: f64,
    /// Half the width of the change's error bar, N; `None` if a probe failed.
    pub error_bar_n: Option<f64>,
    /// How each probe alters the change, N, in the order of [`Source::ALL`](super::Source::ALL); `None`
    /// if it found no equilibrium.
    pub contributions_n: [Option<f64>; N_SOURCES],
}

impl LumpChange {
    /// The change between two presses that were probed on the same mesh at the same depth. Most of the
    /// error is in both, and cancels probe by probe.
    fn new(with: &Probed, without: &Probed) -> Self {
        let part = |probed: &Probed, i: usize| Some(probed.changes[i]? * probed.force_n);
        let contributions_n = std::array::from_fn(|i| Some(part(with, i)? - part(without, i)?));
        // Nor is the change known better than the probes are solved.
        let least = SAFETY * TOLERANCE * with.force_n.abs();
        Self {
            depth_mm: with.depth_mm,
            without_n: without.force_n,
            change_n: with.force_n - without.force_n,
            error_bar_n: all_known(contributions_n).map(|all| wide(all, with.is_bonded) + least),
            contributions_n,
        }
    }
}

/// Presses the same mesh without its lumps, and probes it; `with` and `bars` are the press with the
/// lumps. `None` if no equilibrium was found, or if `goes_on` returned false.
///
/// # Errors
/// When the body cannot be pressed without its lumps.
pub fn change_by_lumps(
    press: &Indentation,
    with: &Descent,
    bars: &ErrorBars,
    goes_on: impl Fn() -> bool,
) -> anyhow::Result<Option<LumpChange>> {
    let plain = Indentation::build(Arc::new(press.prepared.without_lumps()))?;
    let found =
        Descent::near(&plain, with, &goes_on).or_else(|| Descent::from_rest(&plain, &goes_on));
    let probed = found.and_then(|found| found.probe(&plain, |_, _| goes_on()));
    let change = |without: ErrorBars| LumpChange::new(bars.deepest(), without.deepest());
    Ok(probed.map(change))
}
