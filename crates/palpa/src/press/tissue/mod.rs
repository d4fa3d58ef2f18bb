//! The scripted indentation with the continuum model.

mod notes;
mod record;
mod result;
mod run;
mod sample;

use std::sync::Arc;

use palpa_fem::{
    Dynamics, Model, Outcome, PosedTool, SolveParams, State, StepReport, Workspace, advance,
    assume_pressures, equilibrate, pressures_at,
};
use palpa_mesh::Vec3;

pub(crate) use self::notes::{note_mesh, note_tension};
pub use self::record::{Deepest, Record, TurnedPrisms};
pub use self::result::{LargestErrors, LayerResult, RunResult};
pub use self::run::Run;
use self::run::{Acting, Earlier};
pub use self::sample::{Failure, Sample, SampleOutcome};
use super::mesh::{Patch, PressedBody, footprint};
use super::{Phase, Place, Waypoint, n_steps, waypoints};
use crate::note::Note;
use crate::prepare::{Approach, Prepared};

/// Number of samples of a rest in which tissue relaxes. They are evenly spaced in the logarithm of
/// time, from this share of the rest on.
const HOLD_SAMPLES: usize = 10;
const FIRST_HOLD: f64 = 0.01;

/// Distance from the tool's footprint, in addition to the depth, within which the stiffness is
/// computed anew in every iteration, m.
const REGION_MARGIN: f64 = 0.01;

/// Number of iterations after which a start was not near enough to the equilibrium.
const NEAR_ITERATIONS: usize = 20;

/// Tolerance of an elastic equilibrium near a known one.
const ELASTIC_TOLERANCE: f64 = 1e-5;

/// Number of steps to a depth from rest; those at [`accuracy`](crate::accuracy)'s depths are among
/// them.
const FROM_REST: usize = 4;

/// Distance between the points of a footprint if the mesh has no size of its own, m.
const ANY_SIZE: f64 = 1e-3;

/// An indentation that is set up: the data that stays constant while it runs.
#[derive(Debug)]
pub struct Indentation {
    /// The scene that is pressed.
    pub prepared: Arc<Prepared>,
    /// The finite elements of the scene's body.
    pub model: Arc<Model>,
    /// The level at which each layer begins, then the deepest level. `[n_layers + 1]`
    pub borders: Vec<usize>,
    /// Speeds at which the whole press is run, m/s; at least one.
    pub speeds: Vec<f64>,
    /// Whether any tissue relaxes, so that speed and rest matter.
    pub is_viscous: bool,
    /// Remarks for the user: the notes of the prepared scene, then those of the press.
    pub notes: Vec<Note>,
    grip: Grip,
    /// The state at rest, in equilibrium with the tension of the layers.
    rest: State,
    params: SolveParams,
    dynamics: Option<Dynamics>,
}

/// A deformed body in an equilibrium or near one: displacements, and the tool's pressure.
#[derive(Debug, Clone)]
pub(crate) struct Deformed {
    /// Displacements of the nodes, m. `[n_nodes]`
    pub displacements: Vec<Vec3>,
    /// Pressure of the tool, Pa. `[n_vertices]`
    pub pressures: Vec<f64>,
}

impl Deformed {
    /// Number of skin vertices that touch the tool.
    pub(crate) fn n_touching(&self) -> usize {
        self.pressures.iter().filter(|&&p| p > 0.0).count()
    }
}

/// The contact between tool and skin.
#[derive(Debug)]
enum Grip {
    /// These nodes are bonded to the tool. `areas` are the areas of skin that they stand for (m²);
    /// empty if the tool has no area.
    Bond { nodes: Vec<usize>, areas: Vec<f64> },
    /// The tool touches the skin and can separate from it.
    Contact(Approach),
}

impl Indentation {
    /// Sets up the indentation of a prepared scene, and brings the body to equilibrium with the
    /// tension of its layers.
    ///
    /// # Errors
    /// When the body cannot be pressed, or no equilibrium at rest is found.
    pub fn build(prepared: Arc<Prepared>) -> anyhow::Result<Self> {
        let scene = &prepared.scene;
        let is_viscous = (prepared.materials.materials.iter()).any(|m| m.prony.is_some());
        let model = prepared.model()?;
        let mut notes = prepared.notes.clone();
        note_mesh(&model, &prepared.mesh, scene, &mut notes);
        note_tension(&prepared.mesh.body, scene, &mut notes);
        let rest = prepared.rest()?;
        let grip = grip(&prepared, &rest)?;
        let speeds = match &scene.press.speeds[..] {
            [] => vec![scene.press.speed],
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
            notes.push(Note::SpeedsAlike);
        }
        Ok(Self {
            borders: borders(&prepared.mesh.body.interval_layer),
            model,
            speeds,
            is_viscous,
            notes,
            grip,
            rest,
            params: prepared.solve_params(),
            dynamics,
            prepared,
        })
    }

