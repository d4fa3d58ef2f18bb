//! The engine's figures and events: kinds and numbers. Pages have words for each kind in each of
//! their languages.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{NoticeLevel, Vec3};

/// Figures of the engine.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct EngineFigures {
    /// Time since the engine's start, s.
    pub seconds: f64,
    /// Steps of the tissue per second, since the last figures.
    pub tissue_rate: f64,
    /// Ticks of the 1 kHz loop per second, since the last figures.
    pub tick_rate: f64,
    /// Missed deadlines: ticks that were skipped since the start.
    pub missed: u64,
    /// CPU time of a tick, s: median, 99.9th percentile, maximum.
    pub tick_cpu: [f64; 3],
    /// Lateness of ticks, s: median, 99.9th percentile, maximum.
    pub lateness: [f64; 3],
    /// CPU time of the tissue's steps, s: median, 99.9th percentile, maximum.
    pub step_cpu: [f64; 3],
    /// Histogram of the CPU time of ticks: lower bound (s), upper bound (s), count.
    pub tick_histogram: Vec<(f64, f64, u64)>,
    /// Age of the contact patch in use, s: time since its pose was read.
    pub latency: f64,
    /// Number of nodes of the body.
    pub n_nodes: u32,
    /// Meshes taken up since the start.
    pub n_meshes: u64,
    /// The force limits that were reached since the last figures.
    pub limits: Vec<ForceLimit>,
    /// The faults since the last figures.
    pub faults: Vec<LawFault>,
    /// Energy taken from the hand since the start, J.
    pub energy_in: f64,
    /// Energy given to the hand since the start, J.
    pub energy_out: f64,
    /// Energy that the loop gave to the hand and that neither the hand's work nor the tissue's stored
    /// energy paid for, J: the largest since the last figures. This is the quantity that the energy
    /// observer bounds: the negative of its bank.
    pub energy_unpaid: f64,
    /// Bound on `energy_unpaid`, J. From 60 % of it the loop damps the hand gently, and beyond it as
    /// much as the device can.
    pub energy_budget: f64,
    /// The largest damping that the energy observer injected since the last figures, N s/m.
    pub damping: f64,
    /// Result of the tissue's last step.
    pub step_status: StepResult,
    /// Priorities and cores that the system granted to the threads.
    pub granted: Vec<GrantedInfo>,
    /// The latest events, newest last.
    pub events: Vec<EventInfo>,
    /// Snapshots per second, since the last figures.
    pub snapshot_rate: f64,
    /// The error bar of the force where the tool presses.
    pub error_bar: ErrorBar,
}

/// Amplitude spectrum of the commanded force over about the last second. Each axis is transformed for
/// itself, without its mean and with Hann's window; an amplitude is the norm over the three axes. A
/// vibration of 10 mN along an axis has the amplitude 10 mN.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Spectrum {
    /// Time of the newest tick in it, s since the engine's start.
    pub time: f64,
    /// Distance between two frequencies, Hz.
    pub step: f64,
    /// Amplitudes at 0, `step`, 2 `step`, … up to half the rate of the loop, N.
    pub amplitude: Vec<f64>,
}

/// How far the force may be from that of an infinitely fine mesh of the same body, where the tool
/// presses. Lengths in m, forces in N.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum ErrorBar {
    /// The tool does not press, or error bars are not computed: during a game, and in the reference
    /// method.
    #[default]
    None,
    /// No error bar of this place and depth is known yet.
    Unknown,
    /// The error bar was computed here, or near enough.
    Known {
        /// Half the width of the bar, as a share of the force.
        half_width: f64,
        /// Force of the static press at that place and depth on the same mesh.
        force: f64,
        /// That force, extrapolated to an infinitely fine mesh; `None` if few vertices touch or the bar
        /// is wide.
        extrapolated: Option<f64>,
        /// Depth at which the bar was computed.
        depth: f64,
        /// The place of the skin, at rest, at which it was computed.
        point: Vec3,
        /// Relative change of the force when prisms near the tool are made finer.
        near: f64,
        /// The same for triangles of the skin around them.
        skin_far: f64,
        /// The same for deep intervals between levels.
        levels_deep: f64,
        /// What finer meshes of the same few vertices in contact with a round tool do not show, as a
        /// share of the force.
        contact: f64,
    },
    /// There is no error bar at this place and depth.
    Failed {
        /// The reason.
        why: BarProblem,
        /// Depth at which it was tried.
        depth: f64,
    },
}

/// Why there is no error bar.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum BarProblem {
    /// The mesh has too many nodes to be probed beside the loop.
    TooLarge {
        /// Number of its nodes.
        n_nodes: u32,
    },
    /// In a static press, the tool would not touch the skin there.
    NotTouching,
    /// The static press or a probe found no equilibrium.
    NoEquilibrium,
    /// Another reason.
    Other {
        /// The reason, in English.
        text: String,
    },
}

/// A limit that a force met.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ForceLimit {
    /// Largest force of the device.
    Force,
    /// Largest moment of the device.
    Torque,
    /// Largest rate of change of the force.
    Slew,
    /// The ramp held the force back.
    Ramp,
    /// The energy observer injected damping.
    Energy,
    /// The coupling softened a contact that is too stiff for the device.
    Stiffness,
    /// The difference in force to a new patch was larger than the transfer bridges.
    Transfer,
    /// The sweeps ended before the tolerance was met.
    Sweeps,
}

