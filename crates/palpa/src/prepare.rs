//! Prepares a scene for pressing: the steps that a scripted press, a live session, a viewer and an
//! export share.
//!
//! ```text
//! Scene ─► GrownBody ─► lumps in their places ─► mesh, refined where it is pressed ─► Model (built when first asked for)
//!          build.rs     continuum.rs             press/mesh.rs
//! ```

use std::sync::{Arc, OnceLock};

use anyhow::bail;
use palpa_fem::lump::Lump;
use palpa_fem::shape::{Pose, Tool as RigidTool};
use palpa_fem::{
    Load, Materials, Model, ModelParams, Outcome, PosedTool, Shares, SolveParams, State, Supports,
    Workspace, advance,
};
use palpa_mesh::growth::MAX_NODES;
use palpa_mesh::{Surface, Vec3};
use palpa_scene::{ContactTool, Scene};

use crate::build::{BuiltBody, Pressed, build_for};
use crate::continuum;
use crate::note::{Note, in_words};
use crate::press::Place;
use crate::press::lump::{lump_shares, surface_of_shape};
use crate::press::mesh::{PressedBody, Sizes};
use crate::touch::Way;

/// Parameters of the preparation.
#[derive(Debug, Clone)]
pub struct PrepareParams {
    /// A body with more nodes than this is refused before it is grown.
    pub max_nodes: usize,
    /// Distances from the pressed place along the scene's motion at which the skin is refined too,
    /// m.
    pub way: Vec<f64>,
}

impl Default for PrepareParams {
    fn default() -> Self {
        Self {
            max_nodes: MAX_NODES,
            way: Vec::new(),
        }
    }
}

/// A scene with its body grown and refined, and its lumps and materials in place.
#[derive(Debug)]
pub struct Prepared {
    /// The scene.
    pub scene: Scene,
    /// The body as it was grown, with its bones.
    pub grown: Arc<BuiltBody>,
    /// Materials of the layers, then of the lumps, and the placed lumps.
    pub materials: Arc<Materials>,
    /// The refined body, and the place that is pressed.
    pub mesh: PressedBody,
    /// The supports: which nodes of the body are fixed.
    pub supports: Supports,
    /// Remarks for the user, in the order in which they arose.
    pub notes: Vec<Note>,
    /// For each lump that is a mesh, its surface in its place at rest, m; else `None`.
    drawn: Vec<Option<Surface>>,
    model: OnceLock<Arc<Model>>,
    /// The state at rest of a body under tension.
    rest: OnceLock<State>,
}

impl Prepared {
    /// Grows the scene's body and refines it where it is pressed.
    ///
    /// # Errors
    /// When a file cannot be read, the body cannot be grown, or place, depth, tissues or lumps do
    /// not fit it.
    pub fn build(scene: &Scene) -> anyhow::Result<Self> {
        Self::with_params(scene, &PrepareParams::default())
    }

    /// As [`Self::build`], with other parameters.
    ///
    /// # Errors
    /// As [`Self::build`].
    pub fn with_params(scene: &Scene, params: &PrepareParams) -> anyhow::Result<Self> {
        let grown = build_for(scene, params.max_nodes, Pressed::Along(&params.way))?;
        Self::on(scene, Arc::new(grown), &params.way)
    }

    /// As [`Self::build`], on a body already grown for this scene. `way` is [`PrepareParams::way`],
    /// m.
    ///
    /// # Errors
    /// When place, depth, tissues or lumps do not fit the body.
    pub fn on(scene: &Scene, grown: Arc<BuiltBody>, way: &[f64]) -> anyhow::Result<Self> {
        Self::with_sizes(scene, grown, Sizes::of(scene), way)
    }

