//! The state of a body: everything that evolves while it is pressed.

use palpa_mesh::Vec3;
use rayon::prelude::*;

use crate::Mat3;
use crate::contact::Touch;
use crate::element::{N_POINTS, Overstress, elastic_stresses};
use crate::law::{Prony, PronyStep};
use crate::model::Model;

/// The state of a body; cheap to copy back and forth.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Displacement of every node from rest, in m. `[n_nodes]`
    pub displacements: Vec<Vec3>,
    /// Velocity of every node, in m/s; zero unless dynamics is on. `[n_nodes]`
    pub velocities: Vec<Vec3>,
    /// Acceleration of every node, in m/s². `[n_nodes]`
    pub accelerations: Vec<Vec3>,
    /// Touch of every skin vertex. `[n_vertices]`
    pub touches: Vec<Touch>,
    /// Time, in s.
    pub time: f64,
    /// For each phase of a viscous material, the last elastic stress and the memories, point by
    /// point.
    pub(crate) history: Vec<PhaseHistory>,
}

/// Memory of one phase of one group.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct PhaseHistory {
    /// `[point][row]`, rows as in [`crate::law::Prony`]; empty for an elastic material.
    points: Vec<[f64; 6]>,
    volume: Vec<[f64; 1]>,
}

impl PhaseHistory {
    /// Adds a multiple of the last elastic stresses of another memory.
    pub(crate) fn add_last(&mut self, by: f64, other: &Self) {
        let n_rows = self.volume.len();
        for (into, from) in self
            .points
            .iter_mut()
            .zip(&other.points)
            .step_by(n_rows.max(1))
        {
            for (into, from) in into.iter_mut().zip(from) {
                *into += by * from;
            }
        }
        if let (Some(into), Some(from)) = (self.volume.first_mut(), other.volume.first()) {
            into[0] += by * from[0];
        }
    }

    /// Takes over the memory of other pairs' phases. `old` has, for each of this pair's two wedges,
    /// the old phase and the index of the wedge in its pair.
    pub(crate) fn carry(&mut self, old: [(&Self, usize); 2]) {
        let n = self.points.len() / N_POINTS;
        let mean = |a: f64, b: f64| 0.5 * (a + b);
        let [(a, _), (b, _)] = old;
        for i in 0..2 * n {
            self.points[i] = std::array::from_fn(|c| mean(a.points[i][c], b.points[i][c]));
        }
        for (into, (a, b)) in self.volume.iter_mut().zip(a.volume.iter().zip(&b.volume)) {
            into[0] = mean(a[0], b[0]);
        }
        for (k, (old, half)) in old.into_iter().enumerate() {
            let from = &old.points[2 * n * (half + 1)..2 * n * (half + 2)];
            self.points[2 * n * (k + 1)..2 * n * (k + 2)].copy_from_slice(from);
        }
    }
}

impl State {
    /// A body at rest.
    pub fn new(model: &Model) -> Self {
        let n = model.n_nodes();
        let history = if model.has_memory {
            model
                .phases
                .iter()
                .map(|phase| {
                    let prony = &model.materials[phase.material as usize].prony;
                    prony
                        .as_ref()
                        .map_or_else(PhaseHistory::default, |prony| PhaseHistory {
                            points: vec![[0.0; 6]; N_POINTS * prony.n_rows()],
                            volume: vec![[0.0]; prony.n_rows()],
                        })
                })
                .collect()
        } else {
            Vec::new()
        };
        Self {
            displacements: vec![Vec3::zeros(); n],
            velocities: vec![Vec3::zeros(); n],
            accelerations: vec![Vec3::zeros(); n],
            touches: vec![Touch::OPEN; model.body.n_vertices()],
            time: 0.0,
            history,
        }
    }

    /// Positions of all nodes, in m. `[n_nodes]`
    pub fn positions(&self, model: &Model) -> Vec<Vec3> {
        model
            .body
            .positions
            .iter()
            .zip(&self.displacements)
            .map(|(x, u)| x + u)
            .collect()
    }
}

/// Factors and constant stresses of all materials in a step.
#[derive(Debug, Clone)]
pub(crate) struct Memory {
    /// For each material, the factors of its deviatoric and volumetric part.
    pub(crate) scales: Vec<[f64; 2]>,
    /// Constant stresses of each phase; empty if no material has any.
    pub(crate) overstress: Vec<Overstress>,
    steps: Vec<Option<PronyStep>>,
}

impl Memory {
    pub(crate) fn new(model: &Model) -> Self {
        let none = Overstress {
            points: [Mat3::zeros(); N_POINTS],
            volume: 0.0,
        };
        let n = if model.has_memory {
            model.phases.len()
        } else {
            0
        };
        Self {
            scales: vec![[1.0; 2]; model.materials.len()],
            overstress: vec![none; n],
            steps: vec![None; model.materials.len()],
        }
    }

    /// Copies the factors of the materials, and the constant stresses of some groups.
    pub(crate) fn copy_from(&mut self, model: &Model, from: &Self, groups: &[u32]) {
        self.scales.copy_from_slice(&from.scales);
        self.steps.copy_from_slice(&from.steps);
        if !model.has_memory {
            return;
        }
        for &g in groups {
            let first = model.first_phase[g as usize] as usize;
            let end = model.first_phase[g as usize + 1] as usize;
            self.overstress[first..end].copy_from_slice(&from.overstress[first..end]);
        }
    }

