//! The exterior: the body outside the zone, with the stiffness of an earlier state.

use palpa_mesh::Vec3;
use palpa_sparse::fronts::{
    Exterior, FactorScratch, Half, SolveScratch, back_substitute_to, substitute,
};
use palpa_sparse::{Block, ColumnPattern};

use super::plan::{Plan, Trouble};
use crate::batch::{Batches, Pressure, Tangent};
use crate::model::Model;
use crate::state::Memory;

/// The exterior, linearised about an earlier state.
#[derive(Debug, Clone)]
pub(super) struct Outside {
    /// Number of the factor.
    pub(super) id: u64,
    /// Number of the zone that this is the exterior of.
    pub(super) plan: u64,
    pub(super) factor: Exterior<f32>,
    /// The exterior's own right side after elimination, and its force on the ring.
    right: Vec<f32>,
    /// Displacements of all nodes at the point of linearisation, m. `[n_nodes]`
    pub(super) at: Vec<Vec3>,
}

impl Outside {
    pub(super) fn new(model: &Model, plan: &Plan) -> Self {
        Self {
            id: 0,
            plan: plan.id,
            factor: Exterior::new(&plan.tree),
            right: vec![0.0; model.structure.n_dofs()],
            at: vec![Vec3::zeros(); model.n_nodes()],
        }
    }

    /// Fits it to the exterior of another zone, which must be factored before it is used.
    pub(super) fn fit(&mut self, plan: &Plan) {
        self.plan = plan.id;
        self.factor.fit(&plan.tree);
    }

    /// Adds the exterior's force on the ring, at these displacements, to a right side. Cost:
    /// quadratic in the size of the ring.
    pub(super) fn push(
        &self,
        plan: &Plan,
        displacements: &[Vec3],
        x: &mut [f32],
        moves: &mut [f32],
    ) {
        let n = 3 * plan.ring.len();
        let first = x.len() - n;
        let moves = &mut moves[..n];
        let mut has_moved = false;
        for &[node, dof] in &plan.ring {
            let change = displacements[node as usize] - self.at[node as usize];
            has_moved |= change != Vec3::zeros();
            for c in 0..3 {
                moves[dof as usize - first + c] = change[c] as f32;
            }
        }
        let ring = &mut x[first..];
        for (x, right) in ring.iter_mut().zip(&self.right[first..]) {
            *x += right;
        }
        if has_moved {
            self.factor.subtract_response(moves, ring);
        }
    }

