//! What the body answers to forces on a few of its nodes: `W = S K⁻¹ Sᵀ = Yᵀ Y` with `Y = L⁻¹ Sᵀ`.
//!
//! Only the fronts between those nodes and the root are visited, and only forwards.

use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{BlockStructure, matmul as matmul_triangular};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Accum, MatMut, MatRef, Par};

use super::Number;
use super::factor::Zone;
use super::tree::{Half, Tree};

/// A node: its column, and its level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unit {
    /// Which column.
    pub column: u32,
    /// Which of its nodes with unknowns.
    pub level: u32,
}

/// Memory for the compliance of at most so many nodes of a zone.
#[derive(Debug)]
pub struct Compliance<T> {
    most: usize,
    /// First row of each visited front, of the zone's.
    rows: Vec<usize>,
    /// Nodes in the order of their columns' elimination.
    sorted: Vec<u32>,
    y: Vec<T>,
    product: Vec<T>,
    w: Vec<T>,
}

impl<T: Number> Compliance<T> {
    /// Room for `most` nodes.
    pub fn new(tree: &Tree, most: usize) -> Self {
        let range = tree.range(Half::Zone);
        let fronts = &tree.fronts[range];
        let rows: usize = fronts.iter().map(|f| f.own.len()).sum::<usize>() * tree.width;
        let border = fronts.iter().map(|f| f.border.len()).max().unwrap_or(0) * tree.width;
        Self {
            most,
            rows: vec![usize::MAX; fronts.len()],
            sorted: Vec::with_capacity(most),
            y: vec![T::default(); rows * 3 * most],
            product: vec![T::default(); border * 3 * most],
            w: vec![T::default(); 9 * most * most],
        }
    }

    /// The compliance of nodes of the zone: `3 n × 3 n`, column by column, both triangles, m/N for a stiffness in N/m.
    ///
    /// # Panics
    /// When there are more nodes than there is room for, or one is not of the zone.
    pub fn compute(&mut self, tree: &Tree, zone: &Zone<T>, units: &[Unit], out: &mut [T]) {
        assert!(
            units.len() <= self.most,
            "more nodes than there is room for"
        );
        let b = tree.width;
        let range = tree.range(Half::Zone);
        let place = |u: u32| tree.place[units[u as usize].column as usize];
        self.sorted.clear();
        self.sorted.extend(0..units.len() as u32);
        self.sorted.sort_unstable_by_key(|&u| (place(u), u));
        // Rows for the fronts on the way from a node to the root.
        self.rows.fill(usize::MAX);
        for &u in &self.sorted {
            let mut front = Some(tree.front_of[place(u) as usize]);
            while let Some(f) = front {
                let row = &mut self.rows[f as usize - range.start];
                if *row == 0 {
                    break;
                }
                *row = 0;
                front = tree.fronts[f as usize].parent;
            }
        }
        let mut n_rows = 0;
        for (row, front) in self.rows.iter_mut().zip(&tree.fronts[range.clone()]) {
            if *row == 0 {
                *row = n_rows;
                n_rows += front.own.len() * b;
            }
        }
        let n = 3 * units.len();
        let y = &mut self.y[..n_rows * n];
        y.fill(T::default());
        let row_of = |rows: &[usize], p: u32| {
            let f = tree.front_of[p as usize] as usize;
            rows[f - range.start] + (p - tree.fronts[f].own.start) as usize * b
        };
        for (j, &u) in self.sorted.iter().enumerate() {
            let row = row_of(&self.rows, place(u)) + 3 * units[u as usize].level as usize;
            for d in 0..3 {
                y[(3 * j + d) * n_rows + row + d] = T::nearest(1.0);
            }
        }
        for f in range.clone() {
            let first_row = self.rows[f - range.start];
            if first_row == usize::MAX {
                continue;
            }
            let front = &tree.fronts[f];
            // A subtree's columns are consecutive in the order, and so are the nodes under it.
            let first_place = subtree_start(tree, f, range.start);
            let from = self.sorted.partition_point(|&u| place(u) < first_place);
            let to = self.sorted.partition_point(|&u| place(u) < front.own.end);
            let n_right = 3 * (to - from);
            let (own, border) = (front.own.len() * b, front.border.len() * b);
            let panel = &zone.panels[front.panel..][..(own + border) * own];
            let panel = MatRef::from_column_major_slice(panel, own + border, own);
            let all = MatMut::from_column_major_slice_mut(&mut *y, n_rows, n);
            let mut here = all
                .subcols_mut(3 * from, n_right)
                .subrows_mut(first_row, own);
            solve_lower_triangular_in_place(panel.subrows(0, own), here.rb_mut(), Par::Seq);
            if border > 0 {
                let product = &mut self.product[..border * n_right];
                matmul(
                    MatMut::from_column_major_slice_mut(product, border, n_right),
                    Accum::Replace,
                    panel.subrows(own, border),
                    here.rb(),
                    T::nearest(1.0),
                    Par::Seq,
                );
                for (k, &p) in front.border.iter().enumerate() {
                    let row = row_of(&self.rows, p);
                    for j in 0..n_right {
                        let into = &mut y[(3 * from + j) * n_rows + row..][..b];
                        for (y, &s) in into.iter_mut().zip(&product[j * border + k * b..][..b]) {
                            *y -= s;
                        }
                    }
                }
            }
        }
        let y = MatRef::from_column_major_slice(&*y, n_rows, n);
        let w = &mut self.w[..n * n];
        matmul_triangular(
            MatMut::from_column_major_slice_mut(w, n, n),
            BlockStructure::TriangularLower,
            Accum::Replace,
            y.transpose(),
            BlockStructure::Rectangular,
            y,
            BlockStructure::Rectangular,
            T::nearest(1.0),
            Par::Seq,
        );
        for (j, &uj) in self.sorted.iter().enumerate() {
            for (i, &ui) in self.sorted.iter().enumerate().skip(j) {
                for c in 0..3 {
                    for r in 0..3 {
                        let (row, column) = (3 * i + r, 3 * j + c);
                        let value = w[row.max(column) + n * row.min(column)];
                        let (row, column) = (3 * ui as usize + r, 3 * uj as usize + c);
                        out[row + n * column] = value;
                        out[column + n * row] = value;
                    }
                }
            }
        }
    }
}

/// First place of the columns under a front.
fn subtree_start(tree: &Tree, mut f: usize, first: usize) -> u32 {
    while let Some(&child) = tree.fronts[f].children.first() {
        f = child as usize;
    }
    debug_assert!(f >= first);
    tree.fronts[f].own.start
}

impl<T> AsRef<[T]> for Zone<T> {
    fn as_ref(&self) -> &[T] {
        &self.panels
    }
}

impl<T> AsRef<[T]> for super::factor::Exterior<T> {
    fn as_ref(&self) -> &[T] {
        &self.panels
    }
}
