//! What a controller is to the loop.

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
