//! A scene in real time: the finite elements behind the engine's [`palpa_rt::Tissue`], in the frame
//! of a device.
//!
//! ```text
//! scene ─► body, fine along the hand's way or where the tool is ─► LiveTissue ─► palpa_rt::Engine ◄─ device in a simulated hand
//! ```
//! The device's frame is the tool's frame where it presses: z points out of the tissue, x along the
//! tool's length. Its origin is the rest position of the tool's tip, [`palpa_scene::Motion::above`]
//! over the first touch.

mod error_bar;
mod fine;
mod hand;
mod machine;
mod moving;
mod prober;
mod record;
mod rehearsal;
mod ruler;
mod springs;
mod watch;

pub use error_bar::{LiveBar, Moment, NoBar, probe};
pub use fine::FineScene;
pub use hand::{across, device_model, grip, once_from, open_device, path, servo_params};
pub use machine::machine;
pub use moving::LiveTissue;
pub use prober::Prober;
pub use record::{FileState, changed_files, notes_of, scene_of};
pub use rehearsal::{RehearsalParams, RehearsalTick, rehearse};
pub use ruler::Ruler;
pub use springs::{SpringScene, SpringTissue};
pub use watch::{Look, Seen, Watch};

use std::sync::Arc;

use anyhow::{Context as _, bail};
use palpa_fem::realtime::{ExteriorMode, FineBodies, Live, LiveParams, Roaming};
use palpa_fem::shape::Tool as RigidTool;
use palpa_fem::{Model, PosedTool};
use palpa_mesh::Vec3;
use palpa_scene::{BelowFirst, Mesh, Scene, Skin as GivenSkin};
use palpa_servo::Pose;

use crate::accuracy::ORDER;
use crate::build::{Pressed, build_for, in_mm};
use crate::note::Note;
use crate::prepare::Prepared;
use crate::press::mesh::{Sizes, along_skin, young_of};
use crate::press::tissue::{note_mesh, note_tension};
use crate::skin::Skin;

/// Radius of the zone as a multiple of contact radius plus depth, its least value as a multiple of what
/// the tool presses, and its least value, m. The factor of the zone is most of the time of a step, so it
/// is no larger than it must be: it contains the contact where the tool is on its way to the next zone. With
/// smaller ones steps are faster still, but forces are up to 5 % off where the exterior of a large body is late.
const ZONE_RADII: f64 = 0.73;
const PRESSED_RADII: f64 = 1.25;
const LEAST_ZONE: f64 = 11e-3;
/// Least radius of a contact that chooses the edges of a larger tool, m: that of a ball of 10 mm.
const LEAST_CONTACT: f64 = 7.1e-3;
/// Width of a zone's ring, in edges under the tool.
const RING: f64 = 2.2;
/// Change of the indentation after which the exterior is brought up to date, m. After a whole millimetre, the
/// force on the way down is up to 2 % off on thin fat instead of 0.7 %.
const STALE: f64 = 0.4e-3;
/// Distance that a tool may move in one step of the tissue, m, so that the force at the device
/// stays within about 2 % of the converged one: see "Force while moving" in docs/realtime.md.
pub const GOOD_TRAVEL: f64 = 0.2e-3;
/// Largest number of nodes. A larger body needs gigabytes, and one step of it takes longer than the
/// age limit of a patch.
const MOST_NODES: usize = 80_000;
/// Default length of the edges under the tool, as a share of its contact radius.
const EDGE_SHARE: f64 = 0.45;
/// Between the default accuracy and this one, edges and heights near the tool hardly change, with this power of
/// the accuracy: in motion, finer ones lose more than they gain. Below and above, they change as all other sizes.
const FINE: f64 = 0.02;
const GENTLE_EXPONENT: f64 = 0.11;
/// Default height of the intervals at the skin, as a share of the contact radius.
const LEVEL_SHARE: f64 = 0.4;
/// Share of the strain that pairs average ([`palpa_scene::Model::alpha()`]), where the scene gives none. Triangles
/// are wide here, and pairs of them too soft with 0.8.
const ALPHA: f64 = 0.65;
/// The same in a first layer that lies over a softer one, which it bends over.
const BENDING_ALPHA: f64 = 0.97;
/// The same in the layers below such a one. Without it the force is 1 % more; but steps over thin fat fail with
/// more than this, or if a pair's prisms may change their volumes against each other at no cost.
const BELOW_BENDING: BelowFirst = BelowFirst {
    alpha: 0.3,
    apart: 0.1,
};
/// Least number of intervals of a layer that is softer than what lies under it, near the tool: with two the force
/// is 3 to 5 % more.
const IN_SQUEEZED: usize = 3;
/// Error of the force, as a share, that the default mesh is made for.
pub const ACCURACY: f64 = 0.03;
/// Distance between the points along the hand's way at which the body is refined, m.
const WAY_STEP: f64 = 4e-3;

