//! `palpa scenes`: lists, prints and writes the built-in scenes.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use palpa_plot::output::OutDir;
use palpa_scene::built_in::{LOOPED, PRESSED, PRESSED_BONDED, VIEWED};
use palpa_scene::{BuiltIn, ModelKind, Scene, nearest};
use serde::Serialize;

use super::Outcome;
use crate::cli::Context;
use crate::table::Table;

/// List the built-in scenes, or write them as a start for your own
///
/// Without a NAME, lists the built-in scenes. With a NAME, prints its scene file. Every command
/// takes such a name in the place of a scene file, as in `palpa press limb`; a file of the same name
/// comes first.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Built-in scenes [default: all]
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    /// Write each scene as NAME.toml into this folder, or into the folder of --out. With one NAME,
    /// --out may name the file: --out my.toml. A file that exists is not overwritten
    #[arg(long)]
    write: bool,
}

/// The commands that use a built-in scene if none is named.
const DEFAULTS: [(&str, &str); 5] = [
    ("palpa view", VIEWED),
    ("palpa press", PRESSED),
    ("palpa press --model reference", PRESSED_BONDED),
    ("palpa export", PRESSED_BONDED),
    ("palpa loop-report", LOOPED),
];

/// A built-in scene in the `--json` output.
#[derive(Debug, Serialize)]
struct Listed {
    name: &'static str,
    title: &'static str,
    about: &'static str,
    /// Names of the tissues, from the skin inward.
    layers: Vec<String>,
    n_lumps: usize,
    tool: String,
    /// `tissue` or `reference`.
    model: &'static str,
    /// Depth of the scripted press.
    depth_mm: f64,
    /// The motion of the hand in real time.
    motion: &'static str,
    /// Whether the page offers it.
    is_in_gallery: bool,
    /// Whether mesh files have to be added before it can be used.
    is_template: bool,
    /// The commands that use it if no scene is named.
    default_of: Vec<&'static str>,
    /// The scene file, if scenes were named.
    #[serde(skip_serializing_if = "Option::is_none")]
    toml: Option<&'static str>,
    /// The file that was written.
    #[serde(skip_serializing_if = "Option::is_none")]
    written: Option<PathBuf>,
}

impl Listed {
    fn new(built_in: &'static BuiltIn) -> anyhow::Result<Self> {
        let scene = scene_of(built_in)?;
        let uses = DEFAULTS.iter().filter(|(_, key)| *key == built_in.key);
        Ok(Self {
            name: built_in.key,
            title: built_in.name,
            about: built_in.about,
            layers: scene.layers.iter().map(|l| l.tissue.name.clone()).collect(),
            n_lumps: scene.lumps.len(),
            tool: scene.tool.to_string(),
            model: match scene.model.kind {
                ModelKind::Tissue => "tissue",
                ModelKind::Reference => "reference",
            },
            // Without the last digits of the change of unit.
            depth_mm: (scene.press.depth * 1e9).round() * 1e-6,
            motion: scene.motion.kind.name(),
            is_in_gallery: built_in.is_in_gallery,
            is_template: built_in.is_template,
            default_of: uses.map(|(command, _)| *command).collect(),
            toml: None,
            written: None,
        })
    }
}

fn scene_of(built_in: &BuiltIn) -> anyhow::Result<Scene> {
    (built_in.scene()).with_context(|| format!("the built-in scene \"{}\"", built_in.key))
}

/// Runs the command.
///
/// # Errors
/// If there is no built-in scene of a name, or a file exists already or cannot be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Outcome> {
    let named: Vec<&BuiltIn> = (args.names.iter())
        .map(|name| find(name))
        .collect::<anyhow::Result<_>>()?;
    let chosen = if named.is_empty() {
        BuiltIn::all().iter().collect()
    } else {
        named
    };
    if args.write || context.given_out().is_some() {
        write(&chosen, args.names.len() == 1, context)?;
        return Ok(Outcome::Done);
    }
    match (&args.names[..], &chosen[..]) {
        ([], _) => list(&chosen, context)?,
        (_, [one]) => {
            context.say(one.toml.trim_end())?;
            context.json(&Listed {
                toml: Some(one.toml),
                ..Listed::new(one)?
            })?;
        }
        _ => bail!("one scene is printed at a time; --write writes several, each as a file"),
    }
    Ok(Outcome::Done)
}

