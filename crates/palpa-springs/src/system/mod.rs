//! The linear system of a step, `K_ff u_f = −K_fc u_c`: numbering, assembly from the current
//! positions, and factorization.
//!
//! [`Structure`] depends only on the topology: ordering, pattern, and the places of each bar's
//! entries. [`System`] holds the numbers. Free directions are numbered column by column of the
//! body, in the fill-reducing order of the columns. Only the lower triangle is stored.

mod inverse;
mod ordering;

use palpa_mesh::Vec3;

use crate::constraints::Freedom;
use crate::error::SpringError;
use crate::network::{Network, direction};
use crate::params::Solver;
use inverse::HistoricalInverse;
use ordering::{column_order, node_pattern};
use palpa_sparse::{Factor, NodePattern, Pattern, Singular};

/// A pivot smaller than this, relative to the diagonal entry that it came from, counts as zero: the
/// node can move without stretching a bar. Rounding leaves about 1e-14 where exact arithmetic
/// leaves 0.
const SINGULAR_PIVOT: f64 = 1e-11;

/// Marks a node without unknowns.
const NONE: usize = usize::MAX;

/// The parts of the linear system that depend only on the topology.
#[derive(Debug)]
pub(crate) struct Structure {
    /// The first unknown of each node, or [`NONE`].
    start: Vec<usize>,
    n_dofs: usize,
    solver: Solver,
    pattern: Pattern,
    /// Index of the diagonal entry of each unknown.
    diagonal: Vec<usize>,
    /// For each bar between two free nodes: the indices of the first entry in each column of its
    /// block.
    blocks: Vec<[usize; 3]>,
}

impl Structure {
    pub(crate) fn build(
        network: &Network,
        freedoms: &[Freedom],
        solver: Solver,
    ) -> Result<Self, SpringError> {
        let order = column_order(network, freedoms)?;
        let mut start = vec![NONE; network.n_nodes()];
        let mut n_dofs = 0;
        for &node in &order {
            start[node] = n_dofs;
            n_dofs += freedoms[node].n_free;
        }
        let solver = match solver {
            // Measured: faster than dense at every size, by a quarter at 51 unknowns and 40 times
            // at 1,200.
            Solver::Auto => Solver::Sparse,
            chosen => chosen,
        };
        let nodes = node_pattern(network, &order);
        let pattern = match solver {
            Solver::Sparse => {
                Pattern::sparse(&nodes, n_dofs, |node| (start[node], freedoms[node].n_free))?
            }
            // The historical inverse forms its own matrix and uses only the numbering from here.
            _ => Pattern::dense(if solver == Solver::HistoricalInverse {
                0
            } else {
                n_dofs
            }),
        };
        let mut structure = Self {
            start,
            n_dofs,
            solver,
            pattern,
            diagonal: Vec::new(),
            blocks: Vec::new(),
        };
        if solver != Solver::HistoricalInverse {
            structure.locate(network, freedoms, &nodes);
        }
        Ok(structure)
    }

    /// Finds the places of the entries of every node and bar, so that assembly does not need to
    /// search.
    fn locate(&mut self, network: &Network, freedoms: &[Freedom], nodes: &NodePattern) {
        self.diagonal = (0..self.n_dofs).map(|i| self.pattern.diagonal(i)).collect();
        self.blocks = network
            .bars
            .iter()
            .map(|bar| {
                let (a, b) = (bar.a as usize, bar.b as usize);
                let mut block = [NONE; 3];
                if self.start[a] != NONE && self.start[b] != NONE {
                    let (first, second) = if self.start[a] < self.start[b] {
                        (a, b)
                    } else {
                        (b, a)
                    };
                    for (c, entry) in block.iter_mut().take(freedoms[first].n_free).enumerate() {
                        *entry = self
                            .pattern
                            .entry(self.start[second], self.start[first] + c);
                    }
                }
                block
            })
            .collect();
        debug_assert_eq!(
            nodes.len(),
            self.start.iter().filter(|s| **s != NONE).count()
        );
    }

    pub(crate) fn n_dofs(&self) -> usize {
        self.n_dofs
    }

    pub(crate) fn n_factor_entries(&self) -> usize {
        match self.solver {
            Solver::HistoricalInverse => self.n_dofs * self.n_dofs,
            _ => self.pattern.n_factor_entries(),
        }
    }

    pub(crate) fn solver(&self) -> Solver {
        self.solver
    }
}

/// The numbers of the linear system, in memory that is reused from step to step.
#[derive(Debug)]
pub(crate) struct System {
    /// The lower triangle of `K_ff`, in the order of the pattern.
    values: Vec<f64>,
    /// A copy of the diagonal of `K_ff`; pivots are compared with it.
    scale: Vec<f64>,
    right_side: Vec<f64>,
    factor: Factor,
    inverse: Option<HistoricalInverse>,
    /// Unit direction of every bar at the positions of the last assembly. `[n_bars]`
    pub(crate) directions: Vec<Vec3>,
}

