//! `rotorbench diagnose`: which physical effect is missing.

use std::path::PathBuf;

use super::log_arguments::LogArguments;
use super::output::{Force, writable};
use super::watched::{cancellable, searching};
use super::{CliError, CliResult, Outcome};
use crate::compare::CompareConfig;
use crate::diagnose::{DiagnoseConfig, Verdict};
use crate::report;
use crate::report::json;
use crate::session::{self, Job};

/// Arguments of `diagnose`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Model file, or `paper`
    #[arg(long, default_value = "paper")]
    model: PathBuf,
    /// Logs to fit on
    #[arg(long, required = true, num_args = 1..)]
    log: Vec<PathBuf>,
    /// Validation logs; without them every third stretch of the training logs is held out
    #[arg(long, num_args = 1..)]
    validate: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) logs: LogArguments,
    /// Windows over which the body runs freely [s]
    #[arg(value_parser = super::log_arguments::horizon, long, default_value_t = DiagnoseConfig::default().horizon)]
    horizon_s: f64,
    #[command(flatten)]
    force: Force,
    /// Answer as JSON on standard output
    #[arg(long)]
    json: bool,
    /// Write a page with the whole story (HTML)
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let inputs = arguments.log.iter().chain(&arguments.validate).chain([&arguments.model]);
    writable(&arguments.report, inputs, arguments.force)?;
    let model = session::open_model(&arguments.model)?;
    let config = DiagnoseConfig { horizon: arguments.horizon_s };
    let named = |paths: &[PathBuf]| paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>();
    let model_name = arguments.model.display().to_string();
    let (diagnosis, next, page) = cancellable(|cancel| {
        let train =
            session::open_all(&arguments.log, &arguments.logs.open_config(), &Job::unwatched(cancel))?;
        let validate =
            session::open_all(&arguments.validate, &arguments.logs.open_config(), &Job::unwatched(cancel))?;
        let diagnosis = searching(cancel, |job| session::diagnose(&model, &train, &validate, &config, job))?;
        let next = report::verdict::next_steps(
            &diagnosis,
            &model_name,
            (&named(&arguments.log), &named(&arguments.validate)),
            &arguments.logs.as_typed(),
        );
        let shown = if validate.is_empty() { &train } else { &validate };
        let windows = CompareConfig { horizon_s: arguments.horizon_s, ..CompareConfig::default() };
        let job = Job::unwatched(cancel);
        let page = arguments.report.as_ref().map(|path| {
            let compared = session::compare_extension(&model, &diagnosis.model, shown, &windows, &job)?;
            Ok::<_, CliError>((path, report::diagnosis::page(&diagnosis, &compared, shown, &next)))
        });
        let page = page.transpose()?;
        Ok((diagnosis, next, page))
    })?;
    if let Some((path, page)) = page {
        page.save(path)?;
    }
    if arguments.json {
        println!("{}", json::answer(&json::diagnosis(&diagnosis)?)?);
    } else {
        print!("{}", report::story::diagnosis(&diagnosis, &next));
    }
    Ok(if diagnosis.verdict == Verdict::Adequate { Outcome::Done } else { Outcome::FoundWanting })
}
