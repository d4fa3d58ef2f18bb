//! The static force at poses of the loop, solved again on meshes that are finer than the loop's: how
//! wrong the force of the loop is.
//!
//! ```text
//!  poses of the tool ─► two meshes finer than the loop's round them ─► static steps along the way ─► forces
//! ```
//! The second mesh has every interval halved, and a third of what that changes is added to its force.
//! Tissue that neither relaxes nor rubs has one equilibrium at each pose, so it is pressed straight from
//! above on the loop's own mesh, and that state, carried to the finer ones, begins their equilibria
//! ([`Reference::press`]). Else the way to the pose matters, and [`Reference::follow`] goes it again in
//! quasi-static steps.

mod carry;

use std::sync::Arc;

use palpa_fem::{
    Load, Model, Outcome, PosedTool, SolveParams, State, StepReport, Workspace, advance,
    equilibrate,
};
use palpa_mesh::{SurfaceIndex, Vec3};
use palpa_scene::{Scene, Target};

use crate::Prepared;
use crate::build::{BuiltBody, nearest};
use crate::press::mesh::{Sizes, along_skin};

/// Edges of a reference mesh under the tool, as a share of the contact radius: 1.3 mm for a ball of 10 mm. On
/// flat layers the force is then up to 1.1 % above an axisymmetric solution at 3 to 5 mm, 1.5 % at 2 mm.
pub const REFERENCE_SHARE: f64 = 0.22;
/// The mesh that judges a reference has sizes this many times those of the reference.
const FINER: f64 = 0.7;
/// Where the way matters, the longest way of the tool between two static steps, m, and if tissue
/// relaxes, the longest time between them, s. The static solver divides steps of tools with friction
/// itself.
pub const LONGEST_WAY: f64 = 1e-3;
/// See [`LONGEST_WAY`].
pub const LONGEST_TIME: f64 = 0.05;
/// Poses are audited where the force is at least this share of the largest: errors are relative.
pub const LEAST_FORCE: f64 = 0.2;
/// The sizes are those for a tool at this depth, m, or smaller, as its circle in the skin is.
const FULL_DEPTH: f64 = 5e-3;
/// Growth of the edges with the distance from the tool.
const GROWTH: f64 = 0.7;
/// Heights at the skin before they are halved, as a multiple of the edges there, and their growth.
const HEIGHT: f64 = 2.0;
const LEVEL_GROWTH: f64 = 0.8;
/// Share of the strain that pairs average. Thin intervals of soft tissue that is squeezed flat give way
/// in their mesh with more.
const ALPHA: f64 = 0.5;
/// Forces out of balance that a static step may leave, as a share of the tool's.
const TOLERANCE: f64 = 1e-4;
/// The same on the way to a pose, where only the pose matters.
const ON_THE_WAY: f64 = 3e-2;
/// A mesh is fine at least as far round as a tool at this depth presses, m.
const LEAST_DEPTH: f64 = 1e-3;
/// A mesh with more nodes is not used: it would take minutes for a press.
const MOST_NODES: usize = 60_000;
/// Distance between the points along a way at which a mesh is fine, m.
const WAY_STEP: f64 = 4e-3;
/// Heights above the pose at which a straight press solves for the equilibrium on its way, m. It
/// begins higher than any press is deep; in the air a step costs nothing.
const HEIGHTS: [f64; 7] = [50e-3, 7.5e-3, 6e-3, 4.5e-3, 3e-3, 1.5e-3, 0.0];

/// Longest edges of a reference under the tool, as a share of those of the loop.
const FINER_THAN_LOOP: f64 = 0.6;

/// Meshes of a body round some places, and what is needed to press them.
#[derive(Debug)]
pub struct Reference {
    on_loop: Mesh,
    finer: Option<Finer>,
}

/// Meshes that are finer than the loop's.
#[derive(Debug)]
struct Finer {
    mesh: Mesh,
    /// The same with every interval divided in two: what the force changes by with it, it still lacks a
    /// third of ([`extrapolated`]).
    halved: Mesh,
}

