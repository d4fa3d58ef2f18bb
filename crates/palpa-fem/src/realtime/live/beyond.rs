//! Contact outside the zone. A tool that comes down there is felt at once, on the linear answer of
//! the exterior, until the background has made a zone for it.
//!
//! The forces on the exterior are a *load* on it. They act on its last linearisation, so nothing of
//! them is lost when the background makes another one, and columns that enter a zone start where the
//! load has moved them.

use palpa_mesh::Vec3;

use super::Live;
use super::candidates::clearance_of;
use super::iteration::Pass;
use crate::contact::{edge_of, kept_gap};
use crate::model::Model;

/// Deepest indentation from which the linear answer is taken up as the state of a zone, m. Tissue
/// indented more deeply than that is too far from equilibrium.
const MOST_TAKEN_UP: f64 = 1.5e-3;
/// Pace at which deeper tools are followed from there, as a share of the longest move.
const EASY_PACE: f64 = 0.125;
/// Most steps that this takes.
const MOST_CATCHING_UP: u32 = 20;

/// Contact outside the zone.
#[derive(Debug)]
pub(super) struct Beyond {
    /// Forces of the tools on the exterior after elimination, on the exterior and on the ring, N.
    /// `[n_dofs]`
    load: Vec<f32>,
    has_load: bool,
    /// Whether the displacements outside the zone are those under the present ring and load.
    pub(super) is_settled: bool,
    /// Triangles outside the zone near a tool that does not press within it.
    pub(super) triangles: Vec<u32>,
    /// Least gap between such a tool and the skin outside the zone, m.
    pub(super) clearance: f64,
    /// Whether a tool may touch outside the zone: it presses there, or nowhere. `[n_tools]`
    may_touch: Vec<bool>,
    /// Steps that tools which were taken back may still take to their targets; 0 if none was.
    catching_up: u32,
}

impl Beyond {
    pub(super) fn new(model: &Model, n_tools: usize) -> Self {
        Self {
            load: vec![0.0; model.structure.n_dofs()],
            has_load: false,
            is_settled: false,
            triangles: Vec::with_capacity(model.body.skin.triangles.len()),
            clearance: f64::INFINITY,
            may_touch: vec![false; n_tools],
            catching_up: 0,
        }
    }

    /// Called when tools are taken back: they are to come to their targets in the next steps.
    pub(super) fn take_back_tools(&mut self) {
        self.catching_up = MOST_CATCHING_UP;
    }

    /// Counts a step. Returns whether tools that were taken back are still on their way to their targets, which they
    /// stay `is_short` of.
    pub(super) fn is_catching_up(&mut self, is_short: bool) -> bool {
        self.catching_up = if is_short {
            self.catching_up.saturating_sub(1)
        } else {
            0
        };
        self.catching_up > 0
    }

    /// The load on the exterior, if any.
    pub(super) fn load(&self) -> Option<&[f32]> {
        self.has_load.then_some(&*self.load)
    }
}

impl Live {
    /// Finds the triangles outside the zone that a tool may touch, and brings the exterior to
    /// equilibrium with the ring and the tools if there are any. Cost: distances of the tools from
    /// the skin; near the skin, two substitutions through the exterior.
    pub(super) fn look_outside(&mut self, pass: Pass) {
        if self.plan.exterior.is_empty() || !self.exterior.answers_linearly() {
            self.beyond.has_load = false;
            self.beyond.triangles.clear();
            self.beyond.clearance = f64::INFINITY;
            return;
        }
        self.load_exterior();
        if matches!(pass, Pass::Follow | Pass::Near) {
            if !self.beyond.triangles.is_empty() {
                self.settle();
            }
            return;
        }
        if self.beyond.has_load {
            self.settle();
        }
        self.find_tools();
        self.find_triangles();
        if !self.beyond.triangles.is_empty() && !self.beyond.is_settled {
            self.settle();
            self.find_triangles();
        }
    }

