//! The numbers of a factor. Every front is assembled and eliminated, and leaves an update for its
//! parent.

#![expect(
    clippy::inline_always,
    reason = "what runs in the machine's vectors must be compiled with their instructions, in their caller"
)]

use std::ops::Range;

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::factor::{
    LltRegularization, cholesky_in_place, cholesky_in_place_scratch,
};
use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Accum, MatMut, Par};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use super::Number;
use super::solve::subtract_symmetric;
use super::tree::{Front, FrontPair, Half, Threads, Tree};
use crate::Singular;
use crate::blocks::Block;

/// In a factor whose diagonal may be raised: the least pivot, as a share of the diagonal's own entry. Smaller
/// ones make the update of their front so large that those of the next are not positive.
const LEAST_PIVOT: f64 = 0.1;
/// Share of their own values by which the entries of a front's diagonal are raised first, and factor on it
/// each time that this was not enough; and the largest.
const RAISED_FIRST: f64 = 0.25;
const RAISED_AGAIN: f64 = 4.0;
const RAISED_MOST: f64 = 1e3;
/// Entries smaller than this share of the largest of their front count as so large.
const LEAST_ENTRY: f64 = 1e-3;

/// Scratch memory for factoring; its contents do not matter between calls.
pub struct FactorScratch<T> {
    threads: Threads,
    updates: Vec<T>,
    /// For the trunk, then for each branch if branches are factored at the same time.
    memory: Vec<MemBuffer>,
    raised: Raised,
}

impl<T> std::fmt::Debug for FactorScratch<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FactorScratch")
            .field("n_updates", &self.updates.len())
            .finish_non_exhaustive()
    }
}

impl<T: Number> FactorScratch<T> {
    /// Scratch memory for one half of a tree.
    pub fn new(tree: &Tree, half: Half) -> Self {
        Self::with(tree, half, Threads::One, Vec::new())
    }

    /// Scratch memory for one half of a tree whose branches are factored at the same time, by the
    /// threads of rayon's pool. The result is the same to the bit.
    pub fn in_parallel(tree: &Tree, half: Half) -> Self {
        Self::with(tree, half, Threads::Several, Vec::new())
    }

    /// Fits it to one half of another tree. Its memory is kept where it is enough.
    pub fn fit(&mut self, tree: &Tree, half: Half) {
        let updates = std::mem::take(&mut self.updates);
        *self = Self::with(tree, half, self.threads, updates);
    }

    fn with(tree: &Tree, half: Half, threads: Threads, mut updates: Vec<T>) -> Self {
        at_least(&mut updates, tree.scratch(half, threads));
        let mut memory = vec![memory_for::<T>(tree, tree.range(half))];
        if threads == Threads::Several {
            let branches = tree.branches[half as usize].iter();
            memory.extend(branches.map(|branch| memory_for::<T>(tree, branch.clone())));
        }
        Self {
            threads,
            updates,
            memory,
            raised: Raised::new(tree, half),
        }
    }
}

/// Makes a vector longer if it is shorter than `n`. What is in it does not matter.
fn at_least<T: Number>(numbers: &mut Vec<T>, n: usize) {
    if numbers.len() < n {
        // Nothing is copied to a new place.
        numbers.clear();
        numbers.resize(n, T::default());
    }
}

fn memory_for<T: Number>(tree: &Tree, fronts: Range<usize>) -> MemBuffer {
    let columns = tree.fronts[fronts].iter().map(|f| f.own.len());
    MemBuffer::new(columns.max().map_or(StackReq::EMPTY, |n| {
        cholesky_in_place_scratch::<T>(n * tree.width, Par::Seq, faer::Spec::default())
    }))
}

/// The factor of the columns outside the zone, and their Schur complement on the ring.
#[derive(Debug, Clone)]
pub struct Exterior<T> {
    pub(super) panels: Vec<T>,
    /// Lower triangle of the Schur complement on the ring, column by column.
    schur: Vec<T>,
}

