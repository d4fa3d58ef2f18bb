//! The place where the tools press, or would press.

use palpa_mesh::Vec3;

use super::super::candidate::Candidate;
use super::super::plan::Centres;
use super::Live;
use crate::model::Model;
use crate::posed_tool::PosedTool;

/// Residuals are relative to the tools' force, but at least to this force, N.
const LEAST_FORCE: f64 = 0.01;
/// A vertex with less than this share of its tool's force hardly presses. Zones that need not contain such
/// vertices are so much smaller that steps take a quarter less time; with 0.01 they take less still, but the
/// force of the moving step is then 0.3 to 0.4 % off instead of 0.1 to 0.2 %.
const FIRM: f64 = 0.005;

/// The place where tools press.
pub(super) struct Pressed {
    /// Mean of the vertices at rest, weighted by their forces, m.
    pub(super) middle: Vec3,
    /// Mean direction of the forces; a unit vector.
    pub(super) along: Vec3,
}

impl Live {
    /// The place where tools press; `None` without contact.
    pub(super) fn pressed(&self) -> Option<Pressed> {
        self.pressed_where(|_| true)
    }

    /// The place where a tool presses; `None` without contact.
    pub(super) fn pressed_by(&self, tool: usize) -> Option<Pressed> {
        self.pressed_where(|candidate| candidate.tool as usize == tool)
    }

    fn pressed_where(&self, keep: impl Fn(&Candidate) -> bool) -> Option<Pressed> {
        let points = &self.model.body.skin.points;
        let (mut force, mut middle, mut along) = (0.0, Vec3::zeros(), Vec3::zeros());
        for candidate in self.problem.candidates.iter().filter(|c| keep(c)) {
            force += candidate.pressure;
            middle += points[candidate.vertex as usize] * candidate.pressure;
            along += candidate.normal * candidate.pressure;
        }
        (force > 0.0).then(|| Pressed {
            middle: middle / force,
            along: along.normalize(),
        })
    }

    /// The pressing candidates, without those that hardly do. At the rim of a contact, a vertex bears
    /// little, and less than its share of a zone that contains it costs.
    pub(super) fn pressing_firmly(&self) -> impl Iterator<Item = &Candidate> {
        (0..self.course.tools.len()).flat_map(|tool| {
            let own = self.problem.pressing();
            let own = own.filter(move |c| c.tool as usize == tool);
            let least = FIRM * own.clone().map(|c| c.pressure).sum::<f64>();
            own.filter(move |c| c.pressure > least)
        })
    }

    /// Largest distance of a vertex that presses firmly from the centre of its tool, m.
    pub(super) fn contact_radius(&self, centres: &Centres) -> f64 {
        self.radius_where(centres, |_| true)
    }

    /// As [`Self::contact_radius`], from the middle of what each tool presses.
    pub(super) fn reach(&self) -> f64 {
        let middle = |tool| self.pressed_by(tool).map_or(Vec3::zeros(), |at| at.middle);
        self.contact_radius(&Centres::new(self.course.tools.len(), middle))
    }

    /// As [`Self::contact_radius`] in the present zone, without vertices outside it.
    pub(super) fn radius_inside(&self) -> f64 {
        let is_inside = |c: &Candidate| self.plan.is_inside[c.vertex as usize];
        self.radius_where(&self.plan.centres, is_inside)
    }

    fn radius_where(&self, centres: &Centres, keep: impl Fn(&Candidate) -> bool) -> f64 {
        let points = &self.model.body.skin.points;
        let pressing = self.pressing_firmly().filter(|c| keep(c));
        pressing
            .map(|c| (points[c.vertex as usize] - centres.of(c.tool as usize)).norm())
            .fold(0.0, f64::max)
    }

    /// Largest distance of a vertex that presses from its place at rest, m.
    pub(super) fn depth(&self) -> f64 {
        self.problem
            .pressing()
            .map(|c| self.indentation(c.vertex))
            .fold(0.0, f64::max)
    }

    /// The force that residuals are relative to, N: the sum of the magnitudes of the contact
    /// forces.
    pub(super) fn tools_force(&self) -> f64 {
        let candidates = self.problem.candidates.iter();
        let size: f64 = candidates.map(|c| c.force().norm()).sum();
        size.max(LEAST_FORCE)
    }
}

/// Least distance of the skin (or of the vertices `among`) from the tools, m, and the position of
/// that vertex at rest, m.
pub(super) fn nearest_point(
    model: &Model,
    displacements: &[Vec3],
    tools: &[PosedTool],
    among: Option<&[u32]>,
) -> (f64, Vec3) {
    let (distance, vertex) = nearest_vertex(model, displacements, tools, among);
    (distance, model.body.skin.points[vertex])
}

/// The least distance of the skin (or of the vertices `among`) from the tools, m, and that vertex.
pub(super) fn nearest_vertex(
    model: &Model,
    displacements: &[Vec3],
    tools: &[PosedTool],
    among: Option<&[u32]>,
) -> (f64, usize) {
    let mut best = (f64::INFINITY, 0);
    let mut look = |vertex: usize| {
        let point = model.body.skin.points[vertex];
        let x = point + displacements[model.body.node(vertex, 0)];
        for tool in tools {
            let distance = tool.tool.distance_at(&tool.pose, &x).distance;
            if distance < best.0 {
                best = (distance, vertex);
            }
        }
    };
    match among {
        Some(vertices) => vertices.iter().for_each(|&v| look(v as usize)),
        None => (0..model.body.n_vertices()).for_each(look),
    }
    best
}
