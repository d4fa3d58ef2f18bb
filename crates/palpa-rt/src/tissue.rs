//! What the engine asks of a tissue, and how its patches are hashed.

use palpa_servo::{
    Candidate, ContactPatch, MAX_CONTACTS, MAX_TOOLS, Mat3, Pose, ToolContact, Vec3,
};

/// What a step of the tissue is made from; together with the jobs installed before it, everything
/// it depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TissueInput {
    /// Counts steps from 1.
    pub step: u64,
    /// The tick at which the poses were taken.
    pub tick: u64,
    /// When they were taken, s.
    pub sampled_at: f64,
    /// When the step begins, s.
    pub now: f64,
    /// Time since the step before, s, capped: what viscous history is to be moved on by.
    pub dt: f64,
    /// Time from patch to patch to be expected, s.
    pub period: f64,
    /// Where the tools are; those past `n_tools` mean nothing.
    pub poses: [Pose; MAX_TOOLS],
    /// How many tools there are.
    pub n_tools: usize,
}

/// How a step went.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u8)]
pub enum StepStatus {
    /// Within its tolerance.
    #[default]
    Converged = 0,
    /// Not within its tolerance, but usable: the next steps go on from here.
    Unfinished = 1,
    /// It did not come as far as the tools: the patch is of the place that it reached.
    Behind = 2,
    /// Not fit to be felt yet, as after a change of zone: the patch is not published.
    Settling = 3,
    /// There is no usable state: the patch is not published.
    Failed = 4,
}

impl StepStatus {
    /// Whether the patch of such a step is given to the 1 kHz loop.
    pub fn is_published(self) -> bool {
        matches!(self, Self::Converged | Self::Unfinished | Self::Behind)
    }

    /// In a word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Converged => "converged",
            Self::Unfinished => "unfinished",
            Self::Behind => "behind the tool",
            Self::Settling => "settling, patch held back",
            Self::Failed => "failed, patch held back",
        }
    }
}

/// What a step says of itself; goes to the log, and must not depend on anything that a replay does
/// not have (no times).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TissueStep {
    /// How it went.
    pub status: StepStatus,
    /// Iterations.
    pub iterations: u32,
    /// Residual at its end, relative.
    pub residual: f64,
    /// Which factor of the exterior it used.
    pub factor: u64,
    /// Which zone.
    pub zone: u64,
    /// Which mesh, counted from 1.
    pub mesh: u64,
    /// Stored energy, J.
    pub energy: f64,
}

/// A body under tools, as seen by the engine.
///
/// The same inputs, jobs and installations in the same order give the same patches to the bit:
/// replay rests on it.
pub trait Tissue: Send {
    /// Work for the background, with all that it needs: it shares nothing with the tissue.
    type Job: Send + 'static;
    /// What came of it.
    type Done: Send + 'static;

    /// Called once on the tissue thread before the first step: touches memory and warms up what is
    /// per thread.
    fn prepare(&mut self) {}

    /// Moves the tissue on and writes the patch in place, all of it that counts: the slot holds an
    /// older one.
    ///
    /// The engine stamps the patch's `id`, `sampled_at` and `period` afterwards.
    fn step(&mut self, input: &TissueInput, patch: &mut ContactPatch) -> TissueStep;

    /// Background work that is wanted after this step. Asked only while no other job is under way.
    fn take_job(&mut self) -> Option<Self::Job>;

    /// Does it, on the background thread.
    fn run(job: Self::Job) -> Self::Done;

    /// Takes in what came of the last job; called between steps.
    fn install(&mut self, done: Self::Done);
}

