//! Finds the skin vertices that may touch a tool in this step, and keeps the contact forces on the
//! skin.

use palpa_mesh::Vec3;

use super::super::candidate::{Candidate, Point};
use super::super::{MOST_CANDIDATES, MOST_FAR, MOST_POINTS};
use super::Live;
use crate::contact::{Fineness, Spot, anchor_at, edge_of, kept_gap, nearest_tool, spots_of};
use crate::model::Model;
use crate::posed_tool::PosedTool;

/// Fastest approach of a tool, m/s, at which points become candidates in time; and the least
/// reach, m.
const FASTEST: f64 = 0.1;
const LEAST_REACH: f64 = 0.2e-3;
/// Largest number of candidates that do not press, and a total number of candidates that is always
/// allowed.
const MOST_NEAR: usize = 24;
const LEAST_CANDIDATES: usize = 60;
/// No candidate.
const NONE: u16 = u16::MAX;

/// Contact forces on the vertices of the skin.
#[derive(Debug, Clone)]
pub(super) struct SkinForces {
    /// Force of the pressure, N; 0 without contact. `[n_vertices]`
    pub(super) pushes: Vec<Vec3>,
    /// Pressure, Pa; 0 without contact. `[n_vertices]`
    pub(super) pressures: Vec<f64>,
    /// Force of friction, N. `[n_vertices]`
    pub(super) frictions: Vec<Vec3>,
    /// Anchors, in the tool's frame, m; meaningless without contact. `[n_vertices]`
    pub(super) anchors: Vec<Vec3>,
    /// Whether the vertex touched at the end of the last step, and so has an anchor. `[n_vertices]`
    pub(super) is_anchored: Vec<bool>,
    /// Whether it slid. `[n_vertices]`
    pub(super) is_sliding: Vec<bool>,
}

impl SkinForces {
    /// No forces.
    pub(super) fn none(n_vertices: usize) -> Self {
        Self {
            pushes: vec![Vec3::zeros(); n_vertices],
            pressures: vec![0.0; n_vertices],
            frictions: vec![Vec3::zeros(); n_vertices],
            anchors: vec![Vec3::zeros(); n_vertices],
            is_anchored: vec![false; n_vertices],
            is_sliding: vec![false; n_vertices],
        }
    }

    /// Copies the forces on a vertex.
    pub(super) fn copy(&mut self, v: usize, from: &Self) {
        self.pushes[v] = from.pushes[v];
        self.pressures[v] = from.pressures[v];
        self.frictions[v] = from.frictions[v];
        self.anchors[v] = from.anchors[v];
        self.is_anchored[v] = from.is_anchored[v];
        self.is_sliding[v] = from.is_sliding[v];
    }

    /// Multiplies the pressure on a vertex, and lets it touch anew: without friction.
    pub(super) fn ease(&mut self, v: usize, by: f64) {
        self.pushes[v] *= by;
        self.pressures[v] *= by;
        self.frictions[v] = Vec3::zeros();
        self.is_anchored[v] = false;
        self.is_sliding[v] = false;
    }

    /// Removes the forces on a vertex.
    pub(super) fn clear(&mut self, v: usize) {
        self.pushes[v] = Vec3::zeros();
        self.pressures[v] = 0.0;
        self.frictions[v] = Vec3::zeros();
        self.is_anchored[v] = false;
        self.is_sliding[v] = false;
    }

    /// Removes all forces.
    pub(super) fn clear_all(&mut self) {
        for v in 0..self.pushes.len() {
            self.clear(v);
        }
    }
}

/// A triangle of the zone near a tool.
#[derive(Debug, Clone, Copy)]
struct Near {
    triangle: u32,
    /// Least gap of its points, less what the pressure there keeps pressed, m.
    gap: f64,
    /// Its points.
    first: u32,
    end: u32,
}

/// Least gap between a tool and a triangle, m, whose nearest corner is at `least` and whose edges are
/// no longer than `edge`, m: no point of it is nearer than that corner by much more than half an edge.
pub(super) fn clearance_of(least: f64, edge: f64) -> f64 {
    (least - 0.6 * edge).max(0.0).min(least.max(0.0))
}

/// Scratch of the search.
#[derive(Debug)]
pub(super) struct Search {
    /// Places of the zone's vertices and of those near tools beyond it, m, and their distances from the tools, m. `[n_vertices]`
    pub(super) places: Vec<Vec3>,
    pub(super) distances: Vec<f64>,
    /// Places at the start of the step, m. `[n_vertices]`
    pub(super) origins: Vec<Vec3>,
    spots: Vec<Spot>,
    near: Vec<Near>,
    /// The candidate of each vertex. `[n_vertices]`
    candidate_of: Vec<u16>,
    /// Sum of the forces of the points on each candidate, N.
    pushes: Vec<(Vec3, f64)>,
    /// Triangles that press and for which there was no room.
    pub(super) n_left_out: usize,
    /// Least gap of a triangle without candidates, m.
    pub(super) covered: f64,
}

