//! The scripted indentation with the reference method: bars between nodes, and a tool bonded to its
//! nodes.

use anyhow::bail;
use palpa_mesh::quality::prism_shapes;
use palpa_mesh::{LayeredBody, Vec3};
use palpa_scene::{CutFaces, InPlane, Law, Scene, Tool};
use palpa_springs::{
    Constraints, Corrections, EulerParams, InterfaceBars, LayerStiffness, Method, Outcome, Solver,
    SpringModel, SpringParams, SpringState, StepParams, Workspace, step,
};
use serde::Serialize;

use super::place::{mesh_size_near, note_overhang};
use super::{Phase, Place, Waypoint, tidy, waypoints};
use crate::build::BuiltBody;
use crate::note::{LayerAspect, Note, xyz};

/// Times of the samples of a rest, as shares of its duration. They are evenly spaced, because
/// springs do not relax.
const HOLD_SAMPLES: [f64; 5] = [0.2, 0.4, 0.6, 0.8, 1.0];
/// Fewer skin nodes under a disc than this give a note: between 7 and 35 nodes the force on a real
/// forearm changed by a quarter.
const ENOUGH_NODES: usize = 20;
/// Ratio of a level's height to its edge length within which bars represent a Young's modulus
/// (`docs/theory/spring_stiffness.md`).
const SOUND_ASPECT: std::ops::RangeInclusive<f64> = 0.5..=1.2;

/// An indentation that is set up: the data that stays constant while it runs.
#[derive(Debug)]
pub struct BarIndentation {
    /// The spring model of the body under the tool.
    pub model: SpringModel,
    /// The place that is pressed.
    pub place: Place,
    /// Mean length of the skin's edges near the tool. m
    pub mesh_size: f64,
    /// Remarks for the user.
    pub notes: Vec<Note>,
    params: StepParams,
    path: Vec<Waypoint>,
}

/// One row of the result. Forces act on the tool.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BarSample {
    /// Phase of the indentation.
    pub phase: Phase,
    /// Time since the start, s.
    pub time_s: f64,
    /// Depth of the tool along its direction, mm.
    pub depth_mm: f64,
    /// Force on the tool against its direction, N; positive when the body pushes back.
    pub force_n: f64,
    /// x component of the force on the tool, N.
    pub force_x_n: f64,
    /// y component of the force on the tool, N.
    pub force_y_n: f64,
    /// z component of the force on the tool, N.
    pub force_z_n: f64,
    /// The same force computed from the present stretch of the bars, N. Its difference to `force_n`
    /// is the error of the incremental solution.
    pub bar_force_n: f64,
    /// Equation (3.18) taken literally, along the direction, N/ms: the reaction before the free
    /// nodes moved, divided by the step's duration. It depends on the step size. For comparison
    /// only, never sent to a device.
    pub literal_n_per_ms: f64,
    /// Largest unbalanced force on a free node, divided by the largest nodal force.
    pub imbalance: f64,
    /// Number of prisms that are turned inside out: bars have no volume and do not prevent it. From
    /// the first one on, the force is that of the bars only and no longer that of a body.
    pub n_inverted: usize,
    /// Result of the step. If it diverged, the state and the forces are those of the previous
    /// sample, and the run ends.
    pub outcome: BarOutcome,
}

/// Result of the step to a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum BarOutcome {
    /// Solved by incremental finite elements.
    Converged,
    /// The step was singular and was solved by explicit Euler.
    EulerFallback,
    /// The body diverged.
    Diverged,
}

/// The state of a running indentation.
#[derive(Debug)]
pub struct BarRun<'a> {
    indentation: &'a BarIndentation,
    body: &'a LayeredBody,
    /// The body's state.
    pub state: SpringState,
    workspace: Workspace,
    next: usize,
    depth: f64,
    time: f64,
}

impl BarIndentation {
    /// Sets up the scene's indentation on its body.
    ///
    /// # Errors
    /// When the place, the depth or the constraints do not fit the body.
    pub fn build(scene: &Scene, built: &BuiltBody) -> anyhow::Result<Self> {
        check_reference(scene)?;
        let body = &built.growth.body;
        let mut notes = Vec::new();
        let place = Place::find(scene, built, &mut notes)?;
        note_overhang(scene, body, &place, &mut notes);
        let Place {
            vertex,
            at,
            direction,
            ..
        } = place;
        let radius = scene.tool.contact_radius();
        let operated = match scene.tool {
            Tool::Disc { .. } => nodes_under_disc(body, vertex, at, &direction, radius),
            Tool::Node | Tool::Contact(_) => vec![body.node(vertex, 0)],
        };
        let mesh_size = mesh_size_near(body, at, radius);
        if matches!(scene.tool, Tool::Disc { .. }) && operated.len() < ENOUGH_NODES {
            notes.push(Note::FewUnderDisc {
                n_vertices: operated.len(),
                radius,
                edge: mesh_size,
            });
        }
        note_aspects(built, scene, mesh_size, &mut notes);
        if scene.layers.iter().any(|layer| layer.prestress > 0.0) {
            notes.push(Note::TensionLeftOut);
        }
        if scene.press.speeds.len() > 1 {
            notes.push(Note::FirstSpeedOnly);
        }
        note_cut_faces(scene, body, &mut notes);
        let model = SpringModel::build(
            body,
            &spring_params(scene),
            &constraints(scene, body, operated),
        )?;
        let params = step_params(scene, &model);
        Ok(Self {
            model,
            place,
            mesh_size,
            notes,
            params,
            path: waypoints(&scene.press, scene.press.speed, &HOLD_SAMPLES),
        })
    }