    /// The body refined where it is pressed.
    pub fn mesh(&self) -> &PressedBody {
        &self.prepared.mesh
    }

    /// The place that is pressed.
    pub fn place(&self) -> &Place {
        self.prepared.place()
    }

    /// Number of skin vertices that are bonded to the tool.
    pub fn n_bonded(&self) -> usize {
        match &self.grip {
            Grip::Bond { nodes, .. } => nodes.len(),
            Grip::Contact(_) => 0,
        }
    }

    /// Whether inertia and damping are included.
    pub fn is_dynamic(&self) -> bool {
        self.dynamics.is_some()
    }

    /// Whether the skin is bonded to the tool.
    pub fn is_bonded(&self) -> bool {
        matches!(self.grip, Grip::Bond { .. })
    }

    /// Whether the tool is in contact with the skin over an area that grows from nothing.
    pub(crate) fn is_round(&self) -> bool {
        let tool = &self.prepared.scene.tool;
        tool.contact().is_some() && !tool.is_flat()
    }

    /// Number of samples of the run at one speed.
    pub fn n_samples(&self) -> usize {
        self.path(self.speeds[0]).len()
    }

    /// Index of the deepest sample in a run, at the end of the first loading.
    pub fn deepest(&self) -> usize {
        let path = self.path(self.speeds[0]);
        let is_down = |w: &Waypoint| w.phase == Phase::Load && w.cycle == 0;
        path.iter().rposition(is_down).unwrap_or(0)
    }

