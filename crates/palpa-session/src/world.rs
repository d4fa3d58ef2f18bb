//! A scene made ready to be pressed and looked at.

use std::sync::Arc;

use anyhow::Context as _;
use nalgebra::Point3;
use palpa_device::{HapticDevice, LiveTarget, SimulatedDevice};
use palpa_fem::Model;
use palpa_fem::lump::{Lump as PlacedLump, LumpShape};
use palpa_mesh::{LayeredBody, Surface, Vec3};
use palpa_rt::{Engine, EngineParams, Priority, Reader, RecorderParams, TissueParams, Wish};
use palpa_scene::{ContactShape, ContactTool, MaterialStatus, ModelKind, Scene, Tool};
use palpa_servo::{Pose, ServoParams};
use palpa_viewer::control::{self, LayerInfo, LumpForm, LumpInfo, Method, ToolForm, ToolInfo};

use crate::hand::{HOVER, Place, Skin};
use palpa::Note;
use palpa::build::BuiltBody;
use palpa::live::{LiveScene, Look, SpringScene, Watch, device_model, grip};
use palpa::press;

/// Looks at the body: as often as a screen shows them, s.
const LOOK_PERIOD: f64 = 1.0 / 60.0;
/// Steps of the tissue are this far apart at least, s: who looks on needs the processor as well.
const STEP_PERIOD: f64 = 2e-3;
/// A browser without a graphics card takes all cores that it gets; the force comes first, where the system lets it.
pub(super) const BEFORE_THE_BROWSER: Wish = Wish {
    priority: Priority::Nice(-10),
    core: None,
};
/// Edges under the tool and in lumps where a scene says nothing of them, m: so many nodes as a hand can be followed with.
const LEAST_EDGE: f64 = 3e-3;
const NEAR_LUMPS: f64 = 6e-3;
/// Least size of what stands for a bonded tool, m.
const LEAST_TOOL: f64 = 5e-3;
/// Deepest press that a page offers, as a multiple of that of the scene's motion.
const DEEPEST: f64 = 1.6;

/// A scene with its body built.
#[derive(Debug)]
pub struct World {
    /// The scene.
    pub scene: Scene,
    /// How it answers.
    pub method: Method,
    /// The skin at rest.
    pub skin: Skin,
    /// The bones, m.
    pub bones: Vec<Surface>,
    /// The layers, in words and numbers.
    pub layers: Vec<LayerInfo>,
    /// The lumps.
    pub lumps: Vec<LumpInfo>,
    /// What presses.
    pub tool: ToolInfo,
    /// Where the scene presses.
    pub home: Place,
    /// Where the device's frame is.
    pub scene_from_device: Pose,
    /// What a user should know.
    pub notes: Vec<Note>,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    Tissue(Box<LiveScene>),
    Springs(SpringScene),
}

/// What runs, and the window on it.
#[derive(Debug)]
pub struct Running {
    /// The engine.
    pub engine: Engine,
    /// Where the tissue leaves its looks.
    pub looks: Reader<Look>,
    /// Where the hand wants the device, in the device's frame.
    pub target: LiveTarget,
}

impl World {
    /// Builds the scene's body.
    ///
    /// # Errors
    /// When the scene does not fit together or is not fit for real time.
    pub fn build(scene: &Scene) -> anyhow::Result<Self> {
        let mut notes = Vec::new();
        let scene = fit_for_touch(scene, &mut notes);
        match scene.model.kind {
            ModelKind::Tissue => Self::of_tissue(scene, notes),
            ModelKind::Reference => Self::of_springs(scene, notes),
        }
    }

    fn of_tissue(scene: Scene, mut notes: Vec<Note>) -> anyhow::Result<Self> {
        let live = LiveScene::build(&scene)?;
        notes.extend(live.notes.iter().cloned());
        let built = Arc::clone(&live.prepared.grown);
        let lumps = lump_infos(&scene, live.prepared.lumps());
        let frame = live.scene_from_device;
        let kind = Kind::Tissue(Box::new(live));
        let world = Self::around(scene, &built, frame, notes, kind)?;
        Ok(Self { lumps, ..world })
    }

    fn of_springs(scene: Scene, notes: Vec<Note>) -> anyhow::Result<Self> {
        let springs = SpringScene::build(&scene)?;
        let built = Arc::clone(springs.built());
        let frame = springs.scene_from_device;
        Self::around(scene, &built, frame, notes, Kind::Springs(springs))
    }

