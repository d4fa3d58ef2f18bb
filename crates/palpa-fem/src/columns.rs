//! The sparsity that all matrices of a body share: columns of nodes in elimination order, and 3 × 3
//! blocks between nodes of one column, or of two columns under a common group of triangles.
//!
//! ```text
//! blocks of a column v          (l, l) at base + 2 l,  (l + 1, l) at base + 2 l + 1
//! blocks of columns v, later w  row (w, k), column (v, l) at base + 3 l + (k − l + 1),  |k − l| ≤ 1
//! ```
//! Only the lower triangle is kept: the row's column is later in the order.

use palpa_mesh::Surface;
use palpa_sparse::{NodePattern, Pattern, TooLarge, minimum_degree};

use crate::Mat3;
use crate::element::{GroupLayout, N_BLOCKS, N_NODES};
use crate::pairing::Pairing;

/// Two skin triangles that are evaluated together, or a single one, and the places of their blocks.
#[derive(Debug, Clone)]
pub(crate) struct SurfaceGroup {
    /// Skin vertices in their order of elimination; the last is unused in a group of one.
    pub(crate) vertices: [u32; 4],
    /// The skin triangles; a group of one has its triangle twice.
    pub(crate) triangles: [u32; 2],
    pub(crate) shape: GroupLayout,
    /// First block of each pair of local columns a ≥ b, at `a (a + 1)/2 + b`.
    bases: [u32; 10],
}

impl SurfaceGroup {
    pub(crate) fn n_columns(&self) -> usize {
        usize::from(self.shape.n_wedges) + 2
    }

    /// Local nodes of the group.
    pub(crate) fn n_nodes(&self) -> usize {
        2 * self.n_columns()
    }
}

/// The blocks, and their places in the factored matrix.
#[derive(Debug)]
pub(crate) struct Structure {
    pub(crate) groups: Vec<SurfaceGroup>,
    /// Levels with unknowns, from the skin down.
    pub(crate) n_free_levels: usize,
    n_levels: usize,
    /// Place of each column in the elimination order.
    rank: Vec<u32>,
    /// First block of each column.
    own_bases: Vec<u32>,
    /// Nodes (of the body) for the rows and columns of each block.
    rows: Vec<u32>,
    columns: Vec<u32>,
    pattern: Pattern,
    /// Entry of the first row of each column of each block; for a diagonal block, the entry on the
    /// diagonal.
    entries: Vec<[u32; 3]>,
}

impl Structure {
    /// The structure of a body. The deepest level has unknowns or not.
    pub(crate) fn build(
        skin: &Surface,
        pairing: &Pairing,
        n_levels: usize,
        n_free_levels: usize,
    ) -> Result<Self, TooLarge> {
        let n_columns = skin.points.len();
        let cells: Vec<(Vec<u32>, Vec<u32>)> = pairing
            .pairs
            .iter()
            .map(|pair| (pair.corners.to_vec(), pair.triangles.to_vec()))
            .chain(
                pairing
                    .singles
                    .iter()
                    .map(|&t| (skin.triangles[t as usize].to_vec(), vec![t])),
            )
            .collect();
        let edges = cells.iter().flat_map(|(vertices, _)| {
            vertices.iter().enumerate().flat_map(move |(i, &a)| {
                vertices[..i].iter().map(move |&b| (a as usize, b as usize))
            })
        });
        let order = minimum_degree(n_columns, edges.clone())?;
        let mut rank = vec![0_u32; n_columns];
        for (r, &v) in order.iter().enumerate() {
            rank[v] = r as u32;
        }
        // Pairs of columns by rank of the earlier, then of the later.
        let mut pairs: Vec<(u32, u32)> = edges
            .map(|(a, b)| {
                let (a, b) = (rank[a], rank[b]);
                (a.min(b), a.max(b))
            })
            .collect();
        pairs.extend((0..n_columns as u32).map(|r| (r, r)));
        pairs.sort_unstable();
        pairs.dedup();
        let mut structure = Self {
            groups: Vec::new(),
            n_free_levels,
            n_levels,
            rank,
            own_bases: vec![0; n_columns],
            rows: Vec::new(),
            columns: Vec::new(),
            pattern: Pattern::dense(0),
            entries: Vec::new(),
        };
        let mut bases = Vec::with_capacity(pairs.len());
        for &(first, later) in &pairs {
            let base = structure.rows.len() as u32;
            bases.push(base);
            if first == later {
                structure.own_bases[order[first as usize]] = base;
            }
            structure.push_blocks(order[first as usize], order[later as usize]);
        }
        structure.pattern = structure.sparse_pattern(&order, &pairs)?;
        structure.entries = structure.block_entries();
        structure.groups = cells
            .into_iter()
            .map(|(vertices, triangles)| {
                structure.group(skin, vertices, &triangles, &pairs, &bases)
            })
            .collect();
        Ok(structure)
    }

