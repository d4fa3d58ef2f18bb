//! A zone round the tools, whose stiffness is made anew in every step, and the rest of the body, whose stiffness is kept.

use palpa_mesh::Vec3;
use palpa_sparse::fronts::{
    Compliance, Exterior, FactorScratch, Half, Push, SolveScratch, Tree, Zone, back_substitute,
    back_substitute_to, fronts_above, substitute,
};
use palpa_sparse::{Block, ColumnPattern, Singular, TooLarge};
use pulp::{Simd, WithSimd};

use super::MOST_CANDIDATES;
use super::batch::Batches;
use super::contact::ContactProblem;
use crate::assembly::Inverted;
use crate::columns::SurfaceGroup;
use crate::model::Model;
use crate::state::Memory;

/// Stiffness of what holds a supported node, relative to its own.
const SUPPORT: f64 = 1e3;
/// First shift of a zone that is not positive definite, relative to its diagonal, its growth, and how often it may grow.
const FIRST_SHIFT: f32 = 1e-3;
const SHIFT_GROWTH: f32 = 4.0;
const MOST_SHIFTS: usize = 8;

/// Why a step could not be made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Trouble {
    Inverted(Vec3),
    Singular,
}

impl From<Inverted> for Trouble {
    fn from(inverted: Inverted) -> Self {
        Self::Inverted(inverted.at)
    }
}

impl From<Singular> for Trouble {
    fn from(_: Singular) -> Self {
        Self::Singular
    }
}

/// Which columns are in a zone, and in which order all are eliminated.
#[derive(Debug)]
pub(super) struct Plan {
    pub(super) id: u64,
    pub(super) centre: Vec3,
    pub(super) radius: f64,
    pub(super) tree: Tree,
    /// `[n_vertices]`
    pub(super) is_inside: Vec<bool>,
    /// Skin vertices of the zone.
    pub(super) vertices: Vec<u32>,
    /// Nodes with unknowns and the first of these: of the zone, of the ring among them, and of the exterior.
    pub(super) zone: Vec<[u32; 2]>,
    pub(super) ring: Vec<[u32; 2]>,
    pub(super) exterior: Vec<[u32; 2]>,
}

impl Plan {
    /// The zone of all columns whose skin vertex is, at rest, within `radius` of `centre`; all if there is none.
    pub(super) fn new(
        model: &Model,
        pattern: &ColumnPattern,
        id: u64,
        centre: Vec3,
        radius: f64,
    ) -> Result<Self, TooLarge> {
        let points = &model.body.skin.points;
        let mut is_inside: Vec<bool> = points
            .iter()
            .map(|p| (p - centre).norm() <= radius)
            .collect();
        if !is_inside.contains(&true) {
            is_inside.fill(true);
        }
        let places: Vec<[f64; 3]> = points.iter().map(|p| (*p).into()).collect();
        let tree = Tree::zone_last(pattern, &places, &is_inside)?;
        let nodes = |keep: &dyn Fn(usize) -> bool| -> Vec<[u32; 2]> {
            (0..points.len())
                .filter(|&v| keep(v))
                .flat_map(|v| {
                    let first = tree.first_dof(v);
                    (0..model.structure.n_free_levels)
                        .map(move |l| [model.body.node(v, l) as u32, (first + 3 * l) as u32])
                })
                .collect()
        };
        let ring_start = model.structure.n_dofs() - tree.n_ring_columns() * pattern.width();
        let has_ring = tree.n_ring_columns() > 0;
        let zone = nodes(&|v| is_inside[v]);
        let ring = nodes(&|v| has_ring && is_inside[v] && tree.first_dof(v) >= ring_start);
        let exterior = nodes(&|v| !is_inside[v]);
        Ok(Self {
            id,
            centre,
            radius,
            vertices: (0..points.len() as u32)
                .filter(|&v| is_inside[v as usize])
                .collect(),
            zone,
            ring,
            exterior,
            tree,
            is_inside,
        })
    }

    fn holds(&self, group: &SurfaceGroup) -> bool {
        group.vertices[..group.n_columns()]
            .iter()
            .all(|&v| self.is_inside[v as usize])
    }

