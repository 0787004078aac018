//! `rotorbench extend`: adds an effect to a model and shows the fall of the error.

use std::path::PathBuf;

use serde::Serialize;

use super::log_arguments::LogArguments;
use super::output::{AnswerArguments, NotesArgument, writable};
use super::usage_error::UsageError;
use super::watched::{cancellable, searching};
use super::{CliError, CliResult, Outcome};
use crate::cancel::Cancel;
use crate::compare::CompareConfig;
use crate::diagnose::diagnosis::ErrorSummary;
use crate::diagnose::{DiagnoseConfig, DiagnoseError};
use crate::model::Model;
use crate::report::findings::sentences;
use crate::report::notes;
use crate::report::{self, Page, json};
use crate::screening::Finding;
use crate::session::{self, Extended, Job, SessionError};

/// Arguments of `extend`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Model file to start from, or `paper`
    #[arg(long, default_value = "paper")]
    model: PathBuf,
    /// Effects to add
    #[arg(long, num_args = 1.., value_delimiter = ',', required_unless_present_any = ["step_back", "recalibrate"])]
    effect: Vec<String>,
    /// Add nothing: refit the model's own numbers, those whose change the logs ask for
    #[arg(long, conflicts_with_all = ["effect", "step_back"])]
    recalibrate: bool,
    /// Logs to fit on
    #[arg(long, num_args = 1.., required_unless_present = "step_back")]
    log: Vec<PathBuf>,
    /// Validation logs
    #[arg(long, num_args = 1..)]
    validate: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) logs: LogArguments,
    /// Undo the last step of the model's ladder instead
    #[arg(long, conflicts_with_all = ["effect", "log", "validate"])]
    step_back: bool,
    /// Windows over which the body runs freely [s]
    #[arg(value_parser = super::log_arguments::horizon, long, default_value_t = DiagnoseConfig::default().horizon)]
    horizon_s: f64,
    /// Model file to write
    #[arg(short, long)]
    output: PathBuf,
    #[command(flatten)]
    notes: NotesArgument,
    #[command(flatten)]
    answer: AnswerArguments,
}

/// The answer, as `--json` writes it.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Serialize)]
pub(super) struct ExtendAnswer<'a> {
    /// Ids of the effects that were added, in their order.
    added: &'a [String],
    /// The error before and after.
    error: &'a ErrorSummary,
    /// The model as it was saved.
    model: &'a Model,
    /// The findings as sentences.
    warnings: &'a [String],
    /// What to know about the logs and the answer.
    findings: &'a [Finding],
}

/// The answer of `--step-back`, as `--json` writes it.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Serialize)]
pub(super) struct Undone<'a> {
    /// Ids of the effects that the last step had added.
    undone: Option<&'a [String]>,
    /// The model as it was saved.
    model: &'a Model,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    // The model that it starts from, too: the ladder of the new one begins there.
    let inputs = arguments.log.iter().chain(&arguments.validate).chain([&arguments.model]);
    writable(
        std::iter::once(&arguments.output).chain(&arguments.answer.report),
        inputs,
        arguments.answer.force,
    )?;
    let model = session::open_model(&arguments.model)?;
    if arguments.step_back {
        return step_back(&model, arguments);
    }
    let (extended, page) = match cancellable(|cancel| work(&model, arguments, cancel))? {
        Work::Done(extended, page) => (extended, page),
        Work::NothingToChange { error, is_at_floor, findings } => {
            return nothing_to_change(&model, (&error, is_at_floor), &findings, arguments);
        }
    };
    let Extended { extension, findings, has_fallen } = &*extended;
    session::save_model(&extension.model, &arguments.output)?;
    if let Some((path, page)) = arguments.answer.report.as_ref().zip(page) {
        page.save(path)?;
    }
    let warnings = sentences(findings);
    if arguments.answer.json {
        let answer = ExtendAnswer {
            added: &arguments.effect,
            error: &extension.error,
            model: &extension.model,
            warnings: &warnings,
            findings,
        };
        println!("{}", json::answer(&answer)?);
    } else {
        print!("{}", report::story::extension(extension, &arguments.effect));
        print!("{}", notes::lines(&notes::of_all(findings), "Note: ", arguments.notes.detail()));
        println!("written: {}", arguments.output.display());
    }
    Ok(if *has_fallen { Outcome::Done } else { Outcome::FoundWanting })
}