/// A scene set up for real time.
#[derive(Debug)]
pub struct LiveScene {
    /// The body with its materials.
    pub model: Arc<Model>,
    /// The tool.
    pub tool: RigidTool,
    /// Pose of the device's frame in the scene: its origin is the rest position of the tool's tip.
    pub scene_from_device: Pose,
    /// Meshes for any place of the tool, if the fine part moves with it; then `model` is the first
    /// of them.
    pub meshes: Option<Arc<FineScene>>,
    /// The scene, with its body, lumps and materials.
    pub prepared: Arc<Prepared>,
    /// Start of the hand, in the device's frame, m.
    pub start: Vec3,
    /// Parameters of the real-time step.
    pub params: LiveParams,
    /// Mean length of the skin's edges near the tool, m.
    pub mesh_size: f64,
    /// Remarks for the user.
    pub notes: Vec<Note>,
}

impl LiveScene {
    /// Grows the scene's body and refines it along the way of the hand.
    ///
    /// # Errors
    /// When the scene does not fit together, or its tool is bonded to the skin.
    pub fn build(scene: &Scene) -> anyhow::Result<Self> {
        let Some(tool) = scene.tool.contact() else {
            bail!(
                "in real time the tool presses by contact, and the scene's is a {}; give [tool] a shape such as \"sphere\", \
                 \"flat-punch\" or \"fingertip\"",
                scene.tool
            );
        };
        let moves = scene.mesh.moves;
        if moves && !scene.mesh.refine {
            bail!(
                "[mesh] moves = true needs refine = true: with refine = false there is no fine mesh to move"
            );
        }
        let asked = &scene.mesh;
        let (scene, sizes) = coarser(scene);
        let scene = &scene;
        let way = if moves { Vec::new() } else { way(scene) };
        let pressed = if moves {
            Pressed::Anywhere
        } else {
            Pressed::Along(&way)
        };
        let grown = build_for(scene, MOST_NODES, pressed).context("in real time")?;
        let grown = Arc::new(grown);
        let prepared = Arc::new(Prepared::with_sizes(scene, grown, sizes, &way)?);
        // The loop begins at rest, as the press does. Without tension that is the undeformed mesh,
        // so there is nothing to solve.
        let rest = if prepared.is_tense() {
            Some(prepared.rest()?)
        } else {
            None
        };
        let approach = prepared.approach(tool, rest.as_ref())?;
        let posed = approach.at(-scene.motion.above);
        let start = hand::beginning(scene, &posed.pose);
        let meshes = if moves {
            Some(Arc::new(FineScene::new(Arc::clone(&prepared))?))
        } else {
            None
        };
        let model = match &meshes {
            Some(meshes) => {
                let at = posed.pose.translation.vector;
                meshes.model(meshes.place(at))?
            }
            None => prepared.model()?,
        };
        let mesh = &prepared.mesh;
        if model.n_nodes() > MOST_NODES {
            bail!(
                "{} nodes are more than the {MOST_NODES} that can be pressed in real time; make the mesh coarser: \
                 [mesh] near_tool is {:.1} mm under the tool now",
                model.n_nodes(),
                1e3 * mesh.mesh_size
            );
        }
        let mut notes = prepared.notes.clone();
        note_mesh(&model, mesh, scene, &mut notes);
        note_tension(&mesh.body, scene, &mut notes);
        note_accuracy(asked, &mut notes);
        check_way(scene, &prepared, &mut notes)?;
        Ok(Self {
            start,
            meshes,
            mesh_size: mesh.mesh_size,
            params: LiveParams {
                zone_radius: zone_radius(scene),
                exterior: ExteriorMode::Linear,
                stale: STALE,
                ..LiveParams::default()
            },
            model,
            tool: posed.tool,
            scene_from_device: posed.pose,
            notes,
            prepared,
        })
    }