impl<T: Number> Exterior<T> {
    /// Memory for a tree's exterior. It must be factored before a zone can be factored with it.
    pub fn new(tree: &Tree) -> Self {
        let ring = tree.ring.len() * tree.width;
        Self {
            panels: vec![T::default(); tree.panels[Half::Exterior as usize]],
            schur: vec![T::default(); ring * ring],
        }
    }

    /// Fits it to the exterior of another tree, which must be factored before it is used. Memory is kept
    /// where it is enough.
    pub fn fit(&mut self, tree: &Tree) {
        at_least(&mut self.panels, tree.panels[Half::Exterior as usize]);
        let ring = tree.ring.len() * tree.width;
        self.schur.resize(ring * ring, T::default());
    }

    /// Factors the exterior of the matrix made of `blocks`. The blocks must not contain the zone's
    /// own part: a ring block holds only the exterior's share.
    ///
    /// # Errors
    /// When the matrix is not positive definite; the factor must then not be used.
    pub fn factor(
        &mut self,
        tree: &Tree,
        blocks: &[Block<T>],
        scratch: &mut FactorScratch<T>,
    ) -> Result<(), Singular> {
        self.factor_while(tree, blocks, scratch, &|| true)?;
        Ok(())
    }

    /// As [`Self::factor`], while `goes_on`, which is asked before each front and says no for good, says yes.
    /// Returns whether it did; if not, the factor must not be used.
    ///
    /// # Errors
    /// As [`Self::factor`].
    pub fn factor_while(
        &mut self,
        tree: &Tree,
        blocks: &[Block<T>],
        scratch: &mut FactorScratch<T>,
        goes_on: GoesOn<'_>,
    ) -> Result<bool, Singular> {
        self.schur.fill(T::default());
        let n = tree.ring.len() * tree.width;
        put_pairs(tree, &tree.ring_pairs, blocks, &mut self.schur, n);
        let is_whole = eliminate_half(
            tree,
            Half::Exterior,
            blocks,
            &mut self.panels,
            None,
            false,
            scratch,
            goes_on,
        )?;
        if !is_whole {
            return Ok(false);
        }
        for front in &tree.fronts[tree.range(Half::Exterior)] {
            if front.parent.is_none() {
                let size = front.border.len() * tree.width;
                let at = front.update(scratch.threads);
                let update = &scratch.updates[at..][..size * size];
                add_update(tree.width, &front.to_parent, update, 0, &mut self.schur, n);
            }
        }
        Ok(true)
    }

    /// Subtracts the exterior's answer to displacements of the ring from a right side there. Cost:
    /// quadratic in the size of the ring.
    ///
    /// # Panics
    /// If there are not as many numbers as unknowns on the ring.
    pub fn subtract_response(&self, displacements: &[T], right: &mut [T]) {
        assert!(
            displacements.len() == right.len() && self.schur.len() == right.len().pow(2),
            "one displacement and one force per unknown of the ring"
        );
        subtract_symmetric(&self.schur, displacements, right);
    }
}

/// The factor of the columns of the zone.
#[derive(Debug, Clone)]
pub struct Zone<T> {
    pub(super) panels: Vec<T>,
}

impl<T: Number> Zone<T> {
    /// Memory for a tree's zone.
    pub fn new(tree: &Tree) -> Self {
        Self {
            panels: vec![T::default(); tree.panels[Half::Zone as usize]],
        }
    }

    /// Factors the zone of the matrix made of `blocks`, on top of a factored exterior if the tree
    /// has one.
    ///
    /// # Errors
    /// When the matrix is not positive definite; the factor must then not be used.
    pub fn factor(
        &mut self,
        tree: &Tree,
        blocks: &[Block<T>],
        exterior: Option<&Exterior<T>>,
        scratch: &mut FactorScratch<T>,
    ) -> Result<(), Singular> {
        let schur = exterior.map(|e| &e.schur[..]);
        let panels = &mut self.panels;
        let half = Half::Zone;
        eliminate_half(tree, half, blocks, panels, schur, false, scratch, &|| true)?;
        Ok(())
    }

