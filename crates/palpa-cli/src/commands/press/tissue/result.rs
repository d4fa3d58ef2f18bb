//! The result of all samples together.

use palpa_scene::MaterialStatus;
use serde::Serialize;

use super::super::words::status_line;
use super::record::Recorded;
use palpa::Note;
use palpa::press::Phase;
use palpa::press::tissue::{Failure, Indentation, Sample, SampleOutcome};

/// Smallest contact radius, in edges; a smaller contact causes a note.
const FEWEST_EDGES: f64 = 3.0;

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
    pub(super) worst: Worst,
    pub(super) failures: Vec<Failure>,
    pub(super) material_status: String,
    #[serde(skip)]
    pub(super) notes: Vec<Note>,
}

/// Result at one speed.
#[derive(Debug, Serialize)]
pub(super) struct RunResult {
    pub(super) speed_mm_s: f64,
    pub(super) max_force_n: f64,
    pub(super) at_depth_mm: f64,
    pub(super) secant_stiffness_n_per_mm: Option<f64>,
    /// Share of the loading work that is not returned, for each finished cycle.
    pub(super) hysteresis: Vec<f64>,
    /// Share of the force that is lost during the first hold.
    pub(super) relaxation: Option<f64>,
    pub(super) force_after_retract_n: Option<f64>,
}

/// A layer along the pressed column.
#[derive(Debug, Serialize)]
pub(super) struct LayerResult {
    pub(super) name: String,
    pub(super) thickness_at_rest_mm: f64,
    pub(super) thickness_pressed_mm: f64,
    /// Force along the press that the layer passes on to the layer below; for the deepest layer, to
    /// the bone.
    pub(super) force_below_n: f64,
}

/// The largest errors of the converged samples.
#[derive(Debug, Serialize)]
pub(super) struct Worst {
    pub(super) gap_um: f64,
    pub(super) penetration_um: f64,
    pub(super) tension_n: f64,
    pub(super) cone_n: f64,
    pub(super) slip: f64,
    pub(super) friction_smoothing_um: f64,
    /// Largest residual. It excludes the body at rest before the press, which may have no forces to
    /// compare with.
    pub(super) residual: f64,
    pub(super) volume_ratio_min: f64,
    pub(super) volume_ratio_max: f64,
}

pub(super) fn result_of(
    indentation: &Indentation,
    recorded: &Recorded,
    materials: &[MaterialStatus],
    is_interrupted: bool,
) -> PressResult {
    let good: Vec<&Sample> = (recorded.samples.iter())
        .filter(|s| s.outcome.is_converged())
        .collect();
    let runs: Vec<RunResult> = (0..indentation.speeds.len())
        .filter_map(|index| {
            let samples: Vec<&Sample> = good.iter().copied().filter(|s| s.run == index).collect();
            run_result(&samples, indentation.is_viscous)
        })
        .collect();
    let layers = layers(indentation, recorded);
    let change = |l: &LayerResult| (l.thickness_at_rest_mm - l.thickness_pressed_mm).abs();
    let most = layers.iter().max_by(|a, b| change(a).total_cmp(&change(b)));
    let first = runs.first();
    let failed = (recorded.samples.iter()).find(|s| !s.outcome.is_converged());
    PressResult {
        outcome: failed.map_or(SampleOutcome::Converged, |s| s.outcome),
        is_complete: !is_interrupted && failed.is_none(),
        max_force_n: first.map_or(0.0, |run| run.max_force_n),
        at_depth_mm: first.map_or(0.0, |run| run.at_depth_mm),
        secant_stiffness_n_per_mm: first.and_then(|run| run.secant_stiffness_n_per_mm),
        force_after_retract_n: first.and_then(|run| run.force_after_retract_n),
        gives_most: most.filter(|l| change(l) > 0.0).map(|l| l.name.clone()),
        n_turned_prisms: recorded
            .deepest
            .turned
            .as_ref()
            .map_or(0, |turned| turned.n),
        worst: worst(&good),
        notes: notes(indentation, recorded, &good),
        runs,
        layers,
        failures: recorded.failures.clone(),
        material_status: status_line(materials),
    }
}

fn run_result(samples: &[&Sample], is_viscous: bool) -> Option<RunResult> {
    let peak = (samples.iter()).max_by(|a, b| a.force_n.total_cmp(&b.force_n))?;
    let n_cycles = samples.last()?.cycle + 1;
    let first: Vec<&&Sample> = samples.iter().filter(|s| s.cycle == 0).collect();
    let end = |phase: Phase| first.iter().rfind(|s| s.phase == phase);
    let relaxation = end(Phase::Load).zip(end(Phase::Hold));
    let last = samples.last()?;
    Some(RunResult {
        speed_mm_s: peak.speed_mm_s,
        max_force_n: peak.force_n,
        at_depth_mm: peak.depth_mm,
        secant_stiffness_n_per_mm: (peak.depth_mm > 0.0).then(|| peak.force_n / peak.depth_mm),
        hysteresis: (0..n_cycles)
            .filter_map(|cycle| loss(samples, cycle))
            .collect(),
        relaxation: (relaxation.filter(|_| is_viscous))
            .map(|(top, rested)| 1.0 - rested.force_n / top.force_n),
        force_after_retract_n: is_back(last).then_some(last.force_n),
    })
}

