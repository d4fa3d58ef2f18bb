//! An order of elimination that reduces the fill.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

use crate::TooLarge;

/// The vertices of a graph, ordered by approximate minimum degree. Edges may come in any order and
/// more than once.
///
/// # Errors
/// When the graph is too large to be ordered.
pub fn minimum_degree(
    n: usize,
    edges: impl Iterator<Item = (usize, usize)>,
) -> Result<Vec<usize>, TooLarge> {
    let mut pairs: Vec<(usize, usize)> = edges
        .filter(|(a, b)| a != b)
        .map(|(a, b)| (a.max(b), a.min(b)))
        .collect();
    pairs.sort_unstable();
    pairs.dedup();
    let mut col_ptr = vec![0; n + 1];
    for &(column, _) in &pairs {
        col_ptr[column + 1] += 1;
    }
    for c in 0..n {
        col_ptr[c + 1] += col_ptr[c];
    }
    let row_idx: Vec<usize> = pairs.iter().map(|&(_, row)| row).collect();
    let graph = SymbolicSparseColMatRef::new_checked(n, n, &col_ptr, None, &row_idx);
    let (mut forward, mut inverse) = (vec![0; n], vec![0; n]);
    let mut memory = MemBuffer::new(amd::order_scratch::<usize>(n, row_idx.len()));
    amd::order(
        &mut forward,
        &mut inverse,
        graph,
        amd::Control::default(),
        MemStack::new(&mut memory),
    )
    .map_err(|_| TooLarge { n_dofs: n })?;
    Ok(forward)
}
