//! `rotorbench`: the command line. Everything is in the library; this file only dispatches.

#![forbid(unsafe_code)]

use std::process::ExitCode;

fn main() -> ExitCode {
    rotorbench::cli::main()
}
