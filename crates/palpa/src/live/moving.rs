//! Real-time finite elements as the engine's tissue.

use super::Watch;
use nalgebra::Translation3;
use palpa_fem::PosedTool;
use palpa_fem::realtime::{
    Live, LiveReport, LocalContact, LocalModel, RoamDone, RoamJob, Roaming, StepOutcome,
};
use palpa_fem::shape::Tool as RigidTool;
use palpa_rt::{StepStatus, Tissue, TissueInput, TissueStep};
use palpa_servo::{
    Candidate, ContactPatch, MAX_CONTACTS, MAX_TOOLS, Mat3, Pose, ToolContact, Vec3,
};

/// Longest way along the skin that a dent goes with its tool ahead of the body, m; on a limb the skin has turned aside by
/// less than a millimetre there.
const MOST_CARRIED: f64 = 8e-3;
/// Forces below this have no direction, N.
const LEAST_FORCE: f64 = 1e-3;

/// The finite elements of [`Roaming`], with tools whose poses arrive in a device's frame.
#[derive(Debug)]
pub struct LiveTissue {
    body: Roaming,
    /// The tools, in the frames of the devices' hand-pieces.
    tools: Vec<RigidTool>,
    scene_from_device: Pose,
    tolerance: f64,
    /// The tools with their poses at the last step; kept to reuse its memory.
    posed: Vec<PosedTool>,
    /// The local model of the last step that is fit to be felt, and the number of its mesh.
    local: LocalModel,
    local_mesh: u64,
    /// The one before it.
    before: LocalModel,
    /// The time at which its poses were taken, s; `None` before the first such step.
    local_from: Option<f64>,
    last: Option<LiveReport>,
    watch: Option<Watch>,
}

impl LiveTissue {
    /// A body with its tools at the device's origin. `tolerance` is the tolerance of the residuals.
    pub fn new(
        body: Roaming,
        mut tools: Vec<RigidTool>,
        scene_from_device: Pose,
        tolerance: f64,
    ) -> Self {
        tools.truncate(MAX_TOOLS);
        let posed = tools
            .iter()
            .map(|&tool| PosedTool {
                tool,
                pose: scene_from_device,
            })
            .collect();
        Self {
            body,
            tools,
            scene_from_device,
            tolerance,
            posed,
            local: LocalModel::with_room(MAX_CONTACTS, MAX_TOOLS),
            before: LocalModel::with_room(MAX_CONTACTS, MAX_TOOLS),
            local_mesh: 0,
            local_from: None,
            last: None,
            watch: None,
        }
    }

    /// Lets a viewer see the displacements. It has no influence on the results.
    #[must_use]
    pub fn watched(mut self, watch: Watch) -> Self {
        self.watch = Some(watch);
        self
    }

    /// The real-time finite elements.
    pub fn live(&self) -> &Live {
        self.body.live()
    }

    /// Number of meshes used so far, and of meshes that could not be taken up.
    pub fn n_meshes(&self) -> [u64; 2] {
        self.body.n_meshes()
    }

    /// Report of the last step.
    pub fn last(&self) -> Option<&LiveReport> {
        self.last.as_ref()
    }

    /// Whether the job that was taken last is no longer wanted: its result changes nothing.
    pub fn has_given_up_job(&self) -> bool {
        self.body.has_given_up_job()
    }

    /// Force of the tissue on a tool after the last step, in the device's frame, N.
    pub fn force(&self, tool: usize) -> Vec3 {
        self.scene_from_device
            .rotation
            .inverse_transform_vector(&self.live().tool_force(tool))
    }

    fn pose_tools(&mut self, input: &TissueInput) {
        self.posed.clear();
        let poses = input.poses.iter().take(input.n_tools);
        self.posed
            .extend(self.tools.iter().zip(poses).map(|(&tool, pose)| PosedTool {
                tool,
                pose: self.scene_from_device * pose,
            }));
    }

    /// Makes the local model of the state reached, with the compliance of the last one if its own is not the
    /// body's.
    fn renew_local(&mut self, is_altered: bool) {
        std::mem::swap(&mut self.local, &mut self.before);
        let live = self.body.live_mut();
        live.local_model(MAX_CONTACTS, &mut self.local);
        let mesh = self.body.n_meshes()[0];
        if (is_altered || !self.local.is_own) && mesh == self.local_mesh {
            self.local.give_way_as(&self.before);
        }
        self.local_mesh = mesh;
    }

    /// The point of the tool, in its frame, that holds a contact with the friction of the step: where
    /// the contact is. What the tissue has slipped before is in that friction already.
    fn held_at(&self, contact: &LocalContact) -> Vec3 {
        let tool = self.local.tools.get(contact.tool);
        tool.map_or(contact.anchor, |tool| {
            let place = contact.position.into();
            tool.pose.inverse_transform_point(&place).coords
        })
    }

