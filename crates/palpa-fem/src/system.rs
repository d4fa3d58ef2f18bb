//! The linear system of a Newton iteration: blocks assembled, constraints put on, factored and
//! solved.
//!
//! The factor is in single precision, which takes half the time; it preconditions a system whose
//! matrix is in double precision. Only if single precision is not enough, for instance where
//! tissue is all but incompressible, the factor is in double precision.
//!
//! With a [`Region`], the columns near the tools are eliminated last. Contact and stiffness change
//! most there, and only this part of the factor is computed again in every iteration.

use palpa_mesh::{Surface, Vec3};
use palpa_sparse::fronts::{
    Exterior, FactorScratch, Half, Number, SolveScratch, Tree, Zone, back_substitute, least_pivot,
    substitute,
};
use palpa_sparse::{Block, Singular, TooLarge};

use crate::Mat3;
use crate::columns::{Structure, SurfaceGroup, places};

/// A pivot smaller than this, relative to its original diagonal entry, counts as zero: in double
/// precision, and in single precision.
const SINGULAR_PIVOT: f64 = 1e-13;
const SINGLE_PIVOT: f64 = 1e-6;

/// First shift of a matrix that is not positive definite, relative to its diagonal; its growth
/// factor; and the largest number of increases.
const FIRST_SHIFT: f64 = 1e-3;
const SHIFT_GROWTH: f64 = 4.0;
const MOST_SHIFTS: i32 = 9;

/// Directions in which a node is held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hold {
    /// An orthonormal frame, its first `n` columns the directions that are held.
    pub(crate) frame: Mat3,
    /// Number of held directions, 0 (free) to 3.
    pub(crate) n: u8,
}

impl Hold {
    pub(crate) fn free() -> Self {
        Self {
            frame: Mat3::identity(),
            n: 0,
        }
    }

    pub(crate) fn all() -> Self {
        Self {
            frame: Mat3::identity(),
            n: 3,
        }
    }

    /// Holds one more direction. A direction that is already held changes nothing.
    pub(crate) fn and(self, direction: &Vec3) -> Self {
        /// Sine of the smallest angle at which a direction counts as new.
        const NEW: f64 = 1e-6;
        let n = usize::from(self.n);
        if n == 3 {
            return self;
        }
        let mut rest = *direction;
        for i in 0..n {
            let held = self.frame.column(i);
            rest -= held * held.dot(direction);
        }
        if rest.norm() <= NEW * direction.norm() {
            return self;
        }
        let mut axes = [Vec3::zeros(); 3];
        for (i, axis) in axes.iter_mut().enumerate().take(n) {
            *axis = self.frame.column(i).into_owned();
        }
        axes[n] = rest.normalize();
        match n {
            0 => {
                let least = axes[0].iamin();
                let mut other = Vec3::zeros();
                other[least] = 1.0;
                axes[1] = axes[0].cross(&other).normalize();
                axes[2] = axes[0].cross(&axes[1]);
            }
            1 => axes[2] = axes[0].cross(&axes[1]),
            _ => {}
        }
        Self {
            frame: Mat3::from_columns(&axes),
            n: self.n + 1,
        }
    }

    /// The part of a vector in the free directions.
    pub(crate) fn free_part(&self, vector: &Vec3) -> Vec3 {
        match self.n {
            0 => *vector,
            3 => Vec3::zeros(),
            n => {
                let mut free = *vector;
                for i in 0..usize::from(n) {
                    let held = self.frame.column(i);
                    free -= held * held.dot(vector);
                }
                free
            }
        }
    }
}

/// Columns whose part of the factor is computed again in every iteration, and an order of
/// elimination in which they come last.
#[derive(Debug)]
pub(crate) struct Region {
    tree: Tree,
    /// Whether a column is in the region. `[n_vertices]`
    is_inside: Vec<bool>,
    /// Whether a column is outside, or touches a column outside. `[n_vertices]`
    is_outer: Vec<bool>,
    /// Blocks between columns of the ring, to which prisms inside and outside contribute, each with
    /// its row node and column node.
    ring_blocks: Vec<[usize; 3]>,
}

