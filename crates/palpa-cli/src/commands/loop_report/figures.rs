//! The figures of a run.

use palpa_rt::{
    Ending, Happening, Histogram, Log, Quantiles, RecordKind, Report, StepRecord, StepStatus,
    TickEntry,
};
use palpa_servo::{Faults, Limits};
use serde::Serialize;

use super::Run;
use super::audit::Audit;
use super::bars::{self, BarFigures};
use super::force::ForceFigures;
use super::verdicts::{self, Verdict};
use crate::cli::Context;
use crate::table::Table;
use palpa::live::{GOOD_TRAVEL, LiveScene};

/// The body of a run, and the motion of the hand. Lengths in m.
#[derive(Debug, Clone, Copy)]
pub(super) struct Setup {
    pub(super) nodes: usize,
    pub(super) mesh_size: f64,
    pub(super) zone_radius: f64,
    /// Distance from the centre of a zone at which the next zone is requested.
    pub(super) longest_way: f64,
    /// Largest speed of the hand, m/s.
    pub(super) motion_speed: f64,
}

impl Setup {
    pub(super) fn new(live: &LiveScene, motion_speed: f64) -> Self {
        Self {
            nodes: live.model.n_nodes(),
            mesh_size: live.mesh_size,
            zone_radius: live.params.zone_radius,
            longest_way: live.params.longest_way(),
            motion_speed,
        }
    }
}

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
    /// Errors of the force at poses that were solved again; `None` if that was not asked for.
    pub(super) audit: Option<Audit>,
    /// The guarantees, and whether this run kept them.
    pub(super) verdicts: Vec<Verdict>,
    /// Whether every guarantee was judged and kept.
    pub(super) is_good: bool,
    /// Number of ticks with each fault.
    faults: Vec<(String, u64)>,
    /// Number of ticks with each limit.
    limits: Vec<(String, u64)>,
    n_active_max: u32,
    pub(super) lost_ticks: u64,
    pub(super) lost_steps: u64,
    pub(super) lost_events: u64,
    pub(super) has_log_failed: bool,
    /// Whether the log can be read to its end.
    pub(super) is_log_whole: bool,
    /// Threads that ended because of a panic.
    pub(super) panicked: Vec<&'static str>,
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
    /// Rate of the steps with contact; `None` without such steps.
    pub(super) steps_per_s_in_contact: Option<f64>,
    /// Largest speed of the tool at which the force keeps its accuracy: steps are short enough, and
    /// zones arrive in time.
    fastest_tool_mm_per_s: f64,
    /// Largest such speed by the steps alone.
    pub(super) fastest_by_steps_mm_per_s: f64,
    /// Speed of the hand.
    pub(super) motion_mm_per_s: f64,
    /// Of the steps with contact in which something moved: others cost next to nothing.
    step_cpu_us: Times,
    step_wall_us: Times,
    pub(super) held_back: u64,
    unfinished: u64,
    /// Share of the steps with contact that did not reach their tolerance.
    pub(super) unfinished_share: f64,
    /// Number of steps with contact in which something moved, or that did not reach the tool.
    pub(super) touching: u64,
    /// Number of steps that did not reach the tool.
    pub(super) behind: u64,
    /// Share of the steps with contact that did not reach the tool.
    pub(super) behind_share: f64,
    /// Share of the ticks without a force because the tissue was late.
    pub(super) stale_share: f64,
    jobs: u64,
    pub(super) jobs_panicked: u64,
    job_cpu_us: Times,
    /// Wall time from the request of a zone until it is taken over, ms: 90th percentile.
    zone_wall_p90_ms: Option<f64>,
    background_cpu_share: f64,
    zones: u64,
    /// Number of meshes that the body used.
    meshes: u64,
}

/// The ticks up to a time, s.
pub(super) fn ticks_until(log: &Log, seconds: f64) -> impl DoubleEndedIterator<Item = &TickEntry> {
    log.ticks.iter().filter(move |t| t.tick.now <= seconds)
}

