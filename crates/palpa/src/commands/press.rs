//! `palpa press`: a scripted indentation, as table, plots, pictures and a series for ParaView.

mod pictures;
mod record;
mod report;

use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use palpa_tissue::units::{Length, Time, Velocity};
use palpa_tissue::{Scene, Target};

use self::pictures::draw_pictures;
use self::record::{record, remove_older};
use self::report::{PressReport, announce, conclude, facts, result_of};
use super::Outcome;
use crate::build::build;
use crate::cli::Context;
use crate::press::Indentation;

/// Press a body along a script and record the force
///
/// Without a SCENE, a forearm made by formula is pressed. Writes the table (press.csv, press.json), force against depth
/// and time (SVG and PNG), a cross-section, and the deformed body as a VTU/PVD series for ParaView.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Scene file (TOML); the embedded forearm if none is given
    scene: Option<PathBuf>,
    /// Press at the skin point nearest to this one, "X,Y,Z" with units: "120 mm,0 mm,40 mm"
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    at: Option<String>,
    /// Press at this vertex of the skin surface
    #[arg(long, value_name = "N", conflicts_with = "at")]
    vertex: Option<u32>,
    /// How deep, with its unit: "8 mm"
    #[arg(long)]
    depth: Option<Length>,
    /// How fast, with its unit: "10 mm/s"
    #[arg(long)]
    speed: Option<Velocity>,
    /// How long to rest at the depth: "0.5 s"
    #[arg(long)]
    hold: Option<Time>,
    /// Depth between two results: "0.5 mm"
    #[arg(long)]
    step: Option<Length>,
    /// Stop at the depth instead of coming back
    #[arg(long)]
    no_retract: bool,
    /// Deformed bodies in the series for ParaView, rest and deepest among them; 0 for none
    #[arg(long, default_value_t = 9, value_name = "N")]
    frames: usize,
}

/// Runs the command.
///
/// # Errors
/// On a bad scene or body, and when a result cannot be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Outcome> {
    let scene = adjusted_scene(args)?;
    let out = context.out_dir()?;
    let spinner = context.progress(0, "growing the body");
    let built = build(&scene)?;
    drop(spinner);
    let indentation = Indentation::build(&scene, &built)?;
    let notes: Vec<String> = built
        .notes
        .iter()
        .chain(&indentation.notes)
        .cloned()
        .collect();
    let materials = scene.material_status();
    let scene_name = args
        .scene
        .as_deref()
        .map_or("embedded forearm".to_owned(), |p| p.display().to_string());
    announce(
        context,
        &scene_name,
        &scene,
        &built,
        &indentation,
        &materials,
    )?;

    context.begin_recording();
    remove_older(out.path())?;
    let recorded = record(args, context, out, &built, &indentation)?;
    let result = result_of(&recorded.samples, &materials, context.is_interrupted());
    let report = PressReport {
        model: "reference",
        scene: scene_name.clone(),
        body: &built.growth.report,
        materials: &materials,
        press: facts(&scene, &indentation),
        result,
        notes: &notes,
        samples: &recorded.samples,
    };
    out.write_json("press.json", &report)?;
    let pictures = if recorded.samples.len() > 1 {
        draw_pictures(out, &scene, &built, &indentation, &recorded, &report.result)?
    } else {
        Vec::new()
    };
    context.json(&report)?;
    conclude(context, out.path(), &recorded, &report, &pictures, &notes)?;
    Ok(match (context.is_interrupted(), report.result.outcome) {
        (true, _) => Outcome::Interrupted,
        (_, "diverged") => Outcome::NotGood,
        _ => Outcome::Done,
    })
}

/// The scene with what the command line changes in it.
fn adjusted_scene(args: &Args) -> anyhow::Result<Scene> {
    let mut scene = match &args.scene {
        Some(path) if is_surface(path) => bail!(
            "\"{}\" is a surface, not a scene; look at it with `palpa check`, or name it as `surface` in a scene (see \
             scenes/own_mesh.toml)",
            path.display()
        ),
        Some(path) => Scene::load(path)?,
        None => Scene::embedded(),
    };
    let press = &mut scene.press;
    if let Some(text) = &args.at {
        press.target = Target::Point(parse_point(text)?);
    }
    if let Some(vertex) = args.vertex {
        press.target = Target::Vertex(vertex);
    }
    if let Some(depth) = args.depth {
        // The step keeps its share of the depth unless it is given, too.
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
    if let Err(problem) = press.check() {
        bail!("{problem}; see --depth, --step, --speed and --hold");
    }
    Ok(scene)
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
