//! The result of a press, for press.json.

use palpa_scene::MaterialStatus;
use serde::Serialize;

use super::super::words::status_line;
use palpa::press::tissue::{Failure, LargestErrors, LayerResult, Record, RunResult, SampleOutcome};

/// Result of a press.
#[derive(Debug, Serialize)]
pub(super) struct PressResult {
    /// `converged`, or how the first step that failed ended.
    pub(super) outcome: SampleOutcome,
    /// Whether the whole script was run; false after Ctrl-C or a failed step.
    pub(super) is_complete: bool,
    /// Largest force of the first run; also in `runs`.
    pub(super) max_force_n: f64,
    pub(super) at_depth_mm: f64,
    pub(super) secant_stiffness_n_per_mm: Option<f64>,
    pub(super) secant_stiffness_error_bar_n_per_mm: Option<f64>,
    pub(super) force_after_retract_n: Option<f64>,
    /// Result of the run at each speed.
    pub(super) runs: Vec<RunResult>,
    /// The layers along the pressed column, at the deepest sample of the first run.
    pub(super) layers: Vec<LayerResult>,
    /// The layer whose thickness changes most at that sample.
    pub(super) gives_most: Option<String>,
    /// Number of prisms with corners turned inside out at that sample.
    pub(super) n_turned_prisms: usize,
    /// Largest errors over all converged samples.
    pub(super) worst: LargestErrors,
    pub(super) failures: Vec<Failure>,
    pub(super) material_status: String,
}

pub(super) fn result_of(
    record: &Record<'_>,
    materials: &[MaterialStatus],
    is_interrupted: bool,
) -> PressResult {
    let outcome = record.outcome();
    let runs = record.runs();
    let layers = record.layers();
    let change = |l: &LayerResult| (l.thickness_at_rest_mm - l.thickness_pressed_mm).abs();
    let most = layers.iter().max_by(|a, b| change(a).total_cmp(&change(b)));
    let first = runs.first();
    PressResult {
        outcome,
        is_complete: !is_interrupted && outcome.is_converged(),
        max_force_n: first.map_or(0.0, |run| run.max_force_n),
        at_depth_mm: first.map_or(0.0, |run| run.at_depth_mm),
        secant_stiffness_n_per_mm: first.and_then(|run| run.secant_stiffness_n_per_mm),
        secant_stiffness_error_bar_n_per_mm: first
            .and_then(|run| run.secant_stiffness_error_bar_n_per_mm),
        force_after_retract_n: first.and_then(|run| run.force_after_retract_n),
        gives_most: most.filter(|l| change(l) > 0.0).map(|l| l.name.clone()),
        n_turned_prisms: (record.deepest.turned.as_ref()).map_or(0, |turned| turned.n),
        worst: record.largest_errors(),
        runs,
        layers,
        failures: record.failures.clone(),
        material_status: status_line(materials),
    }
}
