//! A row of the table of shipped scenes.

use serde::{Deserialize, Serialize};

use super::drive::Part;

/// A pose that was solved again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PoseRow {
    /// Name of the case.
    pub case: String,
    /// See [`ShippedRow::accuracy`].
    pub accuracy: f64,
    /// Number of the place.
    pub place: usize,
    /// Part of the way.
    pub part: Part,
    /// Depth of the device below the first touch at the place.
    pub depth_mm: f64,
    /// Force of the loop at 1 kHz.
    pub force_n: f64,
    /// Static force on finer meshes; `None` if no equilibrium was found.
    pub static_n: Option<f64>,
    /// Static force on the loop's mesh; `None` if the way matters, or if no equilibrium was found.
    pub on_mesh_n: Option<f64>,
    /// Difference between the first two, as vectors, as a share of the static force.
    pub total_error: Option<f64>,
    /// Difference between the last two, likewise.
    pub mesh_error: Option<f64>,
}

/// What one scene gives at all its places.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ShippedRow {
    /// Name of the case, `shipped-…`.
    pub case: String,
    /// Accuracy that the scene asks of its mesh, as a share of the force: 3 % if it asks for none.
    pub accuracy: f64,
    /// Nodes of the loop's mesh, the mean over the places.
    pub nodes: usize,
    /// Steps with a vertex near the tool in which something moved, per second of their CPU time, patch
    /// and installed results of the background included.
    pub steps_per_s_mean: f64,
    /// 99th percentile of that time.
    pub step_ms_p99: f64,
    /// 95th percentile of the error of the force at 1 kHz against static forces on finer meshes, as a
    /// share of the static force, over all poses.
    pub total_error_p95: Option<f64>,
    /// The largest such error.
    pub total_error_max: Option<f64>,
    /// The 95th percentile on the way down.
    pub total_error_p95_press: Option<f64>,
    /// The 95th percentile on the way across the skin.
    pub total_error_p95_stroke: Option<f64>,
    /// The 95th percentile on the way up.
    pub total_error_p95_lift: Option<f64>,
    /// 95th percentile of the part of the error that the loop's mesh has in it: static forces on
    /// that mesh. `None` if the way matters.
    pub mesh_error_p95: Option<f64>,
    /// 95th percentile of the difference between the force and that of the same way with steps that take
    /// no time, as a share of the latter, over ticks drawn evenly on the parts of each way.
    pub motion_error_p95: Option<f64>,
    /// The largest such difference.
    pub motion_error_max: Option<f64>,
    /// The 95th percentile on the way down.
    pub motion_error_p95_press: Option<f64>,
    /// The 95th percentile on the way across the skin.
    pub motion_error_p95_stroke: Option<f64>,
    /// The 95th percentile on the way up.
    pub motion_error_p95_lift: Option<f64>,
    /// Share of these ticks in which the law let the force go in part, or came back from that.
    pub let_go_share: f64,
    /// Number of poses.
    pub n_poses: usize,
    /// Number of poses without a static equilibrium.
    pub n_poses_failed: usize,
    /// Number of places.
    pub n_places: usize,
    /// Number of steps with contact.
    pub n_steps: usize,
    /// Number of those that were behind the tool.
    pub n_behind: usize,
    /// Number of those that did not converge.
    pub n_unfinished: usize,
    /// Number of steps that failed.
    pub n_failed: usize,
    /// CPU time of the background, as a share of the time of the motion.
    pub background_cpu_share: f64,
    /// CPU time of the steps, as a share of the time of the motion.
    pub steps_cpu_share: f64,
    /// Speed of the slowest hand.
    pub hand_mm_per_s_min: f64,
    /// Speed of the fastest hand.
    pub hand_mm_per_s_max: f64,
    /// Least number of nodes of a reference mesh; `None` if no pose was solved again.
    pub reference_nodes: Option<usize>,
    /// Change of the static force at one pose on a mesh with 0.7 times the sizes of the reference, as
    /// a share of it.
    pub reference_change: Option<f64>,
}