/// A reason why the force is ramped to zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LawFault {
    /// There was no patch yet.
    NoPatch,
    /// The newest patch is too old.
    StalePatch,
    /// The newest patch holds values that cannot be a contact.
    BadPatch,
    /// The time since the last tick was too long.
    MissedDeadline,
    /// The clock went back, stood still, or was not a number.
    BadClock,
    /// A device gave no reading.
    DeviceLost,
    /// A device gave a reading that is not a number.
    BadReading,
    /// A device repeats the same reading.
    DeviceStalled,
    /// A position jumped faster than a hand can move.
    DeviceJumped,
    /// The contact problem gave no finite force.
    NoSolution,
}

/// Result of a step of the tissue.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StepResult {
    /// The step converged within its tolerance.
    #[default]
    Converged,
    /// The residual is above the tolerance, but the state is usable.
    Unfinished,
    /// The step did not reach the poses of the tools.
    Behind,
    /// The forces are not fit to be felt yet; the last patch serves on.
    Settling,
    /// There is no usable state; the last patch serves on.
    Failed,
}

/// Scheduling that a thread requested, and the system's answer.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct GrantedInfo {
    /// Name of the thread.
    pub thread: String,
    /// The requested priority.
    pub priority: PriorityInfo,
    /// The system's reason for refusing the priority; null if it was granted.
    pub priority_refused: Option<String>,
    /// The requested core; null for any core.
    pub core: Option<u32>,
    /// The system's reason for refusing the core; null if it was granted.
    pub core_refused: Option<String>,
}

/// Scheduling priority of a thread.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum PriorityInfo {
    /// Real-time, before all ordinary threads.
    RealTime {
        /// 1 to 99; a larger number goes first.
        priority: u8,
    },
    /// Ordinary.
    Normal,
    /// Ordinary, with a niceness.
    Nice {
        /// 1 to 19 is after other threads, -1 to -20 before them.
        niceness: i8,
    },
    /// After all others, in idle time.
    Idle,
}

/// An entry of the engine's log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EventInfo {
    /// Time since the engine's start, s.
    pub time: f64,
    /// Severity.
    pub level: NoticeLevel,
    /// The event.
    pub what: EventKind,
}

/// What happened in the engine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum EventKind {
    /// The 1 kHz loop began.
    LoopStarted,
    /// The 1 kHz loop ended.
    LoopStopped {
        /// Ticks that it did.
        ticks: u64,
    },
    /// A device could not be read; its force goes to zero.
    DeviceLost {
        /// Number of the device.
        device: u32,
        /// The reason.
        why: DeviceTrouble,
    },
    /// A device can be read again.
    DeviceBack {
        /// Number of the device.
        device: u32,
        /// Ticks for which it was away.
        ticks: u64,
    },
    /// A device did not accept its force.
    WriteFailed {
        /// Number of the device.
        device: u32,
        /// The reason.
        why: DeviceTrouble,
    },
    /// Ticks were skipped because one took too long.
    DeadlineMissed {
        /// Number of ticks skipped since the last such event.
        skipped: u64,
        /// Longest time between two ticks since the last such event, s.
        longest: f64,
    },
    /// The law's faults changed.
    LawFaults {
        /// The present faults; empty when they are over.
        faults: Vec<LawFault>,
    },
    /// The tissue thread began.
    TissueStarted,
    /// The tissue thread ended.
    TissueStopped {
        /// Steps that it did.
        steps: u64,
    },
    /// The status of the tissue's steps changed.
    StepStatus {
        /// Number of the step.
        step: u64,
        /// The new status.
        status: StepResult,
    },
    /// The tissue panicked; its thread is gone and the force goes to zero.
    TissuePanicked {
        /// Number of the step.
        step: u64,
    },
    /// The tissue was moved on by less time than passed.
    TimeLost {
        /// Total difference since the last such event, s.
        seconds: f64,
    },
    /// A background job panicked; the tissue continues without its result and requests another one
    /// after some steps.
    JobPanicked,
    /// A fault was caused on purpose.
    Injected {
        /// The fault.
        fault: InjectedFault,
    },
    /// A ring was full, and records were lost.
    RecordsLost {
        /// What was lost.
        records: LostRecords,
        /// Number of records.
        n: u64,
    },
    /// The log file could not be written; the recording ends.
    FileFailed {
        /// The system's reason.
        reason: String,
    },
}

/// Why a device did not deliver a reading or accept a force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DeviceTrouble {
    /// The device is not connected.
    Unplugged,
    /// The device did not answer in time.
    TimedOut,
    /// The answer of the device makes no sense.
    Garbled,
    /// Another reason.
    Unusable,
}

/// A fault that was caused on purpose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum InjectedFault {
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

/// Records that were lost because a ring was full.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LostRecords {
    /// Ticks of the 1 kHz loop.
    Ticks,
    /// Steps of the tissue.
    Steps,
    /// Events.
    Events,
}
