//! A scripted indentation with the reference method: the tool goes down, rests and comes back, and the force is kept.

use anyhow::bail;
use nalgebra::Unit;
use palpa_mesh::quality::prism_shapes;
use palpa_mesh::{LayeredBody, Vec3};
use palpa_springs::{
    Constraints, Corrections, EulerParams, InterfaceBars, LayerStiffness, Method, Outcome, Solver,
    SpringModel, SpringParams, SpringState, StepParams, Workspace, step,
};
use palpa_tissue::{CutFaces, InPlane, Law, Scene, Tool};
use serde::Serialize;

use crate::build::{BuiltBody, in_mm};

/// Edges within this many tool radii of the press point make the mesh size near the tool.
const NEAR_TOOL: f64 = 2.0;

/// Beyond this angle from the inward normal (60°) a press direction is worth a note.
const OBLIQUE_COS: f64 = 0.5;
/// Fewer skin nodes under a disc are worth a note: from 7 to 35 nodes the force on a real forearm changed by a quarter.
const ENOUGH_NODES: usize = 20;
/// Heights of a level over the length of its edges within which bars stand for a Young's modulus
/// (`docs/theory/spring_stiffness.md`).
const SOUND_ASPECT: std::ops::RangeInclusive<f64> = 0.5..=1.2;

/// An indentation that is set up: what does not change while it runs.
#[derive(Debug)]
pub struct Indentation {
    /// The spring model of the body under the tool.
    pub model: SpringModel,
    /// The skin vertex pressed on.
    pub vertex: usize,
    /// Its place at rest. m
    pub at: Vec3,
    /// The way the tool goes.
    pub direction: Unit<Vec3>,
    /// Depth of the tissue below the vertex. m
    pub tissue_depth: f64,
    /// Mean length of the skin's edges near the tool. m
    pub mesh_size: f64,
    /// What a user should know beside the result.
    pub notes: Vec<String>,
    params: StepParams,
    path: Vec<Waypoint>,
}

/// Where the tool is at one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Waypoint {
    phase: Phase,
    time: f64,
    depth: f64,
}

/// The parts of an indentation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// Going down.
    Load,
    /// Resting at the depth.
    Hold,
    /// Coming back.
    Retract,
}

/// One line of the result. Forces act on the tool.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sample {
    /// Part of the indentation.
    pub phase: Phase,
    /// Time since the start. s
    pub time_s: f64,
    /// Depth of the tool along its direction. mm
    pub depth_mm: f64,
    /// Force against the tool's direction: what pushes back. N
    pub force_n: f64,
    /// Components of the force on the tool. N
    pub force_x_n: f64,
    /// See `force_x_n`.
    pub force_y_n: f64,
    /// See `force_x_n`.
    pub force_z_n: f64,
    /// Pushing back by the bars as they are stretched now; its difference to `force_n` is what the increments leave out.
    pub bar_force_n: f64,
    /// (3.18) to the letter, along the direction: the reaction before the free nodes moved over the step's duration. It
    /// depends on the step; for comparison only, never sent to a device. N/ms
    pub literal_n_per_ms: f64,
    /// Largest force on a free node that is not in equilibrium, over the largest nodal force.
    pub imbalance: f64,
    /// Prisms that are turned over: bars have no volume and do not prevent it. From the first one on the force is that
    /// of the bars alone, no longer of a body.
    pub n_inverted: usize,
    /// `converged`, `euler_fallback` (a singular step was done by explicit Euler) or `diverged`: then the state is the one
    /// before, the forces are those of the sample before, and the run ends.
    pub outcome: &'static str,
}

/// What moves while an indentation runs.
#[derive(Debug)]
pub struct Run<'a> {
    indentation: &'a Indentation,
    body: &'a LayeredBody,
    /// The body's state.
    pub state: SpringState,
    workspace: Workspace,
    next: usize,
    depth: f64,
    time: f64,
}

