//! Is a log fit to be believed? One judgement, made once by checks that need no fit: outliers, dropouts, sample-and-hold,
//! frozen and saturated sensors, missing commands, standstill, units, copies of a log, excitation. [`ScreenedLog`] says of each
//! channel which cells are measurements, of rotors, thrusts and the body which rows are scored, and why the others are not; whoever
//! uses a log takes it from there.
//!
//! A program that reads a log and says what was found: `examples/read_log.rs`.

pub mod attitude;
mod battery;
pub(crate) mod battery_plateaus;
mod body;
pub mod channel;
pub mod channel_noise;
pub mod checks;
mod column;
pub mod duplicate_logs;
mod equal_runs;
pub mod error;
pub mod excitation;
pub mod finding;
mod left_out;
pub mod many_rotors;
pub mod missing_commands;
pub mod plausibility;
pub(crate) mod quantized_voltage;
pub mod readings;
pub mod requirements;
mod rise;
mod rotor;
pub mod rotor_data;
pub mod run_stretches;
pub mod same_bench;
pub mod screened_body;
pub mod screened_log;
pub mod screened_rotor;
pub mod screened_thrust;
pub mod summary;
pub(crate) mod suspicion;
pub mod telemetry_rate;
pub mod thresholds;
mod torque_response;

pub use channel::Judgement;
pub use error::ScreeningError;
pub use finding::{Evidence, Finding};
pub use screened_body::{DrivenBy, ScreenedBody};
pub use screened_log::{ScreenedChannel, ScreenedLog, screened};
pub use screened_rotor::ScreenedRotor;
pub use screened_thrust::ScreenedThrust;

#[cfg(test)]
pub(crate) mod tests;
