//! From a scene to a layered body: surfaces are read, repaired, cut and grown.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use palpa_mesh::generate;
use palpa_mesh::growth::{
    GrowthReport, MAX_NODES, ScatteredThickness, Thickness as ThicknessField, grown_part,
};
use palpa_mesh::{
    Growth, GrowthError, GrowthParams, LayerSpec, RepairOptions, Surface, SurfaceIndex, Vec3, grow,
    read_surface, repair,
};
use palpa_scene::{
    Generator, LengthUnit, LumpPlace, Scene, Skin, Target, Thickness, read_thickness,
};

use crate::note::Note;
use crate::press::mesh::coarsening;

/// A place further from the skin than this share of the body's size is refused: its frame or unit
/// is probably wrong.
const FAR_FROM_SKIN: f64 = 0.25;

/// Layers that are thinned under more than this share of the skin's area get a note.
const MOST_OF_THE_SKIN: f64 = 0.5;
/// Unless half of them keep more than this factor of their thickness: the thicknesses of a body are
/// not known to a hundredth.
const ALMOST_AS_ASKED: f64 = 0.99;

/// Sizes of surfaces that need no note, from a fingertip to a person, m.
const USUAL_SIZE: std::ops::Range<f64> = 0.003..4.0;

/// A body ready to be pressed.
#[derive(Debug, Clone)]
pub struct BuiltBody {
    /// The layered body, and the results of its growth.
    pub growth: Growth,
    /// Bone surfaces, in metres.
    pub bones: Vec<Surface>,
    /// The skin vertex of the body that the scene presses on.
    pub press_vertex: usize,
    /// Place on the skin that the scene presses, m: the point nearest to the scene's target. It
    /// need not be a vertex.
    pub press_at: Vec3,
    /// For each lump of the scene, the place on the skin above it, m; `None` if the scene places it
    /// otherwise.
    pub lump_places: Vec<Option<Vec3>>,
    /// Remarks for the user on changes made to the surfaces.
    pub notes: Vec<Note>,
}

/// Where a tool will press a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pressed<'a> {
    /// At the scene's place, and at these distances from it along the scene's motion, m.
    Along(&'a [f64]),
    /// At any place.
    Anywhere,
}

/// Reads or makes the surfaces of `scene` and grows them into layers.
///
/// # Errors
/// When a file cannot be read or used, or the body cannot be grown.
pub fn build(scene: &Scene) -> anyhow::Result<BuiltBody> {
    build_within(scene, MAX_NODES)
}

/// As [`build`], but refuses a body with more than `max_nodes` nodes before it takes time and
/// memory.
///
/// # Errors
/// As [`build`], and when the body has more nodes.
pub fn build_within(scene: &Scene, max_nodes: usize) -> anyhow::Result<BuiltBody> {
    build_for(scene, max_nodes, Pressed::Along(&[]))
}

