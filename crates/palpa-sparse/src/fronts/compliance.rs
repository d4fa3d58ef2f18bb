//! The compliance of the body under a few forces: `W = S K⁻¹ Sᵀ = Yᵀ Y` with `Y = L⁻¹ Sᵀ`. `Sᵀ` has
//! one column for each force.
//!
//! Only forward substitution is needed, and only in the fronts between the loaded nodes and the
//! root. `Y` is kept: with it, a solution under other forces needs no further forward substitution.
//!
//! Forces on the exterior pass through its fronts to the ring and from there to the zone's root.
//! Their part of `Y` on the exterior stays as long as its factor does.

use std::ops::Range;

use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{BlockStructure, matmul as matmul_triangular};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Accum, MatMut, MatRef, Par};

use super::Number;
use super::factor::{Exterior, Zone};
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
    y: Columns<T>,
    /// One vector, with a number for each visited row.
    rows_of_z: Vec<T>,
    w: Vec<T>,
}

/// The part of the compliance under forces on the exterior that does not depend on the zone's
/// factor.
#[derive(Debug)]
pub struct FarCompliance<T> {
    most: usize,
    y: Columns<T>,
    /// What elimination of the exterior leaves of each force on the ring: one column for each, in the
    /// order of `y`.
    ring: Vec<T>,
    /// `Yᵀ Y`, lower triangle.
    w: Vec<T>,
}

/// Columns of `Y` on one half of a tree: one for each force, in the order in which the columns of
/// nodes that the forces are on are eliminated.
#[derive(Debug)]
struct Columns<T> {
    half: Half,
    /// Indices of the forces.
    sorted: Vec<u32>,
    /// First row of each front of the half; `usize::MAX` if the front is not visited.
    rows: Vec<usize>,
    n_rows: usize,
    y: Vec<T>,
    product: Vec<T>,
}

impl<T: Number> Columns<T> {
    fn new(tree: &Tree, half: Half, most: usize) -> Self {
        let fronts = &tree.fronts[tree.range(half)];
        let border = fronts.iter().map(|f| f.border.len()).max().unwrap_or(0) * tree.width;
        Self {
            half,
            sorted: Vec::with_capacity(most),
            rows: vec![usize::MAX; fronts.len()],
            n_rows: 0,
            y: vec![T::default(); Self::most_rows(tree, half) * most],
            product: vec![T::default(); border * most],
        }
    }

    fn most_rows(tree: &Tree, half: Half) -> usize {
        let fronts = &tree.fronts[tree.range(half)];
        fronts.iter().map(|f| f.own.len()).sum::<usize>() * tree.width
    }