fn is_back(sample: &Sample) -> bool {
    sample.phase == Phase::Retract && sample.depth_mm == 0.0
}

/// Share of the loading work of a cycle that is not returned.
fn loss(samples: &[&Sample], cycle: u32) -> Option<f64> {
    let of_cycle = || samples.iter().filter(move |s| s.cycle == cycle);
    let back = of_cycle().find(|s| is_back(s))?;
    let deepest = of_cycle().rfind(|s| s.phase == Phase::Load)?;
    // A cycle begins where the last one ended.
    let begin = cycle.checked_sub(1).map_or(0.0, |before| {
        let mut ends = samples.iter().filter(|s| s.cycle == before && is_back(s));
        ends.next_back().map_or(0.0, |s| s.work_mj)
    });
    let (down, lost) = (deepest.work_mj - begin, back.work_mj - begin);
    (down > 0.0).then(|| lost / down)
}

fn layers(indentation: &Indentation, recorded: &Recorded) -> Vec<LayerResult> {
    let deepest = &recorded.deepest;
    let samples = &recorded.samples;
    let (Some(rest), Some(pressed)) = (samples.first(), samples.get(deepest.sample)) else {
        return Vec::new();
    };
    let direction = &indentation.place().direction;
    let thicknesses = rest
        .layer_thickness_mm
        .iter()
        .zip(&pressed.layer_thickness_mm);
    let names = &indentation.mesh().body.layer_names;
    (names.iter().zip(thicknesses).zip(&indentation.borders[1..]))
        .map(|((name, (at_rest, pressed)), &below)| LayerResult {
            name: name.clone(),
            thickness_at_rest_mm: *at_rest,
            thickness_pressed_mm: *pressed,
            force_below_n: (deepest.level_forces.get(below)).map_or(0.0, |f| -f.dot(direction)),
        })
        .collect()
}

/// Whether nothing has pressed yet. Then there may be no force to which the residual could be
/// relative.
fn is_unloaded(sample: &Sample) -> bool {
    sample.phase == Phase::Load && sample.cycle == 0 && sample.depth_mm == 0.0
}

fn worst(good: &[&Sample]) -> Worst {
    let largest = |of: fn(&Sample) -> f64| good.iter().map(|s| of(s)).fold(0.0, f64::max);
    Worst {
        gap_um: largest(|s| s.gap_um),
        penetration_um: largest(|s| s.penetration_um),
        tension_n: largest(|s| s.tension_n),
        cone_n: largest(|s| s.cone_n),
        slip: largest(|s| s.slip),
        friction_smoothing_um: largest(|s| s.friction_smoothing_um),
        residual: largest(|s| if is_unloaded(s) { 0.0 } else { s.residual }),
        volume_ratio_min: (good.iter().map(|s| s.volume_ratio_min)).fold(f64::INFINITY, f64::min),
        volume_ratio_max: largest(|s| s.volume_ratio_max),
    }
}

fn notes(indentation: &Indentation, recorded: &Recorded, good: &[&Sample]) -> Vec<Note> {
    let mut notes: Vec<Note> = (recorded.failures.iter())
        .map(|failure| Note::StepFailed {
            speed: failure.speed_mm_s * 1e-3,
            depth: failure.depth_mm * 1e-3,
            outcome: failure.outcome,
        })
        .collect();
    if let Some(turned) = &recorded.deepest.turned {
        notes.push(Note::TurnedPrisms {
            n: turned.n,
            depth: recorded.deepest.depth_mm * 1e-3,
            at: turned.at.into(),
        });
    }
    let smoothed = (good.iter())
        .filter(|s| s.friction_smoothing_um > 0.0)
        .count();
    if smoothed > 0 {
        notes.push(Note::FrictionSmoothed {
            n: smoothed,
            n_all: good.len(),
            slip: worst(good).friction_smoothing_um * 1e-6,
        });
    }
    let widest = (good.iter()).max_by(|a, b| a.contact_area_mm2.total_cmp(&b.contact_area_mm2));
    if let Some(widest) = widest.filter(|_| !indentation.is_bonded()) {
        let radius = (widest.contact_area_mm2 * 1e-6 / std::f64::consts::PI).sqrt();
        let edge = indentation.mesh().mesh_size;
        if radius < FEWEST_EDGES * edge {
            notes.push(Note::FewTouching {
                n_vertices: widest.n_touching,
                radius,
                edge,
            });
        }
    }
    notes
}
