//! The `palpa` command. Its code is in the library, so that tests can call it too.

use std::process::ExitCode;

fn main() -> ExitCode {
    palpa_cli::cli::main()
}
