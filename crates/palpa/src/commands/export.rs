//! `palpa export`: a scene as an input deck for CalculiX.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use palpa_mesh::{LayeredBody, Vec3};
use palpa_tissue::units::Length;
use palpa_tissue::{Scene, Tool};
use serde::Serialize;

use super::Outcome;
use crate::build::{BuiltBody, build, in_mm};
use crate::cli::Context;
use crate::continuum;
use crate::export::{Deck, Element, Export, Section};
use crate::press::{column_length, nodes_under_disc};

/// Write a scene as an input deck for CalculiX, to check its forces with another solver
///
/// Without a SCENE, a forearm made by formula is exported. Writes body.inp, in millimetres, newtons and megapascals; run
/// it with `ccx body` in its folder. The forces on the way down are then in body.dat, the deformed body in body.frd.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Scene file (TOML); the embedded forearm if none is given
    scene: Option<PathBuf>,
    /// The element that each prism becomes
    #[arg(long, value_enum, default_value_t)]
    element: Element,
    /// How deep, with its unit: "8 mm"
    #[arg(long)]
    depth: Option<Length>,
    /// Write the nearest that CalculiX knows where it does not know what the scene says
    #[arg(long)]
    approximate: bool,
}

/// What was written.
#[derive(Debug, Serialize)]
struct Report<'a> {
    scene: &'a str,
    deck: String,
    units: &'static str,
    element: &'static str,
    n_nodes: usize,
    n_elements: usize,
    /// Nodes that move with the tool.
    n_patch_nodes: usize,
    /// Radius of the circle that has the area of the skin between these nodes. mm
    patch_radius_mm: f64,
    depth_mm: f64,
    /// Where the tool goes.
    direction: [f64; 3],
    materials: Vec<Section>,
    notes: &'a [String],
}

/// Runs the command.
///
/// # Errors
/// On a bad scene or body, on what CalculiX cannot say, and when the deck cannot be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Outcome> {
    let mut scene = match &args.scene {
        Some(path) => Scene::load(path)?,
        None => Scene::embedded(),
    };
    if let Some(depth) = args.depth {
        scene.press.step *= depth.si() / scene.press.depth;
        scene.press.depth = depth.si();
        if let Err(problem) = scene.press.check() {
            bail!("{problem}; see --depth");
        }
    }
    let out = context.out_dir()?;
    let spinner = context.progress(0, "growing the body");
    let built = build(&scene)?;
    drop(spinner);
    let body = &built.growth.body;
    let mut notes = built.notes.clone();
    let materials = continuum::materials(&scene)?;
    let lumps = continuum::lumps(&scene, &built, &mut notes)?;
    let supports = continuum::supports(scene.body.cut_faces, body, &mut notes);
    let direction = direction(&scene, &built)?;
    let patch = patch(&scene, &built, direction)?;
    let scene_name = args
        .scene
        .as_deref()
        .map_or("embedded forearm".to_owned(), |p| p.display().to_string());
    let title = [
        format!(
            "palpa {}: {}",
            env!("CARGO_PKG_VERSION"),
            one_line(&scene_name)
        ),
        format!(
            "tool: {}, at ({}) mm, {:.3} mm deep",
            scene.tool,
            in_mm(body.skin.points[built.press_vertex]),
            scene.press.depth * 1e3
        ),
    ];
    let deck = Deck::build(&Export {
        body,
        materials: &materials,
        lumps: &lumps,
        supports: &supports,
        patch: &patch,
        travel: direction * scene.press.depth,
        n_results: (scene.press.depth / scene.press.step - 1e-9)
            .ceil()
            .max(1.0) as usize,
        element: args.element,
        is_approximate: args.approximate,
        title: &title,
    })?;
    notes.extend(deck.notes.iter().cloned());
    out.write_with("body.inp", |w| deck.write(w))?;
    let report = Report {
        scene: &scene_name,
        deck: out.path().join("body.inp").display().to_string(),
        units: "mm, N, MPa",
        element: match args.element {
            Element::C3d15 => "C3D15",
            Element::C3d6 => "C3D6",
        },
        n_nodes: deck.n_nodes(),
        n_elements: deck.n_elements(),
        n_patch_nodes: deck.n_patch_nodes(),
        patch_radius_mm: patch_radius(body, &patch) * 1e3,
        depth_mm: scene.press.depth * 1e3,
        direction: direction.into(),
        materials: deck.sections(),
        notes: &notes,
    };
    context.json(&report)?;
    conclude(context, out.path(), &report)?;
    Ok(Outcome::Done)
}

