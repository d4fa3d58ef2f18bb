//! The figures of a run.

use palpa_rt::{ForceReport, Log, Quantiles, Report, StepRecord, StepStatus, TickEntry};
use palpa_servo::{Faults, Limits};
use serde::Serialize;

use super::Run;
use super::bars::{self, BarFigures};
use super::guarantees::{MOST_ARRIVAL, MOST_RMS};
use crate::cli::Context;
use crate::table::Table;
use palpa::live::{GOOD_TRAVEL, LiveScene};

/// The hand counts as still if the tool moves no farther than the first value, m, within the last
/// seconds, second value, s.
const STILL: [f64; 2] = [0.5e-3, 2.0];

/// Content of loop.json.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(Default))]
pub(super) struct Figures {
    seconds: f64,
    pub(super) nodes: usize,
    mesh_size_mm: f64,
    zone_radius_mm: f64,
    ticks: u64,
    /// Ticks skipped because the previous one was too late.
    misses: u64,
    pub(super) tick_cpu_us: Times,
    wake_up_lateness_us: Times,
    #[serde(skip)]
    pub(super) cpu_histogram: Vec<(f64, f64, u64)>,
    #[serde(skip)]
    pub(super) lateness_histogram: Vec<(f64, f64, u64)>,
    pub(super) tissue: TissueFigures,
    pub(super) devices: Vec<ForceFigures>,
    /// Error bars of the force along the way; `None` if none were asked for.
    pub(super) error_bars: Option<Vec<BarFigures>>,
    /// Number of ticks with each fault.
    faults: Vec<(String, u64)>,
    /// Number of ticks with each limit.
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
#[cfg_attr(test, derive(Default))]
pub(super) struct Times {
    mean: f64,
    p50: f64,
    p99: f64,
    pub(super) p999: f64,
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
#[cfg_attr(test, derive(Default))]
pub(super) struct TissueFigures {
    pub(super) steps: u64,
    pub(super) steps_per_s: f64,
    /// Largest speed of the tool at which the force keeps its accuracy: steps are short enough, and
    /// zones arrive in time.
    fastest_tool_mm_per_s: f64,
    /// Largest such speed by the steps alone.
    pub(super) fastest_by_steps_mm_per_s: f64,
    /// Speed of the hand.
    pub(super) motion_mm_per_s: f64,
    step_cpu_us: Times,
    step_wall_us: Times,
    pub(super) held_back: u64,
    unfinished: u64,
    /// Number of steps that did not reach the tool.
    behind: u64,
    /// Share of the steps with contact that did not reach the tool.
    pub(super) behind_share: f64,
    /// Share of the ticks without a force because the tissue was late.
    pub(super) stale_share: f64,
    jobs: u64,
    jobs_panicked: u64,
    job_cpu_us: Times,
    /// Wall time from the request of a zone until it is taken over, ms: 90th percentile.
    zone_wall_p90_ms: Option<f64>,
    background_cpu_share: f64,
    zones: u64,
    /// Number of meshes that the body used.
    meshes: u64,
}

#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(Default))]
pub(super) struct ForceFigures {
    pub(super) max_force_n: f64,
    /// RMS of the force between 20 and 400 Hz over the last 2 s; `None` if the tool was not still
    /// then.
    pub(super) rms_still_n: Option<f64>,
    rms_worst_n: f64,
    pub(super) arrival_max_n: f64,
    arrival_p999_n: f64,
    /// Largest change of force where a patch arrives, beyond the change that the device's own
    /// displacement causes through the tissue's stiffness.
    pub(super) arrival_alone_max_n: f64,
    pub(super) other_p999_n: f64,
    other_max_n: f64,
    /// Energy taken from the hand, as counted by the law.
    energy_in_mj: f64,
    /// Energy given to the hand, as counted by the law.
    energy_out_mj: f64,
    /// Largest energy given out beyond the energy taken in, since the last fault.
    pub(super) energy_deficit_mj: f64,
    pub(super) energy_budget_mj: f64,
    softening_max: f64,
}

/// The ticks up to a time, s.
fn ticks_until(log: &Log, seconds: f64) -> impl DoubleEndedIterator<Item = &TickEntry> {
    log.ticks.iter().filter(move |t| t.tick.now <= seconds)
}

impl ForceFigures {
    /// The figures of device `k`, up to a time in s.
    fn new(report: &Report, log: &Log, k: usize, force: &ForceReport, seconds: f64) -> Self {
        let ticks = || ticks_until(log, seconds);
        let records = || ticks().map(move |t| &t.devices[k]);
        let last = records().next_back();
        Self {
            max_force_n: force.max_force,
            rms_still_n: is_still(log, k, seconds.min(report.duration)).then_some(force.rms_band),
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
    }
}

impl TissueFigures {
    /// The figures of a run, up to a time in s; `motion_speed` in m/s.
    fn new(report: &Report, log: &Log, live: &LiveScene, motion_speed: f64, seconds: f64) -> Self {
        let status = |wanted: StepStatus| {
            let steps = log.steps.iter();
            steps.filter(|s| s.status == wanted as u8).count() as u64
        };
        let touching = log.steps.iter().filter(|s| s.n_contacts > 0).count();
        let behind = status(StepStatus::Behind);
        let stale = ticks_until(log, seconds).filter(|t| {
            let bits = u16::try_from(t.tick.faults).unwrap_or(0);
            Faults::from_bits(bits).contains(Faults::STALE_PATCH)
        });
        let by_steps = fastest_by_steps(report);
        let zone_wall = zone_wall(log);
        // The tool moves away from the middle of a zone while the next zone is computed.
        let by_zones = zone_wall.map(|time| live.params.longest_way() / time);
        Self {
            steps: report.steps,
            steps_per_s: report.step_rate,
            fastest_tool_mm_per_s: 1e3 * by_zones.map_or(by_steps, |v| v.min(by_steps)),
            fastest_by_steps_mm_per_s: 1e3 * by_steps,
            motion_mm_per_s: 1e3 * motion_speed,
            step_cpu_us: report.step_cpu.into(),
            step_wall_us: report.step_wall.into(),
            held_back: report.held_back,
            unfinished: status(StepStatus::Unfinished),
            behind,
            behind_share: behind as f64 / touching.max(1) as f64,
            stale_share: stale.count() as f64 / report.ticks.max(1) as f64,
            jobs: report.jobs.count,
            jobs_panicked: report.jobs_panicked,
            job_cpu_us: report.jobs.into(),
            zone_wall_p90_ms: zone_wall.map(|s| s * 1e3),
            background_cpu_share: report.background_cpu_share,
            zones: log.steps.iter().map(|s| s.zone).max().unwrap_or(0),
            meshes: log.steps.iter().map(|s| s.mesh).max().unwrap_or(0),
        }
    }
}

impl Figures {
    pub(super) fn new(
        run: &Run,
        log: &Log,
        live: &LiveScene,
        motion_speed: f64,
        seconds: f64,
    ) -> Self {
        let (report, forces) = (&run.report, &run.forces);
        let ticks = || ticks_until(log, seconds);
        let mut faults = Vec::new();
        let mut limits = Vec::new();
        for tick in ticks() {
            let bits = u16::try_from(tick.tick.faults).unwrap_or(0);
            Faults::from_bits(bits).for_each_name(|name| count(&mut faults, name));
            let bits = u16::try_from(tick.tick.limits).unwrap_or(0);
            Limits::from_bits(bits).for_each_name(|name| count(&mut limits, name));
        }
        let devices = forces.iter().enumerate();
        let devices = devices.map(|(k, force)| ForceFigures::new(report, log, k, force, seconds));
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
            tissue: TissueFigures::new(report, log, live, motion_speed, seconds),
            devices: devices.collect(),
            error_bars: run.bars.clone(),
            faults,
            limits,
            n_active_max: ticks().map(|t| t.tick.n_active).max().unwrap_or(0),
            lost_ticks: report.lost_records[0],
            lost_steps: report.lost_records[1],
            has_log_failed: report.has_log_failed,
            threads: run.threads.clone(),
            memory: match &report.memory_locked {
                Ok(()) => "locked".to_owned(),
                Err(why) => format!("not locked ({why})"),
            },
            events: report
                .events
                .iter()
                .map(|e| format!("{:.3} s: {}", e.time, e.what))
                .collect(),
        }
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
            "{:.1} s, {} ticks, {} missed; tissue {:.0} steps/s ({} steps, {} unfinished, {} behind, {} held back, {} zones, {} meshes), \
             {} background jobs ({} panicked), {:.1} % of a core",
            self.seconds, self.ticks, self.misses, t.steps_per_s, t.steps, t.unfinished, t.behind, t.held_back, t.zones, t.meshes,
            t.jobs, t.jobs_panicked, 100.0 * t.background_cpu_share
        ))?;
        context.say(format!(
            "the hand goes at {:.0} mm/s; steps ({:.2} mm each) and zones come in time for up to {:.0} mm/s",
            t.motion_mm_per_s,
            GOOD_TRAVEL * 1e3,
            t.fastest_tool_mm_per_s
        ))?;
        for d in &self.devices {
            context.say(d.table())?;
        }
        if let Some(error_bars) = &self.error_bars {
            bars::say(error_bars, context)?;
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
        Ok(())
    }
}

impl ForceFigures {
    /// Largest change of force that a patch may bring, N.
    pub(super) fn most_arrival_n(&self) -> f64 {
        2.0 * self.other_p999_n
    }