    /// Makes room for the forces in `sorted`, of which the first `n_far` are not on this half, and
    /// fills in those that are.
    fn begin(&mut self, tree: &Tree, pushes: &[Push<T>], n_far: usize) {
        let b = tree.width;
        let range = tree.range(self.half);
        let place = |u: u32| tree.place[pushes[u as usize].column as usize];
        self.sorted.sort_unstable_by_key(|&u| (place(u), u));
        // Rows for the fronts on the path from a loaded node to the root.
        self.rows.fill(usize::MAX);
        let root = (n_far > 0).then_some(range.end as u32 - 1);
        let loaded = self.sorted[n_far..].iter();
        let loaded = loaded.map(|&u| tree.front_of[place(u) as usize]);
        for front in loaded.chain(root) {
            let mut front = Some(front);
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
        let n = self.sorted.len();
        self.y[..n_rows * n].fill(T::default());
        for (j, &u) in self.sorted.iter().enumerate().skip(n_far) {
            let push = &pushes[u as usize];
            let row = row_of(tree, &self.rows, range.start, place(u)) + 3 * push.level as usize;
            self.y[j * n_rows + row..][..3].copy_from_slice(&push.direction);
        }
    }

    /// `Y ← L⁻¹ Y` through the visited fronts. `beyond` takes what is left on the ring if that is
    /// beyond the half: one column for each force.
    fn substitute(
        &mut self,
        tree: &Tree,
        panels: &[T],
        pushes: &[Push<T>],
        n_far: usize,
        beyond: &mut [T],
    ) {
        let b = tree.width;
        let range = tree.range(self.half);
        let place = |u: u32| tree.place[pushes[u as usize].column as usize];
        let (n, n_rows, n_ring) = (self.sorted.len(), self.n_rows, tree.ring.len() * b);
        for f in range.clone() {
            let first_row = self.rows[f - range.start];
            if first_row == usize::MAX {
                continue;
            }
            let front = &tree.fronts[f];
            // The columns of a subtree are consecutive in the order, and so are the forces on them.
            // Forces on the other half reach the root.
            let first_place = subtree_start(tree, f, range.start);
            let from = if f + 1 == range.end && n_far > 0 {
                0
            } else {
                self.sorted.partition_point(|&u| place(u) < first_place)
            };
            let to = self.sorted.partition_point(|&u| place(u) < front.own.end);
            let n_right = to - from;
            let (own, border) = (front.own.len() * b, front.border.len() * b);
            let panel = &panels[front.panel..][..(own + border) * own];
            let panel = MatRef::from_column_major_slice(panel, own + border, own);
            let y = &mut self.y[..n_rows * n];
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
                    let is_within = (tree.front_of[p as usize] as usize) < range.end;
                    for j in 0..n_right {
                        let into = if is_within {
                            let row = row_of(tree, &self.rows, range.start, p);
                            &mut y[(from + j) * n_rows + row..][..b]
                        } else {
                            let row = (p - tree.ring.start) as usize * b;
                            &mut beyond[(from + j) * n_ring + row..][..b]
                        };
                        for (y, &s) in into.iter_mut().zip(&product[j * border + k * b..][..b]) {
                            *y -= s;
                        }
                    }
                }
            }
        }
    }

    fn y(&self) -> MatRef<'_, T> {
        let n = self.sorted.len();
        MatRef::from_column_major_slice(&self.y[..self.n_rows * n], self.n_rows, n)
    }

    /// The lower triangle of `Yᵀ Y`.
    fn square(&self, w: &mut [T]) {
        let n = self.sorted.len();
        matmul_triangular(
            MatMut::from_column_major_slice_mut(&mut w[..n * n], n, n),
            BlockStructure::TriangularLower,
            Accum::Replace,
            self.y().transpose(),
            BlockStructure::Rectangular,
            self.y(),
            BlockStructure::Rectangular,
            T::nearest(1.0),
            Par::Seq,
        );
    }
}

impl<T: Number> FarCompliance<T> {
    /// Memory for at most `most` forces.
    pub fn new(tree: &Tree, most: usize) -> Self {
        Self {
            most,
            y: Columns::new(tree, Half::Exterior, most),
            ring: vec![T::default(); tree.ring.len() * tree.width * most],
            w: vec![T::default(); most * most],
        }
    }

    /// Computes it for those of the forces that are on the exterior. Cost: a substitution for all of
    /// them through the fronts above them.
    ///
    /// # Panics
    /// When more forces are on the exterior than the memory was made for.
    pub fn compute(&mut self, tree: &Tree, exterior: &Exterior<T>, pushes: &[Push<T>]) {
        let end = tree.range(Half::Exterior).end;
        self.y.sorted.clear();
        for (u, push) in pushes.iter().enumerate() {
            let front = tree.front_of[tree.place[push.column as usize] as usize];
            if (front as usize) < end {
                assert!(
                    self.y.sorted.len() < self.most,
                    "more forces than there is room for"
                );
                self.y.sorted.push(u as u32);
            }
        }
        if self.y.sorted.is_empty() {
            return;
        }
        self.y.begin(tree, pushes, 0);
        self.ring.fill(T::default());
        let panels = &exterior.panels;
        self.y.substitute(tree, panels, pushes, 0, &mut self.ring);
        self.y.square(&mut self.w);
    }

    /// Number of forces on the exterior.
    pub fn n_forces(&self) -> usize {
        self.y.sorted.len()
    }
}

impl<T: Number> Compliance<T> {
    /// Memory for at most `most` forces.
    pub fn new(tree: &Tree, most: usize) -> Self {
        let rows = Columns::<T>::most_rows(tree, Half::Zone);
        Self {
            most,
            y: Columns::new(tree, Half::Zone, most),
            rows_of_z: vec![T::default(); rows],
            w: vec![T::default(); most * most],
        }
    }

