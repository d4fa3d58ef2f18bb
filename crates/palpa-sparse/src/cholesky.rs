//! Cholesky factors, dense or supernodal, in memory that is allocated once.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt;
use faer::sparse::linalg::SymbolicSupernodalParams;
use faer::sparse::linalg::cholesky::{simplicial, supernodal};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, MatRef, Par};

use crate::{NodePattern, Singular, TooLarge};

/// Limits for merging supernodes: (number of columns, largest share of zeros). The columns of a
/// body are small dense blocks already. Merging more of them than is usual saves 5–10 % of a step
/// at 300–1,000 nodes.
const RELAXATION: [(usize, f64); 4] = [(8, 1.0), (32, 0.8), (64, 0.3), (usize::MAX, 0.1)];

/// Largest factor, in entries: 8 GiB. A larger factor means that the mesh is finer than intended.
const MOST_ENTRIES: usize = 1 << 30;

/// Positions of the entries of the lower triangle.
#[derive(Debug)]
pub struct Pattern(Kind);

#[derive(Debug)]
enum Kind {
    /// All entries, in columns of length `n`.
    Dense { n: usize },
    /// Only the entries that bars touch, by columns.
    Sparse {
        lower: SymbolicSparseColMat<usize>,
        symbolic: Box<supernodal::SymbolicSupernodalCholesky<usize>>,
    },
}

impl Pattern {
    /// The pattern of a full matrix of order `n`.
    pub fn dense(n: usize) -> Self {
        Self(Kind::Dense { n })
    }

    /// The pattern of nodes in their order of elimination. `unknowns` returns a node's first
    /// unknown and the number of its unknowns.
    ///
    /// # Errors
    /// When the factor would take more than 8 GiB.
    pub fn sparse(
        nodes: &NodePattern,
        n_dofs: usize,
        unknowns: impl Fn(usize) -> (usize, usize),
    ) -> Result<Self, TooLarge> {
        let mut col_ptr = vec![0];
        let mut row_idx = Vec::new();
        for (node, later) in nodes {
            let (start, n) = unknowns(*node);
            for column in start..start + n {
                row_idx.extend(column..start + n);
                for (start, n) in later.iter().map(|&other| unknowns(other)) {
                    row_idx.extend(start..start + n);
                }
                col_ptr.push(row_idx.len());
            }
        }
        let symbolic = analyse(&col_ptr, &row_idx, n_dofs)
            .filter(|symbolic| symbolic.len_val() <= MOST_ENTRIES)
            .ok_or(TooLarge { n_dofs })?;
        Ok(Self(Kind::Sparse {
            lower: SymbolicSparseColMat::new_checked(n_dofs, n_dofs, col_ptr, None, row_idx),
            symbolic: Box::new(symbolic),
        }))
    }

    /// Number of stored entries of the lower triangle (of the whole matrix, if it is dense).
    pub fn n_entries(&self) -> usize {
        match &self.0 {
            Kind::Dense { n } => n * n,
            Kind::Sparse { lower, .. } => lower.row_idx().len(),
        }
    }

    /// Number of stored entries of the factor's lower triangle (of the whole matrix, if it is
    /// dense).
    pub fn n_factor_entries(&self) -> usize {
        match &self.0 {
            Kind::Dense { n } => n * n,
            Kind::Sparse { symbolic, .. } => symbolic.len_val(),
        }
    }

    /// The index of the entry `(i, i)`.
    pub fn diagonal(&self, i: usize) -> usize {
        self.entry(i, i)
    }

    /// The index of an entry of the pattern, `row ≥ column`.
    ///
    /// # Panics
    /// When the entry is not in the pattern.
    pub fn entry(&self, row: usize, column: usize) -> usize {
        match &self.0 {
            Kind::Dense { n } => column * n + row,
            Kind::Sparse { lower, .. } => {
                let entries = lower.col_range(column);
                let rows = &lower.row_idx()[entries.clone()];
                let place = rows
                    .binary_search(&row)
                    .expect("two joined nodes share an entry");
                entries.start + place
            }
        }
    }
}

/// The symbolic factor of a lower triangle whose columns are already in the order of elimination.
fn analyse(
    col_ptr: &[usize],
    row_idx: &[usize],
    n: usize,
) -> Option<supernodal::SymbolicSupernodalCholesky<usize>> {
    // The analysis reads the upper triangle, which is the transpose.
    let mut upper_ptr = vec![0; n + 1];
    for &row in row_idx {
        upper_ptr[row + 1] += 1;
    }
    for i in 0..n {
        upper_ptr[i + 1] += upper_ptr[i];
    }
    let mut next = upper_ptr.clone();
    let mut upper_idx = vec![0; row_idx.len()];
    for column in 0..n {
        for &row in &row_idx[col_ptr[column]..col_ptr[column + 1]] {
            upper_idx[next[row]] = column;
            next[row] += 1;
        }
    }
    let upper = SymbolicSparseColMatRef::new_checked(n, n, &upper_ptr, None, &upper_idx);
    let mut memory = MemBuffer::try_new(StackReq::any_of(&[
        simplicial::prefactorize_symbolic_cholesky_scratch::<usize>(n, upper_idx.len()),
        supernodal::factorize_supernodal_symbolic_cholesky_scratch::<usize>(n),
    ]))
    .ok()?;
    let mut tree = vec![0_isize; n];
    let mut counts = vec![0_usize; n];
    let tree = simplicial::prefactorize_symbolic_cholesky(
        &mut tree,
        &mut counts,
        upper,
        MemStack::new(&mut memory),
    );
    supernodal::factorize_supernodal_symbolic_cholesky(
        upper,
        tree,
        &counts,
        MemStack::new(&mut memory),
        SymbolicSupernodalParams {
            relax: Some(&RELAXATION),
        },
    )
    .ok()
}