    /// The tissue at rest.
    ///
    /// # Errors
    /// When the body cannot be factored.
    pub fn tissue(&self) -> anyhow::Result<LiveTissue> {
        // The scene's hand moves about the origin.
        self.tissue_round(Vec3::zeros(), self.start)
    }

    /// The tissue at rest, with the device at `start` (in its own frame, m) instead of the start of
    /// the scene's hand.
    ///
    /// # Errors
    /// When the body cannot be factored.
    pub fn tissue_at(&self, start: Vec3) -> anyhow::Result<LiveTissue> {
        self.tissue_round(start, start)
    }

    /// As [`Self::tissue_at`], with the fine part of a mesh that moves around `middle` first.
    fn tissue_round(&self, middle: Vec3, start: Vec3) -> anyhow::Result<LiveTissue> {
        let tools = [self.posed(start)];
        let body = match &self.meshes {
            Some(meshes) => {
                let at = self.posed(middle).pose.translation.vector;
                Roaming::new(Arc::<FineScene>::clone(meshes), &tools, self.params, at)?
            }
            None => Roaming::fixed(Live::new(Arc::clone(&self.model), &tools, self.params)?),
        };
        Ok(LiveTissue::new(
            body,
            vec![self.tool],
            self.scene_from_device,
            self.params.tolerance,
        ))
    }

    /// The tool at its pose if the device is at `position`, in the device's frame, m.
    pub fn posed(&self, position: Vec3) -> PosedTool {
        PosedTool {
            tool: self.tool,
            pose: self.scene_from_device * Pose::translation(position.x, position.y, position.z),
        }
    }
}

/// The scene with a coarser mesh than that of a scripted press, which may take its time, where it gives
/// no sizes: edges of 0.45 contact radii under the tool that soon grow beside it, and levels as low as in
/// a press; docs/realtime.md has the errors. With half the growth of the edges they are the same; with one
/// level less in soft fat, or one for the muscle, the force is 2 to 3 % more. Prisms that a lump cuts have
/// its share of the stiffness, so they need not be smaller than the lump. If the scene asks for an accuracy,
/// all these sizes are smaller or larger. A skin from a file is coarsened where it is finer than that; one
/// made by formula has the spacing that the scene asks for. If the scene gives the length of the edges under
/// the tool, the levels there are as high as that too, and all else stays as by default. Returns the sizes
/// near the tool with it: intervals deeper than one and a half contact radii may be a little higher than in
/// a press.
fn coarser(scene: &Scene) -> (Scene, Option<Sizes>) {
    const EDGE_GROWTH: f64 = 1.2;
    const LUMP_SHARE: f64 = 1.5;
    const DEEP: f64 = 1.2;
    let mut scene = scene.clone();
    choose_alpha(&mut scene);
    let contact = contact_radius(&scene);
    let mesh = &mut scene.mesh;
    let is_from_file = matches!(scene.body.skin, GivenSkin::File(_));
    mesh.coarsen.get_or_insert(is_from_file && mesh.refine);
    let accuracy = mesh.accuracy.unwrap_or(ACCURACY);
    let (scale, near) = (scale_for(accuracy), scale_near_tool(accuracy));
    let shallow = contact / scene.tool.contact_radius();
    let height = mesh.near_tool_at(&scene.tool, shallow * near * LEVEL_SHARE);
    mesh.near_tool = mesh.near_tool_at(&scene.tool, shallow * near * EDGE_SHARE);
    let is_graded = mesh.growth.is_some() || mesh.level_growth.is_some();
    if mesh.growth.is_none() {
        mesh.growth = Some(EDGE_GROWTH);
        mesh.level_growth.get_or_insert(near * Mesh::GROWTH);
    }
    if mesh.near_lumps.is_none() {
        let lumps = scene.lumps.iter();
        let radii = lumps.filter_map(|lump| lump.shape.smallest_radius());
        mesh.near_lumps = radii.reduce(f64::min).map(|r| scale * LUMP_SHARE * r);
    }
    // One vertex more than allowed, so that a mesh that is too fine is refused rather than silently
    // coarsened.
    let n_levels = 1 + scene.layers.iter().map(|l| l.levels).sum::<usize>();
    mesh.max_vertices = mesh.max_vertices.min(MOST_NODES / n_levels + 1);
    let sizes = Sizes::of(&scene).map(|mut sizes| {
        sizes.levels.h = height.unwrap_or(sizes.levels.h);
        sizes.levels.border *= shallow;
        sizes.divides_in_two = true;
        sizes.in_squeezed = IN_SQUEEZED;
        if !is_graded {
            sizes.levels.far = DEEP;
        }
        sizes
    });
    (scene, sizes)
}