/// Static forces of the tissue on a tool, N, in the scene's frame; `None` where no equilibrium was
/// found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pressed {
    /// The best that the reference knows.
    pub force: Option<Vec3>,
    /// On the loop's own mesh.
    pub on_loop: Option<Vec3>,
}

/// A mesh, and what is needed to press it.
#[derive(Debug)]
struct Mesh {
    model: Arc<Model>,
    rest: State,
    params: SolveParams,
    /// Mean length of the skin's edges near the tool, m.
    size: f64,
}

/// A pose of the tool at a time, s.
#[derive(Debug, Clone, Copy)]
pub struct Stop {
    /// The tool with its pose in the scene's frame.
    pub tool: PosedTool,
    /// Time, s. Only differences matter, and only for tissue that relaxes.
    pub time: f64,
}

impl Reference {
    /// The mesh of a scene as it is, such as that of the loop, and no finer ones.
    ///
    /// # Errors
    /// When the body cannot be pressed, or has no equilibrium at rest.
    pub fn on(prepared: &Prepared) -> anyhow::Result<Self> {
        Ok(Self {
            on_loop: Mesh::of(prepared)?,
            finer: None,
        })
    }

    /// Meshes of the body of `of` that are fine round the place of the skin nearest to `at`. `share`
    /// is that of [`REFERENCE_SHARE`].
    ///
    /// # Errors
    /// When the place cannot be pressed, or the mesh would have too many nodes.
    pub fn round(of: &Prepared, at: Vec3, share: f64) -> anyhow::Result<Self> {
        Self::build(of, at, &[at], &[], share)
    }

    /// Meshes of the body of `of` that are fine along the way of these stops across the skin.
    ///
    /// # Errors
    /// As [`Self::round`].
    pub fn along(of: &Prepared, stops: &[Stop], share: f64) -> anyhow::Result<Self> {
        let place = of.place();
        let along = along_skin(&of.scene, &place.direction);
        let far = |stop: &Stop| (stop.tool.pose.translation.vector - place.at).dot(&along);
        let (low, high) = (stops.iter().map(far)).fold((0.0_f64, 0.0_f64), |(low, high), far| {
            (low.min(far), high.max(far))
        });
        let n = ((high - low) / WAY_STEP).ceil() as usize;
        let way: Vec<f64> = (0..=n)
            .map(|i| low + (high - low) * i as f64 / n.max(1) as f64)
            .collect();
        let tips: Vec<Vec3> = (stops.iter())
            .map(|stop| stop.tool.pose.translation.vector)
            .collect();
        Self::build(of, place.at, &tips, &way, share)
    }

