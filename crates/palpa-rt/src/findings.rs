//! Results of the recorder so far, readable from any thread.
#![expect(
    clippy::disallowed_types,
    reason = "shared by the recorder and those who ask it; no thread of the 1 kHz path knows of it"
)]

use crate::{event::Event, late::LateTicks, smoothness::ForceReport};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Results of the recorder.
#[derive(Debug, Default)]
pub(crate) struct Findings {
    pub(crate) forces: Vec<ForceReport>,
    pub(crate) events: Vec<Event>,
    pub(crate) has_file_failed: bool,
    pub(crate) late: LateTicks,
}

/// Shared storage of the findings.
#[derive(Debug, Clone, Default)]
pub(crate) struct Board(Arc<Mutex<Findings>>);

impl Board {
    /// Ignores poisoning: a thread that panicked with the lock left only complete values behind.
    pub(crate) fn lock(&self) -> MutexGuard<'_, Findings> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
