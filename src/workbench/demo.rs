//! The two logs of the demonstration: the emulated bench with an effect hidden in it that nobody names, recorded twice.

use std::fs;
use std::path::{Path, PathBuf};

use super::WorkbenchError;
use super::by_hand::command;
use super::places::as_typed;
use crate::bench::BenchConfig;
use crate::cancel::Cancel;
use crate::emulate::HiddenConfig;
use crate::experiment::{ExperimentConfig, Rotors, Waveform};
use crate::log::csv;
use crate::runtime::ExperimentPlan;
use crate::session::{self, Job};

/// Where they go: the folder of `demo`.
const FOLDER: &str = "rotorbench-demo";
/// What is hidden is drawn from it.
const HIDE_SEED: u64 = 44;
/// [-] distance of both levels from the operating point.
const AMPLITUDE: f64 = 0.03;
/// [s] length of each.
const DURATION_S: f64 = 20.0;
/// File, seed of the sensors' noise and of the sequence.
const LOGS: [(&str, u64); 2] = [("train.csv", 1), ("held_out.csv", 2)];

/// The logs, and the commands that make them.
#[derive(Debug, Default)]
pub(super) struct DemoLogs {
    pub logs: Vec<PathBuf>,
    pub commands: Vec<String>,
}

/// Records what is not there yet. A file that is there is taken as it is.
pub(super) fn demo_logs() -> Result<DemoLogs, WorkbenchError> {
    demo_logs_in(Path::new(FOLDER))
}

pub(super) fn demo_logs_in(folder: &Path) -> Result<DemoLogs, WorkbenchError> {
    let made = fs::create_dir_all(folder).and_then(|()| folder.canonicalize());
    let folder = made.map_err(|source| WorkbenchError::Demo { path: folder.to_owned(), source })?;
    let mut demo = DemoLogs::default();
    for (name, seed) in LOGS {
        let path = folder.join(name);
        if !path.exists() {
            record(&path, HiddenConfig::draw(HIDE_SEED, |_| true), seed, DURATION_S)?;
        }
        let words = format!(
            "experiment prbs --lockstep --closed-loop --amplitude {AMPLITUDE} --duration {DURATION_S} --hide-seed \
             {HIDE_SEED} --seed {seed} --sequence {seed} -o"
        );
        let words =
            words.split_whitespace().map(str::to_owned).chain([as_typed(&path).display().to_string()]);
        demo.commands.push(command(&words.collect::<Vec<_>>()));
        demo.logs.push(path);
    }
    Ok(demo)
}

/// Records the bench with an effect hidden in it, and writes the log.
pub(super) fn record(
    path: &Path,
    hidden: Option<HiddenConfig>,
    seed: u64,
    duration_s: f64,
) -> Result<(), WorkbenchError> {
    let mut bench = BenchConfig::default();
    bench.emulator.plant.clamped = false;
    bench.emulator.seed = seed;
    bench.emulator.hidden.extend(hidden);
    let experiment = ExperimentConfig {
        shape: Waveform::Prbs { amplitude: AMPLITUDE, bandwidth_hz: 0.0, duration_s, seed },
        rotors: Rotors::Differential,
        around: 0.4633,
        lead_in_s: 3.0,
    };
    let plan = ExperimentPlan { closed_loop: true, experiment };
    let log = session::run_emulated(&bench, &plan, "experiment", &Job::unwatched(&Cancel::default()))?;
    Ok(csv::write(log.raw(), path)?)
}
