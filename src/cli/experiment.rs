//! `rotorbench experiment`: drive the bench with a test signal and record.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::emulate::PlantArguments;
use super::operate::BenchArguments;
use super::output::{Force, writable};
use super::progress::ProgressLine;
use super::usage_error::{Idle, UsageError};
use super::{CliError, CliResult, Outcome};
use crate::bench::BenchConfig;
use crate::clock;
use crate::experiment::{ExperimentConfig, Rotors, Waveform};
use crate::file::write_atomically;
use crate::log::{csv, export};
use crate::report;
use crate::rt::Shutdown;
use crate::runtime::ExperimentPlan;
use crate::runtime::experiment::{self, Ending};
use crate::session;

/// Arguments of `experiment`.
#[derive(Debug, clap::Args)]
#[command(mut_args(|argument| argument.global(true)))]
pub struct Arguments {
    #[command(subcommand)]
    shape: ShapeArguments,
    #[command(flatten)]
    pub(super) bench: BenchArguments,
    #[command(flatten)]
    plant: PlantArguments,
    /// Rotors that take part: one, two, both, differential; default: one, and differential in closed loop
    #[arg(long, value_name = "ROTORS", value_parser = rotors)]
    rotors: Option<Rotors>,
    /// Operating point of the rotor command [default: 0.4633]
    #[arg(long, value_name = "U")]
    around: Option<f64>,
    /// Time from standstill to the first excited period
    #[arg(long, value_name = "S", default_value_t = 3.0)]
    lead_in: f64,
    /// Add the signal differentially to the running controller, instead of running open loop
    #[arg(long)]
    closed_loop: bool,
    /// On the emulator in virtual time, as fast as it can; without it, on the running bench, which has to be armed
    #[arg(long)]
    lockstep: bool,
    /// In lockstep and open loop, let the body swing instead of holding it still
    #[arg(long, requires = "lockstep", conflicts_with = "closed_loop")]
    free_body: bool,
    /// The log; beside it go FILE.toml, which says what was run, and on a running bench the recording FILE.mcap
    #[arg(short, long, value_name = "FILE.csv", default_value = "experiment.csv")]
    output: PathBuf,
    #[command(flatten)]
    force: Force,
    /// Say what was run as JSON on standard output
    #[arg(long)]
    json: bool,
}

/// The test signals.
#[derive(Debug, clap::Subcommand)]
enum ShapeArguments {
    /// Constant levels, one after another
    Constant {
        /// Commands, separated by commas
        #[arg(long, value_delimiter = ',', default_value = "0.3,0.4,0.5,0.6", allow_hyphen_values = true)]
        levels: Vec<f64>,
        /// [s] at each
        #[arg(long, default_value_t = 20.0)]
        hold: f64,
    },
    /// Slow ramps up and down
    Ramp {
        /// Lowest command
        #[arg(long, default_value_t = 0.25)]
        low: f64,
        /// Highest command
        #[arg(long, default_value_t = 0.7)]
        high: f64,
        /// [1/s] slope
        #[arg(long, default_value_t = 0.02)]
        slope: f64,
        /// Times up and down
        #[arg(long, default_value_t = 2)]
        cycles: u32,
    },
    /// Up- and down-steps of several sizes
    Steps {
        /// Largest step from the operating point
        #[arg(long, default_value_t = 0.08)]
        amplitude: f64,
        /// [s] at each level
        #[arg(long, default_value_t = 1.0)]
        hold: f64,
        /// Number of steps
        #[arg(long, default_value_t = 48)]
        count: u32,
    },
    /// Pseudo-random binary sequence of maximum length
    Prbs {
        /// Distance of both levels from the operating point
        #[arg(long, default_value_t = 0.08)]
        amplitude: f64,
        /// [Hz] up to which the power is flat within 3 dB; 0 = as high as the period allows
        #[arg(long, default_value_t = 0.0)]
        bandwidth: f64,
        /// [s]
        #[arg(long, default_value_t = 120.0)]
        duration: f64,
        /// Chooses where in its period the sequence begins
        #[arg(long, default_value_t = 1)]
        sequence: u64,
    },
    /// A sine of rising frequency
    Chirp {
        /// Amplitude
        #[arg(long, default_value_t = 0.05)]
        amplitude: f64,
        /// [Hz] at the start
        #[arg(long, default_value_t = 0.1)]
        from: f64,
        /// [Hz] at the end
        #[arg(long, default_value_t = 10.0)]
        to: f64,
        /// [s]
        #[arg(long, default_value_t = 60.0)]
        duration: f64,
    },
}

