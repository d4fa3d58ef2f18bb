//! The zone's stiffness and factor. Where the body is not stable without its tools, springs hold
//! the vertices under them. The contact problem removes the forces of the springs again.

use super::super::plan::Trouble;
use super::Live;
use super::report::LiveReport;
use crate::batch::Pressure;

/// First stiffness of the springs, relative to the skin's own stiffness; growth factor; largest
/// value. The contact problem takes their forces out again, so stiff ones cost no accuracy, and with soft
/// ones a second factor may still not be positive definite.
const FIRST: f64 = 1.0;
const GROWTH: f64 = 3.0;
const MOST: f64 = 10.0;
/// Least and largest number of iterations before softer springs are tried. The number doubles each
/// time that softer springs fail.
const PATIENCE: [u32; 2] = [2, 32];

/// Springs along the normals of pressing vertices.
#[derive(Debug)]
pub(super) struct Springs {
    /// Stiffness of each spring relative to the skin's own; 0 for no springs.
    share: f64,
    /// Iterations since the last change of `share`.
    age: u32,
    /// Iterations before softer springs are tried.
    patience: u32,
}

impl Springs {
    pub(super) const NONE: Self = Self {
        share: 0.0,
        age: 0,
        patience: PATIENCE[0],
    };

    /// Whether there are any.
    pub(super) fn are_on(&self) -> bool {
        self.share > 0.0
    }

    /// Removes the springs, because the body has moved to another state.
    pub(super) fn take_off(&mut self) {
        self.share = 0.0;
    }

    /// Counts an iteration and softens the springs if it is time to try. Returns whether it did.
    fn ease(&mut self) -> bool {
        self.age += 1;
        if self.share == 0.0 || self.age <= self.patience {
            return false;
        }
        self.age = 0;
        self.share /= GROWTH;
        if self.share < 0.5 * FIRST {
            self.share = 0.0;
        }
        true
    }

    /// Makes the springs stiffer, because the zone is not stable with the present ones. `was_eased`
    /// says whether they were just softened.
    fn stiffen(&mut self, was_eased: bool) {
        self.age = 0;
        if was_eased {
            self.patience = (2 * self.patience).min(PATIENCE[1]);
        }
        self.share = (self.share * GROWTH).clamp(FIRST, MOST);
    }

    /// Called after the zone was factored with these springs, with so many entries of its diagonal
    /// raised.
    fn settle(&mut self, usual: f64, n_raised: usize) {
        if n_raised > 0 {
            // They do not help. If kept, they would hold the skin for a hundred steps.
            self.share = usual;
        }
        if self.share == 0.0 {
            self.patience = PATIENCE[0];
        }
    }
}

impl Live {
    /// Assembles and factors the zone's stiffness, with springs as soft as possible. Where it is not positive
    /// definite, or if it must be firm, it loses the pressure of the volume; where that is not enough, it has
    /// stiffer springs, and its diagonal is raised: three factors at most.
    pub(super) fn refactor(
        &mut self,
        is_firm: bool,
        report: &mut LiveReport,
    ) -> Result<(), Trouble> {
        let first = if is_firm {
            Pressure::None
        } else {
            Pressure::Own
        };
        self.assemble(first)?;
        let pressed = self.problem.pressing().filter(|c| !c.is_far);
        let pressed = pressed.map(|c| c.vertex);
        let size = self.inside.skin_stiffness(&self.pattern, pressed);
        let was_eased = self.springs.ease();
        let usual = self.springs.share;
        self.hold_pressed(size, 0.0);
        let mut n_raised = 0;
        let mut has_factored = self.has_factored(report);
        let is_altered = is_firm || !has_factored;
        if !is_firm && !has_factored {
            self.assemble(Pressure::None)?;
            self.hold_pressed(size, 0.0);
            has_factored = self.has_factored(report);
        }
        if !has_factored {
            self.springs.stiffen(was_eased);
            self.hold_pressed(size, usual * size);
            report.n_factors += 1;
            n_raised = self.inside.factor_raised(&self.plan, &self.outside)?;
        }
        report.n_raised = report.n_raised.max(n_raised);
        report.spring = self.springs.share;
        self.springs.settle(usual, n_raised);
        self.kept.renew_factor(is_altered);
        Ok(())
    }

    fn assemble(&mut self, pressure: Pressure<'_>) -> Result<(), Trouble> {
        let (model, displacements) = (&*self.model, &self.state.displacements);
        let (memory, pattern, plan) = (&self.memory, &*self.pattern, &*self.plan);
        self.inside
            .assemble(model, memory, pattern, plan, displacements, pressure)
    }

    /// Tries to factor what is assembled.
    fn has_factored(&mut self, report: &mut LiveReport) -> bool {
        report.n_factors += 1;
        self.inside.factor(&self.plan, &self.outside).is_ok()
    }

    /// Puts springs under the pressing vertices of the zone, whose own stiffness is `size` and whose
    /// springs were `before`, N/m.
    fn hold_pressed(&mut self, size: f64, before: f64) {
        let stiffness = self.springs.share * size;
        for candidate in &mut self.problem.candidates {
            candidate.support = if candidate.pressure > 0.0 && !candidate.is_far {
                stiffness
            } else {
                0.0
            };
        }
        let candidates = &self.problem.candidates;
        (self.inside).add_springs(&self.pattern, candidates, stiffness - before);
    }
}