impl TissueFigures {
    /// The figures of a run, up to a time in s.
    fn new(report: &Report, log: &Log, setup: &Setup, until: f64) -> Self {
        let status = |wanted: StepStatus| {
            let steps = log.steps.iter();
            steps.filter(move |s| s.status == wanted as u8)
        };
        // A step that did not reach the tool may have found nothing to do.
        let is_behind = |s: &StepRecord| s.status == StepStatus::Behind as u8;
        let touching = (log.steps.iter()).filter(|s| has_worked(s) || is_behind(s));
        let touching = touching.count();
        let share = |n: usize| n as f64 / touching.max(1) as f64;
        let behind = status(StepStatus::Behind).count();
        let unfinished = status(StepStatus::Unfinished);
        let stale = ticks_until(log, until).filter(|t| {
            let bits = u16::try_from(t.tick.faults).unwrap_or(0);
            Faults::from_bits(bits).contains(Faults::STALE_PATCH)
        });
        let in_contact = rate_in_contact(&log.steps);
        let by_steps = GOOD_TRAVEL * in_contact.unwrap_or(report.step_rate);
        let zone_wall = zone_wall(log);
        // The tool moves away from the middle of a zone while the next zone is computed.
        let by_zones = zone_wall.map(|time| setup.longest_way / time);
        Self {
            steps: report.steps,
            steps_per_s: report.step_rate,
            steps_per_s_in_contact: in_contact,
            fastest_tool_mm_per_s: 1e3 * by_zones.map_or(by_steps, |v| v.min(by_steps)),
            fastest_by_steps_mm_per_s: 1e3 * by_steps,
            motion_mm_per_s: 1e3 * setup.motion_speed,
            step_cpu_us: times_in_contact(log, |step| step.cpu),
            step_wall_us: times_in_contact(log, |step| step.wall),
            held_back: report.held_back,
            unfinished_share: share(unfinished.clone().filter(|s| has_worked(s)).count()),
            unfinished: unfinished.count() as u64,
            touching: touching as u64,
            behind: behind as u64,
            behind_share: share(behind),
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
    pub(super) fn new(run: &Run, log: &Log, setup: &Setup) -> Self {
        let (report, until) = (&run.report, run.until);
        let ticks = || ticks_until(log, until);
        let mut faults = Vec::new();
        let mut limits = Vec::new();
        for tick in ticks() {
            let bits = u16::try_from(tick.tick.faults).unwrap_or(0);
            Faults::from_bits(bits).for_each_name(|name| count(&mut faults, name));
            let bits = u16::try_from(tick.tick.limits).unwrap_or(0);
            Limits::from_bits(bits).for_each_name(|name| count(&mut limits, name));
        }
        let lost_events = report.events.iter().map(|event| match event.what {
            Happening::RecordsLost(RecordKind::Events, n) => n,
            _ => 0,
        });
        let mut figures = Self {
            seconds: report.duration,
            nodes: setup.nodes,
            mesh_size_mm: setup.mesh_size * 1e3,
            zone_radius_mm: setup.zone_radius * 1e3,
            ticks: report.ticks,
            misses: report.skipped,
            tick_cpu_us: report.tick_cpu.into(),
            wake_up_lateness_us: report.lateness.into(),
            cpu_histogram: report.tick_cpu_histogram.clone(),
            lateness_histogram: report.lateness_histogram.clone(),
            tissue: TissueFigures::new(report, log, setup, until),
            devices: ForceFigures::of_all(run, log),
            error_bars: run.bars.clone(),
            audit: run.audit.clone(),
            verdicts: Vec::new(),
            is_good: false,
            faults,
            limits,
            n_active_max: ticks().map(|t| t.tick.n_active).max().unwrap_or(0),
            lost_ticks: report.lost_records[0],
            lost_steps: report.lost_records[1],
            lost_events: lost_events.sum(),
            has_log_failed: report.has_log_failed,
            is_log_whole: log.ending == Ending::Whole,
            panicked: report.panicked.clone(),
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
        };
        figures.verdicts = verdicts::judge(&figures);
        figures.is_good = figures.verdicts.iter().all(|verdict| verdict.is_kept);
        figures
    }

    pub(super) fn say(&self, context: &Context) -> anyhow::Result<()> {
        let mut table = Table::new(["", "p50", "p99", "p99.9", "max"]).with_left_names();
        for (name, t) in [
            ("tick, CPU µs", &self.tick_cpu_us),
            ("wake-up late, µs", &self.wake_up_lateness_us),
            ("step in contact, CPU µs", &self.tissue.step_cpu_us),
            ("step in contact, wall µs", &self.tissue.step_wall_us),
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
            "{:.1} s, {} ticks, {} missed; {} steps, {:.0} a second; of these {} moved in contact, {} a second ({} unfinished, {} behind, {} \
             held back); {} zones, {} meshes; {} background jobs ({} panicked), {:.1} % of a core",
            self.seconds,
            self.ticks,
            self.misses,
            t.steps,
            t.steps_per_s,
            t.touching,
            t.steps_per_s_in_contact
                .map_or_else(|| "none".to_owned(), |rate| format!("{rate:.0}")),
            t.unfinished,
            t.behind,
            t.held_back,
            t.zones,
            t.meshes,
            t.jobs,
            t.jobs_panicked,
            100.0 * t.background_cpu_share
        ))?;
        context.say(format!(
            "the hand goes at {:.0} mm/s; steps ({:.2} mm each) and zones come in time for up to {:.0} mm/s",
            t.motion_mm_per_s,
            GOOD_TRAVEL * 1e3,
            t.fastest_tool_mm_per_s
        ))?;
        for d in &self.devices {
            context.say(d.line())?;
        }
        context.say(verdicts::table(&self.verdicts))?;
        if let Some(error_bars) = &self.error_bars {
            bars::say(error_bars, context)?;
        }
        if let Some(audit) = &self.audit {
            audit.say(context)?;
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

/// Whether a step had contact and something to do. A body that a tool presses without moving is left as
/// it is, a thousand times a second: such steps would hide the others.
fn has_worked(step: &StepRecord) -> bool {
    step.n_contacts > 0 && step.iterations > 0
}

/// Rate of the steps with contact in which something moved, each until the next step begins, 1/s.
fn rate_in_contact(steps: &[StepRecord]) -> Option<f64> {
    let pairs = steps.windows(2).filter(|pair| has_worked(&pair[0]));
    let time: f64 = pairs.clone().map(|pair| pair[1].now - pair[0].now).sum();
    (time > 0.0).then(|| pairs.count() as f64 / time)
}

/// Times of the steps with contact in which something moved.
fn times_in_contact(log: &Log, time: impl Fn(&StepRecord) -> f64) -> Times {
    let histogram = Histogram::new();
    for step in log.steps.iter().filter(|step| has_worked(step)) {
        histogram.add(time(step));
    }
    histogram.quantiles().into()
}

fn count(counts: &mut Vec<(String, u64)>, name: &str) {
    match counts.iter_mut().find(|(n, _)| n == name) {
        Some((_, n)) => *n += 1,
        None => counts.push((name.to_owned(), 1)),
    }
}
