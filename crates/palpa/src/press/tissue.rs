//! The indentation with the continuum model.

use anyhow::bail;
use palpa_fem::lump::Lump;
use palpa_fem::shape::{Pose, Tool as RigidTool};
use palpa_fem::{
    Dynamics, Load, Materials, Model, ModelParams, Outcome, PosedTool, SolveParams, State,
    StepReport, Workspace, advance, equilibrate, prism_fields,
};
use palpa_mesh::{LayeredBody, Vec3};
use palpa_scene::{CutFaces, Scene, Tool};
use serde::Serialize;

use super::lump::lump_shares;
use super::mesh::{Patch, PressedBody};
use super::{Phase, Place, Waypoint, n_steps, tidy, waypoints};
use crate::build::{BuiltBody, in_mm};
use crate::continuum;

/// Samples of a rest in which tissue relaxes, evenly spread in the logarithm of time from this share of the rest on.
const HOLD_SAMPLES: usize = 10;
const FIRST_HOLD: f64 = 0.01;
/// Forces out of balance in a body at rest, as a share of those that count as none: rounding only.
const REST_TOLERANCE: f64 = 1e-3;
/// A contact whose radius is fewer edges than this is worth a note: its force is off by more than about 5 %.
const FEWEST_EDGES: f64 = 3.0;
/// Skin triangles without a partner are worth a note beyond this share of all.
const FEW_SINGLES: f64 = 0.01;

/// With friction a step longer than this share of the contact radius is worth a note: its force is off by more than about
/// 0.5 %.
const LONGEST_STEP: f64 = 0.05;

/// An indentation that is set up: what does not change while it runs.
#[derive(Debug)]
pub struct Indentation {
    /// The body with its materials.
    pub model: Model,
    /// The body made fine, and how.
    pub mesh: PressedBody,
    /// Lumps in their places.
    pub lumps: Vec<Lump>,
    /// Share of every prism that is lump, by volume; empty without lumps. `[n_prisms]`
    pub lump_shares: Vec<f64>,
    /// Where it is pressed.
    pub place: Place,
    /// The level at which each layer begins, and the deepest. `[n_layers + 1]`
    pub borders: Vec<usize>,
    /// Speeds at which the whole press is run, m/s; at least one.
    pub speeds: Vec<f64>,
    /// Whether any tissue relaxes, so that speed and rest count.
    pub is_viscous: bool,
    /// What a user should know beside the result.
    pub notes: Vec<String>,
    grip: Grip,
    /// Whether any layer is under tension at rest.
    is_tense: bool,
    /// The state at rest, under the tension of the layers.
    rest: State,
    /// How far along its way the tool touches first, seen from the place at rest. m
    touch: f64,
    params: SolveParams,
    dynamics: Option<Dynamics>,
    press: palpa_scene::Press,
}

/// How the tool holds the skin.
#[derive(Debug)]
enum Grip {
    /// These nodes are bonded to it, and stand for areas of skin (m²), if it has any.
    Bond { nodes: Vec<usize>, areas: Vec<f64> },
    /// It touches; posed with its tip at the place at rest.
    Contact { tool: RigidTool, pose: Pose },
}