/// The numbers of a factor. A dense factor overwrites the matrix.
pub struct Factor {
    lower: Vec<f64>,
    memory: MemBuffer,
}

impl std::fmt::Debug for Factor {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Factor")
            .field("n_entries", &self.lower.len())
            .finish_non_exhaustive()
    }
}

impl Factor {
    /// Allocates memory for the factors of a pattern; it holds no factor yet.
    pub fn new(pattern: &Pattern) -> Self {
        let (n_entries, scratch) = match &pattern.0 {
            Kind::Dense { n } => (
                0,
                StackReq::any_of(&[
                    llt::factor::cholesky_in_place_scratch::<f64>(
                        *n,
                        Par::Seq,
                        faer::Spec::default(),
                    ),
                    llt::solve::solve_in_place_scratch::<f64>(*n, 1, Par::Seq),
                ]),
            ),
            Kind::Sparse { symbolic, .. } => (
                symbolic.len_val(),
                StackReq::any_of(&[
                    supernodal::factorize_supernodal_numeric_llt_scratch::<usize, f64>(
                        symbolic,
                        Par::Seq,
                        faer::Spec::default(),
                    ),
                    symbolic.solve_in_place_scratch::<f64>(1, Par::Seq),
                ]),
            ),
        };
        Self {
            lower: vec![0.0; n_entries],
            memory: MemBuffer::new(scratch),
        }
    }

    /// Factors the matrix in `values`. `scale` is the diagonal of the matrix; pivots are compared
    /// with it.
    ///
    /// # Errors
    /// When a pivot is not positive, or is smaller than `least_pivot` times the diagonal entry that
    /// it came from.
    pub fn refactor(
        &mut self,
        pattern: &Pattern,
        values: &mut [f64],
        scale: &[f64],
        least_pivot: f64,
    ) -> Result<(), Singular> {
        let stack = MemStack::new(&mut self.memory);
        let is_regular = |pivot: f64, i: usize| pivot * pivot > least_pivot * scale[i];
        match &pattern.0 {
            Kind::Dense { n } => {
                let mut matrix = MatMut::from_column_major_slice_mut(values, *n, *n);
                llt::factor::cholesky_in_place(
                    matrix.as_mut(),
                    llt::factor::LltRegularization::default(),
                    Par::Seq,
                    stack,
                    faer::Spec::default(),
                )
                .map_err(|_| Singular)?;
                let diagonal = (0..*n).all(|i| is_regular(matrix[(i, i)], i));
                diagonal.then_some(()).ok_or(Singular)
            }
            Kind::Sparse { lower, symbolic } => {
                supernodal::factorize_supernodal_numeric_llt(
                    &mut self.lower,
                    SparseColMatRef::new(lower.as_ref(), values),
                    llt::factor::LltRegularization::default(),
                    symbolic,
                    Par::Seq,
                    stack,
                    faer::Spec::default(),
                )
                .map_err(|_| Singular)?;
                let factor = supernodal::SupernodalLltRef::new(symbolic, &self.lower);
                let regular = (0..symbolic.n_supernodes()).all(|s| {
                    let node = factor.supernode(s);
                    let block = node.val();
                    (0..block.ncols()).all(|j| is_regular(block[(j, j)], node.start() + j))
                });
                regular.then_some(()).ok_or(Singular)
            }
        }
    }

    /// Solves in place. If the factor is dense, it is in `values`.
    pub fn solve(&mut self, pattern: &Pattern, values: &[f64], right_side: &mut [f64]) {
        let n = right_side.len();
        let stack = MemStack::new(&mut self.memory);
        let right_side = MatMut::from_column_major_slice_mut(right_side, n, 1);
        match &pattern.0 {
            Kind::Dense { n } => llt::solve::solve_in_place(
                MatRef::from_column_major_slice(values, *n, *n),
                right_side,
                Par::Seq,
                stack,
            ),
            Kind::Sparse { symbolic, .. } => {
                supernodal::SupernodalLltRef::new(symbolic, &self.lower).solve_in_place_with_conj(
                    Conj::No,
                    right_side,
                    Par::Seq,
                    stack,
                );
            }
        }
    }
}
