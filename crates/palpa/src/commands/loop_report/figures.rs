//! The figures of a run.

use palpa_fem::realtime::LiveParams;
use palpa_rt::{ForceReport, Log, Quantiles, Report};
use palpa_servo::{Faults, Limits};
use serde::Serialize;

use crate::cli::Context;
use crate::engine::{GOOD_TRAVEL, LiveScene};
use crate::table::Table;

/// What a run must keep, as the project promises it: thread-CPU time of a tick, s; change of force where a patch comes,
/// N; and force between 20 and 400 Hz with the hand still, N.
const MOST_TICK: f64 = 200e-6;
const MOST_ARRIVAL: f64 = 0.02;
const MOST_RMS: f64 = 0.02;

/// What is written to loop.json.
#[derive(Debug, Serialize)]
pub(super) struct Figures {
    seconds: f64,
    nodes: usize,
    mesh_size_mm: f64,
    zone_radius_mm: f64,
    ticks: u64,
    /// Ticks left out because the one before was too late.
    misses: u64,
    tick_cpu_us: Times,
    wake_up_lateness_us: Times,
    #[serde(skip)]
    pub(super) cpu_histogram: Vec<(f64, f64, u64)>,
    #[serde(skip)]
    pub(super) lateness_histogram: Vec<(f64, f64, u64)>,
    tissue: TissueFigures,
    devices: Vec<ForceFigures>,
    /// Ticks with each fault and each limit.
    faults: Vec<(String, u64)>,
    limits: Vec<(String, u64)>,
    n_active_max: u32,
    lost_ticks: u64,
    lost_steps: u64,
    has_log_failed: bool,
    threads: Vec<String>,
    memory: String,
    events: Vec<String>,
}

/// Quantiles in microseconds.
#[derive(Debug, Clone, Copy, Serialize)]
struct Times {
    mean: f64,
    p50: f64,
    p99: f64,
    p999: f64,
    max: f64,
}

impl From<Quantiles> for Times {
    fn from(q: Quantiles) -> Self {
        let us = |s: f64| (s * 1e9).round() / 1e3;
        Self {
            mean: us(q.mean),
            p50: us(q.p50),
            p99: us(q.p99),
            p999: us(q.p999),
            max: us(q.max),
        }
    }
}

#[derive(Debug, Serialize)]
struct TissueFigures {
    steps: u64,
    steps_per_s: f64,
    /// Up to which speed of the tool the force keeps its accuracy: steps are short enough, and zones are there in time.
    fastest_tool_mm_per_s: f64,
    step_cpu_us: Times,
    step_wall_us: Times,
    held_back: u64,
    unfinished: u64,
    backed_off: u64,
    jobs: u64,
    job_cpu_us: Times,
    background_cpu_share: f64,
    zones: u64,
}

#[derive(Debug, Serialize)]
struct ForceFigures {
    max_force_n: f64,
    /// 20 to 400 Hz, last 2 s, the hand's target still.
    rms_still_n: f64,
    rms_worst_n: f64,
    arrival_max_n: f64,
    arrival_p999_n: f64,
    /// Beyond what the device's own displacement makes with the tissue's stiffness.
    arrival_alone_max_n: f64,
    other_p999_n: f64,
    other_max_n: f64,
    /// By the law's own count.
    energy_in_mj: f64,
    energy_out_mj: f64,
    /// The most that was ever given out beyond what was taken in.
    energy_deficit_mj: f64,
    energy_budget_mj: f64,
    softening_max: f64,
}