    fn push_blocks(&mut self, earlier: usize, later: usize) {
        let n = self.n_free_levels;
        let node = |v: usize, l: usize| (v * self.n_levels + l) as u32;
        for l in 0..n {
            let levels = if earlier == later {
                vec![Some(l), Some(l + 1).filter(|&k| k < n)]
            } else {
                vec![l.checked_sub(1), Some(l), Some(l + 1).filter(|&k| k < n)]
            };
            for k in levels {
                // A missing block keeps its place, so that the index stays a formula.
                self.rows.push(k.map_or(u32::MAX, |k| node(later, k)));
                self.columns.push(node(earlier, l));
            }
        }
    }

    fn sparse_pattern(&self, order: &[usize], pairs: &[(u32, u32)]) -> Result<Pattern, TooLarge> {
        let n = self.n_free_levels;
        let mut later: Vec<Vec<u32>> = vec![Vec::new(); order.len()];
        for &(first, second) in pairs {
            later[first as usize].push(second);
        }
        let mut nodes: NodePattern = Vec::with_capacity(order.len() * n);
        for (r, &v) in order.iter().enumerate() {
            for l in 0..n {
                let mut neighbours = Vec::new();
                for &s in &later[r] {
                    let w = order[s as usize];
                    let levels = if s as usize == r {
                        l + 1..(l + 2).min(n)
                    } else {
                        l.saturating_sub(1)..(l + 2).min(n)
                    };
                    neighbours.extend(levels.map(|k| w * self.n_levels + k));
                }
                nodes.push((v * self.n_levels + l, neighbours));
            }
        }
        Pattern::sparse(&nodes, self.n_dofs(), |node| (self.dof(node), 3))
    }

    fn block_entries(&self) -> Vec<[u32; 3]> {
        self.rows
            .iter()
            .zip(&self.columns)
            .map(|(&row, &column)| {
                if row == u32::MAX {
                    return [u32::MAX; 3];
                }
                let (row, column) = (self.dof(row as usize), self.dof(column as usize));
                [0, 1, 2].map(|c| {
                    let first = if row == column { row + c } else { row };
                    self.pattern.entry(first, column + c) as u32
                })
            })
            .collect()
    }

    fn group(
        &self,
        skin: &Surface,
        mut vertices: Vec<u32>,
        triangles: &[u32],
        pairs: &[(u32, u32)],
        bases: &[u32],
    ) -> SurfaceGroup {
        vertices.sort_unstable_by_key(|&v| self.rank[v as usize]);
        let local = |v: u32| vertices.iter().position(|&w| w == v).unwrap_or(0) as u8;
        let wedges: Vec<[u8; 3]> = triangles
            .iter()
            .map(|&t| skin.triangles[t as usize].map(local))
            .collect();
        let mut first = [0; 10];
        for a in 0..vertices.len() {
            for b in 0..=a {
                let key = (
                    self.rank[vertices[b] as usize],
                    self.rank[vertices[a] as usize],
                );
                let pair = pairs
                    .binary_search(&key)
                    .expect("columns of a group are a pair");
                first[a * (a + 1) / 2 + b] = bases[pair];
            }
        }
        SurfaceGroup {
            vertices: std::array::from_fn(|i| vertices[i.min(vertices.len() - 1)]),
            triangles: [triangles[0], triangles[triangles.len() - 1]],
            shape: GroupLayout {
                wedges: [wedges[0], wedges[wedges.len() - 1]],
                n_wedges: triangles.len() as u8,
            },
            bases: first,
        }
    }

