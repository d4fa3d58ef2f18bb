//! The model of the body and its mesh.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::lump::Lump;
use crate::shape::ContactShape;
use crate::tool::{ContactTool, Tool};

/// The model of the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Model {
    /// Kind of model.
    pub kind: ModelKind,
    /// Share of the deviatoric strain that two paired prisms average, 0 to 0.95. A larger share is
    /// softer and more accurate on a coarse mesh, but a node that is pressed alone can then move
    /// against its neighbours. `None` is [automatic](Self::alpha()).
    pub alpha: Option<f64>,
    /// What prisms share in the layers below the first, if it is not the same there. A scene's file
    /// cannot give it.
    pub below: Option<BelowFirst>,
    /// Whether inertia and damping are included.
    pub dynamics: Dynamics,
    /// Tolerance of the force balance: the largest unbalanced force at a free node, relative to the
    /// forces in the body.
    pub tolerance: f64,
}

impl Model {
    /// Share of the deviatoric strain that two paired prisms average, as given or by default: 0.8.
    pub fn alpha(&self) -> f64 {
        self.alpha.unwrap_or(0.8)
    }

    /// The same in the layers below the first.
    pub fn below(&self) -> BelowFirst {
        self.below.unwrap_or(BelowFirst {
            alpha: self.alpha(),
            apart: 0.0,
        })
    }
}

/// What two paired prisms share in the layers below the first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BelowFirst {
    /// Share of the deviatoric strain that they average.
    pub alpha: f64,
    /// Share of the bulk modulus with which they resist to change their volumes against each other.
    pub apart: f64,
}

/// The models of the body.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ModelKind {
    /// A continuum: nonlinear, nearly incompressible, viscoelastic.
    #[default]
    Tissue,
    /// The network of bars of 2009.
    Reference,
}

/// Whether inertia and damping are included.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Dynamics {
    /// Equilibrium at every moment; time matters only through relaxation.
    #[default]
    QuasiStatic,
    /// Inertia and damping, with implicit time steps.
    Implicit(Damping),
}

/// Rayleigh damping: the damping matrix is `mass · M + stiffness · K`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Damping {
    /// Factor of the mass matrix, in 1/s.
    pub mass: f64,
    /// Factor of the stiffness matrix, in seconds.
    pub stiffness: f64,
}

/// Mesh size near the tool and lumps. Lengths in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mesh {
    /// Whether the mesh is refined; if false, it stays as it was grown.
    pub refine: bool,
    /// Whether the skin is coarsened where it is finer than wanted, before it is grown; `None` is
    /// automatic: in real time if the skin comes from a file and the mesh may be refined.
    pub coarsen: Option<bool>,
    /// Wanted length of edges and height of levels under the tool; `None` is
    /// [automatic](Self::near_tool_of).
    pub near_tool: Option<f64>,
    /// Wanted length of edges and height of levels in and around lumps; `None` is
    /// [automatic](Self::near_lump_of).
    pub near_lumps: Option<f64>,
    /// Increase of the wanted length of edges with the distance from the tool or lump, as a share of
    /// that distance; `None` is [automatic](Self::growth_of_edges).
    pub growth: Option<f64>,
    /// Increase of the wanted height of levels with the distance from the skin or a lump, as a share
    /// of it; `None` is [automatic](Self::growth_of_levels).
    pub level_growth: Option<f64>,
    /// Largest number of skin vertices after refinement.
    pub max_vertices: usize,
    /// Half the width of the error bar that may be left at the deepest, as a share of the force;
    /// `None` if the sizes above are kept.
    pub accuracy: Option<f64>,
    /// Longest time for the choice of a mesh by accuracy, s; `None` without limit.
    pub max_time: Option<f64>,
    /// Whether the fine part near the tool moves with it in real time; if false, the body is fine
    /// along the whole way of the motion.
    pub moves: bool,
}

impl Mesh {
    /// Automatic increase of sizes.
    pub const GROWTH: f64 = 0.5;
    /// Least automatic edge length, m.
    const FINEST: f64 = 0.5e-3;
    /// Why no accuracy can be reached with a tool of a single node.
    pub(crate) const NO_LIMIT: &str = "an accuracy cannot be reached with a tool of a single node, because its force has \
                                       no limit on ever finer meshes; choose a tool with a size";
    /// Largest automatic edge length near a tool, m.
    const COARSEST: f64 = 10e-3;

    /// Checks accuracy and time limit against the ranges of the scene file, and against `tool`, for a
    /// program that has set its own values.
    ///
    /// # Errors
    /// The value that is out of range, and the range; that the mesh may not be refined; or that the
    /// tool has no size.
    pub fn check(&self, tool: &Tool) -> Result<(), String> {
        use crate::limits::{ACCURACY, SEARCH_TIME};
        use crate::units::{Share, Time};
        let accuracy = self.accuracy.map(Share::from_si);
        if let Some(accuracy) = accuracy.filter(|accuracy| !ACCURACY.contains(accuracy)) {
            return Err(format!(
                "an accuracy of {accuracy} is outside the allowed range {ACCURACY}"
            ));
        }
        let time = self.max_time.map(Time::from_si);
        if let Some(time) = time.filter(|time| !SEARCH_TIME.contains(time)) {
            return Err(format!(
                "a time limit of {time} is outside the allowed range {SEARCH_TIME}"
            ));
        }
        if accuracy.is_some() && !self.refine {
            return Err(
                "an accuracy needs a mesh that may be refined; remove refine = false".to_owned(),
            );
        }
        if accuracy.is_some() && !tool.has_size() {
            return Err(Self::NO_LIMIT.to_owned());
        }
        Ok(())
    }

    /// Increase of the wanted length of edges, as given or by default: 0.5.
    pub fn growth_of_edges(&self) -> f64 {
        self.growth.unwrap_or(Self::GROWTH)
    }

    /// Increase of the wanted height of levels, as given or by default: that of the edges.
    pub fn growth_of_levels(&self) -> f64 {
        self.level_growth.unwrap_or_else(|| self.growth_of_edges())
    }

    /// Wanted length near `tool` in metres, as given or by default. Default: a quarter of the
    /// [contact radius](Tool::contact_radius), under a box, whose contact is a strip, 0.3 times it; see
    /// [`near_tool_at`](Self::near_tool_at).
    pub fn near_tool_of(&self, tool: &Tool) -> Option<f64> {
        let is_box = |tool: &ContactTool| matches!(tool.shape, ContactShape::Box { .. });
        let share = if tool.contact().is_some_and(is_box) {
            0.3
        } else {
            0.25
        };
        self.near_tool_at(tool, share)
    }

    /// Wanted length near `tool` in metres, as given or by default: this share of the contact radius,
    /// at most 0.8 times the radius of a rounded edge, 0.5 mm to 10 mm. `None` for a node, which has
    /// no size.
    pub fn near_tool_at(&self, tool: &Tool, share: f64) -> Option<f64> {
        let wanted = tool.edge_length(share);
        let automatic = (wanted > 0.0).then(|| wanted.clamp(Self::FINEST, Self::COARSEST));
        self.near_tool.or(automatic)
    }

    /// Wanted length near `lump` in metres, as given or by default. Default: half the smallest
    /// radius, 0.5 mm to 10 mm; `None` for a mesh.
    pub fn near_lump_of(&self, lump: &Lump) -> Option<f64> {
        let automatic = lump.shape.smallest_radius();
        let automatic = automatic.map(|r| (r / 2.0).clamp(Self::FINEST, Self::COARSEST));
        self.near_lumps.or(automatic)
    }
}