    /// Adds stiff springs where nodes are supported.
    fn support(
        &self,
        model: &Model,
        pattern: &ColumnPattern,
        inside: bool,
        blocks: &mut [Block<f32>],
    ) {
        for &[node, _] in if inside { &self.zone } else { &self.exterior } {
            let hold = &model.supports[node as usize];
            if hold.n == 0 {
                continue;
            }
            let (v, l) = (
                node as usize / model.body.n_levels,
                node as usize % model.body.n_levels,
            );
            let block = &mut blocks[pattern.own(v) + 2 * l];
            let size = (block[0] + block[4] + block[8]) / 3.0 * SUPPORT as f32;
            for k in 0..usize::from(hold.n) {
                let axis = hold.frame.column(k);
                for c in 0..3 {
                    for r in 0..3 {
                        block[r + 3 * c] += size * (axis[r] * axis[c]) as f32;
                    }
                }
            }
        }
    }
}

/// Springs that hold skin vertices along normals, so that the free body is stable.
pub(super) type Springs<'a> = &'a [super::contact::Candidate];

/// The zone's prisms and factor.
#[derive(Debug)]
pub(super) struct Inside {
    pub(super) batches: Batches,
    blocks: Vec<Block<f32>>,
    factor: Zone<f32>,
    scratch: FactorScratch<f32>,
    solve: SolveScratch<f32>,
    compliance: Compliance<f32>,
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
            batches: Batches::new(model, memory, pattern, &|group| plan.holds(group), true),
            blocks: vec![[0.0; 9]; pattern.n_blocks() + 1],
            factor: Zone::new(tree),
            scratch: FactorScratch::new(tree, Half::Zone),
            solve: SolveScratch::new(tree),
            compliance: Compliance::new(tree, most),
            pushes: Vec::with_capacity(most),
            w: vec![0.0; most * most],
            moves: vec![0.0; most],
        }
    }

    /// Makes the zone's stiffness at these displacements.
    pub(super) fn assemble(
        &mut self,
        model: &Model,
        memory: &Memory,
        pattern: &ColumnPattern,
        plan: &Plan,
        displacements: &[Vec3],
    ) -> Result<(), Trouble> {
        self.clear(pattern, plan);
        self.batches
            .add_stiffness(model, memory, displacements, &mut self.blocks)?;
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

    /// Adds springs at vertices.
    pub(super) fn add_springs(&mut self, pattern: &ColumnPattern, springs: Springs<'_>, by: f64) {
        for spring in springs.iter().filter(|s| s.support > 0.0) {
            let block = &mut self.blocks[pattern.own(spring.vertex as usize)];
            for c in 0..3 {
                for r in 0..3 {
                    block[r + 3 * c] += (by * spring.normal[r] * spring.normal[c]) as f32;
                }
            }
        }
    }

    /// Factors the zone; with a share of the diagonal added to it, until it is positive definite. Returns that share.
    pub(super) fn factor(
        &mut self,
        model: &Model,
        pattern: &ColumnPattern,
        plan: &Plan,
        outside: &Outside,
        may_shift: bool,
    ) -> Result<f32, Trouble> {
        let mut shift = 0.0;
        for attempt in 0..=MOST_SHIFTS {
            let exterior = Some(&outside.factor);
            let result = self
                .factor
                .factor(&plan.tree, &self.blocks, exterior, &mut self.scratch);
            if result.is_ok() {
                return Ok(shift);
            }
            if !may_shift {
                break;
            }
            let next = if attempt == 0 {
                FIRST_SHIFT
            } else {
                shift * SHIFT_GROWTH
            };
            for &[node, _] in &plan.zone {
                let (v, l) = (
                    node as usize / model.body.n_levels,
                    node as usize % model.body.n_levels,
                );
                let block = &mut self.blocks[pattern.own(v) + 2 * l];
                for d in [0, 4, 8] {
                    block[d] = (block[d].abs() / (1.0 + shift)) * (1.0 + next);
                }
            }
            shift = next;
        }
        Err(Trouble::Singular)
    }

    /// Empties the blocks that the zone's prisms are in.
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

    /// Fills a contact problem's compliance.
    pub(super) fn comply(&mut self, plan: &Plan, has_friction: bool, problem: &mut ContactProblem) {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        self.pushes.clear();
        for candidate in &problem.candidates {
            let normal = [0, 1, 2].map(|c| candidate.normal[c] as f32);
            let directions = if has_friction {
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
        self.compliance
            .compute(&plan.tree, &self.factor, &self.pushes, &mut self.w[..n * n]);
        for (out, w) in problem.compliance.iter_mut().zip(&self.w[..n * n]) {
            *out = f64::from(*w);
        }
    }

    /// Fills a contact problem's displacements by the right side whose forward substitution is `z`.
    pub(super) fn project(
        &mut self,
        plan: &Plan,
        z: &[f32],
        has_friction: bool,
        problem: &mut ContactProblem,
    ) {
        let n = self.pushes.len();
        self.compliance.project(&plan.tree, z, &mut self.moves[..n]);
        for (i, candidate) in problem.candidates.iter_mut().enumerate() {
            candidate.displacement = if has_friction {
                Vec3::from_fn(|c, _| f64::from(self.moves[3 * i + c]))
            } else {
                candidate.normal * f64::from(self.moves[i])
            };
        }
    }

    /// Adds the forces that a contact problem has found to a right side that has been substituted forwards.
    pub(super) fn push(&mut self, plan: &Plan, problem: &ContactProblem, z: &mut [f32]) {
        let n = self.pushes.len();
        for (force, change) in self.moves[..n].iter_mut().zip(&problem.change) {
            *force = *change as f32;
        }
        self.compliance.add(&plan.tree, &self.moves[..n], z);
    }
}

/// The rest of the body, linear about a state in the past.
#[derive(Debug, Clone)]
pub(super) struct Outside {
    /// Counts factors.
    pub(super) id: u64,
    /// The zone that it is the exterior of.
    pub(super) plan: u64,
    factor: Exterior<f32>,
    /// The right side that is left of the exterior's own unknowns after elimination, and what it pushes the ring with.
    right: Vec<f32>,
    /// Displacements of all nodes about which it is linear, m.
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

    /// Adds what it pushes the ring with, at these displacements, to a right side. Cost: the square of the ring.
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
            subtract_symmetric(self.factor.schur(), n, moves, ring);
        }
    }

    /// Displacements of the exterior that go with those of the ring: brings `displacements` up to date. Cost: a
    /// substitution through the exterior; of some columns only, through the fronts above them.
    pub(super) fn settle(
        &self,
        model: &Model,
        plan: &Plan,
        only: Option<&[u32]>,
        displacements: &mut [Vec3],
        x: &mut [f32],
        scratch: &mut SolveScratch<f32>,
    ) {
        if plan.exterior.is_empty() {
            return;
        }
        let wanted =
            only.map(|columns| fronts_above(&plan.tree, Half::Exterior, columns.iter().copied()));
        let n = plan.tree.first_zone_dof();
        x[..n].copy_from_slice(&self.right[..n]);
        x[n..].fill(0.0);
        for &[node, dof] in &plan.ring {
            let change = displacements[node as usize] - self.at[node as usize];
            for c in 0..3 {
                x[dof as usize + c] = change[c] as f32;
            }
        }
        let (tree, wanted) = (&plan.tree, wanted.as_deref());
        back_substitute_to(tree, Half::Exterior, wanted, &self.factor, x, scratch);
        let mut put = |node: usize, dof: usize| {
            let change = Vec3::from_fn(|c, _| f64::from(x[dof + c]));
            let change = model.supports[node].free_part(&change);
            displacements[node] = self.at[node] + change;
        };
        match only {
            Some(columns) => columns.iter().for_each(|&v| {
                let first = tree.first_dof(v as usize);
                (0..model.structure.n_free_levels)
                    .for_each(|l| put(model.body.node(v as usize, l), first + 3 * l));
            }),
            None => (plan.exterior.iter()).for_each(|&[n, dof]| put(n as usize, dof as usize)),
        }
    }

    /// Makes the exterior's stiffness and factor at these displacements, and is linear about them.
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
    ) -> Result<(), Trouble> {
        if !plan.exterior.is_empty() {
            workshop.blocks.fill([0.0; 9]);
            follower
                .batches
                .add_stiffness(model, memory, displacements, &mut workshop.blocks)?;
            plan.support(model, pattern, false, &mut workshop.blocks);
            self.factor
                .factor(&plan.tree, &workshop.blocks, &mut workshop.scratch)?;
        }
        // The stiffness is the true one: nothing can have turned.
        follower.forces.fill(Vec3::zeros());
        follower.share = 1.0;
        self.follow(model, memory, plan, follower, displacements)?;
        Ok(())
    }

    /// Is linear about other displacements, with the stiffness that it has. Cost: forces of the exterior's prisms and a
    /// substitution. Returns the exterior's own forces out of balance, N.
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