fn conclude(context: &Context, out: &Path, report: &Report<'_>) -> anyhow::Result<()> {
    context.say(format!(
        "{}: {} nodes, {} elements {}",
        report.scene, report.n_nodes, report.n_elements, report.element
    ))?;
    for material in &report.materials {
        context.say(format!(
            "  {:<24} {:>8} elements  {}",
            material.name, material.n_elements, material.law
        ))?;
    }
    context.say(format!(
        "  {} nodes move {:.2} mm with the tool, a patch as large as a disc of radius {:.2} mm",
        report.n_patch_nodes, report.depth_mm, report.patch_radius_mm
    ))?;
    for note in report.notes {
        context.say(format!("  note: {note}"))?;
    }
    context.say(format!(
        "written to {}; run it with: cd {} && ccx body",
        report.deck,
        out.display()
    ))
}

/// The way the tool goes.
fn direction(scene: &Scene, built: &BuiltBody) -> anyhow::Result<Vec3> {
    let body = &built.growth.body;
    let vertex = built.press_vertex;
    let at = in_mm(body.skin.points[vertex]);
    let inward = -body.skin.vertex_normals()[vertex];
    let direction = scene
        .press
        .direction
        .map_or(inward, Vec3::from)
        .try_normalize(f64::MIN_POSITIVE)
        .with_context(|| {
            format!("the skin has no normal at vertex {vertex} ({at}) mm; give a press direction")
        })?;
    if direction.dot(&inward) <= 0.0 {
        bail!("the press direction points out of the skin at ({at}) mm; turn it, or leave it out");
    }
    let depth = column_length(body, vertex);
    if scene.press.depth >= depth {
        bail!(
            "press depth {:.2} mm reaches beyond the body: at ({at}) mm the tissue is {:.2} mm deep; press less deep, or at \
             another place",
            scene.press.depth * 1e3,
            depth * 1e3,
        );
    }
    Ok(direction)
}

/// The nodes that move with the tool.
fn patch(scene: &Scene, built: &BuiltBody, direction: Vec3) -> anyhow::Result<Vec<usize>> {
    let body = &built.growth.body;
    let vertex = built.press_vertex;
    let at = body.skin.points[vertex];
    match scene.tool {
        Tool::Disc { radius } => Ok(nodes_under_disc(body, vertex, at, &direction, radius)),
        Tool::Node => Ok(vec![body.node(vertex, 0)]),
        Tool::Contact(_) => bail!(
            "the deck holds skin that is bonded to the tool, and a {} presses by contact; give the scene's [tool] shape = \
             \"disc\" or \"node\"",
            scene.tool
        ),
    }
}

/// Radius of the circle that has the area of the triangles between these nodes. m
fn patch_radius(body: &LayeredBody, patch: &[usize]) -> f64 {
    let mut is_in = vec![false; body.n_vertices()];
    for &node in patch {
        is_in[node / body.n_levels] = true;
    }
    let area: f64 = (body.skin.triangles.iter().enumerate())
        .filter(|(_, triangle)| triangle.iter().all(|&v| is_in[v as usize]))
        .map(|(t, _)| body.skin.area_vector(t).norm())
        .sum();
    (area / std::f64::consts::PI).sqrt()
}

/// Without what would end a comment.
fn one_line(text: &str) -> String {
    text.replace(['\n', '\r'], " ")
}