impl Search {
    pub(super) fn new(model: &Model) -> Self {
        let n = model.body.n_vertices();
        Self {
            places: vec![Vec3::zeros(); n],
            distances: vec![f64::INFINITY; n],
            origins: vec![Vec3::zeros(); n],
            spots: Vec::with_capacity(MOST_POINTS),
            near: Vec::with_capacity(model.body.skin.triangles.len()),
            candidate_of: vec![NONE; n],
            pushes: Vec::with_capacity(MOST_CANDIDATES),
            n_left_out: 0,
            covered: 0.0,
        }
    }

    /// Distance of the nearest of three vertices, m.
    pub(super) fn least_distance(&self, corners: [usize; 3]) -> f64 {
        let distances = corners.map(|v| self.distances[v]).into_iter();
        distances.fold(f64::INFINITY, f64::min)
    }
}

impl Live {
    /// Notes where the skin is at the start of a step.
    pub(super) fn note_origins(&mut self) {
        for v in 0..self.model.body.n_vertices() {
            let node = self.model.body.node(v, 0);
            self.search.origins[v] =
                self.model.body.positions[node] + self.state.displacements[node];
        }
    }

    /// Finds the triangles that press or are near a tool, with their vertices, and the
    /// tools' clearance. The candidates are sorted by vertex.
    pub(super) fn find_candidates(&mut self, dt: f64) {
        let reach = (FASTEST * 2.0 * dt).min(self.params.reach).max(LEAST_REACH);
        self.place_skin();
        self.search.covered = reach;
        self.find_spots(reach);
        self.choose();
        self.aim();
    }

    /// Places of the zone's vertices, and their distances from the tools.
    fn place_skin(&mut self) {
        let (model, search) = (&*self.model, &mut self.search);
        self.course.clearance = f64::INFINITY;
        for &v in &self.plan.vertices {
            let v = v as usize;
            let node = model.body.node(v, 0);
            search.places[v] = model.body.positions[node] + self.state.displacements[node];
            let nearest = nearest_tool(&self.course.tools, &search.places[v]);
            search.distances[v] = nearest.map_or(f64::INFINITY, |nearest| nearest.1);
        }
    }

    /// Points of the skin within `reach` (m) of a tool, triangle by triangle.
    fn find_spots(&mut self, reach: f64) {
        let (model, search) = (&*self.model, &mut self.search);
        let tools = &self.course.tools;
        let fineness = Fineness::of(tools);
        search.spots.clear();
        search.near.clear();
        let mut clearance = self.beyond.clearance;
        for &t in self.plan.triangles.iter().chain(&self.beyond.triangles) {
            let triangle = model.body.skin.triangles[t as usize];
            let corners = triangle.map(|v| v as usize);
            let at = corners.map(|v| search.places[v]);
            let least = search.least_distance(corners);
            let edge = edge_of(&at);
            let epsilons = corners.map(|v| model.skin_stiffness.normal[v]);
            let pressures = corners.map(|v| self.skin.pressures[v]);
            let largest = pressures.into_iter().fold(0.0, f64::max);
            let kept = reach + kept_gap(pressures, epsilons);
            clearance = clearance.min(clearance_of(least, edge));
            if least > kept + edge {
                continue;
            }
            let first = search.spots.len();
            let at_rest = corners.map(|v| model.body.skin.points[v]);
            let near = (fineness, kept);
            spots_of(
                triangle,
                &at_rest,
                &at,
                &epsilons,
                tools,
                near,
                &mut search.spots,
            );
            let spots = &search.spots[first..];
            let gap = spots.iter().map(|spot| {
                let pressure: f64 = (0..3).map(|k| spot.shares[k] * pressures[k]).sum();
                spot.gap - pressure / spot.stiffness
            });
            let gap = gap.fold(f64::INFINITY, f64::min);
            let is_pressed = largest > 0.0;
            if spots.is_empty() || (gap > reach && !is_pressed) {
                search.spots.truncate(first);
                continue;
            }
            search.near.push(Near {
                triangle: t,
                gap,
                first: first as u32,
                end: search.spots.len() as u32,
            });
        }
        self.course.clearance = clearance;
    }

