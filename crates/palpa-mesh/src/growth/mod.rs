//! Growth of a skin surface inward into a layered body (method, eq. 3.1, on real shapes).
//!
//! 1. Flat caps of a closed limb are found and removed. Their rims become cut faces.
//!    If asked, the skin that remains is coarsened where it is finer than wanted.
//! 2. Every skin vertex gets a *column*: a line inward that starts along the smoothed normal and
//!    turns into the field of the rigid core (bones). Without bones it is straight.
//! 3. Levels are placed on the columns. The lower side of a layer lies at the asked depth, which is
//!    the distance to the nearest point of the skin. If there is too little room, all layers are
//!    thinned in proportion.
//! 4. Every prism is checked. Near prisms that are turned over or flat, nodes are moved: inside a
//!    layer freely, between two layers only at their depth. If that is not enough, columns are
//!    shortened; the core then stands off the bone there. The interface between two layers gives way
//!    last. If nothing helps, growth returns an error with the place.
//!
//! The [`GrowthReport`] says how much was thinned and shortened, where a layer gave way, and how far
//! the core stands off the bones.

mod columns;
mod core;
mod cut;
mod depth;
mod report;
mod thickness;
mod untangle;

use rayon::prelude::*;
use thiserror::Error;

pub use report::{GrowthReport, LayerReport, Moved, Spread, Worst};
pub use thickness::{ScatteredThickness, Thickness};

use crate::{Coarsening, LayeredBody, Surface, SurfaceIndex, Vec3};
use columns::{Column, Confinement};
use core::RigidCore;
use depth::{Depth, Place};

/// Least share of the thickness above it that a layer down to the bone asks for. If there is less
/// room, all layers are thinned in proportion. Without this share, the last layer would be squeezed
/// to nothing before the others become thinner.
const LEAST_FILL_SHARE: f64 = 0.2;

/// Least share of their thickness that the lower layers of a shortened column keep before the layers
/// above them give way too.
const LEAST_SHORTENED: f64 = 0.25;

/// A skin that coarsening would rid of a smaller share of its vertices stays as it is given.
const LEAST_COARSENED: f64 = 0.1;

/// Largest number of nodes. The bars and factors of a larger body would not fit into memory.
pub const MAX_NODES: usize = 2_000_000;

/// Specification of one layer.
#[derive(Debug, Clone)]
pub struct LayerSpec {
    /// Name, for messages and reports.
    pub name: String,
    /// Thickness below the skin, or `None` for a layer that reaches down to the bones (only the
    /// last layer can).
    pub thickness: Option<Thickness>,
    /// Number of prisms through the layer's thickness, at least 1.
    pub n_levels: usize,
    /// Least thickness of the layer where there is too little room, in metres; positive.
    pub min_thickness: f64,
}

/// Parameters of the growth of a surface.
#[derive(Debug, Clone)]
pub struct GrowthParams {
    /// Layers from the skin down; at least one.
    pub layers: Vec<LayerSpec>,
    /// Keep only the part within this distance of a point: `(centre, radius)`, in metres.
    pub cut_out: Option<(Vec3, f64)>,
    /// How the skin is coarsened before it is grown; `None` keeps all its vertices.
    pub coarsening: Option<Coarsening>,
    /// Largest number of nodes. A larger body is refused before it is grown. At most [`MAX_NODES`].
    pub max_nodes: usize,
}

/// A grown body, with a report for the user.
#[derive(Debug, Clone)]
pub struct Growth {
    /// The layered body.
    pub body: LayeredBody,
    /// Figures about the body, for people and programs.
    pub report: GrowthReport,
    /// Factor of the layer that was thinned most on each column, for want of room or to keep prisms
    /// valid (1: not at all). `[n_vertices]`
    pub thinning: Vec<f64>,
    /// Distance from the end of each column to the nearest bone, in metres, negative inside it.
    /// Empty if there are no bones. `[n_vertices]`
    pub stand_off: Vec<f64>,
    /// How the skin was coarsened; `None` if all its vertices were kept.
    pub coarsened: Option<CoarsenReport>,
}