impl Region {
    /// The region of the marked columns.
    pub(crate) fn new(
        structure: &Structure,
        skin: &Surface,
        is_inside: Vec<bool>,
    ) -> Result<Self, TooLarge> {
        let pattern = &structure.pattern;
        let tree = Tree::zone_last(pattern, &places(skin), &is_inside)?;
        let is_outer: Vec<bool> = (0..pattern.n_columns())
            .map(|v| {
                let mut around = pattern.neighbours(v).iter();
                !is_inside[v] || around.any(|&w| !is_inside[w as usize])
            })
            .collect();
        let is_ring = |v: usize| is_inside[v] && is_outer[v];
        let mut ring_blocks = Vec::new();
        structure.for_each_block_between(
            |[v, w]| is_ring(v) && is_ring(w),
            |block, row, column| ring_blocks.push([block, row, column]),
        );
        Ok(Self {
            tree,
            is_inside,
            is_outer,
            ring_blocks,
        })
    }

    /// Whether a column is in the region.
    fn contains(&self, column: usize) -> bool {
        self.is_inside[column]
    }

    /// Whether all columns of a group are in the region.
    pub(crate) fn holds(&self, group: &SurfaceGroup) -> bool {
        group.is_within(&self.is_inside)
    }
}

/// The order of elimination of a system with or without a region.
fn tree_of<'a>(structure: &'a Structure, region: Option<&'a Region>) -> &'a Tree {
    region.map_or(&structure.tree, |region| &region.tree)
}

/// The matrix and its factor, in memory that is reused.
#[derive(Debug)]
pub(crate) struct LinearSystem {
    /// Stiffness between nodes, in the order of [`Structure`].
    pub(crate) blocks: Vec<Mat3>,
    pub(crate) region: Option<Region>,
    /// The part of prisms outside the region in its ring's blocks.
    outer_share: Vec<Mat3>,
    factors: Factors,
    /// The constraints of the factor.
    holds: Vec<Hold>,
    /// Whether there is a factor.
    pub(crate) is_factored: bool,
    /// Shift of the factor, relative to the diagonal.
    pub(crate) shift: f64,
    /// Shift of the factor outside the region.
    outer_shift: f64,
}

/// A factor in one of two precisions.
#[derive(Debug)]
enum Factors {
    Single(Numbers<f32>),
    Double(Numbers<f64>),
}

impl LinearSystem {
    pub(crate) fn new(structure: &Structure, n_nodes: usize, region: Option<Region>) -> Self {
        let tree = tree_of(structure, region.as_ref());
        let n_ring_blocks = region.as_ref().map_or(0, |r| r.ring_blocks.len());
        Self {
            blocks: vec![Mat3::zeros(); structure.n_blocks()],
            outer_share: vec![Mat3::zeros(); n_ring_blocks],
            factors: Factors::Single(Numbers::new(structure, tree, region.is_some())),
            region,
            holds: vec![Hold::free(); n_nodes],
            is_factored: false,
            shift: 0.0,
            outer_shift: 0.0,
        }
    }

    /// Whether the factor alone solves a system, without iterations.
    pub(crate) fn is_exact(&self) -> bool {
        matches!(self.factors, Factors::Double(_)) || self.shift > 0.0
    }

    /// Takes note of the blocks to which only prisms outside the region have been added so far.
    pub(crate) fn note_outer_share(&mut self) {
        if let Some(region) = &self.region {
            for (share, &[block, ..]) in self.outer_share.iter_mut().zip(&region.ring_blocks) {
                *share = self.blocks[block];
            }
        }
    }

