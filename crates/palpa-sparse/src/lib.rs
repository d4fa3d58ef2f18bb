//! Sparse Cholesky factors of layered bodies, in memory that is allocated once.
//!
//! Unknowns are ordered by the body's columns. Two factors stand side by side:
//!
//! - [`Factor`] of any [`Pattern`], for whole bodies in double precision, ordered by [`minimum_degree`];
//! - [`fronts`], on columns alone, of which a part can be made anew while the rest is kept: the real-time factor.

mod blocks;
mod cholesky;
pub mod fronts;
mod order;

pub use blocks::{Block, ColumnPattern};
pub use cholesky::{Factor, Pattern};
pub use order::minimum_degree;

/// For each node that has unknowns, in the order of elimination: the node, and its neighbours later in that order.
pub type NodePattern = Vec<(usize, Vec<usize>)>;

/// The matrix turned out not to be positive definite.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Singular;

/// The factor of so many unknowns would take more than 8 GiB.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TooLarge {
    /// Number of unknowns.
    pub n_dofs: usize,
}