fn find(name: &str) -> anyhow::Result<&'static BuiltIn> {
    if let Some(found) = BuiltIn::find(name) {
        return Ok(found);
    }
    let keys = || BuiltIn::all().iter().map(|built_in| built_in.key);
    let bare = name.strip_suffix(".toml").unwrap_or(name).to_lowercase();
    match nearest(&bare, keys()) {
        Some(meant) => bail!("there is no built-in scene \"{name}\"; did you mean \"{meant}\"?"),
        None => bail!(
            "there is no built-in scene \"{name}\"; the scenes are {}",
            keys().collect::<Vec<_>>().join(", ")
        ),
    }
}

fn list(chosen: &[&'static BuiltIn], context: &Context) -> anyhow::Result<()> {
    let listed: Vec<Listed> = (chosen.iter())
        .map(|built_in| Listed::new(built_in))
        .collect::<anyhow::Result<_>>()?;
    context.json(&listed)?;
    let mut table =
        Table::new(["scene", "layers", "tool", "motion", "what it is"]).with_left_columns();
    for scene in &listed {
        let lumps = match scene.n_lumps {
            0 => String::new(),
            1 => " + lump".to_owned(),
            n => format!(" + {n} lumps"),
        };
        // The kind of the tool, without its sizes.
        let tool = match scene.tool.split(',').next().unwrap_or_default() {
            "single operated node" => "node",
            tool => tool,
        };
        table.push([
            scene.name.to_owned(),
            format!("{}{lumps}", scene.layers.len()),
            tool.to_owned(),
            scene.motion.to_owned(),
            scene.about.to_owned(),
        ]);
    }
    context.say(table)?;
    context.say("\nUsed if no scene is named:")?;
    for (command, key) in DEFAULTS {
        context.say(format_args!("  {command:<30}  {key}"))?;
    }
    context.say(
        "\npalpa press limb           presses a built-in scene; every command takes these names\n\
         palpa scenes limb          prints its file\n\
         palpa scenes --write limb  writes limb.toml, as a start for a scene of your own",
    )
}

/// Writes the scenes as files, and prints their paths.
fn write(chosen: &[&'static BuiltIn], is_one: bool, context: &Context) -> anyhow::Result<()> {
    let out = context.given_out().unwrap_or(Path::new("."));
    let is_toml = |path: &Path| {
        let extension = path.extension();
        extension.is_some_and(|e| e.eq_ignore_ascii_case("toml"))
    };
    let is_file = is_toml(out) && !out.is_dir();
    if is_file && !is_one {
        bail!(
            "--out \"{}\" names one file, but {} scenes are written; name a folder, or one scene",
            out.display(),
            chosen.len()
        );
    }
    let folder = if is_file {
        out.parent().unwrap_or(out)
    } else {
        out
    };
    let folder = if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    };
    let target = |built_in: &BuiltIn| match out.file_name() {
        Some(name) if is_file => name.to_string_lossy().into_owned(),
        _ => format!("{}.toml", built_in.key),
    };
    // All or nothing, unless another program writes at the same time.
    for built_in in chosen {
        let path = folder.join(target(built_in));
        if path.symlink_metadata().is_ok() {
            bail!(
                "\"{}\" exists already and is not overwritten; choose another folder or file with --out",
                shown(&path)
            );
        }
    }
    let dir = OutDir::create(folder.to_owned())?;
    let mut listed = Vec::new();
    for built_in in chosen {
        let path = dir.write_new(&target(built_in), built_in.toml.as_bytes())?;
        context.say(format_args!(
            "{}: {} (palpa press {0})",
            shown(&path),
            built_in.name
        ))?;
        listed.push(Listed {
            written: Some(path),
            ..Listed::new(built_in)?
        });
    }
    context.json(&listed)
}

/// The path without `./` before it.
fn shown(path: &Path) -> String {
    path.strip_prefix(".").unwrap_or(path).display().to_string()
}