impl Indentation {
    /// Sets up the indentation that `scene` asks for on its body.
    ///
    /// # Errors
    /// When the place, the depth or the constraints do not fit the body.
    pub fn build(scene: &Scene, built: &BuiltBody) -> anyhow::Result<Self> {
        check_reference(scene)?;
        let body = &built.growth.body;
        let mut notes = Vec::new();
        let vertex = built.press_vertex;
        let at = body.skin.points[vertex];
        let direction = match scene.press.direction {
            Some(d) => Unit::try_new(Vec3::from(d), f64::MIN_POSITIVE),
            None => Unit::try_new(-body.skin.vertex_normals()[vertex], f64::MIN_POSITIVE),
        };
        let Some(direction) = direction else {
            bail!(
                "the skin has no normal at vertex {vertex} ({}) mm; give a press direction",
                in_mm(at)
            );
        };
        let inward = -body.skin.vertex_normals()[vertex];
        let slant = direction.dot(&inward);
        if slant <= 0.0 {
            bail!(
                "the press direction ({:.2}, {:.2}, {:.2}) points out of the skin at ({}) mm; turn it, or leave it out to \
                 press along the inward normal",
                direction.x,
                direction.y,
                direction.z,
                in_mm(at)
            );
        }
        if slant < OBLIQUE_COS {
            notes.push(format!(
                "the press direction is {:.0}° from the skin's inward normal: the bonded tool drags more than it presses",
                slant.acos().to_degrees()
            ));
        }
        let tissue_depth = column_length(body, vertex);
        if scene.press.depth >= tissue_depth {
            bail!(
                "press depth {:.2} mm reaches beyond the body: at ({}) mm the tissue is {:.2} mm deep; press less deep, \
                 or at another place",
                scene.press.depth * 1e3,
                in_mm(at),
                tissue_depth * 1e3,
            );
        }
        let radius = scene.tool.contact_radius();
        let operated = match scene.tool {
            Tool::Disc { .. } => nodes_under_disc(body, vertex, at, &direction, radius),
            Tool::Node | Tool::Contact(_) => vec![body.node(vertex, 0)],
        };
        let mesh_size = mesh_size_near(body, at, radius);
        if matches!(scene.tool, Tool::Disc { .. }) && operated.len() < ENOUGH_NODES {
            notes.push(format!(
                "only {} skin vertices lie under the tool of radius {:.1} mm, with edges of {:.1} mm there: the force \
                 depends on the mesh; take a finer skin or a larger tool",
                operated.len(),
                radius * 1e3,
                mesh_size * 1e3,
            ));
        }
        note_aspects(built, scene, mesh_size, &mut notes);
        if scene.layers.iter().any(|layer| layer.prestress > 0.0) {
            notes.push("bars are without tension at rest; `prestress` was left out".into());
        }
        if scene.press.speeds.len() > 1 {
            notes.push(
                "bars have no time, so every speed gives the same force; only the first of `speeds` was run"
                    .into(),
            );
        }
        if body
            .cut_faces
            .iter()
            .any(|f| f.vertices.contains(&(vertex as u32)))
        {
            notes.push("the press point lies on a cut face of the body; the force there is that of a free edge".into());
        }
        let model = SpringModel::build(
            body,
            &spring_params(scene),
            &constraints(scene, body, operated, &mut notes),
        )?;
        let params = step_params(scene, &model);
        Ok(Self {
            model,
            vertex,
            at,
            direction,
            tissue_depth,
            mesh_size,
            notes,
            params,
            path: path(scene),
        })
    }

    /// Number of samples of a whole run.
    pub fn n_samples(&self) -> usize {
        self.path.len()
    }

    /// The index of the deepest sample, where loading ends.
    pub fn deepest(&self) -> usize {
        self.path
            .iter()
            .rposition(|w| w.phase == Phase::Load)
            .unwrap_or(0)
    }

    /// Begins a run at rest. `body` is the one that this was built on.
    pub fn start<'a>(&'a self, body: &'a LayeredBody) -> Run<'a> {
        Run {
            indentation: self,
            body,
            state: SpringState::new(&self.model),
            workspace: Workspace::new(&self.model),
            next: 0,
            depth: 0.0,
            time: 0.0,
        }
    }
}

impl Run<'_> {
    /// Goes on to the next sample; `None` at the end. A sample that diverged is the last.
    pub fn advance(&mut self) -> Option<Sample> {
        let Indentation {
            model,
            direction,
            params,
            path,
            ..
        } = self.indentation;
        let waypoint = *path.get(self.next)?;
        let displacement = direction.into_inner() * (waypoint.depth - self.depth);
        // Springs do not relax with time: at rest nothing happens, whatever the number of samples.
        let corrections = match waypoint.phase {
            Phase::Hold => Corrections::OFF,
            Phase::Load | Phase::Retract => params.corrections,
        };
        let duration_ms = (waypoint.time - self.time) * 1e3;
        let params = &StepParams {
            corrections,
            literal_duration_ms: Some(duration_ms).filter(|&d| d > 0.0),
            ..*params
        };
        let report = step(
            model,
            &mut self.state,
            &mut self.workspace,
            displacement,
            params,
        );
        let outcome = match report.outcome {
            Outcome::Converged => "converged",
            Outcome::EulerFallback { .. } => "euler_fallback",
            Outcome::Diverged { .. } | Outcome::NotFinite => "diverged",
        };
        self.next = if outcome == "diverged" {
            path.len()
        } else {
            self.next + 1
        };
        (self.depth, self.time) = (waypoint.depth, waypoint.time);
        let shapes = prism_shapes(self.body, &self.state.positions);
        Some(Sample {
            phase: waypoint.phase,
            time_s: tidy(waypoint.time),
            depth_mm: tidy(waypoint.depth * 1e3),
            // Plus zero: no sample is "minus nothing".
            force_n: -report.force.dot(direction) + 0.0,
            force_x_n: report.force.x,
            force_y_n: report.force.y,
            force_z_n: report.force.z,
            bar_force_n: -report.bar_force.dot(direction),
            literal_n_per_ms: -report.literal_force.map_or(0.0, |f| f.dot(direction)) + 0.0,
            imbalance: report.imbalance,
            n_inverted: shapes.iter().filter(|s| !s.is_valid()).count(),
            outcome,
        })
    }
}

