//! Matrices of layered bodies: 3 × 3 blocks between the nodes of one column, or of two that are neighbours.
//!
//! ```text
//! own blocks of a column     (l, l) at first + 2 l,  (l + 1, l) at first + 2 l + 1
//! between columns a > b      row (a, k), column (b, l) at first + 3 l + (k − l + 1),  |k − l| ≤ 1
//! ```
//! Places of blocks that do not exist (k = −1 or n) are kept, so that an index is a formula. They hold nothing.

/// A 3 × 3 block, column by column.
pub type Block<T> = [T; 9];

/// Which columns are neighbours, and where their blocks stand.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColumnPattern {
    n_columns: usize,
    n_levels: usize,
    /// Columns a > b of each pair, sorted by b, then a.
    pairs: Vec<[u32; 2]>,
    /// First pair of each b, and one past the last.
    first_pair: Vec<u32>,
    /// All neighbours of every column.
    neighbours: Vec<u32>,
    first_neighbour: Vec<u32>,
}

impl ColumnPattern {
    /// The pattern of `n_columns` columns of `n_levels` nodes. Edges may come in any order and more than once.
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

    /// Nodes of a column.
    pub fn n_levels(&self) -> usize {
        self.n_levels
    }

    /// Unknowns of a column.
    pub fn width(&self) -> usize {
        3 * self.n_levels
    }

    /// Number of unknowns.
    pub fn n_dofs(&self) -> usize {
        self.width() * self.n_columns
    }

    /// Number of blocks, with the places of those that do not exist.
    pub fn n_blocks(&self) -> usize {
        self.n_levels * (2 * self.n_columns + 3 * self.pairs.len())
    }

    /// Number of pairs of neighbours.
    pub fn n_pairs(&self) -> usize {
        self.pairs.len()
    }

    /// Columns a > b of a pair.
    pub fn pair(&self, pair: usize) -> [u32; 2] {
        self.pairs[pair]
    }

    /// The neighbours of a column, ascending.
    pub fn neighbours(&self, column: usize) -> &[u32] {
        let range =
            self.first_neighbour[column] as usize..self.first_neighbour[column + 1] as usize;
        &self.neighbours[range]
    }

    /// The first of a column's own blocks.
    pub fn own(&self, column: usize) -> usize {
        2 * self.n_levels * column
    }

    /// The first block of a pair.
    pub fn between(&self, pair: usize) -> usize {
        self.n_levels * (2 * self.n_columns + 3 * pair)
    }

    /// The pair of two neighbours a > b.
    pub fn find(&self, a: usize, b: usize) -> Option<usize> {
        let first = self.first_pair[b] as usize;
        let range = first..self.first_pair[b + 1] as usize;
        self.pairs[range]
            .binary_search_by_key(&(a as u32), |p| p[0])
            .ok()
            .map(|i| first + i)
    }
}

/// First index of every key of a sorted sequence of keys below `n`, and one past the last.
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