/// Sizes for an accuracy, as a share of those for the default one.
fn scale_for(accuracy: f64) -> f64 {
    (accuracy / ACCURACY).powf(1.0 / ORDER)
}

/// The same for edges and heights near the tool.
fn scale_near_tool(accuracy: f64) -> f64 {
    let gentle = |accuracy: f64| (accuracy / ACCURACY).powf(GENTLE_EXPONENT);
    gentle(accuracy)
        .min(gentle(FINE) * (accuracy / FINE).powf(1.0 / ORDER))
        .max(scale_for(accuracy))
}

/// Adds a note where sizes near the tool are larger than an accuracy asks for.
fn note_accuracy(mesh: &Mesh, notes: &mut Vec<Note>) {
    if let Some(accuracy) = mesh.accuracy.filter(|_| mesh.near_tool.is_none()) {
        let (asked, made) = (scale_for(accuracy), scale_near_tool(accuracy));
        if made > asked {
            notes.push(Note::AccuracyTooFine {
                accuracy,
                asked: 1.0 - asked,
                made: 1.0 - made,
            });
        }
    }
}

/// Chooses the share of the strain that pairs average, where the scene gives none.
fn choose_alpha(scene: &mut Scene) {
    if scene.model.alpha.is_some() {
        return;
    }
    let bends = young_of(scene, 0)
        .zip(young_of(scene, 1))
        .is_some_and(|(own, under)| own > under);
    let (alpha, below) = if bends {
        (BENDING_ALPHA, Some(BELOW_BENDING))
    } else {
        (ALPHA, None)
    };
    scene.model.alpha = Some(alpha);
    scene.model.below = below;
}

/// Radius of the contact at the hand's depth, m, but no less than one that hands can be followed with: edges are a
/// share of it.
fn contact_radius(scene: &Scene) -> f64 {
    let radius = scene.tool.contact_radius();
    scene.tool.contact().map_or(radius, |tool| {
        let here = tool.shape.contact_radius_at(scene.motion.depth);
        here.max(LEAST_CONTACT).min(radius)
    })
}

/// Radius of a zone that contains the contact at the hand's depth, m. A flat face presses with its edge at
/// once, which must then lie within the ring.
fn zone_radius(scene: &Scene) -> f64 {
    let (radius, pressed) = (contact_radius(scene), fine::pressed_radius(scene));
    let edge = scene.mesh.near_tool.filter(|_| scene.tool.is_flat());
    (ZONE_RADII * (radius + scene.motion.depth))
        .max(PRESSED_RADII * pressed)
        .max(edge.map_or(0.0, |edge| pressed + RING * edge))
        .max(LEAST_ZONE)
}

/// Positions of the tool along its way across the skin, relative to the pressed place, m.
fn way(scene: &Scene) -> Vec<f64> {
    if !scene.motion.kind.goes_across() {
        return vec![0.0];
    }
    let half = 0.5 * scene.motion.length;
    let n = (half / WAY_STEP).ceil().max(1.0) as i32;
    (-n..=n)
        .map(|i| half * f64::from(i) / f64::from(n))
        .collect()
}

/// Adds a note if the hand's way leaves the skin, and fails if the way goes deeper than the tissue.
fn check_way(scene: &Scene, prepared: &Prepared, notes: &mut Vec<Note>) -> anyhow::Result<()> {
    let (body, place) = (&prepared.grown.growth.body, prepared.place());
    let along = along_skin(scene, &place.direction);
    let skin = Skin::new(&body.skin);
    let depth = scene.motion.depth;
    for far in way(scene) {
        let over = prepared.grown.press_at + along * far;
        let Some(nearest) = skin.nearest(over) else {
            continue;
        };
        if (nearest.at - over).norm() > depth {
            notes.push(Note::MotionOffSkin {
                far,
                length: scene.motion.length,
            });
            break;
        }
        let thickness = nearest.column_length(body);
        if depth >= thickness {
            bail!(
                "[motion] depth = \"{:.1} mm\" reaches beyond the body: at ({}) mm the tissue is {:.1} mm deep; press less deep, or \
                 at another place",
                depth * 1e3,
                in_mm(nearest.at),
                thickness * 1e3
            );
        }
    }
    Ok(())
}
