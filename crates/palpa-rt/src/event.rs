//! Events: fixed-size records that cross a ring; the recorder turns them into text.

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
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Happening {
    /// The 1 kHz loop began.
    LoopStarted,
    /// The 1 kHz loop ended after this many ticks.
    LoopStopped(u64),
    /// A device could not be read.
    DeviceLost(u32, &'static str),
    /// A device can be read again; it was away for this many ticks.
    DeviceBack(u32, u64),
    /// A device did not accept its command.
    WriteFailed(u32, &'static str),
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
    StepStatus(u64, &'static str),
    /// The tissue panicked in a step; its thread is gone.
    TissuePanicked(u64),
    /// The tissue was moved on by less time than passed; total difference since the last such
    /// event, s.
    TimeLost(f64),
    /// A background job panicked; the tissue continues without its result.
    JobPanicked,
    /// A fault hook caused a fault on purpose.
    Injected(&'static str),
    /// A ring was full; this many records of this kind were lost.
    RecordsLost(&'static str, u64),
    /// The file could not be written; all later records are lost.
    FileFailed,
}

/// An event with its time.
#[derive(Debug, Clone, Copy, PartialEq)]
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
            | Self::FileFailed => Level::Error,
        }
    }
}

impl fmt::Display for Happening {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LoopStarted => write!(f, "haptic loop started"),
            Self::LoopStopped(n) => write!(f, "haptic loop stopped after {n} ticks"),
            Self::DeviceLost(d, why) => write!(f, "device {d} lost: {why}; its force goes to zero"),
            Self::DeviceBack(d, n) => write!(f, "device {d} is back after {n} ticks"),
            Self::WriteFailed(d, why) => write!(f, "device {d} did not take its force: {why}"),
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
            Self::StepStatus(step, text) => write!(f, "tissue step {step}: {text}"),
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
                write!(f, "a background job panicked; the tissue keeps what it has")
            }
            Self::Injected(what) => write!(f, "fault on purpose: {what}"),
            Self::RecordsLost(kind, n) => write!(f, "ring full: {n} {kind} not recorded"),
            Self::FileFailed => write!(f, "the log file cannot be written; recording ends here"),
        }
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
                what: Happening::RecordsLost("events", self.lost),
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
