//! `rotorbench diagnose`: which physical effect is missing.

use std::path::PathBuf;

use super::progress::Progress;
use super::{CliResult, Outcome};
use crate::compare::CompareConfig;
use crate::diagnose::{DiagnoseConfig, Verdict, diagnose};
use crate::log::csv;
use crate::model::Model;
use crate::report;
use crate::report::json;

/// Arguments of `diagnose`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Model file, or `paper`
    #[arg(long, default_value = "paper")]
    model: PathBuf,
    /// Logs to fit on
    #[arg(long, required = true, num_args = 1..)]
    log: Vec<PathBuf>,
    /// Logs to judge on; without them every third stretch of the training logs is held out
    #[arg(long, num_args = 1..)]
    validate: Vec<PathBuf>,
    /// Windows over which the body runs freely [s]
    #[arg(value_parser = super::horizon, long, default_value_t = DiagnoseConfig::default().horizon)]
    horizon_s: f64,
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
    super::output::writable(&arguments.report, inputs)?;
    let model = Model::load(&arguments.model)?;
    let train = arguments.log.iter().map(|path| csv::read(path)).collect::<Result<Vec<_>, _>>()?;
    let validate = arguments.validate.iter().map(|path| csv::read(path)).collect::<Result<Vec<_>, _>>()?;
    let config = DiagnoseConfig { horizon: arguments.horizon_s };
    let progress = Progress::start();
    let diagnosis = diagnose(&model, &train, &validate, &config, &|| progress.one_more("candidates fitted"))?;
    drop(progress);
    let named = |paths: &[PathBuf]| paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>();
    let model_name = arguments.model.display().to_string();
    let next = diagnosis.next_steps(&model_name, &named(&arguments.log), &named(&arguments.validate));
    if let Some(path) = &arguments.report {
        let shown = if validate.is_empty() { &train } else { &validate };
        let windows = CompareConfig { horizon_s: arguments.horizon_s };
        report::diagnosis::page(&diagnosis, &model, shown, &windows, &next)?.save(path)?;
    }
    if arguments.json {
        println!("{}", json::answer(&json::with_sentences(&diagnosis, &diagnosis.findings)?)?);
    } else {
        print!("{}", report::story::diagnosis(&diagnosis, &next));
    }
    Ok(if diagnosis.verdict == Verdict::Adequate { Outcome::Done } else { Outcome::FoundWanting })
}
