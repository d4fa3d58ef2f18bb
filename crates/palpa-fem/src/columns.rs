//! The sparsity that all matrices of a body share: 3 × 3 blocks between nodes of one column, or of
//! two columns under a common group of triangles, in the order of [`ColumnPattern`].

use palpa_mesh::{Surface, Vec3};
use palpa_sparse::fronts::Tree;
use palpa_sparse::{ColumnPattern, TooLarge};

use crate::Mat3;
use crate::element::{GroupLayout, N_BLOCKS, N_NODES};
use crate::pairing::Pairing;

/// Two skin triangles that are evaluated together, or a single one, and the places of their blocks.
#[derive(Debug, Clone)]
pub(crate) struct SurfaceGroup {
    /// Skin vertices, ascending; the last is unused in a group of one.
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

    /// Whether all of its columns are among the marked ones.
    pub(crate) fn is_within(&self, is_inside: &[bool]) -> bool {
        let mut columns = self.vertices[..self.n_columns()].iter();
        columns.all(|&v| is_inside[v as usize])
    }

    /// Local nodes of the group.
    pub(crate) fn n_nodes(&self) -> usize {
        2 * self.n_columns()
    }
}

/// Groups, blocks, and an order of elimination for the whole body.
#[derive(Debug)]
pub(crate) struct Structure {
    pub(crate) groups: Vec<SurfaceGroup>,
    /// Levels with unknowns, from the skin down.
    pub(crate) n_free_levels: usize,
    n_levels: usize,
    pub(crate) pattern: ColumnPattern,
    pub(crate) tree: Tree,
}

impl Structure {
    /// The structure of a body. The deepest level has unknowns or not.
    pub(crate) fn build(
        skin: &Surface,
        pairing: &Pairing,
        n_levels: usize,
        n_free_levels: usize,
    ) -> Result<Self, TooLarge> {
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
        let pattern = ColumnPattern::new(skin.points.len(), n_free_levels, edges);
        Ok(Self {
            tree: Tree::whole(&pattern, &places(skin))?,
            groups: cells
                .into_iter()
                .map(|(vertices, triangles)| group(&pattern, skin, vertices, &triangles))
                .collect(),
            n_free_levels,
            n_levels,
            pattern,
        })
    }

    /// Number of unknowns, including held ones.
    pub(crate) fn n_dofs(&self) -> usize {
        self.pattern.n_dofs()
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
    pub(crate) fn multiply(&self, blocks: &[Mat3], x: &[Vec3], y: &mut [Vec3]) {
        self.for_each_block(|block, row, column| {
            let block = &blocks[block];
            y[row] += block * x[column];
            if row != column {
                y[column] += block.tr_mul(&x[row]);
            }
        });
    }

    /// Calls `visit` for every block that exists, with its index, row node and column node.
    pub(crate) fn for_each_block(&self, visit: impl FnMut(usize, usize, usize)) {
        self.for_each_block_between(|_| true, visit);
    }

    /// As [`Self::for_each_block`], for the blocks between columns that `keep` selects; a column's
    /// own blocks are between it and itself.
    pub(crate) fn for_each_block_between(
        &self,
        keep: impl Fn([usize; 2]) -> bool,
        mut visit: impl FnMut(usize, usize, usize),
    ) {
        let n = self.n_free_levels;
        for v in (0..self.pattern.n_columns()).filter(|&v| keep([v, v])) {
            let (first, node) = (self.pattern.own(v), v * self.n_levels);
            for l in 0..n {
                visit(first + 2 * l, node + l, node + l);
                if l + 1 < n {
                    visit(first + 2 * l + 1, node + l + 1, node + l);
                }
            }
        }
        for pair in 0..self.pattern.n_pairs() {
            let columns = self.pattern.pair(pair).map(|v| v as usize);
            if !keep(columns) {
                continue;
            }
            let first = self.pattern.between(pair);
            let [a, b] = columns.map(|v| v * self.n_levels);
            for l in 0..n {
                for k in l.saturating_sub(1)..(l + 2).min(n) {
                    visit(first + 3 * l + k + 1 - l, a + k, b + l);
                }
            }
        }
    }

    pub(crate) fn n_blocks(&self) -> usize {
        self.pattern.n_blocks()
    }

    /// The block between the skin's nodes of two columns, `v ≥ w`; `None` if no triangle has both.
    pub(crate) fn skin_block(&self, v: usize, w: usize) -> Option<usize> {
        if v == w {
            return Some(self.pattern.own(v));
        }
        let pair = self.pattern.find(v, w)?;
        // Between columns, the first place is for levels that differ; see `for_each_block_between`.
        Some(self.pattern.between(pair) + 1)
    }

    /// The diagonal block of a node that has unknowns.
    pub(crate) fn diagonal(&self, node: usize) -> usize {
        let (v, l) = (node / self.n_levels, node % self.n_levels);
        self.pattern.own(v) + 2 * l
    }
}

/// Positions of the columns at the skin, m.
pub(crate) fn places(skin: &Surface) -> Vec<[f64; 3]> {
    skin.points.iter().map(|p| (*p).into()).collect()
}

fn group(
    pattern: &ColumnPattern,
    skin: &Surface,
    mut vertices: Vec<u32>,
    triangles: &[u32],
) -> SurfaceGroup {
    vertices.sort_unstable();
    let local = |v: u32| vertices.iter().position(|&w| w == v).unwrap_or(0) as u8;
    let wedges: Vec<[u8; 3]> = triangles
        .iter()
        .map(|&t| skin.triangles[t as usize].map(local))
        .collect();
    let mut bases = [0; 10];
    for a in 0..vertices.len() {
        for b in 0..=a {
            let (row, column) = (vertices[a] as usize, vertices[b] as usize);
            let base = if a == b {
                pattern.own(row)
            } else {
                let pair = pattern.find(row, column);
                pattern.between(pair.expect("columns of a group are neighbours"))
            };
            bases[a * (a + 1) / 2 + b] = base as u32;
        }
    }
    SurfaceGroup {
        vertices: std::array::from_fn(|i| vertices[i.min(vertices.len() - 1)]),
        triangles: [triangles[0], triangles[triangles.len() - 1]],
        shape: GroupLayout {
            wedges: [wedges[0], wedges[wedges.len() - 1]],
            n_wedges: triangles.len() as u8,
        },
        bases,
    }
}
