//! Placing of levels on the columns, and the repair of prisms that would be turned over.

use super::columns::{Column, Confinement};
use super::core::RigidCore;
use super::depth::Depth;
use super::{GrowthError, LayerSpec, LevelPlaces, Used, place_on_column};
use crate::quality::PrismShape;
use crate::{LayeredBody, Vec3};

/// Prisms with a scaled Jacobian below this are improved as if they were turned over.
const GOOD_ENOUGH: f64 = 0.08;
/// Largest number of rounds of relaxing and shortening. Then growth fails.
const MAX_ROUNDS: usize = 40;
/// Largest number of relaxation sweeps over the nodes of poor prisms in one round.
const MAX_SWEEPS: usize = 25;
/// Factor on the length of a turned-over prism's columns in one round.
const SHORTENING: f64 = 0.94;

/// A column ends on a bone if it ends this close to it, as a share of its length.
const ON_BONE: f64 = 0.01;

/// In the first rounds, the interfaces between layers stay at their depths if there is room for
/// them, and only the columns are shortened. From this round on, they give way at prisms that are
/// still turned over.
const LAST_RESORT: usize = 10;

/// The result of placing the levels.
pub(super) struct Placement {
    /// Factor by which the layers of each column were thinned. `[n_vertices]`
    pub(super) thinning: Vec<f64>,
    /// Whether there is room for the layers on each whole column. `[n_vertices]`
    pub(super) has_room: Vec<bool>,
    /// How much of each column is used. `[n_vertices]`
    pub(super) used: Vec<Used>,
    /// Shapes of the prisms. `[n_prisms]`
    pub(super) shapes: Vec<PrismShape>,
}

/// Computes the body's positions. Levels are placed by depth, then poor prisms are relaxed in
/// rounds: nodes between two layers slide at their depth, nodes on a bone slide on it, and nodes
/// inside a layer move freely. From the second round on, the columns of prisms that are still turned
/// over are shortened a little in each round, and nodes without room for their layers move freely.
pub(super) fn place_levels(
    body: &mut LayeredBody,
    lines: &[Column],
    layers: &[LayerSpec],
    rings: &[Vec<u32>],
    confinement: &Confinement,
    core: Option<&RigidCore>,
    depth: &Depth,
) -> Result<Placement, GrowthError> {
    let n = body.n_vertices();
    let mut surroundings = Surroundings::new(body, rings, confinement, core, depth);
    let whole = Used {
        share: 1.0,
        n_kept: layers.len(),
    };
    let mut placement = Placement {
        thinning: vec![1.0; n],
        has_room: vec![true; n],
        used: vec![whole; n],
        shapes: Vec::new(),
    };
    let mut places = LevelPlaces::default();
    let mut stale: Vec<usize> = (0..n).collect();
    for round in 0..MAX_ROUNDS {
        for &v in &stale {
            let used = placement.used[v];
            place_on_column(
                layers,
                body.skin.points[v],
                &lines[v],
                used,
                depth,
                &mut places,
            );
            for (l, &s) in places.arcs.iter().enumerate() {
                let node = body.node(v, l);
                body.positions[node] = lines[v].at(s);
            }
            placement.thinning[v] = places.thinning;
            placement.has_room[v] = places.has_room;
            if round > 0 && !places.has_room {
                surroundings.is_released[v] = true;
            }
            surroundings.hold(v, body, layers, &places);
        }
        surroundings.relax(body);
        placement.shapes = body_shapes(body);
        let turned_over = vertices_of(body, &placement.shapes, |s| !s.is_valid());
        if turned_over.is_empty() {
            return Ok(placement);
        }
        if round + 1 >= LAST_RESORT {
            for &v in &turned_over {
                surroundings.release(v, body);
            }
        }
        keep_above(body, &placement.shapes, &mut placement.used);
        stale = shorten(&turned_over, rings, &mut placement.used);
    }
    Err(tangled(body, &placement.shapes))
}

/// Lets shortened columns keep the layers above the first prism that is turned over.
fn keep_above(body: &LayeredBody, shapes: &[PrismShape], used: &mut [Used]) {
    for (triangle, column) in body
        .skin
        .triangles
        .iter()
        .zip(shapes.chunks(body.n_levels - 1))
    {
        let Some(first) = column.iter().position(|s| !s.is_valid()) else {
            continue;
        };
        for &v in triangle {
            let n_kept = &mut used[v as usize].n_kept;
            *n_kept = (*n_kept).min(body.interval_layer[first]);
        }
    }
}

