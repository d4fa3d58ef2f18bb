//! Faults on purpose, as a page asks for them: drills for the engine and its user.

use std::time::{Duration, Instant};

use anyhow::bail;
use palpa_rt::FaultHooks;
use palpa_viewer::control::FaultKind;

/// Length of a pause of the tissue.
const PAUSE: Duration = Duration::from_millis(500);

/// Drills.
#[derive(Debug)]
pub(crate) struct Drills {
    is_allowed: bool,
    /// End of a pause of the tissue, while one lasts.
    paused_until: Option<Instant>,
}

impl Drills {
    /// `is_allowed` says whether pages may ask for faults.
    pub(crate) fn new(is_allowed: bool) -> Self {
        Self {
            is_allowed,
            paused_until: None,
        }
    }

    /// Refuses a fault where none is allowed.
    pub(crate) fn check_allowed(&self) -> anyhow::Result<()> {
        if !self.is_allowed {
            bail!("faults on purpose are not allowed here; start with --allow-faults");
        }
        Ok(())
    }

    /// Causes a fault.
    pub(crate) fn inject(&mut self, fault: FaultKind, engine: &FaultHooks, now: Instant) {
        match fault {
            FaultKind::TissuePanic => engine.panic_tissue(),
            FaultKind::SpoiltPatch => engine.spoil_patches(1),
            FaultKind::TissuePause => {
                engine.pause_tissue(true);
                self.paused_until = Some(now + PAUSE);
            }
        }
    }

    /// Ends a pause that is over. The engine may have been started anew meanwhile, or be gone.
    pub(crate) fn advance(&mut self, engine: Option<&FaultHooks>, now: Instant) {
        if self.paused_until.is_some_and(|until| now >= until) {
            self.paused_until = None;
            if let Some(engine) = engine {
                engine.pause_tissue(false);
            }
        }
    }
}
