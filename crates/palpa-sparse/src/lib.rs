//! Sparse Cholesky factors of layered bodies, in memory that is allocated once.
//!
//! The order of elimination is that of the body's columns ([`minimum_degree`] of the skin's graph); a [`Pattern`] says
//! where entries stand, and a [`Factor`] is refilled for every matrix of that pattern.

mod cholesky;
mod order;

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
