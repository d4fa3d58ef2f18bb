//! Implicit dynamics: inertia and damping as an addition to a static step.
//!
//! ```text
//! M a + C v + f(u) = p,   C = a₀ M + a₁ K
//! v_new = v + Δt [(1 − γ) a + γ a_new],   u_new = u + Δt v + Δt² [(½ − β) a + β a_new]        (Newmark)
//! ```
//! with γ = 0.6 and β = (γ + ½)²/4: unconditionally stable for linear bodies, and with enough
//! damping of the highest frequencies that contact does not chatter. First-order accurate in Δt
//! through that damping.

use palpa_mesh::Vec3;

use crate::Mat3;
use crate::assembly::Assembler;
use crate::model::Model;
use crate::state::{Memory, State};
use crate::system::LinearSystem;

const GAMMA: f64 = 0.6;
const BETA: f64 = (GAMMA + 0.5) * (GAMMA + 0.5) / 4.0;

/// Inertia and damping of a body.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Dynamics {
    /// Damping in proportion to mass, 1/s.
    pub mass_damping: f64,
    /// Damping in proportion to stiffness, s.
    pub stiffness_damping: f64,
}

/// Inertia and damping of one step, in addition to the static forces.
#[derive(Debug)]
pub(crate) struct Inertia {
    dynamics: Dynamics,
    duration: f64,
    displacements: Vec<Vec3>,
    velocities: Vec<Vec3>,
    accelerations: Vec<Vec3>,
    /// Stiffness at the start of the step, used for damping throughout the step; empty without such
    /// damping.
    stiffness: Vec<Mat3>,
}

impl Inertia {
    /// A step of a positive, finite `duration`.
    pub(crate) fn new(
        model: &Model,
        memory: &Memory,
        dynamics: &Dynamics,
        state: &State,
        duration: f64,
        assembler: &mut Assembler,
        system: &mut LinearSystem,
    ) -> Self {
        let mut stiffness = Vec::new();
        if dynamics.stiffness_damping > 0.0 {
            let mut forces = vec![Vec3::zeros(); model.n_nodes()];
            let u = &state.displacements;
            // If the state is inverted, the first assembly ends the step.
            let _ = assembler.stiffness(model, memory, u, &mut forces, system);
            stiffness.clone_from(&system.blocks);
        }
        Self {
            stiffness,
            dynamics: *dynamics,
            duration,
            displacements: state.displacements.clone(),
            velocities: state.velocities.clone(),
            accelerations: state.accelerations.clone(),
        }
    }

    /// Velocity and acceleration at the end of the step, for a given displacement there.
    fn motion(&self, node: usize, u: &Vec3) -> (Vec3, Vec3) {
        let dt = self.duration;
        let (v, a) = (&self.velocities[node], &self.accelerations[node]);
        let moved = u - self.displacements[node];
        let new_a = (moved - v * dt) / (BETA * dt * dt) - a * ((0.5 - BETA) / BETA);
        let new_v = v + (a * (1.0 - GAMMA) + new_a * GAMMA) * dt;
        (new_v, new_a)
    }

    /// Adds the forces of inertia and damping to `forces`, and their stiffness to `blocks`.
    pub(crate) fn add(
        &self,
        model: &Model,
        displacements: &[Vec3],
        forces: &mut [Vec3],
        blocks: Option<&mut Vec<Mat3>>,
    ) {
        let dt = self.duration;
        let Dynamics {
            mass_damping,
            stiffness_damping,
        } = self.dynamics;
        let mut velocities = vec![Vec3::zeros(); displacements.len()];
        for (node, u) in displacements.iter().enumerate() {
            let (v, a) = self.motion(node, u);
            forces[node] += (a + v * mass_damping) * model.masses[node];
            velocities[node] = v * stiffness_damping;
        }
        if !self.stiffness.is_empty() {
            model
                .structure
                .multiply(&self.stiffness, &velocities, forces);
        }
        let Some(blocks) = blocks else { return };
        let rate = GAMMA / (BETA * dt);
        for (block, damping) in blocks.iter_mut().zip(&self.stiffness) {
            *block += damping * (stiffness_damping * rate);
        }
        for (node, mass) in model.masses.iter().enumerate() {
            if model.structure.is_free_level(node) {
                let added = mass * (1.0 / (BETA * dt * dt) + mass_damping * rate);
                blocks[model.structure.diagonal(node)] += Mat3::identity() * added;
            }
        }
    }

    pub(crate) fn commit(&self, state: &mut State) {
        for node in 0..state.displacements.len() {
            let (v, a) = self.motion(node, &state.displacements[node]);
            state.velocities[node] = v;
            state.accelerations[node] = a;
        }
    }
}
