//! Matrices of layered bodies. They consist of 3 × 3 blocks, between two nodes of the same column
//! or of two neighbouring columns.
//!
//! ```text
//! own blocks of a column     (l, l) at first + 2 l,  (l + 1, l) at first + 2 l + 1
//! between columns a > b      row (a, k), column (b, l) at first + 3 l + (k − l + 1),  |k − l| ≤ 1
//! ```
//! Index ranges also include blocks that do not exist (k = −1 or k = n), so that a formula gives
//! every index. Those blocks are not used.

/// A 3 × 3 block, column-major.
pub type Block<T> = [T; 9];

/// Which columns are neighbours, and the indices of their blocks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColumnPattern {
    n_columns: usize,
    n_levels: usize,
    /// Pairs of neighbouring columns `[a, b]` with a > b, sorted by b, then a.
    pairs: Vec<[u32; 2]>,
    /// First pair of each b, and one past the last. `[n_columns + 1]`
    first_pair: Vec<u32>,
    /// Neighbours of every column, one column after the other, ascending.
    neighbours: Vec<u32>,
    first_neighbour: Vec<u32>,
}

impl ColumnPattern {
    /// The pattern of `n_columns` columns of `n_levels` nodes each. The edges join neighbouring
    /// columns; they may come in any order and more than once.
    pub fn new(
        n_columns: usize,
        n_levels: usize,
        edges: impl Iterator<Item = (usize, usize)>,
    ) -> Self {
        let mut pairs: Vec<[u32; 2]> = edges
            .filter(|(a, b)| a != b)
            .map(|(a, b)| [a.max(b) as u32, a.min(b) as u32])
            .collect();
        pairs.sort_unstable_by_key(|&[a, b]| (b, a));
        pairs.dedup();
        let first_pair = starts(n_columns, pairs.iter().map(|p| p[1]));
        let mut both: Vec<[u32; 2]> = pairs.iter().flat_map(|&[a, b]| [[a, b], [b, a]]).collect();
        both.sort_unstable();
        Self {
            n_columns,
            n_levels,
            first_neighbour: starts(n_columns, both.iter().map(|p| p[0])),
            neighbours: both.iter().map(|p| p[1]).collect(),
            pairs,
            first_pair,
        }
    }

    /// Number of columns.
    pub fn n_columns(&self) -> usize {
        self.n_columns
    }

    /// Number of nodes in a column.
    pub fn n_levels(&self) -> usize {
        self.n_levels
    }

    /// Number of unknowns in a column.
    pub fn width(&self) -> usize {
        3 * self.n_levels
    }

    /// Number of unknowns.
    pub fn n_dofs(&self) -> usize {
        self.width() * self.n_columns
    }

    /// Number of blocks, including the unused ones.
    pub fn n_blocks(&self) -> usize {
        self.n_levels * (2 * self.n_columns + 3 * self.pairs.len())
    }

    /// Number of pairs of neighbouring columns.
    pub fn n_pairs(&self) -> usize {
        self.pairs.len()
    }

    /// The two columns a > b of a pair.
    pub fn pair(&self, pair: usize) -> [u32; 2] {
        self.pairs[pair]
    }

    /// The neighbours of a column, ascending.
    pub fn neighbours(&self, column: usize) -> &[u32] {
        let range =
            self.first_neighbour[column] as usize..self.first_neighbour[column + 1] as usize;
        &self.neighbours[range]
    }

    /// Index of the first block within a column.
    pub fn own(&self, column: usize) -> usize {
        2 * self.n_levels * column
    }

    /// Index of the first block of a pair.
    pub fn between(&self, pair: usize) -> usize {
        self.n_levels * (2 * self.n_columns + 3 * pair)
    }

    /// Index of the pair of the columns a > b; `None` if they are not neighbours.
    pub fn find(&self, a: usize, b: usize) -> Option<usize> {
        let first = self.first_pair[b] as usize;
        let range = first..self.first_pair[b + 1] as usize;
        self.pairs[range]
            .binary_search_by_key(&(a as u32), |p| p[0])
            .ok()
            .map(|i| first + i)
    }
}

/// Index of the first element of every key in a sorted sequence of keys below `n`, and one past the
/// last.
fn starts(n: usize, keys: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut starts = vec![0; n + 1];
    for key in keys {
        starts[key as usize + 1] += 1;
    }
    for i in 0..n {
        starts[i + 1] += starts[i];
    }
    starts
}
