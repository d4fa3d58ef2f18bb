//! A world: a scene with its body built, ready to be pressed and shown.
//!
//! [`fit`] adapts a scene for touch before its body is built, [`info`] describes the world to a
//! page, and [`engine`] starts the engine on it.

mod engine;
mod fit;
mod info;

use std::sync::Arc;

use anyhow::Context as _;
use nalgebra::Point3;
use palpa::build::BuiltBody;
use palpa::live::{LiveScene, Ruler, SpringScene};
use palpa::press;
use palpa::{Note, Prepared};
use palpa_fem::Model;
use palpa_fem::lump::Lump as PlacedLump;
use palpa_mesh::{LayeredBody, Surface, Vec3};
use palpa_scene::{ModelKind, Scene};
use palpa_servo::Pose;
use palpa_viewer::control::{self, LayerInfo, LumpInfo, Method, ToolInfo};

use self::fit::fit_for_touch;
use self::info::{layer_infos, lump_infos, tool_info};
use crate::hand::{HOVER, Place, Skin};

pub(crate) use engine::{BEFORE_THE_BROWSER, Running};

/// Deepest press that a page offers, as a multiple of the depth of the scene's motion.
const DEEPEST: f64 = 1.6;

/// A scene with its body built.
#[derive(Debug)]
pub(crate) struct World {
    /// The scene, adapted for touch.
    pub(crate) scene: Scene,
    /// The model of the body.
    pub(crate) method: Method,
    /// The skin at rest.
    pub(crate) skin: Skin,
    /// The same skin, by which places and depths are measured.
    pub(crate) ruler: Arc<Ruler>,
    /// Surfaces of the bones, m.
    pub(crate) bones: Vec<Surface>,
    /// The layers, from the skin down.
    pub(crate) layers: Vec<LayerInfo>,
    /// The lumps as pages show them.
    pub(crate) lumps: Vec<LumpInfo>,
    /// The tool.
    pub(crate) tool: ToolInfo,
    /// The place that the scene presses.
    pub(crate) home: Place,
    /// Pose of the device's frame in the scene.
    pub(crate) scene_from_device: Pose,
    /// Remarks on the scene for a user.
    pub(crate) notes: Vec<Note>,
    kind: Kind,
}

/// The model of the body.
#[derive(Debug)]
enum Kind {
    /// Continuum finite elements.
    Tissue(Box<LiveScene>),
    /// The network of bars.
    Springs(SpringScene),
}

impl World {
    /// Builds the scene's body.
    ///
    /// # Errors
    /// When the scene is not consistent, or not suitable for real time.
    pub(crate) fn build(scene: &Scene) -> anyhow::Result<Self> {
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

    fn of_springs(scene: Scene, mut notes: Vec<Note>) -> anyhow::Result<Self> {
        let springs = SpringScene::build(&scene)?;
        notes.extend(springs.notes.iter().cloned());
        let built = Arc::clone(springs.built());
        let frame = springs.scene_from_device;
        Self::around(scene, &built, frame, notes, Kind::Springs(springs))
    }

    /// Builds the world except for its lumps.
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
            ruler: Arc::new(Ruler::new(body.skin.clone(), scene_from_device)),
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

    /// Start of the hand in a recording, scene's frame, m; a replay of the log starts there too.
    pub(crate) fn beginning(&self) -> Vec3 {
        match &self.kind {
            Kind::Tissue(live) => (self.scene_from_device * Point3::from(live.start)).coords,
            Kind::Springs(springs) => springs.beginning(),
        }
    }

    /// The lumps as the model has them, in the order of `lumps`.
    pub(crate) fn placed(&self) -> &[PlacedLump] {
        match &self.kind {
            Kind::Tissue(live) => live.prepared.lumps(),
            Kind::Springs(_) => &[],
        }
    }

    /// The prepared scene of a body of finite elements.
    pub(crate) fn prepared(&self) -> Option<&Arc<Prepared>> {
        match &self.kind {
            Kind::Tissue(live) => Some(&live.prepared),
            Kind::Springs(_) => None,
        }
    }

    /// Number of nodes of the body that the engine starts with.
    pub(crate) fn n_nodes(&self) -> usize {
        match &self.kind {
            Kind::Tissue(live) => live.model.n_nodes(),
            Kind::Springs(springs) => springs.body().n_nodes(),
        }
    }

    /// The finite elements that the engine starts with.
    pub(crate) fn first_model(&self) -> Option<Arc<Model>> {
        match &self.kind {
            Kind::Tissue(live) => Some(Arc::clone(&live.model)),
            Kind::Springs(_) => None,
        }
    }

    /// The body of a network of bars. A body of finite elements comes with every look instead.
    pub(crate) fn spring_body(&self) -> Option<&LayeredBody> {
        match &self.kind {
            Kind::Tissue(_) => None,
            Kind::Springs(springs) => Some(springs.body()),
        }
    }

    /// The greatest depth that a page offers, m.
    pub(crate) fn greatest_depth(&self) -> f64 {
        (DEEPEST * self.scene.motion.depth).min(self.home.deepest())
    }

    /// The hand at home, over the skin.
    pub(crate) fn home_hand(&self) -> control::Hand {
        control::Hand {
            point: self.home.point.into(),
            normal: self.home.normal.into(),
            depth: -HOVER,
            force: None,
        }
    }
}
