//! The zone: its prisms, whose stiffness is computed anew in every step, and its factor.

use palpa_mesh::Vec3;
use palpa_sparse::fronts::{
    Compliance, FactorScratch, FarCompliance, Half, Push, SolveScratch, Zone, back_substitute,
    substitute,
};
use palpa_sparse::{Block, ColumnPattern};

use super::candidate::Candidate;
use super::contact_problem::ContactProblem;
use super::outside::Outside;
use super::plan::{Plan, Trouble};
use super::{MOST_CANDIDATES, MOST_FAR};
use crate::batch::{Batches, Pressure, Tangent};
use crate::model::Model;
use crate::state::Memory;

/// The zone's prisms and factor.
#[derive(Debug)]
pub(super) struct Inside {
    pub(super) batches: Batches,
    blocks: Vec<Block<f32>>,
    factor: Zone<f32>,
    scratch: FactorScratch<f32>,
    pub(super) solve: SolveScratch<f32>,
    compliance: Compliance<f32>,
    far: FarCompliance<f32>,
    pushes: Vec<Push<f32>>,
    w: Vec<f32>,
    moves: Vec<f32>,
}

impl Inside {
    pub(super) fn new(
        model: &Model,
        memory: &Memory,
        pattern: &ColumnPattern,
        plan: &Plan,
    ) -> Self {
        let tree = &plan.tree;
        let most = 3 * MOST_CANDIDATES;
        Self {
            batches: Batches::new(
                model,
                memory,
                pattern,
                &|group| plan.holds(group),
                Tangent::Single,
            ),
            blocks: vec![[0.0; 9]; pattern.n_blocks() + 1],
            factor: Zone::new(tree),
            scratch: FactorScratch::new(tree, Half::Zone),
            solve: SolveScratch::new(tree),
            compliance: Compliance::new(tree, most),
            far: FarCompliance::new(tree, 3 * MOST_FAR),
            pushes: Vec::with_capacity(most),
            w: vec![0.0; most * most],
            moves: vec![0.0; most],
        }
    }

    /// Assembles the zone's stiffness at these displacements.
    pub(super) fn assemble(
        &mut self,
        model: &Model,
        memory: &Memory,
        pattern: &ColumnPattern,
        plan: &Plan,
        displacements: &[Vec3],
        pressure: Pressure<'_>,
    ) -> Result<(), Trouble> {
        self.clear(pattern, plan);
        let blocks = &mut self.blocks;
        self.batches
            .add_stiffness(model, memory, displacements, blocks, pressure)?;
        plan.support(model, pattern, true, &mut self.blocks);
        Ok(())
    }

    /// Mean stiffness of a skin vertex of the zone against its neighbours, N/m.
    pub(super) fn skin_stiffness(
        &self,
        pattern: &ColumnPattern,
        vertices: impl Iterator<Item = u32>,
    ) -> f64 {
        let (mut sum, mut n) = (0.0, 0.0);
        for v in vertices {
            let block = &self.blocks[pattern.own(v as usize)];
            sum += f64::from(block[0] + block[4] + block[8]).abs() / 3.0;
            n += 1.0;
        }
        if n > 0.0 { sum / n } else { 0.0 }
    }

    /// Adds springs of stiffness `by` (N/m) along the normals of supported vertices.
    pub(super) fn add_springs(&mut self, pattern: &ColumnPattern, springs: &[Candidate], by: f64) {
        for spring in springs.iter().filter(|s| s.support > 0.0) {
            let block = &mut self.blocks[pattern.own(spring.vertex as usize)];
            for c in 0..3 {
                for r in 0..3 {
                    block[r + 3 * c] += (by * spring.normal[r] * spring.normal[c]) as f32;
                }
            }
        }
    }

    /// Factors the zone.
    pub(super) fn factor(&mut self, plan: &Plan, outside: &Outside) -> Result<(), Trouble> {
        let exterior = Some(&outside.factor);
        let (blocks, scratch) = (&self.blocks, &mut self.scratch);
        let result = self.factor.factor(&plan.tree, blocks, exterior, scratch);
        result.map_err(|_| Trouble::Singular)
    }