/// Without the digits that binary fractions leave behind.
fn tidy(x: f64) -> f64 {
    (x * 1e9).round() / 1e9
}

/// Down in equal steps, a rest of a few samples, and back; and again.
fn path(scene: &Scene) -> Vec<Waypoint> {
    const HOLD_SAMPLES: usize = 5;
    let press = &scene.press;
    // No step is larger than asked for.
    let n = (press.depth / press.step - 1e-9).ceil().max(1.0) as usize;
    let depth_at = |i: usize| press.depth * i as f64 / n as f64;
    let down = press.depth / press.speed;
    let mut path = Vec::new();
    for cycle in 0..press.cycles {
        let start = f64::from(cycle) * (2.0 * down + press.hold);
        // Where a cycle ends, the next one begins.
        let first = usize::from(cycle > 0);
        path.extend((first..=n).map(|i| Waypoint {
            phase: Phase::Load,
            time: start + depth_at(i) / press.speed,
            depth: depth_at(i),
        }));
        if press.hold > 0.0 {
            path.extend((1..=HOLD_SAMPLES).map(|i| Waypoint {
                phase: Phase::Hold,
                time: start + down + press.hold * i as f64 / HOLD_SAMPLES as f64,
                depth: press.depth,
            }));
        }
        if press.retract {
            path.extend((0..n).rev().map(|i| Waypoint {
                phase: Phase::Retract,
                time: start + down + press.hold + (press.depth - depth_at(i)) / press.speed,
                depth: depth_at(i),
            }));
        }
    }
    path
}

/// Refuses what bars between nodes cannot do.
fn check_reference(scene: &Scene) -> anyhow::Result<()> {
    if !scene.tool.is_bonded() {
        bail!(
            "the reference method moves nodes that are bonded to the tool, and a {} presses by contact; give the scene's \
             [tool] shape = \"disc\" or \"node\"",
            scene.tool
        );
    }
    if let Some(lump) = scene.lumps.first() {
        bail!(
            "the reference method has bars between nodes and no place for the lump \"{}\"; remove [[lump]]",
            lump.name
        );
    }
    Ok(())
}

fn spring_params(scene: &Scene) -> SpringParams {
    let layers: Vec<LayerStiffness> = scene
        .layers
        .iter()
        .map(|layer| match &layer.tissue.law {
            Law::Elastic(elastic) => LayerStiffness::Young {
                modulus: elastic.young(),
            },
            Law::Spring { constant } => LayerStiffness::Spring {
                stiffness: constant.value,
            },
        })
        .collect();
    SpringParams {
        interface_bars: match scene.reference.in_plane {
            InPlane::Above => InterfaceBars::Above,
            InPlane::Below => InterfaceBars::Below,
            InPlane::Mean => InterfaceBars::Mean,
        },
        solver: match scene.reference.solver {
            palpa_tissue::Solver::DenseInverse => Solver::HistoricalInverse,
            palpa_tissue::Solver::Sparse | palpa_tissue::Solver::Euler => Solver::Auto,
        },
        ..SpringParams::new(layers)
    }
}

/// Share of the largest stable step size that Euler alone takes: half of it bears moderate loads and still gets on.
const EULER_FRACTION: f64 = 0.5;

fn step_params(scene: &Scene, model: &SpringModel) -> StepParams {
    let reference = &scene.reference;
    StepParams {
        substeps: reference.substeps as usize,
        method: match reference.solver {
            palpa_tissue::Solver::Euler => {
                Method::Euler(EulerParams::of_stable(model, EULER_FRACTION))
            }
            _ => Method::FiniteElements,
        },
        corrections: Corrections {
            spring_gain: reference.spring_gain,
            shape_gain: reference.shape_gain,
        },
        ..StepParams::default()
    }
}