    /// Makes the vertices of the nearest triangles candidates. Triangles for which there is no room
    /// lose their forces and are counted.
    fn choose(&mut self) {
        let (model, search, problem) = (&*self.model, &mut self.search, &mut self.problem);
        let skin = &mut self.skin;
        problem.clear();
        search.n_left_out = 0;
        search
            .near
            .sort_unstable_by(|a, b| a.gap.total_cmp(&b.gap).then(a.triangle.cmp(&b.triangle)));
        let (mut n_pressing, mut n_far) = (0, 0);
        let mut chosen = 0;
        let is_inside = &self.plan.is_inside;
        for k in 0..search.near.len() {
            let near = search.near[k];
            let vertices = model.body.skin.triangles[near.triangle as usize];
            let new = vertices
                .iter()
                .filter(|&&v| search.candidate_of[v as usize] == NONE);
            let n = problem.candidates.len() + new.clone().count();
            let more_far = new.filter(|&&v| !is_inside[v as usize]).count();
            let is_pressing =
                near.gap < 0.0 || vertices.iter().any(|&v| skin.pressures[v as usize] > 0.0);
            let most = if is_pressing {
                MOST_CANDIDATES
            } else {
                (n_pressing + MOST_NEAR).clamp(LEAST_CANDIDATES, MOST_CANDIDATES)
            };
            if n > most || n_far + more_far > MOST_FAR {
                search.n_left_out += usize::from(is_pressing);
                search.covered = search.covered.min(near.gap);
                continue;
            }
            for v in vertices {
                if search.candidate_of[v as usize] == NONE {
                    search.candidate_of[v as usize] = 0;
                    let is_far = !is_inside[v as usize];
                    let candidate = skin.candidate(v, model, &self.course.tools, search);
                    let candidate = candidate.map(|candidate| Candidate {
                        is_far,
                        ..candidate
                    });
                    problem.candidates.extend(candidate);
                }
            }
            n_far += more_far;
            if is_pressing {
                n_pressing = problem.candidates.len();
            }
            search.near[chosen] = near;
            chosen += 1;
        }
        search.near.truncate(chosen);
        problem.candidates.sort_unstable_by_key(|c| c.vertex);
        for (i, candidate) in problem.candidates.iter().enumerate() {
            search.candidate_of[candidate.vertex as usize] = i as u16;
        }
        for near in &search.near {
            for spot in &search.spots[near.first as usize..near.end as usize] {
                problem.points.push(Point {
                    spot: *spot,
                    corners: spot.vertices.map(|v| search.candidate_of[v as usize]),
                    cosines: [1.0; 3],
                });
            }
        }
        for v in 0..search.candidate_of.len() {
            if search.candidate_of[v] == NONE && skin.pushes[v] != Vec3::zeros() {
                skin.clear(v);
            }
        }
        for candidate in &problem.candidates {
            search.candidate_of[candidate.vertex as usize] = NONE;
        }
    }

    /// Sets the directions in which the candidates are pressed.
    fn aim(&mut self) {
        let (search, problem) = (&mut self.search, &mut self.problem);
        search.pushes.clear();
        search
            .pushes
            .resize(problem.candidates.len(), (Vec3::zeros(), 0.0));
        for point in &problem.points {
            let corners = point.corners.map(usize::from);
            let spot = &point.spot;
            let pressure: f64 = (corners.iter().zip(&spot.shares))
                .map(|(&i, share)| {
                    let vertex = problem.candidates[i].vertex as usize;
                    share * self.skin.pressures[vertex]
                })
                .sum();
            let pressure = (pressure - spot.stiffness * spot.gap).max(0.0);
            for (&i, share) in corners.iter().zip(&spot.shares) {
                let by = share * spot.area * pressure;
                search.pushes[i].0 += spot.normal * by;
                search.pushes[i].1 += by;
            }
        }
        for (candidate, (push, size)) in problem.candidates.iter_mut().zip(&search.pushes) {
            if let Some(normal) = push.try_normalize(0.0) {
                candidate.normal = normal;
                candidate.area *= push.norm() / size;
                candidate.spread = size / push.norm();
            }
            candidate.friction = candidate.across(&candidate.friction);
            candidate.take_push(&self.skin.pushes[candidate.vertex as usize]);
        }
        for point in &mut problem.points {
            let normal = point.spot.normal;
            point.cosines = point
                .corners
                .map(|i| normal.dot(&problem.candidates[usize::from(i)].normal));
        }
    }

    /// Updates what a new step needs to know of the candidates of the last one.
    pub(super) fn touch_again(&mut self) {
        let (search, skin, tools) = (&self.search, &self.skin, &self.course.tools);
        self.course.clearance = 0.0;
        for candidate in &mut self.problem.candidates {
            let v = candidate.vertex as usize;
            let node = self.model.body.node(v, 0);
            let place = self.model.body.positions[node] + self.state.displacements[node];
            let posed = &tools[candidate.tool as usize];
            candidate.facing = posed.tool.distance_at(&posed.pose, &place).normal;
            candidate.is_anchored = skin.is_anchored[v];
            candidate.anchor = if candidate.is_anchored {
                skin.anchors[v]
            } else {
                anchor_at(posed, &place)
            };
            candidate.is_sliding = skin.is_sliding[v];
            candidate.origin = search.origins[v];
        }
    }

