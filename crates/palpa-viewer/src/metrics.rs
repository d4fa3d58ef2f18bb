//! Figures for Prometheus, in its text format 0.0.4.

use crate::board::Board;
use std::{
    fmt::{Display, Write as _},
    sync::atomic::{AtomicU64, Ordering::Relaxed},
};

/// The server's counters since its start.
#[derive(Debug, Default)]
pub(crate) struct Counts {
    /// Connections that became WebSockets.
    pub(crate) connections: Count,
    /// Meshes sent, summed over all clients.
    pub(crate) meshes_sent: Count,
    /// Frames sent.
    pub(crate) frames_sent: Count,
    /// Frames that clients missed because they were slow.
    pub(crate) frames_dropped: Count,
    /// Bytes of all messages sent.
    pub(crate) bytes_sent: Count,
    /// Requests parsed.
    pub(crate) requests: Count,
    /// Requests refused, by the server or by the session.
    pub(crate) refused: Count,
    /// Messages that could not be parsed as requests.
    pub(crate) malformed: Count,
    /// Clients dropped because they did not read, were silent, or sent too much.
    pub(crate) dropped: Count,
}

/// A counter that only grows.
#[derive(Debug, Default)]
pub(crate) struct Count(AtomicU64);

impl Count {
    pub(crate) fn add(&self, n: u64) {
        self.0.fetch_add(n, Relaxed);
    }

    fn get(&self) -> u64 {
        self.0.load(Relaxed)
    }
}

/// The text for Prometheus.
pub(crate) fn text(board: &Board, is_well: bool) -> String {
    let mut page = Page(String::with_capacity(4096));
    page.gauge(
        "palpa_up",
        "Whether the engine runs (1) or has stopped (0).",
        u8::from(is_well),
    );
    server(&mut page, board);
    if let Some((figures, _)) = &*board.engine.borrow() {
        engine(&mut page, figures);
    }
    page.0
}

fn server(page: &mut Page, board: &Board) {
    let clients = board.clients();
    let counts = &board.counts;
    page.gauge("palpa_web_clients", "Clients connected.", clients.n);
    page.gauge(
        "palpa_web_controlled",
        "Whether a page controls.",
        u8::from(clients.controller.is_some()),
    );
    for (name, help, count) in [
        (
            "connections",
            "WebSockets opened since the start.",
            &counts.connections,
        ),
        (
            "meshes_sent",
            "Meshes sent to clients.",
            &counts.meshes_sent,
        ),
        (
            "snapshots_sent",
            "Frames sent to clients.",
            &counts.frames_sent,
        ),
        (
            "snapshots_dropped",
            "Frames that slow clients missed.",
            &counts.frames_dropped,
        ),
        ("sent_bytes", "Bytes sent to clients.", &counts.bytes_sent),
        ("requests", "Requests understood.", &counts.requests),
        ("requests_refused", "Requests refused.", &counts.refused),
        (
            "malformed",
            "Messages that were no requests.",
            &counts.malformed,
        ),
        (
            "clients_dropped",
            "Clients let go because they did not read, were silent, or asked too much.",
            &counts.dropped,
        ),
    ] {
        page.counter(&format!("palpa_web_{name}_total"), help, count.get());
    }
}

fn engine(page: &mut Page, figures: &crate::control::EngineFigures) {
    page.gauge(
        "palpa_engine_seconds",
        "Time since the engine's start.",
        figures.seconds,
    );
    page.gauge(
        "palpa_tissue_steps_per_second",
        "Steps of the tissue in the last second.",
        figures.tissue_rate,
    );
    page.gauge(
        "palpa_servo_ticks_per_second",
        "Ticks of the servo loop in the last second.",
        figures.tick_rate,
    );
    page.counter(
        "palpa_servo_missed_ticks_total",
        "Ticks left out since the start.",
        figures.missed,
    );
    page.quantiles(
        "palpa_servo_tick_cpu_seconds",
        "CPU time of ticks; quantile 1 is the longest.",
        figures.tick_cpu,
    );
    page.quantiles(
        "palpa_servo_lateness_seconds",
        "Lateness of ticks; quantile 1 is the longest.",
        figures.lateness,
    );
    page.quantiles(
        "palpa_tissue_step_cpu_seconds",
        "CPU time of the tissue's steps; quantile 1 is the longest.",
        figures.step_cpu,
    );
    page.gauge(
        "palpa_patch_age_seconds",
        "Age of the contact patch in use: time since its pose was read.",
        figures.latency,
    );
    page.gauge("palpa_body_nodes", "Nodes of the body.", figures.n_nodes);
    page.counter(
        "palpa_body_meshes_total",
        "Meshes taken up since the start.",
        figures.n_meshes,
    );
    page.gauge(
        "palpa_energy_in_joules",
        "Energy taken from the hand since the start.",
        figures.energy_in,
    );
    page.gauge(
        "palpa_energy_out_joules",
        "Energy given to the hand since the start.",
        figures.energy_out,
    );
    page.gauge(
        "palpa_energy_unpaid_joules",
        "Energy given to the hand that nothing paid for: the largest since the last figures.",
        figures.energy_unpaid,
    );
    page.gauge(
        "palpa_energy_budget_joules",
        "Bound on palpa_energy_unpaid_joules.",
        figures.energy_budget,
    );
    page.gauge(
        "palpa_limits_met",
        "Limits that the force met since the last figures.",
        figures.limits.len(),
    );
    page.gauge(
        "palpa_faults_met",
        "Faults since the last figures.",
        figures.faults.len(),
    );
    page.gauge(
        "palpa_snapshots_per_second",
        "Snapshots made in the last second.",
        figures.snapshot_rate,
    );
}

struct Page(String);

impl Page {
    fn gauge(&mut self, name: &str, help: &str, value: impl Display) {
        self.one(name, help, "gauge", value);
    }

    fn counter(&mut self, name: &str, help: &str, value: impl Display) {
        self.one(name, help, "counter", value);
    }

    fn one(&mut self, name: &str, help: &str, kind: &str, value: impl Display) {
        self.head(name, help, kind);
        // Rust writes numbers, NaN and inf in the format that Prometheus reads.
        let _ = writeln!(self.0, "{name} {value}");
    }

    /// One gauge per quantile. A Prometheus summary would also need a sum and a count.
    fn quantiles(&mut self, name: &str, help: &str, values: [f64; 3]) {
        self.head(name, help, "gauge");
        for (quantile, value) in ["0.5", "0.999", "1"].iter().zip(values) {
            let _ = writeln!(self.0, "{name}{{quantile=\"{quantile}\"}} {value}");
        }
    }

    fn head(&mut self, name: &str, help: &str, kind: &str) {
        let _ = writeln!(self.0, "# HELP {name} {help}\n# TYPE {name} {kind}");
    }
}
