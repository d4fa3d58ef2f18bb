//! From a scene to a layered body: surfaces read, made safe, cut and grown.

use std::path::Path;

use anyhow::{Context as _, bail};
use palpa_mesh::generate;
use palpa_mesh::growth::{ScatteredThickness, Thickness as ThicknessField};
use palpa_mesh::{
    Growth, GrowthParams, LayerSpec, RepairOptions, RepairReport, Surface, Vec3, grow,
    read_surface, repair,
};
use palpa_tissue::{Generator, LengthUnit, Scene, Skin, Target, Thickness, read_thickness};

/// A place further from the skin than this share of the body's size is taken for a mistake in frame or unit.
const FAR_FROM_SKIN: f64 = 0.25;

/// A body ready to be pressed.
#[derive(Debug)]
pub struct BuiltBody {
    /// The layered body and what its growth led to.
    pub growth: Growth,
    /// Bone surfaces, in metres.
    pub bones: Vec<Surface>,
    /// What was done to the surfaces on the way and a user should know.
    pub notes: Vec<String>,
}

/// Reads or makes the surfaces of `scene` and grows them into layers.
///
/// # Errors
/// When a file cannot be read or used, or the body cannot be grown.
pub fn build(scene: &Scene) -> anyhow::Result<BuiltBody> {
    let mut notes = Vec::new();
    let (skin, bones) = match &scene.body.skin {
        Skin::File(path) => {
            let unit = scene.body.unit;
            let skin = usable_surface(path, unit, &mut notes)?;
            let bones = scene
                .body
                .bones
                .iter()
                .map(|path| usable_surface(path, unit, &mut notes))
                .collect::<Result<Vec<_>, _>>()?;
            (skin, bones)
        }
        Skin::Generated(generator) => generated(*generator),
    };
    let cut_out = match &scene.body.cutout {
        Some(cutout) => Some((place_on(&skin, &cutout.at)?.1, cutout.radius)),
        None => None,
    };
    let params = GrowthParams {
        layers: layer_specs(scene)?,
        cut_out,
    };
    let growth = grow(&skin, &bones, &params)?;
    if let Some((_, radius)) = cut_out {
        note_margin(scene, &growth, radius, &mut notes);
    }
    Ok(BuiltBody {
        growth,
        bones,
        notes,
    })
}

/// The skin vertex that a target names, and its position. A vertex number counts in `skin`.
///
/// # Errors
/// When the vertex is not there, or the point is far from the skin.
pub fn place_on(skin: &Surface, target: &Target) -> anyhow::Result<(usize, Vec3)> {
    let point = match target {
        Target::Vertex(v) => {
            let n = skin.points.len();
            let Some(p) = skin.points.get(*v as usize) else {
                bail!(
                    "skin vertex {v} is not there: the skin has {n} vertices, numbered from 0 to {}",
                    n - 1
                );
            };
            return Ok((*v as usize, *p));
        }
        Target::Point(p) => Vec3::from(*p),
        Target::Middle => area_centroid(skin),
    };
    let nearest = (0..skin.points.len())
        .min_by(|&a, &b| {
            (skin.points[a] - point)
                .norm()
                .total_cmp(&(skin.points[b] - point).norm())
        })
        .context("the skin has no vertices")?;
    let distance = (skin.points[nearest] - point).norm();
    let (lo, hi) = skin.bounds().unwrap_or_default();
    if matches!(target, Target::Point(_)) && distance > FAR_FROM_SKIN * (hi - lo).norm() {
        bail!(
            "the point ({}) mm is {:.1} mm away from the skin, which reaches from ({}) to ({}) mm; check the point, \
             its unit and its frame",
            in_mm(point),
            distance * 1e3,
            in_mm(lo),
            in_mm(hi),
        );
    }
    Ok((nearest, skin.points[nearest]))
}

/// A point in millimetres, for messages.
pub fn in_mm(p: Vec3) -> String {
    format!("{:.1}, {:.1}, {:.1}", p.x * 1e3, p.y * 1e3, p.z * 1e3)
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

/// Reads a surface and repairs what is safe to repair; refuses what is not fit.
fn usable_surface(
    path: &Path,
    unit: LengthUnit,
    notes: &mut Vec<String>,
) -> anyhow::Result<Surface> {
    let file = read_surface(path)?;
    let name = path
        .file_name()
        .unwrap_or(path.as_os_str())
        .to_string_lossy();
    let mut surface = file.surface;
    if unit != LengthUnit::M {
        surface.points.iter_mut().for_each(|p| *p *= unit.metres());
    }
    notes.extend(file.notes.iter().map(|note| format!("{name}: {note}")));
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
    let (mended, report) = repair(&surface, &RepairOptions::default());
    if report.is_changed() {
        notes.push(format!(
            "{name}: repaired on the way in: {}",
            repairs(&report)
        ));
    }
    Ok(mended)
}

fn repairs(report: &RepairReport) -> String {
    let counts = [
        (report.n_welded, "vertices welded"),
        (report.n_degenerate, "triangles without area dropped"),
        (report.n_duplicate, "double triangles dropped"),
        (report.n_unused, "unused vertices dropped"),
        (report.orientation.n_flipped, "triangles turned outward"),
    ];
    let done: Vec<String> = counts
        .iter()
        .filter(|(n, _)| *n > 0)
        .map(|(n, what)| format!("{n} {what}"))
        .collect();
    done.join(", ")
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
    for layer in &scene.layers {
        let thickness = match &layer.thickness {
            Some(thickness) => Some(thickness_field(thickness, scene.body.unit)?),
            // A block stands on a rigid base: its last layer takes what is left of the depth.
            None => match scene.body.skin {
                Skin::Generated(Generator::Block { size, .. }) => {
                    Some(ThicknessField::Constant(size[2] - above))
                }
                _ => None,
            },
        };
        if let Some(ThicknessField::Constant(d)) = &thickness {
            above += d;
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

/// Says so when a cut-out's rim is so near that it would be felt.
fn note_margin(scene: &Scene, growth: &Growth, radius: f64, notes: &mut Vec<String>) {
    const ENOUGH: f64 = 2.0;
    let tool = match scene.tool {
        palpa_tissue::Tool::Disc { radius } => radius,
        palpa_tissue::Tool::Node => 0.0,
    };
    let depth: f64 = growth
        .report
        .layers
        .iter()
        .map(|l| l.thickness.median)
        .sum();
    let wanted = tool + ENOUGH * depth;
    if radius < wanted {
        notes.push(format!(
            "the cut-out's radius of {:.0} mm is less than the tool's radius plus {ENOUGH:.0} times the tissue's depth \
             ({:.0} mm): the free rim may be felt; choose a larger cutout_radius",
            radius * 1e3,
            wanted * 1e3,
        ));
    }
}
