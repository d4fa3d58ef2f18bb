//! The nodes of a group in the kernel's order, and the places of its blocks in the matrix.

#![expect(
    clippy::inline_always,
    reason = "compiled in its caller with the machine's instructions"
)]

use std::ops::AddAssign;

use palpa_sparse::ColumnPattern;

use super::kernel::{N_BLOCKS, N_NODES};
use crate::columns::SurfaceGroup;
use crate::model::Model;

/// Flag on the place of a block that is to be added transposed.
const TURNED: u32 = 1 << 31;

/// Index of the block at a place.
#[inline(always)]
pub(super) fn index_of(place: u32) -> usize {
    (place & !TURNED) as usize
}

/// Adds a 3 × 3 matrix, given by its entries `(r, c)`, to the block at a place. Entry (r, c) of a
/// block is at `r + 3 c`.
#[inline(always)]
pub(super) fn add_block<E: Copy + AddAssign>(
    place: u32,
    entry: impl Fn(usize, usize) -> E,
    block: &mut [E],
) {
    for r in 0..3 {
        for c in 0..3 {
            let at = if place & TURNED == 0 {
                r + 3 * c
            } else {
                c + 3 * r
            };
            block[at] += entry(r, c);
        }
    }
}

/// Local columns in the order of the kernel: the first wedge's own, the two that are shared, the
/// second's own.
pub(super) fn kernel_columns(group: &SurfaceGroup) -> [usize; 4] {
    let [first, second] = group.shape.wedges.map(|w| w.map(usize::from));
    if group.shape.n_wedges == 1 {
        return [first[0], first[1], first[2], first[0]];
    }
    let shared: Vec<usize> = first.into_iter().filter(|c| second.contains(c)).collect();
    let own = |wedge: [usize; 3], other: [usize; 3]| {
        wedge
            .into_iter()
            .find(|c| !other.contains(c))
            .unwrap_or(wedge[0])
    };
    [own(first, second), shared[0], shared[1], own(second, first)]
}

/// The places of the blocks between the nodes of a group, each marked with [`TURNED`] if it is to
/// be added transposed. `columns` maps the kernel's columns to the group's.
pub(super) fn places(
    model: &Model,
    pattern: &ColumnPattern,
    group: &SurfaceGroup,
    interval: usize,
    columns: [usize; 4],
) -> [u32; N_BLOCKS] {
    let nowhere = pattern.n_blocks() as u32;
    let n_free = model.structure.n_free_levels;
    let mut places = [nowhere; N_BLOCKS];
    for a in 0..N_NODES {
        for b in 0..=a {
            let (ca, cb) = (a / 2, b / 2);
            // A single prism has no fourth column.
            if ca.max(cb) >= group.n_columns() {
                continue;
            }
            let (la, lb) = (interval + a % 2, interval + b % 2);
            if la.max(lb) >= n_free {
                continue;
            }
            let va = group.vertices[columns[ca]] as usize;
            let vb = group.vertices[columns[cb]] as usize;
            places[a * (a + 1) / 2 + b] = if va == vb {
                (pattern.own(va) + 2 * lb + la - lb) as u32
            } else {
                let (row, column, k, l) = if va > vb {
                    (va, vb, la, lb)
                } else {
                    (vb, va, lb, la)
                };
                let Some(pair) = pattern.find(row, column) else {
                    continue;
                };
                let place = (pattern.between(pair) + 3 * l + k + 1 - l) as u32;
                if va > vb { place } else { place | TURNED }
            };
        }
    }
    places
}
