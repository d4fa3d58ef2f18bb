//! The commands, one module each.
//!
//! A command module has `pub struct Args` (derives [`clap::Args`]; its doc comments are the help
//! text) and `pub fn run(args: &Args, context: &Context) -> anyhow::Result<Outcome>`. To add one:
//! write the module, name it below in `pub mod`, [`Command`] and [`Command::run`], and in the list of
//! commands in `README.md`. Its tests are a file of `tests/it`, with its `mod` in
//! `tests/it/main.rs`.

use clap::Subcommand;

pub mod bench;
pub mod check;
pub mod export;
pub mod loop_report;
pub mod press;
pub mod replay;
pub mod reproduce;
pub mod scenes;
pub mod schema;
pub mod verify;
pub mod view;
pub mod z_width;

use crate::cli::Context;

/// How a command ended without an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The command did its work, and the result is good. Exit code 0
    Done,
    /// The command did its work, but the result is not good. Exit code 1
    NotGood,
    /// The command was interrupted and left complete files of the results until then. Exit code 130
    Interrupted,
}

/// A command with its arguments.
#[derive(Debug, Subcommand)]
#[expect(missing_docs, reason = "a command's help text stands at its `Args`")]
pub enum Command {
    Bench(bench::Args),
    Check(check::Args),
    Export(export::Args),
    LoopReport(loop_report::Args),
    Press(press::Args),
    Replay(replay::Args),
    Reproduce(reproduce::Args),
    Scenes(scenes::Args),
    Schema(schema::Args),
    Verify(verify::Args),
    View(view::Args),
    ZWidth(z_width::Args),
}

impl Command {
    /// Runs the command.
    ///
    /// # Errors
    /// If the input is bad, or a result cannot be written.
    pub fn run(&self, context: &Context) -> anyhow::Result<Outcome> {
        match self {
            Self::Bench(args) => bench::run(args, context),
            Self::Check(args) => check::run(args, context),
            Self::Export(args) => export::run(args, context),
            Self::LoopReport(args) => loop_report::run(args, context),
            Self::Press(args) => press::run(args, context),
            Self::Replay(args) => replay::run(args, context),
            Self::Reproduce(args) => reproduce::run(args, context),
            Self::Scenes(args) => scenes::run(args, context),
            Self::Schema(args) => schema::run(args, context),
            Self::Verify(args) => verify::run(args, context),
            Self::View(args) => view::run(args, context),
            Self::ZWidth(args) => z_width::run(args, context),
        }
    }
}
