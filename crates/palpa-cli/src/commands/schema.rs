//! `palpa schema`: the JSON Schema of scene files.

use crate::cli::Context;
use crate::commands::Outcome;

/// Print the JSON Schema of scene files
///
/// An editor that has the schema completes keys and shows the meaning, unit and default of each.
#[derive(Debug, clap::Args)]
pub struct Args {}

/// Prints the schema on standard output. It is JSON with or without `--json`.
///
/// # Errors
/// If standard output cannot be written.
pub fn run(_: &Args, context: &Context) -> anyhow::Result<Outcome> {
    let schema = palpa_scene::scene_schema();
    context.json(&schema)?;
    context.say(format_args!("{schema:#}"))?;
    Ok(Outcome::Done)
}
