//! The figures of all samples of a press together.

use serde::Serialize;

use super::{Record, Sample};
use crate::press::Phase;

/// Result of the run at one speed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunResult {
    /// Speed of the tool, mm/s.
    pub speed_mm_s: f64,
    /// Largest force on the tool, N.
    pub max_force_n: f64,
    /// Depth at the largest force, mm.
    pub at_depth_mm: f64,
    /// Largest force over its depth, N/mm; `None` at depth 0.
    pub secant_stiffness_n_per_mm: Option<f64>,
    /// Half the width of its error bar, N/mm; `None` without error bars.
    pub secant_stiffness_error_bar_n_per_mm: Option<f64>,
    /// Share of the loading work that is not returned, for each finished cycle.
    pub hysteresis: Vec<f64>,
    /// Share of the force that is lost during the first hold; `None` if no tissue relaxes, or
    /// without a hold.
    pub relaxation: Option<f64>,
    /// Force on the tool back at the start, N; `None` if the run did not get there.
    pub force_after_retract_n: Option<f64>,
}

/// A layer along the pressed column, at the deepest sample of the first run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LayerResult {
    /// Name of its tissue.
    pub name: String,
    /// Thickness before the press, mm.
    pub thickness_at_rest_mm: f64,
    /// Thickness at the deepest sample, mm.
    pub thickness_pressed_mm: f64,
    /// Force along the press that the layer passes on to the layer below; for the deepest layer, to
    /// the bone. N
    pub force_below_n: f64,
}

/// The largest errors of the converged samples; [`Sample`] explains each.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LargestErrors {
    /// Deepest penetration of a vertex of the skin into the tool, µm.
    pub penetration_um: f64,
    /// Largest forces by which pressure and friction differ from the law of contact, relative to the
    /// forces that hold the body.
    pub contact_mismatch: f64,
    /// Largest residual. It excludes the body at rest before the press, which may have no forces to
    /// compare with.
    pub residual: f64,
    /// Smallest ratio of a prism's volume to its volume at rest.
    pub volume_ratio_min: f64,
    /// Largest ratio of a prism's volume to its volume at rest.
    pub volume_ratio_max: f64,
}

impl Record<'_> {
    /// The result of each run with a converged sample.
    pub fn runs(&self) -> Vec<RunResult> {
        let (good, is_viscous) = (self.converged(), self.indentation.is_viscous);
        (0..self.indentation.speeds.len())
            .filter_map(|index| {
                let samples: Vec<&Sample> =
                    good.iter().copied().filter(|s| s.run == index).collect();
                run_result(&samples, is_viscous)
            })
            .collect()
    }

    /// The layers from the skin down; empty without samples.
    pub fn layers(&self) -> Vec<LayerResult> {
        let (indentation, deepest) = (self.indentation, &self.deepest);
        let (Some(rest), Some(pressed)) = (self.samples.first(), self.samples.get(deepest.sample))
        else {
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

    /// The largest errors of the converged samples.
    pub fn largest_errors(&self) -> LargestErrors {
        let good = self.converged();
        let largest = |of: fn(&Sample) -> f64| good.iter().map(|s| of(s)).fold(0.0, f64::max);
        LargestErrors {
            penetration_um: largest(|s| s.penetration_um),
            contact_mismatch: largest(|s| s.contact_mismatch),
            residual: largest(|s| if is_unloaded(s) { 0.0 } else { s.residual }),
            volume_ratio_min: (good.iter().map(|s| s.volume_ratio_min))
                .fold(f64::INFINITY, f64::min),
            volume_ratio_max: largest(|s| s.volume_ratio_max),
        }
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
        secant_stiffness_error_bar_n_per_mm: (peak.error_bar_n)
            .filter(|_| peak.depth_mm > 0.0)
            .map(|bar| bar / peak.depth_mm),
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

/// Whether nothing has pressed yet. Then there may be no force to which the residual could be
/// relative.
fn is_unloaded(sample: &Sample) -> bool {
    sample.phase == Phase::Load && sample.cycle == 0 && sample.depth_mm == 0.0
}
