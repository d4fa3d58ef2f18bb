//! Forward and back substitution with a factor, for one right side.

#![expect(
    clippy::inline_always,
    reason = "what runs in the machine's vectors must be compiled with their instructions, in their caller"
)]

use std::ops::Range;

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use super::Number;
use super::tree::{Front, Half, Tree};

/// Scratch memory for substitution; its contents do not matter between calls.
#[derive(Debug)]
pub struct SolveScratch<T> {
    /// A front's part of the vector: its own columns, then its border.
    part: Vec<T>,
    /// For each branch of both halves, if branches are computed at the same time.
    branches: [Vec<BranchScratch<T>>; 2],
}

#[derive(Debug)]
struct BranchScratch<T> {
    part: Vec<T>,
    /// The vector on the columns beyond the branch that it touches: the border of its last front.
    beyond: Vec<T>,
}

impl<T: Number> SolveScratch<T> {
    /// Scratch memory for a tree.
    pub fn new(tree: &Tree) -> Self {
        Self {
            part: part_for(tree, &tree.fronts),
            branches: [Vec::new(), Vec::new()],
        }
    }

    /// Scratch memory for a tree whose branches are computed at the same time, by the threads of
    /// rayon's pool, in [`substitute`] and [`back_substitute`]. The result does not depend on the
    /// number of threads.
    pub fn in_parallel(tree: &Tree) -> Self {
        let scratch = |branch: &Range<usize>| {
            let fronts = &tree.fronts[branch.clone()];
            BranchScratch {
                part: part_for(tree, fronts),
                beyond: vec![T::default(); tree.fronts[branch.end - 1].border.len() * tree.width],
            }
        };
        let branches = [0, 1].map(|half: usize| tree.branches[half].iter().map(scratch).collect());
        Self {
            branches,
            ..Self::new(tree)
        }
    }
}

fn part_for<T: Number>(tree: &Tree, fronts: &[Front]) -> Vec<T> {
    let height = |f: &Front| f.own.len() + f.border.len();
    let most = fronts.iter().map(height).max().unwrap_or(0);
    vec![T::default(); most * tree.width]
}

/// Forward substitution through the fronts of a half: `x ← L⁻¹ x` there. It also reduces the right
/// sides of later columns. `x` covers the whole body, ordered by elimination.
pub fn substitute<T: Number>(
    tree: &Tree,
    half: Half,
    panels: &(impl AsRef<[T]> + Sync),
    x: &mut [T],
    scratch: &mut SolveScratch<T>,
) {
    let (panels, range) = (panels.as_ref(), tree.range(half));
    let SolveScratch { part, branches } = scratch;
    let branches = &mut branches[half as usize];
    if branches.is_empty() {
        pulp::Arch::new().dispatch(Pass::<T, true>::whole(tree, range, None, panels, x, part));
        return;
    }
    for branch in &mut *branches {
        branch.beyond.fill(T::default());
    }
    in_branches::<T, true>(tree, half, panels, x, branches);
    let b = tree.width;
    for (branch, scratch) in tree.branches[half as usize].iter().zip(&*branches) {
        let border = &tree.fronts[branch.end - 1].border;
        for (&p, from) in border.iter().zip(scratch.beyond.chunks(b)) {
            for (x, &from) in x[p as usize * b..][..b].iter_mut().zip(from) {
                *x += from;
            }
        }
    }
    let trunk = Some(&tree.is_trunk[range.clone()]);
    pulp::Arch::new().dispatch(Pass::<T, true>::whole(tree, range, trunk, panels, x, part));
}

/// Back substitution through the fronts of a half: `x ← L⁻ᵀ x` there. The solution of the later
/// columns must be in `x` already.
pub fn back_substitute<T: Number>(
    tree: &Tree,
    half: Half,
    panels: &(impl AsRef<[T]> + Sync),
    x: &mut [T],
    scratch: &mut SolveScratch<T>,
) {
    let SolveScratch { part, branches } = scratch;
    let branches = &mut branches[half as usize];
    if branches.is_empty() {
        back_substitute_to(tree, half, None, panels, x, scratch);
        return;
    }
    let (panels, range) = (panels.as_ref(), tree.range(half));
    let trunk = Some(&tree.is_trunk[range.clone()]);
    pulp::Arch::new().dispatch(Pass::<T, false>::whole(tree, range, trunk, panels, x, part));
    let b = tree.width;
    for (branch, scratch) in tree.branches[half as usize].iter().zip(&mut *branches) {
        let border = &tree.fronts[branch.end - 1].border;
        for (&p, into) in border.iter().zip(scratch.beyond.chunks_mut(b)) {
            into.copy_from_slice(&x[p as usize * b..][..b]);
        }
    }
    in_branches::<T, false>(tree, half, panels, x, branches);
}