    /// Factors the blocks under constraints. If the matrix is not positive definite, it is shifted.
    /// Returns the shift, relative to the diagonal.
    pub(crate) fn refactor(
        &mut self,
        structure: &Structure,
        holds: &[Hold],
    ) -> Result<f64, Singular> {
        self.holds.copy_from_slice(holds);
        self.is_factored = false;
        let mut shift = self.factor_shifted(structure);
        // If a small shift is enough, single precision may be too little; else the matrix is not
        // positive definite.
        let is_small = shift.is_some_and(|shift| shift > 0.0 && shift <= FIRST_SHIFT);
        if is_small && matches!(self.factors, Factors::Single(_)) {
            let tree = tree_of(structure, self.region.as_ref());
            let numbers = Numbers::new(structure, tree, self.region.is_some());
            self.factors = Factors::Double(numbers);
            shift = self.factor_shifted(structure);
        }
        self.shift = shift.ok_or(Singular)?;
        self.is_factored = true;
        Ok(self.shift)
    }

    /// Factors the blocks under constraints, without a shift. Returns whether that works.
    pub(crate) fn factor_unshifted(&mut self, structure: &Structure, holds: &[Hold]) -> bool {
        self.holds.copy_from_slice(holds);
        self.shift = 0.0;
        self.is_factored = self.factor_exterior(structure, 0.0).is_ok()
            && self.factor_zone(structure, 0.0).is_ok();
        self.is_factored
    }

    /// Factors the matrix with the least shift that works, in the region only if that is enough.
    /// After a shifted factor, the search begins a little below its shift. Returns the shift; `None`
    /// if none works.
    fn factor_shifted(&mut self, structure: &Structure) -> Option<f64> {
        let is_outer_good = self.factor_exterior(structure, 0.0).is_ok();
        let least = self.shift / SHIFT_GROWTH;
        let shifts = (0..MOST_SHIFTS).map(|i| FIRST_SHIFT * SHIFT_GROWTH.powi(i));
        let shifts = shifts.filter(|shift| *shift >= 0.99 * least);
        let unshifted = is_outer_good.then_some(0.0);
        (unshifted.into_iter().chain(shifts)).find(|&shift| {
            (is_outer_good || self.factor_exterior(structure, shift).is_ok())
                && self.factor_zone(structure, shift).is_ok()
        })
    }

    /// Factors the region's blocks only, under constraints. Returns false if that is not enough:
    /// there is no region, the constraints have changed outside it, or the matrix would need a
    /// shift.
    pub(crate) fn refactor_region(&mut self, structure: &Structure, holds: &[Hold]) -> bool {
        let Some(region) = self.region.as_ref().filter(|_| self.is_factored) else {
            return false;
        };
        let n_levels = holds.len() / region.is_outer.len();
        let columns = self.holds.chunks(n_levels).zip(holds.chunks(n_levels));
        let is_kept = (columns.zip(&region.is_outer))
            .all(|((before, now), &is_outer)| !is_outer || before == now);
        if !is_kept || self.shift > 0.0 {
            return false;
        }
        self.holds.copy_from_slice(holds);
        self.is_factored = self.factor_zone(structure, 0.0).is_ok();
        self.is_factored
    }

    fn factor_exterior(&mut self, structure: &Structure, shift: f64) -> Result<(), Singular> {
        self.outer_shift = shift;
        let (factors, view) = self.view(structure, shift);
        match factors {
            Factors::Single(numbers) => numbers.factor_exterior(&view),
            Factors::Double(numbers) => numbers.factor_exterior(&view),
        }
    }

    fn factor_zone(&mut self, structure: &Structure, shift: f64) -> Result<(), Singular> {
        let (factors, view) = self.view(structure, shift);
        match factors {
            Factors::Single(numbers) => numbers.factor_zone(&view),
            Factors::Double(numbers) => numbers.factor_zone(&view),
        }
    }

    fn view<'a>(&'a mut self, structure: &'a Structure, shift: f64) -> (&'a mut Factors, View<'a>) {
        let view = View {
            structure,
            region: self.region.as_ref(),
            blocks: &self.blocks,
            outer_share: &self.outer_share,
            holds: &self.holds,
            shift,
            outer_shift: self.outer_shift,
        };
        (&mut self.factors, view)
    }

    /// Solves with the factor: `solution = K⁻¹ right_side`, node-major. A held direction is an
    /// independent spring in the factor. So a force elsewhere gives no displacement there, and the
    /// factor stays usable as an approximation after the direction is released.
    pub(crate) fn solve(
        &mut self,
        structure: &Structure,
        right_side: &[Vec3],
        solution: &mut [Vec3],
    ) {
        let tree = tree_of(structure, self.region.as_ref());
        match &mut self.factors {
            Factors::Single(n) => n.solve(structure, tree, &self.holds, right_side, solution),
            Factors::Double(n) => n.solve(structure, tree, &self.holds, right_side, solution),
        }
    }
}