/// How a skin was coarsened.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoarsenReport {
    /// Number of vertices before, without those of flat caps and outside a cut-out.
    pub n_given: usize,
    /// Number of vertices afterwards.
    pub n_vertices: usize,
    /// Largest distance of the skin from the given one, m.
    pub deviation: f64,
}

/// Reason why a body could not be grown.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum GrowthError {
    /// The surface has no triangles.
    #[error("{what} has no triangles; give a skin surface with faces")]
    Empty {
        /// The surface without triangles.
        what: String,
    },
    /// The surface is not suitable for growth.
    #[error("the skin cannot be grown: {reason}; run `palpa check` on it and repair it first")]
    BadSurface {
        /// The defect and its place.
        reason: String,
    },
    /// An invalid layer specification.
    #[error("layer \"{name}\": {reason}")]
    BadLayer {
        /// Name of the layer.
        name: String,
        /// What is wrong with the layer, and what to do.
        reason: String,
    },
    /// A bone comes out through the skin.
    #[error(
        "bone {bone} comes {:.2} mm out of the skin at ({:.1}, {:.1}, {:.1}) mm; check that skin and bones use the \
         same frame and unit, or move the bone inside",
        depth * 1e3, at[0] * 1e3, at[1] * 1e3, at[2] * 1e3
    )]
    BoneOutside {
        /// Index of the bone in the list of bones.
        bone: usize,
        /// Distance that the bone reaches outside. m
        depth: f64,
        /// Position of that point. m
        at: [f64; 3],
    },
    /// A bone lies completely outside the skin's box.
    #[error(
        "bone {bone} is nowhere inside the skin: it reaches from ({}) to ({}) mm, the skin from ({}) to ({}) mm; check \
         that both use the same frame and unit",
        millimetres(bone_box[0]), millimetres(bone_box[1]), millimetres(skin_box[0]), millimetres(skin_box[1])
    )]
    BoneApart {
        /// Index of the bone in the list of bones.
        bone: usize,
        /// Smallest and largest coordinates of the bone. m
        bone_box: [[f64; 3]; 2],
        /// Smallest and largest coordinates of the skin. m
        skin_box: [[f64; 3]; 2],
    },
    /// The layers are thicker than the room in the whole body.
    #[error(
        "the layers are thicker than the body: they ask for {:.2} mm, and the most room below any skin point is \
         {:.2} mm; make the layers thinner, or check the unit of the \
         surface and where the bones lie",
        asked * 1e3, room * 1e3
    )]
    NoRoom {
        /// Sum of the layers' thicknesses at the place with the most room. m
        asked: f64,
        /// The largest room below a skin point. m
        room: f64,
    },
    /// The body would have too many nodes.
    #[error(
        "{n_vertices} skin vertices with {n_levels} levels are {} nodes, more than the {max_nodes} that are handled; \
         take a coarser skin, fewer levels, or cut out a part with cutout_radius", n_vertices * n_levels
    )]
    TooLarge {
        /// Number of skin vertices.
        n_vertices: usize,
        /// Number of nodes per column.
        n_levels: usize,
        /// The largest number of nodes.
        max_nodes: usize,
    },
    /// No part of the skin lies in the cut-out.
    #[error("no skin triangle lies whole within {:.1} mm of the cut-out's centre; choose a larger cutout_radius", radius * 1e3)]
    EmptyCutOut {
        /// Radius of the cut-out. m
        radius: f64,
    },
    /// Some prisms stayed turned over after all rounds.
    #[error(
        "{n_bad} of {n_prisms} prisms cannot be given a positive volume; the worst is in layer \"{layer}\" under \
         skin vertex {vertex} at ({:.1}, {:.1}, {:.1}) mm; smooth or remesh the skin there, or use thinner layers",
        at[0] * 1e3, at[1] * 1e3, at[2] * 1e3
    )]
    Tangled {
        /// Number of invalid prisms.
        n_bad: usize,
        /// Number of all prisms.
        n_prisms: usize,
        /// Layer of the worst prism.
        layer: String,
        /// A skin vertex of the worst prism.
        vertex: u32,
        /// Position of that vertex. m
        at: [f64; 3],
    },
}