    /// As [`Self::factor`], but where the matrix is not positive definite, or only just, its diagonal is
    /// raised until it is: only in the fronts where elimination would stop, by a share of its own values.
    /// Returns the number of entries that were raised. Each attempt costs the elimination of a front.
    ///
    /// # Errors
    /// When the matrix is not finite, or would have to be raised by too much; the factor must then not
    /// be used.
    pub fn factor_raised(
        &mut self,
        tree: &Tree,
        blocks: &[Block<T>],
        exterior: Option<&Exterior<T>>,
        scratch: &mut FactorScratch<T>,
    ) -> Result<usize, Singular> {
        let schur = exterior.map(|e| &e.schur[..]);
        let panels = &mut self.panels;
        let half = Half::Zone;
        eliminate_half(tree, half, blocks, panels, schur, true, scratch, &|| true)?;
        Ok(scratch.raised.n)
    }
}

/// The least pivot of a factored half, relative to the entry on the matrix's diagonal that it came
/// from. `diagonal` is that of the whole matrix, in the order of elimination.
pub fn least_pivot<T: Number>(
    tree: &Tree,
    half: Half,
    panels: &impl AsRef<[T]>,
    diagonal: &[T],
) -> f64 {
    let b = tree.width;
    let mut least = f64::INFINITY;
    for front in &tree.fronts[tree.range(half)] {
        let (own, height) = (
            front.own.len() * b,
            (front.own.len() + front.border.len()) * b,
        );
        let panel = &panels.as_ref()[front.panel..][..height * own];
        let diagonal = &diagonal[front.own.start as usize * b..][..own];
        for (i, entry) in diagonal.iter().enumerate() {
            let pivot = panel[i * height + i].wide();
            least = least.min(pivot * pivot / entry.wide());
        }
    }
    least
}

/// Whether to go on.
type GoesOn<'a> = &'a (dyn Fn() -> bool + Sync);

/// Factors all fronts of a half: branches at the same time if the scratch memory allows it, then
/// the trunk. Returns whether it went on to the end.
#[expect(
    clippy::too_many_arguments,
    reason = "a half of a matrix, and how it is factored"
)]
fn eliminate_half<T: Number>(
    tree: &Tree,
    half: Half,
    blocks: &[Block<T>],
    panels: &mut [T],
    schur: Option<&[T]>,
    may_raise: bool,
    scratch: &mut FactorScratch<T>,
    goes_on: GoesOn<'_>,
) -> Result<bool, Singular> {
    let branches = &tree.branches[half as usize];
    let FactorScratch {
        threads,
        updates,
        memory,
        raised,
    } = scratch;
    let threads = *threads;
    raised.n = 0;
    let (trunk_memory, branch_memory) = memory.split_at_mut(1);
    let is_parallel = threads == Threads::Several && branches.len() > 1 && !may_raise;
    if is_parallel {
        let rooms = rooms(tree, branches, panels, updates, branch_memory);
        (rooms.into_par_iter().zip(branches)).try_for_each(|(mut room, branch)| {
            branch
                .clone()
                .take_while(|_| goes_on())
                .try_for_each(|f| eliminate(tree, f, blocks, schur, &mut room))
        })?;
    }
    let mut room = Room {
        threads,
        panels,
        first_panel: 0,
        updates,
        first_update: 0,
        memory: &mut trunk_memory[0],
        raised: may_raise.then_some(raised),
    };
    let mut left = branches.iter().peekable();
    for f in tree.range(half) {
        if !goes_on() {
            return Ok(false);
        }
        left.next_if(|branch| branch.end <= f);
        let is_done = is_parallel && left.peek().is_some_and(|branch| branch.contains(&f));
        if !is_done {
            eliminate(tree, f, blocks, schur, &mut room)?;
        }
    }
    Ok(true)
}

