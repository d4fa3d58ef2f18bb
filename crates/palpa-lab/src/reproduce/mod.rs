//! The evaluation of the reference method (seed thesis, chapter 4) side by side with Palpa's
//! results.
//!
//! The text leaves some details open: lateral spacing, material of in-level bars, depth range. All
//! readings are computed, instead of choosing the one that looks right. `docs/reproduce.md` reports
//! the results.

pub mod claims;
pub mod continuum;
pub mod curves;
pub mod fit;
pub mod picture;
pub mod report;
pub mod speed;

use palpa_mesh::generate::patch::{centre_vertex, patch};
use palpa_springs::{
    Constraints, InterfaceBars, LayerStiffness, Solver, SpringError, SpringModel, SpringParams,
};
use serde::{Deserialize, Serialize};

/// The soft spring of the thesis, N/m: 1 dyn/cm.
pub const SOFT: f64 = 1.0e-3;
/// The hard spring of the thesis, N/m: 90 dyn/cm.
pub const HARD: f64 = 90.0e-3;

/// Depth between two levels, m.
pub const LEVEL_SPACING: f64 = 0.040;

/// The three bodies of figures 4.2 to 4.4, each with 4 levels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Body {
    /// One stiffness everywhere (figure 4.2).
    Uniform,
    /// Hard from 40 to 80 mm (figure 4.3).
    Middle,
    /// Hard from 80 to 120 mm (figure 4.4).
    Bottom,
}

impl Body {
    /// All bodies, in the order of the figures.
    pub const ALL: [Self; 3] = [Self::Uniform, Self::Middle, Self::Bottom];

    /// Spring stiffness in the three intervals from the skin down, in N/m.
    pub fn stiffnesses(self) -> [f64; 3] {
        match self {
            Self::Uniform => [SOFT; 3],
            Self::Middle => [SOFT, HARD, SOFT],
            Self::Bottom => [SOFT, SOFT, HARD],
        }
    }

    /// Name in plots.
    pub fn title(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::Middle => "hard middle",
            Self::Bottom => "hard bottom",
        }
    }

    /// Depth at which the thesis sees the slope change, mm; `None` for the uniform body.
    pub fn thesis_knee_mm(self) -> Option<f64> {
        match self {
            Self::Uniform => None,
            Self::Middle => Some(40.0),
            Self::Bottom => Some(80.0),
        }
    }
}

/// A square patch with its centre column held at the skin and its deepest level fixed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// Columns along x and y.
    pub columns: [usize; 2],
    /// Nodes per column.
    pub n_levels: usize,
    /// Distance between neighbouring columns, m.
    pub lateral_spacing: f64,
}

impl Shape {
    /// Number of nodes.
    pub fn n_nodes(&self) -> usize {
        self.columns[0] * self.columns[1] * self.n_levels
    }

    /// The model of this shape, with the stiffness (N/m) of each interval from the skin down.
    ///
    /// # Errors
    /// If the number of stiffnesses is not the number of intervals.
    pub fn model(
        &self,
        stiffnesses: &[f64],
        interface_bars: InterfaceBars,
        solver: Solver,
    ) -> Result<SpringModel, SpringError> {
        let depths: Vec<f64> = (0..self.n_levels)
            .map(|l| LEVEL_SPACING * l as f64)
            .collect();
        let layers: Vec<usize> = (0..self.n_levels - 1).collect();
        let [nx, ny] = self.columns;
        let body = patch(nx, ny, self.lateral_spacing, &depths, &layers);
        let held = body.node(centre_vertex(nx, ny), 0);
        let params = SpringParams {
            layers: stiffnesses
                .iter()
                .map(|&stiffness| LayerStiffness::Spring { stiffness })
                .collect(),
            interface_bars,
            solver,
        };
        SpringModel::build(&body, &params, &Constraints::hold(&body, [held]))
    }

    /// The thesis's patch with 4 levels, `n × n` columns 40 mm apart.
    pub fn thesis(n: usize) -> Self {
        Self {
            columns: [n, n],
            n_levels: 4,
            lateral_spacing: 0.040,
        }
    }
}
