//! Controllers: EMC and PID, their design, and allocation to two rotors.
//!
//! Configuration, state and step are apart: [`ControllerConfig`] is what people write, [`Emc`] and [`Pid`]
//! are built and do not change, their states change. A step cannot fail, allocates nothing and reads no clock.
//!
//! While the guard lets nothing through (`Applied::command_sequence == 0`) a controller rests: angle at the
//! reference, no disturbance, no integral. So a bench that lay disarmed for an hour, its gyro drifting, does
//! not jump when it is armed.
//!
//! A controller of one's own, in lockstep: `examples/own_controller.rs`.

mod allocate;
mod compensation;
pub mod design;
mod emc;
pub mod gains;
mod intake;
mod parameters;
mod pid;
mod reference;
pub mod thresholds;

use serde::{Deserialize, Serialize};

pub use allocate::{Allocation, Allocator};
pub use compensation::Compensation;
pub use emc::{Emc, EmcConfig, EmcGains, EmcState};
pub use gains::{Beta, BetaRule};
pub use parameters::PlantParameters;
pub use pid::{Pid, PidConfig, PidState};
pub use reference::{MoveConfig, ReferenceConfig, ReferenceGenerator, ReferenceState};

use crate::signal::{Applied, Command, Reference, Sensors};

/// Codes of [`Command::controller`].
pub mod code {
    /// Embedded Model Control.
    pub const EMC: u32 = 1;
    /// PID.
    pub const PID: u32 = 2;
    /// Open-loop experiment.
    pub const EXPERIMENT: u32 = 3;

    /// What tables call it: a controller of a code that is not known here, as a recording of another version may hold, by the code.
    #[must_use]
    pub fn name(code: u32) -> String {
        match code {
            EMC => "EMC".to_owned(),
            PID => "PID".to_owned(),
            EXPERIMENT => "experiment".to_owned(),
            other => format!("controller {other}"),
        }
    }
}

/// Which controller runs.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ControllerKind {
    /// Embedded Model Control, [LPC16] section IV.A.
    #[default]
    Emc,
    /// PID, [LPC16] section IV.B.
    Pid,
}

/// The `[controller]` table of the bench file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ControllerConfig {
    /// Which controller runs.
    pub kind: ControllerKind,
    /// Settings of EMC.
    pub emc: EmcConfig,
    /// Settings of PID.
    pub pid: PidConfig,
    /// What the angle should do.
    pub reference: ReferenceConfig,
    /// Correct the integrated angle slowly by `Sensors::body_angle`, where the bench measures it. Off: the angle
    /// is the integral of the gyro, as in [LPC16], and a gyro bias walks it away.
    pub use_body_angle: bool,
    /// Cancel what the model's effects say, where a controller can (see [`Compensation`]).
    pub compensate: bool,
}

impl Default for ControllerConfig {
    fn default() -> Self {
        Self {
            kind: ControllerKind::default(),
            emc: EmcConfig::default(),
            pid: PidConfig::default(),
            reference: ReferenceConfig::default(),
            use_body_angle: false,
            compensate: true,
        }
    }
}

impl ControllerConfig {
    /// EMC as [LPC16] Table II has it: β = γ_0 = 0.276 at T_c = 0.02 s.
    #[must_use]
    pub fn paper() -> Self {
        Self { emc: EmcConfig { beta: Beta::Value(0.276), ..EmcConfig::default() }, ..Self::default() }
    }

    /// Builds the controller for a plant without known effects beyond `plant`.
    ///
    /// # Errors
    /// [`ControlError`] names the parameter, or the eigenvalue that is outside the unit circle.
    pub fn build(&self, plant: &PlantParameters, period_s: f64) -> Result<AnyController, ControlError> {
        self.build_compensated(plant, &Compensation::default(), period_s)
    }

    /// Builds the controller; what `compensation` knows is cancelled when the setting `compensate` is on.
    ///
    /// # Errors
    /// As [`Self::build`].
    pub fn build_compensated(
        &self,
        plant: &PlantParameters,
        compensation: &Compensation,
        period_s: f64,
    ) -> Result<AnyController, ControlError> {
        let known = if self.compensate { *compensation } else { Compensation::default() };
        Ok(match self.kind {
            ControllerKind::Emc => AnyController::Emc(Emc::build(self, plant, &known, period_s)?),
            ControllerKind::Pid => AnyController::Pid(Pid::build(self, plant, &known, period_s)?),
        })
    }
}

