//! `rotorbench workbench`: the page on the user's own machine.

use std::path::PathBuf;
use std::process::{Command, Stdio};

use super::operate::BenchArguments;
use super::{CliResult, Outcome};
use crate::rt::cancel_on_signals;
use crate::workbench::{self, WorkbenchConfig};

/// Arguments of `workbench`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Logs of any format, the last of several held out; a folder may be looked through. None: the demonstration's two logs,
    /// flown into `rotorbench-demo/` where they are not there yet
    log: Vec<PathBuf>,
    /// Model file beside the paper's; may be given several times
    #[arg(long, value_name = "MODEL")]
    model: Vec<PathBuf>,
    /// A session that the page saved
    #[arg(long, value_name = "FILE.toml")]
    session: Option<PathBuf>,
    #[command(flatten)]
    pub(super) bench: BenchArguments,
    /// Port on 127.0.0.1; 0 = any that is free
    #[arg(long, default_value_t = 0)]
    port: u16,
    /// Only print the address
    #[arg(long)]
    no_open: bool,
}

/// Runs the command until Ctrl-C.
pub fn run(arguments: &Arguments) -> CliResult {
    let config = WorkbenchConfig {
        logs: arguments.log.clone(),
        models: arguments.model.clone(),
        session: arguments.session.clone(),
        bench: arguments.bench.load()?,
        bench_file: arguments.bench.config.clone(),
        port: arguments.port,
    };
    let cancel = cancel_on_signals()?;
    workbench::serve(&config, &cancel, |address| {
        println!("{address}");
        if !arguments.no_open {
            open(address);
        }
    })?;
    Ok(Outcome::Done)
}

/// Asks the desktop for a browser; where there is none, the address was printed.
fn open(address: &str) {
    let silent = || Stdio::null();
    let started =
        Command::new("xdg-open").arg(address).stdin(silent()).stdout(silent()).stderr(silent()).spawn();
    if started.is_err() {
        println!("{}", crate::report::workbench::NO_BROWSER);
    }
}