/// The exterior's prisms and scratch.
#[derive(Debug)]
pub(super) struct Follower {
    pub(super) batches: Batches,
    forces: Vec<Vec3>,
    before: Vec<Vec3>,
    /// Share of its forces out of balance that is taken back at once.
    share: f64,
    pub(super) solve: SolveScratch<f32>,
}

impl Follower {
    pub(super) fn new(
        model: &Model,
        memory: &Memory,
        pattern: &ColumnPattern,
        plan: &Plan,
        with_tangent: bool,
    ) -> Self {
        Self {
            batches: Batches::new(
                model,
                memory,
                pattern,
                &|group| !plan.holds(group),
                with_tangent,
            ),
            forces: vec![Vec3::zeros(); model.n_nodes()],
            before: vec![Vec3::zeros(); model.n_nodes()],
            share: 1.0,
            solve: SolveScratch::new(&plan.tree),
        }
    }

    /// Where forces turn back on themselves from step to step (`turned` is the product of two) the old stiffness is less than
    /// half the true one somewhere, and to take them back whole would raise them.
    fn relax(&mut self, turned: f64) {
        /// The least share, and its growth where they do not turn.
        const LEAST: f64 = 0.2;
        const GROWTH: f64 = 1.1;
        self.share = if turned < 0.0 {
            (0.5 * self.share).max(LEAST)
        } else {
            (GROWTH * self.share).min(1.0)
        };
    }
}

