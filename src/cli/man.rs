//! `rotorbench man`: a manual page for each command.

use std::fs;
use std::path::PathBuf;

use clap_mangen::Man;

use super::output::Force;
use super::usage_error::UsageError;
use super::{CliResult, Outcome, commands};
use crate::file::write_atomically;

/// Arguments of `man`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Folder to write `rotorbench.1`, `rotorbench-compare.1`, ... into; it is made where it is not there
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    #[command(flatten)]
    force: Force,
}

/// Runs the command; `command` is the whole command line.
pub fn run(arguments: &Arguments, command: clap::Command) -> CliResult {
    let folder = &arguments.folder;
    let mut command = commands::for_manual(command).disable_help_subcommand(true);
    command.build();
    let pages: Vec<(PathBuf, Man)> =
        pages(command).into_iter().map(|page| (folder.join(page.get_filename()), page)).collect();
    arguments.force.check(pages.iter().map(|(path, _)| path))?;
    fs::create_dir_all(folder).map_err(UsageError::at(folder))?;
    for (path, page) in pages {
        let mut text = Vec::new();
        page.render(&mut text)
            .and_then(|()| write_atomically(&path, &text))
            .map_err(UsageError::at(&path))?;
    }
    println!("{}", crate::report::files::manual_pages(folder));
    Ok(Outcome::Done)
}

/// The page of a command and those of the commands in it.
fn pages(command: clap::Command) -> Vec<Man> {
    let inside = command.get_subcommands().filter(|inside| !inside.is_hide_set()).cloned();
    let mut all: Vec<Man> = inside.flat_map(pages).collect();
    all.push(Man::new(command));
    all
}
