//! The guarantees of a run in real time, and whether the run kept them.
//!
//! A guarantee without anything to judge it by, such as stillness in a run without a pause, is not
//! kept: the report then cannot say that the loop is good.

use palpa_rt::Dips;
use serde::{Serialize, Serializer};

use super::figures::{Figures, TissueFigures};
use super::force::ForceFigures;
use crate::table::Table;

/// Largest thread-CPU time of a tick at its p99.9, µs.
const MOST_TICK: f64 = 200.0;
/// Largest change of force that a patch itself may bring, N: less than a hand feels as a knock.
pub(super) const MOST_ARRIVAL: f64 = 0.02;
/// Largest RMS of the force while the target of the hand is still, N, between 20 and 400 Hz and
/// between 2 and 20 Hz.
const MOST_RMS: f64 = 0.02;
/// Largest error of the force that a patch may correct (99th percentile), and largest force of the
/// energy observer's damping, as a share of the largest force: the accuracy that Palpa aims at. Never
/// less than [`MOST_ARRIVAL`].
const MOST_ERROR: f64 = 0.03;
/// Largest share of the steps with contact in which the tissue may be behind the tool or unfinished,
/// of all steps that may fail, and of the ticks whose contact is not solved.
const MOST_BEHIND: f64 = 0.01;
/// Largest share of ticks without a force because the tissue was late, or whose force the device's
/// limits cut: as many as one hiccup of the machine causes.
const MOST_STALE: f64 = 1e-3;
/// Largest share of the tissue's stiffness that the coupling may take away.
const MOST_SOFTENED: f64 = 0.1;
/// Largest dip of the force below that of the tissue, as a share of it.
const MOST_DIP: f64 = 0.1;
/// Longest gap between two ticks that the loop should survive, ms.
const SHORT_GAP: f64 = 30.0;

/// Unit of a figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unit {
    Count,
    Micros,
    Millijoules,
    MillimetresPerSecond,
    Newtons,
    /// A share of one.
    Share,
}

impl Unit {
    fn symbol(self) -> &'static str {
        match self {
            Self::Count | Self::Share => "1",
            Self::Micros => "us",
            Self::Millijoules => "mJ",
            Self::MillimetresPerSecond => "mm/s",
            Self::Newtons => "N",
        }
    }

    fn shown(self, x: f64) -> String {
        match self {
            Self::Count => format!("{x:.0}"),
            Self::Micros => format!("{x:.0} µs"),
            Self::Millijoules => format!("{x:.2} mJ"),
            Self::MillimetresPerSecond => format!("{x:.0} mm/s"),
            Self::Newtons => format!("{x:.4} N"),
            Self::Share => format!("{:.2} %", 100.0 * x),
        }
    }
}

impl Serialize for Unit {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.symbol())
    }
}

/// The guarantees.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Guarantee {
    TickTime,
    Behind,
    Unfinished,
    Stale,
    FailedSteps,
    HandSpeed,
    LostRecords,
    Panics,
    PatchJump,
    UnusualArrival,
    Transfer,
    Vibration,
    SlowVibration,
    EnergySinceFault,
    EnergyWindow,
    ObserverDamping,
    Pull,
    Unsolved,
    Cut,
    Softened,
    BadPatches,
    OtherFaults,
    Dip,
    Audit,
}

impl Guarantee {
    fn name(self) -> &'static str {
        match self {
            Self::TickTime => "p99.9 of a tick's CPU time",
            Self::Behind => "steps behind the tool",
            Self::Unfinished => "steps not converged",
            Self::Stale => "ticks without a fresh patch",
            Self::FailedSteps => "steps that failed",
            Self::HandSpeed => "speed of the hand",
            Self::LostRecords => "lost records",
            Self::Panics => "panics",
            Self::PatchJump => "change by a patch alone",
            Self::UnusualArrival => "largest change where a patch arrives",
            Self::Transfer => "error that a patch corrects, p99",
            Self::Vibration => "20 to 400 Hz, target of the hand still",
            Self::SlowVibration => "2 to 20 Hz, target of the hand still",
            Self::EnergySinceFault => "energy given out since the last fault",
            Self::EnergyWindow => "energy given out in a closed second",
            Self::ObserverDamping => "force of the energy observer's damping",
            Self::Pull => "force that pulls into the tissue",
            Self::Unsolved => "ticks whose contact was not solved",
            Self::Cut => "ticks whose force a limit cut",
            Self::Softened => "tissue softened for the device",
            Self::BadPatches => "ticks with a bad patch",
            Self::OtherFaults => "ticks with other faults",
            Self::Dip => "largest dip of the force",
            Self::Audit => "error of the force by the audit, p95",
        }
    }
}

