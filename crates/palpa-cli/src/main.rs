//! The `palpa` command; what it does is in the library, so that tests reach it too.

use std::process::ExitCode;

fn main() -> ExitCode {
    palpa_cli::cli::main()
}
