//! `rotorbench compare`: where the model fails; with `--runs`, how controllers answer a disturbance.

use std::path::PathBuf;

use super::log_arguments::LogArguments;
use super::output::{AnswerArguments, NotesArgument, writable};
use super::usage_error::UsageError;
use super::watched::cancellable;
use super::{CliResult, Outcome};
use crate::cancel::Cancel;
use crate::compare::{self, CompareConfig};
use crate::emulate::Impulse;
use crate::report::comparison;
use crate::report::json;
use crate::report::next_steps::{self, Typed};
use crate::report::shell::quoted;
use crate::session::{self, Job};

/// Arguments of `compare`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Model file, or `paper`; several are held side by side
    #[arg(long, default_value = "paper")]
    model: Vec<PathBuf>,
    /// Log of any format that is read; several are compared one by one
    #[arg(long, required_unless_present = "runs", num_args = 1..)]
    log: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) logs: LogArguments,
    /// Instead of models: recordings of runs in which the body was struck, controllers side by side
    #[arg(long, value_name = "FILE.mcap", num_args = 1.., conflicts_with_all = ["model", "log", "horizon_s", "signals"])]
    runs: Vec<PathBuf>,
    /// What struck the body, where a recording does not say it: `at_s:duration_s:torque_nm`, from the controller's first
    /// step on
    #[arg(long, value_name = "IMPULSE", requires = "runs", allow_hyphen_values = true)]
    impulse: Option<String>,
    /// Horizon of the windows over which the body runs freely [s]
    #[arg(value_parser = super::log_arguments::horizon, long, alias = "horizon", default_value_t = CompareConfig::default().horizon_s)]
    horizon_s: f64,
    #[command(flatten)]
    notes: NotesArgument,
    #[command(flatten)]
    answer: AnswerArguments,
    /// Write measured, modelled and unknown signals as columns beside the log's own (CSV; one log, last model)
    #[arg(long, value_name = "FILE")]
    signals: Option<PathBuf>,
}

/// Runs the command: exit 1 when no model is at the noise floor of every log.
pub fn run(arguments: &Arguments) -> CliResult {
    let inputs = arguments.model.iter().chain(&arguments.log).chain(&arguments.runs);
    writable(arguments.answer.report.iter().chain(&arguments.signals), inputs, arguments.answer.force)?;
    if !arguments.runs.is_empty() {
        return side_by_side(arguments);
    }
    if arguments.signals.is_some() && arguments.log.len() > 1 {
        return Err(UsageError::SignalsOfLogs.into());
    }
    let models =
        arguments.model.iter().map(|path| session::open_model(path)).collect::<Result<Vec<_>, _>>()?;
    let signals = arguments.answer.report.is_some() || arguments.signals.is_some();
    let config = CompareConfig { horizon_s: arguments.horizon_s, signals };
    let (logs, found, page, signals) = cancellable(|cancel| {
        let job = Job::unwatched(cancel);
        let logs = session::open_all(&arguments.log, &arguments.logs.open_config(), &job)?;
        let found = session::compare(&models, &logs, &config, &job)?;
        let page = arguments.answer.report.as_ref().map(|path| (path, comparison::page(&found, &logs)));
        let last = logs.first().zip(found.first().and_then(|models| models.last()));
        let signals = match (&arguments.signals, last) {
            (Some(path), Some((log, comparison))) => Some((path, comparison.signals(log.raw())?)),
            _ => None,
        };
        Ok((logs, found, page, signals))
    })?;
    if let Some((path, page)) = page {
        page.save(path)?;
    }
    if let Some((path, signals)) = signals {
        session::save_log(&signals, path)?;
    }
    if arguments.answer.json {
        let comparisons = found.iter().flatten().map(json::comparison).collect::<Result<Vec<_>, _>>()?;
        println!("{}", json::answer(&serde_json::json!({ "comparisons": comparisons }))?);
    } else {
        print!(
            "{}",
            comparison::text(&found, &logs, arguments.notes.detail(), &ask_what_is_missing(arguments))
        );
    }
    Ok(if compare::is_adequate(&found) { Outcome::Done } else { Outcome::FoundWanting })
}

/// The command that goes on from here, of the last model.
fn ask_what_is_missing(arguments: &Arguments) -> String {
    let logs: Vec<String> = arguments.log.iter().map(|path| quoted(&path.display().to_string())).collect();
    let model = arguments.model.last().map_or_else(String::new, |path| quoted(&path.display().to_string()));
    let typed = Typed { logs: arguments.logs.as_typed(), ..Typed::default() };
    next_steps::diagnose(&model, (&logs, &[]), &typed)
}

/// Controllers side by side: there is nothing to be found wanting.
fn side_by_side(arguments: &Arguments) -> CliResult {
    let impulse = arguments.impulse.as_deref().map(super::emulate::impulse).transpose()?;
    if let Some(it) = impulse.filter(|it| !(it.at_s >= 0.0 && it.duration_s > 0.0 && it.torque.is_finite())) {
        let Impulse { at_s, duration_s, torque } = it;
        return Err(UsageError::Impulse { at_s, duration_s, torque }.into());
    }
    // Reading recordings is short: Ctrl-C ends the program as it ends any other.
    let compared = session::compare_runs(&arguments.runs, impulse, &Job::unwatched(&Cancel::default()))?;
    if let Some(path) = &arguments.answer.report {
        compared.page().save(path)?;
    }
    if arguments.answer.json {
        println!("{}", json::answer(&json::with_sentences(&compared, &compared.findings)?)?);
    } else {
        print!("{}", compared.text());
    }
    Ok(Outcome::Done)
}
