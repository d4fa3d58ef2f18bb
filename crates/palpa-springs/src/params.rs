//! Parameters of a spring model: the stiffness of the bars and the solver of the system.

/// Parameters of a spring model, besides the body and its constraints.
#[derive(Debug, Clone, PartialEq)]
pub struct SpringParams {
    /// The stiffness of each layer, from the skin down. `[n_layers]`
    pub layers: Vec<LayerStiffness>,
    /// Which layer gives the stiffness of the in-level bars at an interface between two layers.
    pub interface_bars: InterfaceBars,
    /// How the linear system of a step is solved.
    pub solver: Solver,
}

impl SpringParams {
    /// Parameters with the given layers, and otherwise the defaults.
    pub fn new(layers: impl Into<Vec<LayerStiffness>>) -> Self {
        Self {
            layers: layers.into(),
            interface_bars: InterfaceBars::default(),
            solver: Solver::default(),
        }
    }
}

/// The stiffness of the bars of one layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LayerStiffness {
    /// Every bar has this stiffness, whatever its length, as in the thesis.
    Spring {
        /// Stiffness of each bar. N/m
        stiffness: f64,
    },
    /// Bars that stand for a continuum with this Young's modulus. Poisson's ratio is always ¼ in a
    /// network of bars; see `docs/theory/spring_stiffness.md`.
    Young {
        /// Young's modulus. Pa
        modulus: f64,
    },
}

/// Which layer gives the stiffness of the in-level bars on a level between two layers (the thesis
/// leaves it open).
///
/// In-level bars on the skin belong to the layer below, those on the base to the layer above. The
/// choice concerns only layers of [`LayerStiffness::Spring`]. A modulus is shared among the bars of
/// its own prisms, so that the bars at an interface get a share from either side.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum InterfaceBars {
    /// The layer above the level, towards the skin.
    Above,
    /// The layer below the level, towards the base.
    #[default]
    Below,
    /// Both layers: the mean of the two stiffnesses.
    Mean,
}

/// How the linear system of a step is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Solver {
    /// The fastest solver for the size. So far it has been the sparse one at every measured size.
    #[default]
    Auto,
    /// Cholesky of the reduced matrix, stored as a dense one.
    Dense,
    /// Supernodal Cholesky on the sparse graph of the columns.
    Sparse,
    /// Gauss–Jordan inverse of the whole `3N × 3N` matrix, as in 2009. For comparison only.
    HistoricalInverse,
}