    /// All that is known of a scene without its lumps.
    fn around(
        scene: Scene,
        built: &BuiltBody,
        scene_from_device: Pose,
        mut notes: Vec<Note>,
        kind: Kind,
    ) -> anyhow::Result<Self> {
        let body = &built.growth.body;
        for note in &built.notes {
            if !notes.contains(note) {
                notes.push(note.clone());
            }
        }
        let thickness = (0..body.n_vertices())
            .map(|v| press::column_length(body, v))
            .collect();
        let skin = Skin::new(body.skin.clone(), thickness);
        let home = skin
            .nearest(built.press_at)
            .context("the skin has no place to press")?;
        Ok(Self {
            method: match kind {
                Kind::Tissue(_) => Method::Tissue,
                Kind::Springs(_) => Method::Reference,
            },
            skin,
            bones: built.bones.clone(),
            layers: layer_infos(&scene, body),
            lumps: Vec::new(),
            tool: tool_info(&scene.tool),
            home,
            scene_from_device,
            notes,
            kind,
            scene,
        })
    }

    /// Starts the engine on the body at rest, with the hand over `place`.
    ///
    /// # Errors
    /// When the body cannot be factored, or the system gives no thread.
    pub fn start(&self, tip: Vec3, recorder: &RecorderParams) -> anyhow::Result<Running> {
        let device = device_model(self.scene.device.preset);
        let in_device = self
            .scene_from_device
            .inverse_transform_point(&Point3::from(tip));
        let target = LiveTarget::new(in_device.coords);
        let hand = SimulatedDevice::live(device, grip(self.scene.device.grip), target.clone());
        let devices: Vec<Box<dyn HapticDevice>> = vec![Box::new(hand)];
        let params = EngineParams {
            servo: ServoParams {
                resolution: device.resolution.max(1e-6),
                ..ServoParams::default()
            },
            tissue: TissueParams {
                min_period: STEP_PERIOD,
                ..TissueParams::default()
            },
            tissue_wish: BEFORE_THE_BROWSER,
            background_wish: BEFORE_THE_BROWSER,
            ..EngineParams::default()
        };
        let (watch, looks) = Watch::new(LOOK_PERIOD);
        let engine = match &self.kind {
            Kind::Tissue(live) => {
                let tissue = live.tissue_at(in_device.coords)?.watched(watch);
                Engine::start(tissue, devices, &params, recorder)?
            }
            Kind::Springs(springs) => {
                let tissue = springs.tissue(tip, Some(watch))?;
                Engine::start(tissue, devices, &params, recorder)?
            }
        };
        Ok(Running {
            engine,
            looks,
            target,
        })
    }

    /// Where the hand of a recording begins, in the scene's frame: where a replay of the scene begins as well.
    pub fn beginning(&self) -> Vec3 {
        match &self.kind {
            Kind::Tissue(live) => (self.scene_from_device * Point3::from(live.start)).coords,
            Kind::Springs(springs) => springs.beginning(),
        }
    }

    /// The lumps in their places.
    pub fn placed(&self) -> &[PlacedLump] {
        match &self.kind {
            Kind::Tissue(live) => live.prepared.lumps(),
            Kind::Springs(_) => &[],
        }
    }

    /// Nodes of the body, before what is fine moves.
    pub fn n_nodes(&self) -> usize {
        match &self.kind {
            Kind::Tissue(live) => live.model.n_nodes(),
            Kind::Springs(springs) => springs.body().n_nodes(),
        }
    }

    /// The body of finite elements that the engine begins with.
    pub fn first_model(&self) -> Option<Arc<Model>> {
        match &self.kind {
            Kind::Tissue(live) => Some(Arc::clone(&live.model)),
            Kind::Springs(_) => None,
        }
    }

    /// The body of a network of bars; of finite elements it comes with every look.
    pub fn spring_body(&self) -> Option<&LayeredBody> {
        match &self.kind {
            Kind::Tissue(_) => None,
            Kind::Springs(springs) => Some(springs.body()),
        }
    }

    /// The greatest depth that a page offers, m.
    pub fn greatest_depth(&self) -> f64 {
        (DEEPEST * self.scene.motion.depth).min(self.home.deepest())
    }

    /// Size of the tool, m.
    pub fn tool_size(&self) -> f64 {
        match self.tool.shape {
            ToolForm::Sphere { radius } | ToolForm::FlatPunch { radius, .. } => radius,
            ToolForm::Capsule { radius, length } => radius + 0.5 * length,
            ToolForm::Box { size, .. } => 0.5 * size[0].max(size[1]),
            ToolForm::Fingertip { radii } => radii[0].max(radii[1]),
            ToolForm::Node => 0.0,
        }
    }

    /// Where the hand is at home, over the skin.
    pub fn home_hand(&self) -> control::Hand {
        control::Hand {
            point: self.home.point.into(),
            normal: self.home.normal.into(),
            depth: -HOVER,
        }
    }