/// One line of the result. Forces act on the tool.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sample {
    /// The run of the sweep, from 0.
    pub run: usize,
    /// Its speed. mm/s
    pub speed_mm_s: f64,
    /// Part of the indentation.
    pub phase: Phase,
    /// How often the tool has gone down before.
    pub cycle: u32,
    /// Time since the start of the run. s
    pub time_s: f64,
    /// Depth of the tool along its direction, from where it first touches the skin at rest. mm
    pub depth_mm: f64,
    /// Force against the tool's direction: what pushes back. N
    pub force_n: f64,
    /// Components of the force on the tool. N
    pub force_x_n: f64,
    /// See `force_x_n`.
    pub force_y_n: f64,
    /// See `force_x_n`.
    pub force_z_n: f64,
    /// Area of skin at rest that touches the tool or is bonded to it. mm²
    pub contact_area_mm2: f64,
    /// Largest force on a vertex over the area of skin that it stands for; at the edge of a bonded disc, where pressure has
    /// no limit, it grows with refinement. Empty for a single node. kPa
    pub max_pressure_kpa: Option<f64>,
    /// Skin vertices that touch the tool or are bonded to it.
    pub n_touching: usize,
    /// Largest gap at a vertex that touches. µm
    pub gap_um: f64,
    /// Deepest penetration of a vertex that should not touch. µm
    pub penetration_um: f64,
    /// Largest pull at a vertex that touches. N
    pub tension_n: f64,
    /// Largest friction beyond Coulomb's cone. N
    pub cone_n: f64,
    /// Largest share of a friction that does not oppose its slip.
    pub slip: f64,
    /// Slip over which friction had to be smoothed: vertices that would be held creep by about as much. 0 for Coulomb's
    /// exact law, which nearly every step obeys. µm
    pub friction_smoothing_um: f64,
    /// Forces out of balance as a share of those that hold the body.
    pub residual: f64,
    /// Newton iterations.
    pub iterations: usize,
    /// Parts into which the step was divided.
    pub substeps: usize,
    /// `converged`, or why it did not: `iteration_limit`, `inverted` or `singular`. Then the numbers are those of the sample
    /// before, and this speed's run ends.
    pub outcome: &'static str,
    /// Strain energy (of a viscous tissue that of its present law). mJ
    pub energy_mj: f64,
    /// Work that the tool has done so far, by the trapezoidal rule. mJ
    pub work_mj: f64,
    /// Smallest volume of a prism as a share of that at rest.
    pub volume_ratio_min: f64,
    /// Largest likewise.
    pub volume_ratio_max: f64,
    /// Thickness of each layer along the pressed column. mm `[n_layers]`
    pub layer_thickness_mm: Vec<f64>,
}

impl Sample {
    /// The names of the fields in their order, but for the last, which is a list.
    pub const COLUMNS: [&'static str; 27] = [
        "run",
        "speed_mm_s",
        "phase",
        "cycle",
        "time_s",
        "depth_mm",
        "force_n",
        "force_x_n",
        "force_y_n",
        "force_z_n",
        "contact_area_mm2",
        "max_pressure_kpa",
        "n_touching",
        "gap_um",
        "penetration_um",
        "tension_n",
        "cone_n",
        "slip",
        "friction_smoothing_um",
        "residual",
        "iterations",
        "substeps",
        "outcome",
        "energy_mj",
        "work_mj",
        "volume_ratio_min",
        "volume_ratio_max",
    ];
}

/// Where a step failed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Failure {
    /// Speed of its run. mm/s
    pub speed_mm_s: f64,
    /// Depth that was to be reached. mm
    pub depth_mm: f64,
    /// Why, and where.
    #[serde(flatten)]
    pub outcome: Outcome,
}

/// What moves while one speed is run.
#[derive(Debug)]
pub struct Run<'a> {
    indentation: &'a Indentation,
    /// The number of its speed.
    pub index: usize,
    /// The body's state.
    pub state: State,
    /// What solved it last.
    pub workspace: Workspace,
    path: Vec<Waypoint>,
    next: usize,
    /// The load of the last sample.
    before: Acting,
    earlier: Earlier,
    time: f64,
    last: Option<Sample>,
    /// Why the run ended early, if it did.
    pub failure: Option<Failure>,
}

/// Tools and held nodes at one moment.
#[derive(Debug, Clone, Default)]
struct Acting {
    tools: Vec<PosedTool>,
    held: Vec<(usize, Vec3)>,
}

/// Displacements at the last samples of one phase, the newest first: enough to go on along a parabola. Newton's method
/// then starts where it would be after its first iteration, and saves that.
#[derive(Debug, Default)]
struct Earlier {
    phase: Option<Phase>,
    displacements: Vec<Vec<Vec3>>,
}

impl Earlier {
    fn note(&mut self, phase: Phase, displacements: &[Vec3]) {
        if self.phase != Some(phase) {
            // Where one phase ends, the next one begins.
            self.displacements.truncate(1);
            self.phase = Some(phase);
        }
        self.displacements.truncate(2);
        self.displacements.insert(0, displacements.to_vec());
    }

    /// Where nodes will be at the next sample, as far as three or two samples at equal distances tell.
    fn guess(&self, phase: Phase) -> Option<Vec<Vec3>> {
        if self.phase != Some(phase) {
            return None;
        }
        match &self.displacements[..] {
            [a, b, c, ..] => Some(
                (a.iter().zip(b).zip(c))
                    .map(|((a, b), c)| a * 3.0 - b * 3.0 + c)
                    .collect(),
            ),
            [a, b] => Some(a.iter().zip(b).map(|(a, b)| a * 2.0 - b).collect()),
            _ => None,
        }
    }
}

