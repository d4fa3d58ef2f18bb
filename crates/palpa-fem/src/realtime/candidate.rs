//! A skin vertex that may touch a tool in a moving step: a *candidate*.

use palpa_mesh::Vec3;

/// A skin vertex near a tool.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    /// Index of the skin vertex.
    pub(super) vertex: u32,
    /// Index of the nearest tool.
    pub(super) tool: u32,
    /// Its place at the start of the iteration, m.
    pub(super) start: Vec3,
    /// Unit normal of the tool's surface, from the tool to the tissue.
    pub(super) normal: Vec3,
    /// Gap at the start, m; negative inside the tool.
    pub(super) gap: f64,
    /// Pressing force, N: `p0`, then `p`.
    pub(super) pressure: f64,
    /// Force of friction on it, N.
    pub(super) friction: Vec3,
    /// Stiffness `κ` of the spring that holds it, N/m; 0 for none.
    pub(super) support: f64,
    /// The point of the tool to which friction holds it, in the tool's frame, m.
    pub(super) anchor: Vec3,
    /// Displacement of the iteration, m: first with the forces of the start, then with those found.
    /// Along the normal alone where no tool has friction.
    pub(super) displacement: Vec3,
}

impl Candidate {
    /// Force of the tool on it, N.
    pub(super) fn force(&self) -> Vec3 {
        self.normal * self.pressure + self.friction
    }
}