/// A guarantee, and what a run made of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Verdict {
    pub(super) guarantee: Guarantee,
    /// The device; `None` if it is not about a single one.
    device: Option<usize>,
    /// `None` if there was nothing to judge it by.
    found: Option<f64>,
    allowed: f64,
    unit: Unit,
    pub(super) is_kept: bool,
    /// What happened and what to do, if the guarantee was not kept.
    pub(super) problem: Option<String>,
}

/// Collects verdicts.
struct Judge {
    device: Option<usize>,
    verdicts: Vec<Verdict>,
}

impl Judge {
    /// Judges a figure that may be at most `allowed`. `problem` says what is wrong with a larger one.
    fn at_most(
        &mut self,
        guarantee: Guarantee,
        found: f64,
        allowed: f64,
        unit: Unit,
        problem: impl FnOnce() -> String,
    ) {
        self.if_any(guarantee, Some(found), allowed, unit, "", problem);
    }

    /// The same for a figure that is missing if there was nothing to judge; `missing` says why that
    /// is.
    fn if_any(
        &mut self,
        guarantee: Guarantee,
        found: Option<f64>,
        allowed: f64,
        unit: Unit,
        missing: &str,
        problem: impl FnOnce() -> String,
    ) {
        let is_kept = found.is_some_and(|found| found <= allowed);
        let problem = || match found {
            Some(_) => problem(),
            None => missing.to_owned(),
        };
        self.verdicts.push(Verdict {
            guarantee,
            device: self.device,
            found,
            allowed,
            unit,
            is_kept,
            problem: (!is_kept).then(problem),
        });
    }

    /// Judges a number of events of which there may be none.
    fn none(&mut self, guarantee: Guarantee, found: u64, problem: impl FnOnce() -> String) {
        self.at_most(guarantee, found as f64, 0.0, Unit::Count, problem);
    }
}

/// Judges a run. How late the machine wakes the loop does not count by itself; dips of the force do.
pub(super) fn judge(figures: &Figures) -> Vec<Verdict> {
    let mut judge = Judge {
        device: None,
        verdicts: Vec::new(),
    };
    judge_loop(figures, &mut judge);
    judge_tissue(&figures.tissue, figures.nodes, &mut judge);
    if let Some(audit) = &figures.audit {
        let found = audit.error_p95.filter(|_| audit.n >= audit.n_failed);
        let missing = if audit.n == 0 {
            "no pose was solved again"
        } else {
            "most of the poses have no static equilibrium"
        };
        judge.if_any(Guarantee::Audit, found, MOST_ERROR, Unit::Share, missing, || {
            format!(
                "one force in twenty is {:.1} % or more off that of finer meshes; {:.0} % are allowed: move more slowly; if \
                 it is the mesh, give no near_tool or accuracy in [mesh], so that the loop chooses all sizes, or, if it did, a \
                 smaller near_tool",
                100.0 * found.unwrap_or_default(),
                100.0 * MOST_ERROR
            )
        });
    }
    for (k, device) in figures.devices.iter().enumerate() {
        judge.device = Some(k);
        judge_feel(device, &mut judge);
        judge_contact(device, &mut judge);
    }
    judge.verdicts
}