impl System {
    pub(crate) fn new(structure: &Structure, n_nodes: usize, n_bars: usize) -> Self {
        Self {
            values: vec![0.0; structure.pattern.n_entries()],
            scale: vec![0.0; structure.n_dofs],
            right_side: vec![0.0; structure.n_dofs],
            factor: Factor::new(&structure.pattern),
            inverse: (structure.solver == Solver::HistoricalInverse)
                .then(|| HistoricalInverse::new(n_nodes)),
            directions: vec![Vec3::zeros(); n_bars],
        }
    }

    /// Computes the unit direction of every bar from `a` to `b` at the given positions.
    pub(crate) fn update_directions(&mut self, bars: &[crate::Bar], positions: &[Vec3]) {
        for (c, bar) in self.directions.iter_mut().zip(bars) {
            *c = direction(positions[bar.b as usize] - positions[bar.a as usize]);
        }
    }

    /// Assembles `K_ff` from the current directions and factors it.
    pub(crate) fn refactor(
        &mut self,
        structure: &Structure,
        bars: &[crate::Bar],
        freedoms: &[Freedom],
    ) -> Result<(), Singular> {
        if let Some(inverse) = &mut self.inverse {
            return inverse.update(bars, freedoms, &self.directions);
        }
        self.assemble(structure, bars, freedoms);
        for (scale, &entry) in self.scale.iter_mut().zip(&structure.diagonal) {
            *scale = self.values[entry];
        }
        self.factor.refactor(
            &structure.pattern,
            &mut self.values,
            &self.scale,
            SINGULAR_PIVOT,
        )
    }

    fn assemble(&mut self, structure: &Structure, bars: &[crate::Bar], freedoms: &[Freedom]) {
        self.values.fill(0.0);
        for ((bar, c), block) in bars.iter().zip(&self.directions).zip(&structure.blocks) {
            let (a, b) = (bar.a as usize, bar.b as usize);
            let (start_a, start_b) = (structure.start[a], structure.start[b]);
            let local = |node: usize| (freedoms[node].local(c), freedoms[node].n_free);
            let (c_a, n_a) = local(a);
            let (c_b, n_b) = local(b);
            for (start, n, c) in [(start_a, n_a, c_a), (start_b, n_b, c_b)] {
                if start == NONE {
                    continue;
                }
                for j in 0..n {
                    let top = structure.diagonal[start + j];
                    let k_c = bar.stiffness * c[j];
                    for (i, entry) in self.values[top..top + n - j].iter_mut().enumerate() {
                        *entry += k_c * c[i + j];
                    }
                }
            }
            if start_a != NONE && start_b != NONE {
                let ((c_first, n_first), (c_second, n_second)) = if start_a < start_b {
                    ((c_a, n_a), (c_b, n_b))
                } else {
                    ((c_b, n_b), (c_a, n_a))
                };
                for j in 0..n_first {
                    let top = block[j];
                    let k_c = bar.stiffness * c_first[j];
                    for (i, entry) in self.values[top..top + n_second].iter_mut().enumerate() {
                        *entry -= k_c * c_second[i];
                    }
                }
            }
        }
    }

    /// Solves for the free nodes. On entry, `increments` holds `u_c` at held nodes and zero
    /// elsewhere, and `forces` holds the nodal forces `M1 u_c`. On return, `increments` holds `u_f`
    /// at free nodes.
    pub(crate) fn solve(
        &mut self,
        structure: &Structure,
        freedoms: &[Freedom],
        forces: &[Vec3],
        increments: &mut [Vec3],
    ) {
        if let Some(inverse) = &mut self.inverse {
            inverse.solve(freedoms, forces, increments);
            return;
        }
        for (node, &start) in structure.start.iter().enumerate() {
            if start != NONE {
                let n = freedoms[node].n_free;
                let local = freedoms[node].local(&forces[node]);
                for (i, entry) in self.right_side[start..start + n].iter_mut().enumerate() {
                    *entry = -local[i];
                }
            }
        }
        self.factor
            .solve(&structure.pattern, &self.values, &mut self.right_side);
        for (node, &start) in structure.start.iter().enumerate() {
            if start != NONE {
                let n = freedoms[node].n_free;
                let mut local = Vec3::zeros();
                local.as_mut_slice()[..n].copy_from_slice(&self.right_side[start..start + n]);
                increments[node] = if n == 3 {
                    local
                } else {
                    freedoms[node].frame * local
                };
            }
        }
    }
}
