//! One row of the result of a press, and the result of its step.

use palpa_fem::Outcome;
use serde::Serialize;

use crate::press::Phase;

/// One row of the result. Forces act on the tool.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sample {
    /// Number of the run within a sweep, from 0.
    pub run: usize,
    /// Speed of the run, mm/s.
    pub speed_mm_s: f64,
    /// Phase of the indentation.
    pub phase: Phase,
    /// Number of cycles completed before.
    pub cycle: u32,
    /// Time since the start of the run, s.
    pub time_s: f64,
    /// Depth of the tool along its direction, from its first touch of the skin at rest, mm.
    pub depth_mm: f64,
    /// Force on the tool against its direction, N; positive when the body pushes back.
    pub force_n: f64,
    /// x component of the force on the tool, N.
    pub force_x_n: f64,
    /// y component of the force on the tool, N.
    pub force_y_n: f64,
    /// z component of the force on the tool, N.
    pub force_z_n: f64,
    /// Area at rest of the skin that touches the tool or is bonded to it, mm².
    pub contact_area_mm2: f64,
    /// Largest mean pressure over the skin area that a vertex stands for, kPa. `None` for a
    /// single node. At the edge of a bonded disc the pressure has no limit, so there it grows with
    /// refinement.
    pub max_pressure_kpa: Option<f64>,
    /// Number of skin vertices that touch the tool or are bonded to it.
    pub n_touching: usize,
    /// Deepest penetration of a vertex of the skin into the tool, µm. The law of contact holds on
    /// average over the skin's triangles, so it falls with their size.
    pub penetration_um: f64,
    /// Forces by which pressure and friction differ from the law of contact, relative to the forces
    /// that hold the body.
    pub contact_mismatch: f64,
    /// Residual: the unbalanced forces relative to the forces that hold the body.
    pub residual: f64,
    /// Newton iterations.
    pub iterations: usize,
    /// Number of sub-steps into which the step was divided.
    pub substeps: usize,
    /// Result of the step. Unless it converged, the forces are those of the previous sample, and
    /// the run at this speed ends.
    pub outcome: SampleOutcome,
    /// Strain energy, mJ; for viscous tissue, that of the law at its present state of relaxation.
    pub energy_mj: f64,
    /// Work done by the tool so far, by the trapezoidal rule, mJ.
    pub work_mj: f64,
    /// Smallest ratio of a prism's volume to its volume at rest.
    pub volume_ratio_min: f64,
    /// Largest ratio of a prism's volume to its volume at rest.
    pub volume_ratio_max: f64,
    /// Half the width of the force's error bar, N; `None` if it was not estimated. See
    /// [`crate::accuracy`].
    pub error_bar_n: Option<f64>,
    /// The force extrapolated to an infinitely fine mesh, N; `None` without error bar, or if no order
    /// of convergence can be seen.
    pub extrapolated_n: Option<f64>,
    /// Change of the force by finer prisms near the tool, N.
    pub error_near_n: Option<f64>,
    /// Change of the force by finer triangles around them, N.
    pub error_skin_far_n: Option<f64>,
    /// Change of the force by finer deep intervals, N.
    pub error_levels_deep_n: Option<f64>,
    /// What finer meshes of the same few vertices in contact with a round tool do not show, N.
    pub error_contact_n: Option<f64>,
    /// Change of the force by shorter load steps, N; 0 if they do not matter.
    pub error_load_step_n: Option<f64>,
    /// Thickness of each layer along the pressed column, mm. `[n_layers]`
    pub layer_thickness_mm: Vec<f64>,
}

impl Sample {
    /// Whether the sample is on the first way down of its run.
    pub fn is_first_loading(&self) -> bool {
        self.cycle == 0 && self.phase == Phase::Load
    }
}

/// Result of the step to a sample; [`Failure`] says where a step failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SampleOutcome {
    /// In equilibrium within the tolerance.
    Converged,
    /// The iteration limit was reached.
    IterationLimit,
    /// A prism would be turned inside out.
    Inverted,
    /// The stiffness could not be made positive definite.
    Singular,
}

impl SampleOutcome {
    /// Whether the step converged.
    pub fn is_converged(self) -> bool {
        self == Self::Converged
    }
}

impl From<&Outcome> for SampleOutcome {
    fn from(outcome: &Outcome) -> Self {
        match outcome {
            Outcome::Converged => Self::Converged,
            Outcome::IterationLimit { .. } => Self::IterationLimit,
            Outcome::Inverted { .. } => Self::Inverted,
            Outcome::Singular => Self::Singular,
        }
    }
}

/// A failed step.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Failure {
    /// Speed of the run, mm/s.
    pub speed_mm_s: f64,
    /// Depth that the step should have reached, mm.
    pub depth_mm: f64,
    /// The reason, and the place in the body.
    #[serde(flatten)]
    pub outcome: Outcome,
}
