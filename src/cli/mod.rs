//! The command line: one file per subcommand. Exit 0 = done, 1 = found wanting, 2 = usage or bad input.
//!
//! Results go to standard output, everything else to standard error.

use std::io::{IsTerminal as _, Write as _};
use std::num::NonZeroUsize;
use std::path::Path;
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory as _, FromArgMatches as _, Parser};
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::layer::SubscriberExt as _;
use tracing_subscriber::util::SubscriberInitExt as _;

use crate::threads;

#[macro_use]
mod print;

mod arm;
mod bridge;
mod brief;
mod check;
mod commands;
mod compare;
mod completions;
mod control;
mod demo;
mod design;
mod diagnose;
mod disarm;
mod discover;
mod doctor;
mod dronecan;
mod effects;
mod emulate;
mod experiment;
mod export;
mod extend;
mod fleet;
mod identify;
mod import;
mod jitter;
mod lockstep;
mod log_arguments;
mod man;
mod monitor;
mod operate;
mod outcome;
mod output;
mod paper;
mod pipe;
mod place;
mod progress;
mod record;
mod replay;
mod run;
mod schema;
mod search_arguments;
mod stop;
pub(crate) mod thresholds;
mod usage_error;
mod usage_tip;
mod watched;
mod workbench;

pub use outcome::{CliError, CliResult, Outcome};

/// A hardware-in-the-loop CAN bench that closes the loop, and tells you what your model is missing.
#[derive(Debug, Parser)]
#[command(name = "rotorbench", version, max_term_width = 110)]
struct CommandLine {
    #[command(subcommand)]
    subcommand: Subcommand,
}

#[derive(Debug, clap::Subcommand)]
enum Subcommand {
    /// The whole story with no hardware, in under a minute
    Demo(demo::Arguments),
    /// Own the CAN bus: frames to sensors, commands through the guard to frames
    Bridge(bridge::Arguments),
    /// Run one controller on a fixed period
    Control(control::Arguments),
    /// Bridge and control in one process
    Run(run::Arguments),
    /// Stand in for the hardware, behind shared memory or on a CAN bus
    Emulate(emulate::Arguments),
    /// Record a running bench
    Record(record::Arguments),
    /// Watch a running bench
    Monitor(monitor::Arguments),
    /// Arm a running bench
    Arm(arm::Arguments),
    /// Disarm a running bench
    Disarm(disarm::Arguments),
    /// Emergency stop of a running bench
    Stop(stop::Arguments),
    /// Resolve and check a bench file: signals, units, bus load
    Check(check::Arguments),
    /// What this machine can and cannot do, and the command that mends it
    Doctor(doctor::Arguments),
    /// What a bus that speaks DroneCAN has to say
    Dronecan(dronecan::Arguments),
    /// How punctual this machine is, from a bare cycle to the whole loop, beside cyclictest
    Jitter(jitter::Arguments),
    /// Drive the bench with a test signal and record
    Experiment(experiment::Arguments),
    /// Read a foreign log into the CSV log format
    Import(import::Arguments),
    /// Write a recording as CSV or candump log
    Export(export::Arguments),
    /// Identify actuator and body from logs
    Identify(identify::Arguments),
    /// Eigenvalues, gains and margins from a model
    Design(design::Arguments),
    /// Where the model fails
    Compare(compare::Arguments),
    /// Which physical effect is missing
    Diagnose(diagnose::Arguments),
    /// The law itself, where no known effect explains what is missing
    Discover(discover::Arguments),
    /// Add an effect to a model and show the fall of the error
    Extend(extend::Arguments),
    /// In your browser: where the model fails, what is missing, the error falling
    Workbench(workbench::Arguments),
    /// Diagnose many benches, in shards, and put the answers together
    Fleet(fleet::Arguments),
    /// The catalogue of physical effects
    Effects(effects::Arguments),
    /// Every table and figure of the paper, ours beside the printed one
    Paper(paper::Arguments),
    /// Run the controller again on recorded input
    Replay(replay::Arguments),
    /// Completions of commands and options for a shell
    Completions(completions::Arguments),
    /// Manual pages, one for each command
    Man(man::Arguments),
    /// The JSON Schema of a `--json` answer
    Schema(schema::Arguments),
}

/// The command line, or its error and exit 2. Where only a command is missing the help is the answer, and the end is 0. Numbers
/// may be negative everywhere: what cannot be is refused by who knows why, and not as an option that nobody knows.
fn command_line() -> CommandLine {
    let read = command().try_get_matches().and_then(|it| CommandLine::from_arg_matches(&it));
    read.unwrap_or_else(|error| match error.kind() {
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            let help = error.render();
            if std::io::stdout().is_terminal() {
                print!("{}", help.ansi())
            } else {
                print!("{help}")
            }
            std::process::exit(0)
        }
        _ => usage_tip::with_tip(error, &command()).exit(),
    })
}

