//! `palpa press`: a scripted indentation; writes a table, plots, pictures and a series for
//! ParaView.

mod cut;
mod files;
mod reference;
mod tissue;
mod words;

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Error, bail};
use palpa_scene::built_in::{PRESSED, PRESSED_BONDED};
use palpa_scene::units::{Length, Share, Time, Velocity};
use palpa_scene::{ModelKind, Scene, Target};

use super::Outcome;
use crate::cli::Context;
use crate::named_scene::{self, NamedScene};
use palpa_plot::output::OutDir;

/// Press a body along a script and record the force
///
/// Without a SCENE, presses a forearm with a ball. Writes the table (press.csv, press.json), force
/// against depth and time (SVG and PNG), a cross-section, and the deformed body as a VTU/PVD series
/// for ParaView.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Scene file (TOML), or the name of a built-in scene; see `palpa scenes` [default:
    /// `forearm_press`; with --model reference: `forearm_disc`]
    scene: Option<PathBuf>,
    /// Model of the body [default: the scene's, or tissue]
    #[arg(long, value_enum)]
    model: Option<Model>,
    /// Press at the skin point nearest to X,Y,Z, with units: "120 mm,0 mm,40 mm"
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    at: Option<String>,
    /// Press at this vertex of the skin surface
    #[arg(long, value_name = "N", conflicts_with = "at")]
    vertex: Option<u32>,
    /// Depth of the press, with a unit: "8 mm". Steps scale with it unless --step is given
    #[arg(long, allow_hyphen_values = true)]
    depth: Option<Length>,
    /// Speed of the press, with a unit: "10 mm/s"
    #[arg(long, allow_hyphen_values = true)]
    speed: Option<Velocity>,
    /// Time to hold at the full depth, with a unit: "0.5 s"
    #[arg(long, allow_hyphen_values = true)]
    hold: Option<Time>,
    /// Depth from one result to the next, with a unit: "0.5 mm"
    #[arg(long, allow_hyphen_values = true)]
    step: Option<Length>,
    /// Stop at the full depth; do not retract
    #[arg(long)]
    no_retract: bool,
    /// Leave out the error bars of the force. They take about half as long again as the press
    #[arg(long, conflicts_with = "accuracy")]
    no_error_bar: bool,
    /// Choose the mesh so that the error bar at the deepest is no wider than this share of the
    /// force: "3 %"
    #[arg(long, value_name = "SHARE", allow_hyphen_values = true)]
    accuracy: Option<Share>,
    /// Longest time for the choice of the mesh, with a unit: "60 s"
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    max_time: Option<Time>,
    /// Also press the same mesh without its lumps, and give the change of the force by them, with an
    /// error bar of its own
    #[arg(long, conflicts_with = "no_error_bar")]
    lump_change: bool,
    /// Number of deformed bodies in the ParaView series, including rest and the deepest; 0 for none
    #[arg(long, default_value_t = 9, value_name = "N")]
    frames: usize,
}

/// The models of response.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Model {
    /// Continuum: nonlinear, nearly incompressible, viscoelastic
    Tissue,
    /// Network of bars, the method of 2009
    Reference,
}

/// Runs the command.
///
/// # Errors
/// If the scene or body is bad, or a result cannot be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Outcome> {
    let (scene, scene_name) = adjusted_scene(args)?;
    let out = context.out_dir()?;
    let job = Job {
        args,
        context,
        out,
        scene: &scene,
        scene_name: &scene_name,
    };
    match scene.model.kind {
        ModelKind::Tissue => tissue::run(&job),
        ModelKind::Reference => reference::run(&job),
    }
}

/// A press to run, and the destination of its results.
#[derive(Clone, Copy)]
struct Job<'a> {
    args: &'a Args,
    context: &'a Context,
    out: &'a OutDir,
    scene: &'a Scene,
    scene_name: &'a str,
}

/// The scene with the changes of the command line, and its name.
fn adjusted_scene(args: &Args) -> anyhow::Result<(Scene, String)> {
    if let Some(path) = args.scene.as_ref().filter(|path| is_surface(path)) {
        bail!(
            "\"{}\" is a surface, not a scene; look at it with `palpa check`, or name it as `surface` in a scene \
             (`palpa scenes --write own_mesh` writes a start for one)",
            path.display()
        );
    }
    // Bars have no contact: the tool of their scene is bonded to the skin.
    let default = match args.model {
        Some(Model::Reference) => PRESSED_BONDED,
        Some(Model::Tissue) | None => PRESSED,
    };
    let NamedScene {
        mut scene, name, ..
    } = named_scene::load_or(args.scene.as_deref(), default)?;
    if let Some(model) = args.model {
        scene.model.kind = match model {
            Model::Tissue => ModelKind::Tissue,
            Model::Reference => ModelKind::Reference,
        };
    }
    let press = &mut scene.press;
    if let Some(text) = &args.at {
        press.target = Target::Point(parse_point(text)?);
    }
    if let Some(vertex) = args.vertex {
        press.target = Target::Vertex(vertex);
    }
    if let Some(depth) = args.depth {
        // The step keeps its share of the depth unless the step is given too.
        press.step *= depth.si() / press.depth;
        press.depth = depth.si();
    }
    if let Some(step) = args.step {
        press.step = step.si();
    }
    if let Some(speed) = args.speed {
        press.speed = speed.si();
        press.speeds.clear();
    }
    if let Some(hold) = args.hold {
        press.hold = hold.si();
    }
    press.retract &= !args.no_retract;
    set_accuracy(&mut scene, args)?;
    let press = &scene.press;
    if let Err(problem) = press.check() {
        bail!("{problem}; see --depth, --step, --speed and --hold");
    }
    Ok((scene, name))
}

/// Sets accuracy and time limit from the command line.
fn set_accuracy(scene: &mut Scene, args: &Args) -> anyhow::Result<()> {
    let mesh = &mut scene.mesh;
    if let Some(accuracy) = args.accuracy {
        mesh.accuracy = Some(accuracy.si());
    }
    if let Some(time) = args.max_time {
        if mesh.accuracy.is_none() {
            bail!(
                "--max-time limits the choice of a mesh, and there is none without an accuracy; add --accuracy, or leave it out"
            );
        }
        mesh.max_time = Some(time.si());
    }
    mesh.check(&scene.tool).map_err(Error::msg)?;
    if let Some(accuracy) = mesh.accuracy.filter(|_| args.no_error_bar) {
        bail!(
            "the scene asks for an accuracy of {}, and the mesh for it is chosen by its error bar; leave out --no-error-bar, \
             or remove `accuracy` from [mesh]",
            Share::from_si(accuracy)
        );
    }
    if mesh.accuracy.is_some() && scene.model.kind == ModelKind::Reference {
        bail!(
            "--accuracy needs the model `tissue`; the method of 2009 has the mesh of its surface"
        );
    }
    Ok(())
}

fn is_surface(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    ["obj", "stl", "ply", "off", "glb", "gltf"]
        .iter()
        .any(|e| extension == *e)
}

fn parse_point(text: &str) -> anyhow::Result<[f64; 3]> {
    let parts: Vec<&str> = text.split(',').collect();
    let [x, y, z] = parts[..] else {
        bail!(
            "--at \"{text}\" has {} parts; give three lengths with units, as in \"120 mm,0 mm,40 mm\"",
            parts.len()
        );
    };
    let length = |part: &str| -> anyhow::Result<f64> {
        Ok(part
            .trim()
            .parse::<Length>()
            .with_context(|| format!("--at \"{text}\""))?
            .si())
    };
    Ok([length(x)?, length(y)?, length(z)?])
}