    /// Takes the contact forces outside the zone as the load on the exterior.
    pub(super) fn load_exterior(&mut self) {
        let (plan, model, skin) = (&*self.plan, &*self.model, &self.skin);
        let outside = (0..model.body.n_vertices()).filter(|&v| !plan.is_inside[v]);
        let forces = outside.map(|v| (v, skin.pushes[v] + skin.frictions[v]));
        let forces = forces.filter(|(_, force)| *force != Vec3::zeros());
        self.beyond.has_load = forces.clone().next().is_some();
        if self.beyond.has_load {
            let hold = |v: usize| &model.supports[model.body.node(v, 0)];
            let forces =
                forces.map(|(v, force)| (plan.tree.first_dof(v), hold(v).free_part(&force)));
            let (load, scratch) = (&mut self.beyond.load, &mut self.inside.solve);
            self.outside.take_load(plan, forces, load, scratch);
        }
    }

    /// Whether tools press outside the zone.
    pub(super) fn presses_beyond(&self) -> bool {
        self.beyond.has_load
    }

    /// Takes back tools that press deep outside the zone, with a share of their pressure: the tissue
    /// there becomes part of a zone, which follows them from that depth.
    pub(super) fn ease_beyond(&mut self) {
        self.load_exterior();
        if !self.beyond.has_load {
            return;
        }
        for t in 0..self.course.tools.len() {
            let (model, plan, at) = (&*self.model, &*self.plan, &self.outside.at);
            let displacements = &self.state.displacements;
            let far = self.problem.pressing();
            let far = far.filter(|c| c.tool as usize == t && !plan.is_inside[c.vertex as usize]);
            let (mut depth, mut along) = (0.0_f64, Vec3::zeros());
            for candidate in far.clone() {
                let node = model.body.node(candidate.vertex as usize, 0);
                depth = depth.max((displacements[node] - at[node]).norm());
                along += candidate.normal * candidate.pressure;
            }
            if depth <= MOST_TAKEN_UP {
                continue;
            }
            let share = MOST_TAKEN_UP / depth;
            for candidate in far {
                self.skin.ease(candidate.vertex as usize, share);
            }
            let back = along.normalize() * (depth - MOST_TAKEN_UP);
            self.course.tools[t].pose.translation.vector -= back;
            self.recovery.pace = self.recovery.pace.min(EASY_PACE);
            self.beyond.take_back_tools();
        }
        self.course.clearance = 0.0;
        self.load_exterior();
    }

    /// Finds the tools that press outside the zone or nowhere.
    fn find_tools(&mut self) {
        for (t, may_touch) in self.beyond.may_touch.iter_mut().enumerate() {
            let pressed = self.problem.pressing();
            let pressed = pressed.filter(|c| c.tool as usize == t);
            let mut is_inside = pressed.map(|c| self.plan.is_inside[c.vertex as usize]);
            let presses_outside = is_inside.clone().any(|inside| !inside);
            *may_touch = presses_outside || !is_inside.any(|inside| inside);
        }
    }

    /// Finds the triangles outside the zone near these tools. Where the exterior is not settled, the
    /// displacements of its last linearisation count.
    fn find_triangles(&mut self) {
        let (model, plan, search) = (&*self.model, &*self.plan, &mut self.search);
        let beyond = &mut self.beyond;
        beyond.triangles.clear();
        beyond.clearance = f64::INFINITY;
        if !beyond.may_touch.contains(&true) {
            return;
        }
        let tools = self.course.tools.iter().zip(&beyond.may_touch);
        let tools = tools.filter(|(_, may_touch)| **may_touch);
        for v in 0..model.body.n_vertices() {
            let node = model.body.node(v, 0);
            let is_known = beyond.is_settled || plan.is_inside[v];
            let from = if is_known {
                &self.state.displacements
            } else {
                &self.outside.at
            };
            let place = model.body.positions[node] + from[node];
            let distances = tools
                .clone()
                .map(|(tool, _)| tool.tool.distance_at(&tool.pose, &place).distance);
            search.distances[v] = distances.fold(f64::INFINITY, f64::min);
            search.places[v] = place;
        }
        for &t in &plan.outer_triangles {
            let corners = model.body.skin.triangles[t as usize].map(|v| v as usize);
            let least = search.least_distance(corners);
            let edge = edge_of(&corners.map(|v| search.places[v]));
            let epsilons = corners.map(|v| model.skin_stiffness.normal[v]);
            let kept = kept_gap(corners.map(|v| self.skin.pressures[v]), epsilons);
            beyond.clearance = beyond.clearance.min(clearance_of(least, edge));
            if least <= self.params.reach + kept + edge {
                beyond.triangles.push(t);
            }
        }
    }
}
