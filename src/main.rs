//! The `fretwear` command.

#![forbid(unsafe_code)]

mod cli;
mod progress;
mod terminal;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::main()
}
