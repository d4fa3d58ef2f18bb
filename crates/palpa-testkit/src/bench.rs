//! The command `palpa`, run in a folder of its own.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde_json::Value;
use tempfile::TempDir;

/// A folder that is removed in the end, and the command that runs in it, so that no path of this
/// machine gets into its output.
#[derive(Debug)]
pub struct Bench {
    exe: PathBuf,
    folder: TempDir,
}

impl Bench {
    /// An empty folder for a command: `env!("CARGO_BIN_EXE_palpa")`.
    ///
    /// # Panics
    /// When no folder can be made.
    pub fn new(exe: impl Into<PathBuf>) -> Self {
        Self {
            exe: exe.into(),
            folder: tempfile::tempdir().expect("a temporary folder"),
        }
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// The path of a file in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder().join(name)
    }

    /// Writes a file, and returns its name.
    ///
    /// # Panics
    /// When it cannot be written.
    pub fn file<'a>(&self, name: &'a str, content: impl Into<String>) -> &'a str {
        fs::write(self.path(name), content.into()).expect(name);
        name
    }

    /// Reads a file that must be there.
    ///
    /// # Panics
    /// When it cannot be read.
    pub fn read(&self, name: &str) -> String {
        let text = fs::read_to_string(self.path(name));
        text.unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// The command with arguments, not yet started; its standard input is empty.
    pub fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(&self.exe);
        command
            .args(args)
            .current_dir(self.folder())
            .stdin(Stdio::null());
        command
    }

    /// Runs the command to its end.
    ///
    /// # Panics
    /// When it cannot be started.
    pub fn output(&self, args: &[&str]) -> Output {
        self.command(args).output().expect("palpa runs")
    }

    /// Runs the command: exit code, standard output and standard error.
    ///
    /// # Panics
    /// When it ends by a signal, or writes anything but UTF-8.
    pub fn run(&self, args: &[&str]) -> (i32, String, String) {
        let output = self.output(args);
        let text = |bytes| String::from_utf8(bytes).expect("palpa writes UTF-8");
        let (stdout, stderr) = (text(output.stdout), text(output.stderr));
        let Some(code) = output.status.code() else {
            panic!("{args:?}: {}: {stderr}", output.status);
        };
        (code, stdout, stderr)
    }

    /// Runs the command, which must write JSON to standard output: exit code and the JSON.
    ///
    /// # Panics
    /// As [`Bench::run`], and when standard output is not JSON.
    pub fn json(&self, args: &[&str]) -> (i32, Value) {
        let (code, stdout, stderr) = self.run(args);
        match serde_json::from_str(&stdout) {
            Ok(json) => (code, json),
            Err(error) => panic!("{args:?}: exit code {code}, {error}: {stdout}{stderr}"),
        }
    }

    /// Runs the command, which must succeed and write JSON.
    ///
    /// # Panics
    /// As [`Bench::json`], and when the exit code is not 0.
    pub fn report(&self, args: &[&str]) -> Value {
        let (code, stdout, stderr) = self.run(args);
        assert_eq!(code, 0, "{args:?}: {stdout}{stderr}");
        serde_json::from_str(&stdout).unwrap_or_else(|error| panic!("{args:?}: {error}: {stdout}"))
    }
}

/// Sends a process what Ctrl-C sends. Windows has no command for it.
///
/// # Panics
/// When there is no such process.
#[cfg(unix)]
pub fn interrupt(process: &std::process::Child) {
    let kill = Command::new("kill")
        .args(["-INT", &process.id().to_string()])
        .status()
        .expect("kill runs");
    assert!(kill.success());
}