/// Memory in which some fronts are factored.
struct Room<'a, T> {
    threads: Threads,
    panels: &'a mut [T],
    /// Index of the first of these panels' numbers among those of the half.
    first_panel: usize,
    updates: &'a mut [T],
    first_update: usize,
    memory: &'a mut MemBuffer,
    /// What is raised on the diagonal; `None` if nothing may be.
    raised: Option<&'a mut Raised>,
}

/// How the diagonals of fronts are raised.
#[derive(Debug)]
struct Raised {
    /// Share of their own values by which the entries of the present front are.
    share: f64,
    /// Number of entries of all fronts that are raised.
    n: usize,
    /// The diagonal of the front before it is raised.
    diagonal: Vec<f64>,
}

impl Raised {
    /// For a tree's half.
    fn new(tree: &Tree, half: Half) -> Self {
        let widths = tree.fronts[tree.range(half)].iter().map(|f| f.own.len());
        Self {
            share: 0.0,
            n: 0,
            diagonal: Vec::with_capacity(widths.max().unwrap_or(0) * tree.width),
        }
    }

    /// Notes the diagonal of a panel that children have not been added to, and raises it.
    fn raise<T: Number>(&mut self, panel: &mut [T], height: usize) {
        self.diagonal.clear();
        let columns = panel.chunks_exact(height).enumerate();
        let entries = columns.map(|(i, column)| column[i].wide().abs());
        self.diagonal.extend(entries);
        let largest = self.diagonal.iter().copied().fold(0.0, f64::max);
        for (i, entry) in self.diagonal.iter_mut().enumerate() {
            *entry = entry.max(LEAST_ENTRY * largest);
            panel[i * height + i] += T::nearest(self.share * *entry);
        }
    }

    /// Whether all pivots of a factored panel are large enough.
    fn is_firm<T: Number>(&self, panel: &[T], height: usize) -> bool {
        let mut columns = panel.chunks_exact(height).zip(&self.diagonal).enumerate();
        columns.all(|(i, (column, entry))| column[i].wide().powi(2) >= LEAST_PIVOT * entry)
    }

    /// Raises the present front further. Returns false if that is too much.
    fn grow(&mut self) -> bool {
        if self.share == 0.0 {
            self.share = RAISED_FIRST;
            self.n += self.diagonal.len();
        } else {
            self.share *= RAISED_AGAIN;
        }
        self.share <= RAISED_MOST
    }
}

/// Divides memory among branches.
fn rooms<'a, T>(
    tree: &Tree,
    branches: &[Range<usize>],
    mut panels: &'a mut [T],
    mut updates: &'a mut [T],
    memory: &'a mut [MemBuffer],
) -> Vec<Room<'a, T>> {
    let b = tree.width;
    let (mut panel, mut update) = (0, 0);
    (branches.iter().zip(memory))
        .map(|(branch, memory)| {
            let fronts = &tree.fronts[branch.clone()];
            let first_panel = fronts[0].panel;
            let n_panels = (fronts
                .iter()
                .map(|f| f.own.len() * (f.own.len() + f.border.len())))
            .sum::<usize>()
                * b
                * b;
            let end = (fronts
                .iter()
                .map(|f| f.update(Threads::Several) + (f.border.len() * b).pow(2)))
            .fold(update, usize::max);
            let (_, rest) = std::mem::take(&mut panels).split_at_mut(first_panel - panel);
            let (own, rest) = rest.split_at_mut(n_panels);
            panels = rest;
            let (own_updates, rest) = std::mem::take(&mut updates).split_at_mut(end - update);
            updates = rest;
            let room = Room {
                threads: Threads::Several,
                panels: own,
                first_panel,
                updates: own_updates,
                first_update: update,
                memory,
                raised: None,
            };
            panel = first_panel + n_panels;
            update = end;
            room
        })
        .collect()
}

