//! The network of bars of a layered body.
//!
//! ```text
//!  level l−1   i───────j      in-level bars on every level       i─j
//!              │╲     ╱│      verticals                          i─i', j─j'
//!              │  ╲ ╱  │      both diagonals of every            i─j', j─i'
//!              │  ╱ ╲  │      face between two columns
//!              │╱     ╲│
//!  level l     i'──────j'
//! ```
//! Every bar carries axial force only; with the unit direction `c` from `a` to `b` its stiffness is
//! ```text
//!     k [  c cᵀ  −c cᵀ ]
//!       [ −c cᵀ   c cᵀ ]          (3.10)
//! ```
//! and the sum over all bars is the global stiffness `M1` (3.11–3.14).

use nalgebra::DMatrix;
use palpa_mesh::{LayeredBody, Vec3};

use crate::error::SpringError;
use crate::params::{InterfaceBars, LayerStiffness, SpringParams};
use crate::stiffness::prism_bar_stiffness;

/// A pin-jointed bar between two nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bar {
    /// One end.
    pub a: u32,
    /// The other end.
    pub b: u32,
    /// N/m
    pub stiffness: f64,
    /// Natural length, in metres.
    pub length: f64,
}

/// Nodes at rest, and the bars between them.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    /// Node positions at rest, in metres. `[n_nodes]`
    pub positions: Vec<Vec3>,
    /// Bars; at most one for each pair of nodes.
    pub bars: Vec<Bar>,
    /// The column of each node. The solver numbers the nodes of a column together. `[n_nodes]`
    pub column: Vec<u32>,
}

impl Network {
    /// Builds the bars of a layered body: in-level bars along every skin edge on every level,
    /// verticals in every column, and both diagonals below every skin edge between two levels.
    ///
    /// # Errors
    /// If the stiffnesses do not fit the layers or are not positive, or if two nodes joined by a
    /// bar coincide.
    ///
    /// # Panics
    /// If an interval of the body belongs to a layer without a name.
    pub fn from_body(body: &LayeredBody, params: &SpringParams) -> Result<Self, SpringError> {
        let n_layers = body.layer_names.len();
        if params.layers.len() != n_layers {
            return Err(SpringError::LayerCount {
                found: n_layers,
                given: params.layers.len(),
            });
        }
        for (layer, stiffness) in params.layers.iter().enumerate() {
            let (LayerStiffness::Spring { stiffness: value }
            | LayerStiffness::Young { modulus: value }) = *stiffness;
            if !(value > 0.0 && value.is_finite()) {
                return Err(SpringError::Stiffness { layer, value });
            }
        }

        let numbering = BarNumbering::new(body);
        let mut bars = numbering.joined(body);
        for (interval, &layer) in body.interval_layer.iter().enumerate() {
            match params.layers[layer] {
                LayerStiffness::Spring { stiffness } => {
                    numbering.add_springs(&mut bars, interval, stiffness, params.interface_bars);
                }
                LayerStiffness::Young { modulus } => {
                    numbering.add_modulus(&mut bars, body, interval, modulus);
                }
            }
        }
        let network = Self {
            positions: body.positions.clone(),
            bars,
            column: (0..body.n_nodes())
                .map(|node| (node / body.n_levels) as u32)
                .collect(),
        };
        network.check()?;
        Ok(network)
    }

    /// Number of nodes.
    pub fn n_nodes(&self) -> usize {
        self.positions.len()
    }

    /// The global stiffness `M1` of the network, with the bar directions at `positions`.
    /// `[3 n_nodes × 3 n_nodes]`, node-major, N/m
    ///
    /// # Panics
    /// If `positions` does not hold one position for each node.
    pub fn stiffness_matrix(&self, positions: &[Vec3]) -> DMatrix<f64> {
        assert_eq!(
            positions.len(),
            self.n_nodes(),
            "one position for each node"
        );
        let n = 3 * self.n_nodes();
        let mut m1 = DMatrix::zeros(n, n);
        for bar in &self.bars {
            let (a, b) = (bar.a as usize, bar.b as usize);
            let c = direction(positions[b] - positions[a]);
            let block = bar.stiffness * c * c.transpose();
            for (row, column, sign) in [(a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)] {
                let mut view = m1.fixed_view_mut::<3, 3>(3 * row, 3 * column);
                view += sign * block;
            }
        }
        m1
    }

    /// Returns an error for the first invalid bar.
    pub(crate) fn check(&self) -> Result<(), SpringError> {
        let last = self.n_nodes().saturating_sub(1);
        for bar in &self.bars {
            let (a, b) = (bar.a as usize, bar.b as usize);
            if a.max(b) > last {
                return Err(SpringError::NodeRange {
                    what: "a bar",
                    node: a.max(b),
                    last,
                });
            }
            if !(bar.stiffness >= 0.0 && bar.stiffness.is_finite()) {
                let stiffness = bar.stiffness;
                return Err(SpringError::BarStiffness { a, b, stiffness });
            }
            let length = (self.positions[b] - self.positions[a]).norm();
            if a == b || !(length > 0.0 && length.is_finite() && bar.length > 0.0) {
                return Err(SpringError::BarLength { a, b, length });
            }
        }
        Ok(())
    }
}

