//! `palpa export`: a scene as an input deck for CalculiX.

use std::path::{Path, PathBuf};

use anyhow::bail;
use palpa_scene::Scene;
use palpa_scene::built_in::PRESSED_BONDED;
use palpa_scene::units::Length;
use serde::Serialize;

use super::Outcome;
use crate::cli::Context;
use crate::named_scene::{self, NamedScene};
use palpa::build::in_mm;
use palpa::press::Place;
use palpa::press::mesh::PressedBody;
use palpa::{Note, Prepared};
use palpa_lab::export::{self, Deck, DeckNote, Export, Section};

/// Write a scene as an input deck for CalculiX, to check its forces with another solver
///
/// Without a SCENE, exports a forearm under a disc that is bonded to the skin. Mesh, patch and steps are those of `palpa press`.
/// Writes body.inp, in millimetres, newtons and megapascals. Run it with `ccx body` in its folder:
/// CalculiX then writes the forces of the loading to body.dat and the deformed body to body.frd.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Scene file (TOML), or the name of a built-in scene; see `palpa scenes` [default:
    /// `forearm_disc`]
    scene: Option<PathBuf>,
    /// Element type for the prisms
    #[arg(long, value_enum, default_value_t)]
    element: Element,
    /// Depth of the press, with a unit: "8 mm"
    #[arg(long)]
    depth: Option<Length>,
    /// Where CalculiX lacks a feature of the scene, write the nearest one that it has
    #[arg(long)]
    approximate: bool,
}

/// Report on the written deck.
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
    /// Radius of the circle with the area of the skin between these nodes, mm.
    patch_radius_mm: f64,
    depth_mm: f64,
    /// Direction of the travel of the tool.
    direction: [f64; 3],
    materials: Vec<Section>,
    notes: &'a [String],
}

/// The elements of CalculiX that a prism can become.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum)]
enum Element {
    /// Quadratic, 15 nodes: the most accurate
    #[default]
    C3d15,
    /// Linear, 6 nodes: a small file, but much too stiff for nearly incompressible tissue
    C3d6,
}

impl From<Element> for export::Element {
    fn from(element: Element) -> Self {
        match element {
            Element::C3d15 => Self::C3d15,
            Element::C3d6 => Self::C3d6,
        }
    }
}

/// Runs the command.
///
/// # Errors
/// If the scene or body is bad, if CalculiX lacks a feature of the scene, or if the deck cannot be
/// written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Outcome> {
    let (scene, scene_name) = scene_of(args)?;
    let out = context.out_dir()?;
    let spinner = context.progress(0, "growing the body");
    let prepared = Prepared::build(&scene)?;
    drop(spinner);
    let (body, place) = (&prepared.mesh.body, prepared.place());
    let patch = patch(&prepared.mesh);
    let title = title(&scene, place, &scene_name);
    let deck = Deck::build(&Export {
        body,
        materials: &prepared.materials.materials,
        lumps: prepared.lumps(),
        supports: &prepared.supports,
        patch: &patch,
        travel: place.direction.into_inner() * scene.press.depth,
        n_results: (scene.press.depth / scene.press.step - 1e-9)
            .ceil()
            .max(1.0) as usize,
        element: args.element.into(),
        is_approximate: args.approximate,
        title: &title,
    })?;
    let mut notes: Vec<String> = prepared.notes.iter().map(Note::to_string).collect();
    notes.extend(deck.notes.iter().map(DeckNote::to_string));
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
        patch_radius_mm: (prepared.mesh.patch)
            .as_ref()
            .map_or(0.0, |patch| patch.radius * 1e3),
        depth_mm: scene.press.depth * 1e3,
        direction: place.direction.into_inner().into(),
        materials: deck.sections(),
        notes: &notes,
    };
    context.json(&report)?;
    conclude(context, out.path(), &report)?;
    Ok(Outcome::Done)
}

/// The scene with the options applied, and its name.
fn scene_of(args: &Args) -> anyhow::Result<(Scene, String)> {
    let NamedScene {
        mut scene, name, ..
    } = named_scene::load_or(args.scene.as_deref(), PRESSED_BONDED)?;
    if let Some(depth) = args.depth {
        scene.press.step *= depth.si() / scene.press.depth;
        scene.press.depth = depth.si();
        if let Err(problem) = scene.press.check() {
            bail!("{problem}; see --depth");
        }
    }
    if scene.tool.contact().is_some() {
        bail!(
            "the deck holds skin that is bonded to the tool, and a {} presses by contact; give the scene's [tool] shape = \
             \"disc\" or \"node\"",
            scene.tool
        );
    }
    Ok((scene, name))
}

/// The two lines at the head of the deck.
fn title(scene: &Scene, place: &Place, scene_name: &str) -> [String; 2] {
    [
        format!(
            "palpa {}: {}",
            env!("CARGO_PKG_VERSION"),
            one_line(scene_name)
        ),
        format!(
            "tool: {}, at ({}) mm, {:.3} mm deep",
            scene.tool,
            in_mm(place.at),
            scene.press.depth * 1e3
        ),
    ]
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
    context.say(match report.n_patch_nodes {
        1 => format!("  one node moves {:.2} mm with the tool", report.depth_mm),
        n => format!(
            "  {n} nodes move {:.2} mm with the tool, a patch as large as a disc of radius {:.2} mm",
            report.depth_mm, report.patch_radius_mm
        ),
    })?;
    for note in report.notes {
        context.say(format!("  note: {note}"))?;
    }
    context.say(format!(
        "written to {}; run it with: cd {} && ccx body",
        report.deck,
        out.display()
    ))
}

/// The nodes that move with the tool.
fn patch(pressed: &PressedBody) -> Vec<usize> {
    let body = &pressed.body;
    match &pressed.patch {
        Some(patch) => (patch.vertices.iter()).map(|&v| body.node(v, 0)).collect(),
        None => vec![body.node(pressed.place.vertex, 0)],
    }
}

/// The text without line breaks, which would end a comment.
fn one_line(text: &str) -> String {
    text.replace(['\n', '\r'], " ")
}
