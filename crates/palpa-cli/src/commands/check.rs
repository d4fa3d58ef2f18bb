//! `palpa check`: what is wrong with a surface or a scene, and a repaired copy.

mod report;

use std::path::{Path, PathBuf};

use anyhow::{bail, ensure};
use palpa_mesh::check::Examination;
use palpa_mesh::growth::GrowthReport;
use palpa_mesh::{RepairOptions, Verdict, write_surface};
use palpa_scene::{LengthUnit, Scene};
use serde::Serialize;

use crate::cli::Context;
use crate::commands::Outcome;
use palpa::build::build;
use palpa::check::{SurfaceCheck, is_scene, surfaces_in};
use palpa::one_paragraph;

/// Check surfaces and scenes: what is wrong, where, and what to do
///
/// Reads surfaces (OBJ, STL, PLY, OFF, GLB, glTF) and scenes. Of a scene, it checks the surfaces
/// that the scene names and the body that grows from them. Exit code 0: usable as it is. 1: has
/// defects; the report says whether a repair removes them. 2: cannot be read.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Surfaces, or scenes (.toml)
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
        refusal: None,
    };
    let surfaces = match surfaces_in(file, args.unit) {
        Ok(surfaces) => surfaces,
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
    if is_scene(file) && verdict < Verdict::Bad {
        match build(&Scene::load(file)?) {
            Ok(built) => result.body = Some(built.growth.report),
            Err(error) => {
                result.refusal = Some(one_paragraph(&error));
                verdict = Verdict::Bad;
            }
        }
    }
    result.verdict = Some(verdict);
    Ok(result)
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
        None if context.is_out_given() => context.out_dir()?.path().join(name_of_copy(path)),
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
