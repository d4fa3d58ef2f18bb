//! The reference method in real time: as in 2009, one node of the skin is operated while the tool's
//! tip presses it.

use palpa_mesh::{LayeredBody, Vec3};
use palpa_rt::{StepStatus, Tissue, TissueInput, TissueStep};
use palpa_scene::{ContactShape, ContactTool, Scene};
use palpa_servo::{Candidate, ContactPatch, Mat3, Pose, ToolContact};
use palpa_springs::{Outcome, SpringModel, SpringState, StepParams, Workspace, step};
use std::sync::Arc;

use super::{MOST_NODES, Watch};
use crate::build::{BuiltBody, build_within, nearest};
use crate::continuum;
use crate::note::Note;
use crate::press::{Place, reference};

/// Coefficient of friction between tip and node: so high that the node hardly slips.
const FRICTION: f64 = 5.0;
/// The tip is a point; its frame is that of a sphere of this radius, m.
const POINT: f64 = 5e-3;
/// Displacement used to measure a node's stiffness, as a share of the mean edge length.
const PROBE: f64 = 1e-3;

/// A scene of the reference method, set up for real time.
#[derive(Debug, Clone)]
pub struct SpringScene {
    scene: Arc<Scene>,
    built: Arc<BuiltBody>,
    /// Largest distance from the node at which the tip still presses it, m.
    reach: f64,
    /// Pose of the device's frame in the scene: z points out of the tissue where the scene presses,
    /// and the origin lies above the skin.
    pub scene_from_device: Pose,
    /// Remarks for the user on the place and the cut faces; those on the growth of the body are in
    /// [`BuiltBody::notes`].
    pub notes: Vec<Note>,
}

/// The body with one of its nodes operated.
#[derive(Debug)]
pub struct Held {
    model: SpringModel,
    params: StepParams,
    vertex: usize,
    at: Vec3,
    /// Displacement of the node per force on it, m/N.
    compliance: Mat3,
    stiffness: Mat3,
}

impl SpringScene {
    /// Builds the body of a scene whose model is the reference method.
    ///
    /// # Errors
    /// When the scene uses features that the reference method lacks, or its body cannot be grown.
    pub fn build(scene: &Scene) -> anyhow::Result<Self> {
        reference::check_reference(scene)?;
        let built = Arc::new(build_within(scene, MOST_NODES)?);
        let body = &built.growth.body;
        let mut notes = Vec::new();
        // The tip holds a node.
        let place = Place::at_vertex(scene, body, built.press_vertex, &mut notes)?;
        reference::note_cut_faces(scene, body, &mut notes);
        let point = ContactTool {
            shape: ContactShape::Sphere { radius: POINT },
            friction: 0.0,
            axis: None,
        };
        let (_, at_rest) = continuum::tool(&point, place.direction.into_inner(), place.at)?;
        Ok(Self {
            scene_from_device: at_rest * Pose::translation(0.0, 0.0, scene.motion.above),
            reach: body.skin.mean_edge_length(),
            scene: Arc::new(scene.clone()),
            built,
            notes,
        })
    }

    /// The body as it was grown.
    pub fn built(&self) -> &Arc<BuiltBody> {
        &self.built
    }

    /// Start of the hand, scene's frame, m.
    pub fn beginning(&self) -> Vec3 {
        self.scene_from_device.translation.vector
    }

    /// The body at rest.
    pub fn body(&self) -> &LayeredBody {
        &self.built.growth.body
    }

    /// The body with one vertex of its skin operated.
    ///
    /// # Errors
    /// When its network cannot be built.
    fn held(&self, vertex: usize) -> anyhow::Result<Held> {
        let body = self.body();
        let node = body.node(vertex, 0);
        let constraints = reference::constraints(&self.scene, body, vec![node]);
        let params = reference::spring_params(&self.scene);
        let model = SpringModel::build(body, &params, &constraints)?;
        let params = reference::step_params(&self.scene, &model);
        let stiffness = stiffness(&model, &params, PROBE * self.reach);
        let compliance = stiffness.try_inverse().unwrap_or_default();
        Ok(Held {
            at: body.positions[node],
            model,
            params,
            vertex,
            compliance,
            stiffness,
        })
    }

    /// The tissue at rest, with the tip at `tip`.
    ///
    /// # Errors
    /// When its network cannot be built.
    pub fn tissue(&self, tip: Vec3, watch: Option<Watch>) -> anyhow::Result<SpringTissue> {
        let held = self.held(nearest(&self.body().skin, tip))?;
        Ok(SpringTissue {
            state: SpringState::new(&held.model),
            workspace: Workspace::new(&held.model),
            held,
            scene: self.clone(),
            grip: None,
            wanted: None,
            n_held: 1,
            watch,
        })
    }
}

/// Stiffness of the node, N/m, from a small step along each axis.
fn stiffness(model: &SpringModel, params: &StepParams, probe: f64) -> Mat3 {
    let mut k = Mat3::zeros();
    for axis in 0..3 {
        let mut state = SpringState::new(model);
        let mut workspace = Workspace::new(model);
        let mut by = Vec3::zeros();
        by[axis] = probe;
        let report = step(model, &mut state, &mut workspace, by, params);
        k.set_column(axis, &(-report.force / probe));
    }
    (k + k.transpose()) * 0.5
}

