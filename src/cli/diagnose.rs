//! `rotorbench diagnose`: which physical effect is missing.

use std::path::PathBuf;

use super::{CliResult, Outcome};
use crate::diagnose::compare::CompareConfig;
use crate::diagnose::{DiagnoseConfig, Diagnosis, Verdict, diagnose};
use crate::effect::find;
use crate::model::Model;
use crate::record::log;
use crate::report;

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
    #[arg(value_parser = super::positive_seconds, long, default_value_t = DiagnoseConfig::default().horizon)]
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
    let model = Model::load(&arguments.model)?;
    let train = arguments.log.iter().map(|path| log::read(path)).collect::<Result<Vec<_>, _>>()?;
    let validate = arguments.validate.iter().map(|path| log::read(path)).collect::<Result<Vec<_>, _>>()?;
    let config = DiagnoseConfig { horizon: arguments.horizon_s };
    let progress = indicatif::ProgressBar::new_spinner().with_message("candidates fitted");
    progress.set_style(indicatif::ProgressStyle::with_template("{spinner} {pos} {msg}, {elapsed}")?);
    let diagnosis = diagnose(&model, &train, &validate, &config, &|| progress.inc(1))?;
    progress.finish_and_clear();
    if let Some(path) = &arguments.report {
        let shown = if validate.is_empty() { &train } else { &validate };
        let windows = CompareConfig { horizon_s: arguments.horizon_s };
        report::diagnosis::page(&diagnosis, &model, shown, &windows)?.save(path)?;
    }
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&diagnosis)?);
    } else {
        tell(&diagnosis);
    }
    Ok(if diagnosis.verdict == Verdict::Adequate { Outcome::Done } else { Outcome::FoundWanting })
}

/// The story in a screen of text.
fn tell(diagnosis: &Diagnosis) {
    println!("{}\n", diagnosis.sentence(""));
    for id in &diagnosis.effects {
        if let Some(card) = find(id) {
            println!("  {}  {}\n  {} {}\n", card.id, card.equation, card.report[0], card.report[1]);
        }
    }
    let with_error = |error: Option<f64>| error.map_or(String::new(), |error| format!(" ± {error:.2e}"));
    for (name, found) in &diagnosis.parameters {
        println!("  {name} = {:.6}{} {}", found.value, with_error(found.standard_error), found.unit);
    }
    for changed in &diagnosis.changed_parameters {
        let error = with_error(changed.standard_error);
        println!(
            "  {} ({}): {} -> {:.6}{error} {}",
            changed.name, changed.symbol, changed.from, changed.to, changed.unit
        );
    }
    for other in &diagnosis.alternatives {
        println!("  these data cannot tell it from: {}", other.join(" + "));
    }
    tell_error(diagnosis);
    if let Some(next) = &diagnosis.next_experiment {
        println!("\nnext experiment: {}", next.run);
    }
    for warning in &diagnosis.warnings {
        println!("warning: {warning}");
    }
}

fn tell_error(diagnosis: &Diagnosis) {
    let error = &diagnosis.error;
    println!("\n{}\n{:<28} {:>12} {:>12}", error.measure, "", "fitted on", "held out");
    for (name, both) in
        [("model as it is", error.base), ("recalibrated", error.recalibrated), ("extended", error.extended)]
    {
        println!("{name:<28} {:>12.5} {:>12.5}", both.train, both.validate);
    }
    println!("{:<28} {:>12} {:>12.5}", "noise floor", "", error.noise_floor);
    for place in diagnosis.r#where.iter().filter(|place| place.share_of_error > 0.01) {
        let (share, explained) = (100.0 * place.share_of_error, 100.0 * place.explained);
        println!(
            "\n{}: {share:.0} % of the error; {} explains {explained:.0} % of it",
            place.block, place.depends_on
        );
    }
    tell_candidates(diagnosis);
}

/// Those that are judged by the channel the error is told in: errors of different blocks have different units.
fn tell_candidates(diagnosis: &Diagnosis) {
    let mut candidates: Vec<_> = diagnosis
        .candidates
        .iter()
        .filter(|candidate| candidate.note.is_empty() && diagnosis.error.is_of(&candidate.channel))
        .collect();
    let held_out = |value: Option<f64>| value.unwrap_or(f64::INFINITY);
    candidates.sort_by(|a, b| held_out(a.validate).total_cmp(&held_out(b.validate)));
    println!("\n{:<28} {:>12} {:>12} {:>8}", "candidate alone", "held out", "without it", "chance");
    for candidate in candidates.into_iter().take(8) {
        let number = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.5}"));
        let chance = candidate.chance.map_or("-".to_owned(), |chance| format!("{chance:.3}"));
        println!(
            "{:<28} {:>12} {:>12} {chance:>8}",
            candidate.effect,
            number(candidate.validate),
            number(candidate.drop_one)
        );
    }
}
