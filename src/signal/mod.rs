//! What the rooms hand each other: what a sensor said, what a controller wants, what the guard let through.
//!
//! All are plain `repr(C)` values without pointers, so that the same bytes cross shared memory, the
//! recording and a function call.

pub(crate) mod channels;
mod command;
mod sample;
mod sensors;
mod status;
mod step;

pub use channels::{After, EmulatedRow, GuardRow, SensorRow, Shape, Shown};
pub use command::{Applied, AppliedFlags, Command, CommandFlags, Estimate, Reference, Request};
pub use sample::{Health, Sample};
pub use sensors::{Channel, Sensor, Sensors};
pub use status::{BusStatus, CycleSample, GuardEvent, Heartbeat};
pub use step::{ControlStep, GuardStep, GuardStepInputs, LockstepAnswer, LockstepStep};

/// Number of rotors on the bench; rotor 1 has index 0. See the drawing in the crate's page.
pub const ROTORS: usize = 2;
