//! Rows of the benchmark table and the report.

use serde::ser::SerializeStruct as _;
use serde::{Deserialize, Serialize, Serializer};

use super::growth::Growth;
use super::ratios::Ratio;
use super::shipped::{PoseRow, ShippedRow};

/// Part of the stiffness that a step recomputes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// The stiffness of the whole body.
    Full,
    /// The stiffness of a zone; the rest of the body is brought to equilibrium with an earlier
    /// stiffness.
    Whole,
    /// The stiffness of a zone; the rest of the body responds linearly, and the background updates
    /// it.
    Zone,
}

impl Mode {
    /// Name in tables and plots.
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
    /// Name of the case.
    pub case: String,
    /// Nodes of the body, including those of its fixed base.
    pub nodes: usize,
    /// Nodes whose stiffness a step recomputes.
    pub zone_nodes: usize,
    /// Nodes per column.
    pub levels: usize,
    /// Part of the stiffness that a step recomputes.
    pub mode: Mode,
    /// Radius of the zone; `None` if the zone is the whole body.
    pub zone_radius_mm: Option<f64>,
    /// Edge length under the tool.
    pub h_contact_mm: f64,
    /// Radius of the sphere.
    pub tool_radius_mm: f64,
    /// Steps in contact per second of their whole thread-CPU time, patches and installed results of
    /// the background included.
    pub steps_per_s: f64,
    /// Required steps per second, if there is a target.
    pub target_steps_per_s: Option<f64>,
    /// Mean of that time.
    pub step_ms_mean: f64,
    /// Median of that time.
    pub step_ms_median: f64,
    /// 99th percentile of that time.
    pub step_ms_p99: f64,
    /// CPU time of the background's work, relative to that of the steps.
    pub background_cpu_share: f64,
    /// Largest error of the force past 2 mm against the converged force on the same mesh.
    pub step_error: f64,
    /// Largest error of the converged forces past 2 mm against those on a refined mesh.
    pub mesh_error: Option<f64>,
    /// Largest error of the moving step's forces past 2 mm against those on a refined mesh, down,
    /// across and up.
    pub total_error: Option<f64>,
    /// The largest such error of four places of the sphere on a graded mesh: on a vertex, on the
    /// middle of an edge, near the middle of a triangle and half-way there. `None` for other meshes.
    pub worst_of_four_places: Option<f64>,
    /// Speed of the tool.
    pub tool_mm_per_s: f64,
    /// Travel of the tool in a step.
    pub travel_mm: f64,
    /// Number of steps in contact.
    pub n_steps: usize,
    /// Number of zones that were taken over.
    pub n_zone_switches: usize,
    /// Number of factors of the exterior that were taken over, new zones included.
    pub n_factors: usize,
    /// Number of steps after which the number of pressing vertices changed.
    pub n_active_changes: usize,
    /// Largest number of vertices that pressed at once.
    pub most_active: usize,
    /// Largest number of candidates at once.
    pub most_candidates: usize,
    /// Mean number of Newton iterations per step.
    pub iterations: f64,
    /// Number of steps that went only part of the way.
    pub n_backed_off: usize,
    /// Number of steps that failed.
    pub n_failed: usize,
}

/// The report of all measurements. After an interruption it holds those completed so far.
#[derive(Debug, Default)]
pub struct BenchReport {
    /// Whether all cases were measured; false after an interruption.
    pub is_complete: bool,
    /// Shipped scenes.
    pub shipped: Vec<ShippedRow>,
    /// Their poses that were solved again.
    pub poses: Vec<PoseRow>,
    /// Uniform blocks and graded bodies.
    pub rows: Vec<BenchRow>,
    /// Growth of the cost with the size of the body.
    pub growth: Vec<Growth>,
    /// Comparisons with other methods.
    pub ratios: Vec<Ratio>,
    /// Description of how the table is measured.
    pub method: &'static str,
}

/// The rows of both tables are one list, the shipped scenes first.
impl Serialize for BenchReport {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        #[serde(untagged)]
        enum Row<'a> {
            Shipped(&'a ShippedRow),
            Uniform(&'a BenchRow),
        }
        let shipped = self.shipped.iter().map(Row::Shipped);
        let rows: Vec<Row<'_>> = shipped.chain(self.rows.iter().map(Row::Uniform)).collect();
        let mut report = serializer.serialize_struct("BenchReport", 6)?;
        report.serialize_field("is_complete", &self.is_complete)?;
        report.serialize_field("rows", &rows)?;
        report.serialize_field("poses", &self.poses)?;
        report.serialize_field("growth", &self.growth)?;
        report.serialize_field("ratios", &self.ratios)?;
        report.serialize_field("method", self.method)?;
        report.end()
    }
}
