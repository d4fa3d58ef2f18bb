//! Arrays of the static solver.

use palpa_mesh::Vec3;

use super::contacts::{Contacts, Origin};
use crate::Mat3;
use crate::assembly::Assembler;
use crate::model::Model;
use crate::state::Memory;
use crate::system::{Hold, LinearSystem, Region};

/// Largest share of the body's columns in a region. Above it, the whole factor is computed again.
const LARGEST_SHARE: f64 = 0.6;

/// Scratch memory of the solver. Its content between calls changes no result by more than the
/// tolerance.
#[derive(Debug)]
pub struct Workspace {
    pub(super) system: LinearSystem,
    pub(super) assembler: Assembler,
    pub(crate) memory: Memory,
    /// Unbalanced forces at the present displacements, without those of contact, N. `[n_nodes]`
    pub(super) forces: Vec<Vec3>,
    /// Scratch for forces, N. `[n_nodes]`
    pub(super) trial_forces: Vec<Vec3>,
    /// Forces that are not in balance, with those of contact, N. `[n_nodes]`
    pub(super) right_side: Vec<Vec3>,
    /// Displacements prescribed by holds and guides, m. `[n_nodes]`
    pub(super) demand: Vec<Vec3>,
    /// The linear system's solution: displacements, m, `[n_nodes]`, and multipliers of contact, N.
    pub(super) delta: Vec<Vec3>,
    pub(super) multipliers: Vec<Vec3>,
    /// Scratch for displacements, m. `[n_nodes]`
    pub(super) trial: Vec<Vec3>,
    /// Directions held by supports and loads. `[n_nodes]`
    pub(super) given: Vec<Hold>,
    pub(super) contacts: Contacts,
    /// Where the present solve began.
    pub(super) origin: Origin,
    /// Stiffness that contact, and springs in its place, have added to the system's blocks: block,
    /// row and column node, and stiffness, N/m.
    pub(super) added: Vec<(usize, [usize; 2], Mat3)>,
    pub(super) springs: Vec<(usize, [usize; 2], Mat3)>,
    /// Stiffness of the springs, as a share of the skin's own.
    pub(super) spring: f64,
}

impl Workspace {
    /// Scratch for a model.
    pub fn new(model: &Model) -> Self {
        Self::with_region(model, None)
    }

    /// Scratch for a model that is pressed where the skin, at rest, is within `radius` (m) of any of
    /// `points`. Steps are faster if tools touch the skin there only. Results are the same within
    /// the tolerance.
    pub fn round(model: &Model, points: &[Vec3], radius: f64) -> Self {
        let skin = &model.body.skin.points;
        let is_near = |p: &Vec3| points.iter().any(|at| (p - at).norm() <= radius);
        let is_inside: Vec<bool> = skin.iter().map(is_near).collect();
        let n_inside = is_inside.iter().filter(|inside| **inside).count();
        let is_worth_it = n_inside > 0 && (n_inside as f64) < LARGEST_SHARE * skin.len() as f64;
        // A region whose factor would be too large is left out.
        let region = is_worth_it
            .then(|| Region::new(&model.structure, &model.body.skin, is_inside).ok())
            .flatten();
        Self::with_region(model, region)
    }

    fn with_region(model: &Model, region: Option<Region>) -> Self {
        let zeros = || vec![Vec3::zeros(); model.n_nodes()];
        let memory = Memory::new(model);
        Self {
            assembler: Assembler::new(model, &memory, region.as_ref()),
            system: LinearSystem::new(&model.structure, model.n_nodes(), region),
            memory,
            forces: zeros(),
            trial_forces: zeros(),
            right_side: zeros(),
            demand: zeros(),
            delta: zeros(),
            multipliers: Vec::new(),
            trial: zeros(),
            given: model.supports.clone(),
            contacts: Contacts::new(model),
            origin: Origin::default(),
            added: Vec::new(),
            springs: Vec::new(),
            spring: 0.0,
        }
    }

    /// Force that holds each node in the last solved state, N; zero for a free node. `[n_nodes]`
    pub fn reactions(&self) -> &[Vec3] {
        &self.forces
    }
}
