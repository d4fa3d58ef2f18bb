//! Events: typed records that cross a ring. A report has them as they are; a log has their words.

use crate::tissue::StepStatus;
use palpa_device::DeviceFault;
use palpa_servo::Faults;
use rtrb::Producer;
use std::fmt;

/// Severity of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Worth knowing.
    Info,
    /// Forces may be worse than they should be.
    Warning,
    /// Forces are zero, or data is lost.
    Error,
}

/// The kinds of events.
///
/// `Display` has the words of log files and of the command. The viewer's page has its own words: to
/// add a kind, also add it to `palpa_viewer::control::EventKind`, and its words to
/// `web/src/i18n/events.ts`. The page does not compile without them.
#[derive(Debug, Clone, PartialEq)]
pub enum Happening {
    /// The 1 kHz loop began.
    LoopStarted,
    /// The 1 kHz loop ended after this many ticks.
    LoopStopped(u64),
    /// A device could not be read.
    DeviceLost(u32, DeviceFault),
    /// A device can be read again; it was away for this many ticks.
    DeviceBack(u32, u64),
    /// A device did not accept its command.
    WriteFailed(u32, DeviceFault),
    /// Ticks were skipped because one took too long.
    DeadlineMissed {
        /// Number of ticks skipped since the last such event.
        skipped: u64,
        /// Longest time between two ticks since the last such event, s.
        longest: f64,
    },
    /// The law's faults changed; empty when they are over.
    LawFaults(Faults),
    /// The tissue thread began.
    TissueStarted,
    /// The tissue thread ended after this many steps.
    TissueStopped(u64),
    /// The status of the tissue's steps changed: step number and new status.
    StepStatus(u64, StepStatus),
    /// The tissue panicked in a step; its thread is gone.
    TissuePanicked(u64),
    /// The tissue was moved on by less time than passed; total difference since the last such
    /// event, s.
    TimeLost(f64),
    /// A background job panicked; the tissue continues without its result and requests another one
    /// after some steps.
    JobPanicked,
    /// A fault hook caused a fault on purpose.
    Injected(Injection),
    /// A ring was full; this many records of this kind were lost.
    RecordsLost(RecordKind, u64),
    /// The file could not be written, for this reason; all later records are lost. Only the
    /// recorder makes this event: a real-time thread must not allocate.
    FileFailed(String),
}

/// The faults that a fault hook causes on purpose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Injection {
    /// The tissue panics.
    TissuePanics,
    /// A background job panics.
    JobPanics,
    /// A patch has a force that is not a number.
    PatchWithNan,
    /// The tissue's patch is late.
    PatchLate,
    /// The tissue pauses.
    TissuePauses,
    /// The pause of the tissue is over.
    TissueGoesOn,
    /// The 1 kHz loop wakes up late.
    LoopLate,
}

/// The records that a ring may lose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RecordKind {
    /// Ticks of the 1 kHz loop.
    Ticks,
    /// Steps of the tissue.
    Steps,
    /// Events.
    Events,
}

/// An event with its time.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// Time, s.
    pub time: f64,
    /// The event.
    pub what: Happening,
}

impl Happening {
    /// Severity of the event.
    pub fn level(&self) -> Level {
        match self {
            Self::LoopStarted
            | Self::LoopStopped(_)
            | Self::DeviceBack(..)
            | Self::TissueStarted
            | Self::TissueStopped(_)
            | Self::Injected(_) => Level::Info,
            Self::DeadlineMissed { .. }
            | Self::StepStatus(..)
            | Self::TimeLost(_)
            | Self::LawFaults(..) => Level::Warning,
            Self::DeviceLost(..)
            | Self::WriteFailed(..)
            | Self::TissuePanicked(_)
            | Self::JobPanicked
            | Self::RecordsLost(..)
            | Self::FileFailed(_) => Level::Error,
        }
    }
}