fn millimetres([x, y, z]: [f64; 3]) -> String {
    format!("{:.1}, {:.1}, {:.1}", x * 1e3, y * 1e3, z * 1e3)
}

/// Grows `surface` inward, down to `bones` where a layer asks for it.
///
/// `surface` must be oriented outward and edge-manifold. The cost is about
/// `n_vertices × (steps of a column ≈ 30) × (sources of the core's field ≈ 1000)`, and about ten
/// distances to the skin for each column: a few seconds for 10,000 vertices.
///
/// # Errors
/// [`GrowthError`], with the place of the problem.
pub fn grow(
    surface: &Surface,
    bones: &[Surface],
    params: &GrowthParams,
) -> Result<Growth, GrowthError> {
    check_layers(&params.layers, bones)?;
    check_surface(surface, "the skin")?;
    for (i, bone) in bones.iter().enumerate() {
        check_points(bone, &format!("bone {i}"))?;
    }

    let (mut skin, n_caps) = without_caps(surface);
    let reaches_bone = params.layers.last().is_some_and(|l| l.thickness.is_none());
    if reaches_bone {
        core::check_inside(bones, &skin)?;
    }
    if let Some((centre, radius)) = params.cut_out {
        skin = cut::cut_out(&skin, centre, radius);
        if skin.triangles.is_empty() {
            return Err(GrowthError::EmptyCutOut { radius });
        }
    }
    check_thickness(&skin, &params.layers)?;
    let coarsened = match &params.coarsening {
        Some(coarsening) => coarsened(&mut skin, bones, params, coarsening),
        None => None,
    };
    let n_levels = 1 + params.layers.iter().map(|l| l.n_levels).sum::<usize>();
    let max_nodes = params.max_nodes.min(MAX_NODES);
    if skin.points.len().saturating_mul(n_levels) > max_nodes {
        return Err(GrowthError::TooLarge {
            n_vertices: skin.points.len(),
            n_levels,
            max_nodes,
        });
    }
    let cuts = cut::find_cut_faces(&skin);
    let size = extent(&skin);

    let rings = columns::one_rings(&skin);
    let confinement = Confinement::new(skin.points.len(), &cuts);
    let fixed_depth = |v: usize| fixed_thickness(&params.layers, skin.points[v]);
    let mean_depth =
        (0..skin.points.len()).map(fixed_depth).sum::<f64>() / skin.points.len() as f64;
    let smoothing = if reaches_bone {
        2.0 * mean_depth.max(0.02 * size)
    } else {
        mean_depth
    };
    let directions = columns::inward_directions(&skin, &rings, &confinement, smoothing);

    let depth = Depth::below(&skin);
    let (lines, core): (Vec<Column>, Option<RigidCore>) = if reaches_bone {
        let core = RigidCore::build(bones, &cuts);
        let lines = (0..skin.points.len())
            .into_par_iter()
            .map(|v| columns::column_to_core(v, skin.points[v], directions[v], &core, &confinement))
            .collect();
        (lines, Some(core))
    } else {
        (
            columns::straight_columns(&skin, &directions, fixed_depth, &depth),
            None,
        )
    };
    check_room(&skin, &params.layers, &lines, &depth)?;

    let mut body = LayeredBody {
        positions: vec![Vec3::zeros(); skin.points.len() * n_levels],
        skin,
        n_levels,
        interval_layer: params
            .layers
            .iter()
            .enumerate()
            .flat_map(|(i, l)| vec![i; l.n_levels])
            .collect(),
        layer_names: params.layers.iter().map(|l| l.name.clone()).collect(),
        cut_faces: cuts,
    };
    let outcome = untangle::place_levels(
        &mut body,
        &lines,
        &params.layers,
        &rings,
        &confinement,
        core.as_ref(),
        &depth,
    )?;
    let mut growth = report::finish(body, &params.layers, outcome, core.as_ref(), &depth, n_caps);
    growth.coarsened = coarsened;
    Ok(growth)
}

