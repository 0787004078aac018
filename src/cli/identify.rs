//! `rotorbench identify`: identify actuator and body from logs.

use std::path::{Path, PathBuf};

use super::log_arguments::LogArguments;
use super::output::{AnswerArguments, NotesArgument, writable};
use super::thresholds::THRESHOLDS;
use super::usage_error::UsageError;
use super::watched::{cancellable, in_steps};
use super::{CliError, CliResult, Outcome};
use crate::identify::{Identification, IdentifySettings};
use crate::model::Model;
use crate::report::{json, rotors};
use crate::session::{self, Job, OpenConfig};
use crate::signal::ROTORS;

/// Arguments of `identify`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Logs to identify from, in the CSV log format: constant commands, ramps, PRBS, attitude, in any order
    #[arg(long, value_name = "FILE", num_args = 1.., required = true)]
    log: Vec<PathBuf>,
    /// Logs to validate on
    #[arg(long, value_name = "FILE", num_args = 1..)]
    validate: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) logs: LogArguments,
    /// Where to write the model file; of more than two rotors that of all, and each rotor's own beside it
    #[arg(long, short, value_name = "M.toml")]
    output: Option<PathBuf>,
    /// Model that gives what the logs do not: arm, full voltage, hover rate; a file, or `paper`
    #[arg(long, value_name = "M", default_value = "paper")]
    template: PathBuf,
    /// Degree of g(u), 1 to 4; default: cross-validation chooses
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=4))]
    degree: Option<u8>,
    /// Leave the battery out, also where its voltage was logged
    #[arg(long)]
    no_battery: bool,
    /// Leave a transport delay out of the model, also where the data show one
    #[arg(long)]
    no_delay: bool,
    /// Lever arm d [m]
    #[arg(long, value_name = "M")]
    arm_m: Option<f64>,
    /// Voltage of the full battery [V]
    #[arg(long, value_name = "V")]
    full_voltage_v: Option<f64>,
    /// Rotor rate in hover [rad/s], where the tangent of the thrust curve is taken
    #[arg(long, value_name = "W")]
    hover_rate: Option<f64>,
    #[command(flatten)]
    notes: NotesArgument,
    #[command(flatten)]
    answer: AnswerArguments,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let read_from = arguments.log.iter().chain(&arguments.validate).chain([&arguments.template]);
    writable(arguments.output.iter().chain(&arguments.answer.report), read_from, arguments.answer.force)?;
    let mut settings = settings(arguments)?;
    // The names of the rotors stay as they are in the logs.
    let open = OpenConfig { rotors: Vec::new(), ..arguments.logs.open_config() };
    let (found, page) = cancellable(|cancel| {
        let logs = session::open_all(&arguments.log, &open, &Job::unwatched(cancel))?;
        let validation = session::open_all(&arguments.validate, &open, &Job::unwatched(cancel))?;
        if settings.rotors.is_empty() {
            let last = session::rotors(&logs).last().copied().unwrap_or(0);
            settings.rotors = (1..=last.max(ROTORS)).collect();
        } else {
            session::require_rotors(&logs, &settings.rotors)?;
        }
        let found = in_steps(cancel, |job| session::identify(&logs, &validation, &settings, job))?;
        let page = arguments.answer.report.as_ref().map(|path| (path, found.page()));
        Ok((found, page))
    })?;
    if let Some(path) = &arguments.output {
        save(&found, path, arguments)?;
    }
    if let Some((path, page)) = page {
        page.save(path)?;
    }
    let headline = found.headline();
    let outcome = if headline.is_none() { Outcome::Done } else { Outcome::FoundWanting };
    if arguments.answer.json {
        println!("{}", json::answer(&found.json()?)?);
        return Ok(outcome);
    }
    if let Some(first) = headline.or_else(|| found.caution()) {
        println!("{first}.\n");
    }
    println!("{}\n{}", found.part_table().text(), found.parameter_table().text());
    let tables =
        [rotors::models(&found), found.error_table(), found.degree_table(), found.alternatives_table()];
    for table in tables.into_iter().flatten() {
        println!("{}", table.text());
    }
    print!("{}", found.note_lines(arguments.notes.detail()));
    Ok(outcome)
}

/// Saves the model, and each rotor's own beside it: all of them or none.
fn save(found: &Identification, path: &Path, arguments: &Arguments) -> Result<(), CliError> {
    let own: Vec<PathBuf> = found.rotors.iter().map(|of| of_rotor(path, of.rotor)).collect();
    let read_from = arguments.log.iter().chain(&arguments.validate).chain([&arguments.template]);
    writable(own.iter().chain(&arguments.answer.report), read_from, arguments.answer.force)?;
    // Several of them are held beside each other by their names.
    let save = |model: &Model, path: &Path| {
        let mut named = model.clone();
        session::name_after(&mut named, path);
        session::save_model(&named, path)
    };
    save(&found.model, path)?;
    found.rotors.iter().zip(&own).try_for_each(|(of, own)| save(&of.model, own))?;
    Ok(())
}

/// The file of one rotor's own model: `m.toml` has `m_rotor_3.toml` beside it.
fn of_rotor(path: &Path, rotor: usize) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let ending = path.extension().map_or(String::new(), |it| format!(".{}", it.to_string_lossy()));
    path.with_file_name(format!("{stem}_rotor_{rotor}{ending}"))
}

fn settings(arguments: &Arguments) -> Result<IdentifySettings, CliError> {
    let mut template = session::open_model(&arguments.template)?;
    for (given, place, option, [low, high]) in [
        (arguments.arm_m, &mut template.body.arm, "--arm-m", THRESHOLDS.arms_m),
        (
            arguments.full_voltage_v,
            &mut template.actuator.full_voltage,
            "--full-voltage-v",
            THRESHOLDS.full_voltages_v,
        ),
        (arguments.hover_rate, &mut template.actuator.hover_rate, "--hover-rate", THRESHOLDS.hover_rates),
    ] {
        match given {
            Some(value) if (low..=high).contains(&value) => *place = value,
            Some(value) => return Err(UsageError::Range { option, value, low, high }.into()),
            None => {}
        }
    }
    Ok(IdentifySettings {
        template,
        full_voltage_given: arguments.full_voltage_v.is_some(),
        degree: arguments.degree.map(usize::from),
        battery: !arguments.no_battery,
        delay: !arguments.no_delay,
        rotors: arguments.logs.rotors(),
    })
}
