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
mod config;
mod controller;
pub mod design;
mod emc;
mod error;
mod fresh_readings;
pub mod gains;
mod parameters;
mod pid;
mod reference;
pub mod thresholds;

pub use allocate::{Allocation, Allocator};
pub use compensation::Compensation;
pub use config::{ControllerConfig, ControllerKind, EmcConfig, PidConfig};
pub use controller::{Controller, code};
pub use emc::{Emc, EmcGains, EmcState};
pub use error::ControlError;
pub use gains::{Beta, BetaRule};
pub use parameters::PlantParameters;
pub use pid::{Pid, PidState};
pub use reference::{MoveConfig, ReferenceConfig, ReferenceGenerator, ReferenceState};

pub(crate) use error::check_period;

use crate::signal::{Applied, Command, Reference, Sensors};

impl ControllerConfig {
    /// Builds the controller for a plant without known effects beyond `plant`.
    ///
    /// # Errors
    /// [`ControlError`] names the parameter, or the eigenvalue that is outside the unit circle.
    pub fn build(&self, plant: &PlantParameters, period_s: f64) -> Result<AnyController, ControlError> {
        self.build_compensated(plant, &Compensation::default(), period_s)
    }

    /// Builds the controller; what `compensation` knows is cancelled when the setting `compensate` is on. A static curve that has no
    /// inverse without its higher terms keeps them.
    ///
    /// # Errors
    /// As [`Self::build`].
    pub fn build_compensated(
        &self,
        plant: &PlantParameters,
        compensation: &Compensation,
        period_s: f64,
    ) -> Result<AnyController, ControlError> {
        let known = if self.compensate { *compensation } else { compensation.of_curve_alone(plant) };
        Ok(match self.kind {
            ControllerKind::Emc => AnyController::Emc(Emc::build(self, plant, &known, period_s)?),
            ControllerKind::Pid => AnyController::Pid(Pid::build(self, plant, &known, period_s)?),
        })
    }
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
    #[inline]
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

#[cfg(test)]
mod tests {
    use super::code;

    #[test]
    fn a_controller_is_never_called_by_the_name_of_another() {
        let codes = [code::EMC, code::PID, code::EXPERIMENT, 0, 99];
        assert_eq!(codes.map(code::name), ["EMC", "PID", "experiment", "controller 0", "controller 99"]);
    }
}
