//! The moving step as the engine's tissue.

use std::sync::Arc;

use palpa_fem::realtime::{
    Live, LiveParams, LiveReport, LocalModel, Rebuild, Rebuilt, StepOutcome,
};
use palpa_fem::shape::Tool as RigidTool;
use palpa_fem::{Model, PosedTool};
use palpa_rt::{StepStatus, Tissue, TissueInput, TissueStep};
use palpa_servo::{
    Candidate, ContactPatch, MAX_CONTACTS, MAX_TOOLS, Mat3, Pose, ToolContact, Vec3,
};

/// The finite elements of [`Live`] under tools whose poses come in a device's frame.
#[derive(Debug)]
pub struct LiveTissue {
    live: Live,
    /// Their frames are those of the devices' hand-pieces.
    tools: Vec<RigidTool>,
    scene_from_device: Pose,
    tolerance: f64,
    /// Of the last step; its memory is kept.
    posed: Vec<PosedTool>,
    local: LocalModel,
    last: Option<LiveReport>,
}

impl LiveTissue {
    /// At rest, with the tools at the device's origin.
    ///
    /// # Errors
    /// When the body is too large to be factored, or cannot be at rest.
    pub fn new(
        model: Arc<Model>,
        mut tools: Vec<RigidTool>,
        scene_from_device: Pose,
        params: LiveParams,
    ) -> anyhow::Result<Self> {
        tools.truncate(MAX_TOOLS);
        let posed: Vec<PosedTool> = tools
            .iter()
            .map(|&tool| PosedTool {
                tool,
                pose: scene_from_device,
            })
            .collect();
        let mut local = LocalModel::default();
        local.contacts.reserve(MAX_CONTACTS);
        local.tools.reserve(MAX_TOOLS);
        local.compliance.reserve(9 * MAX_CONTACTS * MAX_CONTACTS);
        Ok(Self {
            live: Live::new(model, &posed, params)?,
            tools,
            scene_from_device,
            tolerance: params.tolerance,
            posed,
            local,
            last: None,
        })
    }

    /// The moving step.
    pub fn live(&self) -> &Live {
        &self.live
    }

    /// What the last step said of itself.
    pub fn last(&self) -> Option<&LiveReport> {
        self.last.as_ref()
    }

    /// Force of the tissue on a tool after the last step, N, in the device's frame.
    pub fn force(&self, tool: usize) -> Vec3 {
        self.scene_from_device
            .rotation
            .inverse_transform_vector(&self.live.tool_force(tool))
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

    /// Writes the local model into the patch, in the device's frame.
    fn fill(&self, patch: &mut ContactPatch) {
        let frame = &self.scene_from_device;
        let turn: Mat3 = *frame.rotation.to_rotation_matrix().matrix();
        let back = turn.transpose();
        patch.n_tools = self.local.tools.len().min(MAX_TOOLS);
        for (out, tool) in patch.tools.iter_mut().zip(&self.local.tools) {
            *out = ToolContact {
                // Where the tool has been followed to, which may be short of where it is.
                pose: frame.inverse() * tool.pose,
                friction: tool.friction,
                is_bonded: false,
                force: back * tool.force,
                stiffness: back * tool.stiffness * turn,
            };
        }
        let n = self.local.contacts.len().min(MAX_CONTACTS);
        patch.n_contacts = n;
        for (out, contact) in patch.contacts.iter_mut().zip(&self.local.contacts) {
            *out = Candidate {
                vertex: contact.vertex,
                tool: u32::try_from(contact.tool).unwrap_or(u32::MAX),
                position: frame
                    .inverse_transform_point(&contact.position.into())
                    .coords,
                force: back * contact.force,
                surface: contact.surface,
                normal: contact.normal,
                curvature: contact.curvature,
                anchor: contact.anchor,
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
    type Job = Rebuild;
    type Done = Rebuilt;

    /// A step in the air: memory is there and touched before anything presses.
    fn prepare(&mut self) {
        let posed = std::mem::take(&mut self.posed);
        self.live.step(&posed, 0.0);
        self.live.local_model(MAX_CONTACTS, &mut self.local);
        self.posed = posed;
    }

    fn step(&mut self, input: &TissueInput, patch: &mut ContactPatch) -> TissueStep {
        self.pose_tools(input);
        let report = self.live.step(&self.posed, input.dt);
        self.live.local_model(MAX_CONTACTS, &mut self.local);
        self.fill(patch);
        self.last = Some(report);
        TissueStep {
            status: match report.outcome {
                StepOutcome::Arrived if report.residual <= self.tolerance => StepStatus::Converged,
                StepOutcome::Arrived => StepStatus::Unfinished,
                StepOutcome::Behind => StepStatus::BackedOff,
                StepOutcome::BackedOff => StepStatus::Settling,
                StepOutcome::Failed => StepStatus::Failed,
            },
            iterations: report.iterations as u32,
            residual: report.residual,
            factor: report.factor,
            zone: report.zone,
            // The moving step works with forces alone.
            energy: 0.0,
        }
    }

    fn take_job(&mut self) -> Option<Rebuild> {
        self.live.take_job()
    }

    fn run(job: Rebuild) -> Rebuilt {
        job.run()
    }

    fn install(&mut self, done: Rebuilt) {
        self.live.install(done);
    }
}