fn judge_loop(figures: &Figures, judge: &mut Judge) {
    let p999 = figures.tick_cpu_us.p999;
    judge.at_most(Guarantee::TickTime, p999, MOST_TICK, Unit::Micros, || {
        format!("p99.9 of a tick's CPU time is {p999:.0} µs, more than {MOST_TICK:.0}")
    });
    let [ticks, steps, events] = [figures.lost_ticks, figures.lost_steps, figures.lost_events];
    let is_cut = figures.has_log_failed || !figures.is_log_whole;
    let lost = ticks + steps + events + u64::from(is_cut);
    judge.none(Guarantee::LostRecords, lost, || {
        let log = if is_cut {
            "; the log does not go to the end of the run"
        } else {
            ""
        };
        format!(
            "{ticks} ticks, {steps} steps and {events} events are not in the log{log}: what happened in them is not judged, and \
             a replay is not possible; close other programs, or write to a faster disk"
        )
    });
    let (jobs, threads) = (figures.tissue.jobs_panicked, &figures.panicked);
    let panics = jobs + threads.len() as u64;
    judge.none(Guarantee::Panics, panics, || {
        format!("{jobs} background jobs panicked, and these threads: {threads:?}; this is a bug in Palpa")
    });
}

fn judge_tissue(t: &TissueFigures, nodes: usize, judge: &mut Judge) {
    const NO_STEP: &str = "no step of the tissue had a vertex near the tool";
    let share = |share: f64| (t.touching > 0).then_some(share);
    judge.if_any(
        Guarantee::Behind,
        share(t.behind_share),
        MOST_BEHIND,
        Unit::Share,
        NO_STEP,
        || {
            format!(
                "in {:.1} % of the steps with contact, {} of {}, the tissue was behind the tool, because zones, meshes or \
                 the steps themselves took too long: the forces of these steps are wrong; close other programs, move more \
                 slowly, or make the mesh coarser with [mesh] near_tool",
                100.0 * t.behind_share, t.behind, t.touching
            )
        },
    );
    judge.if_any(
        Guarantee::Unfinished,
        share(t.unfinished_share),
        MOST_BEHIND,
        Unit::Share,
        NO_STEP,
        || {
            format!(
                "{:.1} % of the steps with contact did not converge: their forces lag behind; move more slowly, or press \
                 less deep",
                100.0 * t.unfinished_share
            )
        },
    );
    judge.at_most(
        Guarantee::Stale,
        t.stale_share,
        MOST_STALE,
        Unit::Share,
        || {
            format!(
                "{:.1} % of the ticks had no force, since no fresh patch came ({} steps failed; with contact {:.0} steps/s on \
                 {nodes} nodes)",
                100.0 * t.stale_share,
                t.held_back,
                t.steps_per_s_in_contact.unwrap_or_default()
            )
        },
    );
    let failed = t.held_back as f64 / t.touching.max(1) as f64;
    judge.at_most(Guarantee::FailedSteps, failed, MOST_BEHIND, Unit::Share, || {
        format!(
            "{} of {} steps of the tissue with contact failed and were not felt; press less deep, or make the mesh finer there",
            t.held_back, t.touching
        )
    });
    let (hand, steps) = (t.motion_mm_per_s, t.fastest_by_steps_mm_per_s);
    // Zones that arrive too late are reported above.
    judge.at_most(
        Guarantee::HandSpeed,
        hand,
        steps,
        Unit::MillimetresPerSecond,
        || {
            format!(
                "the hand goes at {hand:.0} mm/s, and steps are short enough for {steps:.0} mm/s: move more slowly, or \
                 make the mesh coarser with [mesh] near_tool"
            )
        },
    );
}

