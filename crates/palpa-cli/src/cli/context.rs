//! The context of a command: output folder, messages, interruption.

use std::fmt::Display;
use std::io::{self, IsTerminal, Write as _};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use anyhow::Context as _;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use super::Options;
use palpa_plot::output::OutDir;

/// The context of a running command.
///
/// A long command polls [`is_interrupted`](Self::is_interrupted) in its loop. When it is set, the
/// command completes its files with the results so far and returns
/// [`Outcome::Interrupted`](crate::commands::Outcome::Interrupted).
#[derive(Debug)]
pub struct Context {
    is_json: bool,
    out: Option<PathBuf>,
    command: String,
    opened: OnceLock<OutDir>,
    interrupted: Arc<AtomicBool>,
    is_recording: Arc<AtomicBool>,
}

impl Context {
    /// Context of the command named `command`; its default output folder is `out/<command>`.
    pub fn new(options: Options, command: String) -> Self {
        Self {
            is_json: options.json,
            out: options.out,
            command,
            opened: OnceLock::new(),
            interrupted: Arc::default(),
            is_recording: Arc::default(),
        }
    }

    /// Whether standard output is JSON (`--json`).
    pub fn is_json(&self) -> bool {
        self.is_json
    }

    /// The path of `--out`, if it was given: for commands that write files only when asked to.
    pub fn given_out(&self) -> Option<&Path> {
        self.out.as_deref()
    }

    /// The output folder; created if it does not exist. Call this before the long work, so that an
    /// error comes early.
    ///
    /// # Errors
    /// If the folder cannot be created or written to.
    pub fn out_dir(&self) -> anyhow::Result<&OutDir> {
        if let Some(dir) = self.opened.get() {
            return Ok(dir);
        }
        let path = match &self.out {
            Some(path) => path.clone(),
            None => Path::new("out").join(&self.command),
        };
        let dir = OutDir::create(path)?;
        Ok(self.opened.get_or_init(|| dir))
    }

    pub(super) fn opened_out_dir(&self) -> Option<&Path> {
        self.opened.get().map(OutDir::path)
    }

    /// Prints a line of the readable report on standard output; nothing with `--json`. If the
    /// reader has closed the output (`palpa … | head`), the command goes on.
    ///
    /// # Errors
    /// If standard output is full.
    pub fn say(&self, line: impl Display) -> anyhow::Result<()> {
        if self.is_json {
            return Ok(());
        }
        unless_closed(writeln!(io::stdout().lock(), "{line}"))
    }

    /// Prints the result as JSON, with `--json` only.
    ///
    /// # Errors
    /// If standard output is full.
    pub fn json(&self, result: &impl Serialize) -> anyhow::Result<()> {
        if !self.is_json {
            return Ok(());
        }
        let mut stdout = io::stdout().lock();
        let written = serde_json::to_writer_pretty(&mut stdout, result).map_err(io::Error::from);
        unless_closed(written.and_then(|()| writeln!(stdout)))
    }

    /// Prints a note for people on standard error, beside the result.
    pub fn note(&self, line: impl Display) {
        super::eprint_quietly(&line.to_string());
    }

    /// Whether the user has asked to stop (Ctrl-C).
    pub fn is_interrupted(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
    }

    /// A progress bar over `len` steps, shown only if standard error is a terminal. It vanishes
    /// when dropped.
    pub fn progress(&self, len: usize, what: &'static str) -> ProgressBar {
        if self.is_json || !io::stderr().is_terminal() {
            return ProgressBar::hidden();
        }
        let style = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} {eta}")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        let bar = ProgressBar::new(len as u64)
            .with_style(style)
            .with_message(what)
            .with_finish(indicatif::ProgressFinish::AndClear);
        bar.enable_steady_tick(Duration::from_millis(200));
        bar
    }

    /// From this call on, an interrupt keeps the results so far: the command polls
    /// [`is_interrupted`](Self::is_interrupted). Before it there is nothing to keep, and Ctrl-C
    /// ends the command at once.
    pub fn begin_recording(&self) {
        self.is_recording.store(true, Ordering::Relaxed);
    }

    /// While recording, the first Ctrl-C asks the command to stop; the second stops it at once.
    pub(super) fn watch_interrupts(&self) -> anyhow::Result<()> {
        let interrupted = Arc::clone(&self.interrupted);
        let is_recording = Arc::clone(&self.is_recording);
        ctrlc::set_handler(move || {
            if interrupted.swap(true, Ordering::Relaxed) || !is_recording.load(Ordering::Relaxed) {
                std::process::exit(130);
            }
            super::eprint_quietly("stopping after this step; Ctrl-C again to stop at once");
        })
        .context("cannot listen for Ctrl-C")
    }
}

/// Treats a closed standard output as success.
fn unless_closed(written: io::Result<()>) -> anyhow::Result<()> {
    match written {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(error).context("cannot write to standard output")
        }
        _ => Ok(()),
    }
}