/// Where exteriors are factored.
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
}

/// `y −= A x` of a symmetric matrix whose lower triangle is given, column by column.
fn subtract_symmetric(a: &[f32], n: usize, x: &[f32], y: &mut [f32]) {
    pulp::Arch::new().dispatch(SubtractSymmetric { a, n, x, y });
}

// A struct, so that it is compiled for the machine's vectors: a closure is not always inlined where it is called.
struct SubtractSymmetric<'a> {
    a: &'a [f32],
    n: usize,
    x: &'a [f32],
    y: &'a mut [f32],
}

#[expect(
    clippy::inline_always,
    reason = "what runs in the machine's vectors must be compiled with their instructions, in their caller"
)]
impl WithSimd for SubtractSymmetric<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { a, n, x, y } = self;
        for j in 0..n {
            let column = &a[j * n + j + 1..(j + 1) * n];
            let factor = x[j];
            let (_, below) = y.split_at_mut(j + 1);
            let mut lanes = [0.0_f32; 16];
            let chunks = column.len() / 16 * 16;
            for (k, (a, x)) in column[..chunks]
                .chunks_exact(16)
                .zip(x[j + 1..].chunks_exact(16))
                .enumerate()
            {
                let y = &mut below[16 * k..16 * k + 16];
                for i in 0..16 {
                    y[i] -= a[i] * factor;
                    lanes[i] += a[i] * x[i];
                }
            }
            let mut sum: f32 = lanes.iter().sum();
            for k in chunks..column.len() {
                below[k] -= column[k] * factor;
                sum += column[k] * x[j + 1 + k];
            }
            y[j] -= a[j * n + j] * factor + sum;
        }
    }
}