/// The part of a surface from which columns grow if it is not coarsened: without flat caps, and
/// within the cut-out, `(centre, radius)`, m.
pub fn grown_part(surface: &Surface, cut_out: Option<(Vec3, f64)>) -> Surface {
    let (skin, _) = without_caps(surface);
    match cut_out {
        Some((centre, radius)) => cut::cut_out(&skin, centre, radius),
        None => skin,
    }
}

/// The surface without its flat caps, and their number.
fn without_caps(surface: &Surface) -> (Surface, usize) {
    let caps = cut::find_caps(surface);
    let mut is_cap = vec![false; surface.triangles.len()];
    for &t in caps.iter().flatten() {
        is_cap[t as usize] = true;
    }
    (cut::without_triangles(surface, |t| is_cap[t]), caps.len())
}

/// Coarsens the skin if that saves enough.
fn coarsened(
    skin: &mut Surface,
    bones: &[Surface],
    params: &GrowthParams,
    coarsening: &Coarsening,
) -> Option<CoarsenReport> {
    let layers = &params.layers;
    let reaches_bone = layers.last().is_some_and(|l| l.thickness.is_none());
    let bones = if reaches_bone { bones } else { &[] };
    let bones: Vec<SurfaceIndex> = bones.iter().map(SurfaceIndex::build).collect();
    let thickness = |p: Vec3| {
        let far = |bone: &SurfaceIndex| Some((bone.closest(p)?.point - p).norm());
        let to_bone = bones.iter().filter_map(far);
        let layered = if reaches_bone {
            f64::INFINITY
        } else {
            fixed_thickness(layers, p)
        };
        to_bone.fold(layered, f64::min)
    };
    let coarse = coarsening.apply(skin, thickness);
    let report = CoarsenReport {
        n_given: skin.points.len(),
        n_vertices: coarse.surface.points.len(),
        deviation: coarse.deviation,
    };
    let is_worth_it = report.n_vertices as f64 <= (1.0 - LEAST_COARSENED) * report.n_given as f64;
    is_worth_it.then(|| {
        *skin = coarse.surface;
        report
    })
}

/// Sum of the thicknesses that the layers of given thickness ask for below a skin point. m
fn fixed_thickness(layers: &[LayerSpec], skin_point: Vec3) -> f64 {
    layers
        .iter()
        .filter_map(|l| l.thickness.as_ref())
        .map(|t| t.at(skin_point))
        .sum()
}

/// Least thickness that a layer down to the bone asks for. `fixed` is the thickness of the layers
/// above it. m
fn least_fill(layer: &LayerSpec, fixed: f64) -> f64 {
    layer.min_thickness.max(LEAST_FILL_SHARE * fixed)
}

/// How much of a column is used.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Used {
    /// Share of its length, 1 unless it was shortened.
    share: f64,
    /// Number of layers, from the skin down, that a shortened column keeps as thick as they were.
    n_kept: usize,
}

/// How the levels of one column are placed.
#[derive(Debug, Default)]
struct LevelPlaces {
    /// Arc length of each level. m
    arcs: Vec<f64>,
    /// Depth of the lower side of each layer, or `None` if it depends on the bone or there is no
    /// room for it. m
    depths: Vec<Option<f64>>,
    /// Factor of the layer that was thinned most.
    thinning: f64,
    /// Whether there is room for the layers on the whole column.
    has_room: bool,
}