    /// As [`Self::on`], with other sizes of the mesh near the tool.
    ///
    /// # Errors
    /// As [`Self::on`].
    pub fn with_sizes(
        scene: &Scene,
        grown: Arc<BuiltBody>,
        sizes: Option<Sizes>,
        way: &[f64],
    ) -> anyhow::Result<Self> {
        let mut notes = grown.notes.clone();
        let materials = continuum::materials(scene)?;
        let lumps = continuum::lumps(scene, &grown, &mut notes)?;
        let (lumps, drawn): (Vec<Lump>, Vec<Option<Surface>>) = lumps.into_iter().unzip();
        let mesh = PressedBody::build(scene, &grown, &lumps, sizes, way, &mut notes)?;
        let supports = continuum::supports(scene.body.cut_faces, &mesh.body, &mut notes);
        Ok(Self {
            scene: scene.clone(),
            grown,
            materials: Arc::new(Materials {
                materials,
                layers: (0..scene.layers.len()).collect(),
                lumps,
                stiffness: None,
            }),
            mesh,
            supports,
            notes,
            drawn,
            model: OnceLock::new(),
            rest: OnceLock::new(),
        })
    }

    /// The same tissues on another mesh of the body, whose finite elements exist already, pressed
    /// at another place. `scene` is the present one with another tool's axis, place or depth.
    pub(crate) fn on_mesh(&self, scene: Scene, model: &Arc<Model>, place: Place) -> Self {
        let body = model.body().clone();
        Self {
            supports: continuum::supports(scene.body.cut_faces, &body, &mut Vec::new()),
            mesh: PressedBody::refined_before(&scene, body, place),
            grown: Arc::clone(&self.grown),
            materials: Arc::clone(&self.materials),
            notes: Vec::new(),
            drawn: self.drawn.clone(),
            model: Arc::clone(model).into(),
            rest: OnceLock::new(),
            scene,
        }
    }

    /// The same body on the same mesh, with the tissues of the layers in place of the lumps.
    pub(crate) fn without_lumps(&self) -> Self {
        let scene = Scene {
            lumps: Vec::new(),
            ..self.scene.clone()
        };
        Self {
            grown: Arc::clone(&self.grown),
            materials: Arc::new(Materials {
                materials: self.materials.materials.clone(),
                layers: self.materials.layers.clone(),
                lumps: Vec::new(),
                stiffness: None,
            }),
            mesh: self.mesh.clone(),
            supports: self.supports.clone(),
            notes: Vec::new(),
            drawn: Vec::new(),
            model: OnceLock::new(),
            rest: OnceLock::new(),
            scene,
        }
    }

    /// The place that the scene presses.
    pub fn place(&self) -> &Place {
        &self.mesh.place
    }

    /// The placed lumps, in the order of the scene.
    pub fn lumps(&self) -> &[Lump] {
        &self.materials.lumps
    }

    /// Surface of each lump at rest, m.
    pub fn lump_surfaces(&self) -> Vec<Surface> {
        (self.lumps().iter().zip(&self.drawn))
            .map(|(lump, drawn)| drawn.clone().unwrap_or_else(|| surface_of_shape(lump)))
            .collect()
    }

    /// Share of each prism's volume that belongs to lumps; empty without lumps. `[n_prisms]`
    pub fn lump_shares(&self) -> Vec<f64> {
        lump_shares(&self.mesh.body, self.lumps())
    }

    /// The finite elements of the refined body; built on the first call.
    ///
    /// # Errors
    /// When the body cannot be pressed.
    pub fn model(&self) -> anyhow::Result<Arc<Model>> {
        if let Some(model) = self.model.get() {
            return Ok(Arc::clone(model));
        }
        let params = element_params(&self.scene);
        let model = Model::build(&self.mesh.body, &self.materials, &self.supports, params)?;
        Ok(Arc::clone(self.model.get_or_init(|| Arc::new(model))))
    }

    /// Tolerances of a step's equilibrium.
    pub fn solve_params(&self) -> SolveParams {
        SolveParams {
            tolerance: self.scene.model.tolerance,
            ..SolveParams::default()
        }
    }