/// A patch that was never written, `id` 0: its slot and its memory are there.
#[expect(
    clippy::large_stack_arrays,
    reason = "260 KB, at start, on threads with megabytes of stack"
)]
pub fn empty_patch() -> Box<ContactPatch> {
    let tool = ToolContact {
        pose: Pose::identity(),
        friction: 0.0,
        is_bonded: false,
        force: Vec3::zeros(),
        stiffness: Mat3::zeros(),
    };
    Box::new(ContactPatch {
        id: 0,
        sampled_at: 0.0,
        period: 0.0,
        n_tools: 0,
        tools: [tool; MAX_TOOLS],
        n_contacts: 0,
        contacts: [Candidate::NONE; MAX_CONTACTS],
        compliance: [0.0; ContactPatch::STRIDE * ContactPatch::STRIDE],
    })
}

/// A hash of all bits of a patch that mean something, its stamps included. Not against malice.
pub fn patch_hash(patch: &ContactPatch) -> u64 {
    let n_tools = patch.n_tools.min(MAX_TOOLS);
    let n_contacts = patch.n_contacts.min(MAX_CONTACTS);
    let mut h = Lanes::new();
    h.ints([patch.id, patch.n_tools as u64, patch.n_contacts as u64, 0]);
    h.reals(&[patch.sampled_at, patch.period]);
    for tool in &patch.tools[..n_tools] {
        h.reals(tool.pose.translation.vector.as_slice());
        h.reals(tool.pose.rotation.coords.as_slice());
        h.reals(&[tool.friction, f64::from(u8::from(tool.is_bonded))]);
        h.reals(tool.force.as_slice());
        h.reals(tool.stiffness.as_slice());
    }
    for c in &patch.contacts[..n_contacts] {
        h.ints([c.vertex.into(), c.tool.into(), 0, 0]);
        for v in [&c.position, &c.force, &c.surface, &c.normal, &c.anchor] {
            h.reals(v.as_slice());
        }
        h.reals(c.curvature.as_slice());
    }
    for column in patch
        .compliance
        .chunks_exact(ContactPatch::STRIDE)
        .take(3 * n_contacts)
    {
        h.reals(&column[..3 * n_contacts]);
    }
    h.finish()
}

/// Four hashes side by side, because one alone waits for its own multiplication.
struct Lanes([u64; 4]);

impl Lanes {
    fn new() -> Self {
        Self([1, 2, 3, 4])
    }

    fn ints(&mut self, values: [u64; 4]) {
        for (lane, v) in self.0.iter_mut().zip(values) {
            *lane = (*lane ^ v)
                .wrapping_mul(0x9e37_79b9_7f4a_7c15)
                .rotate_left(29);
        }
    }

    fn reals(&mut self, values: &[f64]) {
        for four in values.chunks(4) {
            let mut bits = [four.len() as u64; 4];
            for (b, v) in bits.iter_mut().zip(four) {
                *b = v.to_bits();
            }
            self.ints(bits);
        }
    }

    fn finish(self) -> u64 {
        let mut h = 0_u64;
        for lane in self.0 {
            h = (h ^ lane ^ (lane >> 31))
                .wrapping_mul(0xbf58_476d_1ce4_e5b9)
                .rotate_left(23);
        }
        h ^ (h >> 32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_sees_every_bit_that_counts_and_no_other() {
        let mut patch = empty_patch();
        patch.n_tools = 1;
        patch.n_contacts = 7;
        let before = patch_hash(&patch);
        patch.compliance[21] = 1.0; // row 21 of column 0: past the seven
        patch.tools[1].friction = 1.0;
        assert_eq!(patch_hash(&patch), before);
        let changes: [fn(&mut ContactPatch); 6] = [
            |p| p.compliance[20] = -0.0,
            |p| p.compliance[20 * ContactPatch::STRIDE + 20] = f64::MIN_POSITIVE,
            |p| p.contacts[6].anchor.z = f64::NAN,
            |p| p.tools[0].is_bonded = true,
            |p| p.contacts[6].tool = 1,
            |p| p.id = 1,
        ];
        for change in changes {
            let mut other = patch.clone();
            change(&mut other);
            assert_ne!(patch_hash(&other), before);
        }
    }
}
