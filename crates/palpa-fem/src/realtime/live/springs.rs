//! The zone's stiffness and factor. Where the body is not stable without its tools, springs hold
//! the vertices under them; the contact problem takes the springs' forces out again.

use super::super::plan::Trouble;
use super::Live;
use super::report::LiveReport;

/// First stiffness of the springs, as a share of the skin's own; its growth; and the largest.
const FIRST: f64 = 0.03;
const GROWTH: f64 = 3.0;
const MOST: f64 = 10.0;
/// Least and most iterations after which smaller springs are tried: twice as many each time that
/// smaller ones do not do.
const PATIENCE: [u32; 2] = [2, 32];

/// Springs along the normals of vertices that press.
#[derive(Debug)]
pub(super) struct Springs {
    /// Stiffness of each, as a share of the skin's own; 0 for none.
    share: f64,
    /// Iterations since the share was changed.
    age: u32,
    /// Iterations after which a smaller share is tried.
    patience: u32,
}

impl Springs {
    pub(super) const NONE: Self = Self {
        share: 0.0,
        age: 0,
        patience: PATIENCE[0],
    };

    /// Takes the springs off, as the body is elsewhere.
    pub(super) fn take_off(&mut self) {
        self.share = 0.0;
    }

    /// One iteration later: smaller springs, if it is time to try them. Returns whether it is.
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

    /// Stiffer springs, as with these the zone is not stable. `was_eased` says whether they have
    /// just been made smaller.
    fn stiffen(&mut self, was_eased: bool) {
        self.age = 0;
        if was_eased {
            self.patience = (2 * self.patience).min(PATIENCE[1]);
        }
        self.share = (self.share * GROWTH).max(FIRST);
    }

    /// The zone has been factored with these springs and a shift of its diagonal.
    fn settle(&mut self, usual: f64, shift: f32) {
        if shift > 0.0 {
            // Springs were no help; kept, they would hold the skin stiff for a hundred steps.
            self.share = usual;
        }
        if self.share == 0.0 {
            self.patience = PATIENCE[0];
        }
    }
}

impl Live {
    /// Makes the zone's stiffness and factor, with springs that are as soft as they may be.
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
        let pressed = self.problem.pressing().map(|c| c.vertex);
        let size = inside.skin_stiffness(pattern, pressed);
        let mut was_eased = springs.ease();
        let (mut there, usual) = (0.0, springs.share);
        loop {
            let stiffness = springs.share * size;
            for candidate in &mut self.problem.candidates {
                candidate.support = if candidate.pressure > 0.0 {
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
                    return Ok(());
                }
                Err(trouble) if may_shift => return Err(trouble),
                Err(_) => springs.stiffen(std::mem::take(&mut was_eased)),
            }
        }
    }
}