impl Figures {
    pub(super) fn new(
        report: &Report,
        forces: &[ForceReport],
        log: &Log,
        live: &LiveScene,
        seconds: f64,
    ) -> Self {
        let ticks = || log.ticks.iter().filter(|t| t.tick.now <= seconds);
        let mut faults = Vec::new();
        let mut limits = Vec::new();
        for tick in ticks() {
            let bits = u16::try_from(tick.tick.faults).unwrap_or(0);
            Faults::from_bits(bits).for_each_name(|name| count(&mut faults, name));
            let bits = u16::try_from(tick.tick.limits).unwrap_or(0);
            Limits::from_bits(bits).for_each_name(|name| count(&mut limits, name));
        }
        let devices = forces.iter().enumerate().map(|(k, force)| {
            let records = || ticks().map(move |t| &t.devices[k]);
            let last = records().next_back();
            ForceFigures {
                max_force_n: force.max_force,
                rms_still_n: force.rms_band,
                rms_worst_n: force.rms_band_worst,
                arrival_max_n: force.arrival_max,
                arrival_p999_n: force.arrival_p999,
                arrival_alone_max_n: force.arrival_alone_max,
                other_p999_n: force.other_p999,
                other_max_n: force.other_max,
                energy_in_mj: last.map_or(0.0, |d| d.energy_in * 1e3),
                energy_out_mj: last.map_or(0.0, |d| d.energy_out * 1e3),
                energy_deficit_mj: force.max_work.max(0.0) * 1e3,
                energy_budget_mj: ticks()
                    .next_back()
                    .map_or(0.0, |t| t.tick.energy_budget * 1e3),
                softening_max: records().map(|d| d.softening).fold(0.0, f64::max),
            }
        });
        let status = |wanted: u8| log.steps.iter().filter(|s| s.status == wanted).count() as u64;
        Self {
            seconds: report.duration,
            nodes: live.model.n_nodes(),
            mesh_size_mm: live.mesh_size * 1e3,
            zone_radius_mm: live.params.zone_radius * 1e3,
            ticks: report.ticks,
            misses: report.skipped,
            tick_cpu_us: report.tick_cpu.into(),
            wake_up_lateness_us: report.lateness.into(),
            cpu_histogram: report.tick_cpu_histogram.clone(),
            lateness_histogram: report.lateness_histogram.clone(),
            tissue: TissueFigures {
                steps: report.steps,
                steps_per_s: report.step_rate,
                fastest_tool_mm_per_s: 1e3 * fastest_tool(report, &live.params),
                step_cpu_us: report.step_cpu.into(),
                step_wall_us: report.step_wall.into(),
                held_back: report.held_back,
                unfinished: status(palpa_rt::StepStatus::Unfinished as u8),
                backed_off: status(palpa_rt::StepStatus::BackedOff as u8),
                jobs: report.jobs.count,
                job_cpu_us: report.jobs.into(),
                background_cpu_share: report.background_cpu_share,
                zones: log.steps.iter().map(|s| s.zone).max().unwrap_or(0),
            },
            devices: devices.collect(),
            faults,
            limits,
            n_active_max: ticks().map(|t| t.tick.n_active).max().unwrap_or(0),
            lost_ticks: report.lost_records[0],
            lost_steps: report.lost_records[1],
            has_log_failed: report.has_log_failed,
            threads: report.granted.iter().map(ToString::to_string).collect(),
            memory: match &report.memory_locked {
                Ok(()) => "locked".to_owned(),
                Err(why) => format!("not locked ({why})"),
            },
            events: report
                .events
                .iter()
                .map(|e| format!("{:.3} s: {}", e.time, e.text))
                .collect(),
        }
    }

    /// What is not as it must be; nothing of this speaks of the machine's own lateness.
    fn failures(&self) -> Vec<String> {
        let mut failures = Vec::new();
        if self.tick_cpu_us.p999 > MOST_TICK * 1e6 {
            failures.push(format!(
                "p99.9 of a tick's CPU time is {:.0} µs, more than {:.0}",
                self.tick_cpu_us.p999,
                MOST_TICK * 1e6
            ));
        }
        for d in &self.devices {
            // A device that goes by 45 µm from tick to tick changes the force by 0.02 N wherever it is.
            if d.arrival_alone_max_n > MOST_ARRIVAL {
                failures.push(format!(
                    "force changes by {:.4} N more than by the device's own displacement where a patch arrives, which is more \
                     than {MOST_ARRIVAL}",
                    d.arrival_alone_max_n
                ));
            }
            if d.arrival_max_n > 2.0 * d.other_p999_n {
                failures.push(format!(
                    "force changes by {:.4} N where a patch arrives, more than twice the p99.9 of other ticks, {:.4}",
                    d.arrival_max_n, d.other_p999_n
                ));
            }
            if d.rms_still_n > MOST_RMS {
                failures.push(format!(
                    "force between 20 and 400 Hz is {:.4} N, more than {MOST_RMS}",
                    d.rms_still_n
                ));
            }
            if d.energy_deficit_mj > d.energy_budget_mj {
                failures.push(format!(
                    "{:.2} mJ given out beyond what was taken in, more than {:.2}",
                    d.energy_deficit_mj, d.energy_budget_mj
                ));
            }
        }
        failures
    }