/// As [`build_within`]. `pressed` says where a skin that is coarsened stays fine.
///
/// # Errors
/// As [`build_within`].
pub fn build_for(
    scene: &Scene,
    max_nodes: usize,
    pressed: Pressed<'_>,
) -> anyhow::Result<BuiltBody> {
    let mut notes = Vec::new();
    let (skin, bones) = surfaces(scene, &mut notes)?;
    // Vertex numbers refer to the surface as it was read, before repairs and cuts. From here on,
    // places are positions.
    let mut press_at = point_of(&skin, &scene.press.target)?;
    let mut lumps_at = scene
        .lumps
        .iter()
        .map(|lump| match &lump.place {
            LumpPlace::Below { target, .. } if *target != scene.press.target => {
                point_of(&skin, target).with_context(|| format!("lump \"{}\"", lump.name))
            }
            _ => Ok(None),
        })
        .collect::<anyhow::Result<Vec<_>>>()?;
    let cut_out = match &scene.body.cutout {
        Some(cutout) => point_of(&skin, &cutout.at)?.map(|centre| (centre, cutout.radius)),
        None => None,
    };
    let skin = match &scene.body.skin {
        Skin::File(path) => mended(&skin, path, &mut notes),
        Skin::Generated(_) => skin,
    };
    let on_skin = |p: Vec3| skin.points.get(nearest(&skin, p)).copied().unwrap_or(p);
    let cut_out = cut_out.map(|(centre, radius)| (on_skin(centre), radius));
    let mut params = GrowthParams {
        layers: layer_specs(scene)?,
        cut_out,
        coarsening: None,
        max_nodes,
    };
    if scene.mesh.coarsen == Some(true) {
        // Places do not depend on the coarse skin.
        let part = grown_part(&skin, cut_out);
        let middle = nearest(&part, area_centroid(&part));
        if let Some(middle) = part.points.get(middle) {
            let at = *press_at.get_or_insert(*middle);
            for at in &mut lumps_at {
                at.get_or_insert(*middle);
            }
            params.coarsening = coarsening(scene, &part, at, pressed);
        }
    }
    let growth =
        grow(&skin, &bones, &params).map_err(|error| with_bone_name(error, &scene.body.bones))?;
    if let Some(coarsened) = growth.coarsened {
        notes.push(Note::SkinCoarsened {
            n_given: coarsened.n_given,
            n_vertices: coarsened.n_vertices,
            deviation: coarsened.deviation,
        });
    }
    let n_overlaps = growth.report.n_base_overlaps;
    if n_overlaps > 0 {
        notes.push(Note::BaseOverlaps {
            n_pairs: n_overlaps,
        });
    }
    notes.extend(layers_thinned(&growth.report));
    if let Some(worst) = &growth.report.worst_moved {
        notes.push(Note::LayersMoved {
            share: growth.report.moved_share,
            layer: worst.layer.clone(),
            asked: worst.asked,
            thickness: worst.thickness,
            at: worst.at,
        });
    }
    let press_vertex = vertex_at(&growth.body.skin, press_at, &scene.press.target)?;
    let on_body = &growth.body.skin;
    let press_at = match (&scene.press.target, press_at) {
        (Target::Point(_), Some(point)) => SurfaceIndex::build(on_body)
            .closest(point)
            .map_or(point, |closest| closest.point),
        _ => on_body.points[press_vertex],
    };
    let lump_places = lump_places(scene, on_body, press_at, &lumps_at);
    if let Some((_, radius)) = cut_out {
        note_margin(scene, &growth, radius, &mut notes);
    }
    Ok(BuiltBody {
        growth,
        bones,
        press_vertex,
        press_at,
        lump_places,
        notes,
    })
}

/// A note if there is too little room for the layers under most of the skin.
fn layers_thinned(report: &GrowthReport) -> Option<Note> {
    let (worst, median) = (report.worst_thinning.as_ref()?, report.median_thinning?);
    let is_much = report.thinned_share > MOST_OF_THE_SKIN && median < ALMOST_AS_ASKED;
    is_much.then_some(Note::LayersThinned {
        share: report.thinned_share,
        median,
        least: worst.value,
        at: worst.at,
    })
}

/// The skin as it was read or generated, and the mended bones, in metres.
fn surfaces(scene: &Scene, notes: &mut Vec<Note>) -> anyhow::Result<(Surface, Vec<Surface>)> {
    let path = match &scene.body.skin {
        Skin::File(path) => path,
        Skin::Generated(generator) => return Ok(generated(*generator)),
    };
    let unit = scene.body.unit;
    let skin = read_in_metres(path, unit, notes)?;
    let bones = (scene.body.bones.iter())
        .map(|path| {
            let bone = read_in_metres(path, unit, notes)?;
            Ok(mended(&bone, path, notes))
        })
        .collect::<anyhow::Result<Vec<_>>>()?;
    Ok((skin, bones))
}

/// For each lump the point of the grown skin that it lies below; `None` for a lump that does not
/// depend on the skin. `lumps_at` has the points that the lumps name themselves.
fn lump_places(
    scene: &Scene,
    skin: &Surface,
    press_at: Vec3,
    lumps_at: &[Option<Vec3>],
) -> Vec<Option<Vec3>> {
    (scene.lumps.iter().zip(lumps_at))
        .map(|(lump, at)| match &lump.place {
            LumpPlace::Below { target, .. } if *target == scene.press.target => Some(press_at),
            LumpPlace::Below { .. } => {
                Some(at.unwrap_or_else(|| skin.points[nearest(skin, area_centroid(skin))]))
            }
            LumpPlace::At(_) | LumpPlace::AsRead => None,
        })
        .collect()
}

