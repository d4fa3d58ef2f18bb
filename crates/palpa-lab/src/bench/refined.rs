//! The same problems on refined meshes, to find the error that a mesh causes in the force.

use palpa_fem::Outcome;
use serde::Serialize;

use super::cases::{BenchCase, BenchGrading, BenchShape, Tissue, cases};
use super::ride::{Known, Ride, converged_press};
use palpa_fem::FemError;

/// A problem without its mesh: body and tool.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Problem {
    /// The layered block under the sphere of 10 mm radius.
    Layers,
    /// The layered block under the sphere of 5 mm radius.
    LayersSmall,
    /// The hardening block.
    Ogden,
    /// The limb.
    Limb,
    /// The block of one tissue.
    OneTissue,
}

/// Depths (m) and forces (N) of a pressed body on the refined mesh.
pub type ConvergedForces = &'static [(f64, f64)];

impl Problem {
    /// All problems.
    pub const ALL: [Self; 5] = [
        Self::Layers,
        Self::LayersSmall,
        Self::Ogden,
        Self::Limb,
        Self::OneTissue,
    ];

    /// Forces (N) of the straight press at the depths of a ride, recorded from [`Self::compute`]
    /// (`palpa bench --refined`, on 9,000 to 11,000 nodes).
    pub fn recorded(self) -> ConvergedForces {
        match self {
            Self::Layers => &[
                (2e-3, 0.18938),
                (3e-3, 0.36320),
                (4e-3, 0.59960),
                (5e-3, 0.89766),
            ],
            // Recorded with contact at vertices: some 0.5 % lower than with contact over triangles.
            Self::Ogden => &[
                (2e-3, 0.17987),
                (3e-3, 0.34737),
                (4e-3, 0.58419),
                (5e-3, 0.89522),
            ],
            Self::OneTissue => &[
                (2e-3, 0.49129),
                (3e-3, 0.91563),
                (4e-3, 1.42138),
                (5e-3, 1.99583),
                (6e-3, 2.62658),
            ],
            // Computed on the limb's mesh with edges halved once, 32,000 nodes.
            Self::Limb => &[
                (2e-3, 0.16918),
                (3e-3, 0.30497),
                (4e-3, 0.48379),
                (5e-3, 0.74066),
            ],
            // Not recorded yet, so these rows have no mesh error.
            Self::LayersSmall => &[],
        }
    }

    /// The recorded force (N) at a depth (m), if there is one.
    pub fn force_at(self, depth: f64) -> Option<f64> {
        let known = self
            .recorded()
            .iter()
            .find(|known| (known.0 - depth).abs() < 1e-9);
        known.map(|known| known.1)
    }

    /// The refined mesh.
    fn shape(self, centre: [f64; 2]) -> BenchShape {
        let grading = |spacing, ring| BenchGrading {
            spacing,
            ring,
            growth: 0.3,
            levels: [(0.5e-3, 0.2), (0.8e-3, 0.35), (3e-3, 0.6)],
            centre,
            beside: [0.5, 0.3],
        };
        match self {
            Self::Layers | Self::Ogden => BenchShape::Graded(grading(0.7e-3, 8e-3)),
            Self::LayersSmall => BenchShape::Graded(grading(0.6e-3, 5e-3)),
            Self::OneTissue => BenchShape::OneTissue(BenchGrading {
                levels: [(0.6e-3, 0.3); 3],
                ..grading(0.7e-3, 7e-3)
            }),
            Self::Limb => BenchShape::Limb {
                spacing: 3.6e-3,
                intervals: 2,
            },
        }
    }

    /// Computes the forces of the straight press, to `deepest` (m) or as deep as the ride goes. Returns
    /// them with the number of nodes of the mesh.
    ///
    /// # Errors
    /// If the body cannot be computed with, or if a step does not converge.
    pub fn compute(self, deepest: f64) -> Result<(Vec<Known>, usize), RefinedError> {
        let like = cases()
            .iter()
            .find(|case| case.problem == self)
            .ok_or(RefinedError::NoCase)?;
        let centre = like.ride().at;
        let shape = self.shape([centre.x, centre.y]);
        let case = BenchCase {
            shape,
            way: [like.way[0], 0.0],
            tissue: if like.tissue == Tissue::Relaxing {
                Tissue::Elastic
            } else {
                like.tissue
            },
            ..like.clone()
        };
        let model = case.model()?;
        let ride = like.ride();
        let ride = Ride {
            stroke: 0.0,
            depth: ride.depth.min(deepest),
            ..ride
        };
        let pressed = converged_press(&model, &ride)
            .map_err(|(at, outcome)| RefinedError::Outcome { at, outcome })?;
        Ok((pressed, model.n_nodes()))
    }
}

/// Why there are no forces on a refined mesh.
#[derive(Debug)]
pub enum RefinedError {
    /// No case presses the problem.
    NoCase,
    /// The body cannot be computed with.
    Fem(FemError),
    /// A step did not converge.
    Outcome {
        /// Position along the path, m.
        at: f64,
        /// How the step ended.
        outcome: Outcome,
    },
}

impl From<FemError> for RefinedError {
    fn from(error: FemError) -> Self {
        Self::Fem(error)
    }
}

impl std::fmt::Display for RefinedError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NoCase => write!(f, "no case presses this problem"),
            Self::Fem(error) => error.fmt(f),
            Self::Outcome { at, outcome } => {
                write!(
                    f,
                    "{:.1} mm along the way the body did not converge: {outcome:?}",
                    at * 1e3
                )
            }
        }
    }
}

impl std::error::Error for RefinedError {}