/// The command line as clap has it.
fn command() -> clap::Command {
    commands::with_examples(with_negative_numbers(CommandLine::command()))
}

fn with_negative_numbers(command: clap::Command) -> clap::Command {
    let names: Vec<String> = command.get_subcommands().map(|it| it.get_name().to_owned()).collect();
    let command = command.mut_args(|argument| {
        let takes = argument.get_action().takes_values();
        argument.allow_negative_numbers(takes)
    });
    names.iter().fold(command, |command, name| command.mut_subcommand(name, with_negative_numbers))
}

/// Parses the command line, runs the subcommand, prints its error.
pub fn main() -> ExitCode {
    start_log();
    crate::rt::report_file_limits_as_errors();
    let subcommand = command_line().subcommand;
    if subcommand.only_computes() {
        pipe::end_with_the_reader();
    }
    let bench_file = subcommand.bench_file().map(Path::to_owned);
    match threads::limited(subcommand.threads(), || dispatch(subcommand)) {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::FoundWanting) => ExitCode::from(1),
        Err(error @ CliError::Cancelled(_)) => {
            let _ = writeln!(std::io::stderr(), "{error}");
            ExitCode::from(1)
        }
        Err(error) => {
            // It was there a moment ago; where it is not, the sentence goes without its place.
            let text = bench_file.as_ref().and_then(|path| crate::file::read_settings_text(path).ok());
            let error = match bench_file.zip(text) {
                Some((path, text)) => error.in_bench_file(&path, &text),
                None => error,
            };
            // Where nobody can read it, the exit code still says it.
            let _ = writeln!(std::io::stderr(), "error: {}", brief::brief(&error.to_string()));
            ExitCode::from(2)
        }
    }
}

impl Subcommand {
    /// The bench file it was given, whose settings its errors are about.
    fn bench_file(&self) -> Option<&Path> {
        let bench = match self {
            Self::Bridge(arguments) => &arguments.bench,
            Self::Control(arguments) => &arguments.bench,
            Self::Run(arguments) => &arguments.bench,
            Self::Emulate(arguments) => &arguments.bench,
            Self::Record(arguments) => &arguments.bench,
            Self::Monitor(arguments) => &arguments.bench,
            Self::Arm(arguments) => &arguments.bench,
            Self::Disarm(arguments) => &arguments.bench,
            Self::Stop(arguments) => &arguments.bench,
            Self::Check(arguments) => &arguments.bench,
            Self::Jitter(arguments) => &arguments.bench,
            Self::Experiment(arguments) => &arguments.bench,
            Self::Dronecan(arguments) => arguments.bench(),
            Self::Design(arguments) => &arguments.bench,
            Self::Workbench(arguments) => &arguments.bench,
            Self::Doctor(arguments) => return arguments.config.as_deref(),
            Self::Import(arguments) => return arguments.logs.config.as_deref(),
            Self::Replay(arguments) => return arguments.config.as_deref(),
            _ => return None,
        };
        bench.config.as_deref()
    }

    /// How many threads it may work on; `None` = as many as there are cores.
    fn threads(&self) -> Option<NonZeroUsize> {
        match self {
            Self::Import(arguments) => arguments.logs.threads,
            Self::Identify(arguments) => arguments.logs.threads,
            Self::Compare(arguments) => arguments.logs.threads,
            Self::Diagnose(arguments) => arguments.search.logs.threads,
            Self::Discover(arguments) => arguments.search.logs.threads,
            Self::Extend(arguments) => arguments.logs.threads,
            _ => None,
        }
    }

    /// Whether it drives nothing: no rotor can depend on its living on.
    fn only_computes(&self) -> bool {
        matches!(
            self,
            Self::Check(_)
                | Self::Doctor(_)
                | Self::Import(_)
                | Self::Export(_)
                | Self::Identify(_)
                | Self::Design(_)
                | Self::Compare(_)
                | Self::Diagnose(_)
                | Self::Discover(_)
                | Self::Extend(_)
                | Self::Fleet(_)
                | Self::Effects(_)
                | Self::Replay(_)
                | Self::Completions(_)
                | Self::Man(_)
                | Self::Schema(_)
        )
    }
}