/// The unit vector along `d`, or zero if the bar has collapsed to a point: then it has no direction
/// and no force.
#[inline]
pub(crate) fn direction(d: Vec3) -> Vec3 {
    let length_sq = d.norm_squared();
    if length_sq > f64::MIN_POSITIVE {
        d / length_sq.sqrt()
    } else {
        Vec3::zeros()
    }
}

/// The index of each bar of a body in the list: in-level bars by edge and level, then verticals by
/// vertex and interval, then pairs of diagonals by edge and interval.
struct BarNumbering {
    edges: Vec<[u32; 2]>,
    n_levels: usize,
    first_vertical: usize,
    first_diagonal: usize,
}

impl BarNumbering {
    fn new(body: &LayeredBody) -> Self {
        let edges = body.skin.edges();
        let first_vertical = edges.len() * body.n_levels;
        Self {
            n_levels: body.n_levels,
            first_vertical,
            first_diagonal: first_vertical + body.n_vertices() * (body.n_levels - 1),
            edges,
        }
    }

    fn n_intervals(&self) -> usize {
        self.n_levels - 1
    }

    fn in_level(&self, edge: usize, level: usize) -> usize {
        edge * self.n_levels + level
    }

    fn vertical(&self, vertex: usize, interval: usize) -> usize {
        self.first_vertical + vertex * self.n_intervals() + interval
    }

    /// Index of the diagonal from the upper node at `edges[edge][upper]` to the lower node at the
    /// other end of the edge.
    fn diagonal(&self, edge: usize, interval: usize, upper: usize) -> usize {
        self.first_diagonal + 2 * (edge * self.n_intervals() + interval) + upper
    }

    /// All bars with their ends and natural lengths; stiffnesses are still 0.
    fn joined(&self, body: &LayeredBody) -> Vec<Bar> {
        let mut ends =
            Vec::with_capacity(self.first_diagonal + 2 * self.edges.len() * self.n_intervals());
        for &[i, j] in &self.edges {
            let (i, j) = (i as usize, j as usize);
            ends.extend((0..self.n_levels).map(|l| (body.node(i, l), body.node(j, l))));
        }
        for v in 0..body.n_vertices() {
            ends.extend((0..self.n_intervals()).map(|l| (body.node(v, l), body.node(v, l + 1))));
        }
        for &[i, j] in &self.edges {
            let (i, j) = (i as usize, j as usize);
            for l in 0..self.n_intervals() {
                ends.push((body.node(i, l), body.node(j, l + 1)));
                ends.push((body.node(j, l), body.node(i, l + 1)));
            }
        }
        ends.into_iter()
            .map(|(a, b)| Bar {
                a: a as u32,
                b: b as u32,
                stiffness: 0.0,
                length: (body.positions[b] - body.positions[a]).norm(),
            })
            .collect()
    }

    fn add_springs(&self, bars: &mut [Bar], interval: usize, stiffness: f64, rule: InterfaceBars) {
        let n_vertices = (self.first_diagonal - self.first_vertical) / self.n_intervals();
        for vertex in 0..n_vertices {
            bars[self.vertical(vertex, interval)].stiffness += stiffness;
        }
        // The shares of this interval's layer in the in-level bars of its upper and its lower
        // level.
        let (upper, lower) = match rule {
            InterfaceBars::Above => (0.0, 1.0),
            InterfaceBars::Below => (1.0, 0.0),
            InterfaceBars::Mean => (0.5, 0.5),
        };
        let is_skin = interval == 0;
        let is_base = interval + 1 == self.n_intervals();
        let upper = if is_skin { 1.0 } else { upper };
        let lower = if is_base { 1.0 } else { lower };
        for edge in 0..self.edges.len() {
            bars[self.in_level(edge, interval)].stiffness += upper * stiffness;
            bars[self.in_level(edge, interval + 1)].stiffness += lower * stiffness;
            for end in 0..2 {
                bars[self.diagonal(edge, interval, end)].stiffness += stiffness;
            }
        }
    }

    fn add_modulus(&self, bars: &mut [Bar], body: &LayeredBody, interval: usize, modulus: f64) {
        for (t, triangle) in body.skin.triangles.iter().enumerate() {
            let nodes = body.prism(t, interval);
            let shares = prism_bar_stiffness(&nodes.map(|node| body.positions[node]), modulus);
            for s in 0..3 {
                let [i, j] = [triangle[s], triangle[(s + 1) % 3]];
                let ends = [i.min(j), i.max(j)];
                let edge = self
                    .edges
                    .binary_search(&ends)
                    .expect("every side of a triangle is an edge");
                bars[self.in_level(edge, interval)].stiffness += shares.upper[s];
                bars[self.in_level(edge, interval + 1)].stiffness += shares.lower[s];
                bars[self.vertical(i as usize, interval)].stiffness += shares.vertical[s];
                // `shares.diagonal[s][0]` runs from the upper end of i to the lower end of j.
                let upper = usize::from(i != ends[0]);
                bars[self.diagonal(edge, interval, upper)].stiffness += shares.diagonal[s][0];
                bars[self.diagonal(edge, interval, 1 - upper)].stiffness += shares.diagonal[s][1];
            }
        }
    }
}
