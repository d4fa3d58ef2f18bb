//! Reports of an engine while it runs and at its end.

use crate::{
    event::{Event, Level},
    histogram::Quantiles,
    record::StepRecord,
    servo_loop::TickEntry,
    smoothness::ForceReport,
    threads::Granted,
};
use std::path::PathBuf;

/// Newest tick and step of a running engine.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Snapshot {
    /// The last tick; tick 0 before the first.
    pub tick: TickEntry,
    /// The tissue's last step; step 0 before the first.
    pub step: StepRecord,
}

/// Report of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// Duration, s.
    pub duration: f64,
    /// Ticks done.
    pub ticks: u64,
    /// Ticks skipped because of missed deadlines.
    pub skipped: u64,
    /// CPU time of a tick, s.
    pub tick_cpu: Quantiles,
    /// Lateness of a tick, s.
    pub lateness: Quantiles,
    /// Histogram of the CPU time of ticks: lower end, upper end (s), count.
    pub tick_cpu_histogram: Vec<(f64, f64, u64)>,
    /// Histogram of lateness: lower end, upper end (s), count.
    pub lateness_histogram: Vec<(f64, f64, u64)>,
    /// Smoothness and energy of the force of each device.
    pub forces: Vec<ForceReport>,
    /// Steps of the tissue.
    pub steps: u64,
    /// Steps per second.
    pub step_rate: f64,
    /// CPU time of a step, s.
    pub step_cpu: Quantiles,
    /// Wall time of a step, s.
    pub step_wall: Quantiles,
    /// Steps without a new patch.
    pub held_back: u64,
    /// CPU time of each background job, s.
    pub jobs: Quantiles,
    /// Background jobs that panicked.
    pub jobs_panicked: u64,
    /// CPU time of all background jobs as a share of the run.
    pub background_cpu_share: f64,
    /// Ticks and steps that are not in the log because a ring was full.
    pub lost_records: [u64; 2],
    /// Whether the log could not be written to its end.
    pub has_log_failed: bool,
    /// Threads that panicked.
    pub panicked: Vec<&'static str>,
    /// Events, in order.
    pub events: Vec<Event>,
    /// Scheduling that the system granted to each thread.
    pub granted: Vec<Granted>,
    /// Whether memory was locked; the reason if not.
    pub memory_locked: Result<(), String>,
    /// File of the log.
    pub log: Option<PathBuf>,
}

impl Report {
    /// The events that are warnings or errors.
    pub fn warnings(&self) -> impl Iterator<Item = &Event> {
        (self.events.iter()).filter(|e| e.what.level() >= Level::Warning)
    }
}