impl Acting {
    fn load(&self, duration: f64, dynamics: Option<Dynamics>) -> Load<'_> {
        Load {
            tools: &self.tools,
            held: &self.held,
            duration,
            dynamics,
            ..Load::default()
        }
    }
}

impl Indentation {
    /// Sets up the indentation that `scene` asks for on its body, and takes it to rest under the tension of its layers.
    ///
    /// # Errors
    /// When the place, the depth, the tissues or the lumps do not fit the body, or it finds no rest.
    pub fn build(scene: &Scene, built: &BuiltBody) -> anyhow::Result<Self> {
        let mut indentation = Self::build_along(scene, built, &[])?;
        note_friction(scene, &mut indentation.notes);
        Ok(indentation)
    }

    /// As [`Self::build`], with the body made fine also where the tool goes across the skin: so far from the place along the
    /// motion's direction (m).
    ///
    /// # Errors
    /// As [`Self::build`].
    pub fn build_along(scene: &Scene, built: &BuiltBody, way: &[f64]) -> anyhow::Result<Self> {
        let mut notes = Vec::new();
        let materials = continuum::materials(scene)?;
        let is_viscous = materials.iter().any(|m| m.prony.is_some());
        let lumps = continuum::lumps(scene, built, &mut notes)?;
        let mesh = PressedBody::build(scene, built, &lumps, way, &mut notes)?;
        let place = mesh.place;
        let body = &mesh.body;
        let supports = continuum::supports(scene.body.cut_faces, body, &mut notes);
        let materials = Materials {
            materials,
            layers: (0..scene.layers.len()).collect(),
            lumps,
            stiffness: None,
        };
        let params = ModelParams {
            alpha: scene.model.alpha,
        };
        let model = Model::build(body, &materials, &supports, params)?;
        note_mesh(&model, &mesh, scene, &mut notes);
        note_tension(body, scene, &mut notes);
        let grip = grip(scene, &mesh, &place, &model)?;
        let params = SolveParams {
            tolerance: scene.model.tolerance,
            ..SolveParams::default()
        };
        let rest = rest(scene, &model, &params)?;
        let touch = match &grip {
            Grip::Bond { .. } => 0.0,
            Grip::Contact { tool, pose } => first_touch(&model, &rest, tool, pose, &place),
        };
        let press = scene.press.clone();
        let speeds = match &press.speeds[..] {
            [] => vec![press.speed],
            speeds => speeds.to_vec(),
        };
        let dynamics = match scene.model.dynamics {
            palpa_scene::Dynamics::QuasiStatic => None,
            palpa_scene::Dynamics::Implicit(damping) => Some(Dynamics {
                mass_damping: damping.mass,
                stiffness_damping: damping.stiffness,
            }),
        };
        if speeds.len() > 1 && !is_viscous && dynamics.is_none() {
            notes.push(
                "no tissue relaxes and nothing has mass here: every speed gives the same force"
                    .into(),
            );
        }
        Ok(Self {
            borders: borders(&body.interval_layer),
            lump_shares: lump_shares(body, &materials.lumps),
            lumps: materials.lumps,
            model,
            mesh,
            place,
            speeds,
            is_viscous,
            notes,
            grip,
            is_tense: scene.layers.iter().any(|layer| layer.prestress > 0.0),
            rest,
            touch,
            params,
            dynamics,
            press,
        })
    }

    /// Number of skin vertices that are bonded to the tool.
    pub fn n_bonded(&self) -> usize {
        match &self.grip {
            Grip::Bond { nodes, .. } => nodes.len(),
            Grip::Contact { .. } => 0,
        }
    }

    /// Whether mass and damping count.
    pub fn is_dynamic(&self) -> bool {
        self.dynamics.is_some()
    }

    /// Whether the skin is bonded to the tool.
    pub fn is_bonded(&self) -> bool {
        matches!(self.grip, Grip::Bond { .. })
    }

    /// Number of samples of the run at one speed.
    pub fn n_samples(&self) -> usize {
        self.path(self.speeds[0]).len()
    }

