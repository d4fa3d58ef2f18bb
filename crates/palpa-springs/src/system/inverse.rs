//! The dense inverse of the whole system, as the method was run in 2009. Kept for comparison of
//! speed and result.
//!
//! `M2` is the `3N × 3N` matrix `M1` with the rows and columns of constrained directions set to
//! zero and their diagonal set to 1 (3.15). It is inverted by Gauss–Jordan elimination with row
//! pivoting, and `U' = −M2⁻¹ F2` (3.19, with the sign of equilibrium). Each inversion costs
//! `O(N³)`, even though many entries are zero.

use palpa_mesh::Vec3;

use palpa_sparse::Singular;

use super::SINGULAR_PIVOT;
use crate::constraints::Freedom;
use crate::network::Bar;

#[derive(Debug)]
pub(crate) struct HistoricalInverse {
    n: usize,
    /// `M2`, row-major. The elimination turns it into the unit matrix.
    matrix: Vec<f64>,
    /// Its inverse, row-major.
    inverse: Vec<f64>,
    force: Vec<f64>,
}

impl HistoricalInverse {
    pub(crate) fn new(n_nodes: usize) -> Self {
        let n = 3 * n_nodes;
        Self {
            n,
            matrix: vec![0.0; n * n],
            inverse: vec![0.0; n * n],
            force: vec![0.0; n],
        }
    }

    /// Forms `M2` from the directions of the bars and inverts it.
    pub(crate) fn update(
        &mut self,
        bars: &[Bar],
        freedoms: &[Freedom],
        directions: &[Vec3],
    ) -> Result<(), Singular> {
        let n = self.n;
        self.matrix.fill(0.0);
        for (bar, c) in bars.iter().zip(directions) {
            let ends = [bar.a as usize, bar.b as usize];
            let local = ends.map(|node| freedoms[node].local(c));
            for (p, q, sign) in [(0, 0, 1.0), (0, 1, -1.0), (1, 0, -1.0), (1, 1, 1.0)] {
                for i in 0..freedoms[ends[p]].n_free {
                    for j in 0..freedoms[ends[q]].n_free {
                        self.matrix[(3 * ends[p] + i) * n + 3 * ends[q] + j] +=
                            sign * bar.stiffness * local[p][i] * local[q][j];
                    }
                }
            }
        }
        for (node, freedom) in freedoms.iter().enumerate() {
            for i in freedom.n_free..3 {
                self.matrix[(3 * node + i) * (n + 1)] = 1.0;
            }
        }
        self.invert()
    }

    fn invert(&mut self) -> Result<(), Singular> {
        let n = self.n;
        let scale = self.matrix.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        self.inverse.fill(0.0);
        for i in 0..n {
            self.inverse[i * (n + 1)] = 1.0;
        }
        for column in 0..n {
            let pivot_row = (column..n)
                .max_by(|&p, &q| {
                    let [p, q] = [p, q].map(|row| self.matrix[row * n + column].abs());
                    p.total_cmp(&q)
                })
                .expect("there is at least one row left");
            let pivot = self.matrix[pivot_row * n + column];
            if pivot.is_nan() || pivot.abs() <= SINGULAR_PIVOT * scale {
                return Err(Singular);
            }
            if pivot_row != column {
                for j in 0..n {
                    self.matrix.swap(pivot_row * n + j, column * n + j);
                    self.inverse.swap(pivot_row * n + j, column * n + j);
                }
            }
            for half in [&mut self.matrix, &mut self.inverse] {
                for entry in &mut half[column * n..(column + 1) * n] {
                    *entry /= pivot;
                }
            }
            for row in (0..n).filter(|&row| row != column) {
                let factor = self.matrix[row * n + column];
                subtract_row(&mut self.matrix, n, row, column, factor);
                subtract_row(&mut self.inverse, n, row, column, factor);
            }
        }
        Ok(())
    }

    /// Writes `U' = −M2⁻¹ F2` to the free directions of `increments`.
    pub(crate) fn solve(&mut self, freedoms: &[Freedom], forces: &[Vec3], increments: &mut [Vec3]) {
        for (node, freedom) in freedoms.iter().enumerate() {
            let local = freedom.local(&forces[node]);
            for i in 0..3 {
                self.force[3 * node + i] = if i < freedom.n_free { local[i] } else { 0.0 };
            }
        }
        for (node, freedom) in freedoms.iter().enumerate() {
            if freedom.n_free == 0 {
                continue;
            }
            let mut local = Vec3::zeros();
            for i in 0..freedom.n_free {
                let row = &self.inverse[(3 * node + i) * self.n..][..self.n];
                local[i] = -row.iter().zip(&self.force).map(|(m, f)| m * f).sum::<f64>();
            }
            increments[node] = freedom.frame * local;
        }
    }
}

/// `row −= factor · pivot row`, the inner loop of the elimination.
fn subtract_row(matrix: &mut [f64], n: usize, row: usize, pivot: usize, factor: f64) {
    let (target, source) = if row < pivot {
        let (head, tail) = matrix.split_at_mut(pivot * n);
        (&mut head[row * n..(row + 1) * n], &tail[..n])
    } else {
        let (head, tail) = matrix.split_at_mut(row * n);
        (&mut tail[..n], &head[pivot * n..(pivot + 1) * n])
    };
    for (t, s) in target.iter_mut().zip(source) {
        *t -= factor * s;
    }
}
