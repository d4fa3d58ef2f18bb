//! What is found.

use serde::{Deserialize, Serialize};

use super::growth::Growth;
use super::ratios::Ratio;

/// What a step makes anew.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// The stiffness of the whole body, in every step.
    Full,
    /// That of a zone; the rest of the body is brought to equilibrium with an earlier one.
    Whole,
    /// That of a zone; the rest of the body answers linearly, and the background brings it up to date.
    Zone,
}

impl Mode {
    /// Its name in tables and pictures.
    pub fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Whole => "whole",
            Self::Zone => "zone",
        }
    }
}

/// One line of the table.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct BenchRow {
    /// What is pressed.
    pub case: String,
    /// Nodes of the body, those of its fixed base among them.
    pub nodes: usize,
    /// Nodes that the step makes anew the stiffness of.
    pub zone_nodes: usize,
    /// Nodes of a column.
    pub levels: usize,
    /// What a step makes anew.
    pub mode: Mode,
    /// Radius of the zone; none where it is the body.
    pub zone_radius_mm: Option<f64>,
    /// Length of edges under the tool.
    pub h_contact_mm: f64,
    /// Radius of the sphere that presses.
    pub tool_radius_mm: f64,
    /// The inverse of the median.
    pub steps_per_s: f64,
    /// What is asked of the row, if anything is.
    pub target_steps_per_s: Option<f64>,
    /// Median thread-CPU time of the steps in contact.
    pub step_ms_median: f64,
    /// 99th percentile of the same.
    pub step_ms_p99: f64,
    /// CPU time of the background's work over that of the steps.
    pub background_cpu_share: f64,
    /// Largest error of the force past 2 mm against the converged force on the same mesh.
    pub step_error: f64,
    /// Largest error of the converged forces past 2 mm against those on a refined mesh.
    pub mesh_error: Option<f64>,
    /// Largest error of the moving step's forces past 2 mm against those on a refined mesh.
    pub total_error: Option<f64>,
    /// How fast the tool went.
    pub tool_mm_per_s: f64,
    /// How far it went in a step.
    pub travel_mm: f64,
    /// Steps in contact, of all that were taken.
    pub n_steps: usize,
    /// Zones that were taken over.
    pub n_zone_switches: usize,
    /// Factors of the exterior that were taken over, those of new zones among them.
    pub n_factors: usize,
    /// Steps after which another number of vertices pressed.
    pub n_active_changes: usize,
    /// Most vertices that pressed at once.
    pub most_active: usize,
    /// Most candidates at once.
    pub most_candidates: usize,
    /// Newton iterations of a step, the mean.
    pub iterations: f64,
    /// Steps that went part of the way only.
    pub n_backed_off: usize,
    /// Steps that failed.
    pub n_failed: usize,
}

/// All that was measured. After an interruption it holds what was done until then.
#[derive(Debug, Default, Serialize)]
pub struct BenchReport {
    /// Whether all of it was done; not after an interruption.
    pub is_complete: bool,
    /// The table.
    pub rows: Vec<BenchRow>,
    /// How the cost grows with the body.
    pub growth: Vec<Growth>,
    /// Against other ways to solve.
    pub ratios: Vec<Ratio>,
    /// How the table is measured.
    pub method: &'static str,
}
