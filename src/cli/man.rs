//! `rotorbench man`: a manual page for each command.

use std::fs;
use std::path::PathBuf;

use clap::CommandFactory as _;

use super::{CliError, CliResult, CommandLine, Outcome, commands};

/// Arguments of `man`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Folder to write `rotorbench.1`, `rotorbench-compare.1`, ... into; it is made where it is not there
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let folder = &arguments.folder;
    let failed = |error: std::io::Error| CliError::new(format!("{}: {error}", folder.display()));
    fs::create_dir_all(folder).map_err(failed)?;
    clap_mangen::generate_to(commands::for_manual(CommandLine::command()), folder).map_err(failed)?;
    println!("{}", crate::report::files::manual_pages(folder));
    Ok(Outcome::Done)
}