/// The point that a target names on the skin as it was read; `None` for the middle of the skin.
fn point_of(skin: &Surface, target: &Target) -> anyhow::Result<Option<Vec3>> {
    match target {
        Target::Vertex(v) => match skin.points.get(*v as usize) {
            Some(p) => Ok(Some(*p)),
            None => bail!(
                "there is no skin vertex {v}: the skin has {} vertices, numbered from 0",
                skin.points.len()
            ),
        },
        Target::Point(p) => {
            let point = Vec3::from(*p);
            check_near(skin, point)?;
            Ok(Some(point))
        }
        Target::Middle => Ok(None),
    }
}

/// The vertex of the body's skin at a place; an error if the place is not on the skin.
fn vertex_at(skin: &Surface, at: Option<Vec3>, target: &Target) -> anyhow::Result<usize> {
    let point = at.unwrap_or_else(|| area_centroid(skin));
    let vertex = nearest(skin, point);
    let distance = (skin.points[vertex] - point).norm();
    let (lo, hi) = skin.bounds().unwrap_or_default();
    let size = (hi - lo).norm();
    match target {
        // Welding moves a vertex by less than this distance.
        Target::Vertex(v) if distance > 1e-5 * size => bail!(
            "skin vertex {v} at ({}) mm is not part of the grown skin: it lies on a flat cut face or outside the \
             cut-out; press another vertex",
            in_mm(point)
        ),
        _ => Ok(vertex),
    }
}

/// Refuses a point that is far from the skin.
fn check_near(skin: &Surface, point: Vec3) -> anyhow::Result<()> {
    let distance = (skin.points[nearest(skin, point)] - point).norm();
    let (lo, hi) = skin.bounds().unwrap_or_default();
    if distance > FAR_FROM_SKIN * (hi - lo).norm() {
        bail!(
            "the point ({}) mm is {:.1} mm away from the skin, which reaches from ({}) to ({}) mm; check the point, \
             its unit and its frame",
            in_mm(point),
            distance * 1e3,
            in_mm(lo),
            in_mm(hi),
        );
    }
    Ok(())
}

/// The error, with the file names of the bones that it mentions.
fn with_bone_name(error: GrowthError, files: &[PathBuf]) -> anyhow::Error {
    let file = match &error {
        GrowthError::BoneOutside { bone, .. } | GrowthError::BoneApart { bone, .. } => {
            files.get(*bone)
        }
        _ => None,
    };
    match file {
        Some(file) => anyhow::Error::new(error).context(file.display().to_string()),
        None => error.into(),
    }
}

pub(crate) fn nearest(skin: &Surface, point: Vec3) -> usize {
    let distance = |v: usize| (skin.points[v] - point).norm_squared();
    (0..skin.points.len())
        .min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
        .unwrap_or(0)
}

/// A point in millimetres, for messages.
pub fn in_mm(p: Vec3) -> String {
    // Adding zero turns -0 into 0.
    let [x, y, z] = [p.x, p.y, p.z].map(|c| (c * 1e4).round() / 10.0 + 0.0);
    format!("{x:.1}, {y:.1}, {z:.1}")
}

fn area_centroid(surface: &Surface) -> Vec3 {
    let (mut sum, mut area) = (Vec3::zeros(), 0.0);
    for t in 0..surface.triangles.len() {
        let [a, b, c] = surface.corners(t);
        let weight = surface.area_vector(t).norm();
        sum += (a + b + c) / 3.0 * weight;
        area += weight;
    }
    if area > 0.0 { sum / area } else { sum }
}

/// Reads a surface. Refuses one with a coordinate that is not a finite number.
pub(crate) fn read_in_metres(
    path: &Path,
    unit: LengthUnit,
    notes: &mut Vec<Note>,
) -> anyhow::Result<Surface> {
    let file = read_surface(path)?;
    notes.extend(file.notes.iter().map(|note| Note::FileRead {
        file: file_name(path),
        note: note.clone(),
    }));
    let surface = match unit {
        LengthUnit::M => file.surface,
        unit => file.surface.scaled(unit.metres()),
    };
    if let Some(v) = surface
        .points
        .iter()
        .position(|p| !p.iter().all(|x| x.is_finite()))
    {
        bail!(
            "{}: vertex {v} has a coordinate that is not finite; see `palpa check`",
            path.display()
        );
    }
    let (lo, hi) = surface.bounds().unwrap_or_default();
    let size = (hi - lo).norm();
    if !USUAL_SIZE.contains(&size) {
        notes.push(Note::UnusualSize {
            file: file_name(path),
            size,
        });
    }
    Ok(surface)
}

