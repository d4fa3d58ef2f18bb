//! What the bars are made of, and how the system is solved.

/// Parameters of a spring model, beside the body and its constraints.
#[derive(Debug, Clone, PartialEq)]
pub struct SpringParams {
    /// The stiffness of each layer, from the skin down. `[n_layers]`
    pub layers: Vec<LayerStiffness>,
    /// The material of the in-level bars at an interface of two layers.
    pub interface_bars: InterfaceBars,
    /// How the linear system of a step is solved.
    pub solver: Solver,
}

impl SpringParams {
    /// Parameters with the given layers, and defaults otherwise.
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
    /// Every bar has the same stiffness whatever its length, as in the thesis.
    Spring {
        /// N/m
        stiffness: f64,
    },
    /// Bars stand for a continuum with this Young's modulus (and Poisson's ratio ¼, which bars cannot help having), see
    /// `docs/theory/spring_stiffness.md`.
    Young {
        /// Pa
        modulus: f64,
    },
}

/// Of which layer the in-level bars are where levels lie between two layers (the thesis leaves it open).
///
/// On the skin they are of the layer below, on the base of the layer above. It concerns layers of
/// [`LayerStiffness::Spring`] only; a modulus is spread over the bars of its own prisms, so that an interface gets a
/// share from either side.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum InterfaceBars {
    /// Of the interval above the level, towards the skin.
    Above,
    /// Of the interval below the level, towards the base.
    #[default]
    Below,
    /// Of both, the mean of the two stiffnesses.
    Mean,
}

/// How the linear system of a step is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Solver {
    /// Whichever is fastest for the size, which has been the sparse one at every size measured.
    #[default]
    Auto,
    /// Cholesky of the reduced matrix as a dense one.
    Dense,
    /// Cholesky by supernodes on the columns' sparse graph.
    Sparse,
    /// Gauss–Jordan inverse of the whole `3N × 3N` matrix, as in 2009. For comparison.
    HistoricalInverse,
}
