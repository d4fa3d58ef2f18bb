//! The one table of tolerances: how large an error may be, relative to the reference.

/// Patch tests and rigid motions.
pub const PATCH: f64 = 1e-9;
/// Columns with an exact one-dimensional solution.
pub const COLUMN: f64 = 1e-6;
/// Cylinder between bonded plates, to 6 mm.
pub const BONDED: f64 = 0.02;
/// The same to 12 mm.
pub const BONDED_DEEP: f64 = 0.04;
/// Relaxation, as a share of the elastic force.
pub const PRONY: f64 = 0.005;
/// Lamé's cylinder and Cook's membrane at Poisson's ratio 0.4999.
pub const NEARLY_INCOMPRESSIBLE: f64 = 0.015;
/// Half-space, layer and layered stacks at small strain (A1, A2, A3).
pub const SMALL_STRAIN: f64 = 0.02;
/// What a lump adds to the stiffness at small strain (A4), wherever it adds at least [`LUMP_LEAST`].
pub const LUMP: f64 = 0.10;
/// See [`LUMP`].
pub const LUMP_LEAST: f64 = 0.02;
/// Force of blocks at large strain (B1, B2, B4).
pub const BLOCK: f64 = 0.03;
/// The same on few nodes that are graded toward the tool: the worst over depths and meshes that are alike.
pub const ECONOMY: f64 = 0.02;
/// Under a disc on irregular triangles.
pub const ECONOMY_IRREGULAR: f64 = 0.025;
/// Under a sphere on the finer of those meshes.
pub const ECONOMY_FINE: f64 = 0.01;
/// What a lump adds to the force at large strain (B3c).
pub const BLOCK_LUMP: f64 = 0.15;
/// Surface profiles, as a share of their peak.
pub const PROFILE: f64 = 0.05;
/// What a lump inside one coarse prism adds to the force.
pub const SMALL_LUMP: f64 = 0.15;
/// Penetration at active points, m.
pub const PENETRATION: f64 = 1e-6;
/// Elastic force on different load steps.
pub const LOAD_STEPS: f64 = 0.001;

/// A tolerance as a person reads it: a round share.
pub fn share(value: f64) -> String {
    if value < 5e-5 {
        format!("{value:.0e}")
    } else {
        format!("{} %", (value * 1e6).round() / 1e4)
    }
}