/// Assembles a front, factors its own columns and leaves its update in the scratch memory. The
/// front of the ring begins with the exterior's Schur complement, if there is one.
fn eliminate<T: Number>(
    tree: &Tree,
    f: usize,
    blocks: &[Block<T>],
    schur: Option<&[T]>,
    room: &mut Room<'_, T>,
) -> Result<(), Singular> {
    let front = &tree.fronts[f];
    let b = tree.width;
    let (own, border) = (front.own.len() * b, front.border.len() * b);
    let height = own + border;
    let panel = &mut room.panels[front.panel - room.first_panel..][..height * own];
    let threads = room.threads;
    let update_of = |front: &Front| {
        let at = front.update(threads);
        at.saturating_sub(room.first_update)
    };
    if let Some(raised) = &mut room.raised {
        raised.share = 0.0;
    }
    loop {
        match schur.filter(|_| front.own == tree.ring) {
            // The ring has no border, so its panel is as large as the Schur complement.
            Some(schur) => panel.copy_from_slice(schur),
            None => panel.fill(T::default()),
        }
        put_pairs(tree, &front.pairs, blocks, panel, height);
        if let Some(raised) = &mut room.raised {
            raised.raise(panel, height);
        }
        for child in children(tree, front) {
            let size = child.border.len() * b;
            let update = &room.updates[update_of(child)..][..size * size];
            add_update(b, &child.to_parent, update, 0, panel, height);
        }
        let top = MatMut::from_column_major_slice_mut(panel, height, own).subrows_mut(0, own);
        let result = cholesky_in_place(
            top,
            LltRegularization::default(),
            Par::Seq,
            MemStack::new(room.memory),
            faer::Spec::default(),
        );
        let Some(raised) = &mut room.raised else {
            result.map_err(|_| Singular)?;
            break;
        };
        if result.is_ok() && raised.is_firm(panel, height) {
            break;
        }
        if !raised.grow() {
            return Err(Singular);
        }
    }
    let (top, bottom) =
        MatMut::from_column_major_slice_mut(panel, height, own).split_at_row_mut(own);
    if (0..own).any(|i| !top[(i, i)].wide().is_finite()) {
        return Err(Singular);
    }
    if border > 0 {
        let mut bottom = bottom;
        solve_lower_triangular_in_place(top.rb(), bottom.rb_mut().transpose_mut(), Par::Seq);
        let first = update_of(front);
        let (before, rest) = room.updates.split_at_mut(first);
        let (update, after) = rest.split_at_mut(border * border);
        matmul(
            MatMut::from_column_major_slice_mut(update, border, border),
            BlockStructure::TriangularLower,
            Accum::Replace,
            bottom.rb(),
            BlockStructure::Rectangular,
            bottom.rb().transpose(),
            BlockStructure::Rectangular,
            T::nearest(-1.0),
            Par::Seq,
        );
        for child in children(tree, front) {
            let size = child.border.len() * b;
            let at = update_of(child);
            let from = if at < first {
                &before[at..][..size * size]
            } else {
                &after[at - first - border * border..][..size * size]
            };
            add_update(b, &child.to_parent, from, front.own.len(), update, border);
        }
    }
    Ok(())
}

/// The children that leave an update.
fn children<'a>(tree: &'a Tree, front: &'a Front) -> impl Iterator<Item = &'a Front> {
    let children = front.children.iter().map(|&c| &tree.fronts[c as usize]);
    children.filter(|child| !child.border.is_empty())
}

/// Adds the columns of a child's update from the parent's column `first` on. When the target is a
/// panel, columns beyond its end are left out.
fn add_update<T: Number>(
    b: usize,
    to_parent: &[u32],
    update: &[T],
    first: usize,
    into: &mut [T],
    height: usize,
) {
    pulp::Arch::new().dispatch(AddUpdate {
        b,
        to_parent,
        update,
        first,
        into,
        height,
    });
}

// A struct, not a closure: `FnOnce::call_once` of a closure is not always inlined, and is then not
// compiled for the machine's vector instructions.
struct AddUpdate<'a, T> {
    b: usize,
    to_parent: &'a [u32],
    update: &'a [T],
    first: usize,
    into: &'a mut [T],
    height: usize,
}

