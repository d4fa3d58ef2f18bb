//! Settings of an engine, and the errors when it starts.

use crate::{
    threads::{Priority, Wish},
    tissue_thread::TissueParams,
};
use palpa_servo::{MAX_TOOLS, ServoParams};
use std::{io, path::PathBuf};

/// Settings of an engine.
#[derive(Debug, Clone, PartialEq)]
pub struct EngineParams {
    /// Period of the loop, s.
    pub period: f64,
    /// Settings of the law; its period is set to the loop's.
    pub servo: ServoParams,
    /// Settings of the tissue's thread.
    pub tissue: TissueParams,
    /// How long the loop spins before each tick instead of sleeping, s. Spinning reduces lateness
    /// but uses more CPU.
    pub spin: f64,
    /// Whether the engine's time stands still while the loop has no core: for devices without hardware, whose
    /// hand loses nothing by waiting. Lateness and skipped ticks are counted all the same.
    pub time_waits: bool,
    /// Priority and core of the loop's thread, if the system grants them.
    pub servo_wish: Wish,
    /// Priority and core of the tissue's thread.
    pub tissue_wish: Wish,
    /// Priority and core of the background's thread. Its priority is not lower than the others',
    /// because zones that come late hold the tissue back.
    pub background_wish: Wish,
    /// Priority and core of the recorder's thread.
    pub recorder_wish: Wish,
    /// Whether memory is locked in RAM.
    pub lock_memory: bool,
}

impl Default for EngineParams {
    fn default() -> Self {
        Self {
            period: 1e-3,
            servo: ServoParams::default(),
            tissue: TissueParams::default(),
            spin: 0.0,
            time_waits: false,
            servo_wish: Wish {
                priority: Priority::RealTime(80),
                core: None,
            },
            tissue_wish: Wish::NORMAL,
            background_wish: Wish::NORMAL,
            recorder_wish: Wish {
                priority: Priority::Nice(10),
                core: None,
            },
            lock_memory: true,
        }
    }
}

/// Why an engine cannot start.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StartError {
    /// There is no device, or there are more than the law can serve.
    #[error("{found} devices are given; the loop serves 1 to {MAX_TOOLS}")]
    Devices {
        /// Number of devices.
        found: usize,
    },
    /// The period is not a positive time.
    #[error("a period of {period} s; expected more than 0 and at most 0.1 s")]
    Period {
        /// The period, s.
        period: f64,
    },
    /// The log cannot be created.
    #[error("{}: the log cannot be created: {source}", path.display())]
    Log {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: mcap::McapError,
    },
    /// The system cannot start a thread.
    #[error("cannot start a thread: {0}")]
    Thread(#[from] io::Error),
}