    /// Prepares a step that lasts `dt`.
    pub(crate) fn begin(&mut self, model: &Model, state: &State, dt: f64) {
        if !model.has_memory {
            return;
        }
        self.begin_materials(model, dt);
        let steps = &self.steps;
        let overstress = self.overstress.par_iter_mut().enumerate();
        overstress.for_each(|(p, overstress)| {
            *overstress = constant_stresses(model, steps, p, &state.history[p]);
        });
    }

    /// Factors of every material, without the constant stresses of the groups.
    pub(crate) fn begin_materials(&mut self, model: &Model, dt: f64) {
        for ((material, scale), step) in model
            .materials
            .iter()
            .zip(&mut self.scales)
            .zip(&mut self.steps)
        {
            *step = material.prony.as_ref().map(|prony| prony.step(dt));
            *scale = match (&step, &material.prony) {
                (Some(step), Some(prony)) => {
                    let volume = if prony.relaxes_volume() {
                        step.scale()
                    } else {
                        1.0
                    };
                    [step.scale(), volume]
                }
                _ => [1.0; 2],
            };
        }
    }

    /// Prepares a step at whose end only the last elastic stresses are updated.
    pub(crate) fn hold(&mut self, model: &Model) {
        for (material, step) in model.materials.iter().zip(&mut self.steps) {
            *step = material.prony.as_ref().map(Prony::hold);
        }
    }

    /// Constant stresses of a group in the step that has begun.
    pub(crate) fn begin_group(&mut self, model: &Model, state: &State, g: usize) {
        for p in model.first_phase[g] as usize..model.first_phase[g + 1] as usize {
            self.overstress[p] = constant_stresses(model, &self.steps, p, &state.history[p]);
        }
    }

    /// Relaxation factors of a material in this step, if it is viscous.
    pub(crate) fn step_of(&self, material: usize) -> Option<&PronyStep> {
        self.steps[material].as_ref()
    }

    /// Ends the step: updates the memory of every point.
    pub(crate) fn commit(&self, model: &Model, state: &mut State) {
        if self.steps.iter().all(Option::is_none) {
            return;
        }
        let displacements = &state.displacements;
        let histories = state.history.par_iter_mut().enumerate();
        histories.for_each(|(p, history)| self.advance(model, displacements, p, history));
    }

    /// Ends the step for one group.
    pub(crate) fn commit_group(&self, model: &Model, state: &mut State, g: usize) {
        for p in model.first_phase[g] as usize..model.first_phase[g + 1] as usize {
            self.advance(model, &state.displacements, p, &mut state.history[p]);
        }
    }

    /// Updates the memory of a phase.
    fn advance(&self, model: &Model, displacements: &[Vec3], p: usize, history: &mut PhaseHistory) {
        let index = model.phases[p].material as usize;
        let material = &model.materials[index];
        let (Some(step), Some(prony)) = (&self.steps[index], &material.prony) else {
            return;
        };
        let g = model.phase_group[p] as usize;
        let (i, group) = (g / model.n_groups(), g % model.n_groups());
        let stresses = elastic_stresses(
            model.structure.groups[group].shape,
            &model.geometries[g],
            &model.group_nodes(group, i).map(|n| displacements[n]),
            &material.law,
        );
        // An accepted step has no inverted point.
        let Some(stresses) = stresses else { return };
        for (point, rows) in history.points.chunks_mut(prony.n_rows()).enumerate() {
            step.advance(rows, &components(&stresses.points[point]));
        }
        step.advance(&mut history.volume, &[stresses.volume]);
    }
}

/// Constant stresses of a phase in a step: tension, and memory of earlier steps.
fn constant_stresses(
    model: &Model,
    steps: &[Option<PronyStep>],
    p: usize,
    history: &PhaseHistory,
) -> Overstress {
    let index = model.phases[p].material as usize;
    let material = &model.materials[index];
    let tension = in_plane(model, model.phase_group[p] as usize) * material.prestress;
    let mut overstress = Overstress {
        points: [tension; N_POINTS],
        volume: 0.0,
    };
    if let (Some(step), Some(prony)) = (&steps[index], &material.prony) {
        for (point, rows) in history.points.chunks(prony.n_rows()).enumerate() {
            overstress.points[point] += symmetric(&step.memory(rows));
        }
        if prony.relaxes_volume() {
            overstress.volume = step.memory(&history.volume)[0];
        }
    }
    overstress
}

/// The projection on the plane of a group's layer.
pub(crate) fn in_plane(model: &Model, g: usize) -> Mat3 {
    let normal = model.geometries[g].thickness_gradient.normalize();
    Mat3::identity() - normal * normal.transpose()
}

fn components(s: &Mat3) -> [f64; 6] {
    [
        s[(0, 0)],
        s[(1, 1)],
        s[(2, 2)],
        f64::midpoint(s[(0, 1)], s[(1, 0)]),
        f64::midpoint(s[(1, 2)], s[(2, 1)]),
        f64::midpoint(s[(2, 0)], s[(0, 2)]),
    ]
}

fn symmetric(c: &[f64; 6]) -> Mat3 {
    Mat3::new(c[0], c[3], c[5], c[3], c[1], c[4], c[5], c[4], c[2])
}
