//! The interface between the engine and a tissue, and the hash of its patches.

use palpa_servo::{
    Candidate, ContactPatch, MAX_CONTACTS, MAX_TOOLS, Mat3, Pose, ToolContact, Vec3,
};

/// Input of a step of the tissue. A step depends on nothing but this input and the jobs installed
/// before it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TissueInput {
    /// Counts steps from 1.
    pub step: u64,
    /// The tick at which the poses were taken.
    pub tick: u64,
    /// Time at which the poses were taken, s.
    pub sampled_at: f64,
    /// When the step begins, s.
    pub now: f64,
    /// Time since the previous step, s, capped. The viscous history advances by it.
    pub dt: f64,
    /// Expected time from patch to patch, s.
    pub period: f64,
    /// Poses of the tools, [ahead] of those that were taken; entries from `n_tools` on are not used.
    pub poses: [Pose; MAX_TOOLS],
    /// Number of tools.
    pub n_tools: usize,
    /// Where the hand of the first tool means to touch the tissue, in the device's frame, m; `None` if that is not known.
    pub aim: Option<Vec3>,
}

impl TissueInput {
    /// Time at which the tools will be at the poses, if their hands go on as they do, s.
    pub fn time_of_poses(&self) -> f64 {
        self.sampled_at + lead(self.period)
    }
}

/// Time by which a step looks ahead of the poses that were taken, in patch periods: its patch comes one
/// period later and serves for another, and both are longer than usual where the step needs a new factor.
const LEAD: f64 = 2.0;
/// Largest such time, s, and way of a tool in it, m.
const LONGEST_LEAD: f64 = 0.025;
const LONGEST_WAY: f64 = 1e-3;

/// About where a tool with this velocity, m/s, will be while the patch of the next step serves, if patches
/// come every `period`, s. There the linear model of the tissue is best.
pub fn ahead(mut pose: Pose, velocity: &Vec3, period: f64) -> Pose {
    let way = velocity * lead(period);
    let length = way.norm();
    if length.is_finite() {
        pose.translation.vector += way * (LONGEST_WAY / length.max(LONGEST_WAY));
    }
    pose
}

/// Time by which the poses of a step are ahead of when they were taken, s.
fn lead(period: f64) -> f64 {
    (LEAD * period).min(LONGEST_LEAD)
}

/// Status of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u8)]
pub enum StepStatus {
    /// The step converged within its tolerance.
    #[default]
    Converged = 0,
    /// The residual is above the tolerance, but the state is usable; the next steps continue from
    /// it.
    Unfinished = 1,
    /// The step did not reach the poses of the tools; the patch belongs to the poses that it
    /// reached.
    Behind = 2,
    /// The forces are not fit to be felt yet, as after a change of zone; there is no new patch.
    Settling = 3,
    /// There is no usable state, and no new patch.
    Failed = 4,
}

impl StepStatus {
    /// Whether such a step makes a new patch for the 1 kHz loop.
    pub fn has_patch(self) -> bool {
        matches!(self, Self::Converged | Self::Unfinished | Self::Behind)
    }

    /// Name of the status.
    pub fn name(self) -> &'static str {
        match self {
            Self::Converged => "converged",
            Self::Unfinished => "unfinished",
            Self::Behind => "behind the tool",
            Self::Settling => "settling, no new patch",
            Self::Failed => "failed, no new patch",
        }
    }
}

/// Report of a step. It goes to the log and must not depend on anything that a replay does not
/// have, such as times.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TissueStep {
    /// Status of the step.
    pub status: StepStatus,
    /// Solver iterations.
    pub iterations: u32,
    /// Relative residual at the end of the step.
    pub residual: f64,
    /// Number of the factor of the exterior that the step used.
    pub factor: u64,
    /// Number of the zone.
    pub zone: u64,
    /// Number of the mesh, from 1.
    pub mesh: u64,
    /// Stored energy, J.
    pub energy: f64,
    /// Without a new patch, the last one may be handed over again, so that the loop goes on with it and
    /// knows that the tissue still runs: the time at which the poses of that patch were taken, s. `None`
    /// if the patch is new, or if there is none to go on with.
    pub kept_from: Option<f64>,
}

impl TissueStep {
    /// Whether the patch is sent to the 1 kHz loop.
    pub fn is_published(&self) -> bool {
        self.status.has_patch() || self.kept_from.is_some()
    }
}

/// A body under tools, as seen by the engine.
///
/// The same inputs, jobs and installations in the same order must give the same patches bit for
/// bit. Replay relies on it.
pub trait Tissue: Send {
    /// Work for the background thread. It owns all its data and shares nothing with the tissue.
    type Job: Send + 'static;
    /// Result of a job.
    type Done: Send + 'static;

    /// Called once on the tissue thread before the first step, to touch memory and warm up
    /// per-thread data.
    fn prepare(&mut self) {}

    /// Moves the tissue on and writes the patch in place, the last one again if there is no new one. It
    /// must write every part that is used, because the slot holds an older patch.
    ///
    /// The engine stamps the patch's `id`, `sampled_at` and `period` afterwards.
    fn step(&mut self, input: &TissueInput, patch: &mut ContactPatch) -> TissueStep;

    /// Background work needed after this step. Called only while no other job is running.
    fn take_job(&mut self) -> Option<Self::Job>;

    /// Runs a job on the background thread.
    fn run(job: Self::Job) -> Self::Done;

    /// Installs the result of the last job; called between steps.
    fn install(&mut self, done: Self::Done);

    /// Called between steps, instead of [`Self::install`], if the last job panicked. The job and all
    /// that it held are gone.
    fn job_failed(&mut self);
}

/// Writes the stamps of a patch, which the tissue does not know.
pub fn stamp(patch: &mut ContactPatch, input: &TissueInput, result: &TissueStep) {
    patch.id = input.step;
    patch.sampled_at = result.kept_from.unwrap_or(input.sampled_at);
    patch.period = input.period;
}

/// A boxed patch that was never written (`id` 0); its memory is allocated and touched.
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

/// A hash of all used bits of a patch, its stamps included. Not cryptographic.
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

/// Four hashes side by side, because a single hash waits for each of its multiplications.
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
    fn a_step_looks_ahead_of_a_tool_that_moves_and_never_far() {
        let at = |velocity: [f64; 3], period: f64| {
            let pose = ahead(Pose::translation(0.1, 0.0, 0.0), &velocity.into(), period);
            pose.translation.vector - Vec3::new(0.1, 0.0, 0.0)
        };
        assert_eq!(at([0.0; 3], 0.01), Vec3::zeros());
        let near = at([0.0, 0.05, 0.0], 2e-3);
        assert!((near - Vec3::new(0.0, 2e-4, 0.0)).norm() < 1e-12, "{near}");
        let far = at([0.0, 0.0, -10.0], 0.1);
        assert!((far - Vec3::new(0.0, 0.0, -1e-3)).norm() < 1e-12, "{far}");
        assert_eq!(at([f64::NAN, 0.0, 0.0], 0.01), Vec3::zeros());
        assert_eq!(at([f64::INFINITY, 0.0, 0.0], 0.01), Vec3::zeros());
    }

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