impl ShapeArguments {
    fn shape(&self) -> Waveform {
        match *self {
            Self::Constant { ref levels, hold } => {
                Waveform::Constant { levels: levels.clone(), hold_s: hold }
            }
            Self::Ramp { low, high, slope, cycles } => Waveform::Ramp { low, high, slope, cycles },
            Self::Steps { amplitude, hold, count } => Waveform::Steps { amplitude, hold_s: hold, count },
            Self::Prbs { amplitude, bandwidth, duration, sequence } => {
                Waveform::Prbs { amplitude, bandwidth_hz: bandwidth, duration_s: duration, seed: sequence }
            }
            Self::Chirp { amplitude, from, to, duration } => {
                Waveform::Chirp { amplitude, from_hz: from, to_hz: to, duration_s: duration }
            }
        }
    }
}

/// [-] default operating point: hover of the paper's bench on a full battery.
const AROUND: f64 = 0.4633;

impl Arguments {
    fn rotors(&self) -> Rotors {
        self.rotors.unwrap_or(if self.closed_loop { Rotors::Differential } else { Rotors::One })
    }

    /// Refuses to write over what is there, and with `--force`, too, over the bench file and its model.
    fn refuse_to_overwrite(&self, config: &BenchConfig) -> Result<(), UsageError> {
        let log = &self.output;
        let recording = (!self.lockstep).then(|| log.with_extension("mcap"));
        let mut files = vec![log.clone(), log.with_extension("toml")];
        files.extend(recording.clone());
        let mut inputs = vec![PathBuf::from(&config.model)];
        inputs.extend(self.bench.config.clone());
        writable([log], &inputs, self.force)?;
        writable(&files, &inputs, self.force)
            .map_err(|error| UsageError::Beside { error: Box::new(error), is_recorded: !self.lockstep })?;
        recording.map_or(Ok(()), |recording| self.force.make_way(&recording))
    }

    /// Refuses what would do nothing.
    fn refuse_idle(&self) -> Result<(), UsageError> {
        let refuse = |option: &str, reason| Err(UsageError::idle(option, reason));
        if !self.lockstep
            && let Some(option) = self.plant.given().first()
        {
            return refuse(option, Idle::BenchRuns);
        }
        if self.closed_loop && self.rotors() != Rotors::Differential {
            return refuse("--rotors", Idle::AddedDifferentially);
        }
        let of_levels = matches!(self.shape, ShapeArguments::Constant { .. } | ShapeArguments::Ramp { .. });
        if self.around.is_some() && self.closed_loop && !of_levels {
            return refuse("--around", Idle::AddedToCommands);
        }
        if self.around.is_some() && !self.closed_loop && of_levels && self.rotors() != Rotors::Differential {
            return refuse("--around", Idle::LevelsAreCommands);
        }
        let held = self.lockstep && !self.closed_loop && !self.free_body;
        if let Some(option) = self.plant.moving_the_body().filter(|_| held) {
            return refuse(&option, Idle::BodyIsHeld);
        }
        Ok(())
    }
}

fn rotors(text: &str) -> Result<Rotors, String> {
    match text {
        "one" => Ok(Rotors::One),
        "two" => Ok(Rotors::Two),
        "both" => Ok(Rotors::Both),
        "differential" => Ok(Rotors::Differential),
        _ => Err("one, two, both or differential".to_owned()),
    }
}