impl fmt::Display for Happening {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LoopStarted => write!(f, "haptic loop started"),
            Self::LoopStopped(n) => write!(f, "haptic loop stopped after {n} ticks"),
            Self::DeviceLost(d, why) => {
                write!(
                    f,
                    "device {d} lost: {}; its force goes to zero",
                    reason(*why)
                )
            }
            Self::DeviceBack(d, n) => write!(f, "device {d} is back after {n} ticks"),
            Self::WriteFailed(d, why) => {
                write!(f, "device {d} did not take its force: {}", reason(*why))
            }
            Self::DeadlineMissed { skipped, longest } => {
                write!(
                    f,
                    "{skipped} ticks left out, longest gap {:.1} ms",
                    longest * 1e3
                )
            }
            Self::LawFaults(Faults::NONE) => write!(f, "law: no fault any more, forces come back"),
            Self::LawFaults(faults) => {
                write!(f, "law: forces go to zero:")?;
                let mut separator = " ";
                let mut result = Ok(());
                faults.for_each_name(|name| {
                    result = result.and_then(|()| write!(f, "{separator}{name}"));
                    separator = ", ";
                });
                result
            }
            Self::TissueStarted => write!(f, "tissue started"),
            Self::TissueStopped(n) => write!(f, "tissue stopped after {n} steps"),
            Self::StepStatus(step, status) => write!(f, "tissue step {step}: {}", status.name()),
            Self::TissuePanicked(step) => {
                write!(
                    f,
                    "tissue panicked in step {step} and is gone; forces go to zero, restart the engine"
                )
            }
            Self::TimeLost(s) => write!(
                f,
                "tissue: {:.1} ms of time lost to the cap on its step",
                s * 1e3
            ),
            Self::JobPanicked => {
                write!(
                    f,
                    "a background job panicked; the tissue keeps its zone and mesh, and requests another job after some steps"
                )
            }
            Self::Injected(what) => write!(f, "fault on purpose: {what}"),
            Self::RecordsLost(kind, n) => write!(f, "ring full: {n} {kind} not recorded"),
            Self::FileFailed(why) => {
                write!(
                    f,
                    "the log file cannot be written; recording ends here ({why})"
                )
            }
        }
    }
}

fn reason(fault: DeviceFault) -> &'static str {
    match fault {
        DeviceFault::Unplugged => "not connected",
        DeviceFault::TimedOut => "no answer in time",
        DeviceFault::Garbled => "its answer cannot be understood",
        _ => "not usable",
    }
}

impl fmt::Display for Injection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::TissuePanics => "the tissue panics",
            Self::JobPanics => "a background job panics",
            Self::PatchWithNan => "a patch with NaN",
            Self::PatchLate => "the tissue's patch is late",
            Self::TissuePauses => "the tissue pauses",
            Self::TissueGoesOn => "the tissue goes on",
            Self::LoopLate => "the loop wakes up late",
        })
    }
}

impl fmt::Display for RecordKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Ticks => "ticks",
            Self::Steps => "tissue steps",
            Self::Events => "events",
        })
    }
}

/// The sending end of one thread's events.
#[derive(Debug)]
pub(crate) struct Speaker {
    ring: Producer<Event>,
    lost: u64,
}

impl Speaker {
    pub(crate) fn new(ring: Producer<Event>) -> Self {
        Self { ring, lost: 0 }
    }

    /// Sends an event. If the ring is full, counts the event as lost and reports the number as soon
    /// as there is room.
    #[inline]
    pub(crate) fn say(&mut self, time: f64, what: Happening) {
        if self.lost > 0 {
            let lost = Event {
                time,
                what: Happening::RecordsLost(RecordKind::Events, self.lost),
            };
            if self.ring.push(lost).is_ok() {
                self.lost = 0;
            }
        }
        if self.ring.push(Event { time, what }).is_err() {
            self.lost += 1;
        }
    }
}
