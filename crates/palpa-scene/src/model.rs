//! The model of response and the mesh it works on.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::lump::Lump;
use crate::tool::Tool;

/// How the body answers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Model {
    /// Which model.
    pub kind: ModelKind,
    /// Share of the deviatoric strain that two paired prisms take as their mean, 0 to 0.95. More is softer and nearer to
    /// the truth on a coarse mesh, and lets a node that is pressed alone move against its neighbours.
    pub alpha: f64,
    /// Whether mass and damping count.
    pub dynamics: Dynamics,
    /// Largest force left over at a free node in equilibrium, relative to the scale of the forces in the body.
    pub tolerance: f64,
}

/// The models of response.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ModelKind {
    /// A continuum: nonlinear, nearly incompressible, viscoelastic.
    #[default]
    Tissue,
    /// The network of bars of 2009.
    Reference,
}

/// Whether mass and damping count.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Dynamics {
    /// Equilibrium at every moment; time acts through relaxation only.
    #[default]
    QuasiStatic,
    /// Mass and damping, stepped implicitly.
    Implicit(Damping),
}

/// Rayleigh damping: the damping matrix is `mass · M + stiffness · K`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Damping {
    /// The factor of the mass, in 1/s.
    pub mass: f64,
    /// The factor of the stiffness, in seconds.
    pub stiffness: f64,
}

/// How fine the body is made where it matters. Lengths in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mesh {
    /// Whether the body is refined at all; else it is taken as it was grown.
    pub refine: bool,
    /// Wanted length of edges and height of levels under the tool; `None` is [automatic](Self::near_tool_of).
    pub near_tool: Option<f64>,
    /// Wanted length of edges and height of levels in and round lumps; `None` is [automatic](Self::near_lump_of).
    pub near_lumps: Option<f64>,
    /// By which share of the distance from tool or lump the wanted length grows.
    pub growth: f64,
    /// Most skin vertices that refinement may lead to.
    pub max_vertices: usize,
    /// Whether in real time what is fine near the tool moves with it; else it lies along the whole way of the motion.
    pub moves: bool,
}

impl Mesh {
    /// Edges are not made shorter than this unasked. m
    const FINEST: f64 = 0.5e-3;
    /// Nor are they left longer than this near a tool. m
    const COARSEST: f64 = 10e-3;

    /// Wanted length near `tool` in metres: as given, or else a quarter of its
    /// [contact radius](Tool::contact_radius), and no more than a third of the radius that its edge is rounded by, 0.5 mm to
    /// 10 mm; `None` for a node, which has no size.
    pub fn near_tool_of(&self, tool: &Tool) -> Option<f64> {
        let radius = tool.contact_radius();
        let edge = tool.contact().and_then(|tool| tool.shape.edge_radius());
        let wanted = edge.map_or(radius / 4.0, |edge| (radius / 4.0).min(edge / 3.0));
        let automatic = (radius > 0.0).then(|| wanted.clamp(Self::FINEST, Self::COARSEST));
        self.near_tool.or(automatic)
    }

    /// Wanted length near `lump` in metres: as given, or else half its smallest radius, 0.5 mm to 10 mm; `None` for a
    /// mesh of which nothing is given.
    pub fn near_lump_of(&self, lump: &Lump) -> Option<f64> {
        let automatic = lump.shape.smallest_radius();
        let automatic = automatic.map(|r| (r / 2.0).clamp(Self::FINEST, Self::COARSEST));
        self.near_lumps.or(automatic)
    }
}
