//! `palpa check`: what is wrong with a surface or a scene, and a repaired copy.

mod report;

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail, ensure};
use palpa_mesh::check::Examination;
use palpa_mesh::growth::GrowthReport;
use palpa_mesh::{RepairOptions, SurfaceFile, Verdict, read_surface, write_surface};
use palpa_scene::{LengthUnit, Scene};
use serde::Serialize;

use crate::cli::Context;
use crate::commands::Outcome;
use crate::named_scene;
use palpa::build::{BuiltBody, build};
use palpa::check::{SurfaceCheck, surfaces_of};
use palpa::{Note, one_paragraph};

/// Extensions of the files that can be checked, for similar names.
const KINDS: [&str; 7] = ["obj", "stl", "ply", "off", "glb", "gltf", "toml"];

/// Check surfaces and scenes: what is wrong, where, and what to do
///
/// Reads surfaces (OBJ, STL, PLY, OFF, GLB, glTF) and scenes. Of a scene, it checks the surfaces
/// that the scene names and the body that grows from them. Exit code 0: usable as it is. 1: has
/// defects; the report says whether a repair removes them. 2: cannot be read.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Surfaces, scenes (.toml), or names of built-in scenes; see `palpa scenes`
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Unit of the coordinates of surfaces: m, cm, mm or in. Scenes state their own unit
    #[arg(long, default_value = "m", value_parser = unit)]
    unit: LengthUnit,
    /// Write a repaired copy of a single surface to this file (.obj, .ply, .off, .stl), in metres
    #[arg(long, value_name = "FILE")]
    repaired: Option<PathBuf>,
    /// Move the middle of the repaired copy to the origin
    #[arg(long)]
    recentre: bool,
    /// In the repaired copy, weld vertices closer than this share of the size of the surface
    #[arg(long, value_name = "SHARE", default_value_t = RepairOptions::default().weld_tolerance, value_parser = share)]
    weld: f64,
}

fn unit(word: &str) -> Result<LengthUnit, String> {
    match word {
        "m" => Ok(LengthUnit::M),
        "cm" => Ok(LengthUnit::Cm),
        "mm" => Ok(LengthUnit::Mm),
        "in" => Ok(LengthUnit::In),
        _ => Err("possible are m, cm, mm and in".to_owned()),
    }
}

fn share(word: &str) -> Result<f64, String> {
    match word.parse() {
        Ok(share) if (0.0..0.1).contains(&share) => Ok(share),
        _ => Err("expected a number from 0 up to 0.1".to_owned()),
    }
}

/// The result for one file of the command line.
#[derive(Debug, Serialize)]
struct FileResult {
    file: PathBuf,
    /// `None` if the file could not be read.
    verdict: Option<Verdict>,
    /// The reason if the file could not be read.
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
    /// The surface of the file, or the surfaces that a scene names.
    surfaces: Vec<SurfaceResult>,
    /// The body that grows from a scene; `None` if none grows.
    #[serde(skip_serializing_if = "Option::is_none")]
    body: Option<GrowthReport>,
    /// Remarks on that body.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    notes: Vec<String>,
    /// Why no body grows, although each surface of the scene is sound.
    #[serde(skip_serializing_if = "Option::is_none")]
    refusal: Option<String>,
}

/// The result for one surface.
#[derive(Debug, Serialize)]
struct SurfaceResult {
    #[serde(flatten)]
    check: SurfaceCheck,
    /// Path of the repaired copy.
    #[serde(skip_serializing_if = "Option::is_none")]
    written: Option<PathBuf>,
}

/// Checks all files and reports on each.
///
/// # Errors
/// If a file cannot be read, or a repaired copy cannot be written. The reports on the other files
/// are printed first.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Outcome> {
    ensure!(
        args.repaired.is_none() || args.files.len() == 1,
        "--repaired names one file, but {} are checked; give --out DIR instead",
        args.files.len()
    );
    let mut results = Vec::new();
    for file in &args.files {
        if context.is_interrupted() {
            return Ok(Outcome::Interrupted);
        }
        let result = check_file(file, args, context)?;
        report::say(&result, context)?;
        results.push(result);
    }
    context.json(&results)?;

    let errors: Vec<&String> = results.iter().filter_map(|r| r.error.as_ref()).collect();
    match errors[..] {
        [] => {}
        [error] => bail!("{error}"),
        [first, ..] => bail!(
            "{} of {} files cannot be read, the first: {first}",
            errors.len(),
            results.len()
        ),
    }
    let is_good = results.iter().all(|r| r.verdict == Some(Verdict::Good));
    Ok(if is_good {
        Outcome::Done
    } else {
        Outcome::NotGood
    })
}