/// Places the levels of a column below `skin_point`.
///
/// The lower side of a layer of given thickness is where the column reaches the sum of the
/// thicknesses down to it as *depth*, the distance to the nearest point of the skin. The levels in a
/// layer divide the column between its two sides evenly.
fn place_on_column(
    layers: &[LayerSpec],
    skin_point: Vec3,
    line: &Column,
    used: Used,
    depth: &Depth,
    places: &mut LevelPlaces,
) {
    let asked: Vec<Option<f64>> = layers
        .iter()
        .map(|l| l.thickness.as_ref().map(|t| t.at(skin_point)))
        .collect();
    let fixed: f64 = asked.iter().flatten().sum();
    let nominal: Vec<f64> = layers
        .iter()
        .zip(&asked)
        .map(|(l, d)| d.unwrap_or_else(|| least_fill(l, fixed)))
        .collect();
    let floors: Vec<f64> = layers
        .iter()
        .zip(&nominal)
        .map(|(l, d)| l.min_thickness.min(*d))
        .collect();
    let room = |wanted: &[f64], end: f64| {
        depth
            .reach(line, Place::SKIN, wanted.iter().sum(), end)
            .err()
            .map(|deepest| deepest.depth)
    };
    let mut thickness = match room(&nominal, line.length()) {
        None => nominal.clone(),
        Some(room) => thinned(&nominal, &floors, room),
    };
    places.has_room = (thickness.iter().zip(&nominal)).all(|(d, n)| *d >= n * (1.0 - 1e-9));
    let end = line.length() * used.share;
    if used.share < 1.0
        && let Some(room) = room(&thickness, end)
    {
        thickness = shortened(&thickness, &floors, used.n_kept, room);
    }
    places.thinning = thickness
        .iter()
        .zip(&nominal)
        .map(|(d, n)| d / n)
        .fold(1.0, f64::min);
    places.arcs.clear();
    places.arcs.push(0.0);
    places.depths.clear();
    let mut above = Place::SKIN;
    let mut sum = 0.0;
    for ((layer, d), asked) in layers.iter().zip(&thickness).zip(&asked) {
        sum += d;
        let (below, held) = if asked.is_none() {
            // Down to the bone, or on into it if the minima do not fit.
            (above.arc + (end - above.arc).max(*d), None)
        } else {
            let reached = depth.reach(line, above, sum, end);
            above.depth = sum;
            match reached {
                Ok(place) => (place.arc, Some(sum)),
                Err(deepest) => (deepest.arc + (sum - deepest.depth), None),
            }
        };
        for i in 1..=layer.n_levels {
            let share = i as f64 / layer.n_levels as f64;
            places.arcs.push(above.arc + (below - above.arc) * share);
        }
        places.depths.push(held);
        above.arc = below;
    }
}

