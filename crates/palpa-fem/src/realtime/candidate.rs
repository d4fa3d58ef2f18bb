//! A skin vertex that may touch a tool in a moving step: a *candidate*.

use palpa_mesh::Vec3;

use crate::contact::Spot;

/// A skin vertex of triangles near a tool.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    /// Index of the skin vertex.
    pub(super) vertex: u32,
    /// Index of the nearest tool.
    pub(super) tool: u32,
    /// Its place at the start of the iteration, m.
    pub(super) start: Vec3,
    /// Unit vector along which it is pressed: the mean of the tool's normals at the points that press
    /// in its triangles.
    pub(super) normal: Vec3,
    /// The tool's normal at the vertex itself, across which friction acts.
    pub(super) facing: Vec3,
    /// Sum of the forces of its points over their resultant along `normal`, at least 1: it bounds
    /// friction.
    pub(super) spread: f64,
    /// Area that it stands for at rest, times the share of the pressure along `normal`, m².
    pub(super) area: f64,
    /// In the local model, how much nearer the tool must come until it bears, m.
    pub(super) gap: f64,
    /// Pressing force, N: `p0`, then `p`.
    pub(super) pressure: f64,
    /// What the pressure at its points adds across `normal`, N: the tool's normals differ from it.
    pub(super) aside: Vec3,
    /// Force of friction on it, N.
    pub(super) friction: Vec3,
    /// Stiffness `κ` of the spring that holds it, N/m; 0 for none.
    pub(super) support: f64,
    /// Stiffness of the skin under the area of the vertex, N/m.
    pub(super) yielding: f64,
    /// The point of the tool to which friction holds it, in the tool's frame, m.
    pub(super) anchor: Vec3,
    /// Whether it touched at the end of the last step, so that its anchor stays.
    pub(super) is_anchored: bool,
    /// Whether it slides.
    pub(super) is_sliding: bool,
    /// Whether it is outside the zone.
    pub(super) is_far: bool,
    /// Its place at the start of the step, m.
    pub(super) origin: Vec3,
    /// Displacement of the iteration, m: first with the forces of the start, then with those found.
    /// Along the normal alone where no tool has friction.
    pub(super) displacement: Vec3,
}

impl Candidate {
    /// Force of the tool on it, N.
    pub(super) fn force(&self) -> Vec3 {
        self.push() + self.friction
    }

    /// Largest friction for a coefficient, N.
    pub(super) fn most_friction(&self, coefficient: f64) -> f64 {
        coefficient * self.spread * self.pressure
    }

    /// A vector without its part along the tool's normal.
    pub(super) fn across(&self, vector: &Vec3) -> Vec3 {
        vector - self.facing * self.facing.dot(vector)
    }

    /// Divides a force of pressure (N) into that along the normal and the rest.
    pub(super) fn take_push(&mut self, push: &Vec3) {
        self.pressure = push.dot(&self.normal).max(0.0);
        self.aside = push - self.normal * self.pressure;
    }

    /// Force of the pressure on it, N.
    pub(super) fn push(&self) -> Vec3 {
        self.normal * self.pressure + self.aside
    }
}

/// A point of the skin near a tool, whose triangle has candidates at its corners.
#[derive(Debug, Clone, Copy)]
pub(super) struct Point {
    pub(super) spot: Spot,
    /// The candidates at the corners.
    pub(super) corners: [u16; 3],
    /// Product of the tool's normal there and the normal of each corner.
    pub(super) cosines: [f64; 3],
}