/// The file that says what was run.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Serialize)]
pub(super) struct ExperimentFile<'a> {
    /// Name of the bench.
    bench: &'a str,
    /// [s] period of the loop.
    period_s: f64,
    /// Model file of the bench; `paper` is built in.
    model: &'a str,
    /// Whether it was the emulator in virtual time.
    lockstep: bool,
    /// [s] since 1970 when it began.
    began_unix_s: u64,
    /// Whether it ran to its end.
    complete: bool,
    /// Why it ended.
    reason: String,
    /// Rows of the log.
    samples: usize,
    /// The log.
    log: String,
    /// SHA-256 of the log's text.
    log_sha256: String,
    /// What was run.
    plan: &'a ExperimentPlan,
    /// The emulated bench; absent on a running one.
    #[serde(skip_serializing_if = "Option::is_none")]
    emulator: Option<&'a crate::emulate::EmulatorConfig>,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let mut config = arguments.bench.load()?;
    arguments.refuse_idle()?;
    arguments.plant.apply(&mut config)?;
    let plan = ExperimentPlan {
        closed_loop: arguments.closed_loop,
        experiment: ExperimentConfig {
            shape: arguments.shape.shape(),
            rotors: arguments.rotors(),
            around: arguments.around.unwrap_or(AROUND),
            lead_in_s: arguments.lead_in,
        },
    };
    arguments.refuse_to_overwrite(&config)?;
    let began_unix_s = clock::realtime_ns() / clock::NANOSECONDS_PER_SECOND;
    let shutdown = Shutdown::listen()?;
    let output = &arguments.output;
    let (dataset, ending) = if arguments.lockstep {
        if plan.closed_loop || arguments.free_body {
            config.emulator.plant.clamped = false;
        } else {
            config.hold_body();
        }
        in_lockstep(&config, &plan, &shutdown)?
    } else {
        on_bench(&config, &plan, output, &shutdown)?
    };
    session::save_log(&dataset, output)?;
    let protocol = ExperimentFile {
        bench: &config.name,
        period_s: config.period_s,
        model: &config.model,
        lockstep: arguments.lockstep,
        began_unix_s,
        complete: ending == Ending::Complete,
        reason: report::guard::ending(&ending),
        samples: dataset.len(),
        log: output.display().to_string(),
        log_sha256: csv::content_hash(csv::emit(&dataset).as_bytes()),
        plan: &plan,
        emulator: arguments.lockstep.then_some(&config.emulator),
    };
    write_protocol(&protocol, &output.with_extension("toml"))?;
    if arguments.json {
        println!("{}", report::json::answer(&protocol)?);
    } else {
        println!("{}: {} samples, {}", output.display(), dataset.len(), protocol.reason);
    }
    Ok(if protocol.complete { Outcome::Done } else { Outcome::FoundWanting })
}

fn write_protocol(protocol: &ExperimentFile, path: &Path) -> Result<(), CliError> {
    let text = toml::to_string(protocol)?;
    Ok(write_atomically(path, text.as_bytes()).map_err(UsageError::at(path))?)
}

fn in_lockstep(
    config: &BenchConfig,
    plan: &ExperimentPlan,
    shutdown: &Shutdown,
) -> Result<(crate::log::Dataset, Ending), CliError> {
    let progress = ProgressLine::start();
    let (trace, ending) = experiment::in_lockstep(config, plan, &mut (), |share| {
        progress.share("", share);
        !shutdown.is_requested()
    })?;
    drop(progress);
    if trace.is_empty() {
        return Err(UsageError::NothingRecorded(ending).into());
    }
    Ok((trace.into_dataset("experiment")?, ending))
}

fn on_bench(
    config: &BenchConfig,
    plan: &ExperimentPlan,
    output: &Path,
    shutdown: &Shutdown,
) -> Result<(crate::log::Dataset, Ending), CliError> {
    let recording = output.with_extension("mcap");
    let progress = ProgressLine::start();
    let waiting = || {
        eprintln!("{}", report::guard::WAITS_FOR_ARM);
    };
    let tell = |share| progress.share("", share);
    let ending = experiment::on_bench(config, plan, &recording, shutdown, waiting, tell)?;
    drop(progress);
    Ok((export::dataset(&recording)?, ending))
}