    /// The index of the deepest sample in a run, where loading first ends.
    pub fn deepest(&self) -> usize {
        let path = self.path(self.speeds[0]);
        let is_down = |w: &Waypoint| w.phase == Phase::Load && w.cycle == 0;
        path.iter().rposition(is_down).unwrap_or(0)
    }

    /// Begins the run at the `index`-th speed, at rest.
    pub fn start(&self, index: usize) -> Run<'_> {
        Run {
            indentation: self,
            index,
            state: self.rest.clone(),
            workspace: Workspace::new(&self.model),
            path: self.path(self.speeds[index]),
            next: 0,
            before: Acting::default(),
            earlier: Earlier::default(),
            time: 0.0,
            last: None,
            failure: None,
        }
    }

    /// The rigid tool and where it is at a depth (m); `None` where the skin is bonded.
    pub fn tool_at(&self, depth: f64) -> Option<PosedTool> {
        match &self.grip {
            Grip::Bond { .. } => None,
            Grip::Contact { tool, pose } => {
                let way = self.place.direction.into_inner() * (self.touch + depth);
                let translation = pose.translation.vector + way;
                Some(PosedTool {
                    tool: *tool,
                    pose: Pose::from_parts(translation.into(), pose.rotation),
                })
            }
        }
    }

    /// Pressure of the tool on the skin, where the last step of `run` has it. Pa `[n_vertices]`
    pub fn skin_pressure(&self, run: &Run<'_>) -> Vec<f64> {
        let body = &self.mesh.body;
        let reactions = run.workspace.reactions();
        let mut pressure = vec![0.0; body.n_vertices()];
        match &self.grip {
            Grip::Bond { nodes, areas } => {
                for (&node, area) in nodes.iter().zip(areas).filter(|(_, area)| **area > 0.0) {
                    let pressing = reactions[node].dot(&self.place.direction);
                    pressure[node / body.n_levels] = pressing / area;
                }
            }
            Grip::Contact { .. } => {
                let areas = self.model.skin_areas();
                for (v, touch) in run.state.touches.iter().enumerate() {
                    let Some(tool) = touch.tool().and_then(|k| run.before.tools.get(k)) else {
                        continue;
                    };
                    let node = body.node(v, 0);
                    let x = body.positions[node] + run.state.displacements[node];
                    let normal = tool.tool.distance_at(&tool.pose, &x).normal;
                    pressure[v] = reactions[node].dot(&normal) / areas[v];
                }
            }
        }
        pressure
    }

    fn path(&self, speed: f64) -> Vec<Waypoint> {
        let rests: Vec<f64> = if self.is_viscous || self.dynamics.is_some() {
            (0..HOLD_SAMPLES)
                .map(|i| FIRST_HOLD.powf(1.0 - i as f64 / (HOLD_SAMPLES - 1) as f64))
                .collect()
        } else {
            // Nothing happens.
            vec![1.0]
        };
        waypoints(&self.press, speed, &rests)
    }

    fn acting(&self, depth: f64) -> Acting {
        match &self.grip {
            Grip::Bond { nodes, .. } => {
                let way = self.place.direction.into_inner() * depth;
                let at = |&node: &usize| (node, self.rest.displacements[node] + way);
                Acting {
                    held: nodes.iter().map(at).collect(),
                    ..Acting::default()
                }
            }
            Grip::Contact { .. } => Acting {
                tools: self.tool_at(depth).into_iter().collect(),
                ..Acting::default()
            },
        }
    }

    /// Thickness of each layer along the pressed column. m `[n_layers]`
    fn thicknesses(&self, state: &State) -> Vec<f64> {
        let body = &self.mesh.body;
        let at = |level: usize| {
            let node = body.node(self.place.vertex, level);
            body.positions[node] + state.displacements[node]
        };
        let length = |levels: &[usize]| -> f64 {
            (levels[0]..levels[1])
                .map(|l| (at(l + 1) - at(l)).norm())
                .sum()
        };
        self.borders.windows(2).map(length).collect()
    }
}

