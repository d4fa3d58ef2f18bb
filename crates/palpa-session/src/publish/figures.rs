//! The engine's figures for a page: rates, times, limits and faults.

use std::time::Instant;

use palpa_rt::{LateTick, Level, Quantiles, Report, StepRecord, TickEntry};
use palpa_servo::{Faults, Limits};
use palpa_viewer::control::{EngineFigures, ErrorBar, EventInfo, Notice, NoticeKind, NoticeLevel};

use super::events;

/// Number of events that a page receives.
const LATEST: usize = 30;

/// Counts at the time of the last figures, and the limits and faults since then.
#[derive(Debug)]
pub(crate) struct Figures {
    at: Instant,
    steps: u64,
    ticks: u64,
    snapshots: u64,
    n_events: usize,
    limits: Limits,
    faults: Faults,
    /// Time of the newest tick in them, s.
    ticked: f64,
}

impl Figures {
    /// The counts of an engine at its start.
    pub(crate) fn new() -> Self {
        Self {
            at: Instant::now(),
            steps: 0,
            ticks: 0,
            snapshots: 0,
            n_events: 0,
            limits: Limits::NONE,
            faults: Faults::NONE,
            ticked: f64::NEG_INFINITY,
        }
    }

    /// Records the limits and faults of a tick.
    pub(crate) fn note(&mut self, entry: &TickEntry) {
        self.limits |= Limits::from_bits(entry.tick.limits as u16);
        self.faults |= Faults::from_bits(entry.tick.faults as u16);
    }

    /// The present figures, with the ticks that came `late` last, and a notice of each error of the engine since the last ones.
    pub(crate) fn make(
        &mut self,
        report: &Report,
        late: &[LateTick],
        entry: &TickEntry,
        step: &StepRecord,
        n_nodes: usize,
        snapshots: u64,
    ) -> (EngineFigures, Vec<Notice>) {
        let now = Instant::now();
        let seconds = (now - self.at).as_secs_f64().max(1e-3);
        let rate = |n: u64, before: u64| n.saturating_sub(before) as f64 / seconds;
        let device = &entry.devices[0];
        let events = report
            .events
            .iter()
            .skip(report.events.len().saturating_sub(LATEST));
        let since = late.iter().rev().take_while(|tick| tick.now > self.ticked);
        let most = |of: fn(&LateTick) -> f64| since.clone().map(of).fold(0.0, f64::max);
        let figures = EngineFigures {
            seconds: report.duration,
            tissue_rate: rate(report.steps, self.steps),
            tick_rate: rate(report.ticks, self.ticks),
            missed: report.skipped,
            tick_cpu: three(&report.tick_cpu),
            lateness: three(&report.lateness),
            step_cpu: three(&report.step_cpu),
            tick_histogram: report.tick_cpu_histogram.clone(),
            latency: finite(entry.tick.patch_age),
            n_nodes: n_nodes as u32,
            n_meshes: step.mesh,
            limits: events::limits(self.limits),
            faults: events::faults(self.faults),
            energy_in: device.energy_in,
            energy_out: device.energy_out,
            energy_unpaid: most(|tick| -tick.bank),
            energy_budget: entry.tick.energy_budget,
            damping: most(|tick| tick.damping),
            step_status: events::recorded(step.status),
            granted: report.granted.iter().map(events::granted).collect(),
            events: events
                .map(|event| EventInfo {
                    time: event.time,
                    level: level(event.what.level()),
                    what: events::shown(&event.what),
                })
                .collect(),
            snapshot_rate: rate(snapshots, self.snapshots),
            error_bar: ErrorBar::None,
        };
        let notices = report.events[self.n_events.min(report.events.len())..]
            .iter()
            .filter(|event| event.what.level() >= Level::Error)
            .map(|event| Notice {
                level: NoticeLevel::Error,
                what: NoticeKind::Engine {
                    event: events::shown(&event.what),
                },
            })
            .collect();
        *self = Self {
            at: now,
            steps: report.steps,
            ticks: report.ticks,
            snapshots,
            n_events: report.events.len(),
            limits: Limits::NONE,
            faults: Faults::NONE,
            ticked: late.last().map_or(self.ticked, |tick| tick.now),
        };
        (figures, notices)
    }
}

fn three(quantiles: &Quantiles) -> [f64; 3] {
    [quantiles.p50, quantiles.p999, quantiles.max].map(finite)
}

/// JSON has no infinity.
fn finite(x: f64) -> f64 {
    if x.is_finite() { x } else { 0.0 }
}

fn level(level: Level) -> NoticeLevel {
    match level {
        Level::Info => NoticeLevel::Info,
        Level::Warning => NoticeLevel::Warning,
        Level::Error => NoticeLevel::Error,
    }
}