/// Thicknesses that fit into `room`. They are in proportion to `nominal`, but no layer is thinner
/// than its floor. The other layers share the room that the layers at their floors leave. If the
/// floors together exceed the room, every layer gets its floor.
fn thinned(nominal: &[f64], floors: &[f64], room: f64) -> Vec<f64> {
    let mut is_at_floor = vec![false; nominal.len()];
    loop {
        let kept: f64 = (0..nominal.len())
            .filter(|&i| is_at_floor[i])
            .map(|i| floors[i])
            .sum();
        let asked: f64 = (0..nominal.len())
            .filter(|&i| !is_at_floor[i])
            .map(|i| nominal[i])
            .sum();
        let factor = if asked > 0.0 {
            ((room - kept) / asked).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let thickness = |i: usize| {
            if is_at_floor[i] {
                floors[i]
            } else {
                nominal[i] * factor
            }
        };
        let Some(below) = (0..nominal.len()).find(|&i| thickness(i) < floors[i]) else {
            return (0..nominal.len()).map(thickness).collect();
        };
        is_at_floor[below] = true;
    }
}

/// Thicknesses that fit into the `room` of a shortened column. The first `n_kept` layers stay as
/// they are, unless the layers below would become thinner than [`LEAST_SHORTENED`] of themselves;
/// then fewer do. The others are thinned in proportion.
fn shortened(thickness: &[f64], floors: &[f64], n_kept: usize, room: f64) -> Vec<f64> {
    let kept = |n: usize| thickness[..n].iter().sum::<f64>();
    let rest = |n: usize| thickness[n..].iter().sum::<f64>();
    let fits = |n: &usize| rest(*n) > 0.0 && room - kept(*n) >= LEAST_SHORTENED * rest(*n);
    let n = (1..=n_kept).rev().find(fits).unwrap_or(0);
    let mut all = thickness[..n].to_vec();
    all.extend(thinned(&thickness[n..], &floors[n..], room - kept(n)));
    all
}

/// Size of a surface, independent of its orientation: twice the largest distance from its mean
/// point. m
fn extent(surface: &Surface) -> f64 {
    let centre = surface.points.iter().sum::<Vec3>() / surface.points.len().max(1) as f64;
    2.0 * surface
        .points
        .iter()
        .map(|p| (p - centre).norm())
        .fold(0.0, f64::max)
}

fn check_layers(layers: &[LayerSpec], bones: &[Surface]) -> Result<(), GrowthError> {
    let bad = |name: &str, reason: &str| {
        Err(GrowthError::BadLayer {
            name: name.to_owned(),
            reason: reason.to_owned(),
        })
    };
    let Some((last, above)) = layers.split_last() else {
        return bad("", "a body needs at least one layer");
    };
    for layer in layers {
        if layer.n_levels == 0 {
            return bad(&layer.name, "has 0 levels; give it at least 1");
        }
        if !(layer.min_thickness > 0.0 && layer.min_thickness.is_finite()) {
            return bad(&layer.name, "its smallest thickness must be positive");
        }
    }
    if let Some(layer) = above.iter().find(|l| l.thickness.is_none()) {
        return bad(
            &layer.name,
            "only the deepest layer can reach down to the bone; give this one a thickness",
        );
    }
    if last.thickness.is_none() && bones.iter().all(|b| b.triangles.is_empty()) {
        return bad(
            &last.name,
            "has no thickness and there is no bone to reach down to; give it a thickness or add bones",
        );
    }
    Ok(())
}

fn check_thickness(skin: &Surface, layers: &[LayerSpec]) -> Result<(), GrowthError> {
    for layer in layers {
        let Some(thickness) = &layer.thickness else {
            continue;
        };
        for (v, &p) in skin.points.iter().enumerate() {
            let d = thickness.at(p);
            if !(d > 0.0 && d.is_finite()) {
                return Err(GrowthError::BadLayer {
                    name: layer.name.clone(),
                    reason: format!(
                        "{:.3} mm thick at skin vertex {v} ({:.1}, {:.1}, {:.1}) mm; a thickness must be positive everywhere",
                        d * 1e3,
                        p.x * 1e3,
                        p.y * 1e3,
                        p.z * 1e3
                    ),
                });
            }
        }
    }
    Ok(())
}

fn check_points(surface: &Surface, what: &str) -> Result<(), GrowthError> {
    if surface.triangles.is_empty() {
        return Err(GrowthError::Empty {
            what: what.to_owned(),
        });
    }
    if let Some(v) = surface
        .points
        .iter()
        .position(|p| !p.iter().all(|x| x.is_finite()))
    {
        return Err(GrowthError::BadSurface {
            reason: format!("vertex {v} of {what} is not finite"),
        });
    }
    Ok(())
}

fn check_surface(surface: &Surface, what: &str) -> Result<(), GrowthError> {
    check_points(surface, what)?;
    let mut directed: Vec<[u32; 2]> = surface
        .triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .collect();
    directed.sort_unstable();
    if let Some(pair) = directed.windows(2).find(|w| w[0] == w[1]) {
        let [a, b] = pair[0];
        let p = surface.points[a as usize];
        return Err(GrowthError::BadSurface {
            reason: format!(
                "the edge from vertex {a} to {b} at ({:.1}, {:.1}, {:.1}) mm belongs to several triangles of the same \
                 direction (mixed winding or more than two faces on an edge)",
                p.x * 1e3,
                p.y * 1e3,
                p.z * 1e3
            ),
        });
    }
    if let Some(t) = (0..surface.triangles.len()).find(|&t| surface.area_vector(t).norm() == 0.0) {
        return Err(GrowthError::BadSurface {
            reason: format!("triangle {t} of {what} has no area"),
        });
    }
    Ok(())
}

/// Returns an error if the layers find no room at any vertex.
fn check_room(
    skin: &Surface,
    layers: &[LayerSpec],
    lines: &[Column],
    depth: &Depth,
) -> Result<(), GrowthError> {
    let asked = |v: usize| -> f64 {
        let fixed = fixed_thickness(layers, skin.points[v]);
        fixed
            + layers
                .iter()
                .filter(|l| l.thickness.is_none())
                .map(|l| least_fill(l, fixed))
                .sum::<f64>()
    };
    let mut best: Option<(f64, f64)> = None;
    for (v, line) in lines.iter().enumerate() {
        let asked = asked(v);
        let room = match depth.reach(line, Place::SKIN, asked, line.length()) {
            Err(deepest) if deepest.depth < 0.999 * asked => deepest.depth,
            _ => return Ok(()),
        };
        if best.is_none_or(|(a, r)| room / asked > r / a) {
            best = Some((asked, room));
        }
    }
    match best {
        Some((asked, room)) => Err(GrowthError::NoRoom { asked, room }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::{shortened, thinned};

    #[test]
    fn layers_thin_in_proportion_down_to_their_floors() {
        let close = |got: Vec<f64>, want: [f64; 3]| {
            assert!(
                got.iter().zip(want).all(|(g, w)| (g - w).abs() < 1e-12),
                "{got:?}, not {want:?}"
            );
        };
        let (nominal, floors) = ([1.5, 4.0, 1.1], [0.3, 0.8, 0.5]);
        close(thinned(&nominal, &floors, 9.0), nominal);
        close(thinned(&nominal, &floors, 3.3), [0.75, 2.0, 0.55]);
        // The last layer stays at its floor. The others share the rest: 1.7 of 5.5.
        close(
            thinned(&nominal, &floors, 2.2),
            [1.5 * 1.7 / 5.5, 4.0 * 1.7 / 5.5, 0.5],
        );
        close(thinned(&nominal, &floors, 1.6), floors);
        close(thinned(&nominal, &floors, 0.1), floors);
    }
    #[test]
    fn a_shortened_column_keeps_its_upper_layers_while_the_lower_ones_can_give_way() {
        let close = |got: Vec<f64>, want: [f64; 3]| {
            assert!(
                got.iter().zip(want).all(|(g, w)| (g - w).abs() < 1e-12),
                "{got:?}, not {want:?}"
            );
        };
        let (asked, floors) = ([1.0, 4.0, 10.0], [0.1; 3]);
        close(shortened(&asked, &floors, 2, 12.0), [1.0, 4.0, 7.0]);
        close(shortened(&asked, &floors, 1, 8.0), [1.0, 2.0, 5.0]);
        // The last layer would become thinner than a quarter of itself, so the fat gives way too.
        close(
            shortened(&asked, &floors, 2, 7.0),
            [1.0, 4.0 * 6.0 / 14.0, 10.0 * 6.0 / 14.0],
        );
        close(shortened(&asked, &floors, 0, 7.5), [0.5, 2.0, 5.0]);
        close(shortened(&asked, &floors, 3, 3.0), [0.2, 0.8, 2.0]);
    }
}
