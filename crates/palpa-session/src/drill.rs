//! Faults that a page causes on purpose, to test the engine and train its user.

use std::time::{Duration, Instant};

use anyhow::bail;
use palpa_rt::FaultHooks;
use palpa_viewer::control::FaultKind;

/// Duration of a pause of the tissue.
const PAUSE: Duration = Duration::from_millis(500);

/// Causes faults on purpose.
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

    /// Refuses a fault if faults are not allowed.
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

    /// Ends a pause when its time is over. The engine may have been restarted meanwhile, or have
    /// ended.
    pub(crate) fn advance(&mut self, engine: Option<&FaultHooks>, now: Instant) {
        if self.paused_until.is_some_and(|until| now >= until) {
            self.paused_until = None;
            if let Some(engine) = engine {
                engine.pause_tissue(false);
            }
        }
    }
}
