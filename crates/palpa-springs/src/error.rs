//! Errors in the input.

/// Why a spring model cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SpringError {
    /// The number of stiffnesses differs from the number of layers.
    #[error(
        "the body has {found} layers, but {given} stiffnesses are given; give one for each layer, from the skin down"
    )]
    LayerCount {
        /// Number of layers of the body.
        found: usize,
        /// Number of stiffnesses given.
        given: usize,
    },
    /// A stiffness or modulus that is not a positive number.
    #[error("layer {layer}: a stiffness of {value} is not a positive number")]
    Stiffness {
        /// Layer, counted from the skin down.
        layer: usize,
        /// The value given, in N/m or Pa.
        value: f64,
    },
    /// A bar between two nodes that coincide or are not finite.
    #[error(
        "the bar between nodes {a} and {b} is {length} m long; the two must be apart: repair the mesh or thicken the layer"
    )]
    BarLength {
        /// Node at one end.
        a: usize,
        /// Node at the other end.
        b: usize,
        /// Length of the bar. m
        length: f64,
    },
    /// A bar whose stiffness is not a number ≥ 0.
    #[error(
        "the bar between nodes {a} and {b} has the stiffness {stiffness} N/m; it must be a number that is not negative"
    )]
    BarStiffness {
        /// Node at one end.
        a: usize,
        /// Node at the other end.
        b: usize,
        /// Stiffness of the bar. N/m
        stiffness: f64,
    },
    /// A node number that is too large.
    #[error("{what} names node {node}, but the last node is {last}")]
    NodeRange {
        /// The item that contains the node number.
        what: &'static str,
        /// The node.
        node: usize,
        /// The last existing node.
        last: usize,
    },
    /// The device holds no node.
    #[error("no node is operated; name at least one node that the device holds")]
    NothingOperated,
    /// A node that is both held by the device and fixed in space.
    #[error(
        "node {node} is both operated and fixed; a node on the rigid base cannot be held by the device"
    )]
    OperatedAndFixed {
        /// The node.
        node: usize,
    },
    /// A plane of symmetry without a direction.
    #[error(
        "the plane of symmetry at node {node} has no direction: its normal is zero or not finite"
    )]
    Normal {
        /// The node.
        node: usize,
    },
    /// Too many nodes for a dense solver.
    #[error(
        "{n_nodes} nodes are too many for a dense solver, whose step grows with their cube; up to {limit} are taken: \
         use the sparse solver, or a coarser mesh"
    )]
    TooLargeForDense {
        /// Number of nodes.
        n_nodes: usize,
        /// Largest number of nodes for a dense solver.
        limit: usize,
    },
    /// The factor would need too much memory.
    #[error(
        "the factor of {n_dofs} unknowns would take more than 8 GiB; make the mesh coarser or cut out a part"
    )]
    TooLarge {
        /// Number of unknowns.
        n_dofs: usize,
    },
}

impl From<palpa_sparse::TooLarge> for SpringError {
    fn from(error: palpa_sparse::TooLarge) -> Self {
        Self::TooLarge {
            n_dofs: error.n_dofs,
        }
    }
}