impl<T: Number> WithSimd for AddUpdate<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        add_update_wide(
            self.b,
            self.to_parent,
            self.update,
            self.first,
            self.into,
            self.height,
        );
    }
}

#[inline(always)]
fn add_update_wide<T: Number>(
    b: usize,
    to_parent: &[u32],
    update: &[T],
    first: usize,
    into: &mut [T],
    height: usize,
) {
    let size = to_parent.len() * b;
    let width = into.len() / height;
    for (j, &column) in to_parent.iter().enumerate() {
        let Some(column) = (column as usize).checked_sub(first) else {
            continue;
        };
        if column * b >= width {
            break;
        }
        for jj in 0..b {
            let from = &update[(j * b + jj) * size..][..size];
            let into = &mut into[(column * b + jj) * height..][..height];
            // Columns that are consecutive both here and in the parent are added together.
            let mut i = j;
            while i < to_parent.len() {
                let start = to_parent[i] as usize;
                let run = to_parent[i..]
                    .iter()
                    .enumerate()
                    .take_while(|&(k, &row)| row as usize == start + k)
                    .count();
                let row = (start - first) * b;
                // Above the diagonal is what was in the memory before.
                let above = if i == j { jj } else { 0 };
                let from = &from[i * b..][..run * b][above..];
                let into = &mut into[row..][..run * b][above..];
                for (into, &from) in into.iter_mut().zip(from) {
                    *into += from;
                }
                i += run;
            }
        }
    }
}

/// Adds the blocks of some pairs to a front.
fn put_pairs<T: Number>(
    tree: &Tree,
    pairs: &[FrontPair],
    blocks: &[Block<T>],
    into: &mut [T],
    height: usize,
) {
    pulp::Arch::new().dispatch(PutPairs {
        tree,
        pairs,
        blocks,
        into,
        height,
    });
}

struct PutPairs<'a, T> {
    tree: &'a Tree,
    pairs: &'a [FrontPair],
    blocks: &'a [Block<T>],
    into: &'a mut [T],
    height: usize,
}

impl<T: Number> WithSimd for PutPairs<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        put_pairs_wide(self.tree, self.pairs, self.blocks, self.into, self.height);
    }
}

#[inline(always)]
fn put_pairs_wide<T: Number>(
    tree: &Tree,
    pairs: &[FrontPair],
    blocks: &[Block<T>],
    into: &mut [T],
    height: usize,
) {
    let (b, n) = (tree.width, tree.n_levels);
    for pair in pairs {
        let (row, column) = (pair.row as usize * b, pair.column as usize * b);
        let first = pair.blocks as usize;
        if pair.row == pair.column {
            for l in 0..n {
                let at = (column + 3 * l) * height + row + 3 * l;
                add_block(&blocks[first + 2 * l], false, &mut into[at..], height);
                if l + 1 < n {
                    add_block(
                        &blocks[first + 2 * l + 1],
                        false,
                        &mut into[at + 3..],
                        height,
                    );
                }
            }
            continue;
        }
        for l in 0..n {
            for k in l.saturating_sub(1)..(l + 2).min(n) {
                let block = &blocks[first + 3 * l + k + 1 - l];
                let (r, c) = if pair.is_turned { (l, k) } else { (k, l) };
                let at = (column + 3 * c) * height + row + 3 * r;
                add_block(block, pair.is_turned, &mut into[at..], height);
            }
        }
    }
}

#[inline(always)]
fn add_block<T: Number>(block: &Block<T>, is_turned: bool, into: &mut [T], height: usize) {
    for c in 0..3 {
        let into = &mut into[c * height..][..3];
        for (r, into) in into.iter_mut().enumerate() {
            *into += if is_turned {
                block[c + 3 * r]
            } else {
                block[r + 3 * c]
            };
        }
    }
}
