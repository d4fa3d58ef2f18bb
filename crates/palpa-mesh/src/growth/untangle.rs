//! Placing of levels on the columns, and the repair of prisms that would be turned over.

use super::columns::{Column, Confinement};
use super::core::RigidCore;
use super::{GrowthError, LayerSpec, level_arcs};
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

/// The result of placing the levels.
pub(super) struct Placement {
    /// Factor by which the layers of each column were thinned. `[n_vertices]`
    pub(super) thinning: Vec<f64>,
    /// Share of each column's length that is used (1 unless shortened). `[n_vertices]`
    pub(super) used_share: Vec<f64>,
    /// Shapes of the prisms. `[n_prisms]`
    pub(super) shapes: Vec<PrismShape>,
}

/// Computes the body's positions. Levels are placed by thickness, then poor prisms are relaxed in
/// rounds. From the second round on, the columns of prisms that are still turned over are shortened
/// a little in each round.
pub(super) fn place_levels(
    body: &mut LayeredBody,
    lines: &[Column],
    layers: &[LayerSpec],
    rings: &[Vec<u32>],
    confinement: &Confinement,
    core: Option<&RigidCore>,
) -> Result<Placement, GrowthError> {
    let n = body.n_vertices();
    let surroundings = Surroundings::new(body, rings, confinement, core);
    let mut placement = Placement {
        thinning: vec![1.0; n],
        used_share: vec![1.0; n],
        shapes: Vec::new(),
    };
    let mut stale: Vec<usize> = (0..n).collect();
    for _ in 0..MAX_ROUNDS {
        for &v in &stale {
            place_column(body, lines, layers, v, &mut placement);
        }
        surroundings.relax(body);
        placement.shapes = body_shapes(body);
        let turned_over = vertices_of(body, &placement.shapes, |s| !s.is_valid());
        if turned_over.is_empty() {
            return Ok(placement);
        }
        stale = shorten(&turned_over, rings, &mut placement.used_share);
    }
    Err(tangled(body, &placement.shapes))
}

fn place_column(
    body: &mut LayeredBody,
    lines: &[Column],
    layers: &[LayerSpec],
    v: usize,
    placement: &mut Placement,
) {
    let mut arcs = Vec::with_capacity(body.n_levels);
    let room = lines[v].length() * placement.used_share[v];
    placement.thinning[v] = level_arcs(layers, body.skin.points[v], room, &mut arcs);
    for (l, &s) in arcs.iter().enumerate() {
        let node = body.node(v, l);
        body.positions[node] = lines[v].at(s);
    }
}

/// Shortens the columns of `turned_over`, and the columns next to them less, so that there is no
/// step between neighbours. Returns all columns whose share changed.
fn shorten(turned_over: &[usize], rings: &[Vec<u32>], used_share: &mut [f64]) -> Vec<usize> {
    let mut changed = turned_over.to_vec();
    for &v in turned_over {
        used_share[v] *= SHORTENING;
    }
    for &v in turned_over {
        for &u in &rings[v] {
            let limit = 0.5 * (1.0 + used_share[v]);
            if used_share[u as usize] > limit {
                used_share[u as usize] = limit;
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

/// The surroundings of a node, needed to move it.
struct Surroundings<'a> {
    triangles_at: Vec<Vec<u32>>,
    rings: &'a [Vec<u32>],
    confinement: &'a Confinement,
    core: Option<&'a RigidCore>,
}

impl<'a> Surroundings<'a> {
    fn new(
        body: &LayeredBody,
        rings: &'a [Vec<u32>],
        confinement: &'a Confinement,
        core: Option<&'a RigidCore>,
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
        }
    }

    /// Moves the nodes of poor prisms, one by one, if that improves the worst prism around the
    /// node; no move makes it worse. Skin nodes do not move. Nodes stay out of the bones, and nodes
    /// of flat cut faces stay in them.
    fn relax(&self, body: &mut LayeredBody) {
        let mut columns = vertices_of(body, &body_shapes(body), |s| {
            s.scaled_jacobian < GOOD_ENOUGH || !s.is_valid()
        });
        for _ in 0..MAX_SWEEPS {
            let mut improved = Vec::new();
            for &v in &columns {
                for l in 1..body.n_levels {
                    if self.improve_node(body, v, l) {
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
        let before = self.worst_around(body, v, l);
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
            let mut at = start + self.confinement.project(v, candidate - start);
            if let Some(core) = self.core {
                at = start + self.confinement.project(v, core.outside_bones(at) - start);
            }
            body.positions[node] = at;
            let worth = self.worst_around(body, v, l);
            if worth > best_worth {
                (best, best_worth) = (at, worth);
            }
        }
        body.positions[node] = best;
        best_worth > before + 1e-6
    }

    /// The worst scaled Jacobian of the prisms at node (v, l). At most 0 if one of them is invalid
    /// inside.
    fn worst_around(&self, body: &LayeredBody, v: usize, l: usize) -> f64 {
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