impl Run<'_> {
    /// Goes on to the next sample; `None` at the end. A sample that did not converge is the last.
    pub fn advance(&mut self) -> Option<Sample> {
        let indentation = self.indentation;
        let waypoint = *self.path.get(self.next)?;
        let acting = indentation.acting(waypoint.depth);
        let report = self.solve(&waypoint, &acting);
        self.earlier.note(waypoint.phase, &self.state.displacements);
        let speed_mm_s = tidy(indentation.speeds[self.index] * 1e3);
        let depth_mm = tidy(waypoint.depth * 1e3);
        let outcome = report.outcome;
        let sample = if outcome == Outcome::Converged {
            self.before = acting;
            self.next += 1;
            self.measured(&waypoint, &report)
        } else {
            self.next = self.path.len();
            self.failure = Some(Failure {
                speed_mm_s,
                depth_mm,
                outcome,
            });
            let unmoved = || self.measured(&waypoint, &report);
            self.last.clone().unwrap_or_else(unmoved)
        };
        self.time = waypoint.time;
        let sample = Sample {
            iterations: report.iterations,
            substeps: report.substeps,
            residual: report.residual,
            phase: waypoint.phase,
            cycle: waypoint.cycle,
            time_s: tidy(waypoint.time),
            depth_mm,
            outcome: word(&outcome),
            ..sample
        };
        self.last = Some(sample.clone());
        Some(sample)
    }

    /// Takes the body to where the tool is at a waypoint; first from a guess that goes on as the last samples did.
    fn solve(&mut self, waypoint: &Waypoint, acting: &Acting) -> StepReport {
        let indentation = self.indentation;
        let (before, load) = (
            self.before.load(0.0, None),
            acting.load(waypoint.time - self.time, indentation.dynamics),
        );
        let (model, params) = (&indentation.model, &indentation.params);
        let has_memory = indentation.is_viscous || indentation.dynamics.is_some();
        if waypoint.depth == 0.0 && (self.next == 0 || !has_memory) {
            // The body is at rest. There may be no force at all, of which a share could be out of balance.
            let saved = std::mem::replace(&mut self.state, indentation.rest.clone());
            let tolerance = if indentation.is_tense {
                params.tolerance
            } else {
                REST_TOLERANCE
            };
            let params = SolveParams {
                tolerance,
                ..*params
            };
            let workspace = &mut self.workspace;
            let report = equilibrate(model, &mut self.state, workspace, &load, &params);
            if report.outcome == Outcome::Converged {
                return report;
            }
            self.state = saved;
        }
        let guess = (self.earlier.guess(waypoint.phase)).filter(|_| indentation.dynamics.is_none());
        if let Some(guess) = guess {
            let saved = self.state.clone();
            self.state.displacements = guess;
            let workspace = &mut self.workspace;
            let report = equilibrate(model, &mut self.state, workspace, &load, params);
            if report.outcome == Outcome::Converged {
                return report;
            }
            self.state = saved;
        }
        let workspace = &mut self.workspace;
        advance(model, &mut self.state, workspace, &before, &load, params)
    }

    /// What a step has led to, in the units of the table.
    fn measured(&self, waypoint: &Waypoint, report: &StepReport) -> Sample {
        let indentation = self.indentation;
        let direction = &indentation.place.direction;
        let (pull, area, n_touching) = match &indentation.grip {
            Grip::Bond { nodes, areas } => (report.held_force, areas.iter().sum(), nodes.len()),
            Grip::Contact { .. } => {
                let touching = self.state.touches.iter().filter(|t| t.tool().is_some());
                let n_touching = touching.count();
                (report.tool_forces[0], report.tool_areas[0], n_touching)
            }
        };
        let max_pressure = match &indentation.grip {
            Grip::Bond { areas, .. } if areas.iter().all(|&area| area == 0.0) => None,
            _ => Some((indentation.skin_pressure(self).into_iter()).fold(0.0, f64::max)),
        };
        let fields = prism_fields(&indentation.model, &self.state, &self.workspace);
        let ratios = fields.iter().map(|field| field.volume_ratio);
        let contact = &report.contact;
        // Plus zero: no sample is "minus nothing".
        let force_n = -pull.dot(direction) + 0.0;
        let depth_mm = waypoint.depth * 1e3;
        let work_mj = self.last.as_ref().map_or(0.0, |last| {
            last.work_mj + 0.5 * (last.force_n + force_n) * (depth_mm - last.depth_mm)
        });
        Sample {
            run: self.index,
            speed_mm_s: tidy(indentation.speeds[self.index] * 1e3),
            phase: waypoint.phase,
            cycle: waypoint.cycle,
            time_s: waypoint.time,
            depth_mm,
            force_n,
            force_x_n: pull.x,
            force_y_n: pull.y,
            force_z_n: pull.z,
            contact_area_mm2: area * 1e6 + 0.0,
            max_pressure_kpa: max_pressure.map(|p| p * 1e-3),
            n_touching,
            gap_um: contact.gap * 1e6,
            penetration_um: contact.penetration * 1e6,
            tension_n: contact.tension,
            cone_n: contact.cone,
            slip: contact.slip,
            friction_smoothing_um: report.friction_smoothing * 1e6,
            residual: report.residual,
            iterations: report.iterations,
            substeps: report.substeps,
            outcome: word(&Outcome::Converged),
            energy_mj: report.energy * 1e3,
            work_mj,
            volume_ratio_min: ratios.clone().fold(f64::INFINITY, f64::min),
            volume_ratio_max: ratios.fold(0.0, f64::max),
            layer_thickness_mm: (indentation.thicknesses(&self.state).iter())
                .map(|t| t * 1e3)
                .collect(),
        }
    }
}

