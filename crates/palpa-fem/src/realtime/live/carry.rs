//! Carries displacements, contact forces and memory of a body from one of its meshes to another.

use palpa_mesh::{SurfaceIndex, Vec3};

use super::Live;
use super::candidates::SkinForces;
use crate::batch::{Batches, History, Tangent};
use crate::model::Model;
use crate::state::{Memory, State};

/// The places of a mesh's columns and prisms in another mesh of the same body. Both have the same
/// skin at rest and the same levels.
#[derive(Debug, Clone)]
pub(super) struct Carry {
    /// For each vertex, the vertices of the old triangle that contains it, and their weights.
    parts: Vec<[(u32, f64); 3]>,
    /// For each vertex, the old vertex at the same place, if any.
    same: Vec<Option<u32>>,
    /// For each group and each of its two triangles, the old group and the index of the triangle in
    /// it.
    wedges: Vec<[(u32, u8); 2]>,
}

/// Contact of a vertex, carried over.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Carried {
    /// Pa.
    pub(super) pressure: f64,
    /// N.
    pub(super) push: Vec3,
    pub(super) friction: Vec3,
    /// In the tool's frame, m.
    pub(super) anchor: Vec3,
    pub(super) is_anchored: bool,
    pub(super) is_sliding: bool,
}

/// The state of a body, to continue from on another mesh.
#[derive(Debug, Clone)]
pub(super) struct Come {
    pub(super) state: State,
    pub(super) history: Option<History>,
    pub(super) skin: SkinForces,
}

impl Come {
    /// A body at rest, with these displacements, m. `[n_nodes]`
    pub(super) fn rest(model: &Model, displacements: &[Vec3]) -> Self {
        Self {
            state: State {
                displacements: displacements.to_vec(),
                ..State::new(model)
            },
            history: None,
            skin: SkinForces::none(model.body.n_vertices()),
        }
    }

    /// The state of a body, up to date except for the memory of a linear exterior.
    pub(super) fn of(live: &mut Live) -> Self {
        live.settle();
        let history = live.model.has_memory.then(|| {
            let kept = live.jobs.kept.as_deref();
            let mut history = kept.cloned().unwrap_or_else(|| History::new(&live.model));
            live.remember(&mut history);
            history
        });
        Self {
            state: live.state.clone(),
            history,
            skin: live.skin.clone(),
        }
    }
}

impl Come {
    /// Whether nothing touches the body, and it has no memory: then it is at rest.
    pub(super) fn is_at_rest(&self) -> bool {
        self.history.is_none() && self.skin.pressures.iter().all(|pressure| *pressure == 0.0)
    }

    /// This state with a share of its displacements from rest (m, `[n_nodes]`).
    pub(super) fn nearer_to(&self, rest: &[Vec3], share: f64) -> Self {
        let mut come = self.clone();
        if share < 1.0 {
            for (u, rest) in come.state.displacements.iter_mut().zip(rest) {
                *u = rest + (*u - rest) * share;
            }
        }
        come
    }

    /// Adds a multiple of the last elastic stresses of another state.
    fn add_last(&mut self, by: f64, other: &Self) {
        for (into, from) in self.state.history.iter_mut().zip(&other.state.history) {
            into.add_last(by, from);
        }
        if let (Some(into), Some(from)) = (&mut self.history, &other.history) {
            into.add(by, from, true);
        }
    }
}

/// A state whose memory has the elastic stresses of these displacements (m, `[n_nodes]`).
fn elastic(model: &Model, displacements: &[Vec3]) -> Come {
    let mut come = Come::rest(model, displacements);
    let mut memory = Memory::new(model);
    memory.hold(model);
    let pattern = &model.structure.pattern;
    let mut batches = Batches::new(model, &memory, pattern, &|_| true, Tangent::None);
    batches.commit(model, &memory, &mut come.state);
    let mut history = History::new(model);
    batches.store(&mut history);
    come.history = Some(history);
    come
}

impl Carry {
    /// Relates two meshes. Cost: a search for each vertex and each triangle.
    pub(super) fn new(old: &Model, new: &Model) -> Self {
        /// Vertices of two meshes coincide if all but this share of the weight belongs to one
        /// vertex.
        const SAME: f64 = 1e-6;
        let skin = &old.body.skin;
        let index = SurfaceIndex::build(skin);
        let (mut parts, mut same) = (Vec::new(), Vec::new());
        for point in &new.body.skin.points {
            let Some(closest) = index.closest(*point) else {
                continue;
            };
            let (weights, vertices) = (closest.weights, skin.triangles[closest.triangle as usize]);
            parts.push([0, 1, 2].map(|k| (vertices[k], weights[k])));
            let at = (0..3).find(|&k| weights[k] > 1.0 - SAME);
            same.push(at.map(|k| vertices[k]));
        }
        let mut place = vec![(0, 0); skin.triangles.len()];
        for (g, group) in (0_u32..).zip(&old.structure.groups) {
            for (k, &t) in (0_u8..).zip(&group.triangles[..usize::from(group.shape.n_wedges)]) {
                place[t as usize] = (g, k);
            }
        }
        let find = |t: u32| {
            let middle = new.body.skin.corners(t as usize).iter().sum::<Vec3>() / 3.0;
            let closest = index.closest(middle);
            closest.map_or((0, 0), |closest| place[closest.triangle as usize])
        };
        let wedges = (new.structure.groups.iter().filter(|_| new.has_memory))
            .map(|group| group.triangles.map(find))
            .collect();
        Self {
            parts,
            same,
            wedges,
        }
    }

