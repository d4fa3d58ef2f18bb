//! Shared by all commands: options, exit codes, errors, Ctrl-C.
//!
//! | exit code | meaning |
//! | --- | --- |
//! | 0 | done |
//! | 1 | done, and the result is not good (a check failed) |
//! | 2 | bad input, or an output that cannot be written |
//! | 101 | a bug of ours |
//! | 130 | interrupted; what was done is in the output folder |

use std::io::{self, ErrorKind, Write as _};
use std::panic::{self, PanicHookInfo};
use std::path::PathBuf;
use std::process::ExitCode;

use anstyle::{AnsiColor, Style};
use clap::{CommandFactory as _, FromArgMatches as _, Parser};
use palpa::one_paragraph;

use crate::commands::{Command, Outcome};

mod context;

pub use context::Context;

const ERROR: Style = AnsiColor::Red.on_default().bold();

/// Feel what lies beneath the skin.
///
/// Palpa grows a skin surface inward into layers of tissue. When a tool presses the skin, Palpa
/// computes how the tissue deforms and the force that pushes back, in newtons.
#[derive(Debug, Parser)]
#[command(name = "palpa", version, max_term_width = 100)]
struct Cli {
    #[command(flatten)]
    options: Options,
    #[command(subcommand)]
    command: Command,
}

/// The options of every command.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct Options {
    /// Print the result as JSON on standard output, and nothing else
    #[arg(long, global = true)]
    pub json: bool,
    /// Folder for the output files [default: out/COMMAND]
    #[arg(long, global = true, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// Runs the command line of this process.
pub fn main() -> ExitCode {
    panic::set_hook(Box::new(report_bug));
    let mut matches = Cli::command().get_matches();
    let name = matches.subcommand_name().unwrap_or_default().to_owned();
    let cli = Cli::from_arg_matches_mut(&mut matches)
        .unwrap_or_else(|error| error.format(&mut Cli::command()).exit());
    let context = Context::new(cli.options, name);
    if let Err(error) = context.watch_interrupts() {
        print_error(&error);
        return ExitCode::from(2);
    }
    let outcome = cli.command.run(&context);
    match outcome.and_then(|outcome| {
        io::stdout().flush()?;
        Ok(outcome)
    }) {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::NotGood) => ExitCode::from(1),
        Ok(Outcome::Interrupted) => {
            eprint_quietly(&match context.opened_out_dir() {
                Some(dir) => format!("interrupted; what was done is in {}", dir.display()),
                None => "interrupted".to_owned(),
            });
            ExitCode::from(130)
        }
        // The reader of the output, such as `head`, has closed it. This is not an error.
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            print_error(&error);
            ExitCode::from(2)
        }
    }
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        cause
            .downcast_ref::<io::Error>()
            .is_some_and(|e| e.kind() == ErrorKind::BrokenPipe)
            || cause
                .downcast_ref::<serde_json::Error>()
                .is_some_and(|e| e.io_error_kind() == Some(ErrorKind::BrokenPipe))
    })
}

fn print_error(error: &anyhow::Error) {
    eprint_quietly(&format!("{ERROR}error:{ERROR:#} {}", one_paragraph(error)));
}

/// Prints one line on standard error, coloured only on a terminal. A closed standard error is
/// ignored.
fn eprint_quietly(line: &str) {
    let _ = writeln!(anstream::stderr(), "{line}");
}

fn report_bug(info: &PanicHookInfo<'_>) {
    let message = info
        .payload_as_str()
        .unwrap_or("no message")
        .replace('\n', " ");
    let place = info
        .location()
        .map_or_else(String::new, |at| format!(" ({}:{})", at.file(), at.line()));
    eprint_quietly(&format!(
        "{ERROR}error:{ERROR:#} this is a bug in palpa {}, not in your input: {message}{place}. \
         Please report it with the command line and, if you can, the files.",
        env!("CARGO_PKG_VERSION"),
    ));
}
