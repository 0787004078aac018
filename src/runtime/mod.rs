//! The loops of the processes: bridge, control, run, emulate, experiment, record, replay, an operator's acts, and all of it in
//! lockstep.

pub mod bridge;
pub mod bus_io;
pub mod command_source;
pub mod control;
pub mod control_output;
pub mod controller_plant;
pub mod emulate;
pub mod experiment;
pub mod experiment_plan;
pub mod guard;
mod imu_trigger;
pub mod lockstep;
pub mod monitor;
pub mod operator;
pub mod record;
pub mod replay;
pub mod run;
mod sensor_watch;
pub mod thresholds;
pub mod trace;

pub use experiment_plan::ExperimentPlan;

use crate::bench::BenchError;
use crate::can::CanError;
use crate::control::ControlError;
use crate::emulate::EmulateError;
use crate::experiment::ExperimentError;
use crate::guard::GuardError;
use crate::log::dataset::DatasetError;
use crate::model::ModelError;
use crate::recording::RecordError;
use crate::rt::RealTimeError;
use crate::shm::ShmError;

/// Why a process of the bench cannot run.
#[derive(Debug, thiserror::Error)]
pub enum ProcessError {
    /// The bench file.
    #[error(transparent)]
    Bench(#[from] BenchError),
    /// The model.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The bus.
    #[error(transparent)]
    Can(#[from] CanError),
    /// The controller.
    #[error(transparent)]
    Control(#[from] ControlError),
    /// The emulator.
    #[error(transparent)]
    Emulate(#[from] EmulateError),
    /// The guard.
    #[error(transparent)]
    Guard(#[from] GuardError),
    /// The shared memory.
    #[error(transparent)]
    Shm(#[from] ShmError),
    /// The real-time settings.
    #[error(transparent)]
    RealTime(#[from] RealTimeError),
    /// The experiment.
    #[error(transparent)]
    Experiment(#[from] ExperimentError),
    /// The recording.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The log of a run.
    #[error(transparent)]
    Log(#[from] DatasetError),
    /// The operating system has no thread, or no signal handler, to give.
    #[error("cannot start: {0}")]
    Start(std::io::Error),
    /// A model that no controller can be built on.
    #[error("model `{model}`: {error}")]
    Plant {
        /// Name of the model.
        model: String,
        /// Why not.
        error: ControlError,
    },
    /// `--arm` on what may be real hardware.
    #[error(
        "--arm is for the emulator: `{interface}` is not a virtual interface by kind and name; on hardware use `rotorbench arm`, \
         to try it without hardware say `interface = \"vcan0\"` or `\"mcast:0\"`"
    )]
    ArmOnHardware {
        /// The interface.
        interface: String,
    },
    /// Emulated nodes that ask for ids on a bus where nobody gives any.
    #[error(
        "--dynamic-ids is for `protocol = \"dronecan\"` in the bench file's [bus]: on this bus no node has an id that is given"
    )]
    NoNodeIds,
    /// A measurement of timing that cannot be.
    #[error(
        "{seconds} s in {rounds} rounds: each round of 1 to 1000 takes 0.05 s or more, at least two periods and at most a day"
    )]
    Jitter {
        /// [s] for each stage.
        seconds: f64,
        /// How often the stages take turns.
        rounds: u32,
    },
    /// A bus that may be real is measured only for who names it.
    #[error(
        "`{interface}` may have hardware on it: `--interface {interface}` measures there, sending the safe command only"
    )]
    JitterOnHardware {
        /// The interface.
        interface: String,
    },
    /// Somebody guards the bench and cannot answer.
    #[error(
        "bench `{bench}`: its directory was removed under process {process_id}, which guards it: what was asked for reached it, and \
         its answer cannot be seen; end it (`kill {process_id}` ends in the ramp to zero)"
    )]
    Unanswered {
        /// Name of the bench.
        bench: String,
        /// Its guard's process.
        process_id: u32,
    },
    /// Nobody guards the bench.
    #[error("bench `{bench}` is not running: no bridge, run or emulate --shm answers{}", others(running))]
    NotRunning {
        /// Name of the bench.
        bench: String,
        /// Those that are.
        running: Vec<String>,
    },
}

/// Who asks a bench that is not there may mean another one.
fn others(running: &[String]) -> String {
    let names: Vec<String> = running.iter().map(|name| format!("`{name}`")).collect();
    if names.is_empty() {
        String::new()
    } else {
        format!("; running: {} (name its file: --config)", names.join(", "))
    }
}

// By hand: `#[from]` would make a source of it, too, and the sentence says it already.
impl From<std::io::Error> for ProcessError {
    fn from(error: std::io::Error) -> Self {
        Self::Start(error)
    }
}

impl ProcessError {
    /// Nobody guards the bench of this name.
    pub(crate) fn not_running(bench: &str) -> Self {
        let mut running = crate::shm::running();
        running.retain(|name| name != bench);
        Self::NotRunning { bench: bench.to_owned(), running }
    }
}