/// The network of bars under a tip that operates one node of its skin.
#[derive(Debug)]
pub struct SpringTissue {
    scene: SpringScene,
    held: Held,
    state: SpringState,
    workspace: Workspace,
    /// Point where the tip took hold of the node, relative to the node at rest and along the skin,
    /// m; `None` while the tip presses nothing.
    grip: Option<Vec3>,
    /// The vertex under the tip, if it is not the operated one.
    wanted: Option<usize>,
    n_held: u64,
    watch: Option<Watch>,
}

impl SpringTissue {
    fn follow(&mut self, tip: Vec3, up: Vec3) -> Outcome {
        let off = tip - self.held.at;
        let depth = -up.dot(&off);
        let aside = off + up * depth;
        let grip = match self.grip {
            None if depth > 0.0 && aside.norm() <= self.scene.reach => aside,
            None => {
                self.look_for(tip);
                return Outcome::Converged;
            }
            Some(_) if depth <= 0.0 || self.state.force.dot(&up) < 0.0 && depth < PROBE => {
                self.let_go();
                return Outcome::Converged;
            }
            Some(grip) => grip,
        };
        self.grip = Some(grip);
        let by = off - grip - self.state.displacement;
        let Held { model, params, .. } = &self.held;
        step(model, &mut self.state, &mut self.workspace, by, params).outcome
    }

    fn let_go(&mut self) {
        self.grip = None;
        self.state = SpringState::new(&self.held.model);
    }

    fn look_for(&mut self, tip: Vec3) {
        let vertex = nearest(&self.scene.body().skin, tip);
        self.wanted = (vertex != self.held.vertex).then_some(vertex);
    }

    fn fill(&self, input: &TissueInput, patch: &mut ContactPatch) {
        let frame = &self.scene.scene_from_device;
        let turn: Mat3 = *frame.rotation.to_rotation_matrix().matrix();
        let back = turn.transpose();
        let pose = input.poses[0];
        let is_held = self.grip.is_some();
        patch.n_tools = 1;
        patch.tools[0] = ToolContact {
            pose,
            friction: FRICTION,
            is_bonded: false,
            force: back * self.state.force,
            stiffness: if is_held {
                back * self.held.stiffness * turn
            } else {
                Mat3::zeros()
            },
        };
        let at = frame.inverse_transform_point(&(self.held.at + self.state.displacement).into());
        let tip = pose.translation.vector;
        patch.n_contacts = usize::from(is_held || (at.coords - tip).norm() < self.scene.reach);
        patch.contacts[0] = Candidate {
            vertex: self.held.vertex as u32,
            tool: 0,
            position: at.coords,
            force: -(back * self.state.force),
            surface: Vec3::zeros(),
            normal: -Vec3::z(),
            curvature: Mat3::zeros(),
            anchor: pose.inverse_transform_point(&at).coords,
        };
        patch.set_block(0, 0, &(back * self.held.compliance * turn));
    }
}

/// A job: make this vertex of the scene the operated one.
#[derive(Debug)]
pub struct Take(SpringScene, usize);

impl Tissue for SpringTissue {
    type Job = Take;
    type Done = Option<Held>;

    fn step(&mut self, input: &TissueInput, patch: &mut ContactPatch) -> TissueStep {
        let pose = self.scene.scene_from_device * input.poses[0];
        let up = pose.rotation * Vec3::z();
        let outcome = self.follow(pose.translation.vector, up);
        self.fill(input, patch);
        if let Some(watch) = &mut self.watch {
            let model = &self.held.model;
            let moved = self.state.positions.iter().zip(model.rest_positions());
            watch.look_at(input.step, input.now, moved.map(|(now, rest)| now - rest));
        }
        TissueStep {
            status: match outcome {
                Outcome::Converged => StepStatus::Converged,
                Outcome::EulerFallback { .. } => StepStatus::Unfinished,
                Outcome::Diverged { .. } | Outcome::NotFinite => StepStatus::Failed,
            },
            iterations: 1,
            mesh: 1,
            zone: self.n_held,
            ..TissueStep::default()
        }
    }

    fn take_job(&mut self) -> Option<Take> {
        let vertex = self.wanted.take()?;
        self.grip
            .is_none()
            .then(|| Take(self.scene.clone(), vertex))
    }

    fn run(Take(scene, vertex): Take) -> Option<Held> {
        scene.held(vertex).ok()
    }

    /// The next step wants its node again.
    fn job_failed(&mut self) {}

    fn install(&mut self, done: Option<Held>) {
        let Some(held) = done else { return };
        // If the tip presses a node by now, that node stays operated.
        if self.grip.is_none() {
            self.state = SpringState::new(&held.model);
            self.workspace = Workspace::new(&held.model);
            self.held = held;
            self.n_held += 1;
        }
    }
}
