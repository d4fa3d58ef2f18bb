//! The zone's stiffness and factor. Where the body is not stable without its tools, springs hold
//! the vertices under them. The contact problem removes the forces of the springs again.

use super::super::plan::Trouble;
use super::Live;
use super::report::LiveReport;

/// First stiffness of the springs, relative to the skin's own stiffness; growth factor; largest
/// value.
const FIRST: f64 = 0.03;
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
        self.share = (self.share * GROWTH).max(FIRST);
    }

    /// Called after the zone was factored with these springs and this shift of its diagonal.
    fn settle(&mut self, usual: f64, shift: f32) {
        if shift > 0.0 {
            // The springs did not help. If kept, they would stiffen the skin for a hundred steps.
            self.share = usual;
        }
        if self.share == 0.0 {
            self.patience = PATIENCE[0];
        }
    }
}

impl Live {
    /// Assembles and factors the zone's stiffness, with springs as soft as possible.
    pub(super) fn refactor(&mut self, report: &mut LiveReport) -> Result<(), Trouble> {
        let (model, pattern, plan) = (&*self.model, &*self.pattern, &*self.plan);
        let (inside, springs) = (&mut self.inside, &mut self.springs);
        inside.assemble(
            model,
            &self.memory,
            pattern,
            plan,
            &self.state.displacements,
        )?;
        let pressed = self.problem.pressing().filter(|c| !c.is_far);
        let pressed = pressed.map(|c| c.vertex);
        let size = inside.skin_stiffness(pattern, pressed);
        let mut was_eased = springs.ease();
        let (mut there, usual) = (0.0, springs.share);
        loop {
            let stiffness = springs.share * size;
            for candidate in &mut self.problem.candidates {
                candidate.support = if candidate.pressure > 0.0 && !candidate.is_far {
                    stiffness
                } else {
                    0.0
                };
            }
            inside.add_springs(pattern, &self.problem.candidates, stiffness - there);
            there = stiffness;
            let may_shift = size == 0.0 || springs.share >= MOST;
            match inside.factor(model, pattern, plan, &self.outside, may_shift) {
                Ok(shift) => {
                    report.shift = report.shift.max(shift);
                    report.spring = springs.share;
                    springs.settle(usual, shift);
                    self.kept.renew_factor(shift);
                    return Ok(());
                }
                Err(trouble) if may_shift => return Err(trouble),
                Err(_) => springs.stiffen(std::mem::take(&mut was_eased)),
            }
        }
    }
}
