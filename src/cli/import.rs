//! `rotorbench import`: read a foreign log into the CSV log format, and say what it is like.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::log_arguments::LogArguments;
use super::output::{Force, writable};
use super::usage_error::UsageError;
use super::watched::cancellable;
use super::{CliError, CliResult, Outcome};
use crate::file::write_atomically;
use crate::log::Notes;
use crate::log::can_capture::CaptureNotes;
use crate::report::findings::sentences;
use crate::report::shell::quoted;
use crate::report::{guess, import};
use crate::screening::summary::LogSummary;
use crate::session::{self, GuessedLog, Job, OpenConfig, Opened};

/// Arguments of `import`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The log, of any format that is read: what it is, its first bytes say. The columns of a foreign CSV are guessed and
    /// shown; --mapping says what they mean
    log: PathBuf,
    #[command(flatten)]
    pub(super) logs: LogArguments,
    /// Write what the columns of a foreign log may mean as a mapping file, to be looked at and mended
    #[arg(long, value_name = "M.toml", conflicts_with_all = ["mapping", "output"])]
    write_mapping: Option<PathBuf>,
    /// What a column becomes, where the guess of it is wrong: a signal and the unit it comes in, or `-` to leave it out; of commands the
    /// units are -, %, us, ms, dshot and 8bit. May be given several times
    #[arg(long, value_name = "COLUMN=SIGNAL[:UNIT]", conflicts_with_all = ["mapping", "output"])]
    column: Vec<String>,
    /// Model of the bench that the log's columns are held against, a file or `paper`: units that were mistaken show beside it
    #[arg(long, value_name = "M", default_value = "paper")]
    model: PathBuf,
    /// Write the log here; without it only the report is made
    #[arg(short, long, value_name = "FILE.csv")]
    output: Option<PathBuf>,
    #[command(flatten)]
    force: Force,
    /// Report as JSON on standard output
    #[arg(long)]
    json: bool,
}

/// What `import` found.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Serialize)]
pub(super) struct ImportAnswer<'a> {
    /// Name of the log.
    source: &'a str,
    /// What it was recognised as.
    format: &'static str,
    /// SHA-256 of its content.
    sha256: &'a str,
    /// What reading it left out, cut or merged.
    notes: &'a Notes,
    /// What became of its frames, where it is a capture of a bus.
    #[serde(skip_serializing_if = "Option::is_none")]
    frames: Option<&'a CaptureNotes>,
    /// What it is like; its own `findings` are the codes of `warnings`.
    findings: &'a LogSummary,
    /// The findings as sentences, in their order.
    warnings: Vec<String>,
    /// The log that was written.
    output: Option<&'a Path>,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let beside: Vec<PathBuf> = arguments.logs.inputs().collect();
    let inputs = std::iter::once(&arguments.log).chain(&beside);
    writable(arguments.output.iter().chain(&arguments.write_mapping), inputs, arguments.force)?;
    if !arguments.logs.has_mapping()
        && let Some(mut guessed) =
            cancellable(|cancel| Ok(session::guess_columns(&arguments.log, &Job::unwatched(cancel))?))?
    {
        arguments.column.iter().try_for_each(|said| mend(&mut guessed, said))?;
        return show_guess(arguments, &guessed);
    }
    if arguments.write_mapping.is_some() || !arguments.column.is_empty() {
        return Err(UsageError::NothingGuessed { log: arguments.log.clone() }.into());
    }
    let config = OpenConfig { leaves_out: true, ..arguments.logs.open_config() };
    let model = session::open_model(&arguments.model)?;
    let (opened, findings) = cancellable(|cancel| {
        let job = Job::unwatched(cancel);
        let opened = session::open(&arguments.log, &config, &job)?;
        let findings = session::summarize(&opened.log, &model, &job)?;
        Ok((opened, findings))
    })?;
    let Opened { log, format, notes, frames } = opened;
    if let Some(output) = &arguments.output {
        session::save_log(log.raw(), output)?;
    }
    if arguments.json {
        let report = ImportAnswer {
            source: log.source_name(),
            format,
            sha256: log.raw().sha256(),
            notes: &notes,
            frames: frames.as_ref(),
            findings: &findings,
            warnings: sentences(&findings.findings),
            output: arguments.output.as_deref(),
        };
        println!("{}", crate::report::json::answer(&report)?);
    } else {
        print!("{}", import::text(log.raw(), &notes, &findings));
        if let Some(frames) = &frames {
            print!("{}", import::frames(frames));
        }
        if let Some(output) = &arguments.output {
            println!("written: {}", output.display());
        }
    }
    Ok(Outcome::Done)
}

/// Mends a guess by `COLUMN=SIGNAL[:UNIT]`; signals have neither `=` nor `:`, columns may.
fn mend(guessed: &mut GuessedLog, said: &str) -> Result<(), CliError> {
    let (column, becomes) = said.rsplit_once('=').ok_or_else(|| {
        let form = "COLUMN=SIGNAL or COLUMN=SIGNAL:UNIT";
        UsageError::Form { option: "--column", value: said.to_owned(), form }
    })?;
    let (signal, unit) = match becomes.split_once(':') {
        Some((signal, unit)) => (signal, Some(unit)),
        None => (becomes, None),
    };
    Ok(guessed.mend(column, signal, unit)?)
}

/// Shows what the columns of a foreign log may mean, or writes it as a mapping file.
fn show_guess(arguments: &Arguments, guessed: &GuessedLog) -> CliResult {
    let log = arguments.log.display().to_string();
    if arguments.output.is_some() {
        return Err(UsageError::Guessed { log: arguments.log.clone() }.into());
    }
    if let Some(path) = &arguments.write_mapping {
        let text = guess::mapping_file(guessed, &log)?;
        write_atomically(path, text.as_bytes()).map_err(UsageError::at(path))?;
    }
    if arguments.json {
        println!("{}", crate::report::json::answer(guessed)?);
        return Ok(Outcome::Done);
    }
    print!("{}", guess::text(guessed));
    match &arguments.write_mapping {
        Some(path) => println!("written: {}", path.display()),
        None => print!("{}", guess::next_step(&quoted(&log))),
    }
    Ok(Outcome::Done)
}
