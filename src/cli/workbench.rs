//! `rotorbench workbench`: the page on the user's own machine.

use std::fs::{File, Permissions};
use std::io::{self, Write as _};
use std::os::unix::fs::{OpenOptionsExt as _, PermissionsExt as _};
use std::path::PathBuf;
use std::process::{Command, Stdio};

use tempfile::TempDir;

use super::operate::BenchArguments;
use super::{CliResult, Outcome};
use crate::report::workbench as report;
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
        (!arguments.no_open).then(|| open(address)).flatten()
    })?;
    Ok(Outcome::Done)
}

/// Asks the desktop for a browser; where there is none, the address was printed. The browser is led there by a file that only
/// its user can read, and that goes when what is returned is dropped: what a program is called with, all users of the machine
/// see.
fn open(address: &str) -> Option<TempDir> {
    let silent = || Stdio::null();
    let started = redirect(address).and_then(|(folder, file)| {
        let mut browser = Command::new("xdg-open");
        browser.arg(&file).stdin(silent()).stdout(silent()).stderr(silent()).spawn()?;
        Ok(folder)
    });
    if started.is_err() {
        println!("{}", report::NO_BROWSER);
    }
    started.ok()
}

/// A folder of the user's own with a page that leads to the address. Not a hidden one, nor that of temporary files, where there
/// is a home: a browser in a sandbox of its own sees neither.
fn redirect(address: &str) -> io::Result<(TempDir, PathBuf)> {
    let mut private = tempfile::Builder::new();
    private.prefix("rotorbench-open-").permissions(Permissions::from_mode(0o700));
    let at_home = std::env::home_dir().filter(|home| home.is_absolute()).map(|home| private.tempdir_in(home));
    let folder = match at_home {
        Some(Ok(folder)) => folder,
        _ => private.tempdir()?,
    };
    let path = folder.path().join("workbench.html");
    let mut file = File::options().write(true).create_new(true).mode(0o600).open(&path)?;
    file.write_all(report::redirect(address).as_bytes())?;
    Ok((folder, path))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn the_file_with_the_token_is_its_users_alone_and_goes() {
        let address = "http://127.0.0.1:8000/?token=0a1b";
        let (folder, file) = redirect(address).expect("a file");
        let mode = |path: &Path| path.metadata().expect("it is there").permissions().mode() & 0o777;
        assert_eq!((mode(folder.path()), mode(&file)), (0o700, 0o600));
        assert!(std::fs::read_to_string(&file).expect("text").contains(&format!("url={address}\"")));
        drop(folder);
        assert!(!file.exists());
    }
}
