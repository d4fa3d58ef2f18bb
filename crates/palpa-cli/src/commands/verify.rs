//! `palpa verify`: compares the continuum model with known answers.

mod error_bars;
mod report;

use std::fs;
use std::io;
use std::path::PathBuf;

use anyhow::{Context as _, bail};
use palpa_lab::verify::{Case, Findings, Options, Row, VerifyError, cases};
use serde::Serialize;

use self::report::say_case;
use super::Outcome;
use crate::cli::Context;
use crate::table::Table;
use palpa_lab::verify::picture;
use palpa_plot::output::OutDir;

/// Compare the continuum model with known answers
///
/// Cases by formula need nothing else. With --reference, Palpa also runs the cases that compare
/// with tables of other programs. Prints each figure with the known answer, the computed one, the
/// error, its tolerance, and the number of nodes that can move. Writes verify.csv, verify.json, and
/// the errors against mesh size (convergence.csv, .svg and .png). Exit code 1 if any figure is out
/// of tolerance.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Cases to run, by name [default: all]
    #[arg(value_name = "CASE")]
    cases: Vec<String>,
    /// Folder with the reference tables
    #[arg(long, value_name = "DIR")]
    reference: Option<PathBuf>,
    /// Check error bars instead: of N presses drawn at random, against meshes with less than half the size
    ///
    /// Takes about half a minute a press. Writes `error_bars.csv` after each press, and goes on with the table that is in the
    /// folder of --out; then `error_bars.json`, .svg and .png. Exit code 1 if fewer than 90 % of the forces are inside, or if the
    /// median bar is wider than three true errors.
    #[arg(long, value_name = "N", conflicts_with_all = ["cases", "reference", "list"])]
    error_bars: Option<u64>,
    /// List the cases and run none
    #[arg(long)]
    list: bool,
}

/// Runs the command.
///
/// # Errors
/// If a case or a reference table does not exist, or a result cannot be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Outcome> {
    if let Some(n_cases) = args.error_bars {
        return error_bars::run(n_cases, context);
    }
    let chosen = chosen(args)?;
    if args.list {
        list(context, &chosen)?;
        return Ok(Outcome::Done);
    }
    let options = Options {
        reference: args.reference.clone(),
    };
    let out = context.out_dir()?;
    remove_older(out)?;
    context.begin_recording();
    let mut found = Findings::default();
    let ran = run_cases(&chosen, &options, context, &mut found);
    // The completed figures are kept, whatever ended the run.
    if ran.is_ok() || !found.rows.is_empty() {
        write(out, &found)?;
    }
    ran?;
    context.json(&found.rows)?;
    if !found.study.is_empty() {
        context.say(format_args!(
            "Errors against the size of the mesh: {}",
            out.path().join("convergence.png").display()
        ))?;
    }
    let n_passed = found.rows.iter().filter(|row| row.pass).count();
    let n_rows = found.rows.len();
    context.say(format_args!("{n_passed} of {n_rows} within tolerance"))?;
    Ok(if context.is_interrupted() {
        Outcome::Interrupted
    } else if n_passed < n_rows {
        Outcome::NotGood
    } else {
        Outcome::Done
    })
}

/// The cases to run, in their order.
fn chosen(args: &Args) -> anyhow::Result<Vec<&'static Case>> {
    let is_named = |case: &Case| args.cases.iter().any(|name| is_name_of(name, case));
    if let Some(unknown) =
        (args.cases.iter()).find(|name| !cases().iter().any(|case| is_name_of(name, case)))
    {
        let known: Vec<String> = cases().iter().map(|case| written(case.name)).collect();
        bail!(
            "there is no case \"{unknown}\"; the cases are {}",
            known.join(", ")
        );
    }
    if let Some(folder) = &args.reference
        && !folder.is_dir()
    {
        bail!(
            "there is no folder \"{}\"; --reference names the folder that holds the reference tables",
            folder.display()
        );
    }
    if args.list || !args.cases.is_empty() {
        let named: Vec<&Case> = cases()
            .iter()
            .filter(|case| args.cases.is_empty() || is_named(case))
            .collect();
        if !args.list
            && args.reference.is_none()
            && let Some(case) = named.iter().find(|case| case.needs_reference)
        {
            bail!(
                "case \"{}\" needs the reference tables; name their folder with --reference DIR",
                case.name
            );
        }
        return Ok(named);
    }
    Ok(cases()
        .iter()
        .filter(|case| args.reference.is_some() || !case.needs_reference)
        .collect())
}

