//! Forward and back substitution with a factor, for one right side.

#![expect(
    clippy::inline_always,
    reason = "what runs in the machine's vectors must be compiled with their instructions, in their caller"
)]

use pulp::{Simd, WithSimd};

use super::Number;
use super::tree::{Half, Tree};

/// Scratch memory for substitution; its contents do not matter between calls.
#[derive(Debug)]
pub struct SolveScratch<T> {
    /// A front's part of the vector: its own columns, then its border.
    part: Vec<T>,
}

impl<T: Number> SolveScratch<T> {
    /// Scratch memory for a tree.
    pub fn new(tree: &Tree) -> Self {
        let height = |f: &super::tree::Front| f.own.len() + f.border.len();
        let most = tree.fronts.iter().map(height).max().unwrap_or(0);
        Self {
            part: vec![T::default(); most * tree.width],
        }
    }
}

/// Forward substitution through the fronts of a half: `x ← L⁻¹ x` there. It also reduces the right
/// sides of later columns. `x` covers the whole body, ordered by elimination.
pub fn substitute<T: Number>(
    tree: &Tree,
    half: Half,
    panels: &impl AsRef<[T]>,
    x: &mut [T],
    scratch: &mut SolveScratch<T>,
) {
    pulp::Arch::new().dispatch(Pass::<T, true> {
        tree,
        half,
        wanted: None,
        panels: panels.as_ref(),
        x,
        part: &mut scratch.part,
    });
}

/// Back substitution through the fronts of a half: `x ← L⁻ᵀ x` there. The solution of the later
/// columns must be in `x` already.
pub fn back_substitute<T: Number>(
    tree: &Tree,
    half: Half,
    panels: &impl AsRef<[T]>,
    x: &mut [T],
    scratch: &mut SolveScratch<T>,
) {
    back_substitute_to(tree, half, None, panels, x, scratch);
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
    pulp::Arch::new().dispatch(Pass::<T, false> {
        tree,
        half,
        wanted,
        panels: panels.as_ref(),
        x,
        part: &mut scratch.part,
    });
}

struct Pass<'a, T, const FORWARD: bool> {
    tree: &'a Tree,
    half: Half,
    /// Flags for the fronts of the half to visit; all if `None`.
    wanted: Option<&'a [bool]>,
    panels: &'a [T],
    x: &'a mut [T],
    part: &'a mut [T],
}

impl<T: Number, const FORWARD: bool> WithSimd for Pass<'_, T, FORWARD> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let b = self.tree.width;
        let fronts = &self.tree.fronts[self.tree.range(self.half)];
        for i in 0..fronts.len() {
            let i = if FORWARD { i } else { fronts.len() - 1 - i };
            if self.wanted.is_some_and(|wanted| !wanted[i]) {
                continue;
            }
            let front = &fronts[i];
            let (own, border) = (front.own.len() * b, front.border.len() * b);
            let height = own + border;
            let panel = &self.panels[front.panel..][..height * own];
            let first = front.own.start as usize * b;
            let part = &mut self.part[..height];
            part[..own].copy_from_slice(&self.x[first..first + own]);
            for (k, &p) in front.border.iter().enumerate() {
                part[own + k * b..][..b].copy_from_slice(&self.x[p as usize * b..][..b]);
            }
            if FORWARD {
                forward(simd, panel, own, part);
                for (k, &p) in front.border.iter().enumerate() {
                    self.x[p as usize * b..][..b].copy_from_slice(&part[own + k * b..][..b]);
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