    fn table(&self) -> Table<3> {
        let mut table = Table::new(["force", "found", "allowed"]).with_left_names();
        let mut row = |name: &str, found: String, allowed: String| {
            table.push([name.to_owned(), found, allowed]);
        };
        let newtons = |x: f64| format!("{x:.4} N");
        row("largest", newtons(self.max_force_n), String::new());
        row(
            "20 to 400 Hz, the hand still at the end",
            self.rms_still_n
                .map_or_else(|| "not still".to_owned(), newtons),
            newtons(MOST_RMS),
        );
        row(
            "largest change where a patch arrives",
            newtons(self.arrival_max_n),
            newtons(self.most_arrival_n()),
        );
        row(
            "the same without the device's displacement",
            newtons(self.arrival_alone_max_n),
            newtons(MOST_ARRIVAL),
        );
        let joules = |x: f64| format!("{x:.2} mJ");
        row("energy taken in", joules(self.energy_in_mj), String::new());
        row(
            "energy given out",
            joules(self.energy_out_mj),
            String::new(),
        );
        row(
            "largest excess of energy given out",
            joules(self.energy_deficit_mj),
            joules(self.energy_budget_mj),
        );
        let softened = format!("{:.1} %", 100.0 * self.softening_max);
        row("tissue softened for the device", softened, String::new());
        table
    }
}

/// Whether the tool was still in the last seconds.
fn is_still(log: &Log, device: usize, end: f64) -> bool {
    let [most, time] = STILL;
    let last = log
        .ticks
        .iter()
        .filter(|t| (end - time..=end).contains(&t.tick.now));
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for place in last.map(|t| t.devices[device].position) {
        for c in 0..3 {
            low[c] = low[c].min(place[c]);
            high[c] = high[c].max(place[c]);
        }
    }
    (0..3).all(|c| high[c] - low[c] < most) && end > time
}

/// Time from the end of the step that requests a zone to the step that takes it over, s: 90th
/// percentile.
fn zone_wall(log: &Log) -> Option<f64> {
    let (mut asked, mut times) = (None, Vec::new());
    let mut last: Option<&StepRecord> = None;
    for step in &log.steps {
        let is_zone = last.is_some_and(|l| l.zone != step.zone && l.mesh == step.mesh);
        if let (true, Some(asked)) = (step.installed, asked)
            && is_zone
        {
            times.push(step.now - asked);
        }
        if step.job_taken {
            asked = Some(step.now + step.wall);
        }
        last = Some(step);
    }
    times.sort_by(f64::total_cmp);
    times.get(times.len() * 9 / 10).copied()
}

/// Speed at which a tool moves by [`GOOD_TRAVEL`] in a step, m/s.
fn fastest_by_steps(report: &Report) -> f64 {
    GOOD_TRAVEL * report.step_rate.min(1.0 / report.step_wall.p50)
}

fn count(counts: &mut Vec<(String, u64)>, name: &str) {
    match counts.iter_mut().find(|(n, _)| n == name) {
        Some((_, n)) => *n += 1,
        None => counts.push((name.to_owned(), 1)),
    }
}
