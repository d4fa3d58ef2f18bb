//! What can be wrong with the input.

/// Why a spring model cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SpringError {
    /// The body names another number of layers than stiffnesses are given.
    #[error(
        "the body has {found} layers, but {given} stiffnesses are given; give one for each layer, from the skin down"
    )]
    LayerCount {
        /// Layers of the body.
        found: usize,
        /// Stiffnesses given.
        given: usize,
    },
    /// A stiffness or modulus that is not a positive number.
    #[error("layer {layer}: a stiffness of {value} is not a positive number")]
    Stiffness {
        /// Layer, from the skin down.
        layer: usize,
        /// N/m or Pa.
        value: f64,
    },
    /// A bar between two nodes that coincide or are not finite.
    #[error(
        "the bar between nodes {a} and {b} is {length} m long; the two must be apart: repair the mesh or thicken the layer"
    )]
    BarLength {
        /// One end.
        a: usize,
        /// The other end.
        b: usize,
        /// m
        length: f64,
    },
    /// A bar whose stiffness is not a number ≥ 0.
    #[error(
        "the bar between nodes {a} and {b} has the stiffness {stiffness} N/m; it must be a number that is not negative"
    )]
    BarStiffness {
        /// One end.
        a: usize,
        /// The other end.
        b: usize,
        /// N/m
        stiffness: f64,
    },
    /// A node number beyond the last.
    #[error("{what} names node {node}, but the last node is {last}")]
    NodeRange {
        /// What names the node.
        what: &'static str,
        /// The node.
        node: usize,
        /// The last node that there is.
        last: usize,
    },
    /// No node for the device to hold.
    #[error("no node is operated; name at least one node that the device holds")]
    NothingOperated,
    /// A node that is held by the device and fixed in space.
    #[error(
        "node {node} is operated and fixed at once; a node on the rigid base cannot be held by the device"
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
    /// A dense solver on a system that only a sparse one bears.
    #[error(
        "{n_nodes} nodes are too many for a dense solver, whose step grows with their cube; up to {limit} are taken: \
         use the sparse solver, or a coarser mesh"
    )]
    TooLargeForDense {
        /// Nodes.
        n_nodes: usize,
        /// Most nodes.
        limit: usize,
    },
    /// Too much memory for the factor.
    #[error(
        "the factor of {n_dofs} unknowns would take more than 8 GiB; make the mesh coarser or cut out a part"
    )]
    TooLarge {
        /// Unknowns.
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
