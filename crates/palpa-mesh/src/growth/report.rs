//! The report on a grown body, for the user.

use serde::Serialize;

use super::core::RigidCore;
use super::depth::Depth;
use super::untangle::Placement;
use super::{Growth, LayerSpec};
use crate::check::self_intersections;
use crate::{LayeredBody, Surface};

/// A layer whose thickness is off by no more than this share of it is as thick as asked.
const KEPT: f64 = 0.01;

/// The place where a figure is worst.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Worst {
    /// The value of the figure there.
    pub value: f64,
    /// Skin vertex above it.
    pub vertex: u32,
    /// Position of that vertex. m
    pub at: [f64; 3],
}

/// Minimum, quantiles and maximum of a figure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// The smallest value.
    pub min: f64,
    /// The value below which 5 % lie.
    pub p05: f64,
    /// The value below which half lie.
    pub median: f64,
    /// The value below which 95 % lie.
    pub p95: f64,
    /// The largest value.
    pub max: f64,
}

impl Spread {
    /// The spread of `values`, or `None` if there are none.
    pub fn of(values: &[f64]) -> Option<Self> {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let last = sorted.len().checked_sub(1)?;
        let at = |q: f64| sorted[(q * last as f64).round() as usize];
        Some(Self {
            min: at(0.0),
            p05: at(0.05),
            median: at(0.5),
            p95: at(0.95),
            max: at(1.0),
        })
    }
}

/// A layer that growth could not keep as thick as asked, although there is room for it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Moved {
    /// Name of the layer.
    pub layer: String,
    /// The thickness that the layer asks for there. m
    pub asked: f64,
    /// Its thickness there. m
    pub thickness: f64,
    /// Skin vertex above the place.
    pub vertex: u32,
    /// Position of that vertex. m
    pub at: [f64; 3],
}

/// The actual thickness of a layer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LayerReport {
    /// Name of the layer.
    pub name: String,
    /// Number of prisms through its thickness.
    pub n_levels: usize,
    /// Thickness over all skin vertices: the difference between the distances of the layer's two
    /// sides from the skin. m
    pub thickness: Spread,
}

/// Figures about a grown body.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GrowthReport {
    /// Number of skin vertices, which is the number of columns.
    pub n_vertices: usize,
    /// Number of nodes per column.
    pub n_levels: usize,
    /// Number of nodes.
    pub n_nodes: usize,
    /// Number of prisms; all are valid.
    pub n_prisms: usize,
    /// Number of flat caps found on a closed limb; nothing grows from them.
    pub n_caps: usize,
    /// Number of cut faces (ends, sides, rims).
    pub n_cut_faces: usize,
    /// Scaled Jacobian of the prisms: 1 is best, above 0 is valid.
    pub scaled_jacobian: Spread,
    /// The worst prism.
    pub worst_prism: Worst,
    /// Thickness of each layer.
    pub layers: Vec<LayerReport>,
    /// Share of the skin's area below which the layers were thinned because there is too little
    /// room for them.
    pub thinned_share: f64,
    /// The strongest thinning of that kind (smallest factor of the thickness), if any.
    pub worst_thinning: Option<Worst>,
    /// The usual thinning of that kind: under half of the area with thinned layers, the layer that
    /// was thinned most keeps at most this factor of its thickness. `None` if there is none.
    pub median_thinning: Option<f64>,
    /// Share of the skin's area below which a layer is more than 1 % thicker or thinner than asked
    /// although there is room for it. There, the interface between two layers gave way to keep
    /// prisms valid.
    pub moved_share: f64,
    /// The layer and place that are furthest off, as a share of the thickness, if any.
    pub worst_moved: Option<Moved>,
    /// Share of the skin's area below which columns were shortened to keep prisms valid.
    pub shortened_share: f64,
    /// Number of pairs of base triangles that pass through each other. Even if all prisms are
    /// valid, the body can overlap itself where columns from two sides pass each other without
    /// meeting a core.
    pub n_base_overlaps: usize,
    /// Distance from the ends of the columns to the nearest bone, negative inside it; `None`
    /// without bones. m
    pub stand_off: Option<Spread>,
    /// The largest stand-off; `None` without bones.
    pub worst_stand_off: Option<Worst>,
}

