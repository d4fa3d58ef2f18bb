//! The engine's events, faults and limits as pages receive them.

use palpa_device::DeviceFault;
use palpa_rt::{Granted, Happening, Injection, Priority, RecordKind, StepStatus};
use palpa_servo::{Faults, Limits};
use palpa_viewer::control::{
    DeviceTrouble, EventKind, ForceLimit, GrantedInfo, InjectedFault, LawFault, LostRecords,
    PriorityInfo, StepResult,
};

const LIMITS: [(Limits, ForceLimit); 8] = [
    (Limits::FORCE, ForceLimit::Force),
    (Limits::TORQUE, ForceLimit::Torque),
    (Limits::SLEW, ForceLimit::Slew),
    (Limits::RAMP, ForceLimit::Ramp),
    (Limits::ENERGY, ForceLimit::Energy),
    (Limits::STIFFNESS, ForceLimit::Stiffness),
    (Limits::TRANSFER, ForceLimit::Transfer),
    (Limits::SWEEPS, ForceLimit::Sweeps),
];

const FAULTS: [(Faults, LawFault); 10] = [
    (Faults::NO_PATCH, LawFault::NoPatch),
    (Faults::STALE_PATCH, LawFault::StalePatch),
    (Faults::BAD_PATCH, LawFault::BadPatch),
    (Faults::MISSED_DEADLINE, LawFault::MissedDeadline),
    (Faults::BAD_CLOCK, LawFault::BadClock),
    (Faults::DEVICE_LOST, LawFault::DeviceLost),
    (Faults::BAD_READING, LawFault::BadReading),
    (Faults::DEVICE_STALLED, LawFault::DeviceStalled),
    (Faults::DEVICE_JUMPED, LawFault::DeviceJumped),
    (Faults::NO_SOLUTION, LawFault::NoSolution),
];

/// The limits of a set, in their order.
pub(crate) fn limits(set: Limits) -> Vec<ForceLimit> {
    let met = LIMITS.iter().filter(|(flag, _)| set.contains(*flag));
    met.map(|(_, limit)| *limit).collect()
}

/// The faults of a set, in their order.
pub(crate) fn faults(set: Faults) -> Vec<LawFault> {
    let present = FAULTS.iter().filter(|(flag, _)| set.contains(*flag));
    present.map(|(_, fault)| *fault).collect()
}

/// The status of a step, as its record has it.
pub(crate) fn recorded(status: u8) -> StepResult {
    let all = [
        StepStatus::Converged,
        StepStatus::Unfinished,
        StepStatus::Behind,
        StepStatus::Settling,
        StepStatus::Failed,
    ];
    let known = all.into_iter().find(|known| *known as u8 == status);
    // The engine records no other status.
    known.map_or(StepResult::Failed, step)
}

fn step(status: StepStatus) -> StepResult {
    match status {
        StepStatus::Converged => StepResult::Converged,
        StepStatus::Unfinished => StepResult::Unfinished,
        StepStatus::Behind => StepResult::Behind,
        StepStatus::Settling => StepResult::Settling,
        StepStatus::Failed => StepResult::Failed,
    }
}

/// What the system granted to a thread.
pub(crate) fn granted(granted: &Granted) -> GrantedInfo {
    GrantedInfo {
        thread: granted.thread.to_owned(),
        priority: match granted.wish.priority {
            Priority::RealTime(priority) => PriorityInfo::RealTime { priority },
            Priority::Normal => PriorityInfo::Normal,
            Priority::Nice(niceness) => PriorityInfo::Nice { niceness },
            Priority::Idle => PriorityInfo::Idle,
        },
        priority_refused: granted.priority.clone().err(),
        core: granted.wish.core.map(|core| core as u32),
        core_refused: granted.pinned.clone().err(),
    }
}