/// Checks one file. An unreadable file is a result; a copy that cannot be written is an error.
fn check_file(file: &Path, args: &Args, context: &Context) -> anyhow::Result<FileResult> {
    let mut result = FileResult {
        file: file.into(),
        verdict: None,
        error: None,
        surfaces: vec![],
        body: None,
        notes: vec![],
        refusal: None,
    };
    let (scene, surfaces) = match parts_of(file, args.unit) {
        Ok(parts) => parts,
        Err(error) => {
            result.error = Some(one_paragraph(&error));
            return Ok(result);
        }
    };
    let mut verdict = Verdict::Good;
    for (path, surface, unit) in surfaces {
        let options = RepairOptions {
            weld_tolerance: args.weld,
            recentre: args.recentre,
        };
        let check = SurfaceCheck::of(path, &surface, unit, &options);
        verdict = verdict.max(check.examination.verdict);
        let written = write_repaired(&check.file, &check.examination, args, context)?;
        result.surfaces.push(SurfaceResult { check, written });
    }
    if let Some(scene) = scene.filter(|_| verdict < Verdict::Bad) {
        match build(&scene) {
            Ok(built) => {
                result.notes = notes_on(&built);
                result.body = Some(built.growth.report);
            }
            Err(error) => {
                result.refusal = Some(one_paragraph(&error));
                verdict = Verdict::Bad;
            }
        }
    }
    result.verdict = Some(verdict);
    Ok(result)
}

/// The notes on a body that are not about the surfaces: those have their own reports.
fn notes_on(built: &BuiltBody) -> Vec<String> {
    let is_of_body = |note: &&Note| {
        !matches!(
            note,
            Note::FileRead { .. } | Note::UnusualSize { .. } | Note::Repaired { .. }
        )
    };
    let notes = built.notes.iter().filter(is_of_body);
    notes.map(ToString::to_string).collect()
}

fn is_scene(file: &Path) -> bool {
    let is_toml = |e: &OsStr| e.eq_ignore_ascii_case("toml");
    file.extension().is_some_and(is_toml) || named_scene::built_in(file).is_some()
}

/// A surface that was read, the file that it is from, and the unit of its coordinates.
type Named = (PathBuf, SurfaceFile, LengthUnit);

/// The surface of a file; or a scene, and the surfaces that it names.
fn parts_of(file: &Path, unit: LengthUnit) -> anyhow::Result<(Option<Scene>, Vec<Named>)> {
    if !is_scene(file) {
        if !file.exists()
            && let Some(meant) = named_scene::meant(file, &KINDS)
        {
            bail!(
                "cannot read {}: there is no such file; did you mean \"{meant}\"?",
                file.display()
            );
        }
        return Ok((None, vec![(file.into(), read_surface(file)?, unit)]));
    }
    let scene = named_scene::load(file)?.scene;
    let surfaces = surfaces_of(&scene).with_context(|| format!("scene {}", file.display()))?;
    let unit = scene.body.unit;
    let named = surfaces
        .into_iter()
        .map(|(path, surface)| (path, surface, unit));
    Ok((Some(scene), named.collect()))
}

/// Writes the repaired copy, if one was requested and it is not empty. Returns its path.
fn write_repaired(
    path: &Path,
    examination: &Examination,
    args: &Args,
    context: &Context,
) -> anyhow::Result<Option<PathBuf>> {
    let Some(repaired) = &examination.repaired else {
        return Ok(None);
    };
    let target = match &args.repaired {
        Some(target) => target.clone(),
        None if context.given_out().is_some() => context.out_dir()?.path().join(name_of_copy(path)),
        None => return Ok(None),
    };
    if repaired.surface.triangles.is_empty() {
        return Ok(None);
    }
    write_surface(&target, &repaired.surface)?;
    Ok(Some(target))
}

/// `skin.obj` → `skin_repaired.obj`. If the format cannot be written, the copy becomes PLY.
fn name_of_copy(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_ascii_lowercase());
    let extension = extension.filter(|e| ["obj", "stl", "off"].contains(&e.as_str()));
    format!("{stem}_repaired.{}", extension.as_deref().unwrap_or("ply"))
}