/// Passes through all branches of a half at the same time.
fn in_branches<T: Number, const FORWARD: bool>(
    tree: &Tree,
    half: Half,
    panels: &[T],
    mut x: &mut [T],
    scratch: &mut [BranchScratch<T>],
) {
    let mut passes = Vec::with_capacity(scratch.len());
    let mut taken = 0;
    for (branch, scratch) in tree.branches[half as usize].iter().zip(scratch) {
        let (first, last) = (&tree.fronts[branch.start], &tree.fronts[branch.end - 1]);
        let columns = first.own.start as usize..last.own.end as usize;
        let (_, rest) = std::mem::take(&mut x).split_at_mut((columns.start - taken) * tree.width);
        let (own, rest) = rest.split_at_mut(columns.len() * tree.width);
        x = rest;
        taken = columns.end;
        passes.push(Pass::<T, FORWARD> {
            width: tree.width,
            fronts: &tree.fronts[branch.clone()],
            wanted: None,
            panels,
            x: own,
            columns,
            beyond_columns: &last.border,
            beyond: &mut scratch.beyond,
            part: &mut scratch.part,
        });
    }
    passes
        .into_par_iter()
        .for_each(|pass| pulp::Arch::new().dispatch(pass));
}

/// Flags for the fronts of a half: true if the solution on `columns` depends on the front.
/// [`back_substitute_to`] needs to visit only these.
pub fn fronts_above(tree: &Tree, half: Half, columns: impl Iterator<Item = u32>) -> Vec<bool> {
    let range = tree.range(half);
    let mut is_above = vec![false; range.len()];
    for column in columns {
        let mut front = Some(tree.front_of[tree.place[column as usize] as usize]);
        while let Some(f) = front.filter(|&f| range.contains(&(f as usize))) {
            let seen = &mut is_above[f as usize - range.start];
            if std::mem::replace(seen, true) {
                break;
            }
            front = tree.fronts[f as usize].parent;
        }
    }
    is_above
}

/// Like [`back_substitute`], but only through the fronts that [`fronts_above`] marks. The result in
/// `x` is valid only there.
pub fn back_substitute_to<T: Number>(
    tree: &Tree,
    half: Half,
    wanted: Option<&[bool]>,
    panels: &impl AsRef<[T]>,
    x: &mut [T],
    scratch: &mut SolveScratch<T>,
) {
    let (panels, range) = (panels.as_ref(), tree.range(half));
    let part = &mut scratch.part;
    pulp::Arch::new().dispatch(Pass::<T, false>::whole(
        tree, range, wanted, panels, x, part,
    ));
}

struct Pass<'a, T, const FORWARD: bool> {
    width: usize,
    fronts: &'a [Front],
    /// Flags for the fronts to visit; all if `None`.
    wanted: Option<&'a [bool]>,
    panels: &'a [T],
    /// The vector on `columns`, given by their places in the order.
    x: &'a mut [T],
    columns: Range<usize>,
    /// Later columns, and the vector there.
    beyond_columns: &'a [u32],
    beyond: &'a mut [T],
    part: &'a mut [T],
}

impl<'a, T, const FORWARD: bool> Pass<'a, T, FORWARD> {
    /// A pass over a vector of the whole body.
    fn whole(
        tree: &'a Tree,
        range: Range<usize>,
        wanted: Option<&'a [bool]>,
        panels: &'a [T],
        x: &'a mut [T],
        part: &'a mut [T],
    ) -> Self {
        Self {
            width: tree.width,
            fronts: &tree.fronts[range],
            wanted,
            panels,
            x,
            columns: 0..tree.n_columns(),
            beyond_columns: &[],
            beyond: &mut [],
            part,
        }
    }

    /// The vector on a column.
    fn at(&mut self, place: u32) -> &mut [T] {
        let b = self.width;
        if (place as usize) < self.columns.end {
            return &mut self.x[(place as usize - self.columns.start) * b..][..b];
        }
        let i = self.beyond_columns.partition_point(|&p| p < place);
        &mut self.beyond[i * b..][..b]
    }
}