    /// Updates the displacements of the exterior to follow those of the ring; `only` those of some
    /// columns, given with the fronts above them; under a `load` on the exterior (see
    /// [`Self::take_load`]). Cost: a substitution through the exterior, or through those fronts.
    #[expect(
        clippy::too_many_arguments,
        reason = "a model, its zone, what is wanted, and arrays to work in"
    )]
    pub(super) fn settle(
        &self,
        model: &Model,
        plan: &Plan,
        only: Option<(&[u32], &[bool])>,
        load: Option<&[f32]>,
        displacements: &mut [Vec3],
        x: &mut [f32],
        scratch: &mut SolveScratch<f32>,
    ) {
        if plan.exterior.is_empty() {
            return;
        }
        let n = plan.tree.first_zone_dof();
        x[..n].copy_from_slice(&self.right[..n]);
        if let Some(load) = load {
            x[..n].iter_mut().zip(load).for_each(|(x, load)| *x += load);
        }
        x[n..].fill(0.0);
        for &[node, dof] in &plan.ring {
            let change = displacements[node as usize] - self.at[node as usize];
            for c in 0..3 {
                x[dof as usize + c] = change[c] as f32;
            }
        }
        let (tree, wanted) = (&plan.tree, only.map(|(_, fronts)| fronts));
        back_substitute_to(tree, Half::Exterior, wanted, &self.factor, x, scratch);
        let mut put = |node: usize, dof: usize| {
            let change = Vec3::from_fn(|c, _| f64::from(x[dof + c]));
            let change = model.supports[node].free_part(&change);
            displacements[node] = self.at[node] + change;
        };
        match only {
            Some((columns, _)) => columns.iter().for_each(|&v| {
                let first = tree.first_dof(v as usize);
                (0..model.structure.n_free_levels)
                    .for_each(|l| put(model.body.node(v as usize, l), first + 3 * l));
            }),
            None => (plan.exterior.iter()).for_each(|&[n, dof]| put(n as usize, dof as usize)),
        }
    }

    /// Forces on nodes of the exterior (N, with the first unknown of each), as a right side after
    /// elimination: on the exterior itself, and what is left on the ring. Cost: a substitution.
    pub(super) fn take_load(
        &self,
        plan: &Plan,
        forces: impl Iterator<Item = (usize, Vec3)>,
        load: &mut [f32],
        scratch: &mut SolveScratch<f32>,
    ) {
        load.fill(0.0);
        for (dof, force) in forces {
            for c in 0..3 {
                load[dof + c] += force[c] as f32;
            }
        }
        substitute(&plan.tree, Half::Exterior, &self.factor, load, scratch);
    }

    /// Assembles and factors the exterior's stiffness at these displacements, and linearises about
    /// them. Where it is not positive definite with this pressure, it has none. Gives up once `is_wanted` says no.
    #[expect(
        clippy::too_many_arguments,
        reason = "a model, its zone and two rooms to work in"
    )]
    pub(super) fn refactor(
        &mut self,
        model: &Model,
        memory: &Memory,
        pattern: &ColumnPattern,
        plan: &Plan,
        follower: &mut Follower,
        workshop: &mut Workshop,
        displacements: &[Vec3],
        pressure: Pressure<'_>,
        is_wanted: &(dyn Fn() -> bool + Sync),
    ) -> Result<(), Trouble> {
        if !plan.exterior.is_empty() {
            let mut factor = |pressure| {
                let blocks = &mut workshop.blocks;
                blocks.fill([0.0; 9]);
                let batches = &mut follower.batches;
                batches.add_stiffness(model, memory, displacements, blocks, pressure)?;
                plan.support(model, pattern, false, blocks);
                let scratch = &mut workshop.scratch;
                let is_made = (self.factor).factor_while(&plan.tree, blocks, scratch, is_wanted)?;
                if is_made {
                    Ok(())
                } else {
                    Err(Trouble::GivenUp)
                }
            };
            match factor(pressure) {
                Err(Trouble::Singular) => factor(Pressure::None)?,
                other => other?,
            }
        }
        // The stiffness is that of the present state, so no forces can have reversed.
        follower.forces.fill(Vec3::zeros());
        follower.share = 1.0;
        self.follow(model, memory, plan, follower, displacements)?;
        Ok(())
    }

    /// Linearises about other displacements, with the old stiffness. Cost: the forces of the
    /// exterior's prisms and a substitution. Returns the exterior's own unbalanced forces, N.
    pub(super) fn follow(
        &mut self,
        model: &Model,
        memory: &Memory,
        plan: &Plan,
        follower: &mut Follower,
        displacements: &[Vec3],
    ) -> Result<f64, Trouble> {
        if plan.exterior.is_empty() {
            return Ok(0.0);
        }
        std::mem::swap(&mut follower.forces, &mut follower.before);
        follower.forces.fill(Vec3::zeros());
        follower
            .batches
            .add_forces(model, memory, displacements, &mut follower.forces)?;
        self.at.copy_from_slice(displacements);
        self.right[plan.tree.first_zone_dof()..].fill(0.0);
        let mut put = |node: u32, dof: u32| {
            let force = model.supports[node as usize].free_part(&follower.forces[node as usize]);
            for c in 0..3 {
                self.right[dof as usize + c] = -force[c] as f32;
            }
            force
        };
        let (mut square, mut turned) = (0.0, 0.0);
        for &[node, dof] in &plan.exterior {
            let force = put(node, dof);
            square += force.norm_squared();
            turned += force.dot(&follower.before[node as usize]);
        }
        for &[node, dof] in &plan.ring {
            put(node, dof);
        }
        follower.relax(turned);
        if follower.share < 1.0 {
            let share = follower.share as f32;
            let n = plan.tree.first_zone_dof();
            self.right[..n].iter_mut().for_each(|x| *x *= share);
        }
        let right = &mut self.right;
        substitute(
            &plan.tree,
            Half::Exterior,
            &self.factor,
            right,
            &mut follower.solve,
        );
        Ok(square.sqrt())
    }
}

/// The exterior's prisms, and scratch memory.
#[derive(Debug)]
pub(super) struct Follower {
    pub(super) batches: Batches,
    forces: Vec<Vec3>,
    before: Vec<Vec3>,
    /// Share of the unbalanced forces that is corrected at once.
    share: f64,
    pub(super) solve: SolveScratch<f32>,
}

impl Follower {
    pub(super) fn new(
        model: &Model,
        memory: &Memory,
        pattern: &ColumnPattern,
        plan: &Plan,
        tangent: Tangent,
    ) -> Self {
        Self {
            batches: Batches::new(model, memory, pattern, &|group| !plan.holds(group), tangent),
            forces: vec![Vec3::zeros(); model.n_nodes()],
            before: vec![Vec3::zeros(); model.n_nodes()],
            share: 1.0,
            solve: SolveScratch::new(&plan.tree),
        }
    }

    /// Adapts the share of the unbalanced forces that is corrected. `turned` is the product of the
    /// forces of two steps. If they reverse from step to step, the old stiffness is somewhere less
    /// than half the true one, and a full correction would increase the forces.
    fn relax(&mut self, turned: f64) {
        /// The least share, and its growth factor while forces do not reverse.
        const LEAST: f64 = 0.2;
        const GROWTH: f64 = 1.1;
        self.share = if turned < 0.0 {
            (0.5 * self.share).max(LEAST)
        } else {
            (GROWTH * self.share).min(1.0)
        };
    }
}

/// Memory for factoring exteriors.
#[derive(Debug)]
pub(super) struct Workshop {
    blocks: Vec<Block<f32>>,
    scratch: FactorScratch<f32>,
    pub(super) x: Vec<f32>,
}

impl Workshop {
    pub(super) fn new(model: &Model, pattern: &ColumnPattern, plan: &Plan) -> Self {
        Self {
            blocks: vec![[0.0; 9]; pattern.n_blocks() + 1],
            scratch: FactorScratch::new(&plan.tree, Half::Exterior),
            x: vec![0.0; model.structure.n_dofs()],
        }
    }

    /// Fits it to the exterior of another zone.
    pub(super) fn fit(&mut self, plan: &Plan) {
        self.scratch.fit(&plan.tree, Half::Exterior);
    }
}