    /// Starts the run at speed number `index`, with the body at rest.
    pub fn start(&self, index: usize) -> Run<'_> {
        Run {
            indentation: self,
            index,
            state: self.rest.clone(),
            workspace: self.workspace(),
            fields: Vec::new(),
            path: self.path(self.speeds[index]),
            next: 0,
            before: Acting::default(),
            earlier: Earlier::default(),
            time: 0.0,
            last: None,
            failure: None,
        }
    }

    /// Whether the force depends on the steps in which the tool comes down.
    pub fn has_history(&self) -> bool {
        let friction = |tool: PosedTool| tool.tool.friction() > 0.0;
        self.is_viscous || self.dynamics.is_some() || self.tool_at(0.0).is_some_and(friction)
    }

    /// The relative change of the force at the deepest that is expected if load steps are halved, for
    /// the run at the first speed: half of the change from steps twice as long; a single step is halved
    /// itself. `force_n` is the force of the press. `None` if the force does not depend on steps, or
    /// the other ones find no equilibrium. `goes_on` is asked after each step; if it returns false,
    /// there is no result.
    pub fn load_step_change(&self, force_n: f64, goes_on: impl Fn() -> bool) -> Option<f64> {
        if !self.has_history() || force_n == 0.0 {
            return None;
        }
        let press = &self.prepared.scene.press;
        let n = n_steps(press);
        let n_other = if n > 1 { n.div_ceil(2) } else { 2 };
        let other = palpa_scene::Press {
            step: press.depth / n_other as f64,
            ..press.clone()
        };
        let mut run = self.start(0);
        run.path = waypoints(&other, self.speeds[0], &[1.0]);
        let is_down = |w: &Waypoint| w.phase == Phase::Load && w.cycle == 0;
        let n_down = run.path.iter().take_while(|w| is_down(w)).count();
        let mut last = None;
        for _ in 0..n_down {
            last = Some(run.advance()?).filter(|s| s.outcome.is_converged() && goes_on());
            last.as_ref()?;
        }
        // If the error falls in proportion to the step; in relaxing tissue it falls faster.
        let share = n_other as f64 / (2.0 * (n as f64 - n_other as f64));
        last.map(|other| share * (force_n - other.force_n) / force_n)
    }

    /// Memory for the solver, prepared for touch under the tool.
    pub(crate) fn workspace(&self) -> Workspace {
        let (points, radius) = self.region();
        Workspace::round(&self.model, &points, radius)
    }

    /// Points of the skin that the tool presses on, and the radius around them that it reaches, m.
    pub(crate) fn footprint(&self) -> (Vec<Vec3>, f64) {
        let place = self.place();
        let h = self
            .mesh()
            .sizes
            .map_or(ANY_SIZE, |sizes| sizes.skin.at(0.0));
        footprint(&self.prepared.scene, place.at, &place.direction, h)
    }

    /// Points of the skin, and the radius around them within which contact and stiffness change
    /// most, m.
    pub(crate) fn region(&self) -> (Vec<Vec3>, f64) {
        let (points, radius) = self.footprint();
        (
            points,
            radius + REGION_MARGIN + self.prepared.scene.press.depth,
        )
    }

    /// The body with these displacements in an equilibrium, with the tool at a depth, m.
    pub(crate) fn deformed(&self, displacements: &[Vec3], depth: f64) -> Deformed {
        let tools: Vec<PosedTool> = self.tool_at(depth).into_iter().collect();
        Deformed {
            pressures: pressures_at(&self.model, displacements, &tools),
            displacements: displacements.to_vec(),
        }
    }

    /// The force (N) and the deformed body at a depth (m), without relaxation, inertia or a
    /// history of friction; `None` if no equilibrium is found. `guess` is near it.
    pub(crate) fn elastic(
        &self,
        ws: &mut Workspace,
        depth: f64,
        guess: &Deformed,
    ) -> Option<(f64, Deformed)> {
        let mut state = State::new(&self.model);
        let report = self.settle(ws, &mut state, depth, guess);
        (report.outcome == Outcome::Converged).then(|| self.reached(ws, &state, &report, depth))
    }

    /// The same on the way from rest to a depth, m: the depths of the steps in which an equilibrium
    /// was found, with forces and deformed bodies.
    pub(crate) fn elastic_from_rest(
        &self,
        ws: &mut Workspace,
        depth: f64,
        mut goes_on: impl FnMut() -> bool,
    ) -> Vec<(f64, f64, Deformed)> {
        let mut state = State::new(&self.model);
        state.displacements.clone_from(&self.rest.displacements);
        let mut before = self.acting(0.0);
        let mut found = Vec::new();
        for step in 1..=FROM_REST {
            let depth = depth * step as f64 / FROM_REST as f64;
            let next = self.acting(depth);
            let loads = [&before, &next].map(|acting| acting.load(0.0, None));
            let [from, to] = &loads;
            if !goes_on() {
                break;
            }
            let report = advance(&self.model, &mut state, ws, from, to, &self.params);
            if report.outcome != Outcome::Converged {
                break;
            }
            let (force, deformed) = self.reached(ws, &state, &report, depth);
            found.push((depth, force, deformed));
            before = next;
        }
        found
    }

    /// The force and the deformed body of an equilibrium.
    fn reached(
        &self,
        ws: &Workspace,
        state: &State,
        report: &StepReport,
        depth: f64,
    ) -> (f64, Deformed) {
        let bonded: Vec<usize> = (self.acting(depth).held.iter())
            .map(|held| held.0)
            .collect();
        let deformed = Deformed {
            pressures: state.touches.iter().map(|t| t.pressure).collect(),
            displacements: state.displacements.clone(),
        };
        (self.force_of(report, &bonded, ws), deformed)
    }

    /// Solves the equilibrium at a depth, m, from a guess near it.
    fn settle(
        &self,
        ws: &mut Workspace,
        state: &mut State,
        depth: f64,
        guess: &Deformed,
    ) -> StepReport {
        let acting = self.acting(depth);
        state.displacements.clone_from(&guess.displacements);
        assume_pressures(&self.model, state, &acting.tools, &guess.pressures);
        let load = acting.load(0.0, None);
        let params = SolveParams {
            tolerance: ELASTIC_TOLERANCE,
            ..self.near_params()
        };
        equilibrate(&self.model, state, ws, &load, &params)
    }

    /// The force on the tool against its direction, N. `bonded` are the nodes bonded to it.
    pub(crate) fn force_of(&self, report: &StepReport, bonded: &[usize], ws: &Workspace) -> f64 {
        let pull: Vec3 = if self.is_bonded() {
            bonded.iter().map(|&node| -ws.reactions()[node]).sum()
        } else {
            report.tool_forces.iter().sum()
        };
        -pull.dot(&self.place().direction)
    }

    /// The skin vertices that are bonded to the tool.
    pub(crate) fn bonded_vertices(&self) -> Vec<usize> {
        let n_levels = self.mesh().body.n_levels;
        match &self.grip {
            Grip::Bond { nodes, .. } => nodes.iter().map(|node| node / n_levels).collect(),
            Grip::Contact(_) => Vec::new(),
        }
    }

    /// Displacements of the body at rest, m. `[n_nodes]`
    pub(crate) fn rest_displacements(&self) -> &[Vec3] {
        &self.rest.displacements
    }

    /// Tolerances for a solve that starts near the equilibrium.
    pub(crate) fn near_params(&self) -> SolveParams {
        SolveParams {
            is_near: true,
            max_iterations: NEAR_ITERATIONS,
            ..self.params
        }
    }

    /// The rigid tool with its pose at a depth (m); `None` if the skin is bonded to it.
    pub fn tool_at(&self, depth: f64) -> Option<PosedTool> {
        match &self.grip {
            Grip::Bond { .. } => None,
            Grip::Contact(approach) => Some(approach.at(depth)),
        }
    }

    /// Pressure of the tool on the skin after the last step of `run`, Pa. `[n_vertices]`
    pub fn skin_pressure(&self, run: &Run<'_>) -> Vec<f64> {
        let body = &self.mesh().body;
        let reactions = run.workspace.reactions();
        let mut pressure = vec![0.0; body.n_vertices()];
        match &self.grip {
            Grip::Bond { nodes, areas } => {
                for (&node, area) in nodes.iter().zip(areas).filter(|(_, area)| **area > 0.0) {
                    let pressing = reactions[node].dot(&self.place().direction);
                    pressure[node / body.n_levels] = pressing / area;
                }
            }
            Grip::Contact(_) => {
                for (into, touch) in pressure.iter_mut().zip(&run.state.touches) {
                    *into = touch.pressure;
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
            // Without relaxation nothing changes during the rest.
            vec![1.0]
        };
        waypoints(&self.prepared.scene.press, speed, &rests)
    }

    fn acting(&self, depth: f64) -> Acting {
        match &self.grip {
            Grip::Bond { nodes, .. } => {
                let way = self.place().direction.into_inner() * depth;
                let at = |&node: &usize| (node, self.rest.displacements[node] + way);
                Acting {
                    held: nodes.iter().map(at).collect(),
                    ..Acting::default()
                }
            }
            Grip::Contact(_) => Acting {
                tools: self.tool_at(depth).into_iter().collect(),
                ..Acting::default()
            },
        }
    }

    /// Thickness of each layer along the column under the place, m. `[n_layers]`
    fn thicknesses(&self, state: &State) -> Vec<f64> {
        let body = &self.mesh().body;
        let at = |level: usize| {
            self.place().point.mean(|v| {
                let node = body.node(v, level);
                body.positions[node] + state.displacements[node]
            })
        };
        let length = |levels: &[usize]| -> f64 {
            (levels[0]..levels[1])
                .map(|l| (at(l + 1) - at(l)).norm())
                .sum()
        };
        self.borders.windows(2).map(length).collect()
    }
}

/// The level at which each layer begins, then the deepest level. `[n_layers + 1]`
fn borders(interval_layer: &[usize]) -> Vec<usize> {
    let mut borders = vec![0];
    borders
        .extend((1..interval_layer.len()).filter(|&i| interval_layer[i] != interval_layer[i - 1]));
    borders.push(interval_layer.len());
    borders
}

fn grip(prepared: &Prepared, rest: &State) -> anyhow::Result<Grip> {
    if let Some(tool) = prepared.scene.tool.contact() {
        return Ok(Grip::Contact(prepared.approach(tool, Some(rest))?));
    }
    let mesh = &prepared.mesh;
    Ok(match &mesh.patch {
        Some(Patch {
            vertices, areas, ..
        }) => Grip::Bond {
            nodes: vertices.iter().map(|&v| mesh.body.node(v, 0)).collect(),
            areas: areas.clone(),
        },
        None => Grip::Bond {
            nodes: vec![mesh.body.node(mesh.place.vertex, 0)],
            areas: vec![0.0],
        },
    })
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
