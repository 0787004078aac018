//! The house's nouns: what a sensor said, what a controller wants, what the guard let through.
//!
//! All are plain `repr(C)` values without pointers, so that the same bytes cross shared memory, the
//! recording and a function call.

mod command;
mod sensors;
mod status;
mod step;

pub use command::{Applied, AppliedFlags, Command, CommandFlags, Estimate, Reference, Request};
pub use sensors::{Health, Sample, Sensors};
pub use status::{BusStatus, CycleSample, GuardEvent, Heartbeat};
pub use step::{ControlStep, GuardStep, GuardStepInputs, LockstepAnswer, LockstepStep};

/// Number of rotors on the bench; rotor 1 has index 0. See the drawing in the crate's page.
pub const ROTORS: usize = 2;