    /// Whether any layer has tension at rest.
    pub fn is_tense(&self) -> bool {
        self.scene.layers.iter().any(|layer| layer.prestress != 0.0)
    }

    /// The state before anything presses: in equilibrium with the tension of the layers, relaxed. That is
    /// solved for on the first call.
    ///
    /// # Errors
    /// When the body cannot be pressed, or no equilibrium at rest is found.
    pub fn rest(&self) -> anyhow::Result<State> {
        let model = self.model()?;
        let mut state = State::new(&model);
        if !self.is_tense() {
            return Ok(state);
        }
        if let Some(rest) = self.rest.get() {
            return Ok(rest.clone());
        }
        let mut ws = Workspace::new(&model);
        let load = Load {
            duration: f64::INFINITY,
            ..Load::default()
        };
        let params = self.solve_params();
        let report = advance(
            &model,
            &mut state,
            &mut ws,
            &Load::default(),
            &load,
            &params,
        );
        if report.outcome != Outcome::Converged {
            bail!(
                "the body has no equilibrium under the pre-stress of its layers: {}; make `prestress` smaller, or hold the body with \
                 cut_faces = \"fixed\"",
                in_words(&report.outcome)
            );
        }
        Ok(self.rest.get_or_init(|| state).clone())
    }

    /// The straight way of the scene's tool, or of another one, down to the place. `rest` is the
    /// body's state at rest; it is needed only if a layer has tension.
    ///
    /// # Errors
    /// When the sizes of the tool do not give a valid shape.
    pub fn approach(&self, tool: &ContactTool, rest: Option<&State>) -> anyhow::Result<Approach> {
        let place = self.place();
        let direction = place.direction.into_inner();
        // Tension may have moved the skin, and the place with it.
        let body = &self.mesh.body;
        let moved = |v: usize| match rest {
            Some(rest) => rest.displacements[body.node(v, 0)],
            None => Vec3::zeros(),
        };
        let tip = place.at + place.point.mean(moved);
        let (tool, pose) = continuum::tool(tool, direction, tip)?;
        let points: Vec<Vec3> = (body.skin.points.iter().enumerate())
            .map(|(v, p)| p + moved(v))
            .collect();
        // The far side of the body is not in the way.
        let facing = (body.skin.triangles.iter())
            .map(|corners| corners.map(|v| points[v as usize]))
            .filter(|[a, b, c]| (b - a).cross(&(c - a)).dot(&direction) < 0.0);
        let way = Way {
            tool: &tool,
            pose: &pose,
            direction,
        };
        let touch = way.first_touch(facing);
        Ok(Approach {
            tool,
            pose,
            direction,
            touch,
        })
    }
}

/// The straight way of a tool down to the skin.
#[derive(Debug, Clone, Copy)]
pub struct Approach {
    /// The tool.
    pub tool: RigidTool,
    /// Pose of the tool with its tip at the place at rest.
    pose: Pose,
    /// Unit vector of its movement.
    direction: Vec3,
    /// Distance along the way from `pose` to the first touch of the skin's triangles, m: 0 or
    /// negative.
    touch: f64,
}

impl Approach {
    /// The tool at a depth below the first touch, m; a negative depth is above it.
    pub fn at(&self, depth: f64) -> PosedTool {
        let way = self.direction * (self.touch + depth);
        let translation = self.pose.translation.vector + way;
        PosedTool {
            tool: self.tool,
            pose: Pose::from_parts(translation.into(), self.pose.rotation),
        }
    }
}

/// Parameters of a scene's elements.
pub(crate) fn element_params(scene: &Scene) -> ModelParams {
    let below = scene.model.below();
    ModelParams {
        first: Shares {
            alpha: scene.model.alpha(),
            apart: 0.0,
        },
        below: Shares {
            alpha: below.alpha,
            apart: below.apart,
        },
    }
}
