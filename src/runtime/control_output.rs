//! What a controller or an experiment puts out: the commands, what they were made from, and how well the angle is held.

use serde::Serialize;

use super::ProcessError;
use super::command_source::{CommandSource, CommandSourceState};
use crate::shm::{BenchMember, COMMAND, CONTROL_STEPS, Publisher};
use crate::signal::{Applied, Command, ControlStep, Sensors};

/// A command source at work on a bench.
#[derive(Debug)]
pub struct ControlOutput {
    source: CommandSource,
    state: CommandSourceState,
    commands: Publisher<Command>,
    steps: Publisher<ControlStep>,
    angle: AngleError,
}

impl ControlOutput {
    /// Takes the bench's controls: from now on nobody else can.
    ///
    /// # Errors
    /// [`crate::shm::ShmError::Claimed`] when the bench has a controller.
    pub fn open(bench: &BenchMember, source: CommandSource) -> Result<Self, ProcessError> {
        Ok(Self {
            state: source.start(),
            source,
            commands: bench.publish(&COMMAND)?,
            steps: bench.publish(&CONTROL_STEPS)?,
            angle: AngleError::default(),
        })
    }

    /// One step of the command source; the command is stamped with `now_ns` and not published yet.
    pub fn step(&mut self, now_ns: u64, sensors: &Sensors, applied: &Applied) -> Command {
        let mut command = self.source.step(&mut self.state, sensors, applied);
        command.stamp_ns = now_ns;
        command
    }

    /// Forgets every step, as a new process would.
    pub fn restart(&mut self) {
        self.state = self.source.start();
        self.angle = AngleError::default();
    }

    /// Publishes a step, [`ControlOutput::record`] included: the command, and all it was made from.
    pub fn publish(&mut self, sensors: &Sensors, applied: &Applied, command: &Command) {
        self.command(command);
        self.record(sensors, applied, command);
    }

    /// Publishes a command.
    pub fn command(&mut self, command: &Command) {
        self.commands.send(command);
    }

    /// Publishes what a command was made from, for the recorder, and counts how well the angle was held.
    pub fn record(&mut self, sensors: &Sensors, applied: &Applied, command: &Command) {
        self.angle.see(sensors, applied, command);
        let (sensors, applied, command) = (*sensors, *applied, *command);
        self.steps.send(&ControlStep { sensors, applied, command });
    }

    /// How well the angle was held so far.
    #[must_use]
    pub fn angle(&self) -> AngleError {
        self.angle
    }

    /// Whether an experiment has run to its end.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        self.source.finished(&self.state)
    }
}

/// How far the angle was from its reference while the guard was open.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct AngleError {
    /// Periods counted.
    pub count: u64,
    /// Whether the angle was measured at the pivot in all of them; else it is the controller's own estimate.
    pub measured: bool,
    #[serde(skip)]
    sum_of_squares: f64,
    /// [rad] root of the mean square.
    pub rms: f64,
    /// [rad] greatest error.
    pub greatest: f64,
    /// [rad] error of the last period.
    pub last: f64,
}

impl AngleError {
    /// Takes in a step of a controller, with what it consumed; counts only while the guard is open.
    pub fn see(&mut self, sensors: &Sensors, applied: &Applied, command: &Command) {
        if applied.command_sequence > 0 {
            let measured = sensors.body_angle.is_good().then_some(sensors.body_angle.value);
            self.add(command.estimate.reference_angle, measured, command.estimate.body_angle);
        }
    }

    /// One more period: what was asked for and what it was, measured where it could be.
    fn add(&mut self, reference: f64, measured: Option<f64>, estimated: f64) {
        self.measured = measured.is_some() && (self.measured || self.count == 0);
        self.count += 1;
        self.last = measured.unwrap_or(estimated) - reference;
        self.sum_of_squares += self.last * self.last;
        self.rms = (self.sum_of_squares / self.count as f64).sqrt();
        self.greatest = self.greatest.max(self.last.abs());
    }
}
