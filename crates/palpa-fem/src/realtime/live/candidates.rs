//! Finds the skin vertices that may touch a tool in this step, and keeps the contact forces on the
//! skin.

use palpa_mesh::Vec3;

use super::super::MOST_CANDIDATES;
use super::super::candidate::Candidate;
use super::Live;
use crate::posed_tool::PosedTool;
use crate::shape::Distance;

/// Fastest approach of a tool, m/s, at which vertices become candidates in time; and the least
/// reach, m.
const FASTEST: f64 = 0.1;
const LEAST_REACH: f64 = 0.2e-3;
/// Largest number of candidates that do not press, and a total number of candidates that is always
/// allowed.
const MOST_NEAR: usize = 24;
const LEAST_CANDIDATES: usize = 60;

/// Contact forces on the vertices of the skin.
#[derive(Debug, Clone)]
pub(super) struct SkinForces {
    /// Pressing force, N; 0 without contact. `[n_vertices]`
    pub(super) pressures: Vec<f64>,
    /// Force of friction, N. `[n_vertices]`
    pub(super) frictions: Vec<Vec3>,
    /// Anchors, in the tool's frame, m; meaningless without contact. `[n_vertices]`
    pub(super) anchors: Vec<Vec3>,
}

impl SkinForces {
    /// No forces.
    pub(super) fn none(n_vertices: usize) -> Self {
        Self {
            pressures: vec![0.0; n_vertices],
            frictions: vec![Vec3::zeros(); n_vertices],
            anchors: vec![Vec3::zeros(); n_vertices],
        }
    }

    /// Makes a vertex at `start` a candidate, with its present forces.
    fn candidate(
        &self,
        v: u32,
        start: Vec3,
        (index, tool): (usize, &PosedTool),
        distance: &Distance,
    ) -> Candidate {
        let vertex = v as usize;
        let (pressure, normal) = (self.pressures[vertex], distance.normal);
        let mut friction = self.frictions[vertex];
        friction -= normal * normal.dot(&friction);
        let anchor = if pressure > 0.0 {
            self.anchors[vertex]
        } else {
            // The point of the surface that it would touch.
            let surface = start - normal * distance.distance;
            tool.pose.inverse_transform_point(&surface.into()).coords
        };
        Candidate {
            vertex: v,
            tool: index as u32,
            start,
            normal,
            gap: distance.distance,
            pressure,
            friction,
            support: 0.0,
            anchor,
            displacement: Vec3::zeros(),
        }
    }

    /// Removes the farthest candidates, and their forces, if there are too many.
    fn keep_nearest(&mut self, candidates: &mut Vec<Candidate>) {
        let n_pressing = candidates.iter().filter(|c| c.pressure > 0.0).count();
        let most = (n_pressing + MOST_NEAR).clamp(LEAST_CANDIDATES, MOST_CANDIDATES);
        if candidates.len() <= most {
            return;
        }
        let order = |c: &Candidate| {
            if c.pressure > 0.0 {
                f64::NEG_INFINITY
            } else {
                c.gap
            }
        };
        candidates.select_nth_unstable_by(most - 1, |a, b| {
            order(a).total_cmp(&order(b)).then(a.vertex.cmp(&b.vertex))
        });
        for lost in &candidates[most..] {
            self.pressures[lost.vertex as usize] = 0.0;
            self.frictions[lost.vertex as usize] = Vec3::zeros();
        }
        candidates.truncate(most);
    }
}

impl Live {
    /// Finds the vertices of the zone that press or are near a tool, and the tools' clearance. The
    /// candidates are sorted by vertex.
    pub(super) fn find_candidates(&mut self, dt: f64) {
        let model = &self.model;
        let reach = (FASTEST * 2.0 * dt).clamp(LEAST_REACH, self.params.reach);
        let candidates = &mut self.problem.candidates;
        candidates.clear();
        self.course.clearance = f64::INFINITY;
        for &v in &self.plan.vertices {
            let node = model.body.node(v as usize, 0);
            if model.supports[node].n == 3 {
                continue;
            }
            let start = model.body.positions[node] + self.state.displacements[node];
            let tools = self.course.tools.iter().enumerate();
            let nearest = tools
                .map(|tool| (tool, tool.1.tool.distance_at(&tool.1.pose, &start)))
                .min_by(|a, b| a.1.distance.total_cmp(&b.1.distance));
            let Some((tool, distance)) = nearest else {
                continue;
            };
            self.course.clearance = self.course.clearance.min(distance.distance);
            if distance.distance > reach && self.skin.pressures[v as usize] == 0.0 {
                continue;
            }
            candidates.push(self.skin.candidate(v, start, tool, &distance));
        }
        self.skin.keep_nearest(candidates);
        candidates.sort_unstable_by_key(|c| c.vertex);
    }

    /// Updates the candidates' positions and gaps. Their normals stay, because the compliance
    /// refers to them.
    pub(super) fn measure_gaps(&mut self) {
        for candidate in &mut self.problem.candidates {
            let vertex = candidate.vertex as usize;
            let node = self.model.body.node(vertex, 0);
            let PosedTool { tool, pose } = &self.course.tools[candidate.tool as usize];
            candidate.start = self.model.body.positions[node] + self.state.displacements[node];
            candidate.gap = tool.distance_at(pose, &candidate.start).distance;
            candidate.pressure = self.skin.pressures[vertex];
            candidate.friction = self.skin.frictions[vertex];
            candidate.displacement = Vec3::zeros();
        }
    }

    /// Applies a share of the force changes that the contact problem has found. The anchor of a
    /// sliding vertex follows it.
    pub(super) fn accept_contact(&mut self, share: f64) {
        let skin = &mut self.skin;
        for candidate in &mut self.problem.candidates {
            let vertex = candidate.vertex as usize;
            let before = skin.pressures[vertex];
            candidate.pressure = before + (candidate.pressure - before) * share;
            skin.pressures[vertex] = candidate.pressure;
            skin.frictions[vertex] = candidate.friction;
            if !self.problem.has_friction {
                continue;
            }
            let PosedTool { tool, pose } = &self.course.tools[candidate.tool as usize];
            let most = tool.friction() * candidate.pressure;
            if candidate.friction.norm() >= most * (1.0 - 1e-6) {
                let node = self.model.body.node(vertex, 0);
                let x = self.model.body.positions[node] + self.state.displacements[node];
                let distance = tool.distance_at(pose, &x);
                let surface = x - distance.normal * distance.distance;
                candidate.anchor = pose.inverse_transform_point(&surface.into()).coords;
            }
            skin.anchors[vertex] = candidate.anchor;
        }
    }
}