/// Judges what the hand feels.
fn judge_feel(d: &ForceFigures, judge: &mut Judge) {
    const NO_TOUCH: &str = "nothing was felt: the tool did not touch the skin during the run; check [motion] in the scene, \
                            or run longer with --seconds";
    const NO_PATCH: &str = "no patch of the tissue came while the tool pressed at full force: its steps took too long or \
                            failed; press less deep, or make the mesh coarser";
    const NO_PAUSE: &str = "the target of the hand never stood still for a second, without a fault, while the tool pressed; \
                            run longer with --seconds: the hand rests in the last seconds of a run that has the time";
    let nothing = if d.max_force_n > 0.0 {
        NO_PATCH
    } else {
        NO_TOUCH
    };
    let arrival = |force: f64| (d.arrivals > 0).then_some(force);
    // The change caused by the device itself is excluded: steps of 45 µm from tick to tick change
    // the force by 0.02 N everywhere.
    judge.if_any(
        Guarantee::PatchJump,
        arrival(d.arrival_alone_max_n),
        MOST_ARRIVAL,
        Unit::Newtons,
        nothing,
        || {
            format!(
                "when a patch arrives, the force changes by {:.4} N beyond the change that the device's displacement \
                 causes; {MOST_ARRIVAL} N are allowed",
                d.arrival_alone_max_n
            )
        },
    );
    judge.if_any(
        Guarantee::UnusualArrival,
        arrival(d.arrival_max_n),
        d.most_arrival_n(),
        Unit::Newtons,
        nothing,
        || {
            format!(
                "force changes by {:.4} N where a patch arrives, more than {:.4}: the smaller of twice the p99.9 of other \
                 ticks ({:.4}) and a tenth of the largest force, but at least {MOST_ARRIVAL}",
                d.arrival_max_n,
                d.most_arrival_n(),
                d.other_p999_n
            )
        },
    );
    let most = (MOST_ERROR * d.max_force_n).max(MOST_ARRIVAL);
    judge.if_any(
        Guarantee::Transfer,
        arrival(d.transfer_p99_n),
        most,
        Unit::Newtons,
        nothing,
        || {
            format!(
                "one patch in a hundred corrects the force by {:.4} N or more at the same pose, more than {most:.4}: the \
                 force between patches is wrong by that; move more slowly, or make the mesh coarser",
                d.transfer_p99_n
            )
        },
    );
    for (guarantee, band, rms) in [
        (Guarantee::Vibration, "20 and 400", d.rms_still_n),
        (Guarantee::SlowVibration, "2 and 20", d.rms_slow_still_n),
    ] {
        judge.if_any(guarantee, rms, MOST_RMS, Unit::Newtons, NO_PAUSE, || {
            let rms = rms.unwrap_or_default();
            format!(
                "force between {band} Hz is {rms:.4} N while the target of the hand is still, more than {MOST_RMS}"
            )
        });
    }
    judge_energy(d, most, judge);
    judge.if_any(
        Guarantee::Dip,
        d.dip_max,
        MOST_DIP,
        Unit::Share,
        &format!(
            "the force was never {} N or more: press deeper",
            Dips::LEAST_FORCE
        ),
        || dip_words(d),
    );
}

/// Judges the energy that the loop gives to the hand, and forces that are not the tissue's: none may be more than
/// `most`, N.
fn judge_energy(d: &ForceFigures, most: f64, judge: &mut Judge) {
    let (made, budget) = (d.energy_deficit_mj, d.energy_budget_mj);
    judge.at_most(
        Guarantee::EnergySinceFault,
        made,
        budget,
        Unit::Millijoules,
        || {
            format!("the loop gave out {made:.2} mJ more energy than it took in; {budget:.2} mJ are allowed")
        },
    );
    judge.if_any(
        Guarantee::EnergyWindow,
        d.energy_window_mj,
        budget,
        Unit::Millijoules,
        "the device never came back to the same position within a second of contact",
        || {
            format!(
                "within a second, on a way that ends where it began, the loop gave out {:.2} mJ; {budget:.2} mJ are allowed",
                d.energy_window_mj.unwrap_or_default()
            )
        },
    );
    let damping = d.damping_force_max_n;
    judge.at_most(
        Guarantee::ObserverDamping,
        damping,
        most,
        Unit::Newtons,
        || {
            format!(
                "the energy observer damped with up to {damping:.4} N, more than {most:.4}: this force is not the tissue's"
            )
        },
    );
    judge.at_most(Guarantee::Pull, d.pull_max_n, most, Unit::Newtons, || {
        format!(
            "the force pulled the tool into the tissue with up to {:.4} N, more than {most:.4}: skin only pushes; what pulls is \
             damping of the loop or of its energy observer",
            d.pull_max_n
        )
    });
}

