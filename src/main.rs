//! `rotorbench`: the command line. Everything is in the library; this file only dispatches.

#![forbid(unsafe_code)]

use std::process::ExitCode;

#[global_allocator]
static MEMORY: rotorbench::memory::LongBlocks = rotorbench::memory::LongBlocks;

fn main() -> ExitCode {
    rotorbench::cli::main()
}
