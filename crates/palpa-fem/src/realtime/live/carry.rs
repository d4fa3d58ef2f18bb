//! Carries displacements, contact forces and memory of a body from one of its meshes to another.

use palpa_mesh::{SurfaceIndex, Vec3};

use super::Live;
use super::candidates::SkinForces;
use crate::batch::History;
use crate::model::Model;
use crate::state::State;

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

/// The state of a body, to continue from on another mesh.
#[derive(Debug, Clone)]
pub(super) struct Come {
    pub(super) state: State,
    pub(super) history: Option<History>,
    pub(super) skin: SkinForces,
}

impl Come {
    /// A body at rest.
    pub(super) fn rest(model: &Model) -> Self {
        Self {
            state: State::new(model),
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

    /// Carries a state on the old mesh over to the new one.
    pub(super) fn onto(&self, old: &Model, come: &Come, new: &Model) -> Come {
        let mut out = Come::rest(new);
        for v in 0..self.parts.len() {
            for l in 0..new.body.n_levels {
                out.state.displacements[new.body.node(v, l)] =
                    self.displacement(v, l, new, &come.state.displacements);
            }
            if let Some(u) = self.same[v] {
                out.skin.pressures[v] = come.skin.pressures[u as usize];
                out.skin.frictions[v] = come.skin.frictions[u as usize];
                out.skin.anchors[v] = come.skin.anchors[u as usize];
            }
        }
        if new.has_memory {
            self.carry_phases(old, &come.state, new, &mut out.state);
            out.history = come.history.as_ref().map(|h| self.history(old, h, new));
        }
        out
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

    /// The old vertex at the place of a new one.
    pub(super) fn same(&self, v: usize) -> Option<usize> {
        self.same[v].map(|u| u as usize)
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