    /// By how much a tool has left the pose of its local model behind, along the skin, m. The body holds a tool at the
    /// edge of its zone until the next one is ready; until then the dent is taken to go with it, as it would in even
    /// tissue.
    fn carried(&self, tool: usize) -> Vec3 {
        let (Some(local), Some(posed)) = (self.local.tools.get(tool), self.posed.get(tool)) else {
            return Vec3::zeros();
        };
        let mut push = Vec3::zeros();
        for contact in self.local.contacts.iter().filter(|c| c.tool == tool) {
            let normal = local.pose.rotation * contact.normal;
            push += normal * normal.dot(&contact.force).max(0.0);
        }
        let Some(inward) = push.try_normalize(LEAST_FORCE) else {
            return Vec3::zeros();
        };
        let way = posed.pose.translation.vector - local.pose.translation.vector;
        let along = way - inward * inward.dot(&way);
        along * (MOST_CARRIED / along.norm()).min(1.0)
    }

    /// Writes the local model into the patch, in the device's frame.
    fn fill(&self, patch: &mut ContactPatch) {
        let carried: [Vec3; MAX_TOOLS] = std::array::from_fn(|tool| self.carried(tool));
        let frame = &self.scene_from_device;
        let turn: Mat3 = *frame.rotation.to_rotation_matrix().matrix();
        let back = turn.transpose();
        patch.n_tools = self.local.tools.len().min(MAX_TOOLS);
        for ((out, tool), carried) in patch.tools.iter_mut().zip(&self.local.tools).zip(carried) {
            *out = ToolContact {
                // The pose that the step reached, which may lag behind the device.
                pose: frame.inverse() * Translation3::from(carried) * tool.pose,
                friction: tool.friction,
                is_bonded: false,
                force: back * tool.force,
                stiffness: back * tool.stiffness * turn,
            };
        }
        // Marks the vertices with their mesh: the same number in another mesh is another vertex.
        let mesh = ((self.local_mesh % 16) as u32) << 27;
        let n = self.local.contacts.len().min(MAX_CONTACTS);
        patch.n_contacts = n;
        let carried_by = |tool: usize| carried.get(tool).copied().unwrap_or_default();
        for (out, contact) in patch.contacts.iter_mut().zip(&self.local.contacts) {
            *out = Candidate {
                vertex: contact.vertex ^ mesh,
                tool: u32::try_from(contact.tool).unwrap_or(u32::MAX),
                position: frame
                    .inverse_transform_point(&(contact.position + carried_by(contact.tool)).into())
                    .coords,
                force: back * contact.force,
                surface: contact.surface,
                normal: contact.normal,
                curvature: contact.curvature,
                anchor: self.held_at(contact),
            };
        }
        for j in 0..n {
            for i in 0..=j {
                let block = back * self.local.block(i, j) * turn;
                patch.set_block(i, j, &block);
                patch.set_block(j, i, &block.transpose());
            }
        }
    }
}

impl Tissue for LiveTissue {
    type Job = RoamJob;
    type Done = RoamDone;

    /// Takes a step in the air, so that all memory is allocated and touched before the first
    /// contact.
    fn prepare(&mut self) {
        let posed = std::mem::take(&mut self.posed);
        self.body.step(&posed, 0.0);
        self.body
            .live_mut()
            .local_model(MAX_CONTACTS, &mut self.local);
        self.posed = posed;
    }

    fn step(&mut self, input: &TissueInput, patch: &mut ContactPatch) -> TissueStep {
        self.pose_tools(input);
        let frame = &self.scene_from_device;
        let aim = input
            .aim
            .map(|aim| frame.transform_point(&aim.into()).coords);
        self.body.set_aim(aim);
        (self.body.live_mut()).set_time_of_poses(input.time_of_poses());
        let report = self.body.step(&self.posed, input.dt);
        let is_finished = report.residual <= self.tolerance && report.is_whole();
        let status = match report.outcome {
            StepOutcome::Arrived if is_finished => StepStatus::Converged,
            StepOutcome::Arrived => StepStatus::Unfinished,
            StepOutcome::Behind => StepStatus::Behind,
            StepOutcome::BackedOff => StepStatus::Settling,
            // The local model is still that of the state held.
            StepOutcome::Held if self.local_from.is_some() => StepStatus::Behind,
            StepOutcome::Held | StepOutcome::Failed => StepStatus::Failed,
        };
        // The tools are not back at their depth yet: a local model of this step would give too small a force.
        let keeps_local = report.is_catching_up && self.local_from.is_some();
        if report.outcome == StepOutcome::Held || (keeps_local && status.has_patch()) {
            self.local_from = self.local_from.map(|_| input.sampled_at);
        } else if status.has_patch() {
            self.renew_local(report.is_altered);
            self.local_from = Some(input.sampled_at);
        }
        self.fill(patch);
        self.last = Some(report);
        if let Some(watch) = &mut self.watch {
            watch.look(input.step, input.now, &self.body, self.posed.first());
        }
        TissueStep {
            status,
            kept_from: self.local_from.filter(|_| !status.has_patch()),
            iterations: report.iterations as u32,
            residual: report.residual,
            factor: report.factor,
            zone: report.zone,
            mesh: self.body.n_meshes()[0],
            // The finite elements work with forces only.
            energy: 0.0,
        }
    }

    fn take_job(&mut self) -> Option<RoamJob> {
        self.body.take_job()
    }

    fn run(job: RoamJob) -> RoamDone {
        job.run()
    }

    fn install(&mut self, done: RoamDone) {
        self.body.install(done);
    }

    fn job_failed(&mut self) {
        self.body.job_failed();
    }
}