/// All that a factor depends on.
struct View<'a> {
    structure: &'a Structure,
    region: Option<&'a Region>,
    blocks: &'a [Mat3],
    outer_share: &'a [Mat3],
    holds: &'a [Hold],
    /// Shift of the diagonal, relative to it, and of that of the part outside the region.
    shift: f64,
    outer_shift: f64,
}

impl View<'_> {
    fn tree(&self) -> &Tree {
        tree_of(self.structure, self.region)
    }

    /// A block under the constraints of its nodes. `is_whole` says whether `block` is the whole
    /// block, or a part whose rest is added elsewhere.
    fn constrained<T: Number>(
        &self,
        mut block: Mat3,
        row: usize,
        column: usize,
        is_whole: bool,
    ) -> Block<T> {
        let shift = if is_whole {
            self.shift
        } else {
            self.outer_shift
        };
        let (row_hold, column_hold) = (&self.holds[row], &self.holds[column]);
        let is_diagonal = row == column;
        // Any positive number works for a held direction; one of the size of the matrix keeps
        // pivots similar.
        let size = block.trace().abs() / 3.0;
        if row_hold.n > 0 || column_hold.n > 0 {
            block = row_hold.frame.transpose() * block * column_hold.frame;
            for r in 0..usize::from(row_hold.n) {
                block.row_mut(r).fill(0.0);
            }
            for c in 0..usize::from(column_hold.n) {
                block.column_mut(c).fill(0.0);
            }
            if is_diagonal && is_whole {
                for r in 0..usize::from(row_hold.n) {
                    block[(r, r)] = if size > 0.0 { size } else { 1.0 };
                }
            }
        }
        if is_diagonal {
            for r in 0..3 {
                block[(r, r)] += shift * block[(r, r)].abs();
            }
        }
        std::array::from_fn(|i| T::nearest(block.as_slice()[i]))
    }
}

/// A factor in one precision, and scratch memory.
#[derive(Debug)]
struct Numbers<T> {
    /// The factor outside the region, if there is one.
    exterior: Option<(Exterior<T>, FactorScratch<T>)>,
    zone: Zone<T>,
    scratch: FactorScratch<T>,
    substitution: SolveScratch<T>,
    /// Blocks under constraints.
    blocks: Vec<Block<T>>,
    /// Diagonal of the matrix, in the order of elimination.
    diagonal: Vec<T>,
    x: Vec<T>,
}

impl<T: Number + Send + Sync> Numbers<T> {
    fn new(structure: &Structure, tree: &Tree, has_region: bool) -> Self {
        let exterior = has_region.then(|| {
            (
                Exterior::new(tree),
                FactorScratch::in_parallel(tree, Half::Exterior),
            )
        });
        Self {
            exterior,
            zone: Zone::new(tree),
            scratch: FactorScratch::in_parallel(tree, Half::Zone),
            substitution: SolveScratch::in_parallel(tree),
            blocks: vec![[T::default(); 9]; structure.n_blocks()],
            diagonal: vec![T::default(); structure.n_dofs()],
            x: vec![T::default(); structure.n_dofs()],
        }
    }

    fn factor_exterior(&mut self, view: &View<'_>) -> Result<(), Singular> {
        let Some((exterior, scratch)) = &mut self.exterior else {
            return Ok(());
        };
        let Some(region) = view.region else {
            return Ok(());
        };
        let blocks = &mut self.blocks;
        view.structure.for_each_block_between(
            |[v, w]| !(region.contains(v) && region.contains(w)),
            |block, row, column| {
                blocks[block] = view.constrained(view.blocks[block], row, column, true);
            },
        );
        for (&[block, row, column], share) in region.ring_blocks.iter().zip(view.outer_share) {
            blocks[block] = view.constrained(*share, row, column, false);
        }
        exterior.factor(&region.tree, blocks, scratch)?;
        self.note_diagonal(view, |v| !region.contains(v));
        self.check(view, Half::Exterior)
    }

