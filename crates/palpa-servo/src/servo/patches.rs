//! Arrival of patches: which are usable, how a new patch takes over without a jump, and when a
//! patch is stale.

use super::Servo;
use crate::solver::ToolLoad;
use crate::{ContactPatch, Faults, Limits, MAX_CONTACTS, MAX_TOOLS, TickReport, Vec3};

/// Largest plausible values of a patch, m, m/N and N; a patch with larger values is not usable.
const MAX_LENGTH: f64 = 1e3;
const MAX_COMPLIANCE: f64 = 1e5;
const MAX_LOAD: f64 = 1e4;

/// The patch that forces come from.
#[derive(Debug, Clone, Copy)]
pub(super) enum PatchUse {
    /// There is no patch, or it cannot be used. The tools move freely.
    Unusable,
    Used {
        /// Time of arrival on the loop's clock, s.
        arrived_at: f64,
        /// Time to the next patch, s: declared by the tissue or measured.
        period: f64,
    },
}

impl PatchUse {
    pub(super) fn is_used(self) -> bool {
        matches!(self, Self::Used { .. })
    }

    /// The state after `patch` arrives at `now`, s, in a loop with the period `loop_period`, s.
    fn followed_by(self, patch: &ContactPatch, now: f64, loop_period: f64) -> Self {
        if !is_usable(patch) {
            return Self::Unusable;
        }
        let declared = if patch.period.is_finite() {
            patch.period
        } else {
            0.0
        };
        let period = match self {
            Self::Used { arrived_at, .. } => (now - arrived_at).max(declared),
            Self::Unusable => declared,
        };
        Self::Used {
            arrived_at: now,
            period: period.clamp(2.0 * loop_period, (2.0 * loop_period).max(0.1)),
        }
    }
}

impl Servo {
    /// Takes over a new patch without a jump: the transfer bridges the difference in force at the
    /// same poses.
    pub(super) fn change_patch(
        &mut self,
        now: f64,
        patch: &ContactPatch,
        before: &[ToolLoad; MAX_TOOLS],
        report: &mut TickReport,
    ) -> [ToolLoad; MAX_TOOLS] {
        report.is_new_patch = true;
        let was_used = self.patch.is_used();
        self.patch = self.patch.followed_by(patch, now, self.params.period);
        let PatchUse::Used { period, .. } = self.patch else {
            self.solver.clear();
            return [ToolLoad::ZERO; MAX_TOOLS];
        };
        let poses = self.poses();
        self.solver.adopt(patch, &poses);
        if !was_used {
            self.solver.release_anchors(patch, &poses);
        }
        let loads = self.evaluate(patch, 2, report);
        let (most, time) = (
            self.params.max_transfer,
            self.params.transfer_periods * period,
        );
        for (t, ((tool, old), new)) in (self.tools.iter_mut()).zip(before).zip(&loads).enumerate() {
            let jump = tool.book_patch(old, new, was_used);
            if let Some(tool_report) = report.tools.get_mut(t) {
                tool_report.jump = jump;
            }
            tool.coupling.calibrate(patch.tools.get(t), new);
            tool.coupling.ahead = self.solver.nearest_compliance(patch, t, &tool.hand.pose);
            if !was_used {
                continue;
            }
            let spec = tool.spec();
            if tool.transfer.bridge(old, new, &spec, most, time)
                && let Some(tool_report) = report.tools.get_mut(t)
            {
                tool_report.limits |= Limits::TRANSFER;
            }
        }
        loads
    }

    /// Sets the faults of a patch that is missing, not usable or stale, and its age.
    pub(super) fn check_age(&self, now: f64, patch: &ContactPatch, report: &mut TickReport) {
        report.patch_id = patch.id;
        if patch.id == 0 {
            report.faults |= Faults::NO_PATCH;
            return;
        }
        let PatchUse::Used { arrived_at, period } = self.patch else {
            report.faults |= Faults::BAD_PATCH;
            return;
        };
        let sampled = if patch.sampled_at <= now {
            patch.sampled_at
        } else {
            arrived_at
        };
        report.patch_age = now - sampled;
        let limit = (self.params.stale_periods * period).max(self.params.stale_after);
        // The age counts from the arrival too: a patch may be old when it arrives, but its arrival
        // shows that the tissue still runs.
        if now - arrived_at > limit || report.patch_age > 4.0 * limit {
            report.faults |= Faults::STALE_PATCH;
        }
    }
}

/// Whether the numbers of a patch are finite and plausible for a contact.
fn is_usable(patch: &ContactPatch) -> bool {
    if patch.id == 0 || patch.n_contacts > MAX_CONTACTS || patch.n_tools > MAX_TOOLS {
        return false;
    }
    if !patch.sampled_at.is_finite() {
        return false;
    }
    let short = |v: &Vec3| v.iter().all(|x| x.abs() < MAX_LENGTH);
    let tools_are =
        (patch.tools.iter().take(patch.n_tools)).all(|tool| (0.0..10.0).contains(&tool.friction));
    let candidates_are = patch.contacts.iter().take(patch.n_contacts).all(|c| {
        short(&c.position)
            && short(&c.surface)
            && short(&c.anchor)
            && (c.normal.norm_squared() - 1.0).abs() < 1e-3
            && c.curvature.iter().all(|x| x.abs() < 1e5)
            && c.force.iter().all(|x| x.abs() < MAX_LOAD)
    });
    let used = 3 * patch.n_contacts;
    // Not `all`: its early exit at every entry would prevent vector instructions.
    let compliance_is = (patch.compliance.chunks_exact(ContactPatch::STRIDE))
        .take(used)
        .map(|column| {
            (column.iter().take(used)).fold(true, |good, w| good & (w.abs() < MAX_COMPLIANCE))
        })
        .fold(true, |good, column| good & column);
    tools_are && candidates_are && compliance_is
}