    /// Number of unknowns, including held ones.
    pub(crate) fn n_dofs(&self) -> usize {
        3 * self.rank.len() * self.n_free_levels
    }

    /// The first unknown of a node; only for nodes that have unknowns.
    pub(crate) fn dof(&self, node: usize) -> usize {
        let (v, l) = (node / self.n_levels, node % self.n_levels);
        3 * (self.rank[v] as usize * self.n_free_levels + l)
    }

    /// Whether a node has unknowns.
    pub(crate) fn is_free_level(&self, node: usize) -> bool {
        node % self.n_levels < self.n_free_levels
    }

    /// Adds a group's stiffness in interval `i`.
    pub(crate) fn scatter(
        &self,
        group: &SurfaceGroup,
        i: usize,
        stiffness: &[Mat3; N_BLOCKS],
        blocks: &mut [Mat3],
    ) {
        // In the last interval of a body on a rigid base the lower nodes have no unknowns.
        let n_levels = if i + 1 < self.n_free_levels { 2 } else { 1 };
        for ca in 0..group.n_columns() {
            for cb in 0..=ca {
                let base = group.bases[ca * (ca + 1) / 2 + cb] as usize;
                for la in 0..n_levels {
                    for lb in 0..n_levels {
                        let (a, b) = (2 * ca + la, 2 * cb + lb);
                        if a < b {
                            continue;
                        }
                        let place = if ca == cb {
                            2 * (i + lb) + la - lb
                        } else {
                            3 * (i + lb) + la + 1 - lb
                        };
                        blocks[base + place] += stiffness[a * (a + 1) / 2 + b];
                    }
                }
            }
        }
        debug_assert!(group.n_nodes() <= N_NODES);
    }

    /// `y += K x` for the whole symmetric matrix; node-major, all nodes of the body.
    pub(crate) fn multiply(
        &self,
        blocks: &[Mat3],
        x: &[palpa_mesh::Vec3],
        y: &mut [palpa_mesh::Vec3],
    ) {
        for ((block, &row), &column) in blocks.iter().zip(&self.rows).zip(&self.columns) {
            if row == u32::MAX {
                continue;
            }
            let (row, column) = (row as usize, column as usize);
            y[row] += block * x[column];
            if row != column {
                y[column] += block.transpose() * x[row];
            }
        }
    }

    pub(crate) fn n_blocks(&self) -> usize {
        self.rows.len()
    }

    /// The diagonal block of a node that has unknowns.
    pub(crate) fn diagonal(&self, node: usize) -> usize {
        let (v, l) = (node / self.n_levels, node % self.n_levels);
        self.own_bases[v] as usize + 2 * l
    }

    pub(crate) fn pattern(&self) -> &Pattern {
        &self.pattern
    }

    /// For every block that exists: its index, row node, column node and the entries of its
    /// columns.
    pub(crate) fn blocks(&self) -> impl Iterator<Item = (usize, usize, usize, [usize; 3])> + '_ {
        self.rows
            .iter()
            .zip(&self.columns)
            .zip(&self.entries)
            .enumerate()
            .filter(|(_, ((row, _), _))| **row != u32::MAX)
            .map(|(i, ((&row, &column), entries))| {
                (
                    i,
                    row as usize,
                    column as usize,
                    entries.map(|e| e as usize),
                )
            })
    }
}