    /// `tips` are places of the tool; the deepest says how far round the place and the `way` the mesh
    /// is fine.
    fn build(
        of: &Prepared,
        at: Vec3,
        tips: &[Vec3],
        way: &[f64],
        share: f64,
    ) -> anyhow::Result<Self> {
        let skin = &of.grown.growth.body.skin;
        let index = SurfaceIndex::build(skin);
        let on_skin = |at: Vec3| index.closest(at).map_or(at, |closest| closest.point);
        let depths = tips.iter().map(|tip| (on_skin(*tip) - tip).norm());
        let scene = finer(&of.scene, at, depths.fold(0.0, f64::max));
        let press_at = on_skin(at);
        let grown = Arc::new(BuiltBody {
            press_at,
            press_vertex: nearest(skin, press_at),
            ..(*of.grown).clone()
        });
        // Contact is small where the tool is not deep.
        let circle = |depth: f64| scene.tool.contact().map_or(0.0, |t| t.shape.reach(depth).1);
        let (here, full) = (circle(scene.press.depth), circle(FULL_DEPTH));
        let most = FINER_THAN_LOOP * of.mesh.mesh_size * share / REFERENCE_SHARE;
        let share = share * if here < full { here / full } else { 1.0 };
        // Under a very large tool, a share of its contact may be more than the loop's edges are long.
        let usual = scene.tool.edge_length(share);
        let fit = (most / usual).min(1.0);
        let sized = |share: f64, growth: f64| {
            Sizes::even(&scene, fit * scene.tool.edge_length(share), growth)
        };
        let sizes = Sizes {
            levels: sized(HEIGHT * share, LEVEL_GROWTH).levels,
            in_squeezed: 2,
            ..sized(share, GROWTH)
        };
        let build = |halves_levels: bool| {
            let sizes = Sizes {
                halves_levels,
                ..sizes
            };
            let prepared = Prepared::with_sizes(&scene, Arc::clone(&grown), Some(sizes), way)?;
            let n_nodes = prepared.mesh.body.n_nodes();
            anyhow::ensure!(
                n_nodes <= MOST_NODES,
                "a finer mesh would have {n_nodes} nodes, more than the {MOST_NODES} that are solved for an audit"
            );
            Mesh::of(&prepared)
        };
        Ok(Self {
            on_loop: Mesh::of(of)?,
            finer: Some(Finer {
                mesh: build(false)?,
                halved: build(true)?,
            }),
        })
    }

    /// Number of nodes of the finest mesh.
    pub fn n_nodes(&self) -> usize {
        let finest = (self.finer.as_ref()).map_or(&self.on_loop, |finer| &finer.halved);
        finest.model.n_nodes()
    }

    /// Mean length of the skin's edges near the tool, m.
    pub fn mesh_size(&self) -> f64 {
        let mesh = (self.finer.as_ref()).map_or(&self.on_loop, |finer| &finer.mesh);
        mesh.size
    }

    /// Presses the tool straight along its own axis to its pose. The forces are instantaneous: nothing
    /// relaxes.
    pub fn press(&self, tool: &PosedTool) -> Pressed {
        let on_loop = Walk::from_above(&self.on_loop, tool);
        let of_loop = on_loop.as_ref().map(|(_, force)| *force);
        let force = match &self.finer {
            None => of_loop,
            Some(finer) => finer.press(on_loop.as_ref().map(|(walk, _)| walk), tool),
        };
        Pressed {
            force,
            on_loop: of_loop,
        }
    }

    /// Static forces of the tissue on a tool that goes from stop to stop, N, in the scene's frame.
    /// The first stop must not touch the body. From the first stop without an equilibrium on, and if
    /// `goes_on`, which is asked before each stop, returns false, they are `None`.
    pub fn follow(&self, stops: &[Stop], mut goes_on: impl FnMut() -> bool) -> Vec<Option<Vec3>> {
        let mut forces = vec![None; stops.len()];
        let Some(first) = stops.first() else {
            return forces;
        };
        let (mut coarse, mut fine) = match &self.finer {
            None => (Walk::new(&self.on_loop, *first), None),
            Some(finer) => {
                let [coarse, fine] =
                    [&finer.mesh, &finer.halved].map(|mesh| Walk::new(mesh, *first));
                (coarse, Some(fine))
            }
        };
        for (force, stop) in forces.iter_mut().zip(stops) {
            if !goes_on() {
                break;
            }
            let mut found = coarse.go(*stop, TOLERANCE);
            if let (Some(coarse), Some(fine)) = (found, &mut fine) {
                let fine = fine.go(*stop, TOLERANCE);
                found = fine.map(|fine| extrapolated(coarse, fine));
            }
            if found.is_none() {
                break;
            }
            *force = found;
        }
        forces
    }
}

impl Finer {
    /// The static force on a tool that was pressed to its pose, N; `on_loop` is the same on the loop's
    /// mesh.
    fn press(&self, on_loop: Option<&Walk<'_>>, tool: &PosedTool) -> Option<Vec3> {
        let (coarse, force) = (on_loop.and_then(|other| Walk::beside(other, &self.mesh)))
            .or_else(|| Walk::from_above(&self.mesh, tool))?;
        let (_, fine) = Walk::beside(&coarse, &self.halved)?;
        Some(extrapolated(force, fine))
    }
}

