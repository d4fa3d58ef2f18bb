//! One line of the result of a press, and how its step ended.

use palpa_fem::Outcome;
use serde::Serialize;

use crate::press::Phase;

/// One line of the result. Forces act on the tool.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sample {
    /// The run of the sweep, from 0.
    pub run: usize,
    /// Its speed. mm/s
    pub speed_mm_s: f64,
    /// Part of the indentation.
    pub phase: Phase,
    /// How often the tool has gone down before.
    pub cycle: u32,
    /// Time since the start of the run. s
    pub time_s: f64,
    /// Depth of the tool along its direction, from where it first touches the skin at rest. mm
    pub depth_mm: f64,
    /// Force against the tool's direction: what pushes back. N
    pub force_n: f64,
    /// Components of the force on the tool. N
    pub force_x_n: f64,
    /// See `force_x_n`.
    pub force_y_n: f64,
    /// See `force_x_n`.
    pub force_z_n: f64,
    /// Area of skin at rest that touches the tool or is bonded to it. mm²
    pub contact_area_mm2: f64,
    /// Largest force on a vertex over the area of skin that it stands for; at the edge of a bonded disc, where pressure has
    /// no limit, it grows with refinement. Empty for a single node. kPa
    pub max_pressure_kpa: Option<f64>,
    /// Skin vertices that touch the tool or are bonded to it.
    pub n_touching: usize,
    /// Largest gap at a vertex that touches. µm
    pub gap_um: f64,
    /// Deepest penetration of a vertex that should not touch. µm
    pub penetration_um: f64,
    /// Largest pull at a vertex that touches. N
    pub tension_n: f64,
    /// Largest friction beyond Coulomb's cone. N
    pub cone_n: f64,
    /// Largest share of a friction that does not oppose its slip.
    pub slip: f64,
    /// Slip over which friction had to be smoothed: vertices that would be held creep by about as much. 0 for Coulomb's
    /// exact law, which nearly every step obeys. µm
    pub friction_smoothing_um: f64,
    /// Forces out of balance as a share of those that hold the body.
    pub residual: f64,
    /// Newton iterations.
    pub iterations: usize,
    /// Parts into which the step was divided.
    pub substeps: usize,
    /// How the step ended. Unless it converged, the forces are those of the sample before, and this speed's run ends.
    pub outcome: SampleOutcome,
    /// Strain energy (of a viscous tissue that of its present law). mJ
    pub energy_mj: f64,
    /// Work that the tool has done so far, by the trapezoidal rule. mJ
    pub work_mj: f64,
    /// Smallest volume of a prism as a share of that at rest.
    pub volume_ratio_min: f64,
    /// Largest likewise.
    pub volume_ratio_max: f64,
    /// Thickness of each layer along the pressed column. mm `[n_layers]`
    pub layer_thickness_mm: Vec<f64>,
}

/// How the step to a sample ended; where it failed is in [`Failure`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SampleOutcome {
    /// In equilibrium.
    Converged,
    /// The iterations were used up.
    IterationLimit,
    /// Tissue would be turned inside out.
    Inverted,
    /// The stiffness could not be made positive definite.
    Singular,
}

impl SampleOutcome {
    /// Whether the sample can be trusted.
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

/// Where a step failed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Failure {
    /// Speed of its run. mm/s
    pub speed_mm_s: f64,
    /// Depth that was to be reached. mm
    pub depth_mm: f64,
    /// Why, and where.
    #[serde(flatten)]
    pub outcome: Outcome,
}