/// An event of the engine.
pub(crate) fn shown(what: &Happening) -> EventKind {
    match *what {
        Happening::LoopStarted => EventKind::LoopStarted,
        Happening::LoopStopped(ticks) => EventKind::LoopStopped { ticks },
        Happening::DeviceLost(device, fault) => EventKind::DeviceLost {
            device,
            why: trouble(fault),
        },
        Happening::DeviceBack(device, ticks) => EventKind::DeviceBack { device, ticks },
        Happening::WriteFailed(device, fault) => EventKind::WriteFailed {
            device,
            why: trouble(fault),
        },
        Happening::DeadlineMissed { skipped, longest } => {
            EventKind::DeadlineMissed { skipped, longest }
        }
        Happening::LawFaults(set) => EventKind::LawFaults {
            faults: faults(set),
        },
        Happening::TissueStarted => EventKind::TissueStarted,
        Happening::TissueStopped(steps) => EventKind::TissueStopped { steps },
        Happening::StepStatus(number, status) => EventKind::StepStatus {
            step: number,
            status: step(status),
        },
        Happening::TissuePanicked(step) => EventKind::TissuePanicked { step },
        Happening::TimeLost(seconds) => EventKind::TimeLost { seconds },
        Happening::JobPanicked => EventKind::JobPanicked,
        Happening::Injected(injection) => EventKind::Injected {
            fault: injected(injection),
        },
        Happening::RecordsLost(kind, n) => EventKind::RecordsLost {
            records: lost(kind),
            n,
        },
        Happening::FileFailed(ref reason) => EventKind::FileFailed {
            reason: reason.clone(),
        },
    }
}

fn trouble(fault: DeviceFault) -> DeviceTrouble {
    match fault {
        DeviceFault::Unplugged => DeviceTrouble::Unplugged,
        DeviceFault::TimedOut => DeviceTrouble::TimedOut,
        DeviceFault::Garbled => DeviceTrouble::Garbled,
        _ => DeviceTrouble::Unusable,
    }
}

fn injected(injection: Injection) -> InjectedFault {
    match injection {
        Injection::TissuePanics => InjectedFault::TissuePanics,
        Injection::JobPanics => InjectedFault::JobPanics,
        Injection::PatchWithNan => InjectedFault::PatchWithNan,
        Injection::PatchLate => InjectedFault::PatchLate,
        Injection::TissuePauses => InjectedFault::TissuePauses,
        Injection::TissueGoesOn => InjectedFault::TissueGoesOn,
        Injection::LoopLate => InjectedFault::LoopLate,
    }
}

fn lost(kind: RecordKind) -> LostRecords {
    match kind {
        RecordKind::Ticks => LostRecords::Ticks,
        RecordKind::Steps => LostRecords::Steps,
        RecordKind::Events => LostRecords::Events,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_limit_and_fault_of_the_law_is_shown() {
        let limits = LIMITS
            .iter()
            .fold(Limits::NONE, |all, (flag, _)| all | *flag);
        assert_eq!(limits, Limits::from_bits(u16::MAX));
        let faults = FAULTS
            .iter()
            .fold(Faults::NONE, |all, (flag, _)| all | *flag);
        assert_eq!(faults, Faults::from_bits(u16::MAX));
    }

    #[test]
    fn a_recorded_status_is_the_one_of_the_step() {
        for (status, shown) in [
            (StepStatus::Converged, StepResult::Converged),
            (StepStatus::Behind, StepResult::Behind),
            (StepStatus::Failed, StepResult::Failed),
        ] {
            assert_eq!(recorded(status as u8), shown);
        }
    }

    #[test]
    fn an_event_is_shown_by_its_kind_and_numbers() {
        let faults = Faults::STALE_PATCH | Faults::DEVICE_LOST;
        let shown = serde_json::to_value(shown(&Happening::LawFaults(faults))).unwrap();
        let wanted = serde_json::json!({
            "kind": "law_faults",
            "faults": ["stale_patch", "device_lost"],
        });
        assert_eq!(shown, wanted);
    }
}