/// Why a controller cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ControlError {
    /// A number that no controller can be built on.
    #[error("{name} is {}: it {rule}", crate::unit::short(*value))]
    Parameter {
        /// Name of the parameter in the file.
        name: &'static str,
        /// Value found, in SI.
        value: f64,
        /// What it has to be.
        rule: &'static str,
    },
    /// A move of the reference that cannot be made.
    #[error(
        "reference move {index} at {at_s} s must consist of numbers, last at least 0 s and begin at or after {free_from_s} s"
    )]
    Move {
        /// Position in the list, from 0.
        index: usize,
        /// [s] when it should begin.
        at_s: f64,
        /// [s] when the move before it ends.
        free_from_s: f64,
    },
    /// Margins that no PID has on this plant.
    #[error(
        "no PID has a phase margin of {phase_margin_deg:.0}° and a gain margin of {gain_margin:.2} on this plant"
    )]
    Unreachable {
        /// [°] asked for.
        phase_margin_deg: f64,
        /// [-] asked for.
        gain_margin: f64,
    },
    /// A design with an eigenvalue on or outside the unit circle.
    #[error(
        "the {what} is unstable: eigenvalue {real:.4}{imaginary:+.4}i has modulus {modulus:.4}, not below 1"
    )]
    Unstable {
        /// Which matrix.
        what: &'static str,
        /// Real part of the worst eigenvalue.
        real: f64,
        /// Imaginary part.
        imaginary: f64,
        /// Its modulus.
        modulus: f64,
    },
}

/// A controller: from what was measured, what is wanted and what the rotors got, to the next command.
///
/// `step` is called once each period. `Command::stamp_ns` is left 0 for the process to fill in.
///
/// One of your own, run in lockstep: `examples/own_controller.rs`.
pub trait Controller {
    /// What changes from step to step.
    type State;

    /// The state before the first step: at rest at the reference's first angle.
    fn start(&self) -> Self::State;

    /// One period.
    fn step(
        &self,
        state: &mut Self::State,
        sensors: &Sensors,
        reference: &Reference,
        applied: &Applied,
    ) -> Command;
}

/// The controller that the bench file names.
#[derive(Debug, Clone, PartialEq)]
pub enum AnyController {
    /// Embedded Model Control.
    Emc(Emc),
    /// PID.
    Pid(Pid),
}

/// State of an [`AnyController`].
#[derive(Debug, Clone, PartialEq)]
pub enum AnyState {
    /// Of EMC.
    Emc(EmcState),
    /// Of PID.
    Pid(PidState),
}

impl Controller for AnyController {
    type State = AnyState;

    fn start(&self) -> AnyState {
        match self {
            Self::Emc(emc) => AnyState::Emc(emc.start()),
            Self::Pid(pid) => AnyState::Pid(pid.start()),
        }
    }

    /// One period. The state of the other controller is replaced by a fresh one.
    fn step(
        &self,
        state: &mut AnyState,
        sensors: &Sensors,
        reference: &Reference,
        applied: &Applied,
    ) -> Command {
        match (self, &mut *state) {
            (Self::Emc(emc), AnyState::Emc(own)) => emc.step(own, sensors, reference, applied),
            (Self::Pid(pid), AnyState::Pid(own)) => pid.step(own, sensors, reference, applied),
            (Self::Emc(emc), AnyState::Pid(_)) => {
                let mut own = emc.start();
                let command = emc.step(&mut own, sensors, reference, applied);
                *state = AnyState::Emc(own);
                command
            }
            (Self::Pid(pid), AnyState::Emc(_)) => {
                let mut own = pid.start();
                let command = pid.step(&mut own, sensors, reference, applied);
                *state = AnyState::Pid(own);
                command
            }
        }
    }
}

/// Refuses a period that is not a positive number of seconds.
pub(crate) fn check_period(period_s: f64) -> Result<(), ControlError> {
    let holds = period_s.is_finite() && period_s > 0.0;
    require(holds, "period_s", period_s, "must be a positive number of seconds")
}

/// Refuses the parameter `name` unless what its rule says holds.
fn require(holds: bool, name: &'static str, value: f64, rule: &'static str) -> Result<(), ControlError> {
    if holds { Ok(()) } else { Err(ControlError::Parameter { name, value, rule }) }
}

fn require_finite(name: &'static str, value: f64) -> Result<(), ControlError> {
    require(value.is_finite(), name, value, "must be a number")
}

fn require_positive(name: &'static str, value: f64) -> Result<(), ControlError> {
    require(value.is_finite() && value > 0.0, name, value, "must be a positive number")
}

fn require_not_negative(name: &'static str, value: f64) -> Result<(), ControlError> {
    require(value.is_finite() && value >= 0.0, name, value, "must be zero or a positive number")
}

#[cfg(test)]
mod tests {
    use super::code;

    #[test]
    fn a_controller_is_never_called_by_the_name_of_another() {
        let codes = [code::EMC, code::PID, code::EXPERIMENT, 0, 4];
        assert_eq!(codes.map(code::name), ["EMC", "PID", "experiment", "controller 0", "controller 4"]);
    }
}
