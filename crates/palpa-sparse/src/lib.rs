//! Sparse Cholesky factors of layered bodies, in memory that is allocated once.
//!
//! Unknowns are ordered by the body's columns. There are two kinds of factors:
//!
//! - [`Factor`] of any [`Pattern`]: for whole bodies, in double precision, ordered by
//!   [`minimum_degree`];
//! - [`fronts`]: on columns only. A part of the factor can be computed again while the rest is
//!   kept. This is the real-time factor.

mod blocks;
mod cholesky;
pub mod fronts;
mod order;

pub use blocks::{Block, ColumnPattern};
pub use cholesky::{Factor, Pattern};
pub use order::minimum_degree;

/// Sizes of the data caches of levels 1 to 3, as the library of matrix products sees them, B. On
/// processors without AVX2 and FMA the last bits of factors depend on them.
pub fn cache_sizes() -> [usize; 3] {
    let caches: &[_; 3] = &gemm_common::cache::CACHE_INFO;
    caches.map(|cache| cache.cache_bytes)
}

/// The nodes that have unknowns, in the order of elimination. Each entry is a node and its
/// neighbours that come later in that order.
pub type NodePattern = Vec<(usize, Vec<usize>)>;

/// The matrix is not positive definite.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Singular;

/// The factor would take more than 8 GiB.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TooLarge {
    /// Number of unknowns.
    pub n_dofs: usize,
}