/// The surface after all repairs that are safe.
pub(crate) fn mended(surface: &Surface, path: &Path, notes: &mut Vec<Note>) -> Surface {
    let (mended, report) = repair(surface, &RepairOptions::default());
    if report.is_changed() {
        notes.push(Note::Repaired {
            file: file_name(path),
            n_welded: report.n_welded,
            n_degenerate: report.n_degenerate,
            n_duplicate: report.n_duplicate,
            n_unused: report.n_unused,
            n_flipped: report.orientation.n_flipped,
        });
    }
    mended
}

fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}

fn generated(generator: Generator) -> (Surface, Vec<Surface>) {
    match generator {
        Generator::Block {
            size: [x, y, _],
            spacing,
        } => (generate::block_skin([x, y], spacing), Vec::new()),
        Generator::Cylinder {
            length,
            radius,
            bone_radius,
            spacing,
        } => {
            let (skin, bone) = generate::cylinder(length, radius, bone_radius, spacing);
            (skin, vec![bone])
        }
        Generator::Forearm { spacing, scale } => {
            let (skin, bones) = generate::forearm(spacing, scale);
            (skin, bones.into())
        }
    }
}

fn layer_specs(scene: &Scene) -> anyhow::Result<Vec<LayerSpec>> {
    let mut specs = Vec::new();
    let mut above = 0.0;
    let is_block = matches!(scene.body.skin, Skin::Generated(Generator::Block { .. }));
    for layer in &scene.layers {
        let thickness = match &layer.thickness {
            Some(thickness) => Some(thickness_field(thickness, scene.body.unit)?),
            // A block stands on a rigid base: its last layer takes the remaining depth.
            None => match scene.body.skin {
                Skin::Generated(Generator::Block { size, .. }) => {
                    Some(ThicknessField::Constant(size[2] - above))
                }
                _ => None,
            },
        };
        match &thickness {
            Some(ThicknessField::Constant(d)) => above += d,
            // The remaining depth of a block is known only if all layers above have uniform
            // thickness.
            Some(_) if is_block && scene.layers.last().is_some_and(|l| l.thickness.is_none()) => {
                bail!(
                    "layer \"{}\" of a block varies in thickness, so the last layer cannot take the rest of the depth; \
                 give the last layer a thickness",
                    layer.tissue.name
                )
            }
            _ => {}
        }
        specs.push(LayerSpec {
            name: layer.tissue.name.clone(),
            thickness,
            n_levels: layer.levels,
            min_thickness: layer.min_thickness,
        });
    }
    Ok(specs)
}

fn thickness_field(thickness: &Thickness, unit: LengthUnit) -> anyhow::Result<ThicknessField> {
    Ok(match thickness {
        Thickness::Uniform(d) => ThicknessField::Constant(*d),
        Thickness::Along { axis, table } => ThicknessField::AlongAxis {
            axis: Vec3::from(*axis),
            table: table.clone(),
        },
        Thickness::File(path) => {
            let samples: Vec<(Vec3, f64)> = read_thickness(path, unit)?
                .iter()
                .map(|s| (Vec3::from(s.point), s.thickness))
                .collect();
            let field = ScatteredThickness::build(&samples)
                .with_context(|| format!("{}: has no samples", path.display()))?;
            ThicknessField::Scattered(field)
        }
    })
}

/// Adds a note if the rim of a cut-out is near enough to influence the force.
fn note_margin(scene: &Scene, growth: &Growth, radius: f64, notes: &mut Vec<Note>) {
    const ENOUGH: f64 = 2.0;
    let tool = scene.tool.contact_radius();
    let depth: f64 = growth
        .report
        .layers
        .iter()
        .map(|l| l.thickness.median)
        .sum();
    let wanted = tool + ENOUGH * depth;
    if radius < wanted {
        notes.push(Note::CutoutNear {
            radius,
            enough: wanted,
        });
    }
}
