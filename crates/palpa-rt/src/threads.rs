//! Scheduling that a thread requests from the system at its start, and the result.

use std::fmt;

/// Scheduling priority of a thread.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Priority {
    /// Real-time, first in, first out: before all ordinary threads; 1 to 99.
    RealTime(u8),
    /// Ordinary.
    Normal,
    /// Ordinary, with a niceness: 1 to 19 is after other threads, -1 to -20 before them.
    Nice(i8),
    /// After all others: it runs while a core has nothing else to do, and makes way at once. Nice 19 does not:
    /// a thread that wakes up beside it may have to wait.
    Idle,
}

/// Scheduling that a thread requests.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wish {
    /// Priority of the thread.
    pub priority: Priority,
    /// The only core on which the thread may run; `None` for any core.
    pub core: Option<usize>,
}

/// The result of a request. A refusal is not an error, since the owner of the machine decides.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Granted {
    /// The thread's name.
    pub thread: &'static str,
    /// The request.
    pub wish: Wish,
    /// Whether the priority was granted, or the reason if not.
    pub priority: Result<(), String>,
    /// Whether the thread is bound to its core, or the reason if not; `Ok` if no core was
    /// requested.
    pub pinned: Result<(), String>,
}

impl Wish {
    /// No special request.
    pub const NORMAL: Self = Self {
        priority: Priority::Normal,
        core: None,
    };

    /// Requests this scheduling for the calling thread.
    pub fn ask(self, thread: &'static str) -> Granted {
        Granted {
            thread,
            wish: self,
            priority: system::schedule(self.priority),
            pinned: self.core.map_or(Ok(()), system::pin),
        }
    }
}

/// Locks the memory of the process in RAM: the present memory and, if the system sets no limit,
/// future allocations too.
///
/// # Errors
/// The system's reason.
pub fn lock_memory() -> Result<(), String> {
    system::lock_memory()
}

impl fmt::Display for Granted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let outcome = |r: &Result<(), String>| match r {
            Ok(()) => "granted".to_owned(),
            Err(why) => format!("refused ({why})"),
        };
        match self.wish.priority {
            Priority::RealTime(p) => write!(f, "{}: real-time priority {p} ", self.thread)?,
            Priority::Normal => write!(f, "{}: ordinary priority ", self.thread)?,
            Priority::Nice(n) => write!(f, "{}: nice {n} ", self.thread)?,
            Priority::Idle => write!(f, "{}: idle-time priority ", self.thread)?,
        }
        write!(f, "{}", outcome(&self.priority))?;
        if let Some(core) = self.wish.core {
            write!(f, ", core {core} {}", outcome(&self.pinned))?;
        }
        Ok(())
    }
}

#[cfg(target_os = "linux")]
mod system {
    use super::Priority;
    use rustix::{
        mm::{MlockAllFlags, mlockall},
        process::{Resource, getrlimit, setpriority_process},
        thread::{CpuSet, gettid, sched_setaffinity, set_current_timer_slack},
    };
    use std::num::NonZeroU64;
    use thread_priority::{
        NormalThreadSchedulePolicy, RealtimeThreadSchedulePolicy, ThreadPriority,
        ThreadPriorityValue, ThreadSchedulePolicy, set_thread_priority_and_policy,
        thread_native_id,
    };

    pub(super) fn schedule(priority: Priority) -> Result<(), String> {
        match priority {
            Priority::RealTime(p) => {
                // Without the privilege for real-time scheduling, this at least lets the sleep of
                // an ordinary thread end on time.
                let _ = set_current_timer_slack(NonZeroU64::new(1));
                let _ = super::slice::shorten();
                let value = ThreadPriorityValue::try_from(p)?;
                let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
                set_thread_priority_and_policy(
                    thread_native_id(),
                    ThreadPriority::Crossplatform(value),
                    policy,
                )
                .map_err(|e| e.to_string())
            }
            Priority::Normal => Ok(()),
            Priority::Idle => set_thread_priority_and_policy(
                thread_native_id(),
                ThreadPriority::Min,
                ThreadSchedulePolicy::Normal(NormalThreadSchedulePolicy::Idle),
            )
            .map_err(|e| e.to_string()),
            // On Linux niceness belongs to a thread, despite the name of the call.
            Priority::Nice(n) => {
                setpriority_process(Some(gettid()), i32::from(n)).map_err(|e| e.to_string())
            }
        }
    }