pub(super) fn finish(
    body: LayeredBody,
    layers: &[LayerSpec],
    placement: Placement,
    core: Option<&RigidCore>,
    depth: &Depth,
    n_caps: usize,
) -> Growth {
    let Placement {
        thinning,
        has_room,
        used,
        shapes,
    } = placement;
    let n_intervals = body.n_levels - 1;
    let scaled_jacobian: Vec<f64> = shapes.iter().map(|s| s.scaled_jacobian).collect();
    let worst_at = |vertex: usize, value: f64| Worst {
        value,
        vertex: vertex as u32,
        at: body.skin.points[vertex].into(),
    };
    let worst_prism = (0..shapes.len())
        .min_by(|&a, &b| scaled_jacobian[a].total_cmp(&scaled_jacobian[b]))
        .unwrap_or(0);
    let worst_prism = worst_at(
        body.skin.triangles[worst_prism / n_intervals][0] as usize,
        scaled_jacobian[worst_prism],
    );

    let base = Surface {
        points: (0..body.n_vertices())
            .map(|v| body.positions[body.node(v, body.n_levels - 1)])
            .collect(),
        triangles: body.skin.triangles.clone(),
    };
    let stand_off: Vec<f64> = core.map_or_else(Vec::new, |core| {
        base.points.iter().map(|p| core.bone_distance(*p)).collect()
    });
    let worst_stand_off = (0..stand_off.len())
        .max_by(|&a, &b| stand_off[a].total_cmp(&stand_off[b]))
        .map(|v| worst_at(v, stand_off[v]));
    let vertex_areas = vertex_areas(&body);
    let total: f64 = vertex_areas.iter().sum();
    let share = |is_in: &dyn Fn(usize) -> bool| {
        (0..body.n_vertices())
            .filter(|&v| is_in(v))
            .map(|v| vertex_areas[v])
            .fold(0.0, |sum, area| sum + area)
            / total
    };
    let depths = interface_depths(&body, layers, depth);
    let moved = moved_layers(&body, layers, &has_room, &depths);
    let worst_moved = moved.iter().flatten().max_by(|a, b| {
        let off = |m: &Moved| (m.thickness / m.asked - 1.0).abs();
        off(a).total_cmp(&off(b))
    });
    let report = GrowthReport {
        n_vertices: body.n_vertices(),
        n_levels: body.n_levels,
        n_nodes: body.n_nodes(),
        n_prisms: body.n_prisms(),
        n_caps,
        n_cut_faces: body.cut_faces.len(),
        scaled_jacobian: Spread::of(&scaled_jacobian).unwrap_or(Spread {
            min: 0.0,
            p05: 0.0,
            median: 0.0,
            p95: 0.0,
            max: 0.0,
        }),
        worst_prism,
        layers: layer_reports(&body, layers, &depths),
        thinned_share: share(&|v| !has_room[v]),
        worst_thinning: (0..body.n_vertices())
            .filter(|&v| !has_room[v])
            .min_by(|&a, &b| thinning[a].total_cmp(&thinning[b]))
            .map(|v| worst_at(v, thinning[v])),
        median_thinning: median_by_area(
            (0..body.n_vertices())
                .filter(|&v| !has_room[v])
                .map(|v| (thinning[v], vertex_areas[v]))
                .collect(),
        ),
        moved_share: share(&|v| moved[v].is_some()),
        worst_moved: worst_moved.cloned(),
        shortened_share: share(&|v| used[v].share < 1.0 - 1e-9),
        n_base_overlaps: self_intersections(&base).pairs.len(),
        stand_off: Spread::of(&stand_off),
        worst_stand_off,
    };
    Growth {
        body,
        report,
        thinning,
        stand_off,
        coarsened: None,
    }
}

/// The value that values on half of the area do not exceed, from `(value, area)`.
fn median_by_area(mut values: Vec<(f64, f64)>) -> Option<f64> {
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * values.iter().map(|(_, area)| area).sum::<f64>();
    let mut sum = 0.0;
    let middle = values.iter().find(|(_, area)| {
        sum += area;
        sum >= half
    });
    middle.map(|(value, _)| *value)
}

/// Distance of the lower side of each layer from the skin. m, `[n_vertices × n_layers]`
fn interface_depths(body: &LayeredBody, layers: &[LayerSpec], depth: &Depth) -> Vec<f64> {
    let mut depths = Vec::with_capacity(body.n_vertices() * layers.len());
    for v in 0..body.n_vertices() {
        let mut level = 0;
        for layer in layers {
            level += layer.n_levels;
            depths.push(depth.at(body.positions[body.node(v, level)]));
        }
    }
    depths
}

/// The thicknesses of a column's layers, from the depths of their lower sides. m
fn thicknesses(depths: &[f64]) -> impl Iterator<Item = f64> + '_ {
    let above = std::iter::once(0.0).chain(depths.iter().copied());
    depths.iter().zip(above).map(|(below, above)| below - above)
}

/// For each column with room for its layers, the layer that is furthest off the asked thickness, if
/// by more than [`KEPT`]. `[n_vertices]`
fn moved_layers(
    body: &LayeredBody,
    layers: &[LayerSpec],
    has_room: &[bool],
    depths: &[f64],
) -> Vec<Option<Moved>> {
    let of_column = |(v, column): (usize, &[f64])| {
        if !has_room[v] {
            return None;
        }
        let at = body.skin.points[v];
        let mut worst: Option<(f64, Moved)> = None;
        for (layer, thickness) in layers.iter().zip(thicknesses(column)) {
            let Some(asked) = layer.thickness.as_ref().map(|t| t.at(at)) else {
                continue;
            };
            let off = (thickness / asked - 1.0).abs();
            if off > worst.as_ref().map_or(KEPT, |w| w.0) {
                let moved = Moved {
                    layer: layer.name.clone(),
                    asked,
                    thickness,
                    vertex: v as u32,
                    at: at.into(),
                };
                worst = Some((off, moved));
            }
        }
        worst.map(|(_, moved)| moved)
    };
    depths
        .chunks(layers.len())
        .enumerate()
        .map(of_column)
        .collect()
}

/// A third of the area of the triangles around each vertex. m²
fn vertex_areas(body: &LayeredBody) -> Vec<f64> {
    let mut areas = vec![0.0; body.n_vertices()];
    for (t, triangle) in body.skin.triangles.iter().enumerate() {
        let third = body.skin.area_vector(t).norm() / 3.0;
        for &v in triangle {
            areas[v as usize] += third;
        }
    }
    areas
}

fn layer_reports(body: &LayeredBody, layers: &[LayerSpec], depths: &[f64]) -> Vec<LayerReport> {
    let mut all = vec![Vec::with_capacity(body.n_vertices()); layers.len()];
    for column in depths.chunks(layers.len()) {
        for (of_layer, thickness) in all.iter_mut().zip(thicknesses(column)) {
            of_layer.push(thickness);
        }
    }
    layers
        .iter()
        .zip(&all)
        .filter_map(|(layer, thickness)| {
            Some(LayerReport {
                name: layer.name.clone(),
                n_levels: layer.n_levels,
                thickness: Spread::of(thickness)?,
            })
        })
        .collect()
}
