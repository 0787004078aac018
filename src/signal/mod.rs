//! What the rooms hand each other: what a sensor said, what a controller wants, what the guard let through.
//!
//! All are plain `repr(C)` values without pointers, so that the same bytes cross shared memory, the
//! recording and a function call.

pub(crate) mod channels;
pub mod columns;
mod command;
mod sample;
mod sensors;
mod status;
mod step;

pub use channels::{After, EmulatedRow, GuardRow, MonitorRow, Multiplicity, SensorRow};
pub use command::{Applied, AppliedFlags, Command, CommandFlags, Reference, Request, StateEstimate};
pub use sample::{Health, Sample};
pub use sensors::{Channel, Sensor, Sensors};
pub use status::{BusStatus, CycleSample, GuardEvent, Heartbeat};
pub use step::{ControlStep, GuardStep, GuardStepInputs, LockstepAnswer, LockstepStep};

/// Number of rotors on the bench; rotor 1 has index 0. See the drawing in the crate's page.
pub const ROTORS: usize = 2;

/// [-] which way rotor `rotor`, from 0, turns the body of an attitude bench; 0 of those that the bench has not got.
#[must_use]
pub fn side(rotor: usize) -> f64 {
    match rotor {
        0 => 1.0,
        1 => -1.0,
        _ => 0.0,
    }
}