/// The base is fixed, the tool holds `operated`, cut faces as the scene says.
fn constraints(
    scene: &Scene,
    body: &LayeredBody,
    operated: Vec<usize>,
    notes: &mut Vec<String>,
) -> Constraints {
    let mut constraints = Constraints::hold(body, operated);
    let nodes = |v: u32| (0..body.n_levels).map(move |l| body.node(v as usize, l));
    for face in &body.cut_faces {
        let rim = face.vertices.iter().copied();
        match scene.body.cut_faces {
            CutFaces::Free => {}
            CutFaces::Symmetric if face.is_flat => {
                constraints
                    .symmetric
                    .extend(rim.flat_map(nodes).map(|node| (node, face.normal)));
            }
            CutFaces::Symmetric => {
                notes.push(format!(
                    "the cut face at ({}) mm is not flat, so it is no plane of symmetry; it was left free",
                    in_mm(face.point)
                ));
            }
            // What the tool holds, it holds.
            CutFaces::Fixed => {
                let held = &constraints.operated;
                let fixed: Vec<usize> = rim.flat_map(nodes).filter(|n| !held.contains(n)).collect();
                constraints.fixed.extend(fixed);
            }
        }
    }
    constraints.fixed.sort_unstable();
    constraints.fixed.dedup();
    constraints
}

/// Skin nodes of the side pressed on within `radius` of the tool's axis, and connected with the vertex in the middle.
pub(crate) fn nodes_under_disc(
    body: &LayeredBody,
    vertex: usize,
    at: Vec3,
    direction: &Vec3,
    radius: f64,
) -> Vec<usize> {
    let normals = body.skin.vertex_normals();
    let is_under = |v: usize| {
        let r = body.skin.points[v] - at;
        let off_axis = (r - direction * r.dot(direction)).norm();
        // A far side of the body, or another finger, is not under the tool.
        off_axis <= radius && r.norm() <= 2.0 * radius && normals[v].dot(direction) < 0.0
    };
    let mut is_in = vec![false; body.n_vertices()];
    is_in[vertex] = true;
    let edges = body.skin.edges();
    loop {
        let before = is_in.iter().filter(|&&x| x).count();
        for &[a, b] in &edges {
            let (a, b) = (a as usize, b as usize);
            if is_in[a] != is_in[b] && is_under(if is_in[a] { b } else { a }) {
                (is_in[a], is_in[b]) = (true, true);
            }
        }
        if is_in.iter().filter(|&&x| x).count() == before {
            break;
        }
    }
    (0..is_in.len())
        .filter(|&v| is_in[v])
        .map(|v| body.node(v, 0))
        .collect()
}

/// Says which layers have levels too flat or too tall for bars to stand for their modulus.
fn note_aspects(built: &BuiltBody, scene: &Scene, mesh_size: f64, notes: &mut Vec<String>) {
    let unsound: Vec<String> = (built.growth.report.layers.iter().zip(&scene.layers))
        .filter(|(_, layer)| layer.tissue.elastic().is_some())
        .filter_map(|(report, _)| {
            let height = report.thickness.median / report.n_levels as f64;
            let aspect = height / mesh_size;
            (!SOUND_ASPECT.contains(&aspect)).then(|| format!("{} {aspect:.2}", report.name))
        })
        .collect();
    if !unsound.is_empty() {
        notes.push(format!(
            "levels over skin edges near the tool: {}; outside {} to {} bars are too stiff across or too soft in shear, \
             and the force depends on the number of levels",
            unsound.join(", "),
            SOUND_ASPECT.start(),
            SOUND_ASPECT.end(),
        ));
    }
}

pub(crate) fn column_length(body: &LayeredBody, v: usize) -> f64 {
    let p = |l: usize| body.positions[body.node(v, l)];
    (1..body.n_levels).map(|l| (p(l) - p(l - 1)).norm()).sum()
}

/// Mean length of the skin's edges near a place; of those at its vertex where the tool is smaller than the mesh.
fn mesh_size_near(body: &LayeredBody, at: Vec3, radius: f64) -> f64 {
    let skin = &body.skin;
    let edges: Vec<(f64, f64)> = skin
        .edges()
        .iter()
        .map(|&[a, b]| {
            let (a, b) = (skin.points[a as usize], skin.points[b as usize]);
            ((a - at).norm().min((b - at).norm()), (a - b).norm())
        })
        .collect();
    let nearest = edges.iter().map(|e| e.0).fold(f64::INFINITY, f64::min);
    let reach = (NEAR_TOOL * radius).max(nearest);
    let near: Vec<f64> = edges.iter().filter(|e| e.0 <= reach).map(|e| e.1).collect();
    near.iter().sum::<f64>() / near.len().max(1) as f64
}