    /// The compliance under forces on the zone, and on the exterior if `far` was computed for the same
    /// forces: `n × n`, column-major, both triangles, in m/N if the stiffness is in N/m.
    ///
    /// # Panics
    /// When there are more forces than the memory was made for, or a force is on the exterior and
    /// not in `far`.
    pub fn compute(
        &mut self,
        tree: &Tree,
        zone: &Zone<T>,
        far: Option<&FarCompliance<T>>,
        pushes: &[Push<T>],
        out: &mut [T],
    ) {
        assert!(
            pushes.len() <= self.most,
            "more forces than there is room for"
        );
        let n = pushes.len();
        let n_far = far.map_or(0, FarCompliance::n_forces);
        self.y.sorted.clear();
        self.y.sorted.extend(0..n as u32);
        self.y.begin(tree, pushes, n_far);
        if let Some(far) = far.filter(|_| n_far > 0) {
            // Columns of the exterior come first in the order, and the ring is the root.
            let (n_rows, n_ring) = (self.y.n_rows, tree.ring.len() * tree.width);
            for (j, ring) in far.ring.chunks_exact(n_ring).take(n_far).enumerate() {
                self.y.y[(j + 1) * n_rows - n_ring..(j + 1) * n_rows].copy_from_slice(ring);
            }
        }
        self.y
            .substitute(tree, &zone.panels, pushes, n_far, &mut []);
        self.y.square(&mut self.w);
        if let Some(far) = far {
            for j in 0..n_far {
                for i in j..n_far {
                    self.w[i + n * j] += far.w[i + n_far * j];
                }
            }
        }
        for (j, &uj) in self.y.sorted.iter().enumerate() {
            for (i, &ui) in self.y.sorted.iter().enumerate().skip(j) {
                let value = self.w[i + n * j];
                out[ui as usize + n * uj as usize] = value;
                out[uj as usize + n * ui as usize] = value;
            }
        }
    }

    /// Displacements in the directions of the forces, `Yᵀ z`, for the solution whose forward
    /// substitution is `z`.
    pub fn project(&mut self, tree: &Tree, z: &[T], out: &mut [T]) {
        let (n, n_rows) = (self.y.sorted.len(), self.y.n_rows);
        self.each_front(tree, |product, rows, places| {
            product[rows].copy_from_slice(&z[places]);
        });
        let z = MatRef::from_column_major_slice(&self.rows_of_z[..n_rows], n_rows, 1);
        let sums = MatMut::from_column_major_slice_mut(&mut self.w[..n], n, 1);
        matmul(
            sums,
            Accum::Replace,
            self.y.y().transpose(),
            z,
            T::nearest(1.0),
            Par::Seq,
        );
        for (&u, sum) in self.y.sorted.iter().zip(&self.w) {
            out[u as usize] = *sum;
        }
    }

    /// Adds these forces to a right side after its forward substitution: `z ← z + Y f`.
    pub fn add(&mut self, tree: &Tree, forces: &[T], z: &mut [T]) {
        let (n, n_rows) = (self.y.sorted.len(), self.y.n_rows);
        for (f, &u) in self.w.iter_mut().zip(&self.y.sorted) {
            *f = forces[u as usize];
        }
        let f = MatRef::from_column_major_slice(&self.w[..n], n, 1);
        let sums = MatMut::from_column_major_slice_mut(&mut self.rows_of_z[..n_rows], n_rows, 1);
        let y = self.y.y();
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
        let fronts = &tree.fronts[tree.range(Half::Zone)];
        for (&row, front) in self.y.rows.iter().zip(fronts) {
            if row != usize::MAX {
                let (first, n) = (front.own.start as usize * b, front.own.len() * b);
                of(&mut self.rows_of_z, row..row + n, first..first + n);
            }
        }
    }
}

/// The first row of a column, given by its place in the order. `first` is the first front of its
/// half.
fn row_of(tree: &Tree, rows: &[usize], first: usize, place: u32) -> usize {
    let f = tree.front_of[place as usize] as usize;
    rows[f - first] + (place - tree.fronts[f].own.start) as usize * tree.width
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