/// What became of it, before anything is written.
enum Work {
    /// The model and its page.
    Done(Box<Extended>, Option<Page>),
    /// The model's own numbers are those that the logs ask for.
    NothingToChange { error: Box<ErrorSummary>, is_at_floor: bool, findings: Vec<Finding> },
}

/// Says that the model stays as it is: as it should where only noise is left, else something is missing.
fn nothing_to_change(
    model: &Model,
    (error, is_at_floor): (&ErrorSummary, bool),
    findings: &[Finding],
    arguments: &Arguments,
) -> CliResult {
    if arguments.answer.json {
        let warnings = sentences(findings);
        let answer = ExtendAnswer { added: &[], error, model, warnings: &warnings, findings };
        println!("{}", json::answer(&answer)?);
    } else if let Some((nothing, others)) = findings.split_first() {
        print!("{}", report::story::nothing_to_change(nothing, error));
        print!("{}", notes::lines(&notes::of_all(others), "Note: ", arguments.notes.detail()));
    }
    Ok(if is_at_floor { Outcome::Done } else { Outcome::FoundWanting })
}

fn work(model: &Model, arguments: &Arguments, cancel: &Cancel) -> Result<Work, CliError> {
    let config = DiagnoseConfig { horizon: arguments.horizon_s, ..DiagnoseConfig::default() };
    let train = session::open_all(&arguments.log, &arguments.logs.open_config(), &Job::unwatched(cancel))?;
    let validate =
        session::open_all(&arguments.validate, &arguments.logs.open_config(), &Job::unwatched(cancel))?;
    let logs = (&train[..], &validate[..]);
    let found = searching(cancel, |job| {
        if arguments.recalibrate {
            session::refit(model, logs, &config, job)
        } else {
            session::extend(model, &arguments.effect, logs, &config, job)
        }
    });
    let mut extended = match found {
        Err(SessionError::Diagnose(DiagnoseError::NothingChanged { error, is_at_floor, findings })) => {
            return Ok(Work::NothingToChange { error, is_at_floor, findings });
        }
        found => Box::new(found?),
    };
    session::name_after(&mut extended.extension.model, &arguments.output);
    if arguments.answer.report.is_none() {
        return Ok(Work::Done(extended, None));
    }
    let shown = if validate.is_empty() { &train } else { &validate };
    let windows = CompareConfig { horizon_s: arguments.horizon_s, ..CompareConfig::default() };
    let extension = &extended.extension;
    let job = Job::unwatched(cancel);
    let compared = session::compare_extension(model, &extension.model, shown, &windows, &job)?;
    let page = report::diagnosis::extension_page(extension, &arguments.effect, &compared, shown);
    Ok(Work::Done(extended, Some(page)))
}

/// Undoes the last step of the model's ladder.
fn step_back(model: &Model, arguments: &Arguments) -> CliResult {
    let mut back = session::step_back(model)
        .map_err(|error| UsageError::Model { path: arguments.model.clone(), error: Box::new(error) })?;
    session::name_after(&mut back, &arguments.output);
    session::save_model(&back, &arguments.output)?;
    if arguments.answer.json {
        let undone = model.ladder.last().map(|step| &step.added[..]);
        println!("{}", json::answer(&Undone { undone, model: &back })?);
    } else {
        println!("{}", report::files::model_with_steps(&arguments.output, back.ladder.len()));
    }
    Ok(Outcome::Done)
}
