//! Where the commands come from: a controller with its reference, an open-loop experiment, or a controller with the
//! differential part of an experiment on top of it.

use super::thresholds::THRESHOLDS;
use crate::control::{AnyController, AnyState, Controller, ReferenceGenerator, ReferenceState, code};
use crate::experiment::Experiment;
use crate::signal::{Applied, Command, Sensors, StateEstimate};

/// From sensors to a command, once each period.
#[derive(Debug, Clone)]
pub struct CommandSource {
    controller: Option<(AnyController, ReferenceGenerator)>,
    experiment: Option<Experiment>,
}

/// What changes from step to step.
#[derive(Debug, Clone)]
pub struct CommandSourceState {
    controller: Option<(AnyState, ReferenceState)>,
    /// Steps made.
    sequence: u64,
    /// Steps of the experiment that the guard let through.
    passed: u64,
}

impl CommandSource {
    /// A controller and its reference.
    #[must_use]
    pub fn controller(controller: AnyController, reference: ReferenceGenerator) -> Self {
        Self { controller: Some((controller, reference)), experiment: None }
    }

    /// An experiment alone, open loop.
    #[must_use]
    pub fn experiment(experiment: Experiment) -> Self {
        Self { controller: None, experiment: Some(experiment) }
    }

    /// Adds the deviation of `experiment` to rotor 1 and takes it from rotor 2, on top of the controller.
    #[must_use]
    pub fn excited_by(self, experiment: Experiment) -> Self {
        Self { experiment: Some(experiment), ..self }
    }

    /// The state before the first step.
    #[must_use]
    pub fn start(&self) -> CommandSourceState {
        let controller = self.controller.as_ref();
        CommandSourceState {
            controller: controller.map(|(controller, reference)| (controller.start(), reference.start())),
            sequence: 0,
            passed: 0,
        }
    }

    /// One period. `applied` is what the guard let through last.
    pub fn step(&self, state: &mut CommandSourceState, sensors: &Sensors, applied: &Applied) -> Command {
        state.sequence += 1;
        if applied.command_sequence > 0 {
            state.passed += 1;
        }
        let mut command = match (&self.controller, &mut state.controller) {
            (Some((controller, reference)), Some((controller_state, reference_state))) => {
                let reference = reference.next(reference_state, applied);
                controller.step(controller_state, sensors, &reference, applied)
            }
            _ => Command {
                controller: code::EXPERIMENT,
                estimate: StateEstimate::default(),
                ..Command::default()
            },
        };
        if let Some(experiment) = &self.experiment {
            self.excite(&mut command, experiment, state.passed);
        }
        command.sequence = state.sequence;
        command.sensors_sequence = sensors.sequence;
        command
    }

    fn excite(&self, command: &mut Command, experiment: &Experiment, passed: u64) {
        // Nothing turns before the guard is open, and the experiment waits for it.
        let Some(slot) = passed.checked_sub(1) else { return };
        let beyond = slot.saturating_sub(experiment.slots() - 1);
        let left = 1.0 - (beyond as f64 * experiment.period_s() / THRESHOLDS.run_out_s).min(1.0);
        if self.controller.is_none() {
            command.rotor = experiment.command(slot).map(|level| level * left);
            return;
        }
        let deviation = if slot < experiment.lead_in() { 0.0 } else { left * experiment.deviation(slot) };
        let [first, second] = command.rotor;
        command.rotor = [(first + deviation).clamp(0.0, 1.0), (second - deviation).clamp(0.0, 1.0)];
    }

    /// Slot of the experiment that the last step commanded; `None` before and after it, and without one.
    #[must_use]
    pub fn experiment_slot(&self, state: &CommandSourceState) -> Option<u64> {
        let experiment = self.experiment.as_ref()?;
        state.passed.checked_sub(1).filter(|slot| *slot < experiment.slots())
    }

    /// Whether the experiment has run and its commands have run out.
    #[must_use]
    pub fn finished(&self, state: &CommandSourceState) -> bool {
        let end = |experiment: &Experiment| {
            experiment.slots() + (THRESHOLDS.run_out_s / experiment.period_s()).ceil() as u64
        };
        self.experiment.as_ref().is_some_and(|experiment| state.passed > end(experiment))
    }
}
