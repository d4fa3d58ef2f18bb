//! The model behind every step: bars, constraints, and the structure of the linear system. It is
//! built once and never changes.

use palpa_mesh::{LayeredBody, Vec3};

use crate::constraints::{Constraints, Freedom, Role, freedoms};
use crate::error::SpringError;
use crate::network::{Bar, Network};
use crate::params::{Solver, SpringParams};
use crate::system::Structure;

/// Largest number of nodes for a dense solver. Two matrices of 3N × 3N then take 144 MB, and a step
/// of Gauss–Jordan some 20 s.
const MAX_DENSE_NODES: usize = 1000;

/// A network of bars under constraints, ready for steps.
#[derive(Debug)]
pub struct SpringModel {
    pub(crate) rest: Vec<Vec3>,
    pub(crate) bars: Vec<Bar>,
    pub(crate) freedoms: Vec<Freedom>,
    /// The nodes that the device holds, ascending.
    pub(crate) operated: Vec<usize>,
    /// Bars with exactly one operated end: index of the bar, and whether that end is `a`.
    pub(crate) operated_bars: Vec<(usize, bool)>,
    /// Sum of the stiffnesses of the bars at each node. N/m
    pub(crate) stiffness_at: Vec<f64>,
    /// Number of bars at each node.
    pub(crate) n_bars_at: Vec<u32>,
    pub(crate) structure: Structure,
    /// Diagonal of the bounding box at rest. The check for nodes that run away compares with it. m
    pub(crate) size: f64,
}

impl SpringModel {
    /// Builds the model of a layered body.
    ///
    /// # Errors
    /// If the stiffnesses, the constraints or the body's shape are invalid; see [`SpringError`].
    pub fn build(
        body: &LayeredBody,
        params: &SpringParams,
        constraints: &Constraints,
    ) -> Result<Self, SpringError> {
        Self::from_network(
            Network::from_body(body, params)?,
            constraints,
            params.solver,
        )
    }

    /// Builds the model of any network of bars.
    ///
    /// # Errors
    /// If a bar or a constraint is invalid, or the system is too large.
    pub fn from_network(
        network: Network,
        constraints: &Constraints,
        solver: Solver,
    ) -> Result<Self, SpringError> {
        network.check()?;
        let n_nodes = network.n_nodes();
        if matches!(solver, Solver::Dense | Solver::HistoricalInverse) && n_nodes > MAX_DENSE_NODES
        {
            return Err(SpringError::TooLargeForDense {
                n_nodes,
                limit: MAX_DENSE_NODES,
            });
        }
        let freedoms = freedoms(n_nodes, constraints)?;
        let operated: Vec<usize> = (0..n_nodes)
            .filter(|&n| freedoms[n].role == Role::Operated)
            .collect();
        let is_operated = |n: u32| freedoms[n as usize].role == Role::Operated;
        let operated_bars = network
            .bars
            .iter()
            .enumerate()
            .filter(|(_, bar)| is_operated(bar.a) != is_operated(bar.b))
            .map(|(i, bar)| (i, is_operated(bar.a)))
            .collect();
        let mut stiffness_at = vec![0.0; n_nodes];
        let mut n_bars_at = vec![0; n_nodes];
        for bar in &network.bars {
            for end in [bar.a, bar.b] {
                stiffness_at[end as usize] += bar.stiffness;
                n_bars_at[end as usize] += 1;
            }
        }
        let (low, high) = network.positions.iter().fold(
            (network.positions[0], network.positions[0]),
            |(low, high), p| (low.inf(p), high.sup(p)),
        );
        Ok(Self {
            structure: Structure::build(&network, &freedoms, solver)?,
            rest: network.positions,
            bars: network.bars,
            freedoms,
            operated,
            operated_bars,
            stiffness_at,
            n_bars_at,
            size: (high - low).norm(),
        })
    }

    /// Number of nodes.
    pub fn n_nodes(&self) -> usize {
        self.rest.len()
    }

    /// Number of unknowns of a step: the free directions of all nodes.
    pub fn n_dofs(&self) -> usize {
        self.structure.n_dofs()
    }

    /// The bars.
    pub fn bars(&self) -> &[Bar] {
        &self.bars
    }

    /// Node positions at rest, in metres. `[n_nodes]`
    pub fn rest_positions(&self) -> &[Vec3] {
        &self.rest
    }

    /// The nodes that the device holds, ascending.
    pub fn operated(&self) -> &[usize] {
        &self.operated
    }

    /// Number of entries in the factor of the stiffness matrix, or in its inverse. One solution
    /// multiplies by each of them.
    pub fn n_factor_entries(&self) -> usize {
        self.structure.n_factor_entries()
    }

    /// The solver in use; never [`Solver::Auto`].
    pub fn solver(&self) -> Solver {
        self.structure.solver()
    }
}
