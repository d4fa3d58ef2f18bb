//! The compliance of the body under a few forces: `W = S K⁻¹ Sᵀ = Yᵀ Y` with `Y = L⁻¹ Sᵀ`. `Sᵀ` has
//! one column for each force.
//!
//! Only forward substitution is needed, and only in the fronts between the loaded nodes and the
//! root. `Y` is kept: with it, a solution under other forces needs no further forward substitution.

use std::ops::Range;

use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{BlockStructure, matmul as matmul_triangular};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Accum, MatMut, MatRef, Par};

use super::Number;
use super::factor::Zone;
use super::tree::{Half, Tree};

/// A unit force on a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Push<T> {
    /// The node's column.
    pub column: u32,
    /// Index of the node among the column's nodes that have unknowns.
    pub level: u32,
    /// Direction of the force, a unit vector.
    pub direction: [T; 3],
}

/// Memory for the compliance under at most `most` forces on a zone.
#[derive(Debug)]
pub struct Compliance<T> {
    most: usize,
    /// First row in `Y` of each front of the zone; `usize::MAX` if the front is not visited.
    rows: Vec<usize>,
    n_rows: usize,
    /// Indices of the forces, in the order in which their columns are eliminated.
    sorted: Vec<u32>,
    y: Vec<T>,
    product: Vec<T>,
    /// One vector, with a number for each visited row.
    rows_of_z: Vec<T>,
    w: Vec<T>,
}

impl<T: Number> Compliance<T> {
    /// Memory for at most `most` forces.
    pub fn new(tree: &Tree, most: usize) -> Self {
        let range = tree.range(Half::Zone);
        let fronts = &tree.fronts[range];
        let rows: usize = fronts.iter().map(|f| f.own.len()).sum::<usize>() * tree.width;
        let border = fronts.iter().map(|f| f.border.len()).max().unwrap_or(0) * tree.width;
        Self {
            most,
            rows: vec![usize::MAX; fronts.len()],
            sorted: Vec::with_capacity(most),
            n_rows: 0,
            y: vec![T::default(); rows * most],
            product: vec![T::default(); border * most],
            rows_of_z: vec![T::default(); rows],
            w: vec![T::default(); most * most],
        }
    }

    /// The compliance under forces on the zone: `n × n`, column-major, both triangles, in m/N if
    /// the stiffness is in N/m.
    ///
    /// # Panics
    /// When there are more forces than the memory was made for, or a force is not on the zone.
    pub fn compute(&mut self, tree: &Tree, zone: &Zone<T>, pushes: &[Push<T>], out: &mut [T]) {
        assert!(
            pushes.len() <= self.most,
            "more forces than there is room for"
        );
        let b = tree.width;
        let range = tree.range(Half::Zone);
        let place = |u: u32| tree.place[pushes[u as usize].column as usize];
        self.sorted.clear();
        self.sorted.extend(0..pushes.len() as u32);
        self.sorted.sort_unstable_by_key(|&u| (place(u), u));
        // Rows for the fronts on the path from a loaded node to the root.
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
        self.n_rows = n_rows;
        let n = pushes.len();
        let y = &mut self.y[..n_rows * n];
        y.fill(T::default());
        let row_of = |rows: &[usize], p: u32| {
            let f = tree.front_of[p as usize] as usize;
            rows[f - range.start] + (p - tree.fronts[f].own.start) as usize * b
        };
        for (j, &u) in self.sorted.iter().enumerate() {
            let push = &pushes[u as usize];
            let row = row_of(&self.rows, place(u)) + 3 * push.level as usize;
            y[j * n_rows + row..][..3].copy_from_slice(&push.direction);
        }
        for f in range.clone() {
            let first_row = self.rows[f - range.start];
            if first_row == usize::MAX {
                continue;
            }
            let front = &tree.fronts[f];
            // The columns of a subtree are consecutive in the order, and so are the forces on them.
            let first_place = subtree_start(tree, f, range.start);
            let from = self.sorted.partition_point(|&u| place(u) < first_place);
            let to = self.sorted.partition_point(|&u| place(u) < front.own.end);
            let n_right = to - from;
            let (own, border) = (front.own.len() * b, front.border.len() * b);
            let panel = &zone.panels[front.panel..][..(own + border) * own];
            let panel = MatRef::from_column_major_slice(panel, own + border, own);
            let all = MatMut::from_column_major_slice_mut(&mut *y, n_rows, n);
            let mut here = all.subcols_mut(from, n_right).subrows_mut(first_row, own);
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
                        let into = &mut y[(from + j) * n_rows + row..][..b];
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
                let value = w[i + n * j];
                out[ui as usize + n * uj as usize] = value;
                out[uj as usize + n * ui as usize] = value;
            }
        }
    }

    /// Displacements in the directions of the forces, `Yᵀ z`, for the solution whose forward
    /// substitution is `z`.
    pub fn project(&mut self, tree: &Tree, z: &[T], out: &mut [T]) {
        let (n, n_rows) = (self.sorted.len(), self.n_rows);
        self.each_front(tree, |product, rows, places| {
            product[rows].copy_from_slice(&z[places]);
        });
        let y = MatRef::from_column_major_slice(&self.y[..n_rows * n], n_rows, n);
        let z = MatRef::from_column_major_slice(&self.rows_of_z[..n_rows], n_rows, 1);
        let sums = MatMut::from_column_major_slice_mut(&mut self.w[..n], n, 1);
        matmul(
            sums,
            Accum::Replace,
            y.transpose(),
            z,
            T::nearest(1.0),
            Par::Seq,
        );
        for (&u, sum) in self.sorted.iter().zip(&self.w) {
            out[u as usize] = *sum;
        }
    }

    /// Adds these forces to a right side after its forward substitution: `z ← z + Y f`.
    pub fn add(&mut self, tree: &Tree, forces: &[T], z: &mut [T]) {
        let (n, n_rows) = (self.sorted.len(), self.n_rows);
        for (f, &u) in self.w.iter_mut().zip(&self.sorted) {
            *f = forces[u as usize];
        }
        let y = MatRef::from_column_major_slice(&self.y[..n_rows * n], n_rows, n);
        let f = MatRef::from_column_major_slice(&self.w[..n], n, 1);
        let sums = MatMut::from_column_major_slice_mut(&mut self.rows_of_z[..n_rows], n_rows, 1);
        matmul(sums, Accum::Replace, y, f, T::nearest(1.0), Par::Seq);
        self.each_front(tree, |sums, rows, places| {
            for (z, &sum) in z[places].iter_mut().zip(&sums[rows]) {
                *z += sum;
            }
        });
    }

    /// Calls `of` for every visited front with a vector over the visited rows, the range of the
    /// front in that vector, and its range in vectors ordered by elimination.
    fn each_front(
        &mut self,
        tree: &Tree,
        mut of: impl FnMut(&mut [T], Range<usize>, Range<usize>),
    ) {
        let b = tree.width;
        for (&row, front) in self.rows.iter().zip(&tree.fronts[tree.range(Half::Zone)]) {
            if row != usize::MAX {
                let (first, n) = (front.own.start as usize * b, front.own.len() * b);
                of(&mut self.rows_of_z, row..row + n, first..first + n);
            }
        }
    }
}

/// Place of the first column in the subtree of a front.
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
