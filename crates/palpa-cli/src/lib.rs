//! The command `palpa`: arguments, commands, and what they print.

// `println!` panics when the reader has gone, as in `palpa check … | head`: print through `cli::Context`.
#![warn(clippy::print_stdout, clippy::print_stderr)]

pub mod cli;
pub mod commands;
pub mod table;