    /// Young's modulus at small strain of every prism of a body, Pa; N/m of bars. `[n_prisms]`
    pub fn stiffness(&self, body: &LayeredBody, shows_lumps: bool) -> Vec<f32> {
        let lumps = if shows_lumps { self.placed() } else { &[] };
        let n_intervals = body.n_levels - 1;
        let mut all = Vec::with_capacity(body.n_prisms());
        for t in 0..body.skin.triangles.len() {
            for i in 0..n_intervals {
                let mut young = self.layers[body.interval_layer[i]].stiffness;
                let corners = body.prism(t, i);
                let middle = corners.iter().map(|&n| body.positions[n]).sum::<Vec3>() / 6.0;
                for (lump, info) in lumps.iter().zip(&self.lumps) {
                    young += lump.fraction(&middle) * (info.stiffness - young);
                }
                all.push(young as f32);
            }
        }
        all
    }
}

/// The scene as it can be touched: by contact, and fine where the hand goes.
fn fit_for_touch(scene: &Scene, notes: &mut Vec<Note>) -> Scene {
    let mut scene = scene.clone();
    if scene.model.kind == ModelKind::Reference {
        return scene;
    }
    let shape = match scene.tool {
        Tool::Contact(_) => None,
        Tool::Disc { radius } => Some(ContactShape::FlatPunch {
            radius,
            edge_radius: 0.3 * radius,
        }),
        Tool::Node => Some(ContactShape::Sphere { radius: LEAST_TOOL }),
    };
    if let Some(shape) = shape {
        let tool = Tool::Contact(ContactTool {
            shape,
            friction: 0.0,
            axis: None,
        });
        notes.push(Note::ToolReplaced {
            tool: scene.tool.to_string(),
            by: tool.to_string(),
        });
        scene.tool = tool;
    }
    scene.mesh.moves |= scene.mesh.refine;
    let usual = scene.mesh.near_tool_of(&scene.tool);
    if scene.mesh.refine && scene.mesh.near_tool.is_none() {
        let fine = (scene.tool.contact_radius() / 3.0).max(LEAST_EDGE);
        scene.mesh.near_tool = Some(fine);
        if usual.is_some_and(|usual| 1.5 * usual < fine) {
            notes.push(Note::CoarserForTouch { edge: fine });
        }
    }
    if scene.mesh.near_lumps.is_none() {
        scene.mesh.near_lumps = Some(NEAR_LUMPS);
    }
    scene
}

fn layer_infos(scene: &Scene, body: &LayeredBody) -> Vec<LayerInfo> {
    let status = scene.material_status();
    let mut thickness = vec![0.0; scene.layers.len()];
    for v in 0..body.n_vertices() {
        for (i, &layer) in body.interval_layer.iter().enumerate() {
            let [above, below] = [i, i + 1].map(|l| body.positions[body.node(v, l)]);
            thickness[layer] += (below - above).norm() / body.n_vertices() as f64;
        }
    }
    status
        .into_iter()
        .zip(thickness)
        .map(|(status, thickness)| LayerInfo {
            stiffness: stiffness_of(&status),
            law: status.law.to_owned(),
            name: status.tissue,
            thickness,
        })
        .collect()
}

fn stiffness_of(status: &MaterialStatus) -> f64 {
    status.young.or(status.spring).unwrap_or(0.0)
}

fn lump_infos(scene: &Scene, placed: &[PlacedLump]) -> Vec<LumpInfo> {
    let status = scene.lump_status();
    scene
        .lumps
        .iter()
        .zip(placed)
        .zip(status)
        .map(|((lump, placed), status)| {
            let axes = placed.pose().rotation.to_rotation_matrix();
            LumpInfo {
                name: lump.name.clone(),
                shape: match placed.shape() {
                    LumpShape::Sphere(sphere) => LumpForm::Ellipsoid {
                        radii: [sphere.radius(); 3],
                    },
                    LumpShape::Ellipsoid(ellipsoid) => LumpForm::Ellipsoid {
                        radii: ellipsoid.radii().into(),
                    },
                    LumpShape::Capsule(capsule) => LumpForm::Capsule {
                        radius: capsule.radius(),
                        length: capsule.length(),
                    },
                    LumpShape::Mesh(_) => LumpForm::Mesh {
                        radius: placed.bounding_sphere().1,
                    },
                },
                centre: placed.pose().translation.vector.into(),
                axes: [0, 1, 2].map(|c| axes.matrix().column(c).into_owned().into()),
                stiffness: stiffness_of(&status),
            }
        })
        .collect()
}

fn tool_info(tool: &Tool) -> ToolInfo {
    let Tool::Contact(tool) = tool else {
        return ToolInfo {
            shape: ToolForm::Node,
            friction: 0.0,
        };
    };
    ToolInfo {
        shape: match tool.shape {
            ContactShape::Sphere { radius } => ToolForm::Sphere { radius },
            ContactShape::FlatPunch {
                radius,
                edge_radius,
            } => ToolForm::FlatPunch {
                radius,
                edge_radius,
            },
            ContactShape::Capsule { radius, length } => ToolForm::Capsule { radius, length },
            ContactShape::Box { size, edge_radius } => ToolForm::Box { size, edge_radius },
            ContactShape::Fingertip { radii } => ToolForm::Fingertip { radii },
        },
        friction: tool.friction,
    }
}
