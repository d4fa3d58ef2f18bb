//! The linear system of a Newton iteration: blocks assembled, constraints put on, factored and
//! solved.

use palpa_mesh::Vec3;
use palpa_sparse::{Factor, Singular};

use crate::Mat3;
use crate::columns::Structure;

/// A pivot smaller than this, relative to its original diagonal entry, counts as zero.
const SINGULAR_PIVOT: f64 = 1e-13;

/// First shift of a matrix that is not positive definite, relative to its diagonal; its growth
/// factor; and the largest number of increases.
const FIRST_SHIFT: f64 = 1e-3;
const SHIFT_GROWTH: f64 = 4.0;
const MOST_SHIFTS: usize = 9;

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

/// The matrix and its factor, in memory that is reused.
#[derive(Debug)]
pub(crate) struct LinearSystem {
    /// Stiffness between nodes, in the order of [`Structure`].
    pub(crate) blocks: Vec<Mat3>,
    values: Vec<f64>,
    scale: Vec<f64>,
    diagonal: Vec<usize>,
    right_side: Vec<f64>,
    factor: Factor,
    /// The constraints of the factor.
    holds: Vec<Hold>,
    /// Whether there is a factor.
    pub(crate) is_factored: bool,
}

impl LinearSystem {
    pub(crate) fn new(structure: &Structure, n_nodes: usize) -> Self {
        let pattern = structure.pattern();
        let n = structure.n_dofs();
        Self {
            blocks: vec![Mat3::zeros(); structure.n_blocks()],
            values: vec![0.0; pattern.n_entries()],
            scale: vec![0.0; n],
            diagonal: (0..n).map(|i| pattern.diagonal(i)).collect(),
            right_side: vec![0.0; n],
            factor: Factor::new(pattern),
            holds: vec![Hold::free(); n_nodes],
            is_factored: false,
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
        self.fill(structure);
        let mut shift = 0.0;
        for attempt in 0..=MOST_SHIFTS {
            let result = self.factor.refactor(
                structure.pattern(),
                &mut self.values,
                &self.scale,
                SINGULAR_PIVOT,
            );
            if result.is_ok() {
                self.is_factored = true;
                return Ok(shift);
            }
            let next = if attempt == 0 {
                FIRST_SHIFT
            } else {
                shift * SHIFT_GROWTH
            };
            for (&entry, scale) in self.diagonal.iter().zip(&self.scale) {
                self.values[entry] += (next - shift) * scale.abs();
            }
            shift = next;
        }
        Err(Singular)
    }

    fn fill(&mut self, structure: &Structure) {
        self.values.fill(0.0);
        for (i, row, column, entries) in structure.blocks() {
            let (row_hold, column_hold) = (&self.holds[row], &self.holds[column]);
            let mut block = self.blocks[i];
            if row_hold.n > 0 || column_hold.n > 0 {
                block = row_hold.frame.transpose() * block * column_hold.frame;
                for r in 0..usize::from(row_hold.n) {
                    block.row_mut(r).fill(0.0);
                }
                for c in 0..usize::from(column_hold.n) {
                    block.column_mut(c).fill(0.0);
                }
            }
            let is_diagonal = row == column;
            if is_diagonal {
                // Any positive number works for a held direction; one of the size of the matrix
                // keeps pivots similar.
                let size = self.blocks[i].trace().abs() / 3.0;
                for r in 0..usize::from(row_hold.n) {
                    block[(r, r)] = if size > 0.0 { size } else { 1.0 };
                }
            }
            for (c, &entry) in entries.iter().enumerate() {
                let first = if is_diagonal { c } else { 0 };
                for r in first..3 {
                    self.values[entry + r - first] = block[(r, c)];
                }
            }
        }
        for (scale, &entry) in self.scale.iter_mut().zip(&self.diagonal) {
            *scale = self.values[entry];
        }
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
        for (node, force) in right_side.iter().enumerate() {
            if !structure.is_free_level(node) {
                continue;
            }
            let hold = &self.holds[node];
            let dof = structure.dof(node);
            let local = if hold.n == 0 {
                *force
            } else {
                hold.frame.tr_mul(force)
            };
            self.right_side[dof..dof + 3].copy_from_slice(local.as_slice());
        }
        self.factor
            .solve(structure.pattern(), &self.values, &mut self.right_side);
        for (node, out) in solution.iter_mut().enumerate() {
            if !structure.is_free_level(node) {
                *out = Vec3::zeros();
                continue;
            }
            let hold = &self.holds[node];
            let dof = structure.dof(node);
            let local = Vec3::from_column_slice(&self.right_side[dof..dof + 3]);
            *out = if hold.n == 0 {
                local
            } else {
                hold.frame * local
            };
        }
    }
}
