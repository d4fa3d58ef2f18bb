//! Patches come in: which are usable, how one takes over from another without a jump, and when one
//! is stale.

use super::Servo;
use crate::solver::ToolLoad;
use crate::{ContactPatch, Faults, Limits, MAX_CONTACTS, MAX_TOOLS, TickReport, Vec3};

/// A patch with larger values than these is no contact, m and m/N and N.
const MAX_LENGTH: f64 = 1e3;
const MAX_COMPLIANCE: f64 = 1e2;
const MAX_LOAD: f64 = 1e4;

/// The patch that forces come from.
#[derive(Debug, Clone, Copy)]
pub(super) enum PatchUse {
    /// There is none, or it cannot be used: tools are free.
    Unusable,
    Used {
        /// s, on the loop's clock
        arrived_at: f64,
        /// Time to the next patch, s: as the tissue declares it or as it was measured.
        period: f64,
    },
}

impl PatchUse {
    pub(super) fn is_used(self) -> bool {
        matches!(self, Self::Used { .. })
    }

    /// What a patch that arrives at `now`, s, makes of it, in a loop with this period, s.
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
    /// Takes a new patch over without a jump: its difference at the same poses is bridged.
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
        self.solver.adopt(patch);
        if !was_used {
            let poses = self.poses();
            self.solver.release_anchors(patch, &poses);
        }
        let loads = self.evaluate(patch, 2, report);
        let (most, time) = (
            self.params.max_transfer,
            self.params.transfer_periods * period,
        );
        for (t, ((tool, old), new)) in (self.tools.iter_mut()).zip(before).zip(&loads).enumerate() {
            tool.restart_store(new);
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
        // By its arrival too: a patch that is late on arrival is no use, but its coming shows that
        // the tissue lives.
        if now - arrived_at > limit || report.patch_age > 4.0 * limit {
            report.faults |= Faults::STALE_PATCH;
        }
    }
}

/// Whether a patch holds numbers that can be a contact.
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
    // Not `all`, which would stop the vector unit at every entry.
    let compliance_is = (patch.compliance.chunks_exact(ContactPatch::STRIDE))
        .take(used)
        .map(|column| {
            (column.iter().take(used)).fold(true, |good, w| good & (w.abs() < MAX_COMPLIANCE))
        })
        .fold(true, |good, column| good & column);
    tools_are && candidates_are && compliance_is
}
