//! `rotorbench completions`: what a shell needs to complete commands and options.

use super::{CliResult, Outcome};

/// Arguments of `completions`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Which shell
    shell: clap_complete::Shell,
}

/// Runs the command; `command` is the whole command line.
pub fn run(arguments: &Arguments, command: &mut clap::Command) -> CliResult {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, command, "rotorbench", &mut script);
    print!("{}", String::from_utf8_lossy(&script));
    Ok(Outcome::Done)
}
