//! The command `palpa`: arguments, commands, and their output.

// `println!` panics if the reader has closed the pipe, as in `palpa check … | head`; print through
// `cli::Context` instead.
#![warn(clippy::print_stdout, clippy::print_stderr)]

pub mod cli;
pub mod commands;
pub mod named_scene;
pub mod table;