/// The name as one word for the command line, with hyphens for spaces.
fn written(name: &str) -> String {
    name.replace(' ', "-")
}

fn is_name_of(name: &str, case: &Case) -> bool {
    written(name).eq_ignore_ascii_case(&written(case.name))
}

/// A case in the `--json` list.
#[derive(Debug, Serialize)]
struct Listed {
    name: &'static str,
    title: &'static str,
    source: &'static str,
    needs_reference: bool,
}

fn list(context: &Context, chosen: &[&Case]) -> anyhow::Result<()> {
    let listed: Vec<Listed> = chosen
        .iter()
        .map(|case| Listed {
            name: case.name,
            title: case.title,
            source: case.source,
            needs_reference: case.needs_reference,
        })
        .collect();
    context.json(&listed)?;
    let mut table = Table::new(["case", "needs"]).with_left_names();
    for case in chosen {
        let needs = if case.needs_reference {
            "--reference"
        } else {
            "nothing"
        };
        table.push([written(case.name), needs.to_owned()]);
    }
    let titles = std::iter::once("what is verified, and against what".to_owned()).chain(
        chosen
            .iter()
            .map(|case| format!("{} ({})", case.title, case.source)),
    );
    for (line, title) in table.to_string().lines().zip(titles) {
        context.say(format_args!("{line}  {title}"))?;
    }
    Ok(())
}

fn run_cases(
    chosen: &[&Case],
    options: &Options,
    context: &Context,
    found: &mut Findings,
) -> anyhow::Result<()> {
    let progress = context.progress(chosen.len(), "verifying");
    for case in chosen {
        if context.is_interrupted() {
            break;
        }
        progress.set_message(case.name);
        let findings = match case.run(options) {
            Ok(findings) => findings,
            Err(error @ (VerifyError::NoReference | VerifyError::Table { .. })) => {
                return Err(error).with_context(|| format!("case \"{}\"", case.name));
            }
            // A problem that cannot be solved counts as a failed figure among the others.
            Err(error) => unsolved(case, &error),
        };
        progress.suspend(|| say_case(context, case, &findings))?;
        found.rows.extend(findings.rows);
        found.study.extend(findings.study);
        progress.inc(1);
    }
    Ok(())
}

fn unsolved(case: &Case, error: &VerifyError) -> Findings {
    let row = Row::with_error(
        case.name,
        format!("share of the case that was solved: {error}"),
        [1.0, 0.0],
        -1.0,
        0.0,
        0,
    );
    Findings {
        rows: vec![row],
        study: Vec::new(),
    }
}

/// Removes the study of an older run, so that it does not lie beside figures of this run.
fn remove_older(out: &OutDir) -> anyhow::Result<()> {
    for name in ["convergence.csv", "convergence.svg", "convergence.png"] {
        let path = out.path().join(name);
        match fs::remove_file(&path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                return Err(error).with_context(|| format!("cannot replace {}", path.display()));
            }
            _ => {}
        }
    }
    Ok(())
}

fn write(out: &OutDir, found: &Findings) -> anyhow::Result<()> {
    let mut table = out.table("verify.csv")?;
    for row in &found.rows {
        table.push(row)?;
    }
    table.finish()?;
    out.write_json("verify.json", &found.rows)?;
    if found.study.is_empty() {
        return Ok(());
    }
    let mut study = out.table("convergence.csv")?;
    for point in &found.study {
        study.push(point)?;
    }
    study.finish()?;
    picture::draw(found).save(out, "convergence")?;
    Ok(())
}