    /// Number of samples of a whole run.
    pub fn n_samples(&self) -> usize {
        self.path.len()
    }

    /// Index of the deepest sample, at the end of loading.
    pub fn deepest(&self) -> usize {
        self.path
            .iter()
            .rposition(|w| w.phase == Phase::Load)
            .unwrap_or(0)
    }

    /// Starts a run at rest. `body` must be the body that this was built on.
    pub fn start<'a>(&'a self, body: &'a LayeredBody) -> BarRun<'a> {
        BarRun {
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

impl BarRun<'_> {
    /// Computes the next sample; `None` at the end. A sample that diverged is the last.
    pub fn advance(&mut self) -> Option<BarSample> {
        let BarIndentation {
            model,
            place: Place { direction, .. },
            params,
            path,
            ..
        } = self.indentation;
        let waypoint = *path.get(self.next)?;
        let displacement = direction.into_inner() * (waypoint.depth - self.depth);
        // Springs do not relax, so nothing changes during a rest, whatever the number of samples.
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
            Outcome::Converged => BarOutcome::Converged,
            Outcome::EulerFallback { .. } => BarOutcome::EulerFallback,
            Outcome::Diverged { .. } | Outcome::NotFinite => BarOutcome::Diverged,
        };
        self.next = if outcome == BarOutcome::Diverged {
            path.len()
        } else {
            self.next + 1
        };
        (self.depth, self.time) = (waypoint.depth, waypoint.time);
        let shapes = prism_shapes(self.body, &self.state.positions);
        Some(BarSample {
            phase: waypoint.phase,
            time_s: tidy(waypoint.time),
            depth_mm: tidy(waypoint.depth * 1e3),
            // Adding zero turns -0 into 0.
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

/// Refuses a scene with features that the reference method does not have.
pub(crate) fn check_reference(scene: &Scene) -> anyhow::Result<()> {
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

pub(crate) fn spring_params(scene: &Scene) -> SpringParams {
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
            palpa_scene::Solver::DenseInverse => Solver::HistoricalInverse,
            palpa_scene::Solver::Sparse | palpa_scene::Solver::Euler => Solver::Auto,
        },
        ..SpringParams::new(layers)
    }
}

/// Step size of pure Euler as a share of the largest stable one: half of it stays stable under
/// moderate loads and is still fast enough.
const EULER_FRACTION: f64 = 0.5;

pub(crate) fn step_params(scene: &Scene, model: &SpringModel) -> StepParams {
    let reference = &scene.reference;
    StepParams {
        substeps: reference.substeps as usize,
        method: match reference.solver {
            palpa_scene::Solver::Euler => {
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

/// The constraints: the base is fixed, the tool holds `operated`, and cut faces are held as the
/// scene says.
pub(crate) fn constraints(scene: &Scene, body: &LayeredBody, operated: Vec<usize>) -> Constraints {
    let mut constraints = Constraints::hold(body, operated);
    let nodes = |v: u32| (0..body.n_levels).map(move |l| body.node(v as usize, l));
    for face in &body.cut_faces {
        let rim = face.vertices.iter().copied();
        match scene.body.cut_faces {
            CutFaces::Symmetric if face.is_flat => {
                constraints
                    .symmetric
                    .extend(rim.flat_map(nodes).map(|node| (node, face.normal)));
            }
            // A face that is not flat stays free; `note_cut_faces` says so.
            CutFaces::Free | CutFaces::Symmetric => {}
            // Nodes that the tool holds stay held by the tool.
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

/// Adds a note for each cut face that should be a plane of symmetry and is not flat.
pub(crate) fn note_cut_faces(scene: &Scene, body: &LayeredBody, notes: &mut Vec<Note>) {
    if scene.body.cut_faces == CutFaces::Symmetric {
        let bent = body.cut_faces.iter().filter(|face| !face.is_flat);
        notes.extend(bent.map(|face| Note::CutFaceNotFlat {
            at: xyz(face.point),
        }));
    }
}

/// Skin nodes within `radius` of the tool's axis, on the pressed side, and connected with the
/// vertex in the middle.
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
        // The far side of the body, or another finger, is not under the tool.
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

/// Adds a note for layers whose levels are too flat or too tall for bars to represent their
/// modulus.
fn note_aspects(built: &BuiltBody, scene: &Scene, mesh_size: f64, notes: &mut Vec<Note>) {
    let unsound: Vec<LayerAspect> = (built.growth.report.layers.iter().zip(&scene.layers))
        .filter(|(_, layer)| layer.tissue.elastic().is_some())
        .filter_map(|(report, _)| {
            let height = report.thickness.median / report.n_levels as f64;
            let aspect = height / mesh_size;
            (!SOUND_ASPECT.contains(&aspect)).then(|| LayerAspect {
                name: report.name.clone(),
                aspect,
            })
        })
        .collect();
    if !unsound.is_empty() {
        notes.push(Note::BarAspects {
            layers: unsound,
            least: *SOUND_ASPECT.start(),
            most: *SOUND_ASPECT.end(),
        });
    }
}