    pub(super) fn is_good(&self) -> bool {
        self.failures().is_empty()
    }

    pub(super) fn say(&self, context: &Context) -> anyhow::Result<()> {
        let mut table = Table::new(["", "p50", "p99", "p99.9", "max"]).with_left_names();
        for (name, t) in [
            ("tick, CPU µs", &self.tick_cpu_us),
            ("wake-up late, µs", &self.wake_up_lateness_us),
            ("tissue step, CPU µs", &self.tissue.step_cpu_us),
            ("tissue step, wall µs", &self.tissue.step_wall_us),
        ] {
            let cell = |x: f64| format!("{x:.1}");
            table.push([
                name.to_owned(),
                cell(t.p50),
                cell(t.p99),
                cell(t.p999),
                cell(t.max),
            ]);
        }
        context.say(table)?;
        let t = &self.tissue;
        context.say(format!(
            "{:.1} s, {} ticks, {} missed; tissue {:.0} steps/s ({} steps, {} unfinished, {} backed off, {} held back, {} zones), \
             {} background jobs, {:.1} % of a core",
            self.seconds, self.ticks, self.misses, t.steps_per_s, t.steps, t.unfinished, t.backed_off, t.held_back, t.zones,
            t.jobs, 100.0 * t.background_cpu_share
        ))?;
        context.say(format!(
            "forces keep their accuracy up to a tool speed of {:.0} mm/s: {:.2} mm a step",
            t.fastest_tool_mm_per_s,
            GOOD_TRAVEL * 1e3
        ))?;
        for d in &self.devices {
            context.say(format!(
                "force: at most {:.2} N; 20-400 Hz {:.4} N with the hand still; changes where a patch arrives {:.4} N at most, \
                 {:.4} of it not by the device's own displacement (p99.9 {:.4}), else {:.4} (p99.9)",
                d.max_force_n,
                d.rms_still_n,
                d.arrival_max_n,
                d.arrival_alone_max_n,
                d.arrival_p999_n,
                d.other_p999_n
            ))?;
            context.say(format!(
                "energy: {:.2} mJ taken in, {:.2} given out, never more than {:.3} beyond (budget {:.1}); softened by at most \
                 {:.1} %",
                d.energy_in_mj, d.energy_out_mj, d.energy_deficit_mj, d.energy_budget_mj, 100.0 * d.softening_max
            ))?;
        }
        let list = |counts: &[(String, u64)]| {
            let all: Vec<String> = counts
                .iter()
                .map(|(name, n)| format!("{name} {n}"))
                .collect();
            if all.is_empty() {
                "none".to_owned()
            } else {
                all.join(", ")
            }
        };
        context.say(format!(
            "ticks with faults: {}; at limits: {}",
            list(&self.faults),
            list(&self.limits)
        ))?;
        for thread in &self.threads {
            context.say(thread)?;
        }
        context.say(format!("memory {}", self.memory))?;
        for failure in self.failures() {
            context.say(format!("NOT GOOD: {failure}"))?;
        }
        Ok(())
    }
}

/// Speed at which a tool goes [`GOOD_TRAVEL`] in a step, or leaves the middle of a zone while the next is being made, m/s.
fn fastest_tool(report: &Report, params: &LiveParams) -> f64 {
    let by_steps = GOOD_TRAVEL * report.step_rate.min(1.0 / report.step_wall.p50);
    if report.jobs.count == 0 {
        return by_steps;
    }
    by_steps.min(params.longest_way() / report.jobs.p50)
}

fn count(counts: &mut Vec<(String, u64)>, name: &str) {
    match counts.iter_mut().find(|(n, _)| n == name) {
        Some((_, n)) => *n += 1,
        None => counts.push((name.to_owned(), 1)),
    }
}