/// Shortens the columns of `turned_over`, and the columns next to them less, so that there is no
/// step between neighbours. Returns all columns whose use changed.
fn shorten(turned_over: &[usize], rings: &[Vec<u32>], used: &mut [Used]) -> Vec<usize> {
    let mut changed = turned_over.to_vec();
    for &v in turned_over {
        used[v].share *= SHORTENING;
    }
    for &v in turned_over {
        for &u in &rings[v] {
            let limit = 0.5 * (1.0 + used[v].share);
            let n_kept = used[v].n_kept;
            let neighbour = &mut used[u as usize];
            if neighbour.share > limit {
                neighbour.share = limit;
                neighbour.n_kept = neighbour.n_kept.min(n_kept);
                changed.push(u as usize);
            }
        }
    }
    changed.sort_unstable();
    changed.dedup();
    changed
}

fn body_shapes(body: &LayeredBody) -> Vec<PrismShape> {
    crate::quality::prism_shapes(body, &body.positions)
}

/// Vertices of the prisms for which `is_in` is true, ascending.
fn vertices_of(
    body: &LayeredBody,
    shapes: &[PrismShape],
    is_in: impl Fn(&PrismShape) -> bool,
) -> Vec<usize> {
    let mut marked = vec![false; body.n_vertices()];
    for (triangle, column) in body
        .skin
        .triangles
        .iter()
        .zip(shapes.chunks(body.n_levels - 1))
    {
        if column.iter().any(&is_in) {
            for &v in triangle {
                marked[v as usize] = true;
            }
        }
    }
    (0..marked.len()).filter(|&v| marked[v]).collect()
}

/// Where a node may go.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Hold {
    /// Anywhere outside the bones.
    Free,
    /// Between two layers: it slides at this depth. m
    AtDepth(f64),
    /// On a bone, or this far from it: it slides along the bone. m
    OffBone(f64),
}

/// The surroundings of a node, needed to move it.
struct Surroundings<'a> {
    triangles_at: Vec<Vec<u32>>,
    rings: &'a [Vec<u32>],
    confinement: &'a Confinement,
    core: Option<&'a RigidCore>,
    depth: &'a Depth,
    /// Where each node may go. `[n_nodes]`
    holds: Vec<Hold>,
    /// Columns whose nodes are not held. `[n_vertices]`
    is_released: Vec<bool>,
}

impl<'a> Surroundings<'a> {
    fn new(
        body: &LayeredBody,
        rings: &'a [Vec<u32>],
        confinement: &'a Confinement,
        core: Option<&'a RigidCore>,
        depth: &'a Depth,
    ) -> Self {
        let mut triangles_at = vec![Vec::new(); body.n_vertices()];
        for (t, triangle) in body.skin.triangles.iter().enumerate() {
            for &v in triangle {
                triangles_at[v as usize].push(t as u32);
            }
        }
        Self {
            triangles_at,
            rings,
            confinement,
            core,
            depth,
            holds: vec![Hold::Free; body.n_nodes()],
            is_released: vec![false; body.n_vertices()],
        }
    }

    /// Notes where the nodes of a column may go once they are placed.
    fn hold(&mut self, v: usize, body: &LayeredBody, layers: &[LayerSpec], places: &LevelPlaces) {
        let mut level = 0;
        for (layer, depth) in layers.iter().zip(&places.depths) {
            level += layer.n_levels;
            let node = body.node(v, level);
            self.holds[node] = match (depth, self.core) {
                _ if self.is_released[v] => Hold::Free,
                (Some(depth), _) => Hold::AtDepth(*depth),
                (None, Some(core)) if body.is_base(node) => {
                    let off_bone = core.bone_distance(body.positions[node]);
                    let length = places.arcs[places.arcs.len() - 1];
                    if (0.0..ON_BONE * length).contains(&off_bone) {
                        Hold::OffBone(off_bone)
                    } else {
                        Hold::Free
                    }
                }
                _ => Hold::Free,
            };
        }
    }

    /// Lets the nodes of a column and of the columns next to it move freely.
    fn release(&mut self, v: usize, body: &LayeredBody) {
        let rings = self.rings;
        for u in rings[v].iter().map(|&u| u as usize).chain([v]) {
            self.is_released[u] = true;
            self.holds[body.node(u, 0)..=body.node(u, body.n_levels - 1)].fill(Hold::Free);
        }
    }

    /// The place nearest to `to` where the node of vertex `v` may go from `from`, if there is one.
    fn allowed(&self, v: usize, node: usize, from: Vec3, to: Vec3) -> Option<Vec3> {
        let at = from + self.confinement.project(v, to - from);
        match (self.holds[node], self.core) {
            (Hold::AtDepth(depth), _) => self.depth.corrected(at, v, depth, self.confinement),
            (Hold::OffBone(gap), Some(core)) => {
                let at = core.at_bone_distance(at, gap);
                Some(from + self.confinement.project(v, at - from))
            }
            (_, Some(core)) => {
                Some(from + self.confinement.project(v, core.outside_bones(at) - from))
            }
            (_, None) => Some(at),
        }
    }