    fn factor_zone(&mut self, view: &View<'_>) -> Result<(), Singular> {
        let contains = |v: usize| view.region.is_none_or(|r| r.contains(v));
        let blocks = &mut self.blocks;
        view.structure.for_each_block_between(
            |[v, w]| contains(v) && contains(w),
            |block, row, column| {
                blocks[block] = view.constrained(view.blocks[block], row, column, true);
            },
        );
        self.note_diagonal(view, contains);
        let ring = view.region.map_or(&[][..], |r| &r.ring_blocks);
        for (&[block, row, column], share) in ring.iter().zip(view.outer_share) {
            let share: Block<T> = view.constrained(*share, row, column, false);
            for (whole, share) in self.blocks[block].iter_mut().zip(share) {
                *whole -= share;
            }
        }
        let exterior = self.exterior.as_ref().map(|(exterior, _)| exterior);
        self.zone
            .factor(view.tree(), &self.blocks, exterior, &mut self.scratch)?;
        self.check(view, Half::Zone)
    }

    fn note_diagonal(&mut self, view: &View<'_>, keep: impl Fn(usize) -> bool) {
        let (structure, tree) = (view.structure, view.tree());
        for v in (0..structure.pattern.n_columns()).filter(|&v| keep(v)) {
            let (own, first) = (structure.pattern.own(v), tree.first_dof(v));
            for l in 0..structure.n_free_levels {
                for c in 0..3 {
                    self.diagonal[first + 3 * l + c] = self.blocks[own + 2 * l][4 * c];
                }
            }
        }
    }

    /// Refuses a factor with a pivot that is only rounding.
    fn check(&self, view: &View<'_>, half: Half) -> Result<(), Singular> {
        let tree = view.tree();
        let least = match (half, &self.exterior) {
            (Half::Exterior, Some((exterior, _))) => {
                least_pivot(tree, half, exterior, &self.diagonal)
            }
            _ => least_pivot(tree, half, &self.zone, &self.diagonal),
        };
        let limit = if size_of::<T>() == size_of::<f64>() {
            SINGULAR_PIVOT
        } else {
            SINGLE_PIVOT
        };
        (least > limit).then_some(()).ok_or(Singular)
    }

    fn solve(
        &mut self,
        structure: &Structure,
        tree: &Tree,
        holds: &[Hold],
        right_side: &[Vec3],
        solution: &mut [Vec3],
    ) {
        let n_levels = holds.len() / structure.pattern.n_columns();
        let nodes = || {
            (0..structure.pattern.n_columns()).flat_map(|v| {
                let first = tree.first_dof(v);
                (0..structure.n_free_levels).map(move |l| (v * n_levels + l, first + 3 * l))
            })
        };
        let x = &mut self.x;
        for (node, dof) in nodes() {
            let hold = &holds[node];
            let local = if hold.n == 0 {
                right_side[node]
            } else {
                hold.frame.tr_mul(&right_side[node])
            };
            for c in 0..3 {
                x[dof + c] = T::nearest(local[c]);
            }
        }
        let scratch = &mut self.substitution;
        if let Some((exterior, _)) = &self.exterior {
            substitute(tree, Half::Exterior, exterior, x, scratch);
        }
        substitute(tree, Half::Zone, &self.zone, x, scratch);
        back_substitute(tree, Half::Zone, &self.zone, x, scratch);
        if let Some((exterior, _)) = &self.exterior {
            back_substitute(tree, Half::Exterior, exterior, x, scratch);
        }
        solution.fill(Vec3::zeros());
        for (node, dof) in nodes() {
            let local = Vec3::from_fn(|c, _| x[dof + c].wide());
            let hold = &holds[node];
            solution[node] = if hold.n == 0 {
                local
            } else {
                hold.frame * local
            };
        }
    }
}
