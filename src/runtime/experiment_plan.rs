//! An experiment as it is asked for, and as a recording says that it was run.

use serde::{Deserialize, Serialize};

use crate::control::PlantParameters;
use crate::experiment::{ExperimentConfig, Rotors, Waveform};

/// An experiment and how it is run: written into a recording, so that it can be repeated.
///
/// Run on the emulator by [`crate::session::run_emulated`]: `examples/compare.rs`.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExperimentPlan {
    /// Whether its deviation rides on the controller; else it commands the rotors alone.
    pub closed_loop: bool,
    /// The experiment.
    pub experiment: ExperimentConfig,
}

impl ExperimentPlan {
    /// The experiment that shows most of an attitude bench in one log: a PRBS of `amplitude` [-] on rotor 1, and against it on
    /// rotor 2, on top of the running controller for `seconds` [s].
    #[must_use]
    pub fn closed_loop_prbs(amplitude: f64, seconds: f64) -> Self {
        let shape = Waveform::Prbs { amplitude, bandwidth_hz: 0.0, duration_s: seconds, seed: 1 };
        let plant = PlantParameters::paper();
        let around = plant.command_for(plant.hover_rate);
        let experiment = ExperimentConfig { shape, rotors: Rotors::Differential, around, lead_in_s: 3.0 };
        Self { closed_loop: true, experiment }
    }
}