/// The tool drawn back along its own axis, m.
fn above(tool: &PosedTool, height: f64) -> Stop {
    let mut tool = *tool;
    let out = tool.pose.rotation * Vec3::z();
    tool.pose.translation.vector += out * height;
    Stop { tool, time: 0.0 }
}

/// The force on an infinitely fine mesh, from that on a mesh and that with its sizes halved: errors
/// go with their squares.
fn extrapolated(coarse: Vec3, fine: Vec3) -> Vec3 {
    fine + (fine - coarse) / 3.0
}

impl Mesh {
    fn of(prepared: &Prepared) -> anyhow::Result<Self> {
        Ok(Self {
            model: prepared.model()?,
            rest: prepared.rest()?,
            params: prepared.solve_params(),
            size: prepared.mesh.mesh_size,
        })
    }
}

/// A tool on its way over a mesh.
struct Walk<'a> {
    mesh: &'a Mesh,
    state: State,
    ws: Workspace,
    at: Stop,
}

impl<'a> Walk<'a> {
    fn new(mesh: &'a Mesh, at: Stop) -> Self {
        Self {
            mesh,
            state: mesh.rest.clone(),
            ws: Workspace::new(&mesh.model),
            at,
        }
    }

    /// Presses a tool straight to its pose, from above. The walk at its end and the force, N, if an
    /// equilibrium is found.
    fn from_above(mesh: &'a Mesh, tool: &PosedTool) -> Option<(Self, Vec3)> {
        let (last, way) = HEIGHTS.split_last()?;
        let mut walk = Self::new(mesh, above(tool, HEIGHTS[0]));
        for height in way {
            walk.go(above(tool, *height), ON_THE_WAY)?;
        }
        let force = walk.go(above(tool, *last), TOLERANCE)?;
        Some((walk, force))
    }

    /// The same on another mesh of the body, from the state that a walk ended in: all at once.
    fn beside(other: &Walk<'_>, mesh: &'a Mesh) -> Option<(Self, Vec3)> {
        let mut walk = Self::new(mesh, other.at);
        let [from, to] = [&other.mesh.model, &mesh.model].map(|model| model.body());
        walk.state.displacements = carry::carried(from, &other.state.displacements, to);
        if from.skin.points == to.skin.points {
            walk.state.touches.clone_from(&other.state.touches);
        }
        let load = Load {
            tools: &[other.at.tool],
            ..Load::default()
        };
        // A factor of a mesh with intervals halved takes seconds, and the first serves.
        let params = SolveParams {
            tolerance: TOLERANCE,
            is_near: true,
            ..mesh.params
        };
        let report = equilibrate(&mesh.model, &mut walk.state, &mut walk.ws, &load, &params);
        let force = force_of(&report)?;
        Some((walk, force))
    }

    /// Goes on to a stop; the force there, N, if an equilibrium is found.
    fn go(&mut self, to: Stop, tolerance: f64) -> Option<Vec3> {
        let (before, now) = ([self.at.tool], [to.tool]);
        let last = Load {
            tools: &before,
            ..Load::default()
        };
        let load = Load {
            tools: &now,
            duration: to.time - self.at.time,
            ..Load::default()
        };
        let params = SolveParams {
            tolerance,
            ..self.mesh.params
        };
        let model = &self.mesh.model;
        let report = advance(model, &mut self.state, &mut self.ws, &last, &load, &params);
        let force = force_of(&report)?;
        self.at = to;
        Some(force)
    }
}

/// The force on the tool, N, if there is an equilibrium.
fn force_of(report: &StepReport) -> Option<Vec3> {
    let is_there = report.outcome == Outcome::Converged;
    is_there.then(|| report.tool_forces.first().copied())?
}