    /// Factors the zone, and raises its diagonal where it is not positive definite. Returns the number
    /// of entries that were raised.
    pub(super) fn factor_raised(
        &mut self,
        plan: &Plan,
        outside: &Outside,
    ) -> Result<usize, Trouble> {
        let exterior = Some(&outside.factor);
        let (blocks, scratch) = (&self.blocks, &mut self.scratch);
        let result = (self.factor).factor_raised(&plan.tree, blocks, exterior, scratch);
        result.map_err(|_| Trouble::Singular)
    }

    /// Clears the blocks of the zone's prisms.
    fn clear(&mut self, pattern: &ColumnPattern, plan: &Plan) {
        let n = pattern.n_levels();
        for &v in &plan.vertices {
            let own = pattern.own(v as usize);
            self.blocks[own..own + 2 * n].fill([0.0; 9]);
            for &w in pattern.neighbours(v as usize) {
                if w < v
                    && plan.is_inside[w as usize]
                    && let Some(pair) = pattern.find(v as usize, w as usize)
                {
                    let first = pattern.between(pair);
                    self.blocks[first..first + 3 * n].fill([0.0; 9]);
                }
            }
        }
    }

    /// Forward substitution of a right side that has been reduced to the zone.
    pub(super) fn substitute(&mut self, plan: &Plan, x: &mut [f32]) {
        substitute(&plan.tree, Half::Zone, &self.factor, x, &mut self.solve);
    }

    /// Displacements of the zone, given the forward substitution.
    pub(super) fn back_substitute(&mut self, plan: &Plan, x: &mut [f32]) {
        back_substitute(&plan.tree, Half::Zone, &self.factor, x, &mut self.solve);
    }

    /// Fills in the compliance of a contact problem.
    pub(super) fn comply(&mut self, plan: &Plan, outside: &Outside, problem: &mut ContactProblem) {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        self.pushes.clear();
        for candidate in &problem.candidates {
            let normal = [0, 1, 2].map(|c| candidate.normal[c] as f32);
            let directions = if problem.has_friction {
                &axes[..]
            } else {
                &[normal][..]
            };
            self.pushes.extend(directions.iter().map(|&direction| Push {
                column: candidate.vertex,
                level: 0,
                direction,
            }));
        }
        let n = self.pushes.len();
        let has_far = problem.candidates.iter().any(|c| c.is_far);
        if has_far {
            self.far.compute(&plan.tree, &outside.factor, &self.pushes);
        }
        self.compliance.compute(
            &plan.tree,
            &self.factor,
            has_far.then_some(&self.far),
            &self.pushes,
            &mut self.w[..n * n],
        );
        for (out, w) in problem.compliance.iter_mut().zip(&self.w[..n * n]) {
            *out = f64::from(*w);
        }
    }

    /// Fills in the displacements of a contact problem. `z` is the forward substitution of the
    /// right side.
    pub(super) fn project(&mut self, plan: &Plan, z: &[f32], problem: &mut ContactProblem) {
        let (n, has_friction) = (self.pushes.len(), problem.has_friction);
        self.compliance.project(&plan.tree, z, &mut self.moves[..n]);
        for (i, candidate) in problem.candidates.iter_mut().enumerate() {
            candidate.displacement = if has_friction {
                Vec3::from_fn(|c, _| f64::from(self.moves[3 * i + c]))
            } else {
                candidate.normal * f64::from(self.moves[i])
            };
        }
    }

    /// Adds the forces found by a contact problem to a right side after forward substitution.
    pub(super) fn push(&mut self, plan: &Plan, problem: &ContactProblem, z: &mut [f32]) {
        let n = self.pushes.len();
        for (force, change) in self.moves[..n].iter_mut().zip(&problem.change) {
            *force = *change as f32;
        }
        self.compliance.add(&plan.tree, &self.moves[..n], z);
    }
}