    /// Carries a state on the old mesh over to the new one. `rest` has the displacements of both
    /// meshes at rest, m: what is carried is the difference from rest.
    pub(super) fn onto(&self, old: &Model, come: &Come, new: &Model, rest: [&[Vec3]; 2]) -> Come {
        let from_rest = come.state.displacements.iter().zip(rest[0]);
        let from_rest: Vec<Vec3> = from_rest.map(|(u, rest)| u - rest).collect();
        let mut displacements = self.displacements(new, &from_rest);
        for (u, rest) in displacements.iter_mut().zip(rest[1]) {
            *u += rest;
        }
        let mut out = Come::rest(new, &displacements);
        for v in 0..self.parts.len() {
            let touch = self.touch(v, &come.skin, [old, new]);
            let skin = &mut out.skin;
            skin.pressures[v] = touch.pressure;
            skin.pushes[v] = touch.push;
            skin.frictions[v] = touch.friction;
            skin.anchors[v] = touch.anchor;
            skin.is_anchored[v] = touch.is_anchored;
            skin.is_sliding[v] = touch.is_sliding;
        }
        if new.has_memory {
            self.carry_memory(old, come, new, &mut out);
        }
        out
    }

    /// Carries the viscous memory over. The last elastic stresses are carried by their difference from
    /// those of the present displacements: another mesh has other stresses at the same displacements,
    /// and a body at rest must not take that for a stress that has changed.
    fn carry_memory(&self, old: &Model, come: &Come, new: &Model, out: &mut Come) {
        let last = elastic(old, &come.state.displacements);
        let mut from = come.clone();
        from.add_last(-1.0, &last);
        self.carry_phases(old, &from.state, new, &mut out.state);
        out.history = from.history.map(|history| self.history(old, &history, new));
        out.add_last(1.0, &elastic(new, &out.state.displacements));
    }

    /// Displacements of all nodes of the new mesh, interpolated in the old one, m. `[n_nodes]`
    pub(super) fn displacements(&self, new: &Model, old: &[Vec3]) -> Vec<Vec3> {
        (0..self.parts.len())
            .flat_map(|v| (0..new.body.n_levels).map(move |l| (v, l)))
            .map(|(v, l)| self.displacement(v, l, new, old))
            .collect()
    }

    /// Displacement at the place of a new vertex, interpolated in the old mesh, m.
    pub(super) fn displacement(&self, v: usize, level: usize, new: &Model, old: &[Vec3]) -> Vec3 {
        if let Some(u) = self.same[v] {
            return old[new.body.node(u as usize, level)];
        }
        let parts = self.parts[v].iter();
        parts
            .map(|&(u, weight)| old[new.body.node(u as usize, level)] * weight)
            .sum()
    }

    /// Contact at the place of a new vertex, interpolated in the old mesh: pressure, friction per
    /// area, and the anchor if all corners have one.
    pub(super) fn touch(&self, v: usize, skin: &SkinForces, [old, new]: [&Model; 2]) -> Carried {
        let mut out = Carried {
            is_anchored: true,
            ..Carried::default()
        };
        for &(u, weight) in &self.parts[v] {
            let u = u as usize;
            if weight <= 0.0 {
                continue;
            }
            let by = weight * new.skin_areas[v] / old.skin_areas[u];
            out.pressure += weight * skin.pressures[u];
            out.push += skin.pushes[u] * by;
            out.friction += skin.frictions[u] * by;
            out.anchor += skin.anchors[u] * weight;
            out.is_anchored &= skin.is_anchored[u];
            out.is_sliding |= skin.is_sliding[u];
        }
        out
    }

    /// Memory of the pairs in lanes.
    pub(super) fn history(&self, old: &Model, from: &History, new: &Model) -> History {
        let mut history = History::new(new);
        for (pair, places) in self.pairs(old, new) {
            history.carry(pair, from, places);
        }
        history
    }

    /// Memory of the pairs that are evaluated one by one.
    fn carry_phases(&self, old: &Model, from: &State, new: &Model, into: &mut State) {
        let phases = |model: &Model, pair: usize| {
            model.first_phase[pair] as usize..model.first_phase[pair + 1] as usize
        };
        for (pair, places) in self.pairs(old, new) {
            for p in phases(new, pair) {
                let material = new.phases[p].material;
                let past = places.map(|(pair, half)| {
                    let mut all = phases(old, pair);
                    all.find(|&q| old.phases[q].material == material)
                        .map(|q| (&from.history[q], half))
                });
                if let [Some(a), Some(b)] = past {
                    into.history[p].carry([a, b]);
                }
            }
        }
    }

    /// The new pairs. For both wedges of each: the old pair, and the index of the wedge in it.
    fn pairs(
        &self,
        old: &Model,
        new: &Model,
    ) -> impl Iterator<Item = (usize, [(usize, usize); 2])> {
        let [n_new, n_old] = [new, old].map(Model::n_groups);
        (0..new.body.n_levels - 1).flat_map(move |interval| {
            self.wedges.iter().enumerate().map(move |(g, places)| {
                let place = |(group, half): (u32, u8)| {
                    (interval * n_old + group as usize, usize::from(half))
                };
                (interval * n_new + g, places.map(place))
            })
        })
    }
}