impl<T: Number, const FORWARD: bool> WithSimd for Pass<'_, T, FORWARD> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let b = self.width;
        let part = std::mem::take(&mut self.part);
        for i in 0..self.fronts.len() {
            let i = if FORWARD {
                i
            } else {
                self.fronts.len() - 1 - i
            };
            if self.wanted.is_some_and(|wanted| !wanted[i]) {
                continue;
            }
            let front = &self.fronts[i];
            let (own, border) = (front.own.len() * b, front.border.len() * b);
            let height = own + border;
            let panel = &self.panels[front.panel..][..height * own];
            let first = (front.own.start as usize - self.columns.start) * b;
            let part = &mut part[..height];
            part[..own].copy_from_slice(&self.x[first..first + own]);
            for (k, &p) in front.border.iter().enumerate() {
                part[own + k * b..][..b].copy_from_slice(self.at(p));
            }
            if FORWARD {
                forward(simd, panel, own, part);
                for (k, &p) in front.border.iter().enumerate() {
                    self.at(p).copy_from_slice(&part[own + k * b..][..b]);
                }
            } else {
                backward(simd, panel, own, part);
            }
            self.x[first..first + own].copy_from_slice(&part[..own]);
        }
    }
}

/// Matrix columns that are processed together, so that vectors are read and written once for all of
/// them. A column of nodes has three unknowns per node, so the last group may be smaller.
const TOGETHER: usize = 4;

/// `y −= A x` for a symmetric matrix given by its lower triangle, column by column.
pub(super) fn subtract_symmetric<T: Number>(a: &[T], x: &[T], y: &mut [T]) {
    pulp::Arch::new().dispatch(SubtractSymmetric { a, x, y });
}

// A struct, so that it is compiled for the machine's vectors: a closure is not always inlined where
// it is called.
struct SubtractSymmetric<'a, T> {
    a: &'a [T],
    x: &'a [T],
    y: &'a mut [T],
}

impl<T: Number> WithSimd for SubtractSymmetric<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { a, x, y } = self;
        let size = x.len();
        for j in (0..size).step_by(TOGETHER) {
            let n = TOGETHER.min(size - j);
            for p in j..j + n {
                let column = &a[p * size..][..size];
                y[p] -= column[p] * x[p];
                for q in p + 1..j + n {
                    y[q] -= column[q] * x[p];
                    y[p] -= column[q] * x[q];
                }
            }
            // The matrix is larger than the caches near the core: its columns are read once for both
            // products.
            let columns = std::array::from_fn(|k| &a[(j + k.min(n - 1)) * size..][..size][j + n..]);
            let factors = std::array::from_fn(|k| if k < n { x[j + k] } else { T::default() });
            let sums = T::dot_columns(simd, columns, &x[j + n..]);
            T::subtract_columns(simd, columns, factors, &mut y[j + n..]);
            for (y, sum) in y[j..j + n].iter_mut().zip(sums) {
                *y -= sum;
            }
        }
    }
}

#[inline(always)]
fn forward<T: Number, S: Simd>(simd: S, panel: &[T], own: usize, x: &mut [T]) {
    let height = x.len();
    for j in (0..own).step_by(TOGETHER) {
        let n = TOGETHER.min(own - j);
        for a in j..j + n {
            let column = &panel[a * height..][..height];
            x[a] /= column[a];
            for k in a + 1..j + n {
                let product = column[k] * x[a];
                x[k] -= product;
            }
        }
        // If fewer than four columns remain, the last one is repeated with the factor 0.
        let columns = std::array::from_fn(|a| {
            &panel[(j + a.min(n - 1)) * height + j + n..][..height - j - n]
        });
        let factors = std::array::from_fn(|a| if a < n { x[j + a] } else { T::default() });
        T::subtract_columns(simd, columns, factors, &mut x[j + n..]);
    }
}

#[inline(always)]
fn backward<T: Number, S: Simd>(simd: S, panel: &[T], own: usize, x: &mut [T]) {
    let height = x.len();
    for j in (0..own).step_by(TOGETHER).rev() {
        let n = TOGETHER.min(own - j);
        let columns: [&[T]; TOGETHER] =
            std::array::from_fn(|a| &panel[(j + a.min(n - 1)) * height..][..height]);
        let after = T::dot_columns(simd, columns.map(|c| &c[j + n..]), &x[j + n..]);
        for a in (0..n).rev() {
            let mut sum = x[j + a] - after[a];
            for k in a + 1..n {
                sum -= columns[a][j + k] * x[j + k];
            }
            x[j + a] = sum / columns[a][j + a];
        }
    }
}