    /// Updates the places of candidates and points, and their gaps. The directions stay, because the
    /// compliance refers to them.
    pub(super) fn measure_gaps(&mut self) {
        let problem = &mut self.problem;
        for candidate in &mut problem.candidates {
            let vertex = candidate.vertex as usize;
            let node = self.model.body.node(vertex, 0);
            candidate.start = self.model.body.positions[node] + self.state.displacements[node];
            candidate.take_push(&self.skin.pushes[vertex]);
            candidate.friction = self.skin.frictions[vertex];
            candidate.displacement = Vec3::zeros();
        }
        for point in &mut problem.points {
            let corners = point.corners.map(|i| &problem.candidates[usize::from(i)]);
            let spot = &mut point.spot;
            let x: Vec3 = (0..3).map(|k| corners[k].start * spot.shares[k]).sum();
            let PosedTool { tool, pose } = &self.course.tools[spot.tool as usize];
            let distance = tool.distance_at(pose, &x);
            (spot.gap, spot.normal) = (distance.distance, distance.normal);
            point.cosines = corners.map(|candidate| candidate.normal.dot(&spot.normal));
        }
    }

    /// Applies a share of the force changes that the contact problem has found.
    pub(super) fn accept_contact(&mut self, share: f64) {
        let skin = &mut self.skin;
        for candidate in &mut self.problem.candidates {
            let v = candidate.vertex as usize;
            let before = skin.pushes[v];
            let push = before + (candidate.push() - before) * share;
            candidate.take_push(&push);
            let before = skin.frictions[v];
            candidate.friction = before + (candidate.friction - before) * share;
            skin.pushes[v] = push;
            skin.pressures[v] = candidate.pressure / candidate.area;
            skin.frictions[v] = candidate.friction;
            if candidate.is_far {
                // The exterior follows at the next iteration.
                let node = self.model.body.node(v, 0);
                let place = candidate.start + candidate.displacement * share;
                self.state.displacements[node] = place - self.model.body.positions[node];
            }
        }
    }

    /// Ends a step: the anchors of vertices that slide follow them, and those that have come to touch
    /// keep theirs.
    pub(super) fn end_contact(&mut self) {
        let skin = &mut self.skin;
        for candidate in &mut self.problem.candidates {
            let v = candidate.vertex as usize;
            skin.is_anchored[v] = candidate.pressure > 0.0;
            if !self.problem.has_friction {
                continue;
            }
            let posed = &self.course.tools[candidate.tool as usize];
            let most = candidate.most_friction(posed.tool.friction_limit(candidate.is_sliding));
            let is_sliding = candidate.friction.norm() >= most * (1.0 - 1e-6);
            if is_sliding {
                let node = self.model.body.node(v, 0);
                let x = self.model.body.positions[node] + self.state.displacements[node];
                candidate.anchor = anchor_at(posed, &x);
            }
            skin.is_sliding[v] = is_sliding && candidate.pressure > 0.0;
            skin.anchors[v] = candidate.anchor;
        }
    }
}

impl SkinForces {
    /// Makes a vertex a candidate, with its present forces.
    fn candidate(
        &self,
        vertex: u32,
        model: &Model,
        tools: &[PosedTool],
        search: &Search,
    ) -> Option<Candidate> {
        let v = vertex as usize;
        let start = search.places[v];
        let (tool, _) = nearest_tool(tools, &start)?;
        let PosedTool { tool: shape, pose } = &tools[tool];
        let facing = shape.distance_at(pose, &start).normal;
        let is_anchored = self.is_anchored[v];
        Some(Candidate {
            vertex,
            tool: tool as u32,
            start,
            normal: facing,
            facing,
            spread: 1.0,
            area: model.skin_areas[v],
            gap: f64::INFINITY,
            pressure: 0.0,
            aside: Vec3::zeros(),
            friction: self.frictions[v],
            support: 0.0,
            yielding: model.skin_stiffness.normal[v] * model.skin_areas[v],
            anchor: if is_anchored {
                self.anchors[v]
            } else {
                anchor_at(&tools[tool], &start)
            },
            is_anchored,
            is_sliding: self.is_sliding[v],
            is_far: false,
            origin: search.origins[v],
            displacement: Vec3::zeros(),
        })
    }
}