    pub(super) fn pin(core: usize) -> Result<(), String> {
        if core >= CpuSet::MAX_CPU {
            return Err(format!(
                "core {core} is past the last that the system can name"
            ));
        }
        let mut set = CpuSet::new();
        set.set(core);
        sched_setaffinity(None, &set).map_err(|e| e.to_string())
    }

    pub(super) fn lock_memory() -> Result<(), String> {
        // With a limit, future allocations must not be locked: beyond the limit the allocation
        // itself would fail.
        let is_unlimited = getrlimit(Resource::Memlock).current.is_none();
        let flags = if is_unlimited {
            MlockAllFlags::CURRENT | MlockAllFlags::FUTURE
        } else {
            MlockAllFlags::CURRENT
        };
        mlockall(flags).map_err(|e| e.to_string())
    }
}

/// The time slice of an ordinary thread.
#[cfg(target_os = "linux")]
mod slice {
    use std::io;

    use rustix::{process::getpriority_process, thread::gettid};

    /// A thread that asks for a short slice has its turn soon after it wakes up, ns; the least that the system gives.
    const SHORT: u64 = 100_000;

    /// `struct sched_attr` of the system, in its first version.
    #[repr(C)]
    struct Attributes {
        size: u32,
        policy: u32,
        flags: u64,
        nice: i32,
        priority: u32,
        /// Of an ordinary thread, its slice, ns.
        runtime: u64,
        deadline: u64,
        period: u64,
    }

    /// Asks for a short slice for the calling thread, which stays an ordinary one. It needs no privilege. Beside four
    /// busy threads on two cores, 1 % of wake-ups were 6 ms late without, and 1 ms with it. Before Linux 6.12 it changes
    /// nothing.
    ///
    /// # Errors
    /// The system's reason.
    #[expect(unsafe_code, reason = "no crate offers this call for ordinary threads")]
    pub(super) fn shorten() -> io::Result<()> {
        let attributes = Attributes {
            size: size_of::<Attributes>() as u32,
            policy: 0,
            flags: 0,
            nice: getpriority_process(Some(gettid()))?,
            priority: 0,
            runtime: SHORT,
            deadline: 0,
            period: 0,
        };
        // SAFETY: the call reads as many bytes as `size` says from a struct that lives until it returns, and 0 means the
        // calling thread.
        let result = unsafe { libc::syscall(libc::SYS_sched_setattr, 0, &raw const attributes, 0) };
        if result == 0 {
            Ok(())
        } else {
            Err(io::Error::last_os_error())
        }
    }

    #[cfg(test)]
    mod tests {
        /// The slice that the system notes for a thread, ns, where it does so.
        fn slice() -> Option<u64> {
            let text = std::fs::read_to_string("/proc/thread-self/sched").ok()?;
            let line = text.lines().find(|line| line.starts_with("se.slice"))?;
            line.rsplit(':').next()?.trim().parse().ok()
        }

        #[test]
        fn a_short_slice_needs_no_privilege() {
            std::thread::spawn(|| {
                let before = slice();
                super::shorten().unwrap();
                assert!(slice() <= before);
            })
            .join()
            .unwrap();
        }
    }
}

#[cfg(not(target_os = "linux"))]
mod system {
    use super::Priority;
    use thread_priority::{ThreadPriority, ThreadPriorityValue};

    pub(super) fn schedule(priority: Priority) -> Result<(), String> {
        let wish = match priority {
            Priority::RealTime(p) => {
                ThreadPriority::Crossplatform(ThreadPriorityValue::try_from(p)?)
            }
            Priority::Normal => return Ok(()),
            Priority::Nice(n) if n > 0 => ThreadPriority::Min,
            Priority::Idle => ThreadPriority::Min,
            Priority::Nice(_) => return Ok(()),
        };
        wish.set_for_current().map_err(|e| format!("{e:?}"))
    }

    pub(super) fn pin(_core: usize) -> Result<(), String> {
        Err("not available on this system".to_owned())
    }

    pub(super) fn lock_memory() -> Result<(), String> {
        Err("not available on this system".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wish_that_cannot_be_granted_says_why() {
        let wish = Wish {
            priority: Priority::Normal,
            core: Some(900),
        };
        let granted = std::thread::spawn(move || wish.ask("test")).join().unwrap();
        assert_eq!(granted.priority, Ok(()));
        let why = granted.pinned.clone().unwrap_err();
        assert!(
            granted
                .to_string()
                .contains(&format!("core 900 refused ({why})"))
        );
    }
}