/// How good a reference is, at one pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// Number of nodes of a mesh with 0.7 times the sizes.
    pub finer_nodes: usize,
    /// Change of the static force on that mesh, as a share of it.
    pub change: f64,
}

impl Quality {
    /// Presses one pose on a reference and on a still finer mesh; `None` if either has no
    /// equilibrium or too many nodes, if the second is not finer, or `goes_on`, which is asked before each
    /// press, returns false.
    pub fn find(
        of: &Prepared,
        tool: &PosedTool,
        mut goes_on: impl FnMut() -> bool,
    ) -> Option<Self> {
        let at = tool.pose.translation.vector;
        let mut press = |times: f64| {
            let mesh = Reference::round(of, at, times * REFERENCE_SHARE).ok()?;
            let force = goes_on().then(|| mesh.press(tool).force)??;
            Some((mesh.n_nodes(), force))
        };
        let ((nodes, usual), (finer_nodes, finer)) = (press(1.0)?, press(FINER)?);
        (finer_nodes > nodes).then(|| Self {
            finer_nodes,
            change: (finer - usual).norm() / finer.norm(),
        })
    }
}

/// Thins a way to static steps, no more than `longest_way` apart, m, and `longest_time`, s, if that
/// matters. Keeps the first stop and those of `kept`, which ascend. Indices, ascending.
pub fn thinned(
    stops: &[Stop],
    kept: &[usize],
    longest_way: f64,
    longest_time: Option<f64>,
) -> Vec<usize> {
    let mut all = vec![0];
    let mut last = 0;
    for i in 1..stops.len() {
        let (from, next) = (&stops[last], &stops[(i + 1).min(stops.len() - 1)]);
        let way = next.tool.pose.translation.vector - from.tool.pose.translation.vector;
        let is_late = longest_time.is_some_and(|longest| next.time - from.time > longest);
        if way.norm() > longest_way || is_late || kept.binary_search(&i).is_ok() {
            all.push(i);
            last = i;
        }
    }
    all
}

/// The quantile `q`, 0 to 1, of values in ascending order: at least this share of them is no larger.
pub fn quantile(ascending: &[f64], q: f64) -> Option<f64> {
    let last = ascending.len().checked_sub(1)?;
    ascending.get((q * last as f64).ceil() as usize).copied()
}

/// Whether the force at a pose depends on the way to it.
pub fn has_history(scene: &Scene) -> bool {
    rubs(scene) || relaxes(scene)
}

/// Whether the tool rubs on the skin.
pub fn rubs(scene: &Scene) -> bool {
    scene.tool.contact().is_some_and(|tool| tool.friction > 0.0)
}

/// Whether a tissue of the scene relaxes.
pub fn relaxes(scene: &Scene) -> bool {
    let of_layers = scene.layers.iter().map(|layer| &layer.tissue);
    let mut all = of_layers.chain(scene.lumps.iter().map(|lump| &lump.tissue));
    all.any(|tissue| tissue.prony.is_some())
}

/// The scene, set to press `depth` deep, m, at `at` on a mesh without the limits of a live one.
fn finer(scene: &Scene, at: Vec3, depth: f64) -> Scene {
    let mut scene = scene.clone();
    scene.press.target = Target::Point(at.into());
    scene.press.direction = None;
    scene.press.speeds.clear();
    // The press itself is not run; its depth says how far round the place the tool presses.
    scene.press.depth = depth.max(LEAST_DEPTH);
    scene.mesh.refine = true;
    scene.mesh.max_vertices = MOST_NODES;
    // Those of the loop are for its own mesh.
    scene.mesh.near_lumps = None;
    scene.mesh.growth = None;
    scene.mesh.level_growth = None;
    scene.mesh.accuracy = None;
    scene.model.alpha = Some(ALPHA);
    scene.model.below = None;
    scene
}