/// An outcome in a word, for tables.
fn word(outcome: &Outcome) -> &'static str {
    match outcome {
        Outcome::Converged => "converged",
        Outcome::IterationLimit { .. } => "iteration_limit",
        Outcome::Inverted { .. } => "inverted",
        Outcome::Singular => "singular",
    }
}

/// The level at which each layer begins, and the deepest.
fn borders(interval_layer: &[usize]) -> Vec<usize> {
    let mut borders = vec![0];
    borders
        .extend((1..interval_layer.len()).filter(|&i| interval_layer[i] != interval_layer[i - 1]));
    borders.push(interval_layer.len());
    borders
}

fn grip(scene: &Scene, mesh: &PressedBody, place: &Place, model: &Model) -> anyhow::Result<Grip> {
    Ok(match (&scene.tool, &mesh.patch) {
        (Tool::Contact(given), _) => {
            let (tool, pose) = continuum::tool(given, place.direction.into_inner(), place.at)?;
            Grip::Contact { tool, pose }
        }
        (
            _,
            Some(Patch {
                vertices, areas, ..
            }),
        ) => Grip::Bond {
            nodes: vertices.iter().map(|&v| mesh.body.node(v, 0)).collect(),
            areas: areas.clone(),
        },
        _ => Grip::Bond {
            nodes: vec![model.body().node(place.vertex, 0)],
            areas: vec![0.0],
        },
    })
}

/// The state before anything presses: under the tension of its layers, relaxed.
fn rest(scene: &Scene, model: &Model, params: &SolveParams) -> anyhow::Result<State> {
    let mut state = State::new(model);
    if scene.layers.iter().all(|layer| layer.prestress == 0.0) {
        return Ok(state);
    }
    let mut ws = Workspace::new(model);
    let load = Load {
        duration: f64::INFINITY,
        ..Load::default()
    };
    let report = advance(model, &mut state, &mut ws, &Load::default(), &load, params);
    if report.outcome != Outcome::Converged {
        bail!(
            "the body finds no rest under the tension of its layers: {}; make `prestress` smaller, or hold the body with \
             cut_faces = \"fixed\"",
            told(&report.outcome)
        );
    }
    Ok(state)
}

/// An outcome in words.
pub fn told(outcome: &Outcome) -> String {
    match outcome {
        Outcome::Converged => "converged".to_owned(),
        Outcome::IterationLimit { at } => format!(
            "no balance of forces was found, least near ({}) mm",
            in_mm((*at).into())
        ),
        Outcome::Inverted { at } => format!(
            "the tissue would be turned inside out near ({}) mm",
            in_mm((*at).into())
        ),
        Outcome::Singular => "the tissue has lost its stiffness".to_owned(),
    }
}

