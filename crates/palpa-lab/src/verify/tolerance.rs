//! The table of tolerances: largest accepted errors, relative to the reference unless stated
//! otherwise.

/// Patch tests and rigid motions.
pub const PATCH: f64 = 1e-9;
/// Columns with an exact one-dimensional solution.
pub const COLUMN: f64 = 1e-6;
/// Cylinder between bonded plates, up to 6 mm.
pub const BONDED: f64 = 0.02;
/// Cylinder between bonded plates, up to 12 mm.
pub const BONDED_DEEP: f64 = 0.04;
/// Relaxation, as a share of the elastic force.
pub const PRONY: f64 = 0.005;
/// Lamé's cylinder and Cook's membrane at Poisson's ratio 0.4999.
pub const NEARLY_INCOMPRESSIBLE: f64 = 0.015;
/// Half-space, layer and layered stacks at small strain (A1, A2, A3).
pub const SMALL_STRAIN: f64 = 0.02;
/// Stiffness that a lump adds at small strain (A4), compared wherever it adds at least
/// [`LUMP_LEAST`].
pub const LUMP: f64 = 0.10;
/// Smallest share that a lump must add for a comparison, see [`LUMP`].
pub const LUMP_LEAST: f64 = 0.02;
/// Force of blocks at large strain (B1, B2, B4).
pub const BLOCK: f64 = 0.03;
/// Force of blocks on few nodes, graded towards the tool: the largest error over depths and similar
/// meshes.
pub const ECONOMY: f64 = 0.02;
/// Like [`ECONOMY`], under a disc on irregular triangles.
pub const ECONOMY_IRREGULAR: f64 = 0.025;
/// Like [`ECONOMY`], under a sphere on the finest of these meshes.
pub const ECONOMY_FINE: f64 = 0.01;
/// Force that a lump adds at large strain (B3c).
pub const BLOCK_LUMP: f64 = 0.15;
/// Surface profiles, relative to their peak.
pub const PROFILE: f64 = 0.05;
/// Force that a lump inside one coarse prism adds.
pub const SMALL_LUMP: f64 = 0.15;
/// Error of the law of contact, relative to the force.
pub const MISMATCH: f64 = 2e-4;
/// Penetration of a vertex of the skin, as a share of an edge.
pub const PENETRATION: f64 = 0.15;
/// Force with friction with different load steps.
pub const FRICTION_STEPS: f64 = 0.01;
/// Tangential force of a sphere that slips in part, as a share of the friction.
pub const PARTIAL_SLIP: f64 = 0.03;
/// Force of a sphere that slips in part, over that without friction.
pub const FRICTION_STIFFENS: f64 = 0.002;
/// Force of a sphere that sticks, over that without friction.
pub const ADHESION: f64 = 0.03;
/// Radius of the disc that sticks, as a share of the radius of contact. Edges are a sixth of it and
/// more.
pub const STICKING: f64 = 0.1;
/// Elastic force with different load steps.
pub const LOAD_STEPS: f64 = 0.001;

/// A tolerance as text for people.
pub fn share(value: f64) -> String {
    if value < 5e-5 {
        format!("{value:.0e}")
    } else {
        format!("{} %", (value * 1e6).round() / 1e4)
    }
}
