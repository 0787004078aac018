//! What a command refuses of its own: how it was called, and the files it reads and writes.

use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitStatus;

use crate::report::guard::ending;
use crate::runtime::experiment::Ending;
use crate::session::SessionError;
use crate::unit::short;

/// Why a command refuses. What the rooms refuse has errors of their own.
#[derive(Debug, thiserror::Error)]
pub enum UsageError {
    /// A file that cannot be read, written or taken away.
    #[error("{}: {error}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the system says.
        error: io::Error,
    },
    /// A result would replace a file.
    #[error("{}: is there already; --force replaces it", path.display())]
    IsThere {
        /// The file.
        path: PathBuf,
    },
    /// A result would replace what the command reads.
    #[error("{}: this command reads that file; its result has to go elsewhere", path.display())]
    IsInput {
        /// The file.
        path: PathBuf,
    },
    /// Two results to one place.
    #[error("{}: two results of this command would go there", path.display())]
    TwoResults {
        /// The file.
        path: PathBuf,
    },
    /// A file that the command writes of itself beside the one that was asked for.
    #[error("{error} (beside -o FILE.csv this command writes {}: choose another -o)", beside(.is_recorded))]
    Beside {
        /// What is wrong with it.
        error: Box<UsageError>,
        /// Whether a recording is written, too.
        is_recorded: bool,
    },
    /// An option that changes nothing here.
    #[error("{option} would do nothing: {reason}")]
    Idle {
        /// The option.
        option: String,
        /// Why not.
        reason: Idle,
    },
    /// A number outside what an option takes.
    #[error("{option} must lie in {}..{}, not {}", short(*.low), short(*.high), short(*.value))]
    Range {
        /// The option.
        option: &'static str,
        /// The number, as the option counts it.
        value: f64,
        /// The lowest that it takes.
        low: f64,
        /// The highest.
        high: f64,
    },
    /// A value that is not of the option's form.
    #[error("{option} {value}: write {form}")]
    Form {
        /// The option.
        option: &'static str,
        /// What was given.
        value: String,
        /// The form.
        form: &'static str,
    },
    /// An impulse that cannot be.
    #[error(
        "--impulse {}:{}:{}: three numbers, the first not below zero, the second above it",
        short(*.at_s), short(*.duration_s), short(*.torque)
    )]
    Impulse {
        /// [s]
        at_s: f64,
        /// [s]
        duration_s: f64,
        /// [N m]
        torque: f64,
    },
    /// Margins that cannot be.
    #[error("--pid-margins needs degrees between 0 and 180 and a factor of at least 1")]
    Margins {
        /// [°]
        phase_deg: f64,
        /// [-]
        gain: f64,
    },
    /// A page of several rotors.
    #[error("--report is a page of one rotor, and the logs have {count}; name it with --rotors {first}")]
    ReportOfRotors {
        /// How many they have.
        count: usize,
        /// Number of the first.
        first: usize,
    },
    /// `--signals` of several logs.
    #[error("--signals writes the signals of one log; several were given")]
    SignalsOfLogs,
    /// Columns are guessed of logs that do not say what theirs mean.
    #[error("{}: says itself what its columns mean: nothing is guessed", log.display())]
    NothingGuessed {
        /// The log.
        log: PathBuf,
    },
    /// A log is not written on a guess.
    #[error(
        "{log}: what its columns mean is a guess, and no log is written on a guess: look at it with `import {log}`, and say it \
         with --mapping",
        log = log.display()
    )]
    Guessed {
        /// The log.
        log: PathBuf,
    },
    /// `export` without a result.
    #[error("export: nothing to write; give -o FILE.csv, --candump FILE.log or both")]
    NoOutput,
    /// `export -o` of raw frames.
    #[error("export: -o writes the CSV log, and `{}` is named like raw frames: give --candump for those", path.display())]
    NamedLikeFrames {
        /// The file.
        path: PathBuf,
    },
    /// `monitor` into a pipe or a file.
    #[error("monitor draws on a terminal; without one, use --json")]
    NoTerminal,
    /// A plant for a bus that has one.
    #[error("the emulated plant is for `run --lockstep`; on a bus it is `emulate --can`'s")]
    PlantOnBus,
    /// An effect that nobody knows.
    #[error("unknown effect")]
    UnknownEffect {
        /// Its id.
        id: String,
    },
    /// What cannot be done with a model file.
    #[error("{}: {error}", path.display())]
    Model {
        /// The file.
        path: PathBuf,
        /// Why not.
        error: Box<SessionError>,
    },
    /// A folder without answers of a fleet.
    #[error("{}: no answer of `fleet run` is in this folder", folder.display())]
    NoFleetAnswer {
        /// The folder.
        folder: PathBuf,
    },
    /// An experiment that ended before its first sample.
    #[error("nothing was recorded: {}", ending(.0))]
    NothingRecorded(Ending),
    /// The demo's emulator failed.
    #[error("the emulator's process: {0}")]
    Emulator(ExitStatus),
    /// The demo's guard never let a command through.
    #[error("the demo's guard was never open")]
    NeverArmed,
}

impl UsageError {
    /// An error of the system about a file.
    pub(super) fn at(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |error| Self::File { path, error }
    }

    /// An option that would do nothing.
    pub(super) fn idle(option: impl Into<String>, reason: Idle) -> Self {
        Self::Idle { option: option.into(), reason }
    }
}

/// What `experiment` writes beside its log.
fn beside(is_recorded: &bool) -> &'static str {
    if *is_recorded { "FILE.toml and FILE.mcap" } else { "FILE.toml" }
}

/// Why an option would do nothing.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Idle {
    /// An option of the emulated plant, for a bench that runs.
    #[error("it is the emulator's, and without --lockstep the running bench is driven")]
    BenchRuns,
    /// A choice of rotors in closed loop.
    #[error("with --closed-loop the signal is added differentially")]
    AddedDifferentially,
    /// A level to move about, in closed loop.
    #[error("with --closed-loop the signal is added to the controller's commands")]
    AddedToCommands,
    /// A level to move about, for a signal of levels.
    #[error("the levels are commands themselves")]
    LevelsAreCommands,
    /// What moves a body that is held.
    #[error("open loop holds the body still; --free-body lets it swing")]
    BodyIsHeld,
    /// An angle for a body whose torques have one slope at all angles.
    #[error("model `{model}` has no effect whose slope depends on the angle ({effect})")]
    SameAtAllAngles {
        /// Name of the model.
        model: String,
        /// Id of an effect that would.
        effect: &'static str,
    },
    /// A setting of the PID for EMC.
    #[error("the controller is EMC; leave out --controller emc")]
    OfPid,
    /// A setting of EMC for a PID.
    #[error("the controller is a PID, and this is a setting of EMC")]
    OfEmc,
    /// Eigenvalues for a gain that is given.
    #[error("the feedback gain is given, not placed by eigenvalues")]
    GainIsGiven,
}
