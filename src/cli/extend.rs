//! `rotorbench extend`: adds an effect to a model and shows the fall of the error.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::{CliError, CliResult, Outcome};
use crate::compare::CompareConfig;
use crate::diagnose::{DiagnoseConfig, extend};
use crate::log::csv;
use crate::model::Model;
use crate::report;
use crate::report::findings::sentences;
use crate::report::json;
use crate::screening::requirements::repeated;

/// Arguments of `extend`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Model file to start from, or `paper`
    #[arg(long, default_value = "paper")]
    model: PathBuf,
    /// Effects to add
    #[arg(long, num_args = 1.., required_unless_present_any = ["step_back", "recalibrate"])]
    effect: Vec<String>,
    /// Add nothing: refit the model's own numbers, those whose change the logs ask for
    #[arg(long, conflicts_with_all = ["effect", "step_back"])]
    recalibrate: bool,
    /// Logs to fit on
    #[arg(long, num_args = 1.., required_unless_present = "step_back")]
    log: Vec<PathBuf>,
    /// Logs to judge on
    #[arg(long, num_args = 1..)]
    validate: Vec<PathBuf>,
    /// Undo the last step of the model's ladder instead
    #[arg(long, conflicts_with_all = ["effect", "log", "validate"])]
    step_back: bool,
    /// Windows over which the body runs freely [s]
    #[arg(value_parser = super::horizon, long, default_value_t = DiagnoseConfig::default().horizon)]
    horizon_s: f64,
    /// Model file to write
    #[arg(short, long)]
    output: PathBuf,
    /// Answer as JSON on standard output
    #[arg(long)]
    json: bool,
    /// Write a page with the whole story (HTML)
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
}

/// An error that keeps more than this share has not fallen: half a percent is what any free parameter takes from noise.
const FALLEN: f64 = 0.995;

/// Side by side with the model it came from, a model has to have a name of its own: its file's.
fn name_after(model: &mut Model, file: &Path) {
    if let Some(stem) = file.file_stem() {
        model.name = stem.to_string_lossy().into_owned();
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    // The model that it starts from, too: the ladder of the new one begins there.
    let inputs = arguments.log.iter().chain(&arguments.validate).chain([&arguments.model]);
    super::output::writable(std::iter::once(&arguments.output).chain(&arguments.report), inputs)?;
    let model = Model::load(&arguments.model)?;
    if arguments.step_back {
        let mut back = model.step_back().ok_or_else(|| {
            CliError::new(format!(
                "{}: the ladder is empty, there is no step to undo",
                arguments.model.display()
            ))
        })?;
        name_after(&mut back, &arguments.output);
        back.save(&arguments.output)?;
        if arguments.json {
            let undone = model.ladder.last().map(|step| &step.added);
            println!("{}", crate::report::json::answer(&json!({ "undone": undone, "model": back }))?);
        } else {
            println!("{}: {} steps on the ladder", arguments.output.display(), back.ladder.len());
        }
        return Ok(Outcome::Done);
    }
    let train = arguments.log.iter().map(|path| csv::read(path)).collect::<Result<Vec<_>, _>>()?;
    let validate = arguments.validate.iter().map(|path| csv::read(path)).collect::<Result<Vec<_>, _>>()?;
    let config = DiagnoseConfig { horizon: arguments.horizon_s };
    let mut warnings = sentences(&repeated(&train, &validate));
    let mut extension = extend(&model, &arguments.effect, &train, &validate, &config)?;
    warnings.extend(sentences(&extension.findings));
    let error = &extension.error;
    if arguments.recalibrate && !extension.is_at_floor {
        warnings.push(format!(
            "other numbers leave {:.1} times what noise alone would: they make up for something that is missing; `rotorbench \
             diagnose` looks for it",
            error.extended.validate / error.noise_floor
        ));
    }
    name_after(&mut extension.model, &arguments.output);
    extension.model.save(&arguments.output)?;
    if let Some(path) = &arguments.report {
        let shown = if validate.is_empty() { &train } else { &validate };
        let windows = CompareConfig { horizon_s: arguments.horizon_s };
        report::diagnosis::extension_page(&extension, &model, &arguments.effect, shown, &windows)?
            .save(path)?;
    }
    if arguments.json {
        let answer = json!({
            "added": arguments.effect, "error": extension.error, "model": extension.model, "warnings": warnings,
            "findings": extension.findings,
        });
        println!("{}", json::answer(&answer)?);
    } else {
        print!("{}", report::story::extension(&extension.model, &arguments.effect, &extension.error));
        warnings.iter().for_each(|warning| println!("Note: {warning}"));
    }
    let (error, is_at_floor) = (&extension.error, extension.is_at_floor);
    // Where nothing but noise is left, refitted numbers may have got there, too.
    let beaten = if arguments.recalibrate || is_at_floor { error.base } else { error.recalibrated };
    let falls = error.extended.validate < FALLEN * beaten.validate && (is_at_floor || !arguments.recalibrate);
    Ok(if falls { Outcome::Done } else { Outcome::FoundWanting })
}