    /// Moves the nodes of poor prisms, one by one, if that improves the worst prism around the
    /// node; no move makes it worse. Skin nodes do not move. Nodes stay out of the bones, and nodes
    /// of flat cut faces stay in them.
    ///
    /// Nodes between two layers move only where it is not enough to move the others. On a coarse
    /// skin, a node that slides from below a vertex to below a flat triangle keeps its distance
    /// from the mesh, but not from the smooth skin that the mesh stands for.
    fn relax(&self, body: &mut LayeredBody) {
        for slides in [false, true] {
            self.sweep(body, |node| {
                slides || !matches!(self.holds[node], Hold::AtDepth(_))
            });
        }
    }

    /// Moves the nodes of poor prisms that `may_move`, until none improves.
    fn sweep(&self, body: &mut LayeredBody, may_move: impl Fn(usize) -> bool) {
        let mut columns = vertices_of(body, &body_shapes(body), |s| {
            s.scaled_jacobian < GOOD_ENOUGH || !s.is_valid()
        });
        for _ in 0..MAX_SWEEPS {
            let mut improved = Vec::new();
            for &v in &columns {
                // From below, because columns crowd towards the bone.
                for l in (1..body.n_levels).rev() {
                    if may_move(body.node(v, l)) && self.improve_node(body, v, l) {
                        improved.push(v);
                    }
                }
            }
            improved.dedup();
            if improved.is_empty() {
                return;
            }
            columns = improved;
        }
    }

    /// Tries the mean of the node's neighbours, then small steps along the axes. Returns whether
    /// the node moved.
    fn improve_node(&self, body: &mut LayeredBody, v: usize, l: usize) -> bool {
        let before = self.worst_around(body, v, l, f64::NEG_INFINITY);
        if before >= GOOD_ENOUGH {
            return false;
        }
        let node = body.node(v, l);
        let start = body.positions[node];
        let ring = &self.rings[v];
        let same_level = |u: &u32| body.positions[body.node(*u as usize, l)];
        let mean = ring.iter().map(same_level).sum::<Vec3>() / ring.len().max(1) as f64;
        let reach = ring
            .iter()
            .map(|u| (same_level(u) - start).norm())
            .sum::<f64>()
            / ring.len().max(1) as f64;
        let mut candidates = vec![start.lerp(&mean, 0.5), start.lerp(&mean, 0.2)];
        if l + 1 < body.n_levels {
            candidates.push((body.positions[node - 1] + body.positions[node + 1]) * 0.5);
        }
        for step in [0.3, 0.1, 0.03] {
            for axis in [Vec3::x(), Vec3::y(), Vec3::z()] {
                candidates.extend([start + axis * (step * reach), start - axis * (step * reach)]);
            }
        }
        let (mut best, mut best_worth) = (start, before);
        for candidate in candidates {
            let Some(at) = self.allowed(v, node, start, candidate) else {
                continue;
            };
            body.positions[node] = at;
            let worth = self.worst_around(body, v, l, best_worth);
            if worth > best_worth {
                (best, best_worth) = (at, worth);
            }
        }
        body.positions[node] = best;
        best_worth > before + 1e-6
    }

    /// The worst scaled Jacobian of the prisms at node (v, l). At most 0 if one of them is invalid
    /// inside. The search ends at the first prism that is no better than `enough`.
    fn worst_around(&self, body: &LayeredBody, v: usize, l: usize, enough: f64) -> f64 {
        let intervals = l.saturating_sub(1)..(l + 1).min(body.n_levels - 1);
        let mut worst = f64::INFINITY;
        for &t in &self.triangles_at[v] {
            for i in intervals.clone() {
                let shape = PrismShape::of(&body.prism(t as usize, i).map(|n| body.positions[n]));
                let worth = if shape.is_valid() {
                    shape.scaled_jacobian
                } else {
                    shape.scaled_jacobian.min(0.0)
                };
                worst = worst.min(worth);
                if worst <= enough {
                    return worst;
                }
            }
        }
        worst
    }
}

/// The error that says how many prisms are invalid, and where the worst one is.
fn tangled(body: &LayeredBody, shapes: &[PrismShape]) -> GrowthError {
    let invalid = || shapes.iter().enumerate().filter(|(_, s)| !s.is_valid());
    let worst = invalid()
        .min_by(|a, b| a.1.scaled_jacobian.total_cmp(&b.1.scaled_jacobian))
        .map_or(0, |(prism, _)| prism);
    let n_intervals = body.n_levels - 1;
    let vertex = body.skin.triangles[worst / n_intervals][0];
    GrowthError::Tangled {
        n_bad: invalid().count(),
        n_prisms: shapes.len(),
        layer: body.layer_names[body.interval_layer[worst % n_intervals]].clone(),
        vertex,
        at: body.skin.points[vertex as usize].into(),
    }
}