fn dispatch(subcommand: Subcommand) -> CliResult {
    match subcommand {
        Subcommand::Demo(arguments) => demo::run(&arguments),
        Subcommand::Bridge(arguments) => bridge::run(&arguments),
        Subcommand::Control(arguments) => control::run(&arguments),
        Subcommand::Run(arguments) => run::run(&arguments),
        Subcommand::Emulate(arguments) => emulate::run(&arguments),
        Subcommand::Record(arguments) => record::run(&arguments),
        Subcommand::Monitor(arguments) => monitor::run(&arguments),
        Subcommand::Arm(arguments) => arm::run(&arguments),
        Subcommand::Disarm(arguments) => disarm::run(&arguments),
        Subcommand::Stop(arguments) => stop::run(&arguments),
        Subcommand::Check(arguments) => check::run(&arguments),
        Subcommand::Doctor(arguments) => doctor::run(&arguments),
        Subcommand::Dronecan(arguments) => dronecan::run(&arguments),
        Subcommand::Jitter(arguments) => jitter::run(&arguments),
        Subcommand::Experiment(arguments) => experiment::run(&arguments),
        Subcommand::Import(arguments) => import::run(&arguments),
        Subcommand::Export(arguments) => export::run(&arguments),
        Subcommand::Identify(arguments) => identify::run(&arguments),
        Subcommand::Design(arguments) => design::run(&arguments),
        Subcommand::Compare(arguments) => compare::run(&arguments),
        Subcommand::Diagnose(arguments) => diagnose::run(&arguments),
        Subcommand::Discover(arguments) => discover::run(&arguments),
        Subcommand::Extend(arguments) => extend::run(&arguments),
        Subcommand::Workbench(arguments) => workbench::run(&arguments),
        Subcommand::Fleet(arguments) => fleet::run(&arguments),
        Subcommand::Effects(arguments) => effects::run(&arguments),
        Subcommand::Paper(arguments) => paper::run(&arguments),
        Subcommand::Replay(arguments) => replay::run(&arguments),
        Subcommand::Completions(arguments) => completions::run(&arguments, &mut command()),
        Subcommand::Man(arguments) => man::run(&arguments, CommandLine::command()),
        Subcommand::Schema(arguments) => schema::run(&arguments),
    }
}

/// Log records go to standard error; `ROTORBENCH_LOG` filters them (`debug`, `rotorbench::can=trace`, ...).
fn start_log() {
    let wish = std::env::var("ROTORBENCH_LOG").ok();
    // A terminal that was closed, or a full disk behind standard error, must not make a cycle's thread panic.
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(std::io::stderr)
        // Codes for colours are for eyes, not for files.
        .with_ansi(std::io::stderr().is_terminal())
        .with_target(false)
        .log_internal_errors(false);
    tracing_subscriber::registry().with(lines).with(log_filter(wish.as_deref())).init();
}

/// What passes by target and level; the usual where nothing is wished, or nothing that can be read.
fn log_filter(wish: Option<&str>) -> Targets {
    let usual = || {
        Targets::new().with_default(LevelFilter::WARN).with_target(env!("CARGO_PKG_NAME"), LevelFilter::INFO)
    };
    let parts = wish.unwrap_or_default().split(',').map(str::trim).filter(|part| !part.is_empty());
    let wish = parts.collect::<Vec<_>>().join(",");
    if wish.is_empty() { usual() } else { wish.parse().unwrap_or_else(|_| usual()) }
}

#[cfg(test)]
mod tests {
    use tracing_subscriber::filter::LevelFilter as Level;

    use super::log_filter;

    #[test]
    fn the_log_is_filtered_by_target_and_level() {
        let passes = |wish: Option<&str>, target: &str, level: Level| {
            level.into_level().is_some_and(|level| log_filter(wish).would_enable(target, &level))
        };
        for usual in [None, Some(""), Some("rotorbench=loudly")] {
            assert!(passes(usual, "rotorbench::can", Level::INFO) && passes(usual, "iceoryx2", Level::WARN));
            assert!(!passes(usual, "rotorbench", Level::DEBUG) && !passes(usual, "iceoryx2", Level::INFO));
        }
        assert!(passes(Some("debug"), "iceoryx2", Level::DEBUG));
        assert!(
            !passes(Some("debug"), "rotorbench", Level::TRACE)
                && !passes(Some("off"), "rotorbench", Level::ERROR)
        );
        let two = Some("warn, rotorbench::can=trace,");
        assert!(passes(two, "rotorbench::can::port", Level::TRACE) && passes(two, "rotorbench", Level::WARN));
        assert!(!passes(two, "rotorbench::guard", Level::INFO));
    }
}