fn dip_words(d: &ForceFigures) -> String {
    let percent = 100.0 * d.dip_max.unwrap_or_default();
    let short = 100.0 * d.dip_after_short_max;
    let gap = d.dip_max_after_ms;
    let cause = if gap >= SHORT_GAP {
        format!(
            "after a tick that came {gap:.0} ms after the last, because the machine stood still; with gaps below {SHORT_GAP:.0} ms \
             it fell by up to {short:.0} %"
        )
    } else if gap > 0.0 {
        format!("after a tick that came {gap:.1} ms after the last")
    } else {
        "without a late tick".to_owned()
    };
    format!(
        "the force fell by {percent:.0} % below that of the tissue {cause}; {} such dips, {:.0} % are allowed",
        d.dips,
        100.0 * MOST_DIP
    )
}

/// Judges contact, limits and faults.
fn judge_contact(d: &ForceFigures, judge: &mut Judge) {
    const NO_TOUCH: &str = "the tissue never pressed on the tool at full force";
    let share = |share: f64| (d.touching_ticks > 0).then_some(share);
    judge.if_any(
        Guarantee::Unsolved,
        share(d.unsolved_share),
        MOST_BEHIND,
        Unit::Share,
        NO_TOUCH,
        || {
            format!(
                "in {:.2} % of the ticks in contact the small contact problem was not solved to its tolerance",
                100.0 * d.unsolved_share
            )
        },
    );
    judge.if_any(
        Guarantee::Cut,
        share(d.cut_share),
        MOST_STALE,
        Unit::Share,
        NO_TOUCH,
        || {
            format!(
                "in {:.2} % of the ticks in contact the device's largest force or rate of change, or the largest difference \
                 between two patches, cut the force: it was not that of the tissue; press less deep, or more slowly",
                100.0 * d.cut_share
            )
        },
    );
    judge.if_any(
        Guarantee::Softened,
        share(d.softening_max),
        MOST_SOFTENED,
        Unit::Share,
        NO_TOUCH,
        || {
            format!(
                "the tissue is stiffer than the device renders stably, and was softened by up to {:.0} %: its force is not \
                 felt; press less deep, or use a stiffer device",
                100.0 * d.softening_max
            )
        },
    );
    judge.none(Guarantee::BadPatches, d.bad_patch_ticks, || {
        format!(
            "{} ticks had a patch that could not be used; this is a bug in Palpa",
            d.bad_patch_ticks
        )
    });
    judge.none(Guarantee::OtherFaults, d.other_fault_ticks, || {
        format!(
            "{} ticks had faults of the device, the clock or the contact problem; the list of ticks with faults names them",
            d.other_fault_ticks
        )
    });
}

/// The problems in words. Guarantees that were not judged for the same reason share a line.
pub(super) fn problems(verdicts: &[Verdict]) -> Vec<String> {
    let mut lines: Vec<(String, Vec<&str>)> = Vec::new();
    for verdict in verdicts {
        let Some(problem) = &verdict.problem else {
            continue;
        };
        let name = verdict.guarantee.name();
        match lines.iter_mut().find(|(line, _)| line == problem) {
            Some((_, names)) if verdict.found.is_none() => names.push(name),
            _ if verdict.found.is_none() => lines.push((problem.clone(), vec![name])),
            _ => lines.push((problem.clone(), Vec::new())),
        }
    }
    let line = |(line, names): (String, Vec<&str>)| {
        if names.is_empty() {
            line
        } else {
            format!("{line}. Not judged: {}", names.join("; "))
        }
    };
    lines.into_iter().map(line).collect()
}

/// The verdicts as a table.
pub(super) fn table(verdicts: &[Verdict]) -> Table<4> {
    let mut table = Table::new(["guarantee", "found", "allowed", ""]).with_left_names();
    for verdict in verdicts {
        let name = match verdict.device {
            Some(k) if k > 0 => format!("device {k}: {}", verdict.guarantee.name()),
            _ => verdict.guarantee.name().to_owned(),
        };
        let shown = |x: f64| verdict.unit.shown(x);
        table.push([
            name,
            verdict.found.map_or_else(|| "not judged".to_owned(), shown),
            shown(verdict.allowed),
            if verdict.is_kept { "" } else { "NOT GOOD" }.to_owned(),
        ]);
    }
    table
}

#[cfg(test)]
mod tests;