/// How far the tool can go along its way from `pose` until it touches the skin: 0 where its tip touches first, less where
/// the skin beside it is higher. m
fn first_touch(model: &Model, rest: &State, tool: &RigidTool, pose: &Pose, place: &Place) -> f64 {
    const HALVINGS: usize = 60;
    let body = model.body();
    let direction = place.direction.into_inner();
    let x = |v: usize| {
        let node = body.node(v, 0);
        body.positions[node] + rest.displacements[node]
    };
    // Tension may have moved the skin, and the place with it.
    let start = (x(place.vertex) - place.at).dot(&direction);
    let normals = body.skin.vertex_normals();
    let facing: Vec<Vec3> = (0..body.n_vertices())
        .filter(|&v| normals[v].dot(&direction) < 0.0)
        .map(x)
        .collect();
    let gap = |s: f64| {
        let at = Pose::from_parts(
            (pose.translation.vector + direction * s).into(),
            pose.rotation,
        );
        facing
            .iter()
            .map(|x| tool.distance_at(&at, x).distance)
            .fold(f64::INFINITY, f64::min)
    };
    if gap(start) > -1e-9 {
        return start;
    }
    let mut back = 1e-4;
    while gap(start - back) < 0.0 && back < 1.0 {
        back *= 2.0;
    }
    let (mut free, mut deep) = (start - back, start);
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(free, deep);
        if gap(middle) < 0.0 {
            deep = middle;
        } else {
            free = middle;
        }
    }
    free
}

/// Says where the mesh is known to be too coarse.
fn note_mesh(model: &Model, mesh: &PressedBody, scene: &Scene, notes: &mut Vec<String>) {
    let n_triangles = mesh.body.skin.triangles.len();
    let n_singles = model.n_single_triangles();
    if n_singles as f64 > FEW_SINGLES * n_triangles as f64 {
        notes.push(format!(
            "{n_singles} of {n_triangles} skin triangles have no partner; the prisms under them are too stiff where tissue \
             keeps its volume"
        ));
    }
    let radius = scene.tool.contact_radius();
    if radius > 0.0 && radius < FEWEST_EDGES * mesh.mesh_size {
        notes.push(format!(
            "skin edges near the tool are {:.1} mm long, more than a third of its contact radius of {:.1} mm: the force \
             depends on the mesh; refine it with [mesh] near_tool",
            mesh.mesh_size * 1e3,
            radius * 1e3
        ));
    }
    let edge = scene
        .tool
        .contact()
        .and_then(|tool| tool.shape.edge_radius());
    if let Some(edge) = edge.filter(|&edge| edge < FEWEST_EDGES * mesh.mesh_size) {
        notes.push(format!(
            "skin edges near the tool are {:.1} mm long, more than a third of its edge's radius of {:.1} mm: vertices find the \
             rounded edge or miss it, so that there can be several balances of forces and the force depends on the steps; \
             make the edge rounder, or refine the mesh with [mesh] near_tool",
            mesh.mesh_size * 1e3,
            edge * 1e3
        ));
    }
}

/// Says where tension is let go.
fn note_tension(body: &LayeredBody, scene: &Scene, notes: &mut Vec<String>) {
    let tense = scene.layers.iter().find(|layer| layer.prestress > 0.0);
    let is_free = scene.body.cut_faces == CutFaces::Free && !body.cut_faces.is_empty();
    if let Some(layer) = tense.filter(|_| is_free) {
        notes.push(format!(
            "the cut faces are free and let go of most of the tension of \"{}\" (of 30 kPa in the skin of a block 60 mm wide, \
             3 kPa are left in its middle); set cut_faces = \"fixed\" or \"symmetric\" in [body] to keep it",
            layer.tissue.name
        ));
    }
}

/// Says where steps are too long for friction, which depends on the way that skin has slipped.
fn note_friction(scene: &Scene, notes: &mut Vec<String>) {
    let press = &scene.press;
    let step = press.depth / n_steps(press) as f64;
    let longest = LONGEST_STEP * scene.tool.contact_radius();
    let has_friction = scene.tool.contact().is_some_and(|tool| tool.friction > 0.0);
    if has_friction && step > longest {
        let enough = ((longest * 1e5).floor() / 100.0).max(0.01);
        notes.push(format!(
            "with friction the force depends on the steps, here of {:.2} mm (a sphere of radius 8 mm with friction 0.4, pressed \
             3 mm: 13 % less in one step, 5 % in steps of 1 mm); press with --step \"{enough} mm\" or shorter",
            step * 1e3
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_begin_where_the_layer_changes() {
        assert_eq!(borders(&[0, 1, 1, 2, 2, 2]), [0, 1, 3, 6]);
        assert_eq!(borders(&[0]), [0, 1]);
    }
}
