//! `rotorbench`: the command line. Everything is in the library; this file only dispatches.

use std::process::ExitCode;

fn main() -> ExitCode {
    rotorbench::cli::main()
}
